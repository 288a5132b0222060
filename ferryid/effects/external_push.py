"""External push: a force on the hull from outside that lasts a short while: a hand, a tug, the quay.

It is constant over ground. A quay, a person on it and a line from it push in a direction of the earth; a tug or a hand that
goes along with the vessel pushes in one of the hull. As long as a push is short the heading hardly turns, so that a log shows
no difference, and a direction on the chart is what a witness can confirm. Where it acts on the hull is its moment over its
force; a log shows the force and the moment, and the point of attack only as a line.

A push begins and ends within the log, or touches one end of it. What lasts is a load of another kind: a wind, a mooring, a
payload. It also has to stand out: see `ferryid.diagnose.inference.onset_estimation.promising_spans`.
"""

from __future__ import annotations

from functools import partial
from math import atan2, cos, degrees, hypot, sin, sqrt

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, touches
from ferryid.effects.simulated import Simulated, entry
from ferryid.effects.thresholds import EFFECTS
from ferryid.effects.wording import amount, bearing
from ferryid.types import Floats
from ferryid.vessel.frames import to_body
from ferryid.vessel.profile import Profile

USUAL_MPS2 = 0.05
"""Acceleration by a push of moderate size, of the mass of the rigid body [m/s²]: 85 N, a hand, on a ferry of 1.7 t."""
ARM = 0.2
"""Lever arm of a push of moderate size, in lengths of the vessel."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the force to the north and to the east, and the moment about the body origin."""
    hull = profile.hull
    length = hull.length_m if np.isfinite(hull.length_m) else 4.0 * sqrt(hull.inertia_z / hull.mass_kg)
    force = USUAL_MPS2 * hull.mass_kg
    moment = ARM * length * force
    return (
        Parameter("north", "N", force, -20.0 * force, 20.0 * force),
        Parameter("east", "N", force, -20.0 * force, 20.0 * force),
        Parameter("moment", "N·m", moment, -20.0 * moment, 20.0 * moment),
    )


@touches("external")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Add the push."""
    psi = force_model.measurements.psi
    X, Y = to_body(np.full_like(psi, p[0]), np.full_like(psi, p[1]), psi)
    return force_model.replaced(external=force_model.external + np.column_stack([X, Y, np.full_like(psi, p[2])]))


def load(
    p: Floats, t: float, x: float, y: float, psi: float, u: float, v: float, r: float, u_r: float, v_r: float
) -> tuple[float, float, float]:
    """Return the push [N, N, N·m] for the simulator; see `ferryid.effects.simulated.Simulated`."""
    c, s = cos(psi), sin(psi)
    return c * p[0] + s * p[1], c * p[1] - s * p[0], p[2]


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    north, east = values["north"], values["east"]
    return (
        f"Something from outside, such as a hand, a tug or the quay, pushed the hull with {amount(hypot(north, east))} N "
        f"towards {bearing(degrees(atan2(east, north)))} and a moment of {amount(values['moment'])} N·m."
    )


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the time: a push shows as a step up and a step down."""
    return "time [s]", force_model.measurements.t


EFFECT = Effect(
    "external_push",
    "External push",
    parameters_of,
    apply,
    says,
    partial(entry, "external_push"),
    onset=True,
    longest_s=EFFECTS.longest_push,
    regressor=regressor,
    formula_error=EFFECTS.load_error,
    simulated=Simulated(load),
    acts_last=True,
)
