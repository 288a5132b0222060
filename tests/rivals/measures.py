"""Measures of ferryid's default that the tables of the page and the causes of what it misses share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ferryid.types import Floats
from tests.rivals.recorded import Recorded
from tests.rivals.scatter import Ratio, ratio_of_medians
from tests.rivals.scores import HORIZONS_S, Score
from tests.rivals.simulated import Found

OURS = "ferryid auto"
LAST = len(HORIZONS_S) - 1
POSITION, HEADING = 0, 1
MOST_DAMPING = 5.0
"""Error of the damping force that is aimed at [%]."""
Trials = Mapping[str, Sequence[Mapping[str, Found | str]]]
"""What the methods found in the trials of every kind, by its name."""


def inertias_covered(found: Trials) -> Floats:
    """Return whether the 95 % intervals of m11, m22 and m33 hold the truth, 1 or 0, NaN without one, shape (trials, 3)."""
    return np.array([one[OURS].covered for trials in found.values() for one in trials if isinstance(one[OURS], Found)])


def expected(found: Sequence[Mapping[str, Found | str]]) -> float:
    """Return the median error of the damping force that is to be expected [%]; see `Found`."""
    own = [one[OURS].expected for one in found if isinstance(one[OURS], Found)]
    return 100.0 * float(np.nanmedian(own)) if own else float("nan")


def position_ratio(one: Recorded, name: str) -> Ratio | None:
    """Return ours over another's median position error at the last horizon; None where it has no model."""
    return ratio_of(one.scores[OURS], one.scores[name])


def ratio_of(ours: Score, theirs: Score) -> Ratio | None:
    """Return the ratio of the median position errors of two methods at the last horizon; None where the second has no model."""
    return None if theirs.failed else ratio_of_medians(ours.runs[:, LAST, POSITION], theirs.runs[:, LAST, POSITION])
