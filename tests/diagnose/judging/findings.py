"""Findings made by hand."""

from __future__ import annotations

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.judging.finding import Finding

SOME = {"value": Estimate(1.0, 0.8, 1.2, "-")}


def found(effect: str, probability: float = 0.99, **improvement: float) -> Finding:
    """A finding that removes so much of the squared error on some axes."""
    return Finding(
        effect=effect,
        instance="thruster1" if effect == "thruster_gain" else None,
        probability=probability,
        parameters=SOME,
        axes={},
        intervals=(),
        improvement=improvement,
        held_out=True,
        unresolved_with=("current",),
        separating_manoeuvre="a slow turn",
        says="It is there.",
    )
