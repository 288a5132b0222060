"""The physics of a model line by line, in words that every language has: a form only translates and frames them.

An expression is made of numbers, ``+ - * /``, brackets, names of constants and of lines before it, and of `FUNCTIONS`. Given
are ``u v r`` over ground, ``u_dot v_dot r_dot``, ``psi``, and ``wind_N wind_E current_N current_E payload_m payload_x``, zero
where there is none.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import isfinite, pi

from ferryid.effects.force_model import COEFFICIENTS, UNITS
from ferryid.export.exported import Exported
from ferryid.export.names import legal, number
from ferryid.regression.bases import CROSSFLOW_FACTORS, LEAST_SPEED_MPS, Term
from ferryid.types import Floats
from ferryid.vessel.parse_hull import rigid_mass
from ferryid.vessel.profile import Hull, WindAreas
from ferryid.vessel.wind import AIR_DENSITY

FUNCTIONS = ("abs", "atan2", "cos", "hypot", "sin")
AXES = ("X", "Y", "N")
ACCELERATIONS = ("u_dot", "v_dot", "r_dot")
FACTORS = {
    **{name: name for name in (*ACCELERATIONS, "u", "v", "r")},
    **{f"|{name}|": f"abs({name})" for name in "uvr"},
    **{
        f"{factor}_{flow}": expression.format(flow)
        for flow in ("rw", "rc")
        for factor, expression in {
            "V": "hypot(u_{0}, v_{0})",
            "cos": "u_{0}",
            "sin": "(-v_{0})",
            "2cos": "(2.0 * u_{0})",
            "|cos|": "abs(u_{0})",
            "|sin|": "abs(v_{0})",
            "gamma": "(-atan2(v_{0}, u_{0}))",
        }.items()
    },
    **{name: name for name in CROSSFLOW_FACTORS},
}
"""What the factors of a basis's terms are, see `ferryid.regression.bases.term`; V cos(gamma) is the part of a flow along x."""
STRIPS_SAY = (
    "fore: integral of abs(v + x r) (v + x r) for x from 0 to half_length, aft from -half_length to 0; "
    "x_fore, x_aft with x before it"
)
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*")
_MASS_UNITS = (("kg", "kg", "kg m"), ("kg", "kg", "kg m"), ("kg m", "kg m", "kg m^2"))


@dataclass(frozen=True)
class Constant:
    """A number with its unit, and what it is."""

    name: str
    value: float
    unit: str
    says: str


@dataclass(frozen=True)
class Line:
    """``name = expression``, or ``name += expression`` where it `adds`.

    X, Y and N are set first, and then added to or, with `anew`, set again; all other names are set once.
    """

    name: str
    expression: str
    adds: bool = False
    anew: bool = False


@dataclass(frozen=True)
class Block:
    """Lines with a sentence on what they do; `of_wind` where they are only for a wind that is given."""

    says: str
    lines: tuple[Line, ...]
    of_wind: bool = False


@dataclass(frozen=True)
class Physics:
    """A model's constants, the blocks that give X, Y and N, and the nine entries of its mass matrix by rows."""

    constants: tuple[Constant, ...]
    blocks: tuple[Block, ...]
    mass: tuple[str, ...]

    def translated(self, expression: str, constant: Callable[[str], str], functions: Mapping[str, str]) -> str:
        """Return an expression with constants and functions as a language spells them."""
        known = {one.name for one in self.constants}

        def spelt(found: re.Match[str]) -> str:
            name = found[0]
            return constant(name) if name in known else functions.get(name, name)

        return _NAME.sub(spelt, expression)

    def uses(self, name: str) -> bool:
        """Tell whether a line needs a name."""
        return any(name in _NAME.findall(line.expression) for block in self.blocks for line in block.lines)


def physics(one: Exported) -> Physics:
    """Return the lines of `ferryid.models.forces.Estimator`: base hull, wind load, payload, zeta, terms, intercept."""
    constants = {made.name: made for made in _constants(one)}
    wind = _wind(constants) if one.force.profile.wind is not None else ()
    blocks = (
        Block("velocity and acceleration through the water; the current turns in the body frame", _flow()),
        Block("M nu_dot: the rigid body moves over ground, what it takes along through the water", _mass(one.hull)),
        Block("C(nu) nu", _coriolis(constants)),
        Block("D(nu_r) nu_r", tuple(_damping(constants))),
        *((Block("velocity through the air", _relative("rw", "wind")),) if wind or one.needs_wind else ()),
        *((Block("wind load, Blendermann's form; angle of attack 0 from ahead", wind, of_wind=True),) if wind else ()),
        Block("payload", _payload()),
        *((Block("the scale of the measured force", _scale()),) if "zeta" in constants else ()),
        *((Block(STRIPS_SAY, tuple(_strips())),) if "half_length" in constants else ()),
        *_correction(one, constants),
    )
    blocks = _needed(blocks)
    used = " ".join(line.expression for block in blocks for line in block.lines)
    mass = tuple(_entry(constants, i, j) for i in range(3) for j in range(3))
    names = set(_NAME.findall(" ".join((used, *mass))))
    return Physics(tuple(made for made in constants.values() if made.name in names), blocks, mass)


