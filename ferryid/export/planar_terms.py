"""A model's force as a sum of linear and quadratic terms of the velocities: what simulators for vessels take as parameters.

All is in the frame of ferryid (FRD) and of the force that a motion requires; `PlanarTerms.mirrored` is the same to port (FLU).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ferryid.export.exported import Exported
from ferryid.export.names import plain
from ferryid.models.forces import Estimator
from ferryid.types import Floats

MIRROR = (1.0, -1.0, -1.0)
"""Signs of surge, sway and yaw from FRD to FLU."""
VELOCITIES = ("u", "v", "r")


@dataclass(frozen=True)
class PlanarTerms:
    """Coefficients of a force that a motion requires, by axis first: X, Y, N.

    Attributes
    ----------
    linear
        Of ``nu_j``, shape (3, 3).
    absolute
        Of ``nu_j |nu_k|``, shape (3, 3, 3).
    product
        Of ``nu_j nu_k`` with j not after k, shape (3, 3, 3).
    """

    linear: Floats
    absolute: Floats
    product: Floats

    @classmethod
    def none(cls) -> PlanarTerms:
        """Return no force at all."""
        return cls(np.zeros((3, 3)), np.zeros((3, 3, 3)), np.zeros((3, 3, 3)))

    def __add__(self, other: PlanarTerms) -> PlanarTerms:
        return PlanarTerms(self.linear + other.linear, self.absolute + other.absolute, self.product + other.product)

    def times(self, factor: float) -> PlanarTerms:
        """Return a multiple."""
        return PlanarTerms(factor * self.linear, factor * self.absolute, factor * self.product)

    def force(self, nu: Floats) -> Floats:
        """Return the force [N, N, N·m] at velocities, shape (s, 3)."""
        return np.asarray(
            nu @ self.linear.T
            + np.einsum("ajk,sj,sk->sa", self.absolute, nu, np.abs(nu))
            + np.einsum("ajk,sj,sk->sa", self.product, nu, nu)
        )

    def mirrored(self) -> PlanarTerms:
        """Return the coefficients between FRD and FLU: sway and yaw, force and velocity, change their sign, sizes do not."""
        s = np.array(MIRROR)
        return PlanarTerms(
            self.linear * np.outer(s, s),
            self.absolute * np.einsum("a,j->aj", s, s)[:, :, None],
            self.product * np.einsum("a,j,k->ajk", s, s, s),
        )


@dataclass(frozen=True)
class Beyond:
    """A part of the force that is no such term: what it is, and the force [N, N, N·m] at velocities, shape (s, 3)."""

    what: str
    force: Callable[[Floats], Floats]


def coriolis(mass: Floats) -> PlanarTerms:
    """Return ``C(nu) nu`` of a mass matrix, its symmetric part, shape (3, 3); Fossen (2021), theorem 6.2."""
    m = 0.5 * (mass + mass.T)
    terms = PlanarTerms.none()
    for j, rate in enumerate(m.T):
        # The momentum ahead and to starboard that one unit of a velocity carries.
        ahead, aside = rate[0], rate[1]
        for axis, k, value in ((0, 2, -aside), (1, 2, ahead), (2, 0, aside), (2, 1, -ahead)):
            terms.product[axis, min(j, k), max(j, k)] += value
    return terms


def planar_terms(one: Exported) -> tuple[PlanarTerms, tuple[Beyond, ...]]:
    """Return the terms of a model in still air and water, and what of its force is none."""
    terms = coriolis(one.hull.M)
    beyond: list[Beyond] = []
    for name, value in one.hull.D.items():
        if value == 0.0:
            continue
        axis, factors = _damping(name)
        if not _added(terms, axis, factors, -value):
            beyond.append(Beyond(f"{plain(name)}, cubic damping", _product(axis, factors, -value / one.zeta)))
    terms = terms.times(1.0 / one.zeta)
    beyond += _learned(one, terms)
    if one.needs_wind and one.force.profile.wind is not None:
        alone = replace(one.force, basis=None, theta=None, intercept=None)
        beyond.append(Beyond("load of still air", lambda nu: _in_air(alone, nu) - alone.at_constant_velocity(nu)))
    return terms, tuple(beyond)


def _in_air(force: Estimator, nu: Floats) -> Floats:
    still = np.zeros((len(nu), 2))
    return force(np.zeros_like(nu), nu, np.zeros(len(nu)), still, None)


def _damping(name: str) -> tuple[int, tuple[str, ...]]:
    """Return axis and factors of a damping coefficient: ``N_|v|r`` is 2 and ``|v|``, ``r``."""
    axis, _, rest = name.partition("_")
    factors: list[str] = []
    while rest:
        length = 3 if rest[0] == "|" else 1
        factors.append(rest[:length])
        rest = rest[length:]
    return "XYN".index(axis), tuple(factors)


def _added(terms: PlanarTerms, axis: int, factors: tuple[str, ...], value: float) -> bool:
    """Add a term where it is linear or quadratic, and tell whether it is."""
    signed = [VELOCITIES.index(one) for one in factors if one in VELOCITIES]
    sizes = [VELOCITIES.index(one.strip("|")) for one in factors if one.strip("|") in VELOCITIES and one[0] == "|"]
    if len(signed) + len(sizes) != len(factors):
        return False
    match (len(signed), len(sizes)):
        case (1, 0):
            terms.linear[axis, signed[0]] += value
        case (1, 1):
            terms.absolute[axis, signed[0], sizes[0]] += value
        case (2, 0):
            terms.product[axis, min(signed), max(signed)] += value
        case _:
            return False
    return True


def _product(axis: int, factors: tuple[str, ...], value: float) -> Callable[[Floats], Floats]:
    def force(nu: Floats) -> Floats:
        tau = np.zeros((len(nu), 3))
        tau[:, axis] = value
        for one in factors:
            column = nu[:, VELOCITIES.index(one.strip("|"))]
            tau[:, axis] *= np.abs(column) if one[0] == "|" else column
        return tau

    return force


def _learned(one: Exported, terms: PlanarTerms) -> Iterator[Beyond]:
    """Add a model's own terms, and yield those that are beyond it."""
    basis, theta, intercept = one.force.basis, one.force.theta, one.force.intercept
    if basis is None or theta is None or intercept is None:
        return
    for k, term in enumerate(basis.functions):
        if not theta[k].any() or any(factor.endswith("_dot") for factor in term.factors):
            continue
        known = [_added(terms, axis, term.factors, float(value)) for axis, value in enumerate(theta[k])]
        if not all(known):
            yield Beyond(f"learned term {plain(term.name)}", _of_term(one, k))
    if intercept.any():
        constant = intercept.copy()
        yield Beyond("constant part", lambda nu: np.tile(constant, (len(nu), 1)))


def _of_term(one: Exported, k: int) -> Callable[[Floats], Floats]:
    assert one.force.theta is not None
    assert one.force.intercept is not None
    alone = np.zeros_like(one.force.theta)
    alone[k] = one.force.theta[k]
    with_it = replace(one.force, theta=alone, intercept=np.zeros(3))
    without = replace(one.force, theta=np.zeros_like(alone), intercept=np.zeros(3))
    return lambda nu: with_it.at_constant_velocity(nu) - without.at_constant_velocity(nu)
