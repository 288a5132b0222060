"""Gazebo: a model in SDF with added mass, the terms of gz-sim's Hydrodynamics plugin, and thrusters.

Sources: gz-sim, ``src/systems/hydrodynamics`` (``Hydrodynamics.cc``, ``HydrodynamicsUtils.hh``) and ``src/systems/thruster``;
added mass as of the proposal "Fluid added mass" of sdformat, about the link's origin. The plugin adds
``sum of n (c + c_abs |n|) n`` over axis and velocities, with coefficients in SNAME's signs: negative where they damp.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from typing import Any

import numpy as np

from ferryid.counts import per_cent
from ferryid.export.exported import Exported
from ferryid.export.format import Format
from ferryid.export.names import number, plain
from ferryid.export.planar_terms import MIRROR, PlanarTerms, coriolis
from ferryid.export.sdf import (
    DAMPING_RATIO,
    LINK,
    Box,
    box,
    box_lines,
    comment,
    error_report,
    inertial,
    inertial_lines,
    left_out,
    names_of,
    numbers,
    part_lines,
    rigid_body,
)
from ferryid.export.simulator_fit import Slots, mass_share, remaining, simulator_fit
from ferryid.export.words import beside, frames, heading, limits, wrapped
from ferryid.types import Floats
from ferryid.vessel.profile import Actuator
from ferryid.vessel.thrusters import FRESH_WATER, thrust

_AXES, _VELOCITIES = "xyn", "UVR"
_PLANE = {(0, 0): "xx", (0, 1): "xy", (0, 2): "xr", (1, 1): "yy", (1, 2): "yr", (2, 2): "rr"}
_ALL = np.ones((3, 3, 3), dtype=bool)
SLOTS = Slots(
    _ALL[0],
    _ALL,
    _ALL,
    fitted=(
        *((axis, axis, k) for axis in range(3) for k in (None, axis)),
        *((axis, 3 - axis, k) for axis in (1, 2) for k in (None, 3 - axis)),
    ),
)
_MOST_RPM = 3000.0
"""Where a thrust curve has no end."""
_CURVE_ROWS = 201


def render(one: Exported) -> str:
    """Return the SDF file."""
    body = "\n".join(_model(one))
    head = [*heading(one), "", *_how_to_use(one), "", *frames(one), "", *limits(one), *_report(one, body), *beside(one)]
    return f'<?xml version="1.0"?>\n{comment(head)}\n<sdf version="1.11">\n{body}\n</sdf>\n'


def check(one: Exported, text: str) -> dict[str, Any]:
    """Return what the file expresses, by the plugin's own equations on the numbers that stand in it."""
    mass, simulated = equations(text)
    wanted = simulator_fit(one, SLOTS, coriolis(_whole_mass(one)))
    model = ET.fromstring(text).find("model")
    assert model is not None
    plugin = model.find("plugin[@name='gz::sim::systems::Hydrodynamics']")
    assert plugin is not None
    return {
        "equations": "gz-sim Hydrodynamics with fluid_added_mass",
        "terms": [name for name in numbers(plugin) if name not in _assumed(box(one.force.profile.hull), one)],
        "missing": [part.json() for part in wanted.missing],
        "error_share": {"velocity": remaining(one, simulated), "acceleration": mass_share(one, mass)},
    }


def equations(text: str) -> tuple[Floats, Any]:
    """Return the mass matrix, shape (3, 3), and the force that constant velocities require, of a file, in FRD.

    The equations of the plugin are written as they stand there: a sum over pairs of axis and velocity, in FLU.
    """
    model = ET.fromstring(text).find("model")
    assert model is not None
    link = model.find(f"link[@name='{LINK}']/inertial/fluid_added_mass")
    plugin = model.find("plugin[@name='gz::sim::systems::Hydrodynamics']")
    assert plugin is not None
    mirror = np.array(MIRROR)
    entries = {} if link is None else numbers(link)
    added = np.zeros((3, 3))
    for (i, j), key in _PLANE.items():
        added[i, j] = added[j, i] = entries.get(key, 0.0)
    mass = rigid_body(model) + added * np.outer(mirror, mirror)
    values = numbers(plugin)

    def simulated(nu: Floats) -> Floats:
        state = nu * mirror
        applied = np.zeros_like(state)
        for i, axis in enumerate(_AXES):
            for j, velocity in enumerate(_VELOCITIES):
                damping = np.full(len(state), values.get(f"{axis}{velocity}", 0.0))
                for k, other in enumerate(_VELOCITIES):
                    damping += values.get(f"{axis}{velocity}abs{other}", 0.0) * np.abs(state[:, k])
                    damping += values.get(f"{axis}{velocity}{other}", 0.0) * state[:, k]
                applied[:, i] += damping * state[:, j]
        return np.asarray(coriolis(mass).force(nu) - applied * mirror)

    return mass, simulated


