"""Diagnosis of missing physics: what a model left out of a recording, and what shows it."""

from ferryid.diagnose.data.course import Course, MeasuredCourse
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.data.measurements import check_withheld
from ferryid.diagnose.inference.group_differences import GROUPS
from ferryid.diagnose.judging.diagnosis import (
    SCHEMA,
    Diagnosis,
    Withheld,
    copies_as_json,
    finding_as_json,
    parts_as_json,
    to_json,
    unused_as_json,
)
from ferryid.diagnose.judging.difference import Difference
from ferryid.diagnose.judging.error_profiles import Profiled
from ferryid.diagnose.judging.finding import UNKNOWN, Finding
from ferryid.diagnose.judging.likeness import Likeness, Pair, likeness_as_json, separation
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.diagnose.judging.verdict import campaign_verdict, error_ratio, worse_axes
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose, diagnose_and_store
from ferryid.diagnose.same_vessel import find_other_vessels
from ferryid.diagnose.second_sources import Comparison, SecondSources
from ferryid.diagnose.versus import Versus, compare_groups, versus_json

__all__ = [
    "GROUPS",
    "JUDGING",
    "SCHEMA",
    "UNKNOWN",
    "Comparison",
    "Course",
    "Diagnosis",
    "DiagnosisSettings",
    "Difference",
    "Estimate",
    "Finding",
    "Likeness",
    "MeasuredCourse",
    "Pair",
    "Profiled",
    "SecondSources",
    "Versus",
    "Withheld",
    "campaign_verdict",
    "check_withheld",
    "compare_groups",
    "copies_as_json",
    "diagnose",
    "diagnose_and_store",
    "error_ratio",
    "find_other_vessels",
    "finding_as_json",
    "likeness_as_json",
    "parts_as_json",
    "separation",
    "to_json",
    "unused_as_json",
    "versus_json",
    "worse_axes",
]
