"""Unsmoothed logs made in memory for tests of cross-validation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ferryid.signals.smooth import Measured
from ferryid.signals.track import Motion
from tests.identify.rounds import RATE_HZ, motion

Floats = NDArray[np.float64]


def measured(
    seed: int,
    *,
    seconds: float = 240.0,
    jitter: float = 0.0,
    noise: float = 0.0,
    gaps: int = 0,
    force: Callable[[Motion], Floats] | None = None,
) -> Measured:
    """Return a log of the profile's hull.

    Parameters
    ----------
    seed
        Of the motion and the noise.
    seconds
        Length.
    jitter
        White noise of the velocities [m/s, and a tenth of it in rad/s].
    noise
        White noise of the forces [N, N, N·m].
    gaps
        Number of stretches of 3 s without measurements.
    force
        What acts beside the force of the profile's hull, of the true motion, shape (n, 3).
    """
    made = motion(seed, seconds=seconds)
    rng = np.random.default_rng(seed + 1000)
    tau = made.tau + noise * rng.standard_normal(made.tau.shape)
    if force is not None:
        tau = tau + force(made)
    nu = made.nu + jitter * rng.standard_normal(made.nu.shape) * [1.0, 1.0, 0.1]
    usable = np.ones(len(made.t), dtype=bool)
    for start in rng.integers(0, len(usable), gaps):
        usable[start : start + round(3.0 * RATE_HZ)] = False
    hole = np.where(usable[:, None], 1.0, np.nan)
    return Measured(
        log=made.log,
        t=made.t,
        rate_hz=RATE_HZ,
        eta=made.eta,
        nu=nu * hole,
        tau=tau * hole,
        usable=usable,
        tau_d=tau,
        eta_d=None,
        wind=None,
        current=None,
        payload=None,
        repairs=("made",),
    )
