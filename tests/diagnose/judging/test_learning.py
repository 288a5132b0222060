"""What is learned beside named effects: accepted only where it helps, stored with them, and no worse than a fit alone."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ferryid.compare.evaluation import evaluate
from ferryid.diagnose.judging import learning
from ferryid.diagnose.judging.diagnosis import Diagnosis, to_json
from ferryid.diagnose.judging.learning import Learned, Learner, without_withheld
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS, UNITS, hull_of
from ferryid.errors import ReversedForcesError
from ferryid.export.model_file import export_model
from ferryid.identify import Acceptance, FitSettings, accept, fit_logs, prediction_errors, read_logs, with_remainder
from ferryid.identify.outcome import EstimatorScore
from ferryid.models import Conditions, ForceScores, Model, ModelScores, Quantity, Source, StoredEffect, blank_model
from ferryid.models.forces import beside_the_hull
from ferryid.models.prediction import predict, predict_with_effects
from ferryid.models.store import load_file, save
from ferryid.regression.bases import make_basis
from ferryid.signals.complementary_filter import complementary_filter
from ferryid.signals.prepare import prepare
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.simulate.vessel_model import sailed_by
from ferryid.types import AXES, RunContext
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
DAMPED = {"X_u": 2.5, "X_|u|u": 1.8, "Y_v": 2.0, "Y_|v|v": 1.5, "N_r": 2.5, "N_|r|r": 1.5}
"""Factors on the true hull's damping."""
QUICK = FitSettings(draws=30)
TWELVE = 'path = { kind = "twelve-corner" }\ncontroller = { delta = 0.7, sigma = 0.7 }\n'
BRISK = """
path = { kind = "points", dwell_s = 40, rounds = 2, points = [[0, 0, 0], [25, 5, 45], [20, 25, 180], [0, 30, 300],
  [-15, 10, 90], [10, 0, 200], [-5, -20, 20], [5, 20, 270]] }
[controller.reference]
omega_radps = [0.4, 0.4, 0.4]
speed_limit = [1.4, 1.0, 0.25]
acceleration_limit = [0.2, 0.2, 0.06]
"""
WINDY = "[environment.wind]\nnorth_mps = -3.0\neast_mps = 2.0\n"


def sailed(folder: Path, name: str, text: str, seed: int, hull: dict[str, float] | None = None) -> str:
    """Simulate a trial without the bulk, and return the path of its log."""
    head = (
        'schema = "ferryid.scenario/1"\nvessel = "milliampere"\nsensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }\n'
    )
    scenario = replace(parse_scenario(head + text, name), true_hull=hull or {})
    log = folder / f"{name}.mcap"
    write_log(simulate(scenario, seed), log)
    return str(log)


def hull_of_ferry() -> dict[str, Quantity]:
    return {
        name: Quantity(value, value, value, unit)
        for name, value, unit in zip(COEFFICIENTS, hull_of(FERRY).tolist(), UNITS, strict=True)
    }


def named(sha256: str, **values: float) -> StoredEffect:
    """Return a wind as a diagnosis stores it."""
    parameters = {
        one.name: Quantity(values[one.name], values[one.name], values[one.name], one.unit)
        for one in effects()["wind"].parameters_of(FERRY)
        if one.name in values
    }
    return StoredEffect("wind", None, parameters, (Source("windy", sha256, 0.99),))


def learned_on(log: str, folder: Path, model: Model | None, name: str = "ferry") -> tuple[Model | None, Diagnosis]:
    """Return what is stored, read back, and a diagnosis that tells of it."""
    run = RunContext(folder)
    stored, learned = Learner((log,), FERRY, None, run, QUICK).learn(model, name)
    told = Diagnosis(Path(log).stem, "milliampere", "matched", (), {}, {}, learned=learned)
    return (None if stored is None else load_file(save(stored, folder).path)), told


