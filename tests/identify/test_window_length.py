"""How long training windows are, and what ties the Coriolis force to the mass."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ferryid.identify import shared_rows
from ferryid.identify.feasible import LiftTie, feasible_gains
from ferryid.identify.split import Split
from ferryid.identify.weak_rows import WeakRows, to_force
from ferryid.identify.window_length import prediction_scatter, with_best_length
from ferryid.models.forces import effective_mass
from ferryid.regression.bases import make_basis
from ferryid.signals.track import Motion
from ferryid.types import Flags
from tests.identify.rounds import PROFILE
from tests.identify.test_weak_form import BASIS, SCALE, K, data_of
from tests.identify.trials import measured


def test_noisy_positions_and_velocities_ask_for_longer_windows_than_exact_ones() -> None:
    exact, noisy = (
        with_best_length(data_of([measured(1, seconds=900.0, noise=noise, jitter=jitter)]))
        for noise, jitter in ((60.0, 0.0), (0.0, 0.05))
    )
    assert exact.windows.training_length_s == exact.windows.length_s
    assert noisy.windows.training_length_s >= 2.0 * noisy.windows.length_s


def test_the_scatter_falls_as_the_root_of_the_number_of_logs() -> None:
    one, four = (data_of([measured(seed, noise=80.0) for seed in range(1, 1 + count)]) for count in (1, 4))
    at = np.concatenate([each.regressors(BASIS.terms) for each in one.training_windows])
    at = at - at.mean(axis=0)
    ratio = prediction_scatter(one, at) / prediction_scatter(four, at)
    np.testing.assert_allclose(ratio, 2.0, rtol=0.4)


def test_a_length_that_is_given_stays_and_short_logs_keep_the_usual_one() -> None:
    given = with_best_length(data_of([measured(1, seconds=900.0, jitter=0.05)], weak_window_s=9.0))
    assert given.windows.training_length_s == 9.0
    short = with_best_length(data_of([measured(1, seconds=120.0, jitter=0.05)]))
    assert short.windows.training_length_s == short.windows.length_s


def test_models_are_judged_in_windows_of_the_usual_length_whatever_trains() -> None:
    plain = data_of([measured(1, seconds=900.0, jitter=0.05)])
    long = replace(plain, training_s=3.0 * plain.windows.length_s)
    rows = plain.motions[0].valid
    half = np.arange(len(rows)) < len(rows) // 2
    split = Split("blocks", (rows & half,), (rows & ~half,), 0.0)
    judged = [replace(one, split=split).windows.validation[0] for one in (plain, long)]
    np.testing.assert_array_equal(judged[0].start, judged[1].start)
    # Where nothing is held out, those of the training rows.
    np.testing.assert_array_equal(long.windows.judged[0].start, plain.windows.training[0].start)
    assert len(long.windows.training[0]) < 0.5 * len(plain.windows.training[0])


@pytest.mark.parametrize("sure", [True, False])
def test_a_turning_moment_of_surge_and_sway_goes_with_the_masses_unless_lift_is_unbounded(sure: bool) -> None:
    uv, u_dot, v_dot = (BASIS.terms.index(name) for name in ("uv", "u_dot", "v_dot"))
    gains = np.zeros((K, 3))
    gains[uv, 2] = 400.0
    information = np.array([1e4 * np.eye(K)] * 3)
    information[2][uv, uv] = 1e-3
    tie = LiftTie(uv, 2, ((1, 1, 1.0), (0, 0, -1.0)), 1.0 if sure else np.inf)
    nu = np.random.default_rng(1).standard_normal((500, 3)) * [0.5, 0.2, 0.05]
    found = feasible_gains(PROFILE, SCALE, BASIS, BASIS.mask, gains, information, nu, ties=(tie,))
    base = effective_mass(PROFILE, SCALE, (), np.zeros((0, 3)))
    theta, _ = to_force(found.gains, np.zeros(3), BASIS.terms, base)
    added = effective_mass(PROFILE, SCALE, BASIS.terms, theta) - base
    lift = theta[uv, 2] - (added[1, 1] - added[0, 0])
    assert bool(abs(lift) < 5.0) is sure
    # Draws are pulled alike, to a lift that is drawn.
    drawn = found.moved(np.repeat(gains[None], 400, axis=0))[:, uv, 2]
    assert bool(drawn.std() > 0.3) is sure
    assert theta[u_dot, 0] == pytest.approx(added[0, 0])
    assert theta[v_dot, 1] == pytest.approx(added[1, 1])


def test_rows_are_shared_by_folds_and_lengths_and_change_no_window(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    own = shared_rows.row_columns

    def counted(motion: Motion, *given: Any) -> Any:
        made.append(motion.log)
        return own(motion, *given)

    monkeypatch.setattr(shared_rows, "row_columns", counted)
    data = data_of([measured(seed, seconds=300.0, jitter=0.05) for seed in (1, 2)])
    rows = tuple(one.valid & (np.arange(len(one.t)) % 700 < 600) for one in data.motions)
    others = [
        replace(data, training_s=24.0),
        replace(data, split=Split("folds", rows, tuple(~one for one in rows), 0.0)),
    ]
    found = [one.windows.training + one.windows.judged for one in (data, *others)]
    # Measured and steadied velocities of two logs.
    assert len(made) == 4
    monkeypatch.setattr(shared_rows, "MOST_ROWS", 0)
    for one, windows in zip((data, *others), found, strict=True):
        alone = replace(one, shared=shared_rows.SharedRows()).windows
        for kept, again in zip(windows, alone.training + alone.judged, strict=True):
            for name in ("functions", "steady", "bare", "force", "by_pose", "start"):
                np.testing.assert_array_equal(getattr(kept, name), getattr(again, name))
    assert len(made) > 12


def test_rows_of_another_scale_or_basis_are_made_anew() -> None:
    shared, (motion,) = shared_rows.SharedRows(), data_of([measured(1, seconds=120.0)]).motions
    one, again, heavier, other = (
        shared.columns(motion, PROFILE, scale, basis, steadied=False)
        for scale, basis in (
            (SCALE, BASIS),
            (SCALE, BASIS),
            ({**SCALE, "sigma": 2.0 * SCALE.get("sigma", 1.0)}, BASIS),
            (SCALE, make_basis("thesis")),
        )
    )
    assert again is one
    assert not np.array_equal(heavier["steady"], one["steady"])
    assert other["functions"].shape != one["functions"].shape


def test_windows_that_were_averaged_before_are_not_averaged_again(monkeypatch: pytest.MonkeyPatch) -> None:
    shared, (motion,) = shared_rows.SharedRows(), data_of([measured(1, seconds=120.0)]).motions
    every, some = np.ones(len(motion.t), dtype=bool), np.arange(len(motion.t)) < 600

    def windows(rows: Flags, length_s: float, *, steadied: bool = False) -> WeakRows:
        return shared.windows(motion, rows, PROFILE, SCALE, BASIS, length_s, steadied=steadied)

    first = windows(every, 8.0)
    assert windows(every.copy(), 8.0) is first
    for other in (windows(some, 8.0), windows(every, 12.0), windows(every, 8.0, steadied=True)):
        assert other is not first
    monkeypatch.setattr(shared_rows, "MOST_ROWS", 0)
    shared = shared_rows.SharedRows()
    assert windows(every, 8.0) is not windows(every, 8.0)


def test_forces_that_are_taken_off_go_with_the_velocity_that_enters_products() -> None:
    (motion,) = data_of([measured(1, seconds=120.0)]).motions
    left = replace(motion, tau_steadied=motion.tau + 3.0)
    for one, steadied, more in ((left, False, 0.0), (left, True, 3.0), (motion, True, 0.0)):
        force = shared_rows.SharedRows().columns(one, PROFILE, SCALE, BASIS, steadied=steadied)["force"]
        np.testing.assert_array_equal(force, np.nan_to_num(motion.tau + more))
