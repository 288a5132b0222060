"""Ventilation: a heavily loaded propeller draws air and loses force, beyond a critical loading.

Below the critical shaft speed a propeller near the surface gives the force of its curve; above it air is drawn down and the
force falls, sharply, to a share that hardly depends on the speed any more: Smogeli (2006), "Control of marine propellers: from
normal to extreme conditions", NTNU, and Koushan (2006), "Dynamics of ventilated propeller blade loading on thrusters". There
the share depends on relative shaft speed and on relative submergence. A log has no submergence, so that loading stands for
both: the force of the curve over the largest one of the same direction. Air comes and goes in bursts; what is fitted is the
mean loss while a propeller is loaded, over a band in which the chance of a burst grows.

Air is drawn into a disc turn by turn and washed out again: the loss is behind the loading, for a time that nobody knows
beforehand. That is what tells it from a limit, which holds the force from one moment to the next: a propeller that has just
been loaded still gives all of its force, and one that is eased off not yet.

The force falls as the order rises. Where it only stays behind, at a limit, it saturates; where it falls at every order, the
thruster is weak; where it falls with the speed of the vessel, it loses to its inflow.
"""

from __future__ import annotations

from math import inf, isfinite
from typing import Any

import numpy as np

from ferryid.effects.actuator_force import (
    acts_in,
    along,
    force_is_measured,
    force_limits,
    index_of,
    scaled,
)
from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, Measurements, touches
from ferryid.effects.simulated import Simulated, entry
from ferryid.effects.thresholds import EFFECTS
from ferryid.recursive_filter import lagged
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

WIDTH = 10.0
"""Width of the band above the critical loading over which the loss comes in [% of the largest force]."""


MEMORY = "time_constant"
"""Parameter: with which time constant air gathers in the disc, and leaves it [s]."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the share of the force that a ventilated propeller keeps, the loading from which it draws air, and how fast."""
    return (
        # Without a loss the loading has no meaning.
        Parameter("factor", "-", 0.3, 0.0, 1.0, neutral=1.0, start=0.8, attainable=frozenset({0.0})),
        Parameter("from", "%", 15.0, 30.0, 90.0, neutral=60.0),
        Parameter(MEMORY, "s", 1.0, 0.0, 10.0, start=0.5),
    )


def instances(profile: Profile) -> tuple[str | None, ...]:
    """Return the actuators whose thrust curve has an end and whose force is not measured itself."""
    return tuple(
        one.name
        for one in profile.actuators
        if one.kind != "force" and isfinite(force_limits(one)[0]) and not force_is_measured(profile, one)
    )


def loading(force_model: ForceModel | Measurements, k: int) -> Floats:
    """Return the force of an actuator over its largest one in that direction [%], shape (n,); 0 where it has none."""
    measurements = force_model if isinstance(force_model, Measurements) else force_model.measurements
    ahead, astern = (most or inf for most in force_limits(measurements.profile.actuators[k]))
    push = along(force_model, k)
    return np.asarray(100.0 * np.where(push >= 0.0, push / ahead, -push / astern))


def drawn(loads: Floats, threshold: float) -> Floats:
    """Return the share of the most air that a propeller draws in the long run at loadings [%] above a threshold [%]."""
    air = np.clip((loads - threshold) / WIDTH, 0.0, 1.0)
    return np.asarray(air * air * (3.0 - 2.0 * air))


@touches("parts", "angles")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Take the loss off the force of the actuator."""
    k = index_of(force_model, instance)
    air = drawn(loading(force_model, k), p[1])
    if p[2] > 0.0:
        air = lagged(air, float(p[2]), force_model.measurements.step_s)
    return scaled(force_model, k, 1.0 - (1.0 - p[0]) * air)


def change(p: Floats, speed: float, force: float) -> float:
    """Return the force of a thruster [N] for the simulator, whose propellers draw air at once.

    `p` ends with its largest forces ahead and astern [N].
    """
    air = min(max((100.0 * abs(force) / (p[3] if force >= 0.0 else p[4]) - p[1]) / WIDTH, 0.0), 1.0)
    return float(force * (1.0 - (1.0 - p[0]) * air * air * (3.0 - 2.0 * air)))


def constants(profile: Profile, thruster: str) -> tuple[float, ...]:
    """Return the largest forces of an actuator ahead and astern [N]."""
    ahead, astern = force_limits(next(one for one in profile.actuators if one.name == thruster))
    return ahead or inf, astern or inf


def cannot(measurements: Measurements) -> str:
    """Return why the measurements cannot show it of any actuator."""
    return (
        ""
        if instances(measurements.profile)
        else "no actuator of unmeasured force has a thrust curve whose limits are stated (valid)"
    )


def cannot_be_of(measurements: Measurements, instance: str | None) -> str:
    """Return why the log cannot show it of one actuator: it needs loads above and below where air may be drawn."""
    critical = parameters_of(measurements.profile)[1]
    loads = loading(measurements, index_of(measurements, instance))[measurements.usable]
    pushes = loads > 100.0 * EFFECTS.acting_force
    if acts_in(loads > critical.low + WIDTH) and acts_in(pushes & (loads < critical.low + WIDTH)):
        return ""
    return f"no actuator gave both less and more than {critical.low + WIDTH:.0f} % of its largest force for long"


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    told = (
        f"Above {values['from']:.0f} % of its largest force {instance} keeps {100.0 * values['factor']:.0f} % of the force of "
        "its thrust curve, as a propeller that draws air"
    )
    memory_s = round(values.get(MEMORY, 0.0), 1)
    return (
        f"{told}, which gathers, and leaves, with a time constant of {memory_s:.1f} s."
        if memory_s > 0.0
        else f"{told}."
    )


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's effect, which has no memory."""
    return entry("ventilation", {name: value for name, value in values.items() if name != MEMORY}, instance)


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the loading: the force is lost above one."""
    k = index_of(force_model, instance)
    return f"{instance}'s force by its curve, of its largest [%]", loading(force_model, k)


EFFECT = Effect(
    "ventilation",
    "Ventilation",
    parameters_of,
    apply,
    says,
    scenario,
    instances=instances,
    cannot=cannot,
    cannot_be_of=cannot_be_of,
    of_thrust_curve=True,
    vessel=True,
    regressor=regressor,
    negligible=EFFECTS.least_ventilation,
    later=(MEMORY,),
    simulated=Simulated(thrust=change, constants=constants, lacks=frozenset({MEMORY})),
)
