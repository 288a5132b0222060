"""Whether what was selected stands: held-out tests, rivals, confidence rules, and the verdict."""

from ferryid.diagnose.judging.confidence_rules import RULES, ConfidenceRule
from ferryid.diagnose.judging.diagnosis import SCHEMA, Diagnosis, to_json
from ferryid.diagnose.judging.finding import UNKNOWN, Finding
from ferryid.diagnose.judging.least_sizes import LeastSize
from ferryid.diagnose.judging.likeness import EffectVisibility, Likeness, Pair, likeness, likeness_as_json, separation
from ferryid.diagnose.judging.responses import Key, Responses, candidates_of, response_columns, responses, together
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.diagnose.judging.verdict import VERDICTS, Remainder, campaign_verdict, verdict_of

__all__ = [
    "JUDGING",
    "RULES",
    "SCHEMA",
    "UNKNOWN",
    "VERDICTS",
    "ConfidenceRule",
    "Diagnosis",
    "EffectVisibility",
    "Finding",
    "Key",
    "LeastSize",
    "Likeness",
    "Pair",
    "Remainder",
    "Responses",
    "campaign_verdict",
    "candidates_of",
    "likeness",
    "likeness_as_json",
    "response_columns",
    "responses",
    "separation",
    "to_json",
    "together",
    "verdict_of",
]
