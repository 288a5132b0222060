"""What a log could have shown: chances against cases known in closed form, and advice that names the manoeuvre."""

from __future__ import annotations

from dataclasses import replace
from math import erf, sqrt
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.detection_power import (
    AXES,
    DetectionPower,
    detection_powers,
    is_testable,
    recording_advice,
    unexcited_axes,
    untested_notes,
)
from ferryid.effects import effects
from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, Measurements, hull_of
from ferryid.types import Floats
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")
ROWS = 50


def push(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    return replace(force_model, external=force_model.external + np.array([p[0], 0.0, 0.0]))


PUSH = Candidate(
    Effect("push", "Push", lambda profile: (), push, lambda v, i: "", lambda v, i: {}),
    None,
    (Parameter("force", "N", 10.0, -1e4, 1e4),),
)
NOTHING = Fit((), (), np.empty((0, 0)), hull_of(FERRY), 0.0)


def linear(strength: float, hull: Floats | None = None) -> EstimationProblem:
    """A trial whose prediction errors are the push, every newton of it worth `strength` in units of the noise."""
    zero = np.zeros((ROWS, 3))
    measurements = Measurements(
        FERRY, np.arange(ROWS) * 0.2, zero, zero, zero, np.zeros((ROWS, 2, 3)), zero, np.ones(ROWS, dtype=bool)
    )
    plain = ForceModel(measurements, hull_of(FERRY), measurements.parts, measurements.angles, zero)
    by_hull = np.zeros((ROWS, len(COEFFICIENTS))) if hull is None else hull
    return cast(
        EstimationProblem,
        SimpleNamespace(plain=plain, by_hull=by_hull, white=lambda force_model: strength * force_model.external[:, 0]),
    )


def chance(problem: EstimationProblem) -> float:
    (one,) = detection_powers(problem, NOTHING, [PUSH])
    return one.chance


@pytest.mark.parametrize("strength", [0.03, 0.06, 0.08, 0.2])
def test_the_chance_is_that_of_the_linear_case(strength: float) -> None:
    # Every row shifts by 10 strength at usual size: one regressor, with information 50 (10 strength)².
    information = ROWS * (10.0 * strength) ** 2
    expected = 0.5 * (information - 1.0 - np.log1p(information))
    exact = 0.5 * (1.0 + erf((expected - INFERENCE.prior_odds) / sqrt(2.0 * max(information, 1.0))))
    assert chance(linear(strength)) == pytest.approx(exact, rel=1e-6)


def test_a_chance_is_how_often_the_evidence_is_enough() -> None:
    strength, random = 0.06, np.random.default_rng(5)
    x = np.full(ROWS, 10.0 * strength)
    information = float(x @ x)
    y = x + random.standard_normal((20000, ROWS))
    evidence = 0.5 * (y @ x) ** 2 / (1.0 + information) - 0.5 * np.log1p(information)
    assert chance(linear(strength)) == pytest.approx(float(np.mean(evidence > INFERENCE.prior_odds)), abs=0.03)


@pytest.mark.parametrize("strength", [0.1, 0.14, 0.2])
def test_a_chance_beside_an_unknown_hull_is_how_often_the_evidence_is_enough(strength: float) -> None:
    # The hull can imitate the push, as far as its prior lets it.
    random = np.random.default_rng(5)
    x = np.full(ROWS, 10.0 * strength)
    hull = np.zeros((ROWS, len(COEFFICIENTS)))
    hull[:, 0] = 0.2
    covariance = np.eye(ROWS) + hull @ hull.T
    y = x + random.multivariate_normal(np.zeros(ROWS), covariance, 20000)
    # By the densities themselves: with the push, whose size is normal, against without it.
    with_push = multivariate_normal(np.zeros(ROWS), covariance + np.outer(x, x)).logpdf(y)
    evidence = with_push - multivariate_normal(np.zeros(ROWS), covariance).logpdf(y)
    enough = float(np.mean(evidence > INFERENCE.prior_odds))
    assert enough > 0.05
    assert chance(linear(strength, hull)) == pytest.approx(enough, abs=0.04)


def test_what_the_hull_can_imitate_is_not_seen() -> None:
    assert chance(linear(0.2)) > 0.99
    hull = np.zeros((ROWS, len(COEFFICIENTS)))
    hull[:, 0] = 30.0
    assert chance(linear(0.2, hull)) < 0.01


def test_what_was_found_and_what_is_only_noise_have_no_chance_to_tell() -> None:
    still = replace(PUSH, effect=replace(PUSH.effect, apply=lambda force_model, p, instance: force_model))
    assert detection_powers(linear(0.2), NOTHING, [still]) == ()
    found = Fit((PUSH,), (np.array([5.0]),), np.eye(1), hull_of(FERRY), 0.0)
    assert detection_powers(linear(0.2), found, [PUSH]) == ()
    brief = replace(PUSH, effect=replace(PUSH.effect, onset=True, longest_s=60.0))
    assert detection_powers(linear(0.2), NOTHING, [brief]) == (), "nobody knows when"


def test_a_share_that_is_left_is_smaller_at_its_usual_size() -> None:
    def lost(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        return push(force_model, 100.0 * (1.0 - p), instance)

    share = (Parameter("share", "-", 0.1, 0.0, 1.0, neutral=1.0),)
    (one,) = detection_powers(
        linear(0.06), NOTHING, [replace(PUSH, effect=replace(PUSH.effect, apply=lost), parameters=share)]
    )
    assert one.chance == pytest.approx(chance(linear(0.06)))


@pytest.mark.parametrize(("low", "high"), [(0.0, 1e4), (-1e4, 0.0), (-1e4, 1e4)])
def test_what_goes_one_way_only_has_the_chance_of_what_may_go_either_way(low: float, high: float) -> None:
    (parameter,) = PUSH.parameters
    (one,) = detection_powers(
        linear(0.06), NOTHING, [replace(PUSH, parameters=(replace(parameter, low=low, high=high),))]
    )
    assert one.chance == chance(linear(0.06))


@pytest.mark.parametrize("axis", list(AXES))
def test_an_axis_that_moves_is_told_from_those_that_do_not(axis: str) -> None:
    hull = np.zeros((ROWS, len(COEFFICIENTS)))
    hull[:, AXES[axis][0]] = 1.0
    assert unexcited_axes(linear(1.0, hull)) == tuple(name for name in AXES if name != axis)


def test_every_coefficient_belongs_to_one_axis() -> None:
    assert sorted(place for places in AXES.values() for place in places) == list(range(len(COEFFICIENTS)))
    assert [COEFFICIENTS[place] for place in AXES["surge"]] == ["m11", "X_u", "X_|u|u", "X_uuu"]
    assert all(COEFFICIENTS[place][0] == "N" or COEFFICIENTS[place] in ("m32", "m33") for place in AXES["yaw"])


def candidate(name: str, instance: str | None = None) -> Candidate:
    return Candidate(effects()[name], instance, effects()[name].parameters_of(FERRY))


def test_a_log_that_could_show_less_than_half_is_not_testable() -> None:
    seen, blind = DetectionPower(candidate("wind"), 0.9), DetectionPower(candidate("payload"), 0.1)
    assert is_testable([seen, seen, blind], ())
    assert not is_testable([seen, blind, blind], ())
    assert not is_testable([seen, seen, blind], tuple(AXES))


def test_advice_names_axis_effect_and_manoeuvre() -> None:
    blind: list[Any] = [
        DetectionPower(candidate("wind"), 0.1),
        DetectionPower(candidate("thruster_gain", "thruster1"), 0.2),
    ]
    told = " ".join(recording_advice([*blind, DetectionPower(candidate("current"), 0.99)], ("sway",)))
    assert "hardly moved in sway" in told
    assert "moves sideways" in told
    assert "thruster force (thruster1)" in told
    assert "turn on the spot" in told
    assert "current" not in told
    assert recording_advice([DetectionPower(candidate("current"), 0.99)], ()) == []


def test_advice_names_each_effect_and_manoeuvre_once() -> None:
    ends: list[Any] = [DetectionPower(candidate("azimuth_offset", f"thruster{k}"), 0.1) for k in (1, 2)]
    (told,) = recording_advice([*ends, DetectionPower(candidate("fouling"), 0.2)], ())
    assert told.count("for azimuth offset (thruster1, thruster2), record each thruster alone") == 1
    assert told.count("azimuth offset") == told.count("fouling") == 1


def test_what_was_not_tested_is_told_by_title_and_once_for_a_reason() -> None:
    untested = {"wind": "there are no wind areas", "gusts": "there are no wind areas", "thruster_gain": "nothing turns"}
    assert untested_notes(untested) == [
        "Not tested: steady wind and gusts, since there are no wind areas.",
        "Not tested: thruster force, since nothing turns.",
    ]


@pytest.mark.parametrize("strength", [0.03, 0.06, 0.2])
def test_at_its_multiple_an_effect_has_an_even_chance(strength: float) -> None:
    (one,) = detection_powers(linear(strength), NOTHING, [PUSH])
    random, x = np.random.default_rng(5), np.full(ROWS, 10.0 * strength)
    y = one.multiple * x + random.standard_normal((20000, ROWS))
    information = float(x @ x)
    evidence = 0.5 * (y @ x) ** 2 / (1.0 + information) - 0.5 * np.log1p(information)
    assert np.mean(evidence > INFERENCE.prior_odds) == pytest.approx(0.5, abs=0.1)
    assert (one.multiple > 1.0) == (one.chance < 0.5)
