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


def fitted(slopes: Floats) -> CampaignFit:
    """Return a log of `COUNT` windows with unit noise and one parameter of each column of the slopes, shape (J, 3, p)."""
    flat = slopes.reshape(-1, slopes.shape[2])
    covariance = np.linalg.inv(flat.T @ flat + np.eye(flat.shape[1]))
    gaps = np.random.default_rng(3).standard_normal((COUNT, 3))
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


def test_the_gain_of_other_blocks_is_that_of_the_likelihood() -> None:
    one, other = (HeldOutLoss(np.array(blocks), np.zeros(2, dtype=int), ()) for blocks in ([2.0, 3.0], [6.0, np.nan]))
    assert one.gain(other).tolist() == [2.0, 0.0]
