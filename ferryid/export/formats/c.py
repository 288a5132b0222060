"""C: one header for C99 and C++ that needs nothing but ``math.h``."""

from __future__ import annotations

from collections.abc import Iterator

from ferryid.export.cases import tolerances
from ferryid.export.exported import Exported
from ferryid.export.format import Format
from ferryid.export.names import number, plain
from ferryid.export.physics import AXES, Physics, listed, physics, solved
from ferryid.export.words import beside, effect_numbers, frames, heading, limits
from ferryid.types import Floats

_FUNCTIONS = {"abs": "fabs"}
_STATE = "double psi, const double *wind, const double *current, const double *payload"

_CODE = """
/* The force that a motion takes: tau[3] from nu_dot[3], nu[3] and psi. wind[2], current[2] and payload[2] may be NULL. */
static inline void {name}_force(const double *nu_dot, const double *nu, {state}, double *tau)
{{
    const double u_dot = nu_dot[0], v_dot = nu_dot[1], r_dot = nu_dot[2];
    const double u = nu[0], v = nu[1], r = nu[2];
    const double current_N = current ? current[0] : 0.0, current_E = current ? current[1] : 0.0;
    const double payload_m = payload ? payload[0] : 0.0, payload_x = payload ? payload[1] : 0.0;
{needs}{body}
    tau[0] = X;
    tau[1] = Y;
    tau[2] = N;
}}

/* The matrix by which the force grows with the acceleration [kg, kg m, kg m^2]: nine entries by rows. */
static inline void {name}_mass(const double *payload, double *M)
{{
    const double payload_m = payload ? payload[0] : 0.0, payload_x = payload ? payload[1] : 0.0;
{entries}
}}

/* The acceleration nu_dot[3] under a force tau[3]. */
static inline void {name}_acceleration(const double *tau, const double *nu, {state}, double *nu_dot)
{{
    const double none[3] = {{0.0, 0.0, 0.0}};
    double still[3], b[3], M[9], determinant;
    {name}_force(none, nu, psi, wind, current, payload, still);
    {name}_mass(payload, M);
    b[0] = tau[0] - still[0];
    b[1] = tau[1] - still[1];
    b[2] = tau[2] - still[2];
    determinant = {determinant};
    nu_dot[0] = ({numerators[0]}) / determinant;
    nu_dot[1] = ({numerators[1]}) / determinant;
    nu_dot[2] = ({numerators[2]}) / determinant;
}}

static inline double {name}_wrong(const double *found, const double *wanted, const double *off)
{{
    /* Not a number is wrong, too. */
    return (fabs(found[0] - wanted[0]) <= off[0] ? 0.0 : 1.0) + (fabs(found[1] - wanted[1]) <= off[1] ? 0.0 : 1.0)
        + (fabs(found[2] - wanted[2]) <= off[2] ? 0.0 : 1.0);
}}

/* How many values differ from those that ferryid gives for the same states: 0.0 where all is well. */
static inline double {name}_self_test(void)
{{
    const double off_tau[3] = {{{tau_tolerance}}};
{rate_tolerance}    double wrong = 0.0, found[3];
{cases}
    return wrong;
}}
"""


def render(one: Exported) -> str:
    """Return the header."""
    lines = physics(one)
    determinant, numerators = solved(lambda i, j: f"M[{3 * i + j}]", lambda i: f"b[{i}]")
    tau_off, rate_off = tolerances(one.cases)
    forward = any(case.rate is not None for case in one.cases)
    code = _CODE.format(
        name=one.name,
        state=_STATE,
        needs="".join(_needs(one, lines)),
        body="\n".join(_body(one, lines)),
        entries="\n".join(_entries(one, lines)),
        determinant=determinant,
        numerators=numerators,
        tau_tolerance=listed(tau_off),
        rate_tolerance=f"    const double off_rate[3] = {{{listed(rate_off)}}};\n" if forward else "",
        cases="\n".join(_cases(one)),
    )
    guard = f"{one.name.upper()}_H"
    head = [*heading(one), "", *frames(one), "", *limits(one), *beside(one)]
    return "\n".join(
        [
            "/*",
            *(f" * {line}".rstrip() for line in head),
            " */",
            f"#ifndef {guard}",
            f"#define {guard}",
            "",
            "#include <math.h>",
            "",
            *_constants(one, lines),
            code,
            f"#endif /* {guard} */",
            "",
        ]
    )


def _constants(one: Exported, lines: Physics) -> Iterator[str]:
    for made in lines.constants:
        comment = f"[{plain(made.unit)}] {plain(made.says)}"
        yield f"static const double {one.name}_{made.name} = {number(made.value)}; /* {comment} */"
    for name, value, unit in effect_numbers(one):
        yield f"#define {one.name.upper()}_{name.upper()} ({number(value)}) /* [{unit}] not in the force */"


def _needs(one: Exported, lines: Physics) -> Iterator[str]:
    """Yield what becomes of arguments that are missing, or that the model does not look at."""
    if lines.uses("wind_N"):
        yield "    const double wind_N = wind ? wind[0] : 0.0, wind_E = wind ? wind[1] : 0.0;\n"
    elif not one.needs_wind:
        yield "    (void)wind;\n"
    needed = [what for what, needs in (("wind", one.needs_wind), ("current", one.needs_current)) if needs]
    if needed:
        yield f"    if ({' || '.join(f'!{what}' for what in needed)}) {{\n"
        yield "        /* The model has terms of it: without it, the result is undefined. */\n"
        yield "        tau[0] = tau[1] = tau[2] = NAN;\n        return;\n    }\n"


def _body(one: Exported, lines: Physics) -> Iterator[str]:
    for block in lines.blocks:
        yield f"    /* {plain(block.says)} */"
        if block.of_wind:
            yield "    if (wind) {"
        for line in block.lines:
            expression = _translated(one, lines, line.expression)
            first = not line.adds and not line.anew
            kind = ("double " if line.name in AXES else "const double ") if first else ""
            margin = "        " if block.of_wind else "    "
            yield f"{margin}{kind}{line.name} {'+=' if line.adds else '='} {expression};"
        if block.of_wind:
            yield "    }"


def _entries(one: Exported, lines: Physics) -> Iterator[str]:
    for k, entry in enumerate(lines.mass):
        yield f"    M[{k}] = {_translated(one, lines, entry)};"


def _translated(one: Exported, lines: Physics, expression: str) -> str:
    return lines.translated(expression, lambda name: f"{one.name}_{name}", _FUNCTIONS)


def _cases(one: Exported) -> Iterator[str]:
    for case in one.cases:
        yield "    {"
        optional = {"wind": case.wind, "current": case.current, "payload": case.payload}
        arrays: dict[str, Floats | None] = {"nu_dot": case.nu_dot, "nu": case.nu, **optional, "tau": case.tau}
        if case.rate is not None:
            arrays |= {"push": case.push, "rate": case.rate}
        for name, values in arrays.items():
            if values is not None:
                yield f"        const double {name}[{len(values)}] = {{{listed(values)}}};"
        given = ", ".join(name if values is not None else "0" for name, values in optional.items())
        state = f"nu, {number(case.psi)}, {given}, found"
        yield f"        {one.name}_force(nu_dot, {state});"
        yield f"        wrong += {one.name}_wrong(found, tau, off_tau);"
        if case.rate is not None:
            yield f"        {one.name}_acceleration(push, {state});"
            yield f"        wrong += {one.name}_wrong(found, rate, off_rate);"
        yield "    }"


FORMAT = Format(
    "c",
    ".h",
    "one C99 header, for C++ too",
    render,
    "check it: {name}_self_test() returns 0.0",
)
