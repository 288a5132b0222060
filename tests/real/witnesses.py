"""Witnesses that know nothing of the diagnosis: raw rows, correlations and regressions on the recordings themselves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import csd, savgol_filter, welch
from scipy.spatial.transform import Rotation

from ferryid.effects.force_model import Measurements

Floats = NDArray[np.float64]

SLOPE_S = 2.0
DEGREE_M = 111_412.0


@dataclass(frozen=True)
class Lag:
    """How much later velocities are than the slope of positions [s], at the highest correlation, which is given too."""

    seconds: float
    correlation: float
    lags_s: Floats
    correlations: Floats


def velocity_lag(measurements: Measurements, reach_s: float = 2.0) -> Lag:
    """Correlate the slope of positions with velocities turned north and east, shifted row by row."""
    rate = 1.0 / measurements.step_s
    rows = 2 * round(0.5 * SLOPE_S * rate) + 1
    slope = savgol_filter(measurements.eta[:, :2], rows, 1, deriv=1, delta=measurements.step_s, axis=0)
    c, s = np.cos(measurements.psi), np.sin(measurements.psi)
    u, v = savgol_filter(measurements.nu_raw[:, :2], rows, 1, axis=0).T
    ground = np.column_stack([c * u - s * v, s * u + c * v])
    reach = round(reach_s * rate)
    inner = slice(rows + reach, len(c) - rows - reach)
    known = measurements.usable[inner]
    shifts = np.arange(-reach, reach + 1)
    # A velocity that is late by k rows belongs to the slope k rows earlier.
    found = [
        np.corrcoef(slope[inner][known].ravel(), np.roll(ground, -int(k), axis=0)[inner][known].ravel())[0, 1]
        for k in shifts
    ]
    best = int(np.clip(np.argmax(found), 1, len(found) - 2))
    # The top of the parabola through the highest three.
    before, top, after = found[best - 1 : best + 2]
    between = 0.5 * (before - after) / (before - 2.0 * top + after)
    return Lag(
        float((shifts[best] + between) * measurements.step_s), float(top), shifts * measurements.step_s, np.array(found)
    )


def slow_gain(measurements: Measurements, below_hz: float = 0.06) -> Floats:
    """Return velocity over slope of position where both are slow, north and east: there the position is exact."""
    c, s = np.cos(measurements.psi), np.sin(measurements.psi)
    u, v = measurements.nu_raw[:, :2].T
    gains = []
    for place, velocity in ((measurements.eta[:, 0], c * u - s * v), (measurements.eta[:, 1], s * u + c * v)):
        slope = np.gradient(place, measurements.step_s)
        rows = round(40.0 / measurements.step_s)
        frequency, both = csd(slope, velocity, 1.0 / measurements.step_s, nperseg=rows)
        alone = welch(slope, 1.0 / measurements.step_s, nperseg=rows)[1]
        slow = (frequency > 0.0) & (frequency <= below_hz)
        gains.append(float(np.sum(np.abs(both[slow])) / np.sum(alone[slow])))
    return np.array(gains)


@dataclass(frozen=True)
class Gustiness:
    """How a measured wind varies: of both components together [m/s], and until its autocorrelation is 1/e [s]."""

    std: float
    seconds: float


def gustiness(measurements: Measurements) -> Gustiness:
    """Return how the wind of an anemometer varies about the mean of the recording."""
    assert measurements.wind is not None
    wind = measurements.wind[measurements.usable]
    away = wind - wind.mean(axis=0)
    size = np.fft.rfft(away, 2 * len(away), axis=0)
    alike = np.fft.irfft(np.sum(np.abs(size) ** 2, axis=1))[: len(away)]
    below = np.flatnonzero(alike < alike[0] / np.e)
    return Gustiness(float(np.sqrt(np.mean(away**2))), float(below[0]) * measurements.step_s)


def repeated(table: pd.DataFrame, column: str) -> float:
    """Return the longest time for which a column of a table repeats its value exactly [s]."""
    times, values = table.iloc[:, 0].to_numpy(), table[column].to_numpy()
    changes = np.flatnonzero(np.diff(values) != 0.0)
    return float(np.diff(times[changes]).max())


def antenna(folder: Path) -> Floats:
    """Return where milliAmpère's receiver stands, seen from the origin of the ferry's own navigation [m], x and y."""
    fix, pose = (_stamped(folder / name) for name in ("vectorVS330/fix.csv", "navigation/pose.csv"))
    heading = _stamped(folder / "vectorVS330" / "heading.csv")
    turns = heading[[f"quaternion_{axis}" for axis in "xyzw"]].to_numpy()
    psi = np.unwrap(Rotation.from_quat(turns).as_euler("ZYX")[:, 0])
    north = (fix.latitude - fix.latitude[0]).to_numpy() * DEGREE_M
    east = (fix.longitude - fix.longitude[0]).to_numpy() * DEGREE_M * np.cos(np.radians(fix.latitude[0]))
    when = pose.stamp.to_numpy()
    inside = (when > fix.stamp.iloc[0]) & (when < fix.stamp.iloc[-1])
    when, seen = when[inside], pose[inside]
    at = [np.interp(when, fix.stamp, column) for column in (north, east)]
    turned = np.interp(when, heading.stamp, psi)
    c, s, one, none = np.cos(turned), np.sin(turned), np.ones(len(when)), np.zeros(len(when))
    rows = np.vstack([np.column_stack([one, none, c, -s]), np.column_stack([none, one, s, c])])
    apart = np.concatenate([at[0] - seen.pose_position_x, at[1] - seen.pose_position_y])
    return np.linalg.lstsq(rows, apart, rcond=None)[0][2:]


def _stamped(path: Path) -> pd.DataFrame:
    table = pd.read_csv(path)
    table["stamp"] = table.header_stamp_secs - 1_744_000_000 + 1e-9 * table.header_stamp_nsecs
    return table


def encoder_offsets(folder: Path) -> Floats:
    """Return the median of measured less ordered angle of milliAmpère's four thrusters [deg]."""
    found = []
    for number in range(1, 5):
        order = pd.read_csv(folder / f"actuator_ref_{number}.csv")
        angle = pd.read_csv(folder / "actuators" / f"actuator_{number}" / "azimuth_angle.csv")
        when, ordered = (pd.to_datetime(table.time).astype("int64") * 1e-9 for table in (angle, order))
        apart = angle.data - np.interp(when, ordered, order.angle_reference)
        found.append(float(np.median((apart + 180.0) % 360.0 - 180.0)))
    return np.array(found)


