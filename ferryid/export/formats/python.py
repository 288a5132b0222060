"""Python: a module that needs nothing but ``math``, and checks itself when it is run."""

from __future__ import annotations

from collections.abc import Iterator

from ferryid.export.cases import Case, tolerances
from ferryid.export.exported import Exported
from ferryid.export.format import Format
from ferryid.export.names import number, plain
from ferryid.export.physics import Block, Physics, listed, physics, solved
from ferryid.export.words import beside, commented, effect_numbers, frames, heading, limits
from ferryid.types import Floats

_FUNCTIONS = {name: f"math.{name}" for name in ("atan2", "cos", "hypot", "sin")}

_FORCE = '''
def force(nu_dot, nu, psi, wind=None, current=None, payload=None):
    """Return X, Y [N] and N [N m], the force that a motion takes; see the head of this file for units and signs."""
    u_dot, v_dot, r_dot = nu_dot
    u, v, r = nu
{needs}    wind_N, wind_E = wind if wind is not None else (0.0, 0.0)
    current_N, current_E = current if current is not None else (0.0, 0.0)
    payload_m, payload_x = payload if payload is not None else (0.0, 0.0)
{body}
    return X, Y, N


def mass(payload=None):
    """Return the matrix by which the force grows with the acceleration [kg, kg m, kg m^2]."""
    payload_m, payload_x = payload if payload is not None else (0.0, 0.0)
    return (
{rows}
    )


def acceleration(tau, nu, psi, wind=None, current=None, payload=None):
    """Return the acceleration u_dot, v_dot [m/s^2] and r_dot [rad/s^2] under a force."""
    still = force((0.0, 0.0, 0.0), nu, psi, wind, current, payload)
    M = mass(payload)
    b = tuple(one - other for one, other in zip(tau, still))
    determinant = {determinant}
    return (
        ({numerators[0]}) / determinant,
        ({numerators[1]}) / determinant,
        ({numerators[2]}) / determinant,
    )


# States with what ferryid gives for them: nu_dot, nu, psi, wind, current, payload; the force that it takes; another force, and
# the acceleration under it (None: the mass matrix cannot be inverted).
CASES = (
{cases}
)
TOLERANCES = ({tau_tolerance}), ({rate_tolerance})


def self_test():
    """Return how many values differ from those of ferryid."""
    wrong = 0
    for nu_dot, nu, psi, wind, current, payload, tau, push, rate in CASES:
        pairs = [(force(nu_dot, nu, psi, wind, current, payload), tau, TOLERANCES[0])]
        if rate is not None:
            pairs.append((acceleration(push, nu, psi, wind, current, payload), rate, TOLERANCES[1]))
        for found, wanted, tolerance in pairs:
            wrong += sum(not abs(a - b) <= off for a, b, off in zip(found, wanted, tolerance))
    return wrong


if __name__ == "__main__":
    import sys

    count = self_test()
    print("{label}: " + ("every value as ferryid gives it" if count == 0 else "%d values are wrong" % count))
    sys.exit(1 if count else 0)
'''


def render(one: Exported) -> str:
    """Return the module."""
    lines = physics(one)
    determinant, numerators = solved(lambda i, j: f"M[{i}][{j}]", lambda i: f"b[{i}]")
    tau_tolerance, rate_tolerance = tolerances(one.cases)
    rows = [", ".join(_translated(lines, entry) for entry in lines.mass[3 * i : 3 * i + 3]) for i in range(3)]
    code = _FORCE.format(
        needs="".join(_needs(one)),
        body="\n".join(_body(lines)),
        rows="\n".join(f"        ({row})," for row in rows),
        determinant=determinant,
        numerators=numerators,
        cases="\n".join(_case(case) for case in one.cases),
        tau_tolerance=listed(tau_tolerance),
        rate_tolerance=listed(rate_tolerance),
        label=plain(one.model.label).replace('"', "'"),
    )
    head = [*heading(one), "", *frames(one), "", *limits(one), *beside(one)]
    return "\n".join([commented(head, "#"), "", "import math", "", *_constants(one, lines), code])


def _constants(one: Exported, lines: Physics) -> Iterator[str]:
    for made in lines.constants:
        yield f"{made.name} = {number(made.value)}  # [{plain(made.unit)}] {plain(made.says)}"
    for name, value, unit in effect_numbers(one):
        yield f"{name} = {number(value)}  # [{unit}] not in the force"
    yield ""


def _needs(one: Exported) -> Iterator[str]:
    for what, needed in (("wind", one.needs_wind), ("current", one.needs_current)):
        if needed:
            yield f"    if {what} is None:\n"
            yield f'        raise ValueError("the model has terms of the {what}: give it, (0.0, 0.0) where it is still")\n'


def _body(lines: Physics) -> Iterator[str]:
    for block in lines.blocks:
        yield f"    # {plain(block.says)}"
        margin = "    "
        if block.of_wind:
            yield "    if wind is not None:"
            margin = "        "
        yield from (margin + line for line in _statements(block, lines))


def _statements(block: Block, lines: Physics) -> Iterator[str]:
    for line in block.lines:
        yield f"{line.name} {'+=' if line.adds else '='} {_translated(lines, line.expression)}"


def _translated(lines: Physics, expression: str) -> str:
    return lines.translated(expression, str, _FUNCTIONS)


def _case(case: Case) -> str:
    def tuple_of(values: Floats | None) -> str:
        return "None" if values is None else f"({listed(values)})"

    parts = (case.nu_dot, case.nu, case.psi, case.wind, case.current, case.payload, case.tau, case.push, case.rate)
    return "    (" + ", ".join(number(p) if isinstance(p, float) else tuple_of(p) for p in parts) + "),"


FORMAT = Format(
    "python",
    ".py",
    "a Python module without dependencies",
    render,
    "check it with: python {file}",
)
