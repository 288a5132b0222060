"""What SDF files of a vessel have in common: a comment, a hull that floats, thrusters on joints, and the plane in them.

Gazebo's frames: x ahead, y to port, z up (FLU) in a world of east, north, up. The link's origin is ferryid's body origin, in
the waterline. Only the motion in the plane is identified; what heave, roll and pitch need is assumed, and marked as such.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ferryid.counts import per_cent
from ferryid.export.exported import Exported
from ferryid.export.names import legal, number, plain
from ferryid.export.words import wrapped
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Actuator, Hull
from ferryid.vessel.thrusters import FRESH_WATER

GRAVITY = 9.81
LINK = "base_link"
PART_OF_MASS = 1e-4
"""Mass of a thruster's link, as a part of the vessel's: the physics needs one, and the hull's link has that much less."""
PART_RADIUS_M = 0.1
DAMPING_RATIO = 0.3
"""Of heave, roll and pitch, assumed."""
SMALL = 1e-5
"""Shares of a force that are as good as none."""
_INERTIA_ROOM = 1.01
_LENGTH_OF_GYRATION, _LENGTH_OF_BEAM = 4.0, 0.3
"""Length over the radius of gyration, and beam over length, of a hull whose profile does not know them."""


@dataclass(frozen=True)
class Box:
    """A box as long and wide as the hull that floats with half its height in the water.

    `draught_m` is that half; `stiffness` the restoring coefficients in heave [N/m], roll and pitch [N·m/rad].
    """

    length_m: float
    beam_m: float
    draught_m: float
    z_g_m: float
    stiffness: tuple[float, float, float]


def box(hull: Hull) -> Box:
    """Return the box of a hull; lengths that its profile does not know are assumed from the radius of gyration."""
    radius = math.sqrt(max(hull.inertia_z / hull.mass_kg - hull.x_g_m**2, 0.0))
    length = hull.length_m if math.isfinite(hull.length_m) else _LENGTH_OF_GYRATION * radius
    beam = hull.beam_m if math.isfinite(hull.beam_m) else _LENGTH_OF_BEAM * length
    draught = hull.mass_kg / (FRESH_WATER * length * beam)
    # With its centre of gravity in the waterline, a hull that is deep for its beam would capsize.
    metacentre = beam**2 / (12.0 * draught) - 0.5 * draught
    z_g = 0.0 if metacentre > 0.5 * draught else -draught
    weight = hull.mass_kg * GRAVITY
    roll, pitch = (size**2 / (12.0 * draught) - 0.5 * draught - z_g for size in (beam, length))
    return Box(length, beam, draught, z_g, (FRESH_WATER * GRAVITY * length * beam, weight * roll, weight * pitch))


@dataclass(frozen=True)
class Inertial:
    """Mass [kg], centre of mass (x, y, z) [m] and moments about it [kg·m²] of the hull's link."""

    mass: float
    centre: tuple[float, float, float]
    moments: tuple[float, float, float]


def inertial(hull: Hull, floating: Box, parts: Sequence[Actuator] = ()) -> Inertial:
    """Return the hull's link so that it and the links of its thrusters have the mass of the rigid body.

    Parameters
    ----------
    hull, floating
        The hull and its box.
    parts
        Actuators, once for each link that they have.
    """
    part = PART_OF_MASS * hull.mass_kg
    where = [(one.position_m[0], -one.position_m[1]) for one in parts]
    mass = hull.mass_kg - part * len(parts)
    x = (hull.mass_kg * hull.x_g_m - part * sum(px for px, _ in where)) / mass
    y = -part * sum(py for _, py in where) / mass
    own = 0.4 * part * PART_RADIUS_M**2
    about_origin = hull.inertia_z - sum(own + part * (px**2 + py**2) for px, py in where)
    izz = about_origin - mass * (x**2 + y**2)
    high = 4.0 * floating.draught_m**2
    ixx, iyy = (mass * (size**2 + high) / 12.0 for size in (floating.beam_m, floating.length_m))
    # Moments of a body keep to the triangle inequality; those of roll and pitch are assumed, that of yaw is not.
    both = max(ixx + iyy, _INERTIA_ROOM * izz)
    apart = min(iyy - ixx, izz / _INERTIA_ROOM)
    return Inertial(mass, (x, y, floating.z_g_m), (0.5 * (both - apart), 0.5 * (both + apart), izz))


def comment(lines: Iterable[str]) -> str:
    """Return lines as an XML comment, which holds no two hyphens in a row."""
    body = "\n".join(f"  {line}".rstrip() for line in lines)
    while "--" in body:
        body = body.replace("--", "- -")
    return f"<!--\n{body.rstrip('-')}\n-->"


def shares(values: Mapping[str, float] | Floats) -> str:
    """Return shares of a force by axis: ``surge 1.2 %, sway 0.3 %, yaw 4 %``."""
    numbers = values.values() if isinstance(values, Mapping) else values.tolist()
    return ", ".join(f"{axis} {per_cent(round(value, 5))}" for axis, value in zip(AXES, numbers, strict=True))


