"""Feedback in nats: what a controller put of the disturbances into the forces is seen, and chance is not."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isfinite

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import fit, fitted_force_model
from ferryid.diagnose.inference.feedback import feedback_beside, feedback_of, joined
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.signals.feedback import LAGS, Feedback, directed_information
from ferryid.types import Floats
from tests.diagnose.judging.test_held_out import sailed, trial_on

ROWS = 1200
SHARE = 0.1
"""Share of an order's variance that is the answer to the error two steps before."""


def series(seed: int, answer: float = 0.0) -> tuple[Floats, Floats]:
    """Return white errors, and forces that follow their own past and, by a share of their news, the errors before."""
    rng = np.random.default_rng(seed)
    errors, news = rng.standard_normal((ROWS, 3)), rng.standard_normal((ROWS, 3))
    forces = np.zeros((ROWS, 3))
    for k in range(2, ROWS):
        forces[k] = 0.9 * forces[k - 1] + np.sqrt(1.0 - answer) * news[k] + np.sqrt(answer) * errors[k - 2]
    return errors, forces


def test_an_answer_is_worth_its_information() -> None:
    errors, forces = series(1, SHARE)
    found = directed_information(errors, forces, [(0, ROWS)])
    # Three channels of white news, of whose variance a share is known beforehand.
    assert found.nats == pytest.approx(-0.5 * 3 * ROWS * np.log1p(-SHARE), rel=0.15)


def test_forces_that_answer_nothing_hold_as_much_as_chance() -> None:
    every = [directed_information(*series(seed), [(0, ROWS)]) for seed in range(40)]
    nats = np.array([one.nats for one in every])
    error = every[0].error
    assert abs(nats.mean()) < 3.0 * error / np.sqrt(len(nats))
    assert nats.std() == pytest.approx(error, rel=0.35)
    # What the motion owes to the forces is no feedback: here the errors follow them.
    errors, forces = series(5)
    errors[1:] += 0.3 * forces[:-1] - 0.27 * np.vstack([np.zeros(3), forces[:-2]])
    assert directed_information(errors, forces, [(0, ROWS)]).nats > -3.0 * error


def test_units_idle_axes_and_tied_axes_do_not_count() -> None:
    errors, forces = series(2, SHARE)
    alone = directed_information(errors, forces[:, :1], [(0, ROWS)])
    tied = np.column_stack([1e2 * forces[:, 0], np.full(ROWS, 7.0), -3e-2 * forces[:, 0]])
    found = directed_information(errors, tied, [(0, ROWS)])
    assert (found.nats, found.error) == pytest.approx((alone.nats, alone.error))


def test_series_do_not_reach_over_a_gap() -> None:
    errors, forces = series(3, SHARE)
    half = ROWS // 2
    whole, parted = (
        directed_information(errors, forces, runs).nats for runs in ([(0, ROWS)], [(0, half), (half, ROWS)])
    )
    assert parted == pytest.approx(whole, rel=0.05)
    assert parted != whole


@pytest.mark.parametrize("rows", [0, LAGS[-1][1], 60])
def test_a_log_too_short_to_tell_may_hold_any_feedback(rows: int) -> None:
    errors, forces = series(4)
    assert directed_information(errors[:rows], forces[:rows], [(0, rows)] if rows else []).high == inf
    assert directed_information(errors, np.zeros((ROWS, 3)), [(0, ROWS)]).high == inf


def test_several_logs_add_up() -> None:
    both = joined([Feedback(3.0, 4.0), Feedback(-1.0, 3.0)])
    assert (both.nats, both.error) == (2.0, 5.0)
    assert joined([Feedback(3.0, 4.0), Feedback(0.0, inf)]).high == inf
    # Less than nothing is by chance, and does not make the most that there may be less than that of none.
    assert Feedback(-5.0, 4.0).high == Feedback(0.0, 4.0).high


@pytest.mark.slow
def test_orders_by_the_clock_answer_nothing_and_steering_by_what_is_measured_does() -> None:
    calm = sailed(480.0, np.zeros(2))
    problem = trial_on(calm)
    made = fit(problem, [])
    by_fit, by_model = (
        feedback_of(problem, made),
        feedback_beside(problem.windows, fitted_force_model(problem.plain, made)),
    )
    assert by_fit == by_model
    assert by_fit == Feedback(0.0, 0.0)
    # Steering for the heading that the compass reports is seen by the compass's own noise.
    late = np.roll(calm.eta[:, 2], 3) - np.roll(calm.eta[:, 2], 4)
    parts = calm.parts.copy()
    parts[:, :, 2] -= 1e4 * late[:, None]
    steered = trial_on(replace(calm, parts=parts))
    answers = feedback_of(steered, fit(steered, []))
    assert isfinite(answers.high)
    assert answers.nats > 10.0 * answers.error


def test_a_log_without_steps_may_hold_any_feedback() -> None:
    problem = trial_on(sailed(60.0, np.zeros(2)))
    windows: Windows = replace(problem.windows, starts=problem.windows.starts[:0], runs=())
    assert feedback_beside(windows, problem.plain).high == inf
