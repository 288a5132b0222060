"""Which effects the sensors of a profile can distinguish, on a simulated trial of its vessel: no log is needed."""

from ferryid.identifiability.report import as_json, as_text
from ferryid.identifiability.sensors import SENSORS
from ferryid.identifiability.study import Study, study

__all__ = ["SENSORS", "Study", "as_json", "as_text", "study"]
