"""Time delay: the navigation's data are older than their stamps, against the actuators'."""

from __future__ import annotations

from typing import Any

import numpy as np

from ferryid.compiled import compiled
from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, touches
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return how late the navigation is."""
    return (Parameter("seconds", "s", 0.3, -3.0, 3.0),)


@touches("parts")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Look the actuators' forces up at the time that the motion was measured at."""
    if p[0] == 0.0:
        return force_model
    t = force_model.measurements.t
    flat = np.ascontiguousarray(force_model.parts).reshape(len(t), -1)
    return force_model.replaced(parts=_looked_up(flat, t, t - p[0]).reshape(force_model.parts.shape))


@compiled
def _looked_up(values: Floats, t: Floats, when: Floats) -> Floats:
    """Return values, shape (n, c), at increasing times, linear between those of their rows and held at the ends."""
    out = np.empty((when.shape[0], values.shape[1]))
    last, j = t.shape[0] - 1, 0
    for i in range(when.shape[0]):
        while j < last and t[j + 1] <= when[i]:
            j += 1
        following, share = j, 0.0
        if j < last and when[i] > t[0]:
            following, share = j + 1, (when[i] - t[j]) / (t[j + 1] - t[j])
        for c in range(values.shape[1]):
            out[i, c] = values[j, c] + share * (values[following, c] - values[j, c])
    return out


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence; no physics moves a vessel before it is pushed, but late clocks seem to."""
    if values["seconds"] > 0.0:
        return f"The navigation's data lag the actuators' by {values['seconds']:.2f} s."
    return (
        f"The actuators' data lag the navigation's by {-values['seconds']:.2f} s: the motion precedes its force. An error of a "
        "clock or a force missing from the model can cause this, a delay of the thrusters cannot."
    )


def doubt(values: Values, profile: Profile) -> str:
    """Return that nothing moves before it is pushed."""
    if values.get("seconds", 0.0) >= 0.0:
        return ""
    return "the motion precedes its force, which a force missing from the model causes as easily as a clock"


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's delay."""
    return {"sensors": {"navigation": {"delay_s": values["seconds"]}}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return how fast the thrust changes."""
    j = AXES.index(axis)
    rate = np.gradient(force_model.parts[:, :, j].sum(axis=1), force_model.measurements.step_s)
    return f"change of the thrusters' {axis} {'moment [N·m/s]' if axis == 'yaw' else 'force [N/s]'}", rate


EFFECT = Effect(
    "time_delay",
    "Time delay",
    parameters_of,
    apply,
    says,
    scenario,
    out_of_step=True,
    negligible=EFFECTS.least_delay,
    formula_error=EFFECTS.definition_error,
    regressor=regressor,
    doubt=doubt,
)