def errors_on(log: str, folder: Path, *models: Model) -> list[float]:
    """Return root-mean-square prediction errors on a whole log, over the first model's, mean of the axes."""
    motion = prepare(log, FERRY, folder, window_s=1.0).motion
    opened = read_logs([log], FERRY, QUICK, RunContext(folder))
    every = prediction_errors(models, opened, FERRY, QUICK, [motion.valid])
    return [float(np.mean(np.sqrt(one / every[0]))) for one in every]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("learned")


@pytest.fixture(scope="module")
def windy(folder: Path) -> tuple[str, Model]:
    """Return a log in wind of a hull with more damping, and a model in which the wind alone is named."""
    log = sailed(folder, "windy", TWELVE + WINDY, 11, DAMPED)
    sha256 = prepare_sha256(log, folder)
    blank = replace(blank_model(FERRY, "ferry"), hull=hull_of_ferry())
    return log, replace(blank, conditions=(Conditions("windy", sha256, (named(sha256, north=-3.0, east=2.0),)),))


@pytest.fixture(scope="module")
def taught(windy: tuple[str, Model], folder: Path) -> tuple[Model, Diagnosis]:
    """Return what is learned from the log in wind beside the named wind."""
    stored, told = learned_on(windy[0], folder, windy[1])
    assert stored is not None
    return stored, told


@pytest.fixture(scope="module")
def another(folder: Path) -> str:
    """Return a log of the same vessel in still air, on another path at twice the speed."""
    return sailed(folder, "another", BRISK, 111, DAMPED)


def prepare_sha256(log: str, folder: Path) -> str:
    return prepare(log, FERRY, folder, window_s=1.0).recording.sha256


def test_what_is_learned_beside_a_named_wind_serves_another_log_as_well_as_a_fit(another: str, folder: Path) -> None:
    # At twice the speed either is wrong by what one log happens to determine: several logs say which is better.
    ratios = []
    for seed in range(11, 17):
        log = sailed(folder, f"windy {seed}", TWELVE + WINDY, seed, DAMPED)
        wind = named(sha256 := prepare_sha256(log, folder), north=-3.0, east=2.0)
        blank = replace(blank_model(FERRY, "ferry"), hull=hull_of_ferry())
        known = replace(blank, conditions=(Conditions(f"windy {seed}", sha256, (wind,)),))
        ours, told = learned_on(log, folder, known)
        assert ours is not None
        if told.learned is not None and told.learned.accepted:
            theirs = fit_logs([log], FERRY, QUICK, RunContext(folder)).model
            ratios.append(errors_on(another, folder, theirs, ours)[1])
    assert len(ratios) >= 4
    assert float(np.exp(np.mean(np.log(ratios)))) <= 1.02


@pytest.mark.parametrize("steadied", [False, True])
def test_the_load_of_a_named_wind_goes_with_the_velocity(
    windy: tuple[str, Model], folder: Path, steadied: bool
) -> None:
    log, diagnosed = windy
    prepared = prepare(log, FERRY, folder, window_s=1.0, keep_track=True)
    motion, wind = prepared.motion, np.tile([-3.0, 2.0], (len(prepared.motion.t), 1))
    nu = complementary_filter(motion.nu, motion.nu, motion.eta, motion.rate_hz) if steadied else motion.nu
    found = predict_with_effects(diagnosed, prepared, FERRY, window_s=1.0, smoother="square", steadied=steadied)
    assert FERRY.wind is not None
    blown, still = (wind_force(FERRY.wind, air, motion.eta[:, 2], nu)[motion.valid] for air in (wind, 0.0 * wind))
    np.testing.assert_array_equal(found.motion.nu[motion.valid], nu[motion.valid])
    np.testing.assert_allclose((found.motion.tau - motion.tau)[motion.valid], blown - still, atol=1e-6)


