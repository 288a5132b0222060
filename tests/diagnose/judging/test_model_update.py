"""From a diagnosis to a model: what carries over to another log, what does not, and what is left in a log of that vessel."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid.compare.candidates import select_candidates
from ferryid.compare.comparison import compare
from ferryid.compare.evaluation import evaluate
from ferryid.diagnose.data.measurements import Survey, read_measurements, window_lengths
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, estimation_problem, fit
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.stochastic_disturbance import DisturbanceState
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.least_sizes import LeastSize
from ferryid.diagnose.judging.model_update import store_updated_model, update_model
from ferryid.diagnose.judging.posterior import Posterior, posterior_of
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
from ferryid.effects import effects
from ferryid.effects.force_model import acceleration
from ferryid.models import Quantity, Source, StoredEffect
from ferryid.models.model import Model
from ferryid.models.store.versions import load_file
from ferryid.report.comparison_words import render_effects
from ferryid.report.evaluation_text import render_evaluation
from ferryid.simulate import load_scenario, parse_scenario, simulate, write_log
from ferryid.simulate.vessel_model import sailed_by
from ferryid.types import AXES, IN_MEMORY, RunContext
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
FOULED = "[fouling]\nsurge = 1.8\nsway = 1.3\nyaw = 1.3\n"
WINDY = "[environment.wind]\nnorth_mps = -3.0\neast_mps = 2.0\n"
BROKEN = '[[thrusters.faults]]\nthruster = "thruster2"\nfactor = 0.6\n'
MSE = {"surge": 100.0, "sway": 100.0, "yaw": 100.0}


TWELVE = 'path = { kind = "twelve-corner" }\ncontroller = { delta = 0.7, sigma = 0.7 }\n'
BRISK = """
path = { kind = "points", dwell_s = 40, rounds = 2, points = [[0, 0, 0], [25, 5, 45], [20, 25, 180], [0, 30, 300],
  [-15, 10, 90], [10, 0, 200], [-5, -20, 20], [5, 20, 270]] }
