"""Yaw-rate scale: the gyro's rate against the heading's, in the weak form ``∫ w' psi = -∫ w r``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.checks.kinematics import OUTLIER
from ferryid.diagnose.checks.regression import Solution, step
from ferryid.diagnose.checks.spans import Spans, spans
from ferryid.effects.picture import Scene
from ferryid.vessel.profile import Floats

LEAST = 0.02
SLOW_RADPS = 0.003
"""Below this root mean square of the rate, heading and rate are compared in vain."""
NEUTRAL, SIZE = np.array([1.0, 0.0, 0.0]), np.array([2.0, 0.1, 2.0])
"""Factor, bias [rad/s] and delay [s] of a right gyro, and how large they may be."""


def find(scene: Scene) -> SensorFinding | None:
    """Return the factor of the yaw rate, measured over true.

    A bias and a delay of the gyro are solved for along with it. Noise of the heading makes the factor of a regression on the
    heading too small, noise of the rate that of the other regression too large: the truth lies between.
    """
    trial, both = spans(scene, np.column_stack([scene.psi, scene.nu_raw[:, 2]]))
    if len(trial.starts) < 8:
        return None
    rate, bend, measured = trial.rate(both[:, 0]), trial.curvature(both[:, 0]), trial.mean(both[:, 1])
    if np.std(rate) < SLOW_RADPS:
        return None
    J = -np.column_stack([rate, np.ones_like(rate), -bend])
    first = _step(J, J, measured, trial)
    if first is None:
        return None
    left = np.abs(measured + J @ first.values)
    kept = left <= OUTLIER * max(float(np.median(left)), 1e-9)
    trial, J, rate, measured = trial.only(kept), J[kept], rate[kept], measured[kept]
    solved = _step(J, J, measured, trial)
    Z = np.column_stack([-measured, J[:, 1:]])
    other = _step(Z, J, measured, trial)
    if solved is None or other is None:
        return None
    off, rival = float(solved.values[0]) - 1.0, float(other.values[0]) - 1.0
    if min(abs(off), abs(rival)) < LEAST or off * rival < 0.0 or not solved.certain(0, 1.0):
        return None
    factor = solved.estimate(0, "-")
    scale = np.array([1.0, 1.0, factor.value])

    def correct(seen: Scene) -> Scene:
        return replace(seen, nu_raw=seen.nu_raw / scale, nu=seen.nu / scale)

    sign = " with its sign turned round," if factor.value < 0.0 else ""
    return SensorFinding(
        "yaw_rate_scale",
        {"factor": factor},
        f"The yaw rate measured is{sign} {abs(factor.value):.3f} times that of the heading.",
        correct,
        {"time_s": trial.middle_s, "heading_rate_radps": rate, "yaw_rate_radps": measured},
    )


def _step(Z: Floats, J: Floats, measured: Floats, trial: Spans) -> Solution | None:
    return step(Z[:, None, :], J[:, None, :], measured[:, None], trial.place, SIZE, -NEUTRAL)


CHECK = Check("yaw_rate_scale", "Yaw rate against heading", find, place=20)
