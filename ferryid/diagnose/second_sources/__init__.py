"""What else is in a log: topics that the profile does not map, beside the mapped signals of their kind."""

from ferryid.diagnose.second_sources.comparison import Comparison, Difference
from ferryid.diagnose.second_sources.sources import SecondSources, compare_second_sources
from ferryid.diagnose.second_sources.witnesses import Witness

__all__ = ["Comparison", "Difference", "SecondSources", "Witness", "compare_second_sources"]
