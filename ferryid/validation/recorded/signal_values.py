"""Canonical columns put back into the raw fields of a topic: the inverse of `ferryid.vessel.signal_map.convert`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import pi

import numpy as np

from ferryid.ingest.log import Column, Series
from ferryid.types import Floats
from ferryid.vessel.frames import wrap
from ferryid.vessel.profile import Profile, Signal
from ferryid.vessel.pulses import pulse_of_share
from ferryid.vessel.signal_map import canonical_columns, convert
from ferryid.vessel.units import factor

_ROLE_KIND = {"speed": "rotation", "angle": "angle", "rudder": "angle", "force": "force", "thrust": "force"}


def with_columns(profile: Profile, series: Series, changed: Mapping[str, Floats]) -> Series:
    """Return the raw series of a topic in which canonical columns have other values.

    Rows whose value stays as it was keep their raw value to the last bit.

    Parameters
    ----------
    profile
        Maps fields to columns.
    series
        Raw fields of one topic, n messages.
    changed
        Canonical column to values in SI units, shape (n,).

    Raises
    ------
    ValueError
        For a column that the profile does not map in this topic.
    """
    before, raw, left = convert(profile, series), dict(series.columns), set(changed)
    for signal in profile.signals:
        columns = canonical_columns(signal)
        mine = [name for name in columns if name in changed]
        if not mine or signal.topic.strip("/") != series.topic.strip("/") or not set(mine) <= set(before):
            continue
        if signal.element is not None:
            raise ValueError(f"{signal.quantity} lies in an array, and is not rewritten")
        old = [before[name] for name in columns]
        new = [np.asarray(changed.get(name, before[name]), dtype=np.float64) for name in columns]
        fields = [raw[path] for path in signal.fields]
        for path, field, values in zip(signal.fields, fields, _raw(signal, fields, old, new), strict=True):
            same = np.all([(a == b) | (np.isnan(a) & np.isnan(b)) for a, b in zip(old, new, strict=True)], axis=0)
            raw[path] = np.where(same, field, values)
        left -= set(mine)
    if left:
        raise ValueError(f"no field of {series.topic} gives {', '.join(sorted(left))}")
    return replace(series, columns=raw)


def _raw(signal: Signal, fields: list[Column], old: list[Floats], new: list[Floats]) -> list[Floats]:
    """Return the values of a signal's raw fields that give new canonical values."""
    quantity = signal.quantity
    if quantity == "position" and signal.frame == "geodetic":
        return [_moved(field, a, b) for field, a, b in zip(fields, old, new, strict=True)]
    if quantity in ("position", "velocity"):
        scale = factor(signal.unit, "length" if quantity == "position" else "speed") * signal.scale
        return [value / scale for value in _turned(new, signal.frame)]
    if quantity == "heading":
        turn = wrap(new[0] - old[0])
        turn = -turn if signal.frame == "ENU" else turn
        if signal.unit == "quaternion":
            return _quaternion(fields, turn)
        return [_angle(signal, fields[0], turn)]
    if quantity == "yaw_rate":
        rate = -new[0] if signal.frame in ("FLU", "ENU") else new[0]
        return [_scalar(signal, rate, factor(signal.unit, "rate") * signal.scale)]
    role = quantity.partition(".")[2].removesuffix(".command")
    if role not in _ROLE_KIND:
        raise ValueError(f"{quantity} is not rewritten")
    if signal.pulse_us is not None:
        return [pulse_of_share(new[0] / (signal.full * signal.sign), signal.pulse_us)]
    if signal.full:
        return [_scalar(signal, new[0], factor(signal.unit, "fraction") * signal.full)]
    if role == "angle":
        return [_angle(signal, fields[0], wrap(new[0] - old[0]))]
    return [_scalar(signal, new[0], factor(signal.unit, _ROLE_KIND[role]))]


def _scalar(signal: Signal, values: Floats, scale: float) -> Floats:
    return (values / scale - signal.offset) / signal.sign


def _angle(signal: Signal, field: Column, turn: Floats) -> Floats:
    """Return a raw angle turned by so much [rad], within the full turn that the field keeps to, if it keeps to one."""
    scale = factor(signal.unit, "angle")
    before = np.asarray(field, dtype=np.float64)
    after, half = before + turn / (scale * signal.sign), pi / scale
    known = before[np.isfinite(before)]
    least, most = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    if -1.001 * half <= least < 0.0 and most <= 1.001 * half:
        return np.asarray(half - np.mod(half - after, 2.0 * half))
    if least >= 0.0 and half < most <= 2.001 * half:
        return np.asarray(np.mod(after, 2.0 * half))
    return after


def _turned(values: list[Floats], frame: str) -> list[Floats]:
    """Return a vector in the order and signs of a frame; each such change is its own inverse."""
    if frame == "ENU":
        return [values[1], values[0]]
    return [values[0], -values[1]] if frame == "FLU" else values


def _quaternion(fields: list[Column], turn: Floats) -> list[Floats]:
    """Return x, y, z, w turned about the world's vertical [rad]."""
    x, y, z, w = (np.asarray(field, dtype=np.float64) for field in fields)
    c, s = np.cos(0.5 * turn), np.sin(0.5 * turn)
    return [c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z]


def _moved(field: Column, old: Floats, new: Floats) -> Floats:
    """Return latitudes or longitudes moved by metres, at the scale at which the field was turned into metres."""
    before = np.asarray(field, dtype=np.float64)
    known = np.flatnonzero(np.isfinite(before) & np.isfinite(old))
    low, high = known[int(np.argmin(before[known]))], known[int(np.argmax(before[known]))]
    if before[high] == before[low]:
        raise ValueError("a position that never changes has no scale")
    metres = (old[high] - old[low]) / (before[high] - before[low])
    return np.asarray(before + (new - old) / metres)
