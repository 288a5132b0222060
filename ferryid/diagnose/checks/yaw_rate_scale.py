"""Yaw-rate scale: the gyro's rate against the heading's, in the weak form ``∫ w' psi = -∫ w r``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.checks.kinematics import OUTLIER
from ferryid.diagnose.checks.regression import BLOCK_S, step
from ferryid.diagnose.checks.spans import spans
from ferryid.effects.picture import Scene

LEAST = 0.02
SLOW_RADPS = 0.003
"""Below this root mean square of the rate, heading and rate are compared in vain."""
SIZE = np.array([1.0, 0.1, 2.0])
"""How far off factor, bias [rad/s] and delay [s] may be."""


def find(scene: Scene) -> SensorFinding | None:
    """Return the factor of the yaw rate, measured over true.

    A bias and a delay of the gyro are solved for along with it. Noise of the heading makes the factor of a regression on the
    heading too small, noise of the rate that of the other regression too large: the truth lies between.
    """
    trial = spans(scene, np.column_stack([scene.psi, scene.nu_raw[:, 2]]))
    if len(trial.starts) < 8:
        return None
    psi = np.where(np.isfinite(scene.psi), scene.psi, 0.0)
    rate, bend = trial.rate(psi), trial.curvature(psi)
    measured = trial.mean(np.where(np.isfinite(scene.nu_raw[:, 2]), scene.nu_raw[:, 2], 0.0))
    if np.std(rate) < SLOW_RADPS:
        return None
    block = (trial.middle_s // BLOCK_S).astype(np.int64)
    J = -np.column_stack([rate, np.ones_like(rate), -bend])
    kept = np.ones(len(rate), dtype=np.bool_)
    for _ in range(2):
        solved = step(J[kept], J[kept], measured[kept], block[kept], SIZE, np.array([-1.0, 0.0, 0.0]))
        if solved is None:
            return None
        left = np.abs(measured + J @ solved.values)
        kept = left <= OUTLIER * max(float(np.median(left[kept])), 1e-9)
    Z = np.column_stack([-measured, *J.T[1:]])
    other = step(Z[kept], J[kept], measured[kept], block[kept], SIZE, np.array([-1.0, 0.0, 0.0]))
    if other is None:
        return None
    off, rival = solved.values[0] - 1.0, other.values[0] - 1.0
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


CHECK = Check("yaw_rate_scale", "Yaw rate against heading", find, place=20)