def _needed(blocks: tuple[Block, ...]) -> tuple[Block, ...]:
    """Return blocks without lines that no later one needs, for compilers that mind, and without empty ones."""
    names = set(AXES)
    kept: list[Block] = []
    for block in reversed(blocks):
        lines: list[Line] = []
        for line in reversed(block.lines):
            if line.name in names:
                names |= set(_NAME.findall(line.expression))
                lines.insert(0, line)
        if lines:
            kept.insert(0, replace(block, lines=tuple(lines)))
    return tuple(kept)


def _constants(one: Exported) -> Iterator[Constant]:
    force, hull, areas = one.force, one.hull, one.force.profile.wind
    # The same arithmetic as the hull's own: what is left of M without the rigid body is the water's.
    rigid = rigid_mass(hull.mass_kg, hull.x_g_m, hull.inertia_z)
    for i in range(3):
        for j in range(3):
            if hull.M[i, j] != 0.0:
                yield Constant(
                    f"m{i + 1}{j + 1}",
                    float(hull.M[i, j]),
                    _MASS_UNITS[i][j],
                    "mass matrix of the base model, water included",
                )
    yield Constant("m", float(rigid[0, 0]), "kg", "mass of the rigid body")
    if rigid[1, 2] != 0.0:
        yield Constant("m_x_g", float(rigid[1, 2]), "kg m", "mass times place of the centre of gravity ahead")
    for name, unit in zip(COEFFICIENTS[5:], UNITS[5:], strict=True):
        if hull.D.get(name, 0.0) != 0.0:
            yield Constant(legal(name), float(hull.D[name]), unit, f"damping {name}, negative where it damps")
    if areas is not None:
        yield from _of_air(areas)
    if one.zeta != 1.0:
        yield Constant("zeta", one.zeta, "-", "divides the force of the hull: the scale of the measured one")
    if force.basis is None or force.theta is None or force.intercept is None:
        return
    if isfinite(force.basis.length_m):
        yield Constant("half_length", 0.5 * force.basis.length_m, "m", "half the length of the hull")
        yield Constant("least", LEAST_SPEED_MPS, "m/s", "keeps a speed that is divided by from being zero")
    for k, term in enumerate(force.basis.functions):
        for j, axis in enumerate(AXES):
            if force.theta[k, j] != 0.0:
                yield Constant(
                    coefficient(term, axis), float(force.theta[k, j]), one.model.units[k][j], f"{axis} by {term.name}"
                )
    for axis, value in zip(AXES, force.intercept.tolist(), strict=True):
        if value != 0.0:
            yield Constant(f"constant_{axis}", value, "N m" if axis == "N" else "N", f"constant part of {axis}")


def coefficient(term: Term, axis: str) -> str:
    """Return the name of a term's coefficient on an axis."""
    return f"k_{legal(term.name)}_{axis}"


def _of_air(areas: WindAreas) -> Iterator[Constant]:
    yield Constant("air_density", AIR_DENSITY, "kg/m^3", "density of the air")
    yield Constant("A_frontal", areas.frontal_m2, "m^2", "frontal area above water")
    yield Constant("A_lateral", areas.lateral_m2, "m^2", "lateral area above water")
    yield Constant("L_air", areas.length_m, "m", "length that goes with the lateral area")
    if areas.S_L_m != 0.0:
        yield Constant("S_L", areas.S_L_m, "m", "centroid of the lateral area ahead of the body origin")
    yield Constant("CD_t", areas.CD_t, "-", "drag from the side")
    yield Constant("CD_l_AF", areas.CD_l_AF, "-", "drag from ahead")
    yield Constant("delta_air", areas.delta, "-", "cross-force parameter")


def _flow() -> tuple[Line, ...]:
    return (
        Line("c", "cos(psi)"),
        Line("s", "sin(psi)"),
        Line("u_c", "c * current_N + s * current_E"),
        Line("v_c", "c * current_E - s * current_N"),
        Line("u_rc", "u - u_c"),
        Line("v_rc", "v - v_c"),
        Line("u_rc_dot", "u_dot - r * v_c"),
        Line("v_rc_dot", "v_dot + r * u_c"),
    )


