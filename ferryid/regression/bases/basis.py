"""Bases of the correction: functions of motion, listed in `ferryid.regression.bases.forms`, and of wind and current."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite, nan

import numpy as np
from numpy.typing import NDArray

from ferryid.cached import cached_property
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.regression.bases.crossflow_integrals import crossflow_integrals
from ferryid.regression.bases.forms import basis_forms
from ferryid.regression.bases.term import CROSSFLOW_FACTORS, SURGE, SWAY, YAW, Term, terms
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats

Unit = tuple[str, str, str]
Rows = NDArray[np.bool_] | NDArray[np.int64] | slice

STRUCTURES = ("coupled", "decoupled")

_EVERY_ROW = slice(None)
_OWN = (
    ("u", "|u|", "u_dot"),
    ("v", "|v|", "v_dot", *CROSSFLOW_FACTORS),
    ("r", "|r|", "r_dot", *CROSSFLOW_FACTORS),
)
"""Factors of each axis, which are zero, or only part of what they stand for, without motion on it."""
_SIZED = re.compile(r"(.+)-(\d{1,4}(?:\.\d{1,4})?)m")

BASES: Mapping[str, tuple[Term, ...]] = {name: form.terms for name, form in basis_forms().items()}
"""Functions of motion alone, a file each in `ferryid.regression.bases.forms`."""

_ACROSS = (SWAY, YAW)

WIND: Mapping[str, tuple[Term, ...]] = {
    "thesis": terms(
        ("V_rw^2 cos(gamma_rw)", "V_rw cos_rw", (SURGE,)),
        ("V_rw^2 sin(gamma_rw)", "V_rw sin_rw", _ACROSS),
        ("V_rw^2 sin(2gamma_rw)", "2cos_rw sin_rw", (YAW,)),
    ),
    "paper": terms(
        ("V_rw^2 cos(gamma_rw)", "V_rw cos_rw", (SURGE,)),
        ("V_rw^2 sin(gamma_rw)", "V_rw sin_rw", _ACROSS),
        ("V_rw^2 sin(gamma_rw)gamma_rw", "V_rw sin_rw gamma_rw", (YAW,)),
    ),
}
"""Functions of the apparent wind: thesis (3.6) and paper (18)."""

CURRENT: Mapping[str, tuple[Term, ...]] = {
    "thesis": terms(
        ("V_rc^2 cos(gamma_rc)|cos(gamma_rc)|", "|cos|_rc cos_rc", (SURGE,)),
        ("V_rc^2 sin(gamma_rc)|sin(gamma_rc)|", "|sin|_rc sin_rc", _ACROSS),
        ("V_rc^2 sin(gamma_rc)", "V_rc sin_rc", _ACROSS),
        ("V_rc^2 sin(2gamma_rc)", "2cos_rc sin_rc", (YAW,)),
    ),
    "paper": terms(
        ("V_rc^2 cos(gamma_rc)", "V_rc cos_rc", (SURGE,)),
        ("V_rc^2 sin(gamma_rc)", "V_rc sin_rc", _ACROSS),
        ("V_rc^2 sin(gamma_rc)gamma_rc", "V_rc sin_rc gamma_rc", (YAW,)),
    ),
}
"""Functions of the velocity through the water: thesis (3.7) and paper (19)."""


@dataclass(frozen=True)
class Basis:
    """K basis functions of one vessel's motion and, where measured, of wind and current.

    Attributes
    ----------
    name
        Name that `make_basis` takes: ``"modulus"``, ``"thesis+wind-paper"``, ``"cross-flow-5m"``.
    structure
        ``"coupled"`` or ``"decoupled"``.
    functions
        The functions in order.
    mask
        True where a term may act on an axis (surge, sway, yaw), shape (K, 3).
    length_m
        Length of the hull [m]; NaN where no function needs it.
    """

    name: str
    structure: str
    functions: tuple[Term, ...]
    mask: Flags
    length_m: float = nan

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the functions, K of them."""
        return tuple(term.name for term in self.functions)

    @property
    def units(self) -> tuple[Unit, ...]:
        """Units of the coefficients in surge, sway and yaw, K rows of three."""
        return tuple(coefficient_units(term) for term in self.functions)

    @cached_property
    def needs_wind(self) -> bool:
        """True where a function depends on the apparent wind."""
        return self._needs("rw")

    @cached_property
    def needs_current(self) -> bool:
        """True where a function depends on the velocity through the water."""
        return self._needs("rc")

    def _needs(self, flow: str) -> bool:
        return any(factor.endswith(f"_{flow}") for term in self.functions for factor in term.factors)

    def without(self, axes: Sequence[int]) -> Basis:
        """Return the basis for motion without some axes: no function acts on one, and none that has its velocity in it acts.

        The apparent wind stays, whose part across the hull is the wind's own for the most part.
        """
        mask = self.mask.copy()
        for axis in axes:
            mask[:, axis] = False
            mask[[any(factor in _OWN[axis] for factor in term.factors) for term in self.functions]] = False
        mask.setflags(write=False)
        return replace(self, mask=mask)

    def fill(
        self,
        out: Floats,
        nu: Floats,
        nu_dot: Floats,
        wind_rel: Floats | None = None,
        current_rel: Floats | None = None,
    ) -> None:
        """Write the functions into the rows of `out`, one function a row: the layout of cross-products.

        Parameters
        ----------
        out
            Shape (K, n), overwritten.
        nu, nu_dot
            Velocity [m/s, m/s, rad/s] and acceleration, FRD, shape (n, 3).
        wind_rel, current_rel
            Velocity of the hull relative to air and to water along its x and y axes [m/s], shape (n, 2).

        Raises
        ------
        FerryIdError
            Where a function needs a wind or current that is not given.
        """
        values = _factors(nu, nu_dot)
        if isfinite(self.length_m):
            values.update(crossflow_integrals(values["v"], values["r"], self.length_m))
        for flow, relative, what, needed in (
            ("rw", wind_rel, "wind", self.needs_wind),
            ("rc", current_rel, "current", self.needs_current),
        ):
            if needed:
                if relative is None:
                    raise FerryIdError(
                        f'basis "{self.name}": needs {what}, and there is none for these rows. '
                        f"Fix: map {what} in the vessel profile, or use the basis without it"
                    )
                values.update(_flow_factors(relative, flow))
        for row, term in zip(out, self.functions, strict=True):
            first, *rest = term.factors
            if not rest:
                row[:] = values[first]
                continue
            np.multiply(values[first], values[rest[0]], out=row)
            for factor in rest[1:]:
                row *= values[factor]

    def evaluate(
        self,
        nu: Floats,
        nu_dot: Floats,
        wind_rel: Floats | None = None,
        current_rel: Floats | None = None,
    ) -> Floats:
        """Return the functions as a matrix with one row a sample, shape (n, K); arguments as in `fill`."""
        out = np.empty((len(self.functions), len(nu)))
        self.fill(out, nu, nu_dot, wind_rel, current_rel)
        return out.T

    def of(self, motion: Motion, rows: Rows = _EVERY_ROW) -> Floats:
        """Return the functions for rows of a motion, shape (n, K); NaN where a needed measurement is missing.

        Raises
        ------
        FerryIdError
            Where a function needs a wind or current that the log does not have.
        """
        nu, psi = motion.nu[rows], motion.eta[rows, 2]
        wind = None if motion.wind is None else relative_flow(nu, psi, motion.wind[rows])
        current = None if motion.current is None else relative_flow(nu, psi, motion.current[rows])
        return self.evaluate(nu, motion.nu_dot[rows], wind, current)


