"""What is measured from a log."""

from ferryid.diagnose.data.course import Course, MeasuredCourse
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.data.measurements import (
    MeasuredLog,
    Survey,
    check_withheld,
    measure_log,
    read_measurements,
    window_lengths,
)

__all__ = [
    "Course",
    "Estimate",
    "MeasuredCourse",
    "MeasuredLog",
    "Survey",
    "check_withheld",
    "measure_log",
    "read_measurements",
    "window_lengths",
]
