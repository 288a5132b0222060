"""Fouling: damping of second order grown by a factor on each axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, Measurements, touches
from ferryid.effects.thresholds import EFFECTS
from ferryid.effects.wording import listed
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile

SECOND_ORDER = (
    ("X_|u|u",),
    ("Y_|v|v", "Y_|r|v", "Y_|v|r", "Y_|r|r"),
    ("N_|v|v", "N_|r|v", "N_|v|r", "N_|r|r"),
)


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return a factor for each axis."""
    return tuple(Parameter(axis, "-", 1.0, 0.3, 6.0, neutral=1.0) for axis in AXES)


@touches("hull")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Multiply the coefficients."""
    hull = force_model.hull.copy()
    for names, factor in zip(SECOND_ORDER, p.tolist(), strict=True):
        for name in names:
            hull[COEFFICIENTS.index(name)] *= factor
    return force_model.replaced(hull=hull)


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show fouling."""
    return measurements.profile.hull.why_unknown


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    parts = ", ".join(f"{axis} {100.0 * (values[axis] - 1.0):+.0f} %" for axis in AXES)
    told = f"Damping at speed has changed ({parts}): the hull is"
    if all(values[axis] >= 1.0 for axis in AXES):
        return f"{told} fouled."
    if all(values[axis] <= 1.0 for axis in AXES):
        return f"{told} cleaner than the hull model."
    return f"{told} fouled, or cleaner than the hull model."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's fouling."""
    return {"fouling": {axis: values[axis] for axis in AXES}}


def doubt_of_ends(ends: Mapping[str, tuple[float, float]]) -> str:
    """Return that damping changed both ways, or may not have in surge: a rough hull grows all of it, there the most.

    Roughness adds to friction, which is most of what damps surge. Sway and yaw are damped by the pressure of the cross-flow,
    which grows by other causes: a hull that lies deeper, or whose model is off.
    """
    more = [axis for axis in AXES if ends[axis][0] > 1.0]
    less = [axis for axis in AXES if ends[axis][1] < 1.0]
    # Of surge the likeliest value counts: what rough hulls show most must not point the other way.
    ahead = 0.5 * sum(ends["surge"])
    if less and not more and ahead > 1.0:
        more = ["surge"]
    elif more and not less and ahead < 1.0:
        less = ["surge"]
    if more and less:
        return f"damping in {listed(more)} has grown and in {listed(less)} fallen, and a rough hull grows all of it"
    low, high = ends["surge"]
    if low <= 1.0 <= high:
        return "damping in surge, which the friction of a rough hull grows the most, may not have changed"
    return ""


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the squared speed along the axis, with its sign."""
    k = AXES.index(axis)
    speed = force_model.measurements.nu[:, k]
    return f"{axis} speed squared, signed [{'rad²/s²' if axis == 'yaw' else 'm²/s²'}]", np.abs(speed) * speed


EFFECT = Effect(
    "fouling",
    "Fouling",
    parameters_of,
    apply,
    says,
    scenario,
    cannot=cannot,
    vessel=True,
    doubt_of_ends=doubt_of_ends,
    regressor=regressor,
    # Within the prior of the hull it is the hull's own.
    negligible=EFFECTS.hull_spread,
    changes_hull=True,
    by_row=True,
)
