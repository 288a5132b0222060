"""Payload: rigid mass aboard, which enters the vessel's own mass matrix; it may come aboard and leave during the log.

A load sinks the hull, and a deeper hull is damped more and moves more water. How much more is fitted beside the mass, as no
drawing says, and not told: without it, what is only damping would seem to be missing thrust, and the mass too small.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values, span
from ferryid.effects.force_model import ForceModel, Measurements, aboard, added_mass, touches
from ferryid.effects.thresholds import EFFECTS
from ferryid.effects.wording import amount
from ferryid.types import Floats
from ferryid.vessel.dimensions import off_hull
from ferryid.vessel.profile import Profile

WATERPLANE = 0.85
"""Waterplane coefficient of a small workboat."""
WATER = 1025.0
"""Density of sea water [kg/m³]."""
DEEPER = "by_draught"
"""Parameter of a hull whose size is known: growth of all damping and of the added mass over that of the draught."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return mass and place; both in proportion to the hull."""
    mass, length = profile.hull.mass_kg, profile.hull.length_m
    half = 0.5 * length if np.isfinite(length) else mass ** (1.0 / 3.0)
    by_mass = _by_mass(profile)
    return (
        Parameter("mass", "kg", 0.15 * mass, 0.0, 2.0 * mass, start=0.05 * mass),
        Parameter("x", "m", 0.3 * half, -half, half),
        *((Parameter(DEEPER, "-", 0.7, 0.0, 3.0, start=0.5),) if np.isfinite(by_mass) else ()),
    )


def _by_mass(profile: Profile) -> float:
    """Return the growth of the draught by a load, as a share of it [1/kg]; NaN for a hull of unknown size."""
    hull = profile.hull
    return 1.0 / (WATER * WATERPLANE * hull.length_m * hull.beam_m * hull.draught_m)


@touches("hull", "load", "damping_factor")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Put the mass aboard."""
    n = len(force_model.measurements.t)
    load = aboard(p[None, :2])[0]
    more = 0.0
    if len(p) > 2:
        more = float(p[2] * p[0]) * _by_mass(force_model.measurements.profile)
        load += more * added_mass(force_model)
    every = np.empty((n, len(load)))
    every[:] = load
    loaded = force_model.with_load(every)
    return loaded if len(p) < 3 else loaded.damped(np.full(n, 1.0 + more))


def unreported(measurements: Measurements, p: Floats) -> frozenset[str]:
    """Return what is fitted so that the rest comes out right, and is of no interest itself."""
    return frozenset({DEEPER})


def impulse(force_model: ForceModel, p: Floats) -> Floats:
    """Return the momentum that a load takes which lay still over ground before it came aboard, shape (n, 3)."""
    m, x = float(p[0]), float(p[1])
    u, v, r = force_model.measurements.nu.T
    return -m * np.column_stack([u, v + x * r, x * (v + x * r)])


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show a payload."""
    return "the payload was measured and is part of the model" if measurements.payload is not None else ""


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    mass = f"{amount(abs(values['mass']))} kg {'more' if values['mass'] > 0.0 else 'less'}"
    return f"The vessel carried {mass} than the hull model allows for, {whereabouts(values['x'])}."


def whereabouts(x: float) -> str:
    """Return where a load is, in words."""
    return f"{abs(x):.1f} m {'forward' if x >= 0.0 else 'aft'} of midship"


def doubt(values: Values, profile: Profile) -> str:
    """Return that the vessel could not carry it, or not there."""
    mass, x = (values.get(name, 0.0) for name in ("mass", "x"))
    share = mass / profile.hull.mass_kg
    if share > EFFECTS.heaviest_load:
        return f"the load would be {100.0 * share:.0f} % of the vessel's own mass, more than one carries"
    if mass < 0.0:
        return f"the vessel would be {amount(-mass)} kg lighter than it is empty"
    return off_hull(profile, x, 0.0)


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's payload."""
    return {"payload": [{"mass_kg": values["mass"], "x_m": values["x"], **span(values)}]}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the acceleration along the axis, that of turning included."""
    measurements = force_model.measurements
    u, v, r = measurements.nu.T
    u_dot, v_dot, r_dot = np.gradient(measurements.nu, measurements.step_s, axis=0).T
    values = {"surge": u_dot - v * r, "sway": v_dot + u * r, "yaw": r_dot}[axis]
    return f"{axis} acceleration [{'rad/s²' if axis == 'yaw' else 'm/s²'}]", values


EFFECT = Effect(
    "payload",
    "Payload",
    parameters_of,
    apply,
    says,
    scenario,
    cannot=cannot,
    onset=True,
    impulse=impulse,
    passing_size=lambda profile: EFFECTS.passing_load * profile.hull.mass_kg,
    unreported=unreported,
    regressor=regressor,
    changes_hull=True,
    profiled="mass",
    doubt=doubt,
    by_row=True,
    acts_last=True,
)