def make_basis(
    name: str,
    *,
    wind: str | None = None,
    current: str | None = None,
    structure: str = "coupled",
) -> Basis:
    """Return a named basis.

    The intercept is not part of it: SIMPLS takes it from the means. Terms of wind and current exist only where
    they were measured; thesis (3.4), (3.6), (3.7) and paper (16), (18), (19).

    Parameters
    ----------
    name
        One of `BASES`. One that needs the hull's length has it behind, see `with_hull_length`. A name as in
        `Basis.name`, ``"modulus+wind-paper+current-thesis"``, sets wind and current too.
    wind, current
        ``"thesis"``, ``"paper"`` or None for no such functions.
    structure
        ``"coupled"``: every function may act on every axis. ``"decoupled"``: only on the axes on which the basis's own file
        says that it acts; a term of wind or current where it acts in (2.15)-(2.20).

    Raises
    ------
    FerryIdError
        For a name or structure that does not exist, with the nearest that does, or a length that is missing.
    """
    head, *extensions = name.split("+")
    extensions_of = {"wind": wind, "current": current}
    for extension in extensions:
        kind, _, form = extension.partition("-")
        if kind not in extensions_of:
            raise _unknown("basis extension", extension, [f"{k}-{f}" for k in extensions_of for f in WIND])
        extensions_of[kind] = form
    head, length_m = _split_length(head)
    functions = _choose("basis", head, BASES)
    if isfinite(length_m):
        head = _with_length(head, length_m)
    for kind, table in (("wind", WIND), ("current", CURRENT)):
        chosen = extensions_of[kind]
        if chosen is not None:
            functions += _choose(f"{kind} basis", chosen, table)
            head += f"+{kind}-{chosen}"
    if structure not in STRUCTURES:
        raise _unknown("structure", structure, STRUCTURES)
    mask = np.ones((len(functions), 3), dtype=bool)
    if structure == "decoupled":
        for row, term in zip(mask, functions, strict=True):
            row[:] = False
            row[list(term.axes)] = True
    mask.setflags(write=False)
    return Basis(head, structure, functions, mask, length_m)


