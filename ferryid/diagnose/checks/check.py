"""What a check of the sensors is, and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats
from ferryid.vessel.profile import Profile, Signal


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
    probability
        That it is so.
    vessel
        True for what all logs of a campaign show together: see `ferryid.diagnose.checks.pooling`.
    doubt
        Why it is not credible beside other logs, as the end of a sentence; empty where it is.
    intervals
        When it acts, as (first, last) [s]; empty where it acts throughout.
    """

    effect: str
    parameters: Mapping[str, Estimate]
    says: str
    correct: Callable[[Measurements], Measurements]
    evidence: Mapping[str, Floats] = field(default_factory=dict)
    probability: float = 1.0
    vessel: bool = False
    doubt: str = ""
    intervals: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Lasting:
    """What is known of an error that a sensor keeps from log to log, so that logs of a campaign can be pooled.

    Attributes
    ----------
    neutral
        Value of each parameter without the error.
    size
        Standard deviation of what a parameter may be, in its unit.
    least
        Returns how far a parameter has to be from neutral to be worth a name.
    says
        Returns the finding as a sentence, of values by name.
    corrected
        Returns measurements without an error of these values.
    of_instrument
        True where the instrument or its mounting has the error, so that it is the same in all logs; a clock may be set anew.
    """

    neutral: float
    size: float
    least: Callable[[Measurements], float]
    says: Callable[[Mapping[str, float]], str]
    corrected: Callable[[Measurements, Mapping[str, float]], Measurements]
    of_instrument: bool = True


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
    lasting
        Of errors that a sensor keeps; None of events.
    in_profile
        ``in_profile(profile, values)`` returns the line of the profile that corrects an error of these values in every log, and
        under which heading; empty where the signal map cannot.
    hidden
        ``hidden(profile)`` is True where what the profile maps never shows the error, so that an estimate of none says nothing.
    """

    id: str
    title: str
    find: Callable[[Measurements], SensorFinding | None]
    place: int
    estimate: Callable[[Measurements], Mapping[str, Estimate]] | None = None
    lasting: Lasting | None = None
    in_profile: Callable[[Profile, Mapping[str, float]], str] = lambda profile, values: ""
    hidden: Callable[[Profile], bool] = lambda profile: False


def mapped(profile: Profile, quantity: str) -> Signal | None:
    """Return the signal of a profile that gives a quantity; None where it has none."""
    return next((one for one in profile.signals if one.quantity == quantity), None)


def rescaled(profile: Profile, quantity: str, factor: float) -> str:
    """Return the line of the profile that divides a signal by a positive factor; empty without such a signal."""
    signal = mapped(profile, quantity)
    if signal is None or factor <= 0.0:
        return ""
    return f"scale = {signal.scale / factor:.4g} in [signals.{quantity}]"
