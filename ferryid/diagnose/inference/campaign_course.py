"""The course of a flow over time, such as a wind that rises and falls: a mean with slow changes, beside the hull.

The campaign's estimate has one steady flow for each log. Here every log's flow may depart from it: piecewise linear between
knots, a vector in the horizontal plane, each component a first-order Gauss-Markov process with the strength and the memory that
such flows have (`ferryid.effects.effect.Turbulence`). Gaps are linear in the departures near the estimate, so that one
Gauss-Newton step with each log's own part eliminated gives courses, mean flows and hull together. A departure acts at once, as
the flow at that moment would if it were steady. The noise is the steady estimate's: what departures now explain is still in
it, so that bands are rather too wide than too narrow.

References
----------
Gelb (1974), Applied Optimal Estimation, section 3.8, for the process; EN 1991-1-4:2005, sections 4.4 and B.1, for turbulence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, solve_triangular
from scipy.sparse import csr_array

from ferryid.diagnose.data.course import Course
from ferryid.diagnose.inference.campaign_estimation import CampaignFit
from ferryid.diagnose.inference.campaign_model import DIFFERENCE_STEP
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects.effect import Turbulence
from ferryid.effects.force_model import as_measured
from ferryid.side_by_side import over
from ferryid.types import Floats

KNOTS_A_MEMORY, MOST_KNOTS = 4.0, 200
"""Knots within the time constant of a flow, and the most in a log: a longer one has them further apart."""


@dataclass(frozen=True)
class _Knots:
    """Where a log's departures are free: times, shape (K,), and how much of each knot is in every row, shape (n, K)."""

    t: Floats
    parts: csr_array

    @classmethod
    def of(cls, windows: Windows, time_constant_s: float) -> _Knots:
        t, span = windows.measurements.t, len(windows.weight)
        first, last = float(t[windows.starts[0]]), float(t[windows.starts[-1] + span - 1])
        apart = max(time_constant_s / KNOTS_A_MEMORY, (last - first) / (MOST_KNOTS - 1))
        knots = np.linspace(first, last, max(2, round((last - first) / apart) + 1))
        place = np.clip((t - first) / (knots[1] - knots[0]), 0.0, len(knots) - 1.0)
        before = np.minimum(place.astype(np.int64), len(knots) - 2)
        after = place - before
        rows = np.tile(np.arange(len(t)), 2)
        entries = np.concatenate([1.0 - after, after])
        parts = csr_array((entries, (rows, np.concatenate([before, before + 1]))), shape=(len(t), len(knots)))
        return cls(knots, parts)

    def precision(self, time_constant_s: float) -> Floats:
        """Return the inverse covariance of a first-order process of unit variance, shape (K, K)."""
        kept = float(np.exp(-(self.t[1] - self.t[0]) / time_constant_s))
        K, new = len(self.t), 1.0 - kept**2
        diagonal = np.full(K, (1.0 + kept**2) / new)
        diagonal[[0, -1]] = 1.0 / new
        return np.asarray(np.diag(diagonal) - kept / new * (np.eye(K, k=1) + np.eye(K, k=-1)))


def estimate_courses(fit: CampaignFit, k: int, turbulence: Turbulence) -> tuple[Course, ...]:
    """Estimate how a flow changed over time in every log, together with the mean flows and the hull.

    Parameters
    ----------
    fit
        The estimate with a steady flow of every log.
    k
        Which of its conditions.
    turbulence
        How such a flow changes.
    """
    campaign, places = fit.campaign, range(len(fit.campaign.members))
    rows = [j for j, (of, _) in enumerate(campaign.own) if of == k]
    speed = float(np.mean([np.hypot(*fit.condition(i, k)[0]) for i in places]))
    logs = over(lambda i: _eliminated(fit, i, rows, turbulence, speed), places)
    precise = np.sqrt(campaign.common_precision(fit.spreads))
    whole = np.column_stack([np.diag(precise), precise * fit.common])
    R = _triangular([whole, *(one.left for one in logs)])
    step = -solve_triangular(R[: campaign.g, : campaign.g], R[: campaign.g, -1])
    root = solve_triangular(R[: campaign.g, : campaign.g], np.eye(campaign.g))
    return tuple(_course(fit, i, rows, logs[i], step, root @ root.T) for i in places)


@dataclass(frozen=True)
class _Log:
    """One log with its own vector and its departures eliminated.

    `left` are equations that it leaves for the common vector, with their errors, shape (r, g + 1); `covariance` is that of its
    own and its departures if the common vector stays, `alone` where they go then, `back` how they follow the common vector.
    """

    knots: _Knots
    left: Floats
    covariance: Floats
    alone: Floats
    back: Floats


