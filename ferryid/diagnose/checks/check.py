"""What a check of the sensors is, and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats


@dataclass(frozen=True)
class SensorFinding:
    """An error of the sensors.

    Attributes
    ----------
    effect
        Its id in results.
    parameters
        By name, with 95 % intervals.
    says
        One sentence in plain words.
    correct
        Returns the measurements without the error.
    evidence
        Columns for the figure that shows it: name to values.
    """

    effect: str
    parameters: Mapping[str, Estimate]
    says: str
    correct: Callable[[Measurements], Measurements]
    evidence: Mapping[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True)
class Check:
    """One check.

    Attributes
    ----------
    id, title
        Name in results, and for people.
    find
        Returns what is wrong with measurements, None where nothing is, or where the measurements cannot tell.
    place
        Checks act in ascending order, each on what those before it corrected.
    estimate
        Returns the error's parameters however small it is, as `find` would estimate them; empty where the measurements show
        none. None of checks whose errors have no size below what is found.
    """

    id: str
    title: str
    find: Callable[[Measurements], SensorFinding | None]
    place: int
    estimate: Callable[[Measurements], Mapping[str, Estimate]] | None = None
