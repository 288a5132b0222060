"""What a rival method learns from a log: names of physics, and a prediction for any other log."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ferryid.models.prediction import Prediction
from ferryid.signals.prepare import Prepared
from ferryid.validation.records import RivalName
from ferryid.vessel.profile import Profile

WINDOW_S = 1.0
"""Smoothing window of every learner, the thesis's [s]."""
SMOOTHER = "square"
"""Its moving average."""


@dataclass(frozen=True)
class LearnedModel:
    """What a rival made of one log.

    Attributes
    ----------
    rival
        Which one.
    predict
        What it expects of a log, the one that it learnt from or another.
    names
        The physics that it names, the one that removes most first; none where its terms have no meaning of their own.
    coefficients
        Of its terms by label, in the units of the terms.
    """

    rival: str
    predict: Callable[[Prepared], Prediction]
    names: tuple[RivalName, ...] = ()
    coefficients: Mapping[str, float] = field(default_factory=dict)


Learner = Callable[[str, Profile, Path], LearnedModel]
"""``learn(log, profile, out)``: path of the log, the vessel, and the folder whose ``logs`` keep the ingested tables."""
