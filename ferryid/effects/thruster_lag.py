"""Thruster lag: force follows measured speed with a first-order lag, for all thrusters alike."""

from __future__ import annotations

from dataclasses import replace
from math import exp
from typing import Any

import numpy as np
from scipy.signal import lfilter

from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.picture import Picture
from ferryid.vessel.profile import Floats, Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the time constant."""
    return (Parameter("time_constant", "s", 0.5, 0.0, 10.0),)


def apply(picture: Picture, p: Floats, instance: str | None) -> Picture:
    """Let the strength of each thruster lag; its direction is as measured."""
    if p[0] < 1e-3:
        return picture
    keep = exp(-picture.scene.step_s / float(p[0]))
    parts = picture.parts.copy()
    for k in range(parts.shape[1]):
        angle = picture.angles[:, k]
        if np.isfinite(angle).all():
            c, s = np.cos(angle), np.sin(angle)
            along = parts[:, k, 0] * c + parts[:, k, 1] * s
            late = _late(along, keep)
            x, y = picture.scene.profile.actuators[k].position_m
            parts[:, k, 0], parts[:, k, 1] = late * c, late * s
            parts[:, k, 2] = x * parts[:, k, 1] - y * parts[:, k, 0]
        else:
            parts[:, k] = _late(parts[:, k], keep)
    return replace(picture, parts=parts)


def _late(values: Floats, keep: float) -> Floats:
    # The input is linear between rows, as a sampled force is, not held.
    mean = 0.5 * (values[1:] + values[:-1])
    fed = np.concatenate([values[:1], mean])
    late, _ = lfilter([1.0 - keep], [1.0, -keep], fed, axis=0, zi=keep * values[:1])
    return np.asarray(late)


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    return f"The thrusters' force follows their measured speed with a lag of {values['time_constant']:.2f} s."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's lag."""
    return {"thrusters": {"force_lag_s": values["time_constant"]}}


def regressor(picture: Picture, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return how fast the thrust changes."""
    j = ("surge", "sway", "yaw").index(axis)
    rate = np.gradient(picture.parts[:, :, j].sum(axis=1), picture.scene.step_s)
    return f"change of the thrusters' {axis} {'moment [N·m/s]' if axis == 'yaw' else 'force [N/s]'}", rate


EFFECT = Effect("thruster_lag", "Thruster lag", parameters_of, apply, says, scenario, vessel=True, regressor=regressor)
