"""Held-out blocks: what the rest of the logs cannot predict is no evidence."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ferryid.diagnose.inference.campaign_estimation import CampaignFit
from ferryid.diagnose.judging.campaign_evidence import HeldOutLoss, held_out_loss
from ferryid.types import Floats

COUNT = 40


def fitted(slopes: Floats, gaps: Floats | None = None) -> CampaignFit:
    """Return a log of `COUNT` windows with unit noise and one parameter of each column of the slopes, shape (J, 3, p)."""
    flat = slopes.reshape(-1, slopes.shape[2])
    covariance = np.linalg.inv(flat.T @ flat + np.eye(flat.shape[1]))
    gaps = np.random.default_rng(3).standard_normal((COUNT, 3)) if gaps is None else gaps
    windows = SimpleNamespace(starts=np.arange(COUNT), weight=np.ones(4), runs=((0, COUNT),))
    campaign = SimpleNamespace(
        members=[SimpleNamespace(windows=windows)],
        linearised=lambda *_: [(gaps, slopes)],
    )
    made = SimpleNamespace(
        parts=[SimpleNamespace(gaps=gaps, slopes=slopes)],
        campaign=campaign,
        common=None,
        own=[None],
        covariance=lambda i: covariance,
    )
    return cast("CampaignFit", made)


def test_a_block_that_alone_knows_a_parameter_gains_nothing() -> None:
    slopes = np.ones((COUNT, 3, 2))
    slopes[:, :, 1] = 0.0
    whole = held_out_loss(fitted(slopes))
    assert np.isfinite(whole.blocks).all()
    # The second parameter acts in the last windows alone, a thousand times the noise.
    slopes[-4:, :, 1] = 1e3
    alone = held_out_loss(fitted(slopes))
    assert np.isfinite(alone.blocks[:-1]).all()
    # Along that parameter the block is not predicted, and shows no error; the rest of it is judged as before.
    assert alone.blocks[-1] < 3.0 * whole.blocks.max()
    assert np.isfinite(alone.errors[0]).all()
    gain = alone.gain(whole)
    assert gain[:-1] == pytest.approx(0.0, abs=0.5)


def test_the_likelihood_of_a_block_is_that_of_its_prediction_by_the_rest() -> None:
    """By Gaussian conditioning on what is farther than a window from the block; one parameter is the first half's own."""
    rng = np.random.default_rng(5)
    slopes = rng.standard_normal((COUNT, 3, 2)) * [1.0, 3.0]
    slopes[COUNT // 2 :, :, 1] = 0.0
    y, flat = rng.standard_normal((COUNT, 3)), slopes.reshape(-1, 2)
    at = -np.linalg.solve(flat.T @ flat + np.eye(2), flat.T @ y.ravel())
    found = held_out_loss(fitted(slopes, y + slopes @ at)).blocks
    assert len(found) == 2
    for k, (block, rest) in enumerate(((slice(0, 20), slice(24, 40)), (slice(20, 40), slice(0, 16)))):
        J, known = slopes[block].reshape(-1, 2), slopes[rest].reshape(-1, 2)
        C = np.linalg.inv(known.T @ known + np.eye(2))
        left = y[block].ravel() - J @ C @ known.T @ y[rest].ravel()
        S = np.eye(len(left)) + J @ C @ J.T
        assert found[k] == pytest.approx(left @ np.linalg.solve(S, left) + np.linalg.slogdet(S)[1])
    # The plain squares of the first would say that it is many times worse than the noise: nothing knows its own parameter.
    assert found[0] < 2.0 * found[1]


def test_the_gain_of_other_blocks_is_that_of_the_likelihood() -> None:
    one, other = (HeldOutLoss(np.array(blocks), np.zeros(2, dtype=int), ()) for blocks in ([2.0, 3.0], [6.0, np.nan]))
    assert one.gain(other).tolist() == [2.0, 0.0]