def inertial_lines(one: Inertial, added: Mapping[str, float] | None = None) -> list[str]:
    """Return the element ``inertial``; `added` are the entries of ``fluid_added_mass``."""
    ixx, iyy, izz = one.moments
    lines = [
        "<inertial>",
        f"  <pose>{' '.join(number(value + 0.0) for value in one.centre)} 0 0 0</pose>",
        f"  <mass>{number(one.mass)}</mass>",
        f"  <inertia><ixx>{number(ixx)}</ixx><iyy>{number(iyy)}</iyy><izz>{number(izz)}</izz>"
        "<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia>",
    ]
    if added:
        entries = "".join(f"<{key}>{number(value)}</{key}>" for key, value in added.items())
        lines.append(f"  <fluid_added_mass>{entries}</fluid_added_mass>")
    return [*lines, "</inertial>"]


def box_lines(floating: Box, x_m: float) -> list[str]:
    """Return collision and visual of the hull's box, at the place of the centre of gravity, so that it floats level."""
    size = " ".join(number(value) for value in (floating.length_m, floating.beam_m, 2.0 * floating.draught_m))
    return [
        f'<{kind} name="hull"><pose>{number(x_m)} 0 0 0 0 0</pose><geometry><box><size>{size}</size></box></geometry></{kind}>'
        for kind in ("collision", "visual")
    ]


def part_lines(hull: Hull, name: str, pose: str, parent: str, axis: str, limit: str = "") -> list[str]:
    """Return a small link and the joint that it turns on."""
    mass = PART_OF_MASS * hull.mass_kg
    moment = number(0.4 * mass * PART_RADIUS_M**2)
    return [
        f'<link name="{name}">',
        f'  <pose relative_to="{parent}">{pose}</pose>',
        f"  <inertial><mass>{number(mass)}</mass><inertia><ixx>{moment}</ixx><iyy>{moment}</iyy><izz>{moment}</izz>"
        "<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>",
        "</link>",
        f'<joint name="{name}_joint" type="revolute">',
        f"  <parent>{parent}</parent>",
        f"  <child>{name}</child>",
        f"  <axis><xyz>{axis}</xyz>{limit}</axis>",
        "</joint>",
    ]


def names_of(actuators: Sequence[Actuator]) -> dict[str, str]:
    """Return a name for SDF and topics for each actuator, no two the same."""
    found: dict[str, str] = {}
    for one in actuators:
        name = legal(plain(one.name))
        while name in found.values() or name == LINK:
            name += "_"
        found[one.name] = name
    return found


def rigid_body(model: ET.Element) -> Floats:
    """Return the mass matrix of all links in the plane about the origin of the hull's link, in FRD, shape (3, 3)."""
    total = np.zeros((3, 3))
    for link in model.findall("link"):
        body = link.find("inertial")
        assert body is not None
        mass, izz = (float(body.findtext(key) or "nan") for key in ("mass", "inertia/izz"))
        x, y = np.add(_place(model, link), _pose(body)).tolist()
        y = -y
        total += [[mass, 0.0, -mass * y], [0.0, mass, mass * x], [-mass * y, mass * x, izz + mass * (x**2 + y**2)]]
    return total


def _place(model: ET.Element, link: ET.Element) -> list[float]:
    """Return where a link is, x and y [m] in the hull's link; what it hangs on is not turned."""
    pose = link.find("pose")
    on = None if pose is None else model.find(f"link[@name='{pose.get('relative_to')}']")
    x, y = _pose(link)
    on_x, on_y = (0.0, 0.0) if on is None else _place(model, on)
    return [x + on_x, y + on_y]


def _pose(element: ET.Element) -> list[float]:
    return [float(value) for value in (element.findtext("pose") or "0 0").split()[:2]]


def numbers(element: ET.Element) -> dict[str, float]:
    """Return the children of an element that hold one number."""
    found = {}
    for child in element:
        try:
            found[child.tag] = float(child.text or "")
        except ValueError:
            continue
    return found


def left_out(one: Exported) -> list[str]:
    """Return what of wind and current plugins of hydrodynamics leave out, as sentences."""
    missing = []
    if one.force.profile.wind is not None:
        missing.append("wind load: the plugin has none")
    if one.needs_wind or one.needs_current:
        missing.append("terms of wind and current: only what still air and water make of them is in")
    return missing


def error_report(checked: Mapping[str, Any], inertia: str, fitted: str, more: Iterable[str]) -> Iterator[str]:
    """Yield the lines of a head on the error by a plugin's own equations.

    Parameters
    ----------
    checked
        As the format's own check returns it.
    inertia, fitted
        Which part of the inertia is wrong, and which terms were fitted to what has none.
    more
        Further sentences.
    """
    error = checked["error_share"]
    yield ""
    yield "Error of the force by the plugin's own equations, over the ranges above:"
    yield f"  at constant velocity: {shares(error['velocity'])}"
    yield f"  of the {inertia}: {shares(error['acceleration'])}"
    if checked["missing"]:
        yield f"What the plugin has no term for, as a share of the force before {fitted} were fitted to it:"
    for part in checked["missing"]:
        yield from wrapped(f"  {part['what']}: {shares(part['share'])}")
    for sentence in more:
        yield from wrapped(f"  {sentence}")
