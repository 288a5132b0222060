"""Adaptive rounds: what rows in memory teach, on top of what, and which axes stay as they were."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.files import dump_json
from ferryid.identify.acceptance import accept_on_motions, force_mse
from ferryid.identify.adaptive.averaging import model_reference
from ferryid.identify.adaptive.rounds import data_matrix, fit_motions, settings_of_model, update_axes
from ferryid.identify.settings import FitSettings
from ferryid.models.forces.estimator import Estimator, base_estimator, effective_mass, model_estimator
from ferryid.models.forces.residual import base_force
from ferryid.models.model import Model, model_to_json
from ferryid.models.store.versions import load, save
from ferryid.signals.track import Motion
from tests.identify.rounds import PROFILE, motion, with_flow

SCHEMAS = Path(__file__).resolve().parents[2] / "ferryid" / "schemas"
WEAK = FitSettings(components=21, delta=0.4, sigma=0.4)
COUPLED = replace(WEAK, structure="coupled")
UNSEEN = motion(9)


def loaded(mass_kg: float, made: Motion) -> Motion:
    """Return the motion with the force that a mass at the origin takes in addition."""
    (u, v, r), (u_dot, v_dot, _) = made.nu.T, made.nu_dot.T
    more = mass_kg * np.column_stack([u_dot - v * r, v_dot + u * r, 0.0 * r])
    return replace(made, tau=made.tau + more)


def test_recovers_the_hull_that_made_the_motions() -> None:
    model = fit_motions(PROFILE, [motion(1), motion(2), motion(3)], WEAK).model
    mass = effective_mass(PROFILE, model.scale, model.terms, model.theta)
    np.testing.assert_allclose(mass, PROFILE.hull.M, rtol=1e-6, atol=1e-2)
    # All but what the basis does not hold at all: Y_|r|v and the like on other axes.
    left = force_mse(model, UNSEEN) / force_mse(Estimator(PROFILE, WEAK.scale), UNSEEN)
    assert (left < 1e-3).all()


def test_all_components_are_least_squares_of_the_residual() -> None:
    logs = [motion(1, noise=30.0), motion(2, noise=30.0)]
    model = fit_motions(PROFILE, logs, COUPLED).model
    data = data_matrix(PROFILE, logs, COUPLED)
    want_y = np.concatenate([log.tau - base_force(PROFILE, log, WEAK.scale) for log in logs])
    np.testing.assert_array_equal(data.Y, want_y)
    want = np.linalg.lstsq(np.hstack([data.X, np.ones((len(data.X), 1))]), data.Y)[0]
    np.testing.assert_allclose(np.vstack([model.theta, model.intercept]), want, rtol=1e-6, atol=1e-6)


def test_only_the_rows_asked_for_train() -> None:
    log, asked = motion(1, noise=30.0), np.arange(2400) < 1200
    poison = replace(log, tau=np.where(asked[:, None], log.tau, 1e6))
    model = fit_motions(PROFILE, [poison], WEAK, rows=[asked]).model
    np.testing.assert_array_equal(model.theta, fit_motions(PROFILE, [log], WEAK, rows=[asked]).model.theta)
    assert [entry["rows"] for entry in model.training] == [1200]
    assert model.training[0]["seconds"] == pytest.approx(120.0)


def test_scores_are_those_of_the_training_rows_and_say_so() -> None:
    log = motion(1, noise=30.0)
    model = fit_motions(PROFILE, [log], WEAK).model
    error = log.tau - model_estimator(model).of(log)
    np.testing.assert_allclose(model.scores.force.mse_model, np.mean(error**2, axis=0))
    assert model.scores.split == "none"
    assert "flatter" in model.scores.split_notes[0]
    assert not model.accepted


def test_on_top_of_a_model_least_squares_ends_where_it_would_without() -> None:
    first = fit_motions(PROFILE, [motion(1, noise=30.0)], replace(COUPLED, components=4)).model
    logs = [motion(2, noise=30.0), motion(3, noise=30.0)]
    on_top = fit_motions(PROFILE, logs, COUPLED, base=first).model
    without = fit_motions(PROFILE, logs, COUPLED).model
    np.testing.assert_allclose(
        model_estimator(on_top).of(UNSEEN), model_estimator(without).of(UNSEEN), rtol=1e-5, atol=1e-4
    )
    assert on_top.settings["base_model"] == model_reference(first)
    assert {log["name"] for log in on_top.training} == {"round 1", "round 2", "round 3"}
    assert on_top.ranges["u"][1] == max(first.ranges["u"][1], without.ranges["u"][1])


def test_few_components_on_top_of_a_good_model_stay_near_it() -> None:
    good = fit_motions(PROFILE, [motion(1), motion(2), motion(3)], WEAK).model
    few = replace(WEAK, components=1)
    short = [motion(4, seconds=60.0, noise=30.0)]
    on_top, alone = fit_motions(PROFILE, short, few, base=good).model, fit_motions(PROFILE, short, few).model
    assert (force_mse(on_top, UNSEEN) < 0.1 * force_mse(alone, UNSEEN)).all()


def test_a_base_brings_its_own_factors() -> None:
    base = fit_motions(PROFILE, [motion(1)], replace(WEAK, sigma=1.0, zeta=1.1)).model
    on_top = fit_motions(PROFILE, [motion(2)], FitSettings(components=21), base=base).model
    assert on_top.scale == {"delta": 0.4, "sigma": 1.0, "zeta": 1.1}
    np.testing.assert_allclose(base_estimator(on_top).of(UNSEEN), base_estimator(base).of(UNSEEN))


def test_inertia_is_judged_together_with_that_of_the_base() -> None:
    # The base holds the hull's whole inertia: nothing is left for the correction, and that is no reason to distrust it.
    base = fit_motions(PROFILE, [motion(1), motion(2)], WEAK).model
    on_top = fit_motions(PROFILE, [motion(3)], WEAK, base=base).model
    assert on_top.settings["notes"] == []
    still = replace(motion(3), tau=np.zeros((2400, 3)))
    assert any("No actuator" in note for note in fit_motions(PROFILE, [still], WEAK, base=base).model.settings["notes"])


def test_commanded_residual_on_top_of_a_model() -> None:
    base = fit_motions(PROFILE, [motion(1)], COUPLED).model
    log = motion(2, noise=30.0)
    moved = replace(log, tau=log.tau + 500.0, tau_d=log.tau)
    got = fit_motions(PROFILE, [moved], replace(COUPLED, residual="commanded"), base=base).model
    want = fit_motions(PROFILE, [log], COUPLED, base=base).model
    np.testing.assert_allclose(got.theta, want.theta, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(got.intercept, want.intercept, rtol=1e-9, atol=1e-9)


def test_wind_and_current_join_the_basis() -> None:
    logs = [with_flow(motion(seed), seed) for seed in (1, 2)]
    model = fit_motions(PROFILE, logs, WEAK).model
    assert model.settings["basis"] == "modulus+wind-thesis+current-thesis"
    # On top of a model without them the basis is the base's.
    calm = fit_motions(PROFILE, [motion(1)], WEAK).model
    assert fit_motions(PROFILE, logs, WEAK, base=calm).model.terms == calm.terms
    assert fit_motions(PROFILE, logs, WEAK, base=model).model.terms == model.terms


def test_components_by_cross_validation() -> None:
    model = fit_motions(PROFILE, [motion(1, noise=30.0), motion(2, noise=30.0)], replace(WEAK, components="auto")).model
    assert 1 <= model.settings["components"] <= 18
    assert (force_mse(model, UNSEEN) < force_mse(Estimator(PROFILE, WEAK.scale), UNSEEN)).all()


@pytest.mark.slow
def test_draws_give_intervals_that_hold_the_truth() -> None:
    quiet = motion(1, seconds=600.0)
    truth = fit_motions(PROFILE, [quiet], WEAK).model
    rng = np.random.default_rng(0)
    noisy = replace(quiet, tau=quiet.tau + 30.0 * rng.standard_normal(quiet.tau.shape))
    model = fit_motions(PROFILE, [noisy], WEAK, draws=200).model
    used = truth.theta != 0.0
    inside = (model.low <= truth.theta) & (truth.theta <= model.high)
    assert inside[used].mean() > 0.75
    assert np.isnan(truth.low).all()
    assert np.isnan(truth.covariance).all()
    on_top = fit_motions(PROFILE, [noisy], WEAK, base=truth, draws=200).model
    np.testing.assert_allclose(on_top.high, model.high, rtol=1e-4, atol=1e-3)


def crossing() -> Motion:
    """Return half a crossing with load: along the keel, with hardly any sway and yaw."""
    return loaded(500.0, motion(5, seconds=90.0, sizes=(0.8, 1e-3, 1e-3)))


def test_surge_update_finds_the_load_and_locks_sway_and_yaw() -> None:
    before = fit_motions(PROFILE, [motion(1), motion(2), motion(3)], WEAK, draws=50).model
    after = update_axes(before, [crossing()]).model
    row = after.terms.index("u_dot")
    assert after.theta[row, 0] - before.theta[row, 0] == pytest.approx(500.0, rel=1e-3)
    np.testing.assert_array_equal(model_estimator(after).of(UNSEEN)[:, 1:], model_estimator(before).of(UNSEEN)[:, 1:])
    np.testing.assert_array_equal(after.covariance[1:], before.covariance[1:])
    np.testing.assert_array_equal(after.low[:, 1:], before.low[:, 1:])
    other = [k for k, term in enumerate(after.terms) if term not in ("u_dot", "u", "u^3", "|u|u")]
    np.testing.assert_array_equal(after.theta[other], before.theta[other])
    assert after.settings["updated"] == ["surge", "u_dot", "u", "u^3", "|u|u"]
    assert after.settings["base_model"] == model_reference(before)


def test_surge_update_does_not_mind_that_nothing_acts_on_locked_axes() -> None:
    before = fit_motions(PROFILE, [motion(1)], WEAK).model
    log = crossing()
    alone = replace(log, tau=log.tau * np.array([1.0, 0.0, 0.0]))
    after = update_axes(before, [alone]).model
    assert after.settings["notes"] == []
    still = update_axes(before, [replace(log, tau=0.0 * log.tau)]).model
    assert len(still.settings["notes"]) == 1
    row = after.terms.index("u_dot")
    assert still.theta[row, 0] == before.theta[row, 0]
    assert after.theta[row, 0] == pytest.approx(before.theta[row, 0] + 500.0, rel=1e-3)
    # Nor that the earlier model's inertia there cannot be.
    light = before.theta.copy()
    light[before.terms.index("v_dot"), 1] -= 5000.0
    assert update_axes(replace(before, theta=light), [log]).model.settings["notes"] == []


def test_surge_update_beats_a_whole_fit_of_a_crossing_elsewhere() -> None:
    before = fit_motions(PROFILE, [motion(1), motion(2), motion(3)], COUPLED).model
    log = replace(crossing(), tau=crossing().tau + 20.0 * np.random.default_rng(1).standard_normal((900, 3)))
    whole = fit_motions(PROFILE, [log], COUPLED).model
    elsewhere = loaded(500.0, UNSEEN)
    assert (force_mse(update_axes(before, [log]).model, elsewhere) < 0.1 * force_mse(whole, elsewhere)).all()


@pytest.mark.slow
def test_update_of_given_terms_and_axes() -> None:
    before = fit_motions(PROFILE, [motion(1, noise=30.0)], COUPLED, draws=50).model
    after = update_axes(before, [motion(2, noise=30.0)], axes=("yaw", "sway"), terms=("v", "r"), draws=50).model
    changed = after.theta != before.theta
    rows = [after.terms.index("v"), after.terms.index("r")]
    want = np.zeros_like(changed)
    want[rows, 1:] = True
    np.testing.assert_array_equal(changed, want)
    assert after.intercept[0] == before.intercept[0]
    assert (after.intercept[1:] != before.intercept[1:]).all()
    assert after.settings["updated"] == ["sway", "yaw", "v", "r"]
    # Fitted coefficients have their own spread, and none in common with the ones that were kept.
    again = [*rows, len(after.terms)]
    kept = sorted(set(range(len(after.terms))) - set(rows))
    np.testing.assert_array_equal(after.covariance[1][np.ix_(kept, again)], 0.0)
    np.testing.assert_array_equal(after.covariance[1][np.ix_(kept, kept)], before.covariance[1][np.ix_(kept, kept)])
    np.testing.assert_array_equal(after.covariance[1][np.ix_(again, kept)], 0.0)
    half = (after.high - after.low)[rows[0], 1] / 2.0
    assert half == pytest.approx(1.96 * after.covariance[1, rows[0], rows[0]] ** 0.5, rel=0.5)
    assert after.low[rows[0], 1] < after.theta[rows[0], 1] < after.high[rows[0], 1]


@pytest.mark.slow
def test_models_are_stored_and_read_like_any_other(tmp_path: Path) -> None:
    first = fit_motions(PROFILE, [motion(1)], WEAK, name="first").model
    for model in (first, update_axes(first, [crossing()], name="updated").model):
        plain = json.loads(dump_json(model_to_json(model)))
        jsonschema.validate(plain, json.loads((SCHEMAS / "model.json").read_text()))
        save(model, tmp_path)
        back = load(f"{model.name}@1", tmp_path)
        np.testing.assert_array_equal(back.theta, model.theta)
        np.testing.assert_array_equal(back.covariance, model.covariance)
        assert settings_of_model(back).components == model.settings["components"]


def test_force_mse_by_hand() -> None:
    log = motion(1)
    shifted = replace(log, tau=log.tau + np.array([3.0, -4.0, 0.5]))
    true = Estimator(PROFILE, {})
    np.testing.assert_allclose(force_mse(true, shifted), [9.0, 16.0, 0.25], rtol=1e-9)
    holed = replace(shifted, tau=np.where(log.t[:, None] < 50.0, np.nan, shifted.tau))
    np.testing.assert_allclose(force_mse(true, [holed, shifted]), [9.0, 16.0, 0.25], rtol=1e-9)
    # 2400 rows with one error and 600 without: a fifth less.
    np.testing.assert_allclose(
        force_mse(true, [shifted, log], [log.valid, log.t < 60.0]), np.array([9.0, 16.0, 0.25]) * 0.8, rtol=1e-9
    )
    assert np.isnan(force_mse(true, log, [np.zeros(2400, dtype=bool)])).all()


def test_judge_is_the_updating_criterion() -> None:
    log = motion(1)
    shifted = replace(log, tau=log.tau + np.array([3.0, 4.0, 0.5]))
    true, weak = Estimator(PROFILE, {}), Estimator(PROFILE, WEAK.scale)
    assert accept_on_motions(weak, true, shifted).accepted
    assert not accept_on_motions(true, weak, shifted).accepted
    assert not accept_on_motions(true, true, shifted).accepted
    model = fit_motions(PROFILE, [log], WEAK).model
    assert accept_on_motions(weak, model, [UNSEEN]).per_axis["surge"] < 0.01


def refusals() -> list[tuple[str, object]]:
    log = motion(1)
    model = fit_motions(PROFILE, [log], WEAK).model
    other = replace(model, profile_text=PROFILE.text.replace('"milliampere"', '"ferry"', 1))
    spoilt = replace(model, terms=model.terms[:-1], theta=model.theta[:-1])
    return [
        ("no motions", lambda: fit_motions(PROFILE, [], WEAK)),
        ("one mask", lambda: fit_motions(PROFILE, [log], WEAK, rows=[log.valid[:-1]])),
        ("none of the rows", lambda: fit_motions(PROFILE, [log], WEAK, rows=[~log.valid])),
        (
            "must be that of the fit",
            lambda: fit_motions(PROFILE, [log], replace(WEAK, basis="thesis"), base=model),
        ),
        ("parallel", lambda: fit_motions(PROFILE, [log], replace(WEAK, residual="parallel"), base=model)),
        ("of the vessel ferry", lambda: fit_motions(PROFILE, [log], WEAK, base=other)),
        ("its terms are not those", lambda: fit_motions(PROFILE, [log], WEAK, base=spoilt)),
        ('Did you mean "surge"', lambda: update_axes(model, [log], axes=("surg",))),
        ("no axis was given", lambda: update_axes(model, [log], axes=())),
        ('has no term "uu"', lambda: update_axes(model, [log], terms=("uu",))),
        ("--name", lambda: fit_motions(PROFILE, [log], WEAK, name="../x")),
    ]


@pytest.mark.parametrize(("says", "call"), refusals(), ids=lambda value: value if isinstance(value, str) else "")
def test_what_cannot_be_used_is_refused_in_one_line(says: str, call) -> None:
    with pytest.raises(FerryIdError) as caught:
        call()
    assert says in str(caught.value)
    assert "Fix:" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_caller_keeps_motions_and_models_as_they_were() -> None:
    log = motion(1, noise=30.0)
    before = {key: value.copy() for key, value in vars(log).items() if isinstance(value, np.ndarray)}
    model: Model = fit_motions(PROFILE, [log], WEAK).model
    theta = model.theta.copy()
    update_axes(model, [log])
    fit_motions(PROFILE, [log], WEAK, base=model)
    np.testing.assert_array_equal(model.theta, theta)
    for key, value in before.items():
        np.testing.assert_array_equal(getattr(log, key), value)
