"""ROS 2: a parameter file with masses, damping, wind areas, terms, effects and ranges; for any node."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from math import isfinite

from ferryid.effects.force_model import COEFFICIENTS, UNITS
from ferryid.export.exported import Exported
from ferryid.export.format import Format
from ferryid.export.names import legal, number, plain
from ferryid.export.physics import FACTORS, STRIPS_SAY
from ferryid.export.words import beside, commented, frames, heading, limits
from ferryid.types import AXES
from ferryid.vessel.wind import AIR_DENSITY

_RULES = (
    "Keys are names that every ROS 2 tool takes: X_|u|u is X_abs_u_u, u^3 is u_3; the comment beside each has its own name.",
    "tau = (M_RB nu_dot + C_RB(nu) nu + M_A nu_r_dot + C_A(nu_r) nu_r + D(nu_r) nu_r - wind load + payload) / zeta + terms + "
    "intercept, with nu_r = nu - R(psi)' [current; 0], M = M_RB + M_A, and a current that turns in the body frame.",
    "ferryid export --to c or --to python writes the same as code, to check a node against.",
)


def render(one: Exported) -> str:
    """Return the parameter file."""
    head = [*heading(one), "", *frames(one), *_RULES, "", *limits(one), *beside(one)]
    body = ["/**:", "  ros__parameters:", *("    " + line for line in _parameters(one))]
    return "\n".join([commented(head, "#"), *body, ""])


def _parameters(one: Exported) -> Iterator[str]:
    model, hull, areas = one.model, one.hull, one.force.profile.wind
    yield "model:"
    yield f"  label: {_text(model.label)}"
    yield f"  sha256: {_text(one.sha256)}"
    yield f"  vessel: {_text(one.force.profile.name)}"
    yield "mass_matrix:  # rigid body and the water it takes along"
    for i in range(3):
        for j in range(3):
            yield f"  m{i + 1}{j + 1}: {number(hull.M[i, j])}  # {'kg' if i < 2 and j < 2 else 'kg m^2' if i == j else 'kg m'}"
    yield "rigid_body:"
    yield f"  mass: {number(hull.mass_kg)}  # kg"
    yield f"  x_g: {number(hull.x_g_m)}  # m, centre of gravity ahead of the body origin"
    yield f"  inertia_z: {number(hull.inertia_z)}  # kg m^2, about the body origin"
    yield "damping:  # negative where it damps"
    for name, unit in zip(COEFFICIENTS[5:], UNITS[5:], strict=True):
        yield f"  {legal(name)}: {number(hull.D.get(name, 0.0))}  # {name} [{plain(unit)}]"
    yield f"zeta: {number(one.zeta)}"
    if areas is not None:
        yield "wind:  # Blendermann's form"
        yield from _rows(
            {
                "air_density": (AIR_DENSITY, "kg/m^3"),
                "frontal_area": (areas.frontal_m2, "m^2"),
                "lateral_area": (areas.lateral_m2, "m^2"),
                "length": (areas.length_m, "m"),
                "S_L": (areas.S_L_m, "m, centroid of the lateral area ahead of the body origin"),
                "CD_t": (areas.CD_t, "-"),
                "CD_l_AF": (areas.CD_l_AF, "-"),
                "delta": (areas.delta, "-"),
            }
        )
    yield from _terms(one)
    if one.acting:
        yield "effects:"
    for acting in one.acting:
        yield f"  {acting.name}:"
        yield f"    acts_on: {_text(acting.on)}"
        yield f"    says: {_text(acting.stored.says())}"
        yield from ("  " + row for row in _rows({k: (q.value, q.unit) for k, q in acting.parameters.items()}))
    if one.ranges:
        yield "ranges:"
    for name, low, high, unit in one.ranges:
        yield f"  {legal(name)}: [{number(low)}, {number(high)}]  # {plain(unit)}".rstrip(" #")


def _terms(one: Exported) -> Iterator[str]:
    force = one.force
    if force.basis is None or force.theta is None or force.intercept is None:
        return
    if isfinite(force.basis.length_m):
        yield f"# {STRIPS_SAY}"
        yield "strips:"
        yield from _rows({"half_length": (0.5 * force.basis.length_m, "m")})
    yield "terms:  # V cos(gamma), V sin(gamma) = u_rw, -v_rw: the hull's velocity relative to the air; rc: to the water"
    for k, term in enumerate(force.basis.functions):
        units = ", ".join(plain(unit) for unit in one.model.units[k])
        product = " ".join(FACTORS[factor] for factor in term.factors)
        yield f"  {legal(term.name)}:  # {term.name} = {product} [{units}]"
        yield from ("  " + row for row in _rows({axis: (float(force.theta[k, j]), "") for j, axis in enumerate(AXES)}))
    yield "intercept:"
    yield from _rows(
        {axis: (float(force.intercept[j]), "N m" if axis == "yaw" else "N") for j, axis in enumerate(AXES)}
    )


def _rows(values: Mapping[str, tuple[float, str]]) -> Iterator[str]:
    for key, (value, unit) in values.items():
        yield f"  {key}: {number(value)}" + (f"  # {plain(unit)}" if unit else "")


def _text(text: str) -> str:
    return json.dumps(plain(text))


FORMAT = Format(
    "ros2",
    ".yaml",
    "a ROS 2 parameter file",
    render,
    "use it with: ros2 run PACKAGE NODE --ros-args --params-file {file}",
)
