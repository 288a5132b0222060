"""The paths of a recording and of a simulation of the same manoeuvre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ferryid.diagnose.data.thresholds import DATA
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats
from ferryid.vessel.frames import wrap

RATE_HZ = 2.0


@dataclass(frozen=True)
class PathComparison:
    """Two logs of one manoeuvre, row by row.

    Attributes
    ----------
    shift_s
        What is added to the simulation's time so that its path fits best.
    t
        Time of the recording [s], shape (n,).
    position_m, heading_rad, speed_mps
        Recording less simulation: distance of the positions, heading, and speed over ground, shape (n,).
    """

    shift_s: float
    t: Floats
    position_m: Floats
    heading_rad: Floats
    speed_mps: Floats


def compare_paths(simulated: Measurements, recorded: Measurements) -> PathComparison | str:
    """Compare the paths of a simulation and a recording of one manoeuvre.

    The simulation's clock may have started up to `DATA.shift_s` earlier or later.

    Returns
    -------
    Paths or str
        The reason, where they are not of the same manoeuvre, or there is no position.
    """
    pair = (simulated, recorded)
    if not all(np.isfinite(one.eta[one.usable, :2]).all() for one in pair):
        return "a log has no positions"
    lengths = [float(one.t[one.usable][-1] - one.t[one.usable][0]) for one in pair]
    if abs(lengths[0] - lengths[1]) > DATA.length_difference * max(lengths):
        return f"the simulation lasts {lengths[0]:.0f} s, the recording {lengths[1]:.0f} s"
    step = 1.0 / RATE_HZ
    t = np.arange(recorded.t[0], recorded.t[-1], step)
    own, other = _sampled(recorded, t), None
    best, shift = np.inf, 0.0
    for tried in np.arange(-DATA.shift_s, DATA.shift_s + step, step):
        moved = _sampled(simulated, t - tried)
        away = np.hypot(*(own[:, :2] - moved[:, :2]).T)
        if np.isfinite(away).mean() < 1.0 - 2.0 * DATA.length_difference:
            continue
        distance = float(np.sqrt(np.nanmean(away**2)))
        if distance < best:
            best, shift, other = distance, float(tried), moved
    place = own[:, :2]
    extent = float(np.sqrt(np.nansum(np.nanvar(place, axis=0))))
    if other is None or best > DATA.path_distance * extent:
        return f"the paths are {best:.1f} m apart, on a manoeuvre with an extent of {extent:.1f} m"
    both = np.isfinite(own).all(axis=1) & np.isfinite(other).all(axis=1)
    own, other, t = own[both], other[both], t[both]
    away = own - other
    return PathComparison(shift, t, np.hypot(away[:, 0], away[:, 1]), wrap(away[:, 2]), away[:, 3])


def _sampled(measurements: Measurements, t: Floats) -> Floats:
    """Return north, east, heading and speed at some times, NaN outside of what was measured, shape (n, 4)."""
    columns = np.column_stack([measurements.eta, np.hypot(measurements.nu[:, 0], measurements.nu[:, 1])])
    known = measurements.usable
    inside = np.interp(t, measurements.t, known.astype(np.float64), left=0.0, right=0.0) > 0.5
    found = np.column_stack([np.interp(t, measurements.t[known], column[known]) for column in columns.T])
    return np.where(inside[:, None], found, np.nan)
