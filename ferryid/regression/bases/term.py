"""What bases are made of: terms, the factors that they are products of, and the forms that name a list of terms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

SURGE, SWAY, YAW = 0, 1, 2
CROSSFLOW_FACTORS = ("fore", "aft", "x_fore", "x_aft")
"""Integrals along the hull, `ferryid.regression.bases.crossflow_integrals`, the only factors that need its length."""

DIMENSIONS: Mapping[str, tuple[int, int, int]] = {
    "u_dot": (1, -2, 0),
    "v_dot": (1, -2, 0),
    "r_dot": (0, -2, 1),
    "u": (1, -1, 0),
    "v": (1, -1, 0),
    "r": (0, -1, 1),
    "|u|": (1, -1, 0),
    "|v|": (1, -1, 0),
    "|r|": (0, -1, 1),
    # Air (rw) and water (rc) relative to the hull: V, V cos(gamma), V sin(gamma) and the angle of attack as a number.
    **{f"{name}_{flow}": (1, -1, 0) for flow in ("rw", "rc") for name in ("V", "cos", "sin", "2cos", "|cos|", "|sin|")},
    **{f"gamma_{flow}": (0, 0, 0) for flow in ("rw", "rc")},
    # v + x r is a velocity: the radian of r goes with x.
    **dict.fromkeys(CROSSFLOW_FACTORS[:2], (3, -2, 0)),
    **dict.fromkeys(CROSSFLOW_FACTORS[2:], (4, -2, 0)),
}
"""Exponents of metre, second and radian of every factor."""

_MIRRORED = ("v_dot", "r_dot", "v", "r", *CROSSFLOW_FACTORS)
"""Factors of the hull's own motion that change sign where port and starboard change places; the others stay."""


@dataclass(frozen=True)
class Term:
    """One basis function, the product of its factors.

    Attributes
    ----------
    name
        Name in reports and model files.
    factors
        Names of the factors, keys of `DIMENSIONS`.
    axes
        Axes that the term belongs to in the decoupled structure: 0 surge, 1 sway, 2 yaw.
    """

    name: str
    factors: tuple[str, ...]
    axes: tuple[int, ...]

    @property
    def dimension(self) -> tuple[int, int, int]:
        """Exponents of metre, second and radian."""
        parts = [DIMENSIONS[factor] for factor in self.factors]
        return sum(p[0] for p in parts), sum(p[1] for p in parts), sum(p[2] for p in parts)


@dataclass(frozen=True)
class Form:
    """Functions of motion alone: one file in `ferryid.regression.bases.forms`, by whose name ``make_basis`` knows it.

    Attributes
    ----------
    title
        What it is, in some words.
    terms
        The functions in order.
    """

    title: str
    terms: tuple[Term, ...]

    @property
    def needs_length(self) -> bool:
        """True where a function depends on the hull's length."""
        return any(factor in CROSSFLOW_FACTORS for term in self.terms for factor in term.factors)


def terms(*rows: tuple[str, str, tuple[int, ...]]) -> tuple[Term, ...]:
    """Return terms of their names, factors with blanks between, and decoupled axes."""
    return tuple(Term(name, tuple(factors.split()), axes) for name, factors, axes in rows)


def mirrored_terms(*rows: tuple[str, str]) -> tuple[Term, ...]:
    """Return terms of names and factors, with the decoupled axes that a hull alike to port and starboard has.

    The mirror image of a motion takes the same force ahead, and the opposite force and moment across. A product that stays
    the same under it acts in surge, and one that changes sign in sway and yaw.
    """
    return terms(*((name, factors, _axes(factors)) for name, factors in rows))


def _axes(factors: str) -> tuple[int, ...]:
    changes = sum(factor in _MIRRORED for factor in factors.split()) % 2 == 1
    return (SWAY, YAW) if changes else (SURGE,)