def _whole_mass(one: Exported) -> Floats:
    """Return the mass matrix that the file can hold: the symmetric part."""
    return 0.5 * (one.mass + one.mass.T)


def _model(one: Exported) -> Iterator[str]:
    hull, actuators = one.force.profile.hull, one.force.profile.actuators
    names, floating = names_of(actuators), box(hull)
    turning = [actuator for actuator in actuators if actuator.kind == "azimuth"]
    moving = inertial(hull, floating, [*actuators, *turning])
    mirror = np.array(MIRROR)
    rigid = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, hull.x_g_m], [0.0, hull.x_g_m, hull.inertia_z / hull.mass_kg]])
    added = (_whole_mass(one) - hull.mass_kg * rigid) * np.outer(mirror, mirror)
    yield f'<model name="{one.name}">'
    yield f'  <link name="{LINK}">'
    entries = {key: float(added[at]) for at, key in _PLANE.items() if added[at] != 0.0}
    for line in (*inertial_lines(moving, entries), *box_lines(floating, hull.x_g_m)):
        yield f"    {line}"
    yield "  </link>"
    for actuator in actuators:
        for line in _thruster_links(one, actuator, names[actuator.name]):
            yield f"  {line}"
    yield '  <plugin filename="gz-sim-hydrodynamics-system" name="gz::sim::systems::Hydrodynamics">'
    yield f"    <link_name>{LINK}</link_name>"
    for name, value in _coefficients(one).items():
        yield f"    <{name}>{number(value)}</{name}>"
    yield "    <!-- heave, roll and pitch: assumed, not identified -->"
    for name, value in _assumed(floating, one).items():
        yield f"    <{name}>{number(value)}</{name}>"
    yield "  </plugin>"
    for actuator in actuators:
        for line in _thruster_plugins(one, actuator, names[actuator.name]):
            yield f"  {line}"
    yield "</model>"


def _coefficients(one: Exported) -> dict[str, float]:
    """Return the plugin's coefficients: of the force that acts, not of the one required, in FLU."""
    terms = simulator_fit(one, SLOTS, coriolis(_whole_mass(one))).terms.mirrored().times(-1.0)
    return dict(_named(terms))


def _named(terms: PlanarTerms) -> Iterator[tuple[str, float]]:
    for i, axis in enumerate(_AXES):
        for j, velocity in enumerate(_VELOCITIES):
            if terms.linear[i, j] != 0.0:
                yield f"{axis}{velocity}", float(terms.linear[i, j])
            for k, other in enumerate(_VELOCITIES):
                if terms.absolute[i, j, k] != 0.0:
                    yield f"{axis}{velocity}abs{other}", float(terms.absolute[i, j, k])
                if terms.product[i, j, k] != 0.0:
                    yield f"{axis}{velocity}{other}", float(terms.product[i, j, k])


def _assumed(floating: Box, one: Exported) -> dict[str, float]:
    """Return linear damping of heave, roll and pitch, a part of the critical one."""
    hull = one.force.profile.hull
    moments = inertial(hull, floating).moments
    masses = (hull.mass_kg, *moments[:2])
    return {
        name: -2.0 * DAMPING_RATIO * math.sqrt(stiffness * mass)
        for name, stiffness, mass in zip(("zW", "kP", "mQ"), floating.stiffness, masses, strict=True)
    }


def _thruster_links(one: Exported, actuator: Actuator, name: str) -> Iterator[str]:
    hull = one.force.profile.hull
    x, y = actuator.position_m
    place = f"{number(x)} {number(0.0 - y)} 0 0 0"
    if actuator.kind == "azimuth":
        yield from part_lines(hull, f"{name}_azimuth", f"{place} 0", LINK, "0 0 1")
        yield from part_lines(hull, name, "0 0 0 0 0 0", f"{name}_azimuth", "1 0 0")
    else:
        yield from part_lines(hull, name, f"{place} {number(0.0 - _direction(actuator))}", LINK, "1 0 0")


def _direction(actuator: Actuator) -> float:
    """Return where an actuator that does not turn pushes [rad], 0 ahead and π/2 to starboard."""
    return 0.5 * math.pi if actuator.kind == "tunnel" and actuator.angle_rad == 0.0 else actuator.angle_rad


