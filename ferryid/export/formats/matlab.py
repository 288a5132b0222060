"""MATLAB and Octave: a vessel function as in Fossen's Marine Systems Simulator; called without arguments, it checks itself."""

from __future__ import annotations

from collections.abc import Iterator

from ferryid.export.cases import tolerances
from ferryid.export.exported import Exported
from ferryid.export.format import Format
from ferryid.export.names import number, plain
from ferryid.export.physics import Physics, physics
from ferryid.export.words import beside, commented, effect_numbers, frames, heading, limits
from ferryid.types import Floats

_CODE = """
if nargin == 0
    xdot = self_test();
    M = [];
    return
end
if nargin < 3, wind = []; end
if nargin < 4, current = []; end
if nargin < 5, payload = []; end
nu = reshape(x(1:3), 3, 1);
psi = x(6);
M = mass_matrix(payload);
nu_dot = M \\ (reshape(tau, 3, 1) - force_of_motion([0; 0; 0], nu, psi, wind, current, payload));
xdot = [nu_dot; cos(psi) * nu(1) - sin(psi) * nu(2); sin(psi) * nu(1) + cos(psi) * nu(2); nu(3)];
end

function tau = force_of_motion(nu_dot, nu, psi, wind, current, payload)
% The force X, Y [N] and N [N m] that a motion takes; [] for a wind, current or payload that is not given.
p = parameters();
u_dot = nu_dot(1); v_dot = nu_dot(2); r_dot = nu_dot(3);
u = nu(1); v = nu(2); r = nu(3);
{needs}wind_N = 0.0; wind_E = 0.0;
if ~isempty(wind), wind_N = wind(1); wind_E = wind(2); end
current_N = 0.0; current_E = 0.0;
if ~isempty(current), current_N = current(1); current_E = current(2); end
payload_m = 0.0; payload_x = 0.0;
if ~isempty(payload), payload_m = payload(1); payload_x = payload(2); end
{body}
tau = [X; Y; N];
end

function M = mass_matrix(payload)
% The matrix by which the force grows with the acceleration [kg, kg m, kg m^2].
p = parameters();
payload_m = 0.0; payload_x = 0.0;
if ~isempty(payload), payload_m = payload(1); payload_x = payload(2); end
M = zeros(3, 3);
{entries}
end

function p = parameters()
{constants}
end

function wrong = self_test()
% How many values differ from those that ferryid gives for the same states: 0 where all is well.
off_tau = {tau_tolerance};
off_rate = {rate_tolerance};
wrong = 0;
{cases}
if wrong == 0
    disp('{label}: every value as ferryid gives it');
else
    disp(['{label}: ' num2str(wrong) ' values are wrong']);
end
end
"""


def render(one: Exported) -> str:
    """Return the function."""
    lines = physics(one)
    tau_off, rate_off = tolerances(one.cases)
    head = [
        f"{one.name.upper()}  [xdot, M] = {one.name}(x, tau, wind, current, payload)",
        "",
        "x = [u v r x y psi]' with x, y [m] north and east; xdot its rate under the force tau = [X Y N]'; M the mass matrix",
        "  with the payload. wind, current and payload, of two numbers each, may be left out or [].",
        f"{one.name}() checks itself and returns how many values are wrong.",
        "",
        *heading(one),
        "",
        *frames(one),
        "",
        *limits(one),
        *beside(one),
    ]
    code = _CODE.format(
        needs="".join(_needs(one)),
        body="\n".join(_body(lines)),
        entries="\n".join(
            f"M({k // 3 + 1}, {k % 3 + 1}) = {_translated(lines, entry)};" for k, entry in enumerate(lines.mass)
        ),
        constants="\n".join(_constants(one, lines)),
        tau_tolerance=_column(tau_off),
        rate_tolerance=_column(rate_off),
        cases="\n".join(_cases(one)),
        label=plain(one.model.label).replace("'", "''"),
    )
    return f"function [xdot, M] = {one.name}(x, tau, wind, current, payload)\n{commented(head, '%')}{code}"


def _constants(one: Exported, lines: Physics) -> Iterator[str]:
    for made in lines.constants:
        yield f"p.{made.name} = {number(made.value)}; % [{plain(made.unit)}] {plain(made.says)}"
    for name, value, unit in effect_numbers(one):
        yield f"p.{name} = {number(value)}; % [{unit}] not in the force"


def _needs(one: Exported) -> Iterator[str]:
    for what, needed in (("wind", one.needs_wind), ("current", one.needs_current)):
        if needed:
            yield f"if isempty({what})\n"
            yield f"    error('the model has terms of the {what}: give it, [0 0] where it is still');\nend\n"


def _body(lines: Physics) -> Iterator[str]:
    for block in lines.blocks:
        yield f"% {plain(block.says)}"
        if block.of_wind:
            yield "if ~isempty(wind)"
        for line in block.lines:
            margin = "    " if block.of_wind else ""
            expression = _translated(lines, line.expression)
            yield f"{margin}{line.name} = {f'{line.name} + ({expression})' if line.adds else expression};"
        if block.of_wind:
            yield "end"


def _translated(lines: Physics, expression: str) -> str:
    return lines.translated(expression, lambda name: f"p.{name}", {})


def _column(values: Floats | None) -> str:
    return "[]" if values is None else f"[{'; '.join(number(value) for value in values.tolist())}]"


def _cases(one: Exported) -> Iterator[str]:
    for case in one.cases:
        optional = ", ".join(_column(part) for part in (case.wind, case.current, case.payload))
        nu, psi = _column(case.nu), number(case.psi)
        yield f"tau = force_of_motion({_column(case.nu_dot)}, {nu}, {psi}, {optional});"
        yield f"wrong = wrong + sum(~(abs(tau - {_column(case.tau)}) <= off_tau));"
        if case.rate is not None:
            yield f"xdot = {one.name}([{nu}; 0.0; 0.0; {psi}], {_column(case.push)}, {optional});"
            yield f"wrong = wrong + sum(~(abs(xdot(1:3) - {_column(case.rate)}) <= off_rate));"


FORMAT = Format(
    "matlab",
    ".m",
    "a function for MATLAB or Octave, in the style of Fossen's MSS",
    render,
    "check it: {name}() returns 0",
    names_file=True,
)