def sectors(measurements: Measurements) -> Floats:
    """Return the range of angles that each azimuth thruster used while it pushed [deg], shape (k, 2)."""
    used = []
    for k in range(measurements.parts.shape[1]):
        size = np.hypot(measurements.parts[:, k, 0], measurements.parts[:, k, 1])
        pushing = measurements.usable & (size > 0.2 * np.quantile(size, 0.95))
        used.append(np.degrees(np.quantile(measurements.angles[pushing, k], [0.025, 0.975])))
    return np.array(used)


def straight_share(values: Floats) -> float:
    """Return the share of rows that lie on the line of their neighbours to a part in a thousand: interpolated ones."""
    slope = np.diff(values)
    moving = (slope[1:] != 0.0) & (slope[:-1] != 0.0)
    return float(np.mean(np.abs(np.diff(slope))[moving] <= 1e-3 * np.abs(slope[1:][moving])))


def position_pace(table: pd.DataFrame, rows: int) -> Floats:
    """Return the way of Gunnerus's positions in some rows over that of the logged speed.

    It is the 5, 25, 50, 75 and 95 % quantiles.
    """
    step = np.hypot(np.diff(table.N), np.diff(table.E))
    logged = np.hypot(table.u, table.v).to_numpy()[1:] * np.diff(table.tvec)
    ways = [np.convolve(one, np.ones(rows), mode="valid") for one in (step, logged)]
    return np.quantile(ways[0] / ways[1], [0.05, 0.25, 0.5, 0.75, 0.95])


def turned_by_course(table: pd.DataFrame, least_deg: float = 360.0, least_mps: float = 0.5) -> tuple[float, float]:
    """Return the turn that Gunnerus's logged yaw rate adds up to over that of the course of the positions, in whole circles.

    Course and heading differ by the drift, which is alike at both ends of a long turn. Beside it how far the course turned, in
    all circles together [deg].
    """
    t, rate = table.tvec.to_numpy(), table.r.to_numpy()
    way = np.column_stack([np.gradient(table.N, t), np.gradient(table.E, t)])
    course = np.degrees(np.unwrap(np.arctan2(way[:, 1], way[:, 0])))
    turn = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])
    side = np.sign(np.convolve(rate, np.ones(61) / 61.0, mode="same"))
    edges = np.concatenate([[0], np.flatnonzero(np.diff(side)) + 1, [len(t)]])
    by_rate = by_course = 0.0
    for first, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        whole = abs(course[end - 1] - course[first])
        if whole >= least_deg and np.hypot(*way[first:end].T).min() > least_mps:
            by_rate += abs(turn[end - 1] - turn[first])
            by_course += whole
    return by_rate / by_course, by_course


def idle(measurements: Measurements, least_s: float = 3.0) -> tuple[float, float, float] | None:
    """Return the longest time without any recorded force [s], and the surge speeds at its slowest and fastest after [m/s]."""
    still = np.abs(measurements.parts).sum(axis=(1, 2)) == 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8))).reshape(-1, 2)
    best = None
    for first, end in edges.tolist():
        seconds = (end - first) * measurements.step_s
        surge = np.abs(measurements.nu_raw[first:end, 0])
        slowest = int(np.argmin(surge))
        fastest = float(surge[slowest:].max())
        if seconds >= least_s and (best is None or fastest - surge[slowest] > best[2] - best[1]):
            best = (seconds, float(surge[slowest]), fastest)
    return best


def position_steps(pose: Floats) -> Floats:
    """Return the commonest lengths of a position's steps [m], the commonest first, with the share of all steps: (k, 2)."""
    step = np.hypot(*np.diff(pose, axis=0).T)
    lengths, counts = np.unique(np.round(step[step > 1e-3], 2), return_counts=True)
    first = np.argsort(-counts)[:4]
    return np.column_stack([lengths[first], counts[first] / counts.sum()])
