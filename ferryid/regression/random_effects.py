"""Linear regression on groups of rows that each have coefficients of their own: random effects with spreads of their own.

Of every group only the cross-products of its columns are needed: those of what all groups share, of what is the group's own,
and the target. The own coefficients have zero mean and a standard deviation each; they are eliminated from the normal
equations.

References
----------
Laird and Ware (1982), Random-effects models for longitudinal data. Rasmussen and Williams (2006), section 2.7, for the marginal
likelihood beside coefficients with a flat prior.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ferryid.cached import cached_property
from ferryid.types import Floats, Ints

_RIDGE = 1e-10
"""Of the diagonal: what columns that nothing tells apart are held by."""
_SPREADS = np.geomspace(0.01, 10.0, 13)
"""Spreads that are tried, in units; the best is then refined between its neighbours."""
_REFINEMENTS = 6
_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, eq=False)
class GroupSums:
    """Cross-products of L groups of rows, the noise of which has unit variance.

    Attributes
    ----------
    products
        Of the columns [shared (P), own (D), target], shape (L, P + D + 1, P + D + 1).
    prior
        Precision of the shared coefficients about zero, zero where nothing is known, shape (P,).
    """

    products: Floats
    prior: Floats

    @property
    def P(self) -> int:
        """Number of shared coefficients."""
        return len(self.prior)

    @property
    def D(self) -> int:
        """Number of own coefficients of a group."""
        return int(self.products.shape[1]) - self.P - 1

    def within(self, own: Ints) -> GroupSums:
        """Return the same with some of the own coefficients only, by their numbers."""
        places = np.concatenate([np.arange(self.P), self.P + own, [self.products.shape[1] - 1]])
        return GroupSums(self.products[:, places[:, None], places], self.prior)

    def fit(self, spread: Floats) -> MixedFit:
        """Return the estimate for standard deviations of the own coefficients, shape (D,)."""
        P = self.P
        own = self.products[:, P:-1, P:-1] + np.diag(spread**-2.0)
        across, right = self.products[:, P:-1, :P], self.products[:, P:-1, -1]
        both = np.concatenate([across, right[:, :, None]], axis=2)
        # A group without own coefficients has none to eliminate.
        back = np.linalg.solve(own, both) if self.D else both
        shared = np.concatenate([self.products[:, :P, :P], self.products[:, :P, -1:]], axis=2)
        shared = shared - np.swapaxes(across, 1, 2) @ back
        normal, slope = shared[:, :, :P].sum(axis=0) + np.diag(self.prior), shared[:, :, -1].sum(axis=0)
        normal = normal + _RIDGE * np.diag(np.maximum(np.diag(normal), np.finfo(np.float64).tiny))
        found = np.linalg.solve(normal, slope)
        cost = self.products[:, -1, -1].sum() - float(np.einsum("gd,gd->", right, back[:, :, -1])) - slope @ found
        logarithm = float(np.sum(np.linalg.slogdet(own)[1])) + 2.0 * len(own) * float(np.sum(np.log(spread)))
        evidence = -0.5 * (float(cost) + logarithm + float(np.linalg.slogdet(normal)[1]))
        return MixedFit(self, found, back[:, :, -1] - back[:, :, :-1] @ found, evidence, normal, own, back[:, :, :-1])

    def best(self, spread: Callable[[float], Floats], start: float | None = None) -> tuple[float, MixedFit]:
        """Return the size of greatest evidence and its estimate; `spread` gives the standard deviations, (D,), of a size."""
        tried = {float(size): self.fit(spread(float(size))) for size in _SPREADS}
        if start is not None:
            tried[start] = self.fit(spread(start))
        sizes = sorted(tried)
        place = max(range(len(sizes)), key=lambda one: tried[sizes[one]].evidence)
        low, high = np.log(sizes[max(place - 1, 0)]), np.log(sizes[min(place + 1, len(sizes) - 1)])
        for _ in range(_REFINEMENTS):
            inner = [float(np.exp(one)) for one in (high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))]
            for size in inner:
                if size not in tried:
                    tried[size] = self.fit(spread(size))
            if tried[inner[0]].evidence >= tried[inner[1]].evidence:
                high = np.log(inner[1])
            else:
                low = np.log(inner[0])
        best = max(tried, key=lambda one: tried[one].evidence)
        return best, tried[best]


@dataclass(frozen=True, eq=False)
class MixedFit:
    """Shared coefficients and those of every group.

    Attributes
    ----------
    sums
        What was fitted.
    shared, own
        The estimate, shapes (P,) and (L, D).
    evidence
        Logarithm of the marginal likelihood, but for what only the noise decides [nat].
    normal
        Normal matrix of the shared coefficients with the own ones eliminated, shape (P, P).
    inner, back
        Normal matrix of the own coefficients of every group, shape (L, D, D), and how they follow the shared ones, (L, D, P).
    """

    sums: GroupSums
    shared: Floats
    own: Floats
    evidence: float
    normal: Floats
    inner: Floats
    back: Floats

    @cached_property
    def covariance(self) -> Floats:
        """Covariance of the shared coefficients, shape (P, P)."""
        return np.asarray(np.linalg.inv(self.normal))

    @cached_property
    def own_covariance(self) -> Floats:
        """Covariance of the own coefficients of every group, shape (L, D, D)."""
        return np.asarray(np.linalg.inv(self.inner) + self.back @ self.covariance @ np.swapaxes(self.back, 1, 2))

    def loss(self, products: Floats, own: Floats | None = None) -> Floats:
        """Return the squares that the estimate leaves of other rows of the groups, shape (L,).

        Parameters
        ----------
        products
            Cross-products of these rows in the columns of `sums`, shape (L, P + D + 1, P + D + 1).
        own
            Own coefficients, shape (L, D); those estimated where None.
        """
        own = self.own if own is None else own
        every = np.concatenate(
            [np.broadcast_to(-self.shared, (len(own), self.sums.P)), -own, np.ones((len(own), 1))], axis=1
        )
        return np.asarray(np.einsum("gi,gij,gj->g", every, products, every))
