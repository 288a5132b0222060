"""A recursive digital filter. That of scipy.signal would do, but every command would wait a second for its import."""

from __future__ import annotations

from math import exp

import numpy as np

from ferryid.compiled import compiled
from ferryid.types import Floats


def recursive_filter(b: Floats, a: Floats, values: Floats, first_output: Floats | None = None) -> Floats:
    """Return ``y[k] = sum_i b[i] x[k-i] - sum_i>0 a[i] y[k-i]`` along the first axis.

    Parameters
    ----------
    b, a
        Coefficients of input and output, shapes (p,) and (q,); ``a[0]`` is 1.
    values
        The input x, shape (n, ...).
    first_output
        ``y[0]``, shape (...); the input and the output before it count as if they had stood still. Both are zero before the
        start where None.
    """
    columns = np.ascontiguousarray(values, dtype=np.float64).reshape(len(values), -1)
    before_x, before_y = np.zeros(columns.shape[1]), np.zeros(columns.shape[1])
    if first_output is not None:
        before_x[:], before_y[:] = columns[0], np.asarray(first_output, dtype=np.float64).reshape(-1)
    made = _filtered(np.asarray(b, dtype=np.float64), np.asarray(a, dtype=np.float64), columns, before_x, before_y)
    return made.reshape(values.shape)


def lagged(values: Floats, time_constant_s: float, step_s: float) -> Floats:
    """Return the answer of a first-order lag to values that are linear between rows: exact, so that no lag is no delay either.

    Parameters
    ----------
    values
        Shape (n, ...); before the first they stood still.
    time_constant_s, step_s
        Of the lag, above zero, and between two rows [s].
    """
    x = step_s / time_constant_s
    keep = exp(-x)
    new, old = 1.0 - (1.0 - keep) / x, (1.0 - keep) / x - keep
    return recursive_filter(np.array([new, old]), np.array([1.0, -keep]), values, values[0])


@compiled
def _filtered(b: Floats, a: Floats, x: Floats, before_x: Floats, before_y: Floats) -> Floats:
    n, columns = x.shape
    y = np.empty((n, columns))
    for k in range(n):
        for m in range(columns):
            total = 0.0
            for i in range(b.shape[0]):
                total += b[i] * (x[k - i, m] if k >= i else before_x[m])
            for i in range(1, a.shape[0]):
                total -= a[i] * (y[k - i, m] if k >= i else before_y[m])
            y[k, m] = total
    return y