def _eliminated(fit: CampaignFit, i: int, rows: list[int], turbulence: Turbulence, speed_mps: float) -> _Log:
    campaign, g, windows = fit.campaign, fit.campaign.g, fit.campaign.members[i].windows
    time_constant_s, std = turbulence.time_constant_s(speed_mps), turbulence.std(speed_mps)
    knots = _Knots.of(windows, time_constant_s)
    size = np.array([campaign.own[j][1].size for j in rows])
    departures = fit.noise.white(i, windows.along_vessel(_changes(fit, i, rows, knots)), windows.runs)
    J = np.concatenate([fit.parts[i].slopes, departures], axis=2)
    J = J.reshape(-1, J.shape[2])
    process = np.kron(np.linalg.cholesky(knots.precision(time_constant_s)).T, np.diag(size / std))
    # Orthogonal elimination: on all but noiseless logs, normal equations of so many knots lose their digits.
    own = J.shape[1] - g
    measured = np.column_stack([J[:, g:], J[:, :g], fit.parts[i].gaps.ravel()])
    believed = np.zeros((own, J.shape[1] + 1))
    steady = fit.own_belief(i)
    believed[:, :own] = block_diag(steady[:, g:], process)
    believed[: campaign.l, own:-1] = steady[:, :g]
    believed[: campaign.l, -1] = steady @ np.concatenate([fit.common, fit.own[i]])
    R = _triangular([measured, believed])
    root = solve_triangular(R[:own, :own], np.eye(own))
    return _Log(knots, R[own:, own:], root @ root.T, -root @ R[:own, -1], root @ R[:own, own:-1])


def _triangular(equations: list[Floats]) -> Floats:
    """Return the triangular factor of stacked equations: they have the same sums of squares as the factor's."""
    return np.asarray(np.linalg.qr(np.vstack(equations))[1], dtype=np.float64)


def _changes(fit: CampaignFit, i: int, rows: list[int], knots: _Knots) -> Floats:
    """Return derivatives of a log's gaps on the channels by its departures in sizes, knot by knot, shape (J, 3, K q)."""
    campaign, windows = fit.campaign, fit.campaign.members[i].windows
    J, m, n = len(windows.starts), len(windows.weight), len(windows.measurements.t)
    at = (windows.starts[:, None] + np.arange(m)).ravel()
    weight = np.tile(windows.weight * windows.measurements.step_s, J)
    means = csr_array((weight, at, np.arange(0, J * m + 1, m)), shape=(J, n))
    changes = np.zeros((J, 3, len(knots.t), len(rows)))
    for q, row in enumerate(rows):
        # Ahead and astern, as in the campaign's own derivatives: a wind near none has another slope to either side.
        ends = []
        for sign in (1.0, -1.0):
            moved = fit.own[i].copy()
            moved[row] += sign * DIFFERENCE_STEP
            ends.append(windows.along(as_measured(campaign.force_model(i, fit.common, moved))))
        slope = (ends[0] - ends[1]) / (2.0 * DIFFERENCE_STEP)
        for channel in range(3):
            changes[:, channel, :, q] = (means @ knots.parts.multiply(slope[:, channel, None])).toarray()
    return changes.reshape(J, 3, -1)


def _course(fit: CampaignFit, i: int, rows: list[int], log: _Log, step: Floats, covariance: Floats) -> Course:
    campaign, g, K = fit.campaign, fit.campaign.g, len(log.knots.t)
    parameters = [campaign.own[j][1] for j in rows]
    moved = np.concatenate([step, log.alone - log.back @ step])
    across = -covariance @ log.back.T
    both = np.block([[covariance, across], [across.T, log.covariance + log.back @ covariance @ log.back.T]])
    both *= INFERENCE.posterior_factor**2 * max(1.0, fit.disagreement)
    share = log.knots.parts[campaign.members[i].windows.measurements.usable].mean(axis=0)
    picks, pick_mean = np.zeros((len(rows), K, len(moved))), np.zeros((len(rows), len(moved)))
    for q, (row, one) in enumerate(zip(rows, parameters, strict=True)):
        for pick in (picks[q], pick_mean[q : q + 1]):
            pick[:, campaign.means.start + row] = pick[:, g + row] = one.size
        picks[q][:, g + campaign.l + q :: len(rows)] = one.size * np.eye(K)
        pick_mean[q, g + campaign.l + q :: len(rows)] = one.size * share
    z = fit.common[campaign.means][rows] + fit.own[i, rows]
    steady = [one.neutral + one.size * at for one, at in zip(parameters, z.tolist(), strict=True)]
    return Course(
        log.knots.t,
        {one.name: at + pick @ moved for one, at, pick in zip(parameters, steady, picks, strict=True)},
        {
            one.name: np.sqrt(np.einsum("ka,ab,kb->k", pick, both, pick))
            for one, pick in zip(parameters, picks, strict=True)
        },
        np.array(steady) + pick_mean @ moved,
        pick_mean @ both @ pick_mean.T,
    )
