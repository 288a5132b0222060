"""Thrust saturation: one actuator gives no more than a force below what its thrust curve ends at."""

from __future__ import annotations

from functools import partial
from math import isfinite
from typing import Any

import numpy as np

from ferryid.effects.actuator_force import (
    acts_in,
    along,
    force_is_measured,
    force_limits,
    index_of,
    loss_label,
    lost,
    scaled,
)
from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, Measurements, touches
from ferryid.effects.simulated import Simulated, entry
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

ROUNDING = 0.05
"""Share of the limit below and above it over which the force bends into it, so that the fit has a slope on both sides."""
SIZE, START, LOWEST = 0.5, 0.3, 0.02
"""Usual distance of a limit from the curve's end, where a search begins, and the lowest limit, in shares of that end.

A search begins low, where every larger force depends on the limit: from above the largest force of a log nothing would.
"""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the limits ahead and astern; neutral beyond what any actuator of the vessel gives.

    All actuators of a vessel have the same scales: `START` is of the weakest, so that the search begins within its reach.
    """
    names = instances(profile)
    limited = [force_limits(one) for one in profile.actuators if one.name in names]
    ends = [[side for side in sides if side > 0.0] or [1.0] for sides in zip(*limited, strict=True)] or [[1.0], [1.0]]
    return tuple(
        Parameter(
            name,
            "N",
            SIZE * max(end),
            LOWEST * min(end),
            max(end) / (1.0 - ROUNDING),
            neutral=max(end) / (1.0 - ROUNDING),
            start=START * min(end),
        )
        for name, end in zip(("ahead", "astern"), ends, strict=True)
    )


def instances(profile: Profile) -> tuple[str | None, ...]:
    """Return the actuators whose thrust curve has an end and whose force is not measured itself."""
    return tuple(
        one.name
        for one in profile.actuators
        if one.kind != "force" and isfinite(force_limits(one)[0]) and not force_is_measured(profile, one)
    )


@touches("parts", "angles")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Bend the force of the actuator into its limits."""
    k = index_of(force_model, instance)
    push = along(force_model, k)
    size, limit = np.abs(push), np.where(push < 0.0, p[1], p[0])
    over = np.clip(size - (1.0 - ROUNDING) * limit, 0.0, 2.0 * ROUNDING * limit)
    kept = np.minimum(size, (1.0 + ROUNDING) * limit) - over**2 / (4.0 * ROUNDING * limit)
    return scaled(force_model, k, np.where(size > 0.0, kept / np.where(size > 0.0, size, 1.0), 1.0))


def cannot(measurements: Measurements) -> str:
    """Return why the measurements cannot show it of any actuator."""
    return (
        ""
        if instances(measurements.profile)
        else "no actuator of unmeasured force has a thrust curve whose limits are stated (valid)"
    )


def cannot_be_of(measurements: Measurements, instance: str | None) -> str:
    """Return why the log cannot show it of one actuator: it needs forces above and below a limit."""
    push = along(measurements, index_of(measurements, instance))[measurements.usable]
    for sign, one in zip((1.0, -1.0), parameters_of(measurements.profile), strict=True):
        size, least = sign * push, one.neutral if one.start is None else one.start
        if acts_in(size > least) and acts_in((size > 0.0) & (size < least)):
            return ""
    return f"no actuator varied its force about {100.0 * START:.0f} % of its largest and beyond"


def unreported(measurements: Measurements, p: Floats) -> frozenset[str]:
    """Return the sides on which no force reached a limit."""
    every = parameters_of(measurements.profile)
    free = {one.name for one, value in zip(every, p.tolist(), strict=True) if value > (1.0 - ROUNDING) * one.neutral}
    return frozenset(free) if len(free) < len(every) else frozenset()


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    sides = " and ".join(f"{values[side]:.3g} N {side}" for side in ("ahead", "astern") if side in values)
    return f"{instance} gives no more than {sides}."


def thrust(p: Any, speed: float, force: float) -> float:
    """Return the simulated force of the actuator: cut off at its limits."""
    return float(min(force, p[0]) if force > 0.0 else max(force, -p[1]))


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the force beyond the limits."""
    return loss_label(instance, axis, "beyond its limits"), lost(force_model, apply(force_model, p, instance), axis)


EFFECT = Effect(
    "thrust_saturation",
    "Thrust saturation",
    parameters_of,
    apply,
    says,
    partial(entry, "thrust_saturation"),
    instances=instances,
    cannot=cannot,
    cannot_be_of=cannot_be_of,
    of_thrust_curve=True,
    vessel=True,
    piecewise=True,
    unreported=unreported,
    in_part=True,
    regressor=regressor,
    formula_error=EFFECTS.definition_error,
    simulated=Simulated(thrust=thrust),
    by_row=True,
)
