"""Sensor errors that are known to be there, estimated from kinematics alone: the regressions of the checks, without thresholds.

The estimates themselves stand with the effects of the plant: `ferryid.validation.plant.effects`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from scipy.stats import norm
from scipy.stats import t as student

from ferryid.diagnose import Estimate
from ferryid.diagnose.checks.kinematics import NEUTRAL, Kinematics
from ferryid.effects.force_model import Measurements


@dataclass(frozen=True)
class SensorEstimate:
    """The estimate of an error of the sensors from kinematics.

    Attributes
    ----------
    gain
        Half of the squared deviate of a normal variable that is as rare as the estimate: the logarithm of a likelihood ratio.
        0 where the log has too little for an estimate.
    free
        How many parameters it has.
    parameters
        By name, with 95 % intervals.
    correct
        Returns the measurements without the error.
    idle
        True where the error is below the least size that a diagnosis names.
    """

    gain: float
    free: int
    parameters: Mapping[str, Estimate] = field(default_factory=dict)
    correct: Callable[[Measurements], Measurements] = lambda measurements: measurements
    idle: bool = False


def kinematic_gain(found: Kinematics, index: int) -> float:
    """Return the gain of one parameter of a kinematic regression."""
    return gain_of_score(found.solution.score(index, float(NEUTRAL[index])), found.solution.freedom)


def gain_of_score(score: float, freedom: int) -> float:
    """Return the gain of an estimate that is so many standard errors off its neutral value."""
    return 0.5 * float(norm.isf(max(student.sf(score, freedom), 1e-300))) ** 2 if score > 0.0 else 0.0
