"""PX4: the link and the parameters of its plugin for surface vehicles in Gazebo, ``custom::UsvDynamics``.

Source: PX4-Autopilot, ``src/modules/simulation/gz_plugins/usv_dynamics/UsvDynamics.cpp``, as once in Gazebo Classic. It applies
``-diag(xDotU, yDotV, nDotR) nu_dot - diag(xU + xUU |u|, yV + yVV |v|, nR + nRR |r|) nu`` at the origin of the link, with the
acceleration of the step before. A Coriolis matrix of the added mass is computed there and not used.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ferryid.export.exported import Exported
from ferryid.export.format import Format
from ferryid.export.names import number
from ferryid.export.planar_terms import MIRROR, coriolis
from ferryid.export.sdf import (
    DAMPING_RATIO,
    GRAVITY,
    LINK,
    Box,
    Inertial,
    box,
    box_lines,
    comment,
    error_report,
    inertial,
    inertial_lines,
    left_out,
    numbers,
    rigid_body,
)
from ferryid.export.simulator_fit import Slots, mass_share, remaining, simulator_fit
from ferryid.export.words import beside, frames, heading, limits, wrapped
from ferryid.types import Floats
from ferryid.vessel.parse_hull import rigid_mass
from ferryid.vessel.profile import Hull
from ferryid.vessel.thrusters import FRESH_WATER

_DIAGONAL = np.eye(3, dtype=bool)
_SIZES = np.einsum("ij,jk->ijk", np.eye(3), np.eye(3)).astype(bool)
SLOTS = Slots(
    _DIAGONAL,
    _SIZES,
    np.zeros((3, 3, 3), dtype=bool),
    fitted=tuple((axis, axis, k) for axis in range(3) for k in (None, axis)),
)
_LINEAR, _QUADRATIC, _ADDED = ("xU", "yV", "nR"), ("xUU", "yVV", "nRR"), ("xDotU", "yDotV", "nDotR")
_SEGMENT = math.acos(0.5) - 0.5 * math.sqrt(0.75)
"""Area of a hull's section in the water over the square of its radius, half that radius deep."""
_SEGMENTS = 20


def render(one: Exported) -> str:
    """Return the SDF file."""
    body = "\n".join(_model(one))
    head = [*heading(one), "", *_how_to_use(), "", *frames(one), "", *limits(one), *_report(one, body), *beside(one)]
    return f'<?xml version="1.0"?>\n{comment(head)}\n<sdf version="1.9">\n{body}\n</sdf>\n'


def check(one: Exported, text: str) -> dict[str, Any]:
    """Return what the file expresses, by the plugin's own equations on the numbers that stand in it."""
    mass, simulated = equations(text)
    wanted = simulator_fit(one, SLOTS, coriolis(_rigid(one)))
    return {
        "equations": "PX4 UsvDynamics",
        "terms": [*_ADDED, *_LINEAR, *_QUADRATIC],
        "missing": [part.json() for part in wanted.missing],
        "error_share": {"velocity": remaining(one, simulated), "acceleration": mass_share(one, mass)},
    }


def equations(text: str) -> tuple[Floats, Any]:
    """Return the mass matrix, shape (3, 3), and the force that constant velocities require, of a file, in FRD."""
    model = ET.fromstring(text).find("model")
    assert model is not None
    plugin = model.find("plugin[@name='custom::UsvDynamics']")
    assert plugin is not None
    values, rigid, mirror = numbers(plugin), rigid_body(model), np.array(MIRROR)

    def simulated(nu: Floats) -> Floats:
        state = nu * mirror
        damping = np.array([values[key] for key in _LINEAR]) + np.array([values[key] for key in _QUADRATIC]) * np.abs(
            state
        )
        return np.asarray(coriolis(rigid).force(nu) + damping * state * mirror)

    return rigid + np.diag([values[key] for key in _ADDED]), simulated


def _link(one: Exported) -> Hull:
    """Return the link as a hull that has as much of the inertia as a rigid body can.

    That is the lesser of the masses ahead and aside, the moment between sway and yaw, and all of yaw. Only so does the Coriolis
    force of the added mass act, and the plugin's acceleration of the step before has little to do.
    """
    mass = float(min(one.mass[0, 0], one.mass[1, 1]))
    moment = 0.5 * float(one.mass[1, 2] + one.mass[2, 1])
    return replace(one.force.profile.hull, mass_kg=mass, x_g_m=moment / mass, inertia_z=float(one.mass[2, 2]))


