"""Force errors per axis, the same for fit, evaluate and compare."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.identify.model import AXES
from ferryid.identify.result import FreeRun
from ferryid.signals.track import Motion

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def usable(motion: Motion, *estimates: Floats) -> Flags:
    """Return the rows on which force and every estimate are known, shape (n,)."""
    rows: Flags = motion.valid & np.isfinite(motion.tau).all(axis=1)
    for estimate in estimates:
        rows = rows & np.isfinite(estimate).all(axis=1)
    return rows


def mean_square(tau: Floats, estimate: Floats, rows: Flags) -> Floats:
    """Return the mean square of ``tau - estimate`` over `rows` per axis, shape (3,) [N², N², (N·m)²]."""
    if not rows.any():
        return np.full(3, np.nan)
    result: Floats = np.mean((tau[rows] - estimate[rows]) ** 2, axis=0)
    return result


def r_squared(tau: Floats, estimate: Floats, rows: Flags) -> Floats:
    """Return the coefficient of determination per axis, shape (3,); NaN where the force never varies."""
    if not rows.any():
        return np.full(3, np.nan)
    variance = np.var(tau[rows], axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(variance > 0, 1.0 - mean_square(tau, estimate, rows) / variance, np.nan)


def by_axis(values: Sequence[float] | Floats) -> dict[str, float]:
    """Return three values under the names of the axes."""
    return {axis: float(value) for axis, value in zip(AXES, values, strict=True)}


def force_scores(tau: Floats, base: Floats, model: Floats, rows: Flags) -> dict[str, Any]:
    """Return MSE and R² of base and model per axis, their ratio, and its mean over the axes that can be judged."""
    mse_base, mse_model = mean_square(tau, base, rows), mean_square(tau, model, rows)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(mse_base > 0, mse_model / mse_base, np.nan)
    judged = ratio[np.isfinite(ratio)]
    return {
        "mse": {"base": by_axis(mse_base), "model": by_axis(mse_model)},
        "r2": {"base": by_axis(r_squared(tau, base, rows)), "model": by_axis(r_squared(tau, model, rows))},
        "per_axis": by_axis(ratio),
        "normalised_mse": float(judged.mean()) if judged.size else float("nan"),
    }


def free_run_plain(run: FreeRun) -> dict[str, Any]:
    """Return a free run as plain values."""
    return {
        "horizons_s": run.horizons_s.tolist(),
        "position_m": run.position_m.tolist(),
        "heading_rad": run.heading_rad.tolist(),
        "speed_mps": run.speed_mps.tolist(),
        "yaw_rate_radps": run.yaw_rate_radps.tolist(),
        "starts": run.starts,
        "note": run.note,
    }


def outside_ranges(columns: Mapping[str, Floats], ranges: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """Return the fraction of rows outside each range of validity, widened by a tenth of its span on either side."""
    shares = {}
    for name, (low, high) in ranges.items():
        if name in columns and columns[name].size:
            margin = 0.1 * (high - low)
            values = columns[name]
            shares[name] = float(np.mean((values < low - margin) | (values > high + margin)))
    return shares