def with_hull_length(name: str, length_m: float, where: str) -> str:
    """Return a basis's name with the hull's length in it where its functions need one; any other name as it is.

    Parameters
    ----------
    name
        As for `make_basis`.
    length_m
        Length of the hull [m], NaN where it is not known.
    where
        The profile that has the length, for the message.

    Raises
    ------
    FerryIdError
        Where the length is needed and not known.
    """
    head, plus, extensions = name.partition("+")
    if head not in BASES or not basis_forms()[head].needs_length:
        return name
    if not isfinite(length_m):
        raise FerryIdError(
            f"{where}: the basis {head} needs the hull's length, and there is no length_m in [hull]. "
            f"Fix: add it, or say it with --basis {head}-5m, for 5 m"
        )
    return _with_length(head, length_m) + plus + extensions


def relative_flow(nu: Floats, psi: Floats, flow_ne: Floats) -> Floats:
    """Return the hull's velocity relative to air or water along its x and y axes [m/s], shape (n, 2).

    Parameters
    ----------
    nu
        Velocity over ground, shape (n, 3).
    psi
        Heading [rad], shape (n,).
    flow_ne
        Where the air or water goes to, north and east [m/s], shape (n, 2).
    """
    c, s = np.cos(psi), np.sin(psi)
    north, east = flow_ne[:, 0], flow_ne[:, 1]
    return np.column_stack([nu[:, 0] - (c * north + s * east), nu[:, 1] - (c * east - s * north)])


def _split_length(head: str) -> tuple[str, float]:
    """Return the name of a basis of motion without its length, and the length, NaN where it needs none."""
    found = _SIZED.fullmatch(head)
    if found and found[1] in BASES and basis_forms()[found[1]].needs_length and float(found[2]) > 0.0:
        return found[1], float(found[2])
    known = found[1] if found and found[1] in BASES else head
    if known in BASES and basis_forms()[known].needs_length:
        raise FerryIdError(
            f'settings: the basis "{head}" needs the hull\'s length behind its name, found none above zero. '
            f"Fix: write {known}-5m for a hull of 5 m"
        )
    return head, nan


def _with_length(head: str, length_m: float) -> str:
    return f"{head}-{length_m:.4f}".rstrip("0").rstrip(".") + "m"


def _choose(what: str, name: str, table: Mapping[str, tuple[Term, ...]]) -> tuple[Term, ...]:
    if name not in table:
        raise _unknown(what, name, list(table))
    return table[name]


def _unknown(what: str, name: str, options: list[str] | tuple[str, ...]) -> FerryIdError:
    return FerryIdError(
        f'settings: there is no {what} called "{name}".{did_you_mean(name, options)} '
        f"Fix: choose one of {', '.join(options)}"
    )


def _factors(nu: Floats, nu_dot: Floats) -> dict[str, Floats]:
    # Contiguous copies: every factor is read several times, and a stride of three columns halves the speed.
    u, v, r = np.ascontiguousarray(nu.T)
    u_dot, v_dot, r_dot = np.ascontiguousarray(nu_dot.T)
    return {
        "u": u,
        "v": v,
        "r": r,
        "|u|": np.abs(u),
        "|v|": np.abs(v),
        "|r|": np.abs(r),
        "u_dot": u_dot,
        "v_dot": v_dot,
        "r_dot": r_dot,
    }


def _flow_factors(relative: Floats, flow: str) -> dict[str, Floats]:
    """Return V, V cos(gamma), V sin(gamma) ... with gamma = -atan2(v, u), so that sin(gamma) = -v / V."""
    along, across = np.ascontiguousarray(relative.T)
    cos, sin = along, -across
    values = {
        "V": np.hypot(along, across),
        "cos": cos,
        "sin": sin,
        "2cos": 2.0 * cos,
        "|cos|": np.abs(cos),
        "|sin|": np.abs(sin),
        "gamma": -np.arctan2(across, along),
    }
    return {f"{name}_{flow}": value for name, value in values.items()}


def coefficient_units(term: Term) -> Unit:
    """Return the unit of a term's coefficient in surge, sway (force) and yaw (moment) as plain strings."""
    metre, second, radian = term.dimension
    if term.factors[0].endswith("_dot"):
        # Force over acceleration is inertia; radians are left out there, as in every table of added mass.
        return ("kg", "kg", "kg·m") if radian == 0 else ("kg·m", "kg·m", "kg·m²")
    force = _unit(-metre, -second, -radian)
    return ("kg/s", "kg/s", "N·s") if force == "N·s/m" else (force, force, _unit(1 - metre, -second, -radian))


def _unit(metre: int, second: int, radian: int) -> str:
    exponents = [("m", metre), ("s", second), ("rad", radian)]
    above = ["N", *(symbol + _POWER[power] for symbol, power in exponents if power > 0)]
    below = [symbol + _POWER[-power] for symbol, power in exponents if power < 0]
    top, bottom = "·".join(above), "·".join(below)
    if not below:
        return top
    return f"{top}/({bottom})" if len(below) > 1 else f"{top}/{bottom}"


_POWER = {1: "", 2: "²", 3: "³", 4: "⁴"}
