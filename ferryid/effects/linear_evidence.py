"""Evidence of many alternatives at once, by a model that is linear in an effect and in the hull."""

from __future__ import annotations

import numpy as np

from ferryid.effects.effect import Residual
from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats

DIFFERENCE_STEP = 0.01


def hull_jacobian(
    force_model: ForceModel, prior_hull: Floats, residual: Residual, places: list[int]
) -> tuple[Floats, Floats]:
    """Return a log's residual as linear in the hull: its derivatives by shares of coefficients, and its value as believed.

    The line is drawn at the force model's hull, which is the fitted one, as acceleration is far from linear in mass.
    """
    e = residual(force_model)
    columns, away = [], []
    for k in places:
        hull = force_model.hull.copy()
        hull[k] += DIFFERENCE_STEP * prior_hull[k]
        columns.append((residual(force_model.replaced(hull=hull)) - e) / DIFFERENCE_STEP)
        away.append(force_model.hull[k] / prior_hull[k] - 1.0 if prior_hull[k] != 0.0 else 0.0)
    J = np.column_stack(columns)
    return J, e - J @ np.array(away)


def profiled_loss(J: Floats, residuals: Floats, spread: float) -> Floats:
    """Return the negative logarithm of the likelihood of each of some residuals, with the hull profiled_loss to it.

    Parameters
    ----------
    J
        From `hull_jacobian`.
    residuals
        With the hull as believed, shape (w, q).
    spread
        Standard deviation by which the hull's coefficients are believed to be off, as a share of each.
    """
    H = spread * J
    product = H.T @ residuals
    share = np.einsum("pq,pq->q", product, np.linalg.solve(H.T @ H + np.eye(H.shape[1]), product))
    return np.asarray(0.5 * (np.einsum("wq,wq->q", residuals, residuals) - share))


def log_evidence_gains(J: Floats, e: Floats, columns: Floats, sums: Floats, size: float, spread: float) -> Floats:
    """Return the evidence of each of some alternatives, with the hull's coefficients profiled_loss beside it.

    Parameters
    ----------
    J, e
        From `hull_jacobian`.
    columns
        Changes of the residual, shape (w, m).
    sums
        How the derivatives of the residual by the one parameter of each alternative are summed of these, shape (m, q).
    size
        Standard deviation of what is believed of that parameter.
    spread
        As of `profiled_loss`.
    """
    H, every = spread * J, np.column_stack([e, columns])
    across = H.T @ every
    # Of what the hull leaves free; alternatives are many, and what they are sums of is not.
    free = every.T @ every - across.T @ np.linalg.solve(H.T @ H + np.eye(H.shape[1]), across)
    power = np.einsum("mq,mq->q", sums, free[1:, 1:] @ sums)
    product = sums.T @ free[1:, 0]
    ratio = power * size**2
    return np.asarray(0.5 * product**2 * size**2 / (1.0 + ratio) - 0.5 * np.log1p(ratio))
