"""What kinematics alone tell of an error of the sensors that is known to be there: the checks' regressions, no threshold."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import degrees, log, radians

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from ferryid.diagnose import Estimate
from ferryid.diagnose.checks import azimuth_resolution, heading_bias, velocity_scale, yaw_rate_scale
from ferryid.diagnose.checks.azimuth_resolution import corrected as straightened
from ferryid.diagnose.checks.azimuth_resolution import error_of, estimate, off_grid, step_of
from ferryid.diagnose.checks.kinematics import ANGLE, NEUTRAL, SCALE, Kinematics, X, Y, kinematics
from ferryid.diagnose.checks.lever_arm import least_m
from ferryid.diagnose.checks.yaw_rate_scale import compared
from ferryid.diagnose.checks.yaw_rate_scale import corrected as rescaled
from ferryid.effects.force_model import Measurements as Scene
from ferryid.vessel.frames import to_world

CHANCE = 0.02
"""Share of the readings of an angle that is not rounded which are within a hundredth of a step off any grid."""
STRAIGHT = 1e-12
"""Least share of readings off a grid that is believed, so that logarithms stay finite."""


@dataclass(frozen=True)
class Sensed:
    """What kinematics tell of an error of the sensors.

    Attributes
    ----------
    gain
        Half of the squared deviate of a normal variable that is as rare as the estimate: the logarithm of a likelihood ratio.
    free
        How many parameters it has.
    parameters
        By name, with 95 % intervals.
    correct
        Returns the scene without the error.
    idle
        True where the error is smaller than a diagnosis finds worth a name.
    """

    gain: float
    free: int
    parameters: Mapping[str, Estimate] = field(default_factory=dict)
    correct: Callable[[Scene], Scene] = lambda scene: scene
    idle: bool = False


def sensed(scene: Scene, effect: str) -> Sensed:
    """Return what kinematics tell of an error of the sensors; a gain of 0 where the scene has too little to tell.

    Parameters
    ----------
    scene
        As measured.
    effect
        One of `SENSED`.
    """
    return SENSED[effect](scene)


def _yaw_rate_scale(scene: Scene) -> Sensed:
    rates = compared(scene)
    if rates is None:
        return Sensed(0.0, 1)
    score = rates.off / max(float(rates.solution.errors[0]), 1e-300)
    factor = rates.solution.estimate(0, "-")
    return Sensed(
        _gain(score, rates.solution.freedom),
        1,
        {"factor": factor},
        lambda seen: rescaled(seen, factor.value),
        rates.off < yaw_rate_scale.LEAST,
    )


def _azimuth_resolution(scene: Scene) -> Sensed:
    """Return the step of the coarsest angle; the gain is that of its readings' being on a grid over being anywhere."""
    steps = [step_of(angle) for angle in scene.angles.T]
    step = max(steps, default=0.0)
    if step == 0.0:
        return Sensed(0.0, 1)
    readings = np.degrees(np.unique(np.round(scene.angles[:, steps.index(step)], 9)))
    off = off_grid(readings, step)
    count, near = len(readings), int(np.count_nonzero(off < 0.5 * CHANCE * step))
    share = min(max(near / count, CHANCE), 1.0 - STRAIGHT)
    gain = near * log(share / CHANCE) + (count - near) * log((1.0 - share) / (1.0 - CHANCE))
    idle = error_of(step) < azimuth_resolution.LEAST
    return Sensed(gain, 1, {"step": estimate(step)}, lambda seen: straightened(seen, steps), idle)


def _velocity_scale(scene: Scene) -> Sensed:
    found = kinematics(scene, (SCALE,))
    if found is None:
        return Sensed(0.0, 1)
    factor = found.solution.estimate(SCALE, "-")
    scale = np.array([factor.value, factor.value, 1.0])
    return Sensed(
        _compared(found, SCALE),
        1,
        {"factor": factor},
        lambda seen: replace(seen, nu_raw=seen.nu_raw / scale, nu=seen.nu / scale),
        abs(factor.value - 1.0) < velocity_scale.LEAST,
    )


def _heading_bias(scene: Scene) -> Sensed:
    found = kinematics(scene, (ANGLE,))
    if found is None:
        return Sensed(0.0, 1)
    bias = np.array([0.0, 0.0, float(found.solution.values[ANGLE])])
    return Sensed(
        _compared(found, ANGLE),
        1,
        {"angle": found.solution.estimate(ANGLE, "deg", degrees(1.0))},
        lambda seen: replace(seen, eta=seen.eta - bias),
        abs(bias[2]) < radians(heading_bias.LEAST_DEG),
    )


def _lever_arm(scene: Scene) -> Sensed:
    found = kinematics(scene, (X, Y))
    if found is None:
        return Sensed(0.0, 2)
    x, y = found.solution.estimate(X, "m"), found.solution.estimate(Y, "m")

    def correct(seen: Scene) -> Scene:
        one = np.ones(len(seen.t))
        arm = np.column_stack([*to_world(x.value * one, y.value * one, seen.psi), 0.0 * one])
        return replace(seen, eta=seen.eta - arm)

    # The two are told by turns of their own, so that their errors hardly go together.
    idle = max(abs(x.value), abs(y.value)) < least_m(scene)
    return Sensed(_compared(found, X) + _compared(found, Y), 2, {"x": x, "y": y}, correct, idle)


SENSED: Mapping[str, Callable[[Scene], Sensed]] = {
    "yaw_rate_scale": _yaw_rate_scale,
    "azimuth_resolution": _azimuth_resolution,
    "velocity_scale": _velocity_scale,
    "heading_bias": _heading_bias,
    "lever_arm": _lever_arm,
}
"""By effect: what kinematics tell of it."""


def _compared(found: Kinematics, index: int) -> float:
    return _gain(found.solution.score(index, float(NEUTRAL[index])), found.solution.freedom)


def _gain(score: float, freedom: int) -> float:
    """Return the gain of an estimate that is so many standard errors off its neutral value."""
    return 0.5 * float(norm.isf(max(student.sf(score, freedom), 1e-300))) ** 2 if score > 0.0 else 0.0
