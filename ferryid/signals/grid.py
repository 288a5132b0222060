"""One stream on a uniform grid: interpolated, averaged or held, with nothing invented across gaps."""

from __future__ import annotations

import numpy as np

from ferryid.signals.quality import is_load, is_order
from ferryid.signals.source import Source
from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Flags, Floats

EXACT_S = 1e-6


def on_grid(source: Source, t0_ns: int, t: Floats, rate: float, repairs: list[str]) -> dict[str, Floats]:
    # Times relative to the grid's start keep nanoseconds exact in floating point.
    time_s = np.asarray((source.time_ns - t0_ns) * 1e-9, dtype=np.float64)
    averaged = not source.on_change and source.period_s * rate * SIGNALS.decimation_ratio < 1.0
    if averaged:
        repairs.append(
            f"{source.topic}: {1 / source.period_s:.3g} Hz, averaged over the intervals of the {rate:g} Hz grid."
        )
    columns = dict(source.columns)
    wind = _wind_vector(columns)
    columns.update(wind)
    result: dict[str, Floats] = {}
    everywhere: Flags | None = None
    for name, values in columns.items():
        finite: Flags = np.isfinite(values)
        whole = bool(finite.all())
        times, known = (time_s, values) if whole else (time_s[finite], values[finite])
        if times.size == 0:
            result[name] = np.full(t.size, np.nan)
            continue
        if source.on_change or is_load(name) or (is_order(name) and not averaged):
            unlimited = source.on_change or is_load(name)
            result[name] = _held(times, known, t, np.inf if unlimited else source.bridge_s)
            continue
        if whole:
            everywhere = _bridged(times, t, source.bridge_s) if everywhere is None else everywhere
            inside = everywhere
        else:
            inside = _bridged(times, t, source.bridge_s)
        if averaged:
            times, known = _bin_means(times, known, t.size, rate)
            if times.size == 0:
                result[name] = np.full(t.size, np.nan)
                continue
            # Half a bin at either end has its mean elsewhere.
            inside = inside & (t >= times[0] - EXACT_S) & (t <= times[-1] + EXACT_S)
        result[name] = np.where(inside, np.interp(t, times, known), np.nan)
    if wind:
        along, across = result.pop("_wind_along"), result.pop("_wind_across")
        result["wind_speed"] = np.hypot(along, across)
        result["wind_from"] = np.arctan2(across, along)
    return result


def _wind_vector(columns: dict[str, Floats]) -> dict[str, Floats]:
    """Replace speed and direction of the wind by two components, which can be averaged and interpolated."""
    if "wind_speed" not in columns or "wind_from" not in columns:
        return {}
    speed, direction = columns.pop("wind_speed"), columns.pop("wind_from")
    return {"_wind_along": speed * np.cos(direction), "_wind_across": speed * np.sin(direction)}


def _bridged(times: Floats, t: Floats, bridge_s: float) -> Flags:
    """True where a grid time lies on a sample, or between two that are no further apart than `bridge_s`."""
    after = np.searchsorted(times, t, side="left")
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, times.size - 1)
    on_sample = (np.abs(times[after] - t) <= EXACT_S) | (np.abs(times[before] - t) <= EXACT_S)
    between = (times[before] <= t) & (t <= times[after]) & (times[after] - times[before] <= bridge_s)
    bridged: Flags = on_sample | between
    return bridged


def _held(times: Floats, values: Floats, t: Floats, longest_s: float) -> Floats:
    latest = np.searchsorted(times, t + EXACT_S, side="right") - 1
    known = latest >= 0
    latest = np.maximum(latest, 0)
    known &= t - times[latest] <= longest_s
    return np.where(known, values[latest], np.nan)


def _bin_means(times: Floats, values: Floats, count: int, rate: float) -> tuple[Floats, Floats]:
    """Return mean time and mean value of the samples around each grid time, for those that have any.

    The mean time is kept, since samples seldom lie evenly in a bin: half a sample off would be a delay between streams.
    """
    bins = np.floor(times * rate + 0.5).astype(np.int64)
    near = (bins >= 0) & (bins < count)
    bins = bins[near]
    number = np.bincount(bins, minlength=count)
    filled = number > 0
    mean_time = np.bincount(bins, times[near], count)[filled] / number[filled]
    mean_value = np.bincount(bins, values[near], count)[filled] / number[filled]
    return mean_time, mean_value
