"""The traps that a first trial of naming missing physics fell into, one test each: it fails for whoever walks into it again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ferryid.diagnose.inference.search as search_module
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fit, fitted_force_model
from ferryid.diagnose.inference.search import list_candidates, search
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.held_out import HEADING, held_out_evidence
from ferryid.effects.force_model import COEFFICIENTS, Measurements
from tests.diagnose.trials import FERRY, OFF, sailed, trial_on

BASE = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner", dwell_s = 40 }
controller = { delta = 0.7, sigma = 0.7 }
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
"""


def candidate(problem: EstimationProblem, name: str, instance: str | None = None) -> Candidate:
    return next(one for one in list_candidates(problem.plain.measurements)[0] if one.key == (name, instance))


def gain(problem: EstimationProblem, made: Fit) -> float:
    return made.evidence - fit(problem, ()).evidence


@pytest.fixture(scope="module")
def raw(tmp_path_factory: pytest.TempPathFactory) -> Measurements:
    """A closed-loop trial with coloured navigation noise, in which nothing acts but a hull that is ten per cent off."""
    return sailed(tmp_path_factory.mktemp("clean"), "clean", BASE, 3)


@pytest.fixture(scope="module")
def clean(raw: Measurements) -> EstimationProblem:
    """The same, ready for hypotheses."""
    return trial_on(raw)


@pytest.fixture(scope="module")
def inflow(tmp_path_factory: pytest.TempPathFactory) -> EstimationProblem:
    """The same with thrusters that lose force to their inflow, which damping resembles."""
    return trial_on(
        sailed(tmp_path_factory.mktemp("inflow"), "inflow", f"{BASE}thrusters = {{ inflow_loss_per_mps = 0.3 }}\n", 4)
    )


@pytest.mark.slow
def test_trap_1_noise_in_the_acceleration_is_not_less_mass(clean: EstimationProblem, raw: Measurements) -> None:
    # The trap: force on the differentiated velocity by least squares.
    u_dot = np.gradient(raw.nu_raw[:, 0], raw.step_s)
    u, v, r = raw.nu.T
    columns = np.column_stack([u_dot, u, np.abs(u) * u, v * r, r * r])
    naive = float(np.linalg.lstsq(columns, raw.parts.sum(axis=1)[:, 0], rcond=None)[0][0])
    true = OFF["m11"] * FERRY.hull.M[0, 0]
    assert naive < 0.8 * true
    # Masses that may be anything are still found.
    spread = clean.hull_spread.copy()
    spread[:5] = 0.5 * np.abs(clean.plain.hull[:5])
    free = replace(clean, hull_spread=spread)
    hull = dict(zip(COEFFICIENTS, fit(free, ()).hull.tolist(), strict=True))
    assert hull["m11"] == pytest.approx(true, rel=0.05)
    assert hull["m22"] == pytest.approx(OFF["m22"] * FERRY.hull.M[1, 1], rel=0.08)
    assert hull["m33"] == pytest.approx(OFF["m33"] * FERRY.hull.M[2, 2], rel=0.08)


@pytest.mark.parametrize("name", ["thruster_lag", "time_delay"])
def test_trap_2_a_controller_that_answers_noise_is_no_lag(clean: EstimationProblem, name: str) -> None:
    made = fit(clean, [candidate(clean, name)])
    assert gain(clean, made) < 0.0
    assert abs(made.values[0][0]) < 0.05


@pytest.mark.slow
def test_trap_3_what_hides_in_a_product_is_found_and_sized(inflow: EstimationProblem) -> None:
    # Every effect among all the others: tests/effects/test_every_effect.py.
    made = fit(inflow, [candidate(inflow, "thrust_inflow_loss")])
    assert made.values[0][0] == pytest.approx(0.3, abs=0.05)
    assert gain(inflow, made) > 5.0 * INFERENCE.prior_odds


def test_trap_4_gains_and_hull_free_at_once_do_not_shrink(clean: EstimationProblem) -> None:
    both = [candidate(clean, "thruster_gain", name) for name in clean.plain.measurements.names]
    made = fit(clean, both)
    np.testing.assert_allclose(np.concatenate(made.values), 1.0, atol=0.06)
    assert gain(clean, made) < 0.0


def test_trap_4_a_mass_that_would_cancel_the_acceleration_explains_nothing(clean: EstimationProblem) -> None:
    one = candidate(clean, "payload")
    assert gain(clean, fit(clean, [one])) < INFERENCE.prior_odds
    # The more mass, the less acceleration does the force model have; what was measured stays.
    left = [float(np.sum(clean.white(one.act(clean.plain, np.array([mass, 0.0]))) ** 2)) for mass in (0.0, 2e3, 2e4)]
    assert left[0] < left[1] < left[2]


def test_trap_5_a_hull_that_is_off_is_refitted_beside_every_candidate(inflow: EstimationProblem) -> None:
    one = candidate(inflow, "thrust_inflow_loss")
    # The trap: regress what an old fit of the hull left on the candidate; the hull has swallowed the effect by then.
    old = fitted_force_model(inflow.plain, fit(inflow, ()))
    left = inflow.white(old)
    slope = (inflow.white(one.act(old, np.array([0.05]))) - left) / 0.05
    assert abs(float(slope @ left) / float(slope @ slope)) < 0.4 * 0.3
    assert fit(inflow, [one]).values[0][0] == pytest.approx(0.3, abs=0.05)


@pytest.mark.slow
def test_trap_6_what_is_certain_but_void_is_no_finding(
    clean: EstimationProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A force of the size of an integrator's error, in a log calm enough to make it significant.
    wind = candidate(clean, "wind")
    little = wind.act(clean.plain, np.array([-0.24, 0.16]))
    calm = replace(clean, plain=replace(clean.plain, external=2.0 * clean.plain.external - little.external))
    result = search(calm, lambda stage: None, known=[wind])
    assert result.rounds[0].ranked[0].gain > INFERENCE.prior_odds
    assert result.fit.candidates == ()
    monkeypatch.setattr(search_module, "INFERENCE", replace(INFERENCE, void_share=0.0))
    assert [one.key for one in search(calm, lambda stage: None, known=[wind]).fit.candidates] == [wind.key]


@pytest.mark.slow
def test_trap_7_a_gain_that_a_reversed_heading_matches_names_nothing(clean: EstimationProblem) -> None:
    # Half a wind on the vessel as it turned, half one on a vessel that turned the other way: either explains as much.
    wind, plain = candidate(clean, "wind"), clean.plain
    measurements = plain.measurements
    turned = replace(plain, measurements=replace(measurements, eta=measurements.eta * [1.0, 1.0, -1.0]))
    blown = [wind.act(one, np.array([-2.0, 1.4])).external - one.external for one in (plain, turned)]
    pushed = replace(clean, plain=replace(plain, external=plain.external + sum(blown)))
    made = fit(pushed, [wind])
    pushed = pushed.with_noise_of(made)
    told = held_out_evidence(pushed, fit(pushed, [wind]))
    assert told is not None
    (proof,) = told.proofs
    assert proof.improvement.score_low > 0.0
    late = [value for name, value in proof.placebos.items() if name != HEADING]
    assert max(late) < 0.1 * proof.improvement.score
    assert proof.placebos[HEADING] > 0.8 * proof.improvement.score
    assert not proof.holds