def _rigid(one: Exported) -> Floats:
    link = _link(one)
    return rigid_mass(link.mass_kg, link.x_g_m, link.inertia_z)


def _model(one: Exported) -> Iterator[str]:
    link = _link(one)
    floating = box(link)
    moving = inertial(link, floating)
    yield f'<model name="{one.name}">'
    yield f'  <link name="{LINK}">'
    for line in (*inertial_lines(moving), *box_lines(floating, link.x_g_m)):
        yield f"    {line}"
    yield "  </link>"
    yield '  <plugin filename="libUsivDynamicsPlugin.so" name="custom::UsvDynamics">'
    yield f"    <bodyName>{LINK}</bodyName>"
    for name, value in _parameters(one).items():
        yield f"    <{name}>{number(value)}</{name}>"
    yield "    <!-- buoyancy, heave, roll and pitch: assumed, not identified -->"
    for name, value in _afloat(floating, moving).items():
        yield f"    <{name}>{number(value)}</{name}>"
    yield f"    <length_n>{_SEGMENTS}</length_n>"
    yield "  </plugin>"
    yield "</model>"


def _parameters(one: Exported) -> dict[str, float]:
    """Return added mass and damping, both positive."""
    terms = simulator_fit(one, SLOTS, coriolis(_rigid(one))).terms
    mass = _link(one).mass_kg
    added = dict(zip(_ADDED, (float(one.mass[0, 0]) - mass, float(one.mass[1, 1]) - mass, 0.0), strict=True))
    linear = {name: float(terms.linear[axis, axis]) for axis, name in enumerate(_LINEAR)}
    return added | linear | {name: float(terms.absolute[axis, axis, axis]) for axis, name in enumerate(_QUADRATIC)}


def _afloat(floating: Box, moving: Inertial) -> dict[str, float]:
    """Return two hulls that carry the vessel half a radius deep, as far apart as a box of the beam rolls alike."""
    length = floating.length_m
    radius = math.sqrt(moving.mass / (2.0 * FRESH_WATER * length * _SEGMENT))
    apart = floating.beam_m / math.sqrt(3.0)
    heave = 2.0 * FRESH_WATER * GRAVITY * length * math.sqrt(3.0) * radius
    stiffness = (heave, heave * 0.25 * apart**2, heave * length**2 / 12.0)
    masses = (moving.mass, *moving.moments[:2])
    damping = {
        name: 2.0 * DAMPING_RATIO * math.sqrt(k * mass)
        for name, k, mass in zip(("zW", "kP", "mQ"), stiffness, masses, strict=True)
    }
    afloat = {"waterLevel": 0.5 * radius, "waterDensity": FRESH_WATER, "hullRadius": radius}
    return damping | afloat | {"boatWidth": apart, "boatLength": length}


def _how_to_use() -> Iterator[str]:
    told = (
        "For PX4's gz_boat, in place of its link and its plugin. Frames are Gazebo's, x ahead, y to port, z up, with "
        f"{LINK} at the body origin below in the waterline at z = 0; wherever this head names another frame, it is ferryid's.",
        "Used are xDotU, yDotV, xU, xUU, yV, yVV, nR, nRR. The plugin computes the Coriolis force of these "
        "added masses and does not apply it, and knows no current. So the link has as much of the inertia as a rigid body can: "
        "the lesser of the masses ahead and aside, water included, and all of yaw; its buoyancy carries that mass.",
        "waterLevel is half a radius above the water, as the plugin counts the depth of its hulls from the link's origin.",
        "Motors are PX4's own, and are not exported.",
    )
    for sentence in told:
        yield from wrapped(sentence)


def _report(one: Exported, body: str) -> Iterator[str]:
    checked = check(one, f"<sdf>{body}</sdf>")
    return error_report(checked, "inertia", "its terms", [*left_out(one), *_unstable(one)])


def _unstable(one: Exported) -> Iterator[str]:
    """Yield a warning where the acceleration of the step before makes a simulation run away."""
    mass = _link(one).mass_kg
    for name, value in _parameters(one).items():
        if name in _ADDED and abs(value) >= mass:
            yield f"{name} is not below the mass of the link: the plugin, a step late with it, runs away"


FORMAT = Format(
    "px4",
    ".px4.sdf",
    "the link and plugin parameters of a surface vehicle for PX4 in Gazebo",
    render,
    "use it in place of link and UsvDynamics plugin of models/boat/model.sdf",
    check=check,
)
