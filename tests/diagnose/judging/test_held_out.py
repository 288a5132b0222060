"""Held-out evidence: what holds, and what a placebo matches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, estimation_problem, fit
from ferryid.diagnose.inference.folds import folds_of, subset
from ferryid.diagnose.inference.force_errors import force_errors, mass_of
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.free_runs import free_runs
from ferryid.diagnose.judging.held_out import (
    HEADING,
    _matched,
    compare_held_out,
    held_out,
    held_out_evidence,
    imitable,
    placebos,
)
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.effect import HELD
from ferryid.effects.force_model import ForceModel, Measurements, hull_of
from ferryid.effects.thresholds import EFFECTS
from ferryid.vessel import load_profile
from ferryid.vessel.hull import current_in_body, payload_mass
from ferryid.vessel.profile import Hull
from ferryid.vessel.wind import wind_force
from tests.vessel.hull_matrices import forward

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
WIND = np.array([-2.0, 1.5])


def sailed(
    seconds: float,
    wind: np.ndarray,
    noise: float = 0.005,
    hull: Hull = FERRY.hull,
    *,
    current: tuple[float, float] = (0.0, 0.0),
    steady: tuple[float, float, float] | None = None,
    swaying: tuple[float, float] = (0.0, np.inf),
) -> Measurements:
    """Integrate the ferry by scipy under a force of many periods, or a steady one, and measure it with white noise.

    Across only while it is `swaying`, if a span is given.
    """

    def tau(t: float) -> np.ndarray:
        if steady is not None:
            return np.array(steady)
        # Ratios of periods without a common multiple: the trial never repeats itself.
        return np.array(
            [
                60.0 + 120.0 * np.sin(t / 7.1) + 80.0 * np.sin(t / 17.3),
                90.0 * np.sin(t / 11.7 + 1.0) * (swaying[0] < t < swaying[1]),
                120.0 * np.sin(t / 9.1 + 2.0) + 100.0 * np.sin(t / 29.0),
            ]
        )

    assert FERRY.wind is not None
    areas = FERRY.wind

    def rates(t: float, state: np.ndarray) -> np.ndarray:
        psi, nu = state[2:3], state[None, 3:]
        load = wind_force(areas, wind[None], psi, nu)
        c, s = np.cos(state[2]), np.sin(state[2])
        moved = [c * state[3] - s * state[4], s * state[3] + c * state[4], state[5]]
        nu_c = current_in_body(np.array([current]), psi) if any(current) else None
        return np.concatenate([moved, forward(hull, nu, tau(t)[None] + load, nu_c)[0]])

    t = np.arange(0.0, seconds, 0.2)
    path = solve_ivp(rates, (0.0, seconds), np.zeros(6), t_eval=t, rtol=1e-7, atol=1e-7).y.T
    rng = np.random.default_rng(3)
    eta = path[:, :3] + rng.standard_normal((len(t), 3)) * [noise, noise, 0.1 * noise]
    nu = path[:, 3:] + rng.standard_normal((len(t), 3)) * [noise, noise, 0.1 * noise]
    force = np.array([tau(one) for one in t])
    # Half of the force each from two thrusters: where it acts is of no interest here.
    parts = np.stack([0.5 * force, 0.5 * force], axis=1)
    return Measurements(FERRY, t, eta, nu, path[:, 3:], parts, np.zeros((len(t), 2)), np.ones(len(t), dtype=bool))


def trial_on(measurements: Measurements) -> EstimationProblem:
    cut = windows(measurements, 8.0, 2.0)
    seen = cut.measurements
    still = wind_force(FERRY.wind, np.zeros((len(seen.t), 2)), seen.psi, seen.nu) if FERRY.wind else np.zeros(3)
    plain = ForceModel(seen, hull_of(FERRY), seen.parts, seen.angles, still)
    return estimation_problem(cut, plain, EFFECTS.hull_spread * np.abs(plain.hull))


def candidate(name: str, instance: str | None = None) -> Candidate:
    effect = effects()[name]
    return Candidate(effect, instance, effect.parameters_of(FERRY))


@pytest.fixture(scope="module")
def windy() -> EstimationProblem:
    problem = trial_on(sailed(480.0, WIND))
    return problem.with_noise_of(fit(problem, [candidate("wind")]))


@pytest.fixture(scope="module")
def calm() -> EstimationProblem:
    return trial_on(sailed(480.0, np.zeros(2)))


def test_what_is_left_over_is_model_minus_measured(windy: EstimationProblem) -> None:
    """A wind that the model does not know pushes the vessel; what is left over is that push with its sign turned round."""
    seen, plain = windy.windows, windy.plain
    assert FERRY.wind is not None
    measurements = seen.measurements
    push = (
        wind_force(FERRY.wind, np.broadcast_to(WIND, (len(measurements.t), 2)), measurements.psi, measurements.nu)
        - plain.external
    )
    left = force_errors(seen, plain, plain)
    for axis in range(3):
        slope = np.polyfit(seen.mean(push)[:, axis], left[:, axis], 1)[0]
        assert slope == pytest.approx(-1.0, abs=0.2), axis


def test_training_and_held_out_windows_share_no_row(windy: EstimationProblem) -> None:
    folds = folds_of(windy.windows)
    assert folds is not None
    width = len(windy.windows.weight)
    for k in range(INFERENCE.folds):
        held = windy.windows.starts[folds.fold == k]
        learnt = folds.training[k].starts
        assert np.abs(held[:, None] - learnt[None]).min() >= 1.25 * width - 1
        # The purge takes no more than it must.
        assert len(learnt) > 0.4 * (len(windy.windows.starts) - len(held))
    assert np.all(np.diff(folds.block) >= 0)
    assert set(folds.fold.tolist()) == set(range(INFERENCE.folds))


def test_no_series_of_training_windows_reaches_over_a_held_out_block(windy: EstimationProblem) -> None:
    folds = folds_of(windy.windows)
    assert folds is not None
    stride = int(np.diff(windy.windows.starts).min())
    for training in folds.training:
        assert training.runs[0][0] == 0
        assert training.runs[-1][1] == len(training.starts)
        for first, end in training.runs:
            assert np.all(np.diff(training.starts[first:end]) == stride)


def test_a_log_too_short_to_hold_anything_out_has_no_evidence(windy: EstimationProblem) -> None:
    few = subset(windy.windows, np.arange(len(windy.windows.starts)) < 20)
    assert folds_of(few) is None
    assert folds_of(subset(windy.windows, np.zeros(len(windy.windows.starts), dtype=bool))) is None
    found = fit(windy, [candidate("wind")])
    assert held_out_evidence(replace(windy, windows=few), found) is None


def test_a_force_that_was_left_out_is_the_force_error(calm: EstimationProblem) -> None:
    push = np.array([20.0, -30.0, 40.0])
    pushed = replace(calm.plain, external=calm.plain.external + push)
    more = force_errors(calm.windows, pushed, calm.plain) - force_errors(calm.windows, calm.plain, calm.plain)
    np.testing.assert_allclose(more, np.broadcast_to(push, more.shape), rtol=1e-9)
    np.testing.assert_allclose(mass_of(hull_of(FERRY)), FERRY.hull.M)


def test_a_block_is_judged_by_fits_that_have_not_seen_it(windy: EstimationProblem) -> None:
    folds = folds_of(windy.windows)
    assert folds is not None
    judged = held_out(windy, folds, [candidate("wind")])
    # Whatever is done to a block's own measurements moves its errors by just that, and nothing through the fit.
    own = folds.fold == 0
    measured = windy.windows.measured.copy()
    measured[own] += 0.5
    changed = replace(windy, windows=replace(windy.windows, measured=measured))
    again = folds_of(changed.windows)
    assert again is not None
    other = held_out(changed, again, [candidate("wind")])
    np.testing.assert_allclose(other.gaps[own], judged.gaps[own] - 0.5, atol=1e-9)


@pytest.mark.parametrize("damping", [1.0, 2.5])
def test_what_one_stretch_alone_shows_of_the_hull_is_no_evidence(damping: float) -> None:
    """What a wind gains in stretches that were left out is as much as its evidence, also where the hull is not known there.

    The ferry swings and sways in one block alone: the others cannot tell how it is damped across.
    """
    across = {name: damping * FERRY.hull.D[name] for name in ("Y_v", "Y_|v|v", "Y_vvv")}
    hull = replace(FERRY.hull, D={**FERRY.hull.D, **across})
    problem = trial_on(sailed(480.0, 0.25 * WIND, hull=hull, swaying=(120.0, 160.0)))
    problem = problem.with_noise_of(fit(problem, [candidate("wind")]))
    found, nothing = fit(problem, [candidate("wind")]), fit(problem, [])
    told = held_out_evidence(problem, found)
    assert told is not None
    assert told.whole.score == pytest.approx(found.evidence - nothing.evidence, rel=0.3)


def test_a_wind_that_blew_holds_and_beats_every_placebo(windy: EstimationProblem) -> None:
    found = fit(windy, [candidate("wind")])
    told = held_out_evidence(windy, found)
    assert told is not None
    (proof,) = told.proofs
    assert proof.holds
    assert HEADING in proof.placebos
    assert max(proof.placebos.values()) < 0.5 * proof.improvement.score
    whole = told.whole
    assert whole.removed[1] > 0.5
    assert np.all(whole.low <= whole.removed)
    assert np.all(whole.removed <= whole.high)
    np.testing.assert_allclose(whole.removed, 1.0 - whole.mse_after / whole.mse_before)
    # The fits of the folds find the wind as well as the whole does.
    for values in [one.values[0] for one in held_out(windy, told.folds, found.candidates).fits]:
        np.testing.assert_allclose(values[:2], WIND, atol=0.15)


def test_what_did_not_happen_gains_less_than_its_prior_odds_or_does_not_hold(calm: EstimationProblem) -> None:
    """The interval of a gain by chance excludes zero now and then; no such gain makes up for the prior odds."""
    for name in ("wind", "current", "payload", "mooring"):
        told = held_out_evidence(calm, fit(calm, [candidate(name)]))
        assert told is not None
        assert not told.proofs[0].holds or told.proofs[0].improvement.score < INFERENCE.prior_odds, name


def test_what_a_hull_imitates_by_straining_is_weighed_against_the_hull_of_the_model() -> None:
    """A refitted hull that is off in all its coefficients leaves little of a load: that tells nothing of how much it weighs."""
    aboard = replace(FERRY.hull, M=FERRY.hull.M + payload_mass(np.array([[200.0, 0.3]]))[0])
    problem, load = trial_on(sailed(480.0, np.zeros(2), hull=aboard)), candidate("payload")
    problem = problem.with_noise_of(fit(problem, [load]))
    found, folds = fit(problem, [load]), folds_of(problem.windows)
    assert folds is not None
    refitted, full = held_out(problem, folds, ()), held_out(problem, folds, found.candidates, found.values, found)
    assert compare_held_out(problem, folds, refitted, full).removed.max() < JUDGING.least_removed
    evidence = held_out_evidence(problem, found)
    assert evidence is not None
    (proof,) = evidence.proofs
    assert proof.holds
    assert proof.improvement.removed.min() > 0.9
    rigid = replace(problem, hull_spread=np.zeros_like(problem.hull_spread))
    own = held_out(rigid, folds, found.candidates, found.values)
    assert proof.improvement.score == pytest.approx(
        compare_held_out(rigid, folds, held_out(rigid, folds, ()), own).score
    )
    assert proof.beaten > 0.5 * proof.improvement.score


def test_a_placebo_keeps_what_is_fitted_beside_an_effect_and_never_told(windy: EstimationProblem) -> None:
    found = np.array([*WIND, 1.1, 0.9, 0.6])
    for placebo in placebos(windy, candidate("wind"), found).values():
        free = [one.name for one in placebo.parameters if one.size > HELD]
        assert free == ["north", "east"]
        np.testing.assert_array_equal(placebo.start[2:], found[2:])


def test_a_constant_push_is_matched_by_its_placebo(calm: EstimationProblem) -> None:
    # The held-out errors shrink, but the same force late shrinks them as much: it tells nothing of when it acts.
    base = candidate("wind").effect

    def apply(force_model: ForceModel, p: np.ndarray, instance: str | None) -> ForceModel:
        return replace(force_model, external=force_model.external + np.array([p[0], p[1], 0.0]))

    pushed = replace(calm, plain=replace(calm.plain, external=calm.plain.external + np.array([40.0, -40.0, 0.0])))
    push = Candidate(
        replace(base, id="push", apply=apply),
        None,
        tuple(replace(parameter, size=50.0, low=-500.0, high=500.0) for parameter in base.parameters_of(FERRY)),
    )
    found = fit(pushed, [push])
    told = held_out_evidence(pushed.with_noise_of(found), found)
    assert told is not None
    assert told.proofs[0].improvement.score_low > 0.0
    assert told.proofs[0].beaten <= 1e-6
    assert not told.proofs[0].holds


def test_only_what_depends_on_the_heading_has_a_mirrored_placebo(windy: EstimationProblem) -> None:
    assert HEADING in placebos(windy, candidate("wind"), np.array([*WIND, 1.0, 1.0, 1.0]))
    assert HEADING not in placebos(windy, candidate("payload"), np.array([300.0, 0.5]))


def test_free_runs_of_the_true_force_model_stay_with_the_vessel(windy: EstimationProblem) -> None:
    folds = folds_of(windy.windows)
    assert folds is not None
    seen = windy.windows.measurements
    assert FERRY.wind is not None
    blown = wind_force(FERRY.wind, np.broadcast_to(WIND, (len(seen.t), 2)), seen.psi, seen.nu)
    true = replace(windy, plain=replace(windy.plain, external=blown))
    knows = [replace(fit(true, ()), hull=true.plain.hull)] * INFERENCE.folds
    runs = free_runs(true, folds, knows, knows)
    # The path of scipy's integration at 1e-8, from a start that is off by the noise.
    np.testing.assert_array_less(runs.after[:, 0], 0.03)
    np.testing.assert_array_less(runs.after[:, 2], 0.01)
    np.testing.assert_allclose(runs.removed, 0.0)
    better = free_runs(windy, folds, held_out(windy, folds, ()).fits, held_out(windy, folds, [candidate("wind")]).fits)
    assert np.all(better.removed[1:, 0] > 0.5)
    assert np.all(better.low[1:, 0] > 0.0)
    assert np.all(np.diff(better.before[:, 0]) > 0.0)


CIRCLING = (150.0, -60.0, 110.0)
"""A force that never changes [N, N, N·m], under which the ferry turns in circles."""
SET = (0.2, -0.1)
"""North and east [m/s]."""


@pytest.mark.parametrize(("effect", "current"), [("current", SET), ("wind", (0.0, 0.0)), ("current", (0.0, 0.0))])
def test_turning_circles_under_constant_orders_show_wind_and_current(effect: str, current: tuple[float, float]) -> None:
    blows = effect == "wind"
    problem = trial_on(sailed(400.0, WIND if blows else np.zeros(2), current=current, steady=CIRCLING))
    found = fit(problem, [candidate(effect)])
    problem = problem.with_noise_of(found)
    found = fit(problem, [candidate(effect)])
    evidence = held_out_evidence(problem, found)
    assert evidence is not None
    (proof,) = evidence.proofs
    assert proof.holds == (blows or any(current))
    if any(current):
        assert found.values[0] == pytest.approx(current, abs=0.01)
        # On the mirrored heading a current does the same in surge or in sway: no less than this is to be expected there.
        alike = imitable(
            problem,
            found.candidates[0],
            placebos(problem, found.candidates[0], found.values[0])[HEADING],
            found.values[0],
        )
        assert 0.4 < alike < 1.0
    if blows:
        assert found.values[0][:2] == pytest.approx(WIND, abs=0.3)


def test_what_imitates_an_effect_wholly_or_not_at_all(windy: EstimationProblem) -> None:
    wind, values = candidate("wind"), np.append(WIND, np.ones(3))
    assert imitable(windy, wind, wind, values) == pytest.approx(1.0)
    # Elsewhere in the log the vessel heads elsewhere.
    assert all(imitable(windy, wind, one, values) < 0.5 for one in placebos(windy, wind, values).values())


def test_in_circles_alone_the_mirrored_heading_may_gain_what_it_can_imitate() -> None:
    late = {"10 s late": 0.0, "20 s late": 0.0, "30 s late": 0.0}
    share = JUDGING.placebo_share
    for alike, limit in ((0.0, share), (0.5, 0.5 * (1.0 + share)), (1.0, 1.0)):
        assert not _matched(100.0, {HEADING: 99.9 * limit}, alike)
        assert _matched(100.0, {HEADING: 100.1 * limit}, alike)
        assert _matched(100.0, {**late, HEADING: 100.1 * share}, alike)
        assert _matched(100.0, dict.fromkeys(late, 100.1 * share), alike)


def test_while_the_heading_hardly_turns_a_mirrored_one_tests_nothing(
    monkeypatch: pytest.MonkeyPatch, windy: EstimationProblem
) -> None:
    t = windy.windows.measurements.t
    gust = replace(candidate("wind"), onset_s=float(t[0]) + 60.0, offset_s=float(t[0]) + 160.0)
    found = fit(windy, [gust])

    def placebos_judged(alike: float, one: Candidate) -> set[str]:
        monkeypatch.setattr("ferryid.diagnose.judging.held_out.imitable", lambda *_: alike)
        evidence = held_out_evidence(windy, replace(found, candidates=(one,)))
        assert evidence is not None
        return set(evidence.proofs[0].placebos)

    assert HEADING in placebos_judged(0.9, gust)
    assert HEADING not in placebos_judged(0.95, gust)
    assert len(placebos_judged(0.95, gust)) == 3
    # What lasts is judged by it whatever it can imitate.
    assert HEADING in placebos_judged(0.95, candidate("wind"))


def test_only_in_circles_is_what_comes_late_no_placebo(windy: EstimationProblem) -> None:
    values = np.append(WIND, np.ones(3))
    assert len(placebos(windy, candidate("wind"), values)) == 4
    circles = trial_on(sailed(300.0, WIND, steady=CIRCLING))
    assert list(placebos(circles, candidate("wind"), values)) == [HEADING]
    # What does not depend on the heading is not from another side.
    assert HEADING not in placebos(circles, candidate("thruster_gain", "thruster1"), np.array([0.8]))
    # A vessel that keeps its heading does not turn, however little that differs from what it was before.
    eta = circles.windows.measurements.eta.copy()
    eta[:, 2] = 1.0 + 0.3 * np.sin(circles.windows.measurements.t / 5.0)
    measurements = replace(circles.windows.measurements, eta=eta)
    keeping = replace(circles, windows=replace(circles.windows, measurements=measurements))
    assert len(placebos(keeping, candidate("wind"), values)) == 4
