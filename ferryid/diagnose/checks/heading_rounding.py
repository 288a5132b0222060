"""The step that headings are rounded to, where a vessel turns so slowly that it matters."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats

AROUND = 3
"""Steps before and after a heading that stands still, of which the usual one is that of the rounding."""
SAME_RAD = 1e-9
"""Headings this near to each other are the same number."""


def rounding_steps(psi: Floats) -> Floats:
    """Return the step that every heading is rounded to, zero where it moves from row to row, shape (n,).

    A rounded heading stands still, steps, and stands still again. One that moves without standing has no step, or one that it
    outruns. The step may be another elsewhere: numbers of three digits are tenths up to 100 degrees, and degrees beyond.

    Parameters
    ----------
    psi
        Heading, unwrapped, shape (n,).
    """
    out = np.zeros(len(psi))
    if len(psi) < 2:
        return out
    still = np.abs(np.diff(psi)) < SAME_RAD
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    first, last = edges[::2], edges[1::2]
    if len(first) < 2 * AROUND:
        return out
    length, between = last - first, first[1:] - last[:-1]
    # A step takes less long than the heading stands beside it; else it moved meanwhile.
    step = np.abs(psi[first[1:]] - psi[last[:-1]])
    step = np.where(between <= np.maximum(length[1:], length[:-1]), step, np.nan)
    padded = np.concatenate([np.full(AROUND, np.nan), step, np.full(AROUND, np.nan)])
    near = np.lib.stride_tricks.sliding_window_view(padded, 2 * AROUND)
    known = np.isfinite(near).sum(axis=1) >= AROUND
    usual = np.zeros(len(first))
    usual[known] = np.nanmedian(near[known], axis=1)
    for begin, end, size in zip(first, last, usual, strict=True):
        out[begin : end + 1] = size
    return out