def _mass(hull: Hull) -> tuple[Line, ...]:
    rigid = rigid_mass(hull.mass_kg, hull.x_g_m, hull.inertia_z)
    names = {(0, 0): "m", (1, 1): "m", (1, 2): "m_x_g", (2, 1): "m_x_g"}
    lines = []
    for i, axis in enumerate(AXES):
        parts = []
        for j, rate in enumerate(ACCELERATIONS):
            total, own = hull.M[i, j] != 0.0, (i, j) in names and rigid[i, j] != 0.0
            # A current that does not turn leaves the yaw acceleration as it is: rigid body and water add up.
            if j == 2:
                parts += [f"m{i + 1}3 * r_dot"] if total else []
                continue
            parts += [f"{names[i, j]} * {rate}"] if own else []
            water = [f"m{i + 1}{j + 1}"] if total else []
            if water or own:
                added = f"({' - '.join([*(water or ['0.0']), names[i, j]])})" if own else water[0]
                parts.append(f"{added} * {rate.replace('_dot', '_rc_dot')}")
        lines.append(Line(axis, " + ".join(parts) or "0.0"))
    return tuple(lines)


def _coriolis(constants: Mapping[str, Constant]) -> tuple[Line, ...]:
    moment = "m_x_g" if "m_x_g" in constants else ""
    coupled = " + ".join(name for name in ("m23", "m32") if name in constants)
    arm = " - ".join(filter(None, (f"0.5 * ({coupled})" if coupled else "0.0", moment)))
    return (
        Line("c13", "-m * v" + (f" - {moment} * r" if moment else "")),
        Line("c23", "m * u"),
        Line("c13_rc", "-(m22 - m) * v_rc" + (f" - ({arm}) * r" if coupled or moment else "")),
        Line("c23_rc", "(m11 - m) * u_rc"),
        Line("X", "(c13 + c13_rc) * r", adds=True),
        Line("Y", "(c23 + c23_rc) * r", adds=True),
        Line("N", "-c13 * u - c23 * v - c13_rc * u_rc - c23_rc * v_rc", adds=True),
    )


_DAMPED = (
    ("X", "u_rc", (("X_u", ""), ("X_|u|u", "abs(u_rc)"), ("X_uuu", "u_rc * u_rc"))),
    ("Y", "v_rc", (("Y_v", ""), ("Y_|v|v", "abs(v_rc)"), ("Y_|r|v", "abs(r)"), ("Y_vvv", "v_rc * v_rc"))),
    ("Y", "r", (("Y_r", ""), ("Y_|v|r", "abs(v_rc)"), ("Y_|r|r", "abs(r)"))),
    ("Y", "u_rc", (("Y_uv", "v_rc"), ("Y_ur", "r"))),
    ("N", "v_rc", (("N_v", ""), ("N_|v|v", "abs(v_rc)"), ("N_|r|v", "abs(r)"))),
    ("N", "r", (("N_r", ""), ("N_|v|r", "abs(v_rc)"), ("N_|r|r", "abs(r)"), ("N_rrr", "r * r"))),
    ("N", "u_rc", (("N_uv", "v_rc"), ("N_ur", "r"))),
)
"""Axis, velocity that a bracket of coefficients multiplies, and in it each coefficient with what it multiplies."""


def _damping(constants: Mapping[str, Constant]) -> Iterator[Line]:
    for axis, velocity, parts in _DAMPED:
        known = [(legal(name), by) for name, by in parts if legal(name) in constants]
        if known:
            inside = " + ".join(f"{name} * {by}" if by else name for name, by in known)
            yield Line(axis, f"-({inside}) * {velocity}", adds=True)


def _relative(flow: str, what: str) -> tuple[Line, ...]:
    return (
        Line(f"u_{flow}", f"u - (c * {what}_N + s * {what}_E)"),
        Line(f"v_{flow}", f"v - (c * {what}_E - s * {what}_N)"),
    )


def _wind(constants: Mapping[str, Constant]) -> tuple[Line, ...]:
    lever = "S_L / L_air" if "S_L" in constants else "0.0"
    half = number(0.5 * pi)
    return (
        Line("gamma", "-atan2(v_rw, u_rw)"),
        Line("pressure", "0.5 * air_density * (u_rw * u_rw + v_rw * v_rw)"),
        Line("turned", "sin(2.0 * gamma)"),
        Line("crossed", "1.0 - CD_l_AF * A_frontal / A_lateral / CD_t"),
        Line("below", "1.0 - 0.5 * delta_air * crossed * turned * turned"),
        Line("sideways", "pressure * A_lateral * CD_t * sin(gamma) / below"),
        Line("X", "pressure * A_frontal * CD_l_AF * cos(gamma) / below", adds=True),
        Line("Y", "-sideways", adds=True),
        Line("N", f"-({lever} - 0.18 * (abs(gamma) - {half})) * L_air * sideways", adds=True),
    )