def test_wind_is_named_and_damping_is_learned(
    windy: tuple[str, Model], taught: tuple[Model, Diagnosis], another: str, folder: Path
) -> None:
    log, diagnosed = windy
    stored, told = taught
    assert told.learned is not None
    assert told.learned.accepted, told.learned.says
    assert stored.accepted
    assert (
        "is part of the model; held-out squared prediction error against the model without it: surge -"
        in told.learned.says
    )
    assert stored.conditions == diagnosed.conditions
    # The hull in the file is the whole hull: what was learned is counted in.
    assert stored.terms
    factor = {name: stored.hull[name].value / diagnosed.hull[name].value for name in ("X_u", "N_r")}
    assert min(factor.values()) > 1.3
    plain = to_json(told)["learned"]
    assert set(plain["over_fit"]) == set(plain["per_axis"]) == set(AXES)
    assert np.mean(list(plain["over_fit"].values())) <= 1.02

    base, alone, ours = errors_on(another, folder, blank_model(FERRY, "base"), diagnosed, stored)
    assert ours < 0.8 * base
    assert ours < 0.8 * alone
    # The commands see the same model.
    entry = evaluate(stored, [log], RunContext(folder))["logs"][0]
    assert [one["effect"] for one in entry["effects"]["conditions"]] == ["wind"]
    assert max(entry["per_axis"].values()) < 0.9
    # What it is compared with has learned nothing.
    base = evaluate(diagnosed, [log], RunContext(folder))["logs"][0]["mse"]["base"]
    assert entry["mse"]["base"] == pytest.approx(base)


