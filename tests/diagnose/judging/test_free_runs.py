"""Free runs that diverge, or that cannot be judged, count as none."""

from __future__ import annotations

import numpy as np

from ferryid.diagnose.judging.free_runs import DIVERGED, _judged, _stopped

HORIZONS = np.array([1.0, 2.0])


def test_runs_that_all_diverge_are_none() -> None:
    runs = _judged(HORIZONS, np.full((2, 6, 2, 4), np.nan), np.arange(6))
    assert runs.starts == 0
    assert np.isnan(runs.low).all()


def test_runs_that_reach_their_horizon_are_judged() -> None:
    errors = np.ones((2, 6, 2, 4))
    errors[1] = 0.5
    runs = _judged(HORIZONS, errors, np.arange(6))
    assert runs.starts == 6
    assert np.allclose(runs.removed, 0.5)
    assert np.allclose((runs.low, runs.high), 0.5)


def test_a_run_is_left_out_from_where_it_diverged_on() -> None:
    path = np.ones((4, 2, 6))
    path[1, 0, 3] = -DIVERGED
    stopped = _stopped(path)
    assert np.isfinite(stopped[0]).all()
    assert np.isnan(stopped[1:, 0]).all()
    assert np.isfinite(stopped[:, 1]).all()


def test_errors_that_grow_by_more_than_a_tenth_and_than_chance_are_counted() -> None:
    errors = np.ones((2, 6, 2, 4))
    # Over the longest horizon alone: position and heading much larger, speed a little, yaw rate in one block only.
    errors[1, :, 1, 0], errors[1, :, 1, 1], errors[1, :, 1, 2], errors[1, 0, 1, 3] = 1.3, 1.2, 1.05, 3.0
    errors[1, :, 0] = 2.0
    assert _judged(HORIZONS, errors, np.arange(6)).worse == ("position", "heading")
    # Where nothing reaches the longest horizon, the next one counts.
    errors[:, :, 1] = np.nan
    assert _judged(HORIZONS, errors, np.arange(6)).worse == ("position", "heading", "speed", "yaw rate")
    assert _judged(HORIZONS, np.full((2, 6, 2, 4), np.nan), np.arange(6)).worse == ()


def test_one_block_that_reaches_a_horizon_tells_nothing_of_chance() -> None:
    errors = np.ones((2, 6, 2, 4))
    errors[1, :, 0], errors[1, 0, 1] = 0.5, 1.3
    errors[:, 1:, 1] = np.nan
    assert _judged(HORIZONS, errors, np.arange(6)).worse == ()