def _payload() -> tuple[Line, ...]:
    return (
        Line("X", "payload_m * (u_dot - v * r - payload_x * r * r)", adds=True),
        Line("across", "payload_m * (v_dot + payload_x * r_dot + u * r)"),
        Line("Y", "across", adds=True),
        Line("N", "payload_x * across", adds=True),
    )


def _scale() -> tuple[Line, ...]:
    return tuple(Line(axis, f"{axis} / zeta", anew=True) for axis in AXES)


def _strips() -> Iterator[Line]:
    """Yield the lines of `crossflow_integrals`: ``even`` and ``odd`` of each half, and the integrals made of them."""
    for half, sign in (("fore", "+"), ("aft", "-")):
        end, both, even, odd = (f"{name}_{half}" for name in ("end", "both", "even", "odd"))
        crossing = f"crossing_{half}"
        yield Line(end, f"v {sign} half_length * r")
        yield Line(both, f"abs(v) + abs({end}) + least")
        yield Line(even, f"(v + {end}) / {both} * (v * v + abs(v) * abs({end}) + {end} * {end}) / 3.0")
        yield Line(crossing, f"0.5 * (abs(v) * abs({end}) - v * {end}) / {both}")
        yield Line(
            odd,
            f"(abs({end}) * {end} - abs(v) * v) / 6.0 - {crossing} * {crossing} * ({end} - v) / {both} / 3.0",
        )
        yield Line(half, f"half_length * {even}")
        yield Line(f"x_{half}", f"{'' if sign == '+' else '-'}0.5 * half_length * half_length * ({even} + {odd})")


def _correction(one: Exported, constants: Mapping[str, Constant]) -> Iterator[Block]:
    functions = one.force.basis
    if functions is None:
        return
    for term in functions.functions:
        product = " * ".join(FACTORS[factor] for factor in term.factors)
        acting = [axis for axis in AXES if coefficient(term, axis) in constants]
        lines = tuple(Line(axis, f"{coefficient(term, axis)} * {product}", adds=True) for axis in acting)
        yield Block(f"term {term.name}", lines)
    fixed = [axis for axis in AXES if f"constant_{axis}" in constants]
    yield Block("constant part", tuple(Line(axis, f"constant_{axis}", adds=True) for axis in fixed))


_ABOARD = {(0, 0): "payload_m", (1, 1): "payload_m", (2, 2): "payload_m * payload_x * payload_x"}
_ABOARD |= dict.fromkeys(((1, 2), (2, 1)), "payload_m * payload_x")


def _entry(constants: Mapping[str, Constant], i: int, j: int) -> str:
    """Return an entry of the matrix by which the force grows with the acceleration."""
    name = f"m{i + 1}{j + 1}"
    parts = [*([name] if name in constants else []), *([_ABOARD[i, j]] if (i, j) in _ABOARD else [])]
    entry = " + ".join(parts)
    if "zeta" in constants and entry:
        entry = f"({entry}) / zeta"
    term = f"k_{ACCELERATIONS[j]}_{AXES[i]}"
    return " + ".join(filter(None, (entry, term if term in constants else ""))) or "0.0"


def solved(matrix: Callable[[int, int], str], right: Callable[[int], str]) -> tuple[str, tuple[str, ...]]:
    """Return Cramer's rule for three unknowns: the determinant, and the numerators of the solution.

    Parameters
    ----------
    matrix, right
        How an entry of the matrix and of the right side are spelt, counted from 0.
    """

    def minor(i: int, j: int) -> str:
        a, b = (k for k in range(3) if k != i)
        c, d = (k for k in range(3) if k != j)
        return f"({matrix(a, c)} * {matrix(b, d)} - {matrix(a, d)} * {matrix(b, c)})"

    def signed(terms: list[tuple[int, str]]) -> str:
        first, *rest = (("-" if odd % 2 else "", text) for odd, text in terms)
        return first[0] + first[1] + "".join(f" {sign or '+'} {text}" for sign, text in rest)

    determinant = signed([(j, f"{matrix(0, j)} * {minor(0, j)}") for j in range(3)])
    numerators = tuple(signed([(i + j, f"{right(i)} * {minor(i, j)}") for i in range(3)]) for j in range(3))
    return determinant, numerators


def listed(values: Floats) -> str:
    """Return numbers with commas between."""
    return ", ".join(number(value) for value in values.tolist())
