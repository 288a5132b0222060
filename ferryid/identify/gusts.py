"""Gusts of a wind that nobody measured: a first-order process in every log, one value a window of the weak form.

As a random effect with 2 J unknowns a log they are eliminated from the normal equations; their precision is banded, so that the
cost grows with the length of the log (Rue and Held 2005, chapter 2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ferryid.compiled import compiled
from ferryid.identify.thresholds import IDENTIFY
from ferryid.types import Floats, Ints

_PROBES = 8
"""Random vectors by which the trace of an inverse is estimated (Hutchinson 1990)."""
MANY_WINDOWS = 5000
"""Windows of all logs from which on solving by a compiled loop, ten times as fast, saves more than loading it takes."""


def _probes(J: int) -> tuple[Floats, Floats]:
    """Return the random vectors of J windows: of their gusts, shape (2 J, `_PROBES`), and of their targets, (J, `_PROBES`)."""
    rng = np.random.default_rng(0)
    return rng.choice([-1.0, 1.0], (2 * J, _PROBES)), rng.choice([-1.0, 1.0], (J, _PROBES))


@dataclass(frozen=True, eq=False)
class GustEquations:
    """Banded precision of the gusts of one log, given hull and conditions.

    Attributes
    ----------
    bands
        Diagonal and the two above it, in the upper form of `scipy.linalg.solveh_banded`, shape (3, 2 J).
    slope
        Derivative of the target with respect to the wind, shape (J, 3, 2).
    blow
        Whether the log is long enough to tell gusts from the hull's forces, and has a wind at all.
    many
        Whether there are so many windows that loading the compiled loop pays.
    trace
        Expected square of what remains uncertain of the gusts, in the measure of the process.
    uncertain
        Sum of squares that they leave uncertain in the targets, shape (3,).
    """

    bands: Floats
    slope: Floats
    blow: bool
    many: bool = False
    trace: float = 0.0
    uncertain: Floats = field(default_factory=lambda: np.zeros(3))

    def eliminated(self, columns: Sequence[tuple[Ints, Floats]], size: int, weight: Floats) -> tuple[Floats, Floats]:
        """Return the gusts' side of the normal equations and its solution, shape (2 J, size) each.

        Parameters
        ----------
        columns
            Of each axis the numbers of its columns, (c,), and the columns, shape (J, c).
        size
            Number of columns of all axes.
        weight
            Of the axes, shape (3,).
        """
        cube = np.zeros((len(self.slope), 2, size))
        for axis, (places, table) in enumerate(columns):
            if self.many:
                _weigh(cube, places, weight[axis] * self.slope[:, axis], table)
                continue
            cube[:, :, places] += weight[axis] * self.slope[:, axis, :, None] * table[:, None, :]
        response = cube.reshape(-1, size)
        if not self.blow:
            return response, np.zeros_like(response)
        return response, self.solve(response)

    def solve(self, right: Floats) -> Floats:
        """Return the solution for right-hand sides, shape (2 J, c)."""
        if self.many:
            return _solved(self.bands, right)
        from scipy.linalg import solveh_banded

        return np.asarray(solveh_banded(self.bands, right, check_finite=False))


class Gusts:
    """Gusts of L logs, found window by window.

    `uncertain` is the sum of squares that they leave uncertain in the targets since the last `update`, shape (3,), and `many`
    tells whether there are so many windows that loading compiled loops pays.

    Parameters
    ----------
    runs
        Number of the unbroken stretch that each window lies in, shape (J,) each.
    stride_s
        Time between windows [s].
    """

    def __init__(self, runs: Sequence[Ints], stride_s: float) -> None:
        self.found = [np.zeros((len(run), 2)) for run in runs]
        self.spread = IDENTIFY.gust_spread_mps
        self._kept = float(np.exp(-stride_s / IDENTIFY.gust_time_s))
        self._follows = [np.diff(run) == 0 for run in runs]
        self._sums = list[tuple[float, int]]()
        self.uncertain = np.zeros(3)
        self._probes = [_probes(len(run)) for run in runs]
        self.many = sum(map(len, runs)) >= MANY_WINDOWS

    def precision(self, k: int) -> tuple[Floats, Floats]:
        """Return diagonal (J,) and neighbours (J - 1,) of the precision of a process of unit variance in one log."""
        follows, kept = self._follows[k], self._kept
        share = 1.0 / (1.0 - kept**2)
        diagonal = np.ones(len(self.found[k]))
        diagonal[:-1] += np.where(follows, kept**2 * share, 0.0)
        diagonal[1:] += np.where(follows, share - 1.0, 0.0)
        return diagonal, np.where(follows, -kept * share, 0.0)

    def equations(self, k: int, slope: Floats, weight: Floats, *, uncertain: bool = True) -> GustEquations:
        """Return the precision of one log's gusts for this slope of the target (J, 3, 2) and weights of the axes (3,).

        What remains uncertain of them is found where that is wanted: it takes as long as all else.
        """
        J = len(slope)
        bands = np.zeros((3, 2 * J))
        if J:
            data = np.einsum("jax,a,jay->jxy", slope, weight, slope)
            diagonal, beside = (part / self.spread**2 for part in self.precision(k))
            bands[2] = (np.einsum("jxx->jx", data) + diagonal[:, None]).reshape(-1)
            bands[1, 1::2] = data[:, 0, 1]
            bands[0, 2:] = np.repeat(beside, 2)
        equations = GustEquations(bands, slope, IDENTIFY.fewest_gust_windows <= J and bool(slope.any()), self.many)
        return self._with_uncertainty(k, equations) if equations.blow and uncertain else equations

    def _with_uncertainty(self, k: int, equations: GustEquations) -> GustEquations:
        """Return equations with the expected squares of what remains uncertain."""
        size = equations.bands.shape[1]
        process, signs = self._probes[k]
        targets = (equations.slope.transpose(0, 2, 1)[..., None] * signs[:, None, None, :]).reshape(size, 3, _PROBES)
        # One factorisation for all of them.
        found = equations.solve(np.column_stack([process, targets.reshape(size, -1)]))
        return replace(
            equations,
            trace=float(np.sum(self._weighted(k, process) * found[:, :_PROBES])) / _PROBES,
            uncertain=np.sum(targets * found[:, _PROBES:].reshape(targets.shape), axis=(0, 2)) / _PROBES,
        )

    def add(self, equations: GustEquations) -> None:
        """Add up what the gusts of one log leave uncertain, until the next `update`."""
        if equations.blow:
            self._sums.append((equations.trace, equations.bands.shape[1]))
            self.uncertain += equations.uncertain

    def _weighted(self, k: int, values: Floats) -> Floats:
        """Return the process's precision times values, shape (2 J, c)."""
        diagonal, beside = self.precision(k)
        table = values.reshape(len(diagonal), 2, -1)
        out = table * diagonal[:, None, None]
        out[:-1] += beside[:, None, None] * table[1:]
        out[1:] += beside[:, None, None] * table[:-1]
        return np.asarray(out.reshape(values.shape))

    def take(self, k: int, gusts: Floats) -> None:
        """Take the gusts that were found in one log, shape (J, 2)."""
        limit = 4.0 * self.spread
        self.found[k] = np.clip(gusts, -limit, limit)

    def update(self) -> None:
        """Estimate their spread anew, by expectation and maximisation."""
        self.uncertain = np.zeros(3)
        if not self._sums:
            return
        squares = sum(trace for trace, _ in self._sums)
        for k, gusts in enumerate(self.found):
            flat = gusts.reshape(-1, 1)
            squares += float(np.sum(flat * self._weighted(k, flat))) if len(flat) else 0.0
        count = sum(size for _, size in self._sums)
        self.spread = float(max(np.sqrt(squares / count), IDENTIFY.least_gust_mps))
        self._sums.clear()


