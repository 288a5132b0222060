"""Whether what was selected stands: held-out tests, rivals, confidence rules, and the verdict."""

from ferryid.diagnose.judging.confidence_rules import RULES, ConfidenceRule
from ferryid.diagnose.judging.diagnosis import SCHEMA, Diagnosis, to_json
from ferryid.diagnose.judging.finding import UNKNOWN, Finding
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
    "Finding",
    "Remainder",
    "campaign_verdict",
    "to_json",
    "verdict_of",
]