def _thruster_plugins(one: Exported, actuator: Actuator, name: str) -> Iterator[str]:
    yield '<plugin filename="gz-sim-thruster-system" name="gz::sim::systems::Thruster">'
    yield f"  <joint_name>{name}_joint</joint_name>"
    yield "  <velocity_control>true</velocity_control>"
    curve = _curve(actuator)
    if curve is not None:
        low, high, coefficient, _ = curve
        yield f"  <max_thrust_cmd>{number(high)}</max_thrust_cmd>"
        yield f"  <min_thrust_cmd>{number(low)}</min_thrust_cmd>"
        yield f"  <fluid_density>{number(_density(actuator))}</fluid_density>"
        yield f"  <propeller_diameter>{number(_diameter(actuator))}</propeller_diameter>"
        yield f"  <thrust_coefficient>{number(coefficient)}</thrust_coefficient>"
    yield "</plugin>"
    if actuator.kind == "azimuth":
        yield '<plugin filename="gz-sim-joint-position-controller-system" name="gz::sim::systems::JointPositionController">'
        yield f"  <joint_name>{name}_azimuth_joint</joint_name>"
        yield f"  <topic>{one.name}/{name}/azimuth</topic>"
        yield "  <use_velocity_commands>true</use_velocity_commands>"
        yield "</plugin>"


def _density(actuator: Actuator) -> float:
    return float(actuator.inflow.get("water_density", FRESH_WATER))


def _diameter(actuator: Actuator) -> float:
    return float(actuator.inflow.get("diameter_m", 1.0))


def _curve(actuator: Actuator) -> tuple[float, float, float, float] | None:
    """Return least and greatest force [N], the coefficient of the plugin's square law, and its error over the greatest force.

    The law is ``T = rho K D^4 omega |omega|``; the plugin uses it for the speed of the blades alone, as thrust is what is
    ordered.
    """
    if actuator.thrust is None:
        return None
    to_rpm = 60.0 if actuator.thrust.input_unit == "rps" else 1.0
    ends = [end * to_rpm if math.isfinite(end) else math.copysign(_MOST_RPM, end) for end in actuator.thrust.valid]
    rpm = np.linspace(ends[0], ends[1], _CURVE_ROWS)
    force, _ = thrust(
        actuator.thrust, rpm, diameter_m=actuator.inflow.get("diameter_m", math.nan), water_density=_density(actuator)
    )
    force = force * actuator.count * (1.0 - actuator.inflow.get("thrust_deduction", 0.0))
    omega = rpm * math.pi / 30.0
    law = _density(actuator) * _diameter(actuator) ** 4 * omega * np.abs(omega)
    coefficient = float(law @ force / (law @ law))
    error = float(np.abs(force - coefficient * law).max() / np.abs(force).max())
    return float(force.min()), float(force.max()), coefficient, error


def _how_to_use(one: Exported) -> Iterator[str]:
    told = (
        f"For gz-sim 7 or newer with the DART engine: frames are Gazebo's, x ahead, y to port, z up, with {LINK} at the body "
        "origin below in the waterline; wherever this head names another frame, it is ferryid's. The hull is a box for "
        "gz-sim-buoyancy-system with graded_buoyancy: 1000 below 0, 1 above.",
        "fluid_added_mass and the rigid body give M and C(nu) nu. xU, yR and the like multiply a velocity, xUabsU that and the "
        "size of another, yUR two. Of the plugin's other terms none is used: no xDotU and the like, no default_current.",
        "With a current, the added mass of a hull that turns in it lacks its change in the body's frame.",
        f"Thrusters take the force on the hull in N on /model/{one.name}/joint/THRUSTER_joint/cmd_thrust, azimuths an angle in "
        f"rad, positive to port, on {one.name}/THRUSTER/azimuth.",
    )
    for sentence in told:
        yield from wrapped(sentence)


def _report(one: Exported, body: str) -> Iterator[str]:
    checked = check(one, f"<sdf>{body}</sdf>")
    return error_report(checked, "inertia (its asymmetric part)", "other terms", [*left_out(one), *_of_thrusters(one)])


def _of_thrusters(one: Exported) -> Iterator[str]:
    for actuator in one.force.profile.actuators:
        curve = _curve(actuator)
        if curve is not None:
            yield (
                f"{plain(actuator.name)}: the speed of its blades follows a square law, which errs by up to "
                f"{per_cent(curve[3])} of the greatest thrust; thrust itself is what is ordered"
            )
        if actuator.kind == "propeller_rudder":
            yield f"{plain(actuator.name)}: its rudder is not exported; the plugin has none"


FORMAT = Format(
    "gazebo",
    ".gazebo.sdf",
    "an SDF model for Gazebo (gz-sim) with hydrodynamics and thrusters",
    render,
    "use it with: <include><uri>{file}</uri></include> in a world with graded buoyancy",
    check=check,
)