[controller.reference]
omega_radps = [0.4, 0.4, 0.4]
speed_limit = [1.4, 1.0, 0.25]
acceleration_limit = [0.2, 0.2, 0.06]
"""
"""Another path, at twice the speed."""


def sailed(folder: Path, name: str, path: str, seed: int, more: str) -> str:
    """Simulate a trial without the bulk, and return the path of its log."""
    text = (
        'schema = "ferryid.scenario/1"\nvessel = "milliampere"\n'
        f"sensors = {{ imu_rate_hz = 0.0, camera_rate_hz = 0.0 }}\n{path}{more}"
    )
    log = folder / f"{name}.mcap"
    write_log(simulate(parse_scenario(text, name), seed), log)
    return str(log)


def trial_on(log: str, model: Model | None = None) -> tuple[EstimationProblem, Survey]:
    measurements, survey = read_measurements(log, FERRY)
    seen = windows(measurements, *window_lengths(FERRY))
    plain, spread = prior_force_model(seen.measurements, FERRY, model, survey.recording.sha256)
    return estimation_problem(seen, plain, spread), survey


def finding(candidate: Candidate, probability: float) -> Finding:
    return Finding(
        effect=candidate.effect.id,
        instance=candidate.instance,
        probability=probability,
        parameters={},
        axes={},
        intervals=(),
        improvement=dict.fromkeys(AXES, 0.5),
        held_out=True,
        says="",
    )


def taught(
    log: str,
    *names: str,
    onset_s: float = 0.0,
    told_s: float | None = None,
    offset_s: float = inf,
    doubtful: str = "",
) -> tuple[Posterior, EstimationProblem]:
    """Fit effects to a log whose presence is known, so that nothing here depends on a search."""
    problem, survey = trial_on(log)
    candidates = [
        Candidate(
            effects()[name], effects()[name].instances(FERRY)[-1], effects()[name].parameters_of(FERRY),
            onset_s if effects()[name].onset else 0.0, offset_s if effects()[name].onset else inf,
        )
        for name in names
    ]  # fmt: skip
    kept = fit(problem, candidates)
    problem = problem.with_noise_of(kept)
    kept = fit(problem, candidates, kept.values)
    findings = [replace(finding(one, 0.3 if one.effect.id == doubtful else 0.99), onset_s=told_s) for one in candidates]
    found = posterior_of(problem, kept, (), findings, survey)
    assert found is not None
    return found, problem


def told(*several: Posterior) -> list[Diagnosis]:
    after = {"mse": dict.fromkeys(AXES, 50.0)}
    return [
        Diagnosis(
            str(one.training["name"]), "milliampere", "explained", (), {"mse": MSE, "rows": 10}, after, posterior=one
        )
        for one in several
    ]


def judged(model: Model, log: str, out: Path) -> dict[str, Any]:
    return evaluate(model, [log], RunContext(out))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("remodel")


@pytest.fixture(scope="module")
def fouled(folder: Path) -> str:
    return sailed(folder, "fouled", TWELVE, 3, FOULED + WINDY)


@pytest.fixture(scope="module")
def model(fouled: str, folder: Path) -> Model:
    """The model that a log of a fouled ferry in a wind leads to."""
    found, _ = taught(fouled, "fouling", "wind")
    done = store_updated_model(told(found), FERRY, None, folder / "out")
    assert done[0].model is not None
    assert done[0].model_accepted
    return load_file(Path(done[0].model))


def test_the_file_keeps_the_vessel_and_the_log_apart(model: Model) -> None:
    assert (model.label, model.accepted, model.terms) == ("milliampere@1", True, ())
    growth = model.vessel_effects[0]
    assert [one.effect for one in model.vessel_effects] == ["fouling"]
    assert growth.parameters["surge"].value == pytest.approx(1.8, rel=0.1)
    assert growth.parameters["surge"].low < 1.8 < growth.parameters["surge"].high
    (known,) = model.conditions
    assert (known.log, [one.effect for one in known.effects]) == ("fouled", ["wind"])
    assert known.sha256 == model.training[0]["sha256"] == growth.sources[0].sha256
    assert known.effects[0].values["north"] == pytest.approx(-3.0, abs=0.3)
    assert model.hull["m11"].low < FERRY.hull.M[0, 0] < model.hull["m11"].high


def test_a_property_found_in_one_log_holds_in_another(model: Model, folder: Path) -> None:
    second = sailed(folder, "second", BRISK, 8, FOULED + WINDY.replace("-3.0", "1.0").replace("2.0", "1.5"))
    entry = judged(model, second, folder / "out")["logs"][0]
    assert [one["effect"] for one in entry["effects"]["vessel"]] == ["fouling"]
    assert entry["effects"]["conditions"] == []
    assert "Steady wind of fouled does not act here" in entry["effects"]["left_out"][0]
    assert max(entry["per_axis"]["surge"], entry["per_axis"]["sway"]) < 0.4
    assert entry["per_axis"]["yaw"] < 0.75
    runs = entry["free_run"]
    for key in ("position_m", "speed_mps"):
        assert np.all(np.array(runs["model"][key])[:4] < 0.75 * np.array(runs["base"][key])[:4]), key


def test_the_wind_of_one_log_is_not_that_of_another(model: Model, fouled: str, folder: Path) -> None:
    calm = sailed(folder, "calm", BRISK, 9, FOULED)
    told_here, told_there = (judged(model, log, folder / "out") for log in (fouled, calm))
    here, there = told_here["logs"][0], told_there["logs"][0]
    assert [one["effect"] for one in here["effects"]["conditions"]] == ["wind"]
    without = replace(model, conditions=())
    blind = judged(without, fouled, folder / "out")["logs"][0]
    assert here["mse"]["model"]["sway"] < 0.8 * blind["mse"]["model"]["sway"]
    same = judged(without, calm, folder / "out")["logs"][0]
    assert there["mse"]["model"] == same["mse"]["model"]
    # Put into the calm log by its hash, the wind would do harm.
    forged = replace(model, conditions=(replace(model.conditions[0], sha256=there["sha256"]),))
    harmed = judged(forged, calm, folder / "out")["logs"][0]
    assert harmed["mse"]["model"]["sway"] > 1.2 * there["mse"]["model"]["sway"]
    text = render_evaluation(told_here)
    assert "acts, as in every log: Damping at speed has changed" in text
    assert "acts, as in this log: A steady wind" in text


def test_a_fault_that_began_in_one_log_lasts_in_the_next(folder: Path) -> None:
    first = sailed(folder, "fault", TWELVE, 4, f"{BROKEN}from_s = 300\n")
    second = sailed(folder, "after", BRISK, 5, BROKEN)
    found, _ = taught(first, "thruster_gain", onset_s=300.0, told_s=300.5)
    made, _ = update_model(told(found), FERRY, None, "ferry")
    assert made is not None
    assert made.vessel_effects[0].values["factor"] == pytest.approx(0.6, abs=0.03)
    assert made.vessel_effects[0].sources[0].onset_s == 300.5, "the onset that was told"
    for log in (first, second):
        ratio = judged(made, log, folder / "out")["logs"][0]["per_axis"]
        assert ratio["yaw"] < 0.3
        assert max(ratio["surge"], ratio["sway"]) < 0.8


def test_a_fault_that_passed_in_one_log_is_not_in_the_next(folder: Path) -> None:
    log = sailed(folder, "passed", TWELVE, 4, f"{BROKEN}from_s = 300\nuntil_s = 500\n")
    found, problem = taught(log, "thruster_gain", onset_s=300.0, offset_s=500.0)
    assert found.vessel == ()
    (stored,) = found.conditions
    assert (stored.effect, stored.offset_in(str(found.training["sha256"]))) == ("thruster_gain", 500.0)
    made, _ = update_model(told(found), FERRY, None, "ferry")
    assert made is not None
    assert not made.accepted, "nothing of it holds for the vessel"
    here, there = (
        prior_force_model(problem.plain.measurements, FERRY, made, sha)[0]
        for sha in (found.training["sha256"], "other")
    )
    t = problem.plain.measurements.t
    weak = np.any(here.parts != there.parts, axis=(1, 2))
    assert weak.any()
    assert ((t[weak] >= 300.0) & (t[weak] < 500.0)).all()


def test_the_model_moves_as_the_force_model_that_was_fitted(model: Model, fouled: str) -> None:
    problem, survey = trial_on(fouled)
    candidates = [
        Candidate(effects()[name], None, effects()[name].parameters_of(FERRY)) for name in ("fouling", "wind")
    ]
    force_model = replace(problem.plain, hull=np.array([one.value for one in model.hull.values()]))
    for candidate, stored in zip(candidates, (*model.vessel_effects, *model.conditions[0].effects), strict=True):
        force_model = candidate.act(force_model, np.array(list(stored.values.values())))
    again, _ = prior_force_model(problem.plain.measurements, FERRY, model, survey.recording.sha256)
    np.testing.assert_allclose(acceleration(again), acceleration(force_model), rtol=1e-9, atol=1e-12)
    elsewhere, _ = prior_force_model(problem.plain.measurements, FERRY, model, "of another log")
    assert np.abs(acceleration(elsewhere) - acceleration(force_model)).max() > 1e-3


def test_a_diagnosis_of_a_diagnosed_model_changes_what_it_adds_alone(model: Model, folder: Path) -> None:
    log = sailed(folder, "worse", TWELVE, 6, FOULED.replace("1.8", "2.7"))
    problem, survey = trial_on(log, model)
    candidate = Candidate(effects()["fouling"], None, effects()["fouling"].parameters_of(FERRY))
    kept = fit(problem, [candidate])
    found = posterior_of(problem, kept, (), [finding(candidate, 0.99)], survey)
    assert found is not None
    made, _ = update_model(told(found), FERRY, model, "milliampere")
    assert made is not None
    (growth,) = made.vessel_effects
    assert len(growth.sources) == 2
    assert made.conditions == model.conditions
    # How hull and growth share it is for what was believed before; their product is what the water does.
    drag = made.hull["X_|u|u"].value * growth.values["surge"]
    assert drag == pytest.approx(2.7 * FERRY.hull.D["X_|u|u"], rel=0.1)
    assert growth.values["surge"] > 1.1 * model.vessel_effects[0].values["surge"]


def test_logs_that_agree_are_weighed_and_those_that_do_not_are_told(folder: Path, fouled: str) -> None:
    other = sailed(folder, "again", BRISK, 11, FOULED)
    one, _ = taught(fouled, "fouling", "wind")
    two, _ = taught(other, "fouling")
    made, notes = update_model(told(one, two), FERRY, None, "ferry")
    assert made is not None
    assert notes == ()
    (growth,) = made.vessel_effects
    parts = [part.vessel[0].parameters["surge"] for part in (one, two)]
    weights = [(part.high - part.low) ** -2 for part in parts]
    mean = sum(w * part.value for w, part in zip(weights, parts, strict=True)) / sum(weights)
    assert growth.parameters["surge"].value == pytest.approx(mean)
    assert [source.log for source in growth.sources] == ["fouled", "again"]
    assert [known.log for known in made.conditions] == ["fouled"]
    # The hull of both is surer than that of either.
    k = 0
    width = made.hull["m11"].high - made.hull["m11"].low
    assert width < 2 * 1.96 * min(np.sqrt(part.hull.covariance[k, k]) for part in (one, two))

    def moved(part: Posterior, value: float) -> Posterior:
        quantity = replace(part.vessel[0].parameters["surge"], value=value, low=value - 0.05, high=value + 0.05)
        stored = replace(part.vessel[0], parameters={**part.vessel[0].parameters, "surge": quantity})
        return replace(part, vessel=(stored,))

    made, notes = update_model(told(moved(one, 1.8), moved(two, 1.0)), FERRY, None, "ferry")
    assert made is not None
    assert made.vessel_effects == ()
    assert not made.accepted
    assert "contradict each other about surge (1.8 against 1 -)" in notes[0]
    done = store_updated_model(told(moved(one, 1.8), moved(two, 1.0)), FERRY, None, folder / "apart")
    assert (done[0].model is not None, done[0].model_accepted) == (True, False)
    # Logs that differ by more than they admit leave a wider interval than either of them.
    made, notes = update_model(told(moved(one, 1.8), moved(two, 1.72)), FERRY, None, "ferry")
    assert made is not None
    wide = made.vessel_effects[0].parameters["surge"]
    assert wide.high - wide.low > 0.1 / np.sqrt(2.0) * 1.2


def test_what_another_log_would_have_shown_and_does_not_enters_no_model(folder: Path) -> None:
    weak = sailed(folder, "weak", BRISK, 12, BROKEN)
    found, _ = taught(weak, "thruster_gain")
    (first,) = told(found)
    instance = found.vessel[0].instance
    away = 1.0 - found.vessel[0].values["factor"]

    def beside(least: float | None, thruster: str | None = instance) -> tuple[Model, tuple[str, ...]]:
        unseen = LeastSize("thruster_gain", thruster, least, "-", "")
        sound = Diagnosis("sound", "milliampere", "matched", (), {}, {}, least_sizes=(unseen,))
        made, notes = update_model([first, sound], FERRY, None, "ferry")
        assert made is not None
        return made, notes

    made, notes = beside(0.49 * away)
    assert (made.vessel_effects, made.accepted) == ((), False)
    assert (
        "does not enter the model: weak shows it, and sound does not, where half of it would have been seen" in notes[0]
    )
    for made, notes in (beside(0.51 * away), beside(None), beside(0.1 * away, "another")):
        assert [one.effect for one in made.vessel_effects] == ["thruster_gain"]
        assert notes == ()
    # What set in may have lasted since.
    (stored,) = found.vessel
    began = replace(stored, sources=tuple(replace(one, onset_s=100.0) for one in stored.sources))
    (first,) = told(replace(found, vessel=(began,)))
    made, _ = beside(0.1 * away)
    assert len(made.vessel_effects) == 1


def test_one_estimate_from_all_logs_counts_once(folder: Path, fouled: str) -> None:
    one, _ = taught(fouled, "fouling")
    assert one.hull is not None
    # As of a campaign, in which every log has the hull and the property of all.
    two = replace(one, training={**one.training, "sha256": "another"})
    made, notes = update_model(told(one, two), FERRY, None, "ferry")
    assert made is not None
    assert notes == ()
    (growth,) = made.vessel_effects
    assert growth.parameters == one.vessel[0].parameters
    assert len(growth.sources) == 2
    end = 1.96 * np.sqrt(one.hull.covariance[0, 0])
    assert made.hull["m11"].high - made.hull["m11"].value == pytest.approx(end)
    # Without a hull of its own it leaves the one that was examined.
    made, _ = update_model(told(replace(one, hull=None), replace(two, hull=None)), FERRY, None, "ferry")
    assert made is not None
    assert made.hull == {}


@pytest.mark.parametrize("apart", [0.0, 0.01], ids=["one estimate", "two"])
def test_what_has_no_interval_keeps_its_value_and_leaves_the_rest_as_it_is(apart: float) -> None:
    parts = []
    for k in (0.0, 1.0):
        side = 0.7 + apart * k
        # Each log has its own NaN.
        arm = {
            "x": Quantity(apart * k, float("nan"), float("nan"), "m"),
            "y": Quantity(side, side - 0.1, side + 0.1, "m"),
        }
        stored = StoredEffect("lever_arm", None, arm, (Source(f"log {k}", str(k), 0.99),))
        parts.append(Posterior({"name": str(k), "sha256": str(k), "seconds": 60.0, "rows": 60}, {}, (stored,), ()))
    made, _ = update_model(told(*parts), FERRY, None, "ferry")
    assert made is not None
    x, y = (made.vessel_effects[0].parameters[name] for name in ("x", "y"))
    assert x.value == pytest.approx(apart / 2.0)
    assert not np.isfinite(x.high - x.low)
    assert y.value == pytest.approx(0.7 + apart / 2.0)
    # One estimate of all logs is no surer for being told of each.
    assert y.high - y.low == pytest.approx(0.2 if not apart else 0.2 / np.sqrt(2.0))


def test_what_is_doubtful_or_nothing_makes_no_model(fouled: str, folder: Path) -> None:
    found, _ = taught(fouled, "fouling", "wind", doubtful="fouling")
    assert found.vessel == ()
    assert [one.effect for one in found.conditions] == ["wind"]
    assert found.notes == ("Fouling is too doubtful to enter a model.",)
    made, _ = update_model(told(found), FERRY, None, "ferry")
    assert made is not None
    assert not made.accepted
    nothing = Diagnosis("calm", "milliampere", "matched", (), {"mse": MSE}, {"mse": MSE})
    assert update_model([nothing], FERRY, None, "ferry") == (None, ())
    assert store_updated_model([nothing], FERRY, None, folder / "none") == (nothing,)
    assert not (folder / "none").exists()


GUST_STD = 1.5
CHANCE = {
    "gusts": (np.array([GUST_STD, 9.0]), np.array([0.1, 0.3])),
    "waves": (np.array([0.4, 60.0, 100.0, 6.0]), np.array([0.05, np.inf, 0.1, 0.2])),
}
"""Parameters of disturbances, and the standard deviations of their logarithms."""


def gusty(log: str, **probabilities: float) -> Posterior:
    """Return what a log teaches in which a wind was found, and these disturbances with their probabilities."""
    problem, survey = trial_on(log)
    wind = Candidate(effects()["wind"], None, effects()["wind"].parameters_of(FERRY))
    chance = {name: Candidate(effects()[name], None, effects()[name].parameters_of(FERRY)) for name in probabilities}
    states = [DisturbanceState(candidate, *CHANCE[name], gain=40.0) for name, candidate in chance.items()]
    findings = [finding(wind, 0.99), *(finding(chance[name], value) for name, value in probabilities.items())]
    found = posterior_of(problem, fit(problem, [wind]), states, findings, survey)
    assert found is not None
    return found


def test_what_came_and_went_by_chance_is_a_condition_of_its_log(fouled: str) -> None:
    found = gusty(fouled, gusts=0.97, waves=0.9)
    assert found.vessel == ()
    wind, gusts, waves = found.conditions
    assert [one.key for one in (wind, gusts, waves)] == [("wind", None), ("gusts", None), ("waves", None)]
    for stored, probability in ((gusts, 0.97), (waves, 0.9)):
        (source,) = stored.sources
        assert (source.log, source.sha256) == ("fouled", wind.sources[0].sha256)
        assert (source.probability, source.onset_s) == (probability, None)
        units = {one.name: one.unit for one in effects()[stored.effect].parameters_of(FERRY)}
        assert {name: one.unit for name, one in stored.parameters.items()} == units
        assert list(stored.values.values()) == CHANCE[stored.effect][0].tolist()
    # 95 % of a normal distribution of the logarithm, a tenth of which is the formula's.
    strength, memory = gusts.parameters["std"], gusts.parameters["time_constant"]
    assert (strength.low, strength.high) == pytest.approx((1.5 / 1.3194, 1.5 * 1.3194), rel=1e-3)
    assert (memory.low, memory.high) == pytest.approx((9.0 / 1.8586, 9.0 * 1.8586), rel=1e-3)
    # What the log does not tell has no interval, and is not said.
    assert [name for name, one in waves.parameters.items() if not np.isfinite(one.low)] == ["force_std"]
    assert "60 N " not in waves.says()
    assert "100 N·m" in waves.says()
    assert [one.effect for one in gusty(fouled, gusts=0.4, waves=0.9).conditions] == ["wind", "waves"]


def test_stored_gusts_load_the_vessel_as_many_winds_drawn_at_random_do(fouled: str, folder: Path) -> None:
    (kept,) = store_updated_model(told(gusty(fouled, gusts=0.97)), FERRY, None, folder / "out", name="gusty")
    assert kept.model is not None
    stored = load_file(Path(kept.model))
    (known,) = stored.conditions
    measurements = trial_on(fouled)[0].plain.measurements
    rows = np.flatnonzero(measurements.usable)[:: int(np.count_nonzero(measurements.usable) / 12)]

    def load(of: Model, sha256: str = known.sha256) -> np.ndarray:
        """Return the external force beyond that in still air."""
        still = replace(of, conditions=())
        return np.subtract(
            *(prior_force_model(measurements, FERRY, one, sha256)[0].external[rows] for one in (of, still))
        )

    assert {one.effect for one in known.effects} == {"wind", "gusts"}
    wind = next(one for one in known.effects if one.effect == "wind")
    air = np.array([wind.values["north"], wind.values["east"]])
    draws = air + GUST_STD * np.random.default_rng(13).normal(size=(20_000, 2))
    average, steady = np.empty((2, len(rows), 3))
    for k, row in enumerate(rows.tolist()):
        psi, nu = np.full(len(draws), measurements.psi[row]), np.tile(measurements.nu[row], (len(draws), 1))
        average[k] = wind_force(FERRY.wind, draws, psi, nu).mean(axis=0)
        steady[k] = wind_force(FERRY.wind, air[None], psi[:1], nu[:1])[0]
    still = measurements.air_load[rows]
    factors = np.array([wind.values[name] for name in ("C_X", "C_Y", "C_N")])
    scale = np.sqrt(np.mean(average**2, axis=0))
    assert (np.abs(load(stored) - factors * (average - still)) < 0.02 * scale).all()
    assert (np.abs(average - steady).max(axis=0) > 0.09 * scale).all()
    # Without them the load is that of the steady wind; in another log there is neither.
    alone = replace(stored, conditions=(replace(known, effects=(wind,)),))
    np.testing.assert_allclose(load(alone), factors * (steady - still), atol=1e-9 * np.abs(steady).max())
    assert not load(stored, "of another log").any()
    # In whatever order a file lists them.
    turned = replace(stored, conditions=(replace(known, effects=known.effects[::-1]),))
    np.testing.assert_array_equal(load(turned), load(stored))


def test_a_wrong_hull_model_becomes_the_hull(fouled: str) -> None:
    problem, survey = trial_on(fouled)
    effect = effects()["hull_parameters"]
    candidate = Candidate(effect, None, effect.parameters_of(FERRY))
    names = [parameter.name for parameter in candidate.parameters]
    factors = np.where(np.array(names) == "m11", 1.5, 1.0)
    # Without a step the factors stay as they are given, and the hull is the profile's.
    kept = fit(problem, [candidate], [factors], steps=0)
    found = posterior_of(problem, kept, (), [finding(candidate, 0.99)], survey)
    assert found is not None
    assert (found.vessel, found.conditions) == ((), ())
    made, _ = update_model(told(found), FERRY, None, "ferry")
    assert made is not None
    assert made.hull["m11"].value == pytest.approx(1.5 * FERRY.hull.M[0, 0])
    assert made.hull["m22"].value == pytest.approx(FERRY.hull.M[1, 1])
    # The interval holds what is not known of the factor as well as of the coefficient, which alone is known to 12 %.
    wide = made.hull["X_uuu"]
    assert wide.high - wide.low > 2 * 1.96 * 0.12 * abs(wide.value)


def test_compare_tells_the_difference_in_physics(model: Model, fouled: str, folder: Path) -> None:
    clean = replace(model.undiagnosed(), version=7)
    field = select_candidates(["clean", "found"], [clean, model])
    result = compare(field, [fouled], RunContext(folder / "out")).result
    pair = result.logs[0].pairs[-1]
    assert (pair.first, pair.second) == (clean.label, model.label)
    assert pair.mse["surge"].value > 1.25
    assert result.logs[0].scores[model.label].trained
    assert [(row.effect, row.log) for row in result.effects] == [("fouling", None), ("wind", "fouled")]
    assert result.effects[0].values[clean.label] is None
    text = render_effects(result.effects)
    assert "Fouling, a property of the vessel" in text
    assert f"  {clean.label}: not in it" in text
    assert "Steady wind, a condition of fouled" in text


def test_nothing_is_left_to_find_in_a_log_of_the_model(model: Model, folder: Path) -> None:
    sailing = sailed_by(load_scenario("twelve-corner-calm"), model)
    quick = replace(sailing.scenario.sensors, imu_rate_hz=0.0, camera_rate_hz=0.0)
    log = folder / "of-the-model.mcap"
    write_log(simulate(replace(sailing.scenario, sensors=quick, duration_s=720.0), 21, vessel=sailing.vessel), log)
    (with_model,) = diagnose([str(log)], FERRY, DiagnosisSettings(model=model), IN_MEMORY)
    assert with_model.verdict == "matched"
    assert with_model.posterior is None
    entry = judged(model, str(log), folder / "out")["logs"][0]
    assert entry["per_axis"]["surge"] < 0.9


def test_sides_of_a_shallow_place_that_a_log_does_not_tell_have_no_interval(folder: Path) -> None:
    log = sailed(folder, "shallow", TWELVE, 6, "[environment.shallow]\nnorth_m = [7.5, 60.0]\ndamping_factor = 2.0\n")
    found, problem = taught(log, "shallow_water")
    (stored,) = found.conditions
    unreported = effects()["shallow_water"].unreported(
        problem.plain.measurements, np.array(list(stored.values.values()))
    )
    assert unreported
    assert {name for name, one in stored.parameters.items() if not np.isfinite(one.low)} == unreported