@compiled
def _weigh(cube: Floats, places: Ints, slope: Floats, table: Floats) -> None:
    """Add the products of slopes (J, 2) and columns (J, c) to some of the columns of a cube (J, 2, size)."""
    for j in range(table.shape[0]):
        for x in range(2):
            for m in range(table.shape[1]):
                cube[j, x, places[m]] += slope[j, x] * table[j, m]


@compiled
def _solved(bands: Floats, right: Floats) -> Floats:
    """Solve a precision of 2 x 2 blocks that are joined to their neighbours by multiples of the identity.

    LAPACK solves for each right-hand side by itself; here every block is eliminated once for all of them.

    Parameters
    ----------
    bands
        See `GustEquations`, shape (3, 2 J).
    right
        Right-hand sides, shape (2 J, c).
    """
    J, columns = right.shape[0] // 2, right.shape[1]
    out = right.copy()
    inverse = np.empty((J, 3))
    for j in range(J):
        a, b, d = bands[2, 2 * j], bands[1, 2 * j + 1], bands[2, 2 * j + 1]
        if j:
            beside = bands[0, 2 * j]
            a -= beside * beside * inverse[j - 1, 0]
            b -= beside * beside * inverse[j - 1, 1]
            d -= beside * beside * inverse[j - 1, 2]
            for m in range(columns):
                out[2 * j, m] -= beside * out[2 * j - 2, m]
                out[2 * j + 1, m] -= beside * out[2 * j - 1, m]
        determinant = a * d - b * b
        a, b, d = d / determinant, -b / determinant, a / determinant
        inverse[j, 0], inverse[j, 1], inverse[j, 2] = a, b, d
        for m in range(columns):
            first, second = out[2 * j, m], out[2 * j + 1, m]
            out[2 * j, m] = a * first + b * second
            out[2 * j + 1, m] = b * first + d * second
    for j in range(J - 2, -1, -1):
        beside = bands[0, 2 * j + 2]
        if beside != 0.0:
            a, b, d = inverse[j, 0] * beside, inverse[j, 1] * beside, inverse[j, 2] * beside
            for m in range(columns):
                first, second = out[2 * j + 2, m], out[2 * j + 3, m]
                out[2 * j, m] -= a * first + b * second
                out[2 * j + 1, m] -= b * first + d * second
    return out