def test_what_was_learned_is_exported_and_simulated(taught: tuple[Model, Diagnosis], folder: Path) -> None:
    stored, _ = taught
    made = export_model(stored.label, "python", folder)
    run = subprocess.run([sys.executable, made["file"]], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert beside_the_hull(stored).functions
    sailing = sailed_by(parse_scenario(SHORT, "t"), stored, "windy")
    truth = simulate(sailing.scenario, 3, vessel=sailing.vessel, terms=sailing.terms).truth
    assert np.isfinite(truth.nu).all()
    assert sailing.scenario.wind.north_mps == -3.0


SHORT = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
duration_s = 40
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
path = { kind = "four-corner", dwell_s = 15 }
"""


def test_a_hull_that_is_right_learns_nothing(folder: Path) -> None:
    log = sailed(folder, "right", TWELVE, 3)
    model = replace(blank_model(FERRY, "right"), hull=hull_of_ferry())
    stored, learned = Learner((log,), FERRY, None, RunContext(folder), QUICK).learn(model, "right")
    assert stored is not None
    assert stored.terms == ()
    assert stored.hull == model.hull
    # Nobody had judged it: it gets the figures of the held-out windows, which are those of the profile's hull.
    assert stored.scores is not None
    assert stored.scores.force.normalised_mse == pytest.approx(1.0, abs=0.05)
    judged = replace(model, scores=stored.scores)
    assert Learner((log,), FERRY, None, RunContext(folder), QUICK).learn(judged, "right")[0] is judged
    assert not learned.accepted
    assert "A correction learned on top of the findings was not accepted" in learned.says
    assert learned.reasons[0].startswith("Rejected: ")


def test_where_nothing_is_named_the_model_is_the_fits(windy: tuple[str, Model], folder: Path) -> None:
    log = sailed(folder, "calm", TWELVE, 4, DAMPED)
    stored, told = learned_on(log, folder, None, "calm")
    fitted = fit_logs([log], FERRY, QUICK, RunContext(folder), name="calm")
    assert fitted.acceptance.accepted
    assert stored is not None
    np.testing.assert_array_equal(stored.theta, fitted.model.theta)
    np.testing.assert_array_equal(stored.intercept, fitted.model.intercept)
    assert told.learned is not None
    assert told.learned.says.startswith(
        "No named effect enters the model. A correction of the hull is part of the model;"
    )


def hinted(log: str, folder: Path, north: float, east: float) -> Model:
    """Return a model with a wind in a log that is but a hint."""
    wind = named(prepare_sha256(log, folder), north=north, east=east)
    wind = replace(wind, sources=tuple(replace(one, probability=0.4) for one in wind.sources))
    blank = replace(blank_model(FERRY, "ferry"), hull=hull_of_ferry())
    return replace(blank, conditions=(Conditions(Path(log).stem, wind.sources[0].sha256, (wind,)),))


def test_a_hint_that_predicts_is_part_of_the_model(windy: tuple[str, Model], folder: Path) -> None:
    wider = hinted(windy[0], folder, -3.0, 2.0)
    stored, learned = Learner((windy[0],), FERRY, None, RunContext(folder), QUICK).learn(None, "ferry", wider)
    assert learned.with_hints
    assert learned.accepted
    assert learned.says.startswith(
        "Steady wind is a hint and part of the model all the same, which predicts better so;"
    )
    assert stored is not None
    (conditions,) = stored.conditions
    assert [one.effect for one in conditions.effects] == ["wind"]
    assert conditions.effects[0].says().endswith(" It is a hint.")
    assert not windy[1].conditions[0].effects[0].says().endswith("a hint.")
    # Of a fit alone, which knows no wind's mean for all rows, the error is larger.
    assert learned.over_fit is not None
    assert float(np.mean(list(learned.over_fit.values()))) < 1.0


def test_without_an_effect_that_is_a_hint_there_is_no_model_with_hints(
    windy: tuple[str, Model], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Coefficients of the hull that are a hint are no effect that a model lists."""
    wider = replace(hinted(windy[0], folder, -3.0, 2.0), conditions=())
    learner = Learner((windy[0],), FERRY, None, RunContext(folder), QUICK)
    plain = Learned(True, "Nothing.")
    monkeypatch.setattr(Learner, "_fitted", lambda *_: (None, plain))
    assert learner.learn(None, "ferry", wider) == (None, plain)


def test_a_hint_that_does_not_predict_stays_out(windy: tuple[str, Model], folder: Path) -> None:
    wider = hinted(windy[0], folder, 3.0, -2.0)
    learner = Learner((windy[0],), FERRY, None, RunContext(folder), QUICK)
    without, plain = learner.learn(None, "ferry")
    stored, learned = learner.learn(None, "ferry", wider)
    assert (learned, learned.with_hints) == (plain, False)
    assert stored is not None
    assert without is not None
    assert stored.conditions == ()
    np.testing.assert_array_equal(stored.theta, without.theta)


def test_a_log_that_cannot_be_fitted_leaves_the_model_as_it_is(folder: Path) -> None:
    model = replace(blank_model(FERRY, "ferry"), hull=hull_of_ferry())
    short = sailed(folder, "short", f"duration_s = 15\n{TWELVE}", 5)
    stored, learned = Learner((short,), FERRY, None, RunContext(folder), QUICK).learn(model, "ferry")
    assert stored is model
    assert learned.says.startswith("Nothing was learned beside the findings: ")


def test_a_log_that_cannot_be_fitted_leaves_the_others_to_learn_from(windy: tuple[str, Model], folder: Path) -> None:
    short = sailed(folder, "seconds", f"duration_s = 1\n{TWELVE}", 5)
    stored, learned = Learner((windy[0], short), FERRY, None, RunContext(folder), QUICK).learn(None, "ferry")
    alone, plain = Learner((windy[0],), FERRY, None, RunContext(folder), QUICK).learn(None, "ferry")
    assert stored is not None
    assert alone is not None
    np.testing.assert_array_equal(stored.theta, alone.theta)
    assert learned.ratio == plain.ratio
    assert learned.says == f"{plain.says.removesuffix('.')}. 1 log that a fit cannot use is no part of that."


def test_forces_that_are_reversed_beside_the_findings_alone_end_nothing(
    windy: tuple[str, Model], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, model = windy

    def reversed_forces(*given: object) -> None:
        raise ReversedForcesError("log: the sway force accelerates the vessel the wrong way. Fix: change the frame")

    monkeypatch.setattr(learning, "fit_remainder", reversed_forces)
    stored, learned = Learner((log,), FERRY, None, RunContext(folder), QUICK).learn(model, "ferry")
    assert stored is model
    assert learned.says == (
        "Nothing was learned beside the findings: with the findings, log: the sway force accelerates the vessel the wrong way."
    )
    # Where the log shows it by itself, the profile is wrong.
    monkeypatch.setattr(learning, "fit_opened", reversed_forces)
    with pytest.raises(ReversedForcesError, match="the wrong way"):
        Learner((log,), FERRY, None, RunContext(folder), QUICK).learn(model, "ferry")


def test_what_is_stored_predicts_what_was_fitted(windy: tuple[str, Model], folder: Path) -> None:
    """Properties of the vessel act on the hull alone, and not on what was learned with them in place."""
    log, diagnosed = windy
    fouling = {"surge": 1.8, "sway": 1.3, "yaw": 1.3}
    fouled = StoredEffect(
        "fouling",
        None,
        {name: Quantity(one, one, one, "-") for name, one in fouling.items()},
        (Source("windy", "ab", 0.9),),
    )
    before = replace(diagnosed, vessel_effects=(fouled,))
    prepared = prepare(log, FERRY, folder, window_s=1.0, keep_track=True)
    correction = random_correction()
    after = with_remainder(before, correction)
    empty = with_remainder(before, replace(correction, theta=0.0 * correction.theta, intercept=np.zeros(3)))
    seen = [predict(one, prepared, FERRY, window_s=1.0, smoother="square") for one in (empty, after)]
    functions = make_basis("modulus", structure="decoupled")
    more = functions.of(prepared.motion) @ correction.theta + correction.intercept
    rows = prepared.motion.valid
    np.testing.assert_allclose((seen[1].tau - seen[0].tau)[rows], more[rows], atol=1e-6)
    # A correction of the correction adds up.
    twice = with_remainder(after, correction)
    told = predict(twice, prepared, FERRY, window_s=1.0, smoother="square").tau
    np.testing.assert_allclose((told - seen[1].tau)[rows], more[rows], atol=1e-6)


def random_correction() -> Model:
    functions = make_basis("modulus", structure="decoupled")
    K, rng = len(functions.terms), np.random.default_rng(2)
    theta = np.where(functions.mask, 10.0 * rng.standard_normal((K, 3)), 0.0)
    return replace(
        blank_model(FERRY, "ferry"),
        settings={"basis": "modulus", "structure": "decoupled", "components": 3, "window_s": 1.0, "smoother": "square"},
        terms=functions.terms,
        units=functions.units,
        theta=theta,
        intercept=np.array([4.0, -2.0, 1.0]),
        low=theta - 1.0,
        high=theta + 1.0,
        covariance=np.tile(np.eye(K + 1), (3, 1, 1)),
    )


def test_withheld_signals_are_not_learned_from() -> None:
    mapped, hidden = ({one.quantity for one in without_withheld(FERRY, names).signals} for names in ((), ("wind",)))
    assert mapped - hidden == {"wind"}


@pytest.mark.parametrize(
    ("folds", "first", "second", "fitted", "examined", "kept", "told"),
    [
        # Better on top than without, and than the fit.
        (0.8, 60.0, 50.0, 70.0, False, "first", "on top of the findings is part of the model"),
        # The fit is better, and so is the correction on the hull as it was.
        (0.8, 80.0, 50.0, 50.0, False, "second", "on the hull as it was before the diagnosis is part of the model"),
        # The fit is better than either, and takes their place.
        (
            0.8,
            80.0,
            90.0,
            40.0,
            False,
            "fit",
            "The model of ferryid fit, which knows no findings, .* 2.00 times as large",
        ),
        # It is told of, where a model was examined that knows other logs.
        (
            0.8,
            80.0,
            90.0,
            40.0,
            True,
            "first",
            "The model of ferryid fit predicts these logs better: .* 2.00 times as large",
        ),
        # It is better by less than what a model is accepted for: told.
        (
            0.8,
            80.0,
            90.0,
            77.0,
            False,
            "first",
            "The model of ferryid fit predicts these logs better: .* 1.04 times as large",
        ),
        # What folds speak against is not stored, whatever the held-out rows say.
        (1.1, 60.0, 50.0, 99.0, False, "none", "on folds of the training rows .* 1.10 times as large"),
    ],
)
def test_which_correction_is_stored(
    monkeypatch: pytest.MonkeyPatch,
    folds: float,
    first: float,
    second: float,
    fitted: float,
    examined: bool,
    kept: str,
    told: str,
) -> None:
    """Held-out errors are 100 without a correction, `first` with it, `second` with that on the hull as it was."""
    diagnosed = replace(blank_model(FERRY, "ferry"), hull=hull_of_ferry())
    rows = (np.ones(3, dtype=bool),)
    good = accept(np.full(3, 100.0), np.full(3, 50.0), "prediction")
    scores = ModelScores(ForceScores.of(np.ones(3), np.ones(3), np.ones(3)), 9, 9.0, "blocks", ())
    errors = {"none": 100.0, "first": first, "second": second, "fit": fitted}
    models = {name: replace(diagnosed, settings={**diagnosed.settings, "test": name}, scores=scores) for name in errors}

    def fit(_: Learner) -> SimpleNamespace:
        stored = replace(models["fit"], accepted=True)
        return SimpleNamespace(
            outcome=SimpleNamespace(acceptance=good, judged=models["fit"], model=stored), validation=rows
        )

    def remainder(_: Learner, base: Model) -> SimpleNamespace:
        estimators = (EstimatorScore("weak", folds, 0.5, True),)
        # Of other rows than those on which the models are compared.
        own = accept(np.full(3, 100.0), np.full(3, 33.0), "prediction")
        outcome = Outcome(own, estimators, models["first"])
        fitted = SimpleNamespace(outcome=outcome, validation=rows)
        model = models["first" if base.hull else "second"]
        return SimpleNamespace(model=model, judged=model, outcome=outcome, fitted=fitted)

    def measured(_: Learner, several: Sequence[Model], __: object) -> list[np.ndarray]:
        return [np.full(3, errors[str(one.settings.get("test", "none"))]) for one in several]

    monkeypatch.setattr(Learner, "_opened", property(lambda _: []))
    monkeypatch.setattr(Learner, "_plain", property(fit))
    monkeypatch.setattr(Learner, "_remainder", remainder)
    monkeypatch.setattr(Learner, "_errors", measured)
    start = blank_model(FERRY, "ferry") if examined else None
    stored, learned = Learner(("log",), FERRY, start, RunContext(Path("nowhere"))).learn(diagnosed, "ferry")
    assert stored is not None
    assert stored.settings.get("test", "none") == kept
    assert learned.accepted == stored.accepted == (kept != "none")
    assert re.search(told, learned.says), learned.says
    assert learned.fit_alone == (kept == "fit")
    assert learned.over_fit == dict.fromkeys(AXES, pytest.approx(errors[kept] / fitted))
    # One set of figures: those of the rows on which the models were compared, not of the fit's own.
    assert sum("On held-out data" in one for one in learned.reasons) == 1
    assert not any("-67.0 %" in one for one in learned.reasons)


@dataclass(frozen=True)
class Outcome:
    """What is read of the outcome of a fit."""

    acceptance: Acceptance
    estimators: tuple[EstimatorScore, ...]
    model: Model
