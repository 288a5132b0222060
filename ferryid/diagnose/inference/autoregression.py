"""The noise of the weak form's gaps, learnt from the gaps themselves: what whitens them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ferryid.types import Floats

ORDER = 4
"""Order of the autoregression; windows overlap over about as many strides."""


@dataclass(frozen=True)
class AutoregressiveNoise:
    """Autoregression of every channel, coefficients (c, ORDER), and the inverse Cholesky factor of what it leaves (c, c)."""

    coefficients: Floats
    unmix: Floats

    def white(self, gaps: Floats, runs: tuple[tuple[int, int], ...]) -> Floats:
        """Return whitened gaps, flat; the first ORDER windows of every run only start the autoregression.

        Parameters
        ----------
        gaps
            Shape (J, c) or (J, c, q) for q columns at once.
        runs
            Unbroken series of windows.
        """
        parts = []
        for first, end in runs:
            part = gaps[first:end]
            if len(part) <= ORDER:
                continue
            left = part[ORDER:].copy()
            for k in range(ORDER):
                past = part[ORDER - 1 - k : len(part) - 1 - k]
                weights = self.coefficients[:, k]
                left -= past * (weights if gaps.ndim == 2 else weights[:, None])
            parts.append(left)
        every = np.concatenate(parts) if parts else np.empty((0, *gaps.shape[1:]))
        mixed = np.einsum("ij,nj...->ni...", self.unmix, every)
        return np.asarray(mixed.reshape(-1, *gaps.shape[2:]))


def fit_autoregression(gaps: Floats, runs: tuple[tuple[int, int], ...]) -> AutoregressiveNoise:
    """Return the noise that gaps, shape (J, c), have if nothing but noise is in them."""
    c = gaps.shape[1]
    pairs = [(gaps[a:b], b - a) for a, b in runs if b - a > ORDER]
    coefficients = np.zeros((c, ORDER))
    left = []
    for channel in range(c):
        past = np.concatenate(
            [np.column_stack([part[ORDER - 1 - k : n - 1 - k, channel] for k in range(ORDER)]) for part, n in pairs]
        )
        now = np.concatenate([part[ORDER:, channel] for part, _ in pairs])
        # A little of the variance on the diagonal keeps a short log's regression from its own noise.
        gram = past.T @ past + 1e-3 * np.eye(ORDER) * float(now @ now)
        coefficients[channel] = np.linalg.solve(gram, past.T @ now)
        left.append(now - past @ coefficients[channel])
    rest = np.column_stack(left)
    covariance = rest.T @ rest / len(rest)
    return AutoregressiveNoise(coefficients, np.linalg.inv(np.linalg.cholesky(covariance)))
