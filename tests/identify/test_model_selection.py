"""The choice of window and component count: which rows it sees, which window is right, and which it must not be asked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.identify import inputs
from ferryid.identify import pipeline as module
from ferryid.identify.log_sums import folds_by_blocks, force_free_axes, sum_log
from ferryid.identify.model_selection import Selection, distinct_windows, select_model, windows_to_try
from ferryid.identify.outcome import FitOutcome
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import WINDOWS_S, FitSettings
from ferryid.regression.bases.basis import make_basis
from ferryid.signals.prepare import Opened, open_track
from ferryid.signals.smooth import Measured
from ferryid.signals.track import Motion
from ferryid.types import RunContext
from tests.identify.rounds import PROFILE
from tests.identify.trials import measured

Floats = NDArray[np.float64]

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
SETTINGS = FitSettings(delta=0.4, sigma=0.4, inertia="fitted")
FUNCTIONS = make_basis("modulus", structure="decoupled")
K = len(FUNCTIONS.terms)


def chosen(settings: FitSettings, windows_s: tuple[float, ...], *logs: Measured) -> Selection:
    pieces = [sum_log(PROFILE, settings, FUNCTIONS, log, windows_s) for log in logs]
    return select_model(PROFILE, settings, FUNCTIONS, windows_s, folds_by_blocks(pieces), force_free_axes(pieces))


@pytest.mark.slow
def test_the_best_window_is_the_test_rows_own() -> None:
    """Of all coefficients those fitted to rows smoothed alike have the least error on test rows, where rows are many.

    With noisy velocities a shorter window pulls coefficients to zero by more; with quick turns a longer one flattens products.
    """
    logs = [measured(seed, seconds=600.0, jitter=0.05) for seed in (1, 2)]
    windows_s = (0.0, 0.25, 1.0, 8.0, 16.0)
    choice = chosen(replace(SETTINGS, components=K), windows_s, *logs)
    assert (choice.window_s, choice.components) == (1.0, K)
    score = choice.curves.normalised()[0][:, -1]
    assert (np.diff(score[:3]) < 0.0).all()
    assert (np.diff(score[2:]) > 0.0).all()
    auto = chosen(SETTINGS, windows_s, *logs)
    assert auto.window_s == 1.0
    assert auto.components < K


@pytest.mark.slow
def test_of_a_given_number_of_components_the_best_window_is_taken() -> None:
    log, windows_s = measured(1, noise=300.0), (0.5, 0.7, 0.9, 1.0, 1.5, 3.0)
    taken = {
        components: chosen(replace(SETTINGS, components=components), windows_s, log) for components in (1, 3, 6, K + 9)
    }
    assert [choice.components for choice in taken.values()] == [1, 3, 6, K]
    for choice in taken.values():
        assert choice.window == np.argmin(choice.curves.normalised()[0][:, choice.components - 1])
    assert len({choice.window_s for choice in taken.values()}) > 1


def test_error_over_the_base_models() -> None:
    choice = chosen(SETTINGS, (1.0,), measured(1, noise=20.0))
    np.testing.assert_array_equal(choice.over_base, choice.curves.mse / choice.curves.base)
    # Noise of 20 N, a tenth of whose power a window of 11 rows leaves.
    assert choice.over_base[0, -1, 0] * choice.curves.base[0] == pytest.approx(400.0 / 11.0, rel=0.2)


def test_test_rows_are_the_same_for_all_windows_and_for_every_residual() -> None:
    log = replace(measured(1, noise=20.0), tau_d=measured(1).tau * 1.1)
    alone = sum_log(PROFILE, SETTINGS, FUNCTIONS, log, (0.5, 3.0))
    for residual, smoother in (("commanded", "square"), ("parallel", "square"), ("measured", "savgol")):
        other = sum_log(PROFILE, replace(SETTINGS, residual=residual, smoother=smoother), FUNCTIONS, log, (0.5, 3.0))
        np.testing.assert_array_equal(other.test.products, alone.test.products)
        np.testing.assert_array_equal(other.test.n, alone.test.n)
        assert not np.allclose(other.training[0].products, alone.training[0].products)
    assert [one.n.sum() for one in alone.training] != [alone.test.n.sum()] * 2


@pytest.mark.parametrize("held", [False, True])
def test_inertia_that_a_fit_would_hold_is_held(held: bool) -> None:
    settings = replace(SETTINGS, inertia="auto" if held else "fitted")
    log = measured(1, noise=5.0)
    forceless = replace(log, tau=log.tau * [1.0, 0.0, 1.0])
    choice = chosen(settings, (1.0,), forceless)
    assert choice.held.tolist() == [False, held, False]
    # Without inertia, no force needs no damping either, and the regression is perfect.
    assert bool(choice.over_base[0, -1, 1] > 0.2) is held


def test_inertia_is_held_where_it_is_told_that_no_actuator_acts() -> None:
    pieces = [sum_log(PROFILE, SETTINGS, FUNCTIONS, measured(1, noise=5.0), (1.0,))]
    folds, forceless = folds_by_blocks(pieces), np.array([True, False, False])
    for inertia in ("auto", "fitted"):
        choice = select_model(PROFILE, replace(SETTINGS, inertia=inertia), FUNCTIONS, (1.0,), folds, forceless)
        assert choice.held.tolist() == [inertia == "auto", False, False]


def test_inertia_that_cannot_be_right_is_held() -> None:
    def light(made: Motion) -> Floats:
        """An added mass far below zero, so that the hull seems to weigh a fifth."""
        return made.nu_dot * [0.0, 0.0, -0.9 * PROFILE.hull.M[2, 2]]

    log = measured(1, noise=1.0, force=light)
    assert chosen(replace(SETTINGS, inertia="auto"), (1.0,), log).held.tolist() == [False, False, True]
    honest = chosen(replace(SETTINGS, inertia="auto"), (1.0,), measured(1, noise=1.0))
    assert not honest.held.any()


def test_where_no_actuator_acts_is_told_of_all_logs_together() -> None:
    log = measured(1)
    scales = ([1.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0])
    pieces = [
        sum_log(PROFILE, SETTINGS, FUNCTIONS, replace(log, tau=log.tau * scale + [0.0, 7.0, 0.0]), (1.0,))
        for scale in scales
    ]
    told = [force_free_axes(some).tolist() for some in (pieces, pieces[:1], pieces[1:2], pieces[1:])]
    assert told == [[False, True, False], [False, True, False], [True, True, False], [True, True, False]]
    # A force that is steady in each log and differs between them is a force.
    other = sum_log(PROFILE, SETTINGS, FUNCTIONS, replace(log, tau=log.tau * [1.0, 0.0, 1.0] - [0.0, 7.0, 0.0]), (1.0,))
    assert not force_free_axes([pieces[0], other]).any()


def test_windows_that_come_to_the_same_rows_are_tried_once() -> None:
    # At 10 Hz 0.5 and 0.6 s are five and seven rows, 0.5 and 0.55 both five; at 40 Hz they differ.
    assert distinct_windows((1.0, 0.55, 0.5, 0.0, 0.1), [10.0]) == (0.0, 0.5, 1.0)
    assert distinct_windows((0.5, 0.55, 0.6), [10.0]) == (0.5, 0.6)
    assert distinct_windows((0.5, 0.55), [10.0, 40.0]) == (0.5, 0.55)
    log = measured(1, seconds=20.0)
    assert windows_to_try((0.55, 0.5), [log]) == (0.5,)


def test_usual_windows_are_tried_where_the_log_is_ten_times_as_long() -> None:
    long, short = measured(1), measured(1, seconds=20.0)
    assert windows_to_try((), [long]) == windows_to_try(WINDOWS_S, [long]) == WINDOWS_S
    assert windows_to_try((), [long, short]) == tuple(one for one in WINDOWS_S if one <= 2.0)
    assert windows_to_try((5.0, 1.0), [short]) == (1.0, 5.0)
    with pytest.raises(FerryIdError, match=r"--windows: 61\.0 s is no smoothing window"):
        windows_to_try((1.0, 61.0), [long])


def test_the_kalman_smoother_finds_its_window_itself() -> None:
    with pytest.raises(
        FerryIdError, match=r"^--window auto: the Kalman smoother finds its window by likelihood. Fix: "
    ):
        FitSettings(smoother="kalman", windows_s=WINDOWS_S)


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Opened:
    return open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path_factory.mktemp("out"))


def fitted(monkeypatch: pytest.MonkeyPatch, opened: Opened, log: Measured, windows_s: tuple[float, ...]) -> FitOutcome:
    monkeypatch.setattr(inputs, "open_track", lambda *_, **__: replace(opened, measured=log))
    settings = FitSettings(delta=0.4, sigma=0.4, draws=20, windows_s=windows_s)
    return fit_logs(["short.mcap"], PROFILE, settings, RunContext(Path("nowhere")))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "gaps", "windows_s"),
    [(130.0, 0, ()), (130.0, 0, WINDOWS_S), (240.0, 0, WINDOWS_S), (240.0, 6, ()), (600.0, 12, WINDOWS_S)],
)
def test_validation_rows_do_not_reach_the_choice(
    monkeypatch: pytest.MonkeyPatch, opened: Opened, seconds: float, gaps: int, windows_s: tuple[float, ...]
) -> None:
    log = measured(3, seconds=seconds, jitter=0.02, noise=20.0, gaps=gaps)
    seen: list[Selection] = []
    monkeypatch.setattr(module, "select_model", lambda *a, **k: seen.append(select_model(*a, **k)) or seen[-1])
    honest = fitted(monkeypatch, opened, log, windows_s)
    validation = honest.logs[0].validation
    assert validation.sum() > 200
    poison = np.where(validation[:, None], 5.0 * log.tau + 100.0, log.tau)
    poisoned = fitted(monkeypatch, opened, replace(log, tau=poison), windows_s)
    np.testing.assert_array_equal(poisoned.logs[0].validation, validation)
    assert len(seen) == 2
    np.testing.assert_array_equal(seen[1].curves.mse, seen[0].curves.mse)
    np.testing.assert_array_equal(poisoned.judged.theta, honest.judged.theta)
    assert poisoned.acceptance.normalised_mse != honest.acceptance.normalised_mse
    assert honest.model.settings["window_s"] == seen[0].window_s
    assert honest.model.settings["components"] == seen[0].components
