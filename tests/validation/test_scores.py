"""Figures of merit, worked by hand from a few lines."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from math import inf, isnan
from typing import Any

import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects import effects
from ferryid.effects.shallow_water import HEAVIER
from ferryid.effects.wind import COEFFICIENTS
from ferryid.json_record import Record
from ferryid.validation.case import Case, Truth
from ferryid.validation.detection_curves import Curve
from ferryid.validation.estimate_errors import estimate_errors
from ferryid.validation.name_scores import (
    NONE,
    OTHER,
    REFUSED,
    Share,
    confusion,
    false_names,
    first_name,
    hints_not_in_log,
    names,
    names_not_in_log,
    outcome_of_missed,
    wrong_names,
)
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.records import (
    UNKNOWN,
    CaseResult,
    Diagnosis,
    Finding,
    OracleEstimate,
    OracleResult,
    RivalName,
    TransferResult,
    TransferScore,
)
from ferryid.validation.scores import detections, score
from ferryid.validation.transfer_scores import claimed_improvement, claims, failed_rivals, median_interval, methods
from ferryid.vessel import load_profile

WIND = Truth("wind", None, {"north": 3.0, "east": 4.0})
WEAK = Truth("thruster_gain", "thruster1", {"factor": 0.8}, onset_s=300.0)


def finding(
    effect: str,
    values: dict[str, float] | None = None,
    half: float = 0.1,
    instance: str | None = None,
    p: float = 1.0,
    **more: Any,
) -> Finding:
    parameters = {name: Estimate(value, value - half, value + half, "") for name, value in (values or {}).items()}
    return Finding(effect, instance, p, parameters, **more)


def result(
    truths: list[Truth],
    findings: list[Finding],
    cell: str = "wind",
    kind: str = "single",
    allowed: tuple[str, ...] = (),
    level: int | None = None,
    size: float = 0.0,
    realised: dict[str, dict[str, float]] | None = None,
    notes: tuple[str, ...] = (),
    error: str = "",
    **evaluations: Record | None,
) -> CaseResult:
    case = Case("1", cell, kind, "ferry", "square", "mcap", 1, level, size, tuple(truths), allowed)
    verdict = "refused" if error else "explained"
    return CaseResult(case, realised or {}, Diagnosis(verdict, 2.0, tuple(findings), notes, error=error), evaluations)


def test_what_is_named_is_right_wrong_or_one_of_several_undecided() -> None:
    wind = finding("wind", {"north": 3.0, "east": 4.0})
    refused = result([WIND], [], error="trial.mcap: nothing in it")
    lines = {
        "right": result([WIND], [wind]),
        "second": result([WIND], [finding("current"), wind]),
        "apart": result([WIND], [finding("current", unresolved_with=("wind",))]),
        "doubted": result([WIND], [finding("current", p=0.5)]),
        "allowed": result([WIND], [finding("gusts")], allowed=("gusts",)),
        "thruster": result([WEAK], [finding("thruster_gain", instance="thruster2")], cell="thruster_gain"),
        "unknown": result([], [finding("unknown")], cell="wake", kind="outside"),
        "clean": result([], [finding("wind", p=0.51)], cell="clean", kind="clean"),
        "refused": refused,
    }
    assert {name for name, one in lines.items() if wrong_names(one)} == {"second", "thruster", "clean"}
    assert [first_name(one) for one in lines.values()] == [
        "wind",
        "current",
        "current",
        NONE,
        "gusts",
        OTHER,
        UNKNOWN,
        "wind",
        REFUSED,
    ]
    shares = false_names(list(lines.values()))
    assert shares == {"all": Share(3, 9), "single": Share(2, 7), "outside": Share(0, 1), "clean": Share(1, 1)}
    made = confusion([*lines.values(), result([WIND, WEAK], [wind], cell="pair", kind="pair")])
    assert made.rows == ("wind", "thruster_gain", "wake", "clean")
    assert made.columns == ("current", "gusts", "wind", OTHER, UNKNOWN, NONE, REFUSED)
    assert made.counts == ((2, 1, 1, 0, 0, 1, 1), (0, 0, 0, 1, 0, 0, 0), (0, 0, 0, 0, 1, 0, 0), (0, 0, 1, 0, 0, 0, 0))
    first = score(list(lines.values())).cells[0]
    assert (first.first, first.every, first.false, first.refused) == (Share(1, 6), Share(2, 6), Share(1, 6), 1)


def test_a_hull_is_right_only_in_a_coefficient_that_is_wrong() -> None:
    hull = Truth("hull_parameters", None, {"N_r": 1.3, "m22": 0.8})

    def named(**values: float) -> CaseResult:
        found = finding("hull_parameters", {name.replace("Y_rv", "Y_|r|v"): one for name, one in values.items()})
        return result([hull], [found], cell="hull_parameters", allowed=("hull_parameters",))

    right, beside = named(Y_rv=0.3, N_r=1.2), named(Y_rv=0.3)
    assert (names(right), first_name(right)) == ([("hull_parameters", None)], "hull_parameters")
    assert (names(beside), first_name(beside)) == ([("hull_parameters", "other coefficients")], OTHER)
    assert (wrong_names(beside), len(names_not_in_log(beside)), names_not_in_log(right)) == ([], 1, [])
    assert [one.found for one in estimate_errors([beside])] == [0]
    assert [one.found for one in estimate_errors([right])] == [1, 1]
    # Where no hull is injected, it is an exception that is counted without.
    clean = result([], [finding("hull_parameters", {"N_r": 1.2})], "clean", "clean", allowed=("hull_parameters",))
    assert (names(clean), wrong_names(clean)) == ([("hull_parameters", None)], [])
    assert score([right, beside, clean]).strict == Share(2, 3)


def test_hints_of_what_is_not_there_are_counted() -> None:
    doubtful = [finding(name, p=0.5) for name in ("wind", "current", "unknown")]
    assert hints_not_in_log(result([WIND], doubtful)) == [("current", None)]
    assert score([result([WIND], doubtful), result([WIND], doubtful[:1])]).hinted == Share(1, 2)


def test_errors_are_those_of_vectors_and_intervals_those_of_parameters() -> None:
    lines = [
        # A vector of 5 that is off by 0.4, with one component outside of its interval.
        result([WIND], [finding("wind", {"north": 3.24, "east": 4.32}, 0.3)]),
        # A factor of 0.81 for one of 0.8 is 5 % of the 0.2 that are lost; 4 s late, with an interval that ends after 3.
        result(
            [WEAK],
            [finding("thruster_gain", {"factor": 0.81, "onset": 304.0}, 3.0, "thruster1", onset=304.0)],
        ),
        # Named, but not since when.
        result([WEAK], [finding("thruster_gain", {"factor": 0.8}, 0.01, "thruster1")]),
        # Doubtful, and of the wrong thruster: neither is a measurement of the truth.
        result([WIND], [finding("wind", {"north": 9.0, "east": 9.0}, p=0.4)]),
        result([WEAK], [finding("thruster_gain", {"factor": 0.1}, instance="thruster2")]),
    ]
    everything, gain, wind = estimate_errors(lines)
    assert (everything.effect, gain.effect, wind.effect) == ("all", "thruster_gain", "wind")
    assert (everything.found, gain.found, wind.found) == (3, 2, 1)
    assert wind.errors == pytest.approx((0.08,))
    assert wind.reaches == pytest.approx((0.24 / 0.3, 0.32 / 0.3))
    assert wind.covered == Share(1, 2)
    # The one that does not hold the truth is kept with what else was there.
    (one,) = wind.outside
    assert (one.effect, one.parameter, one.truth, one.estimate.value, one.beside) == ("wind", "east", 4.0, 4.32, ())
    assert everything.outside == (one,)
    assert gain.errors == pytest.approx((0.05, 0.0))
    assert gain.times_s == (4.0, inf)
    assert (gain.in_time, gain.times_held) == (Share(1, 2), Share(0, 2))
    assert everything.median_error == pytest.approx(0.05)
    assert everything.within == Share(3, 3)


def test_a_disturbance_is_measured_by_what_it_did() -> None:
    gusts = Truth("gusts", None, {"std": 1.0, "time_constant": 8.0})
    found = finding("gusts", {"std": 1.32, "time_constant": 9.0})
    realised = {"gusts": {"std": 1.2, "time_constant": 10.0}}
    assert estimate_errors([result([gusts], [found], realised=realised)])[0].errors == pytest.approx((0.1, 0.1))


def test_places_on_the_chart_have_intervals_but_no_relative_error() -> None:
    shoal = Truth("shallow_water", None, {"factor": 1.5, "north": 10.0, "east": 2.0})
    found = estimate_errors(
        [result([shoal], [finding("shallow_water", {"factor": 1.45, "north": 10.05, "east": 9.0})])]
    )[0]
    assert found.errors == pytest.approx((0.1,))
    assert found.covered == Share(2, 3)


def test_what_changes_nothing_is_what_the_library_has() -> None:
    profile = load_profile("milliampere")
    not_reported = {*COEFFICIENTS, HEAVIER.name}
    # An error of a limit is a share of the limit: what changes nothing is whatever the thruster never reaches.
    limits = {"thrust_saturation"}
    for name, plant_effect in plant_effects().items():
        effect = effects().get(name)
        for one in () if effect is None else effect.parameters_of(profile):
            if one.name not in plant_effect.positions and one.name not in not_reported:
                assert plant_effect.neutral == (0.0 if name in limits else one.neutral), (name, one.name)
    assert set(plant_effects()) - set(effects()) == {"azimuth_resolution", "yaw_rate_scale"}


def test_claims_are_held_against_a_transfer_log() -> None:
    def mse(surge: float) -> dict[str, float | None]:
        return {"surge": surge, "sway": 1.0, "yaw": 1.0}

    def named(*effects: str) -> tuple[RivalName, ...]:
        return tuple(RivalName(effect, None, 0.1, ()) for effect in effects)

    def transfer(surge: float, **rivals: TransferScore) -> TransferResult:
        diagnosed = TransferScore(mse(surge), 1.0, base_position_m=2.0)
        return TransferResult(TransferScore(mse(9.0), 4.0), {"diagnosed": diagnosed, **rivals})

    nothing = dict.fromkeys(("surge", "sway", "yaw"))
    rivals = {"thesis": TransferScore(nothing, why="too short"), "sindy": TransferScore(mse(2.0), 8.0)}
    one = finding("wind", improvement={"surge": 0.5, "sway": 0.2, "yaw": 0.0})
    two = finding("fouling", improvement={"surge": 0.4, "sway": 0.0, "yaw": 0.0})
    asked = {**rivals, "sindy": replace(rivals["sindy"], names=named("current"))}
    asked["stepwise"] = TransferScore(nothing, names=named("wind"))
    both = result([WIND], [one, two], transfer=transfer(0.35, **asked))
    # Each removes its share of what the other leaves: 1 - 0.5 * 0.6.
    assert claimed_improvement(both) == pytest.approx({"surge": 0.7, "sway": 0.2, "yaw": 0.0})
    whole = result([WIND], [one], transfer=transfer(0.9, **rivals))
    ratio = {axis: {"value": 0.4, "low": 0.3, "high": 0.5} for axis in ("surge", "sway", "yaw")}
    whole = replace(whole, diagnosis=replace(whole.diagnosis, after={"ratio": ratio}))
    assert claimed_improvement(whole)["surge"] == pytest.approx(0.6)
    doubtful = finding("wind", p=0.3, improvement={"surge": 0.9, "sway": 0.0, "yaw": 0.0})
    hint = result([WIND], [doubtful], transfer=transfer(0.1))
    alone = result([WIND], [one])
    surge = claims([both, whole, hint, alone])[0]
    assert (surge.axis, surge.logs) == ("surge", 2)
    assert surge.claimed == pytest.approx(0.65)
    assert surge.achieved == pytest.approx(0.375)
    assert surge.apart == pytest.approx(0.5 * (-0.05 - 0.5))
    # 0.65 of 0.7 is kept, 0.1 of 0.6 is not.
    assert surge.kept == Share(1, 2)
    made = {method.name: method for method in methods([both, whole])}
    assert list(made) == ["diagnosed", "sindy", "stepwise"]
    assert made["diagnosed"].mse["surge"] == pytest.approx(0.625)
    assert made["diagnosed"].free_run == pytest.approx(0.5)
    assert (made["diagnosed"].first, made["diagnosed"].false) == (Share(2, 2), Share(1, 2))
    assert made["sindy"].free_run == pytest.approx(2.0)
    assert (made["sindy"].first, made["sindy"].false) == (Share(0, 1), Share(1, 1))
    assert (made["stepwise"].logs, made["stepwise"].first) == (0, Share(1, 1))
    assert isnan(made["stepwise"].free_run)
    assert failed_rivals([both, whole]) == {"thesis": "too short"}
    # A log on which no rival ran counts in no row.
    assert methods([both, whole, result([WIND], [one], transfer=transfer(0.01))]) == methods([both, whole])


def test_intervals_of_shares_and_medians() -> None:
    # Clopper and Pearson's own closed forms at the ends: 1 - 0.025^(1/n) and 0.025^(1/n).
    assert Share(0, 100).interval == pytest.approx((0.0, 1.0 - 0.025**0.01))
    assert Share(20, 20).interval == pytest.approx((0.025**0.05, 1.0))
    assert Share(0, 0).interval == (0.0, 1.0)
    # Of ten values the second and the ninth: 2 (1 + 10) / 1024 is 2.1 %, with the third it would be 11 %.
    assert median_interval([float(k) for k in range(1, 11)]) == (2.0, 9.0)
    # Of six the first and the last: 2 / 64 is 3.1 %; of five nothing.
    assert median_interval([5.0, 1.0, 2.0, 3.0, 4.0, 6.0]) == (1.0, 6.0)
    assert median_interval([1.0] * 5) == (-inf, inf)


def oracle(gain: float, effect: str = "wind", floor: float = 4.6, idle: bool = False) -> OracleResult:
    return OracleResult(gain, (OracleEstimate(effect, None, gain, 2, floor, idle=idle),), 1.0)


def curve_results(idle: bool = False) -> list[CaseResult]:
    """Return 20 clean logs, and five sizes of a wind four times: named from 2 on, by an oracle from 1 on."""
    wind = finding("wind", {"north": 3.0, "east": 4.0})
    clean = [result([], [], "clean", "clean", oracle=oracle(0.2 * k)) for k in range(20)]
    sizes = (0.25, 0.5, 1.0, 2.0, 4.0)
    return clean + [
        result([WIND], [wind] if size >= 2.0 else [], level=k, size=size, oracle=oracle(8.0 * size**2, idle=idle))
        for k, size in enumerate(sizes)
        for _ in range(4)
    ]


@pytest.mark.slow
def test_detection_curves_of_a_diagnosis_and_of_its_oracle() -> None:
    lines = curve_results()
    scores = score(lines)
    (found,) = scores.detections
    assert (found.cell, found.effect) == ("wind", "wind")
    assert found.oracle is not None
    assert found.ratio is not None
    assert (found.blind.named, found.oracle.named) == (8, 12)
    # A factor of two between neighbouring sizes, and the same curve one size on.
    assert found.ratio.value == pytest.approx(2.0, rel=0.1)
    assert scores.median_ratio == found.ratio.value
    # The tail of the gains 0, 0.2 .. 3.8, seven of twenty: 0.8 above 2.4 on average, and 35 times rarer.
    assert scores.thresholds == {"wind": pytest.approx(max(4.6, 2.4 + 0.8 * 3.555348))}
    # What clean logs gain as well is no detection.
    (strict,) = detections(lines, {"wind": 10.0})
    assert strict.oracle is not None
    assert strict.oracle.named == 8
    assert strict.threshold == 10.0
    (without,) = detections([replace(one, evaluations={}) for one in lines], {})
    assert (without.oracle, without.ratio) == (None, None)


@pytest.mark.slow
def test_what_became_of_what_the_oracle_alone_named() -> None:
    weak = result([WEAK], [finding("wind")], "thruster_gain")
    key = ("thruster_gain", "thruster1")
    assert outcome_of_missed(result([WIND], []), ("wind", None)) == "none"
    assert outcome_of_missed(result([WIND], [finding("unknown")]), ("wind", None)) == "unknown"
    assert outcome_of_missed(result([WIND], [finding("wind", p=0.5), finding("current")]), ("wind", None)) == "a hint"
    assert outcome_of_missed(weak, key) == "taken for wind"
    note = "Thruster force (thruster1) was considered, but dropped: a law explains more."
    weak = replace(weak, diagnosis=replace(weak.diagnosis, notes=(note,)))
    assert outcome_of_missed(weak, key) == "dropped"
    assert outcome_of_missed(weak, ("thruster_gain", "thruster2")) == "taken for wind"
    (lost,) = (one.instead for one in score(curve_results()).detections)
    assert lost == {"none": 4}
    (lost,) = (one.instead for one in score(curve_results(idle=True)).detections)
    assert lost == {"too small to be worth a name": 4}


def test_the_size_of_a_cell_is_that_of_what_it_is_called_after() -> None:
    gusts = Truth("gusts", None, {"std": 1.0, "time_constant": 8.0})
    wind = finding("wind", {"north": 3.0, "east": 4.0})
    lines = [result([WIND, gusts], [wind], cell="gusts", level=k, size=1.0 + k) for k in range(5)]
    assert detections(lines, {})[0].blind.named == 0


@pytest.mark.slow
def test_scores_are_plain_data() -> None:
    scores = score(curve_results())
    plain = json.loads(json.dumps(scores.to_json(), allow_nan=False))
    assert plain["runs"] == 40
    assert plain["false_names"]["clean"]["interval"][0] == 0.0
    assert plain["detections"][0]["blind"]["says"] == scores.detections[0].blind.text
    assert Curve.from_json(plain["detections"][0]["blind"]).size == scores.detections[0].blind.size
    assert plain["seconds"] == [2.0, 2.0]
    assert plain["recoveries"][0]["covered"]["of"] == 16
    # Without a transfer log there is no number, rather than one that no reader of JSON knows.
    assert plain["claims"][0]["claimed"] is None


def test_scores_of_nothing_are_no_error() -> None:
    empty = score([])
    assert empty.runs == 0
    json.dumps(empty.to_json(), allow_nan=False)


@pytest.mark.slow
def test_scoring_draws_nothing() -> None:
    code = "import sys, ferryid.validation.oracle, ferryid.validation.scores; print('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_a_rival_that_is_not_installed_is_listed_and_not_counted() -> None:
    mse = {"surge": 0.5, "sway": 0.6, "yaw": 0.7}
    diagnosed, rival = TransferScore(mse, 1.0, base_position_m=4.0), TransferScore(mse, 2.0, base_position_m=4.0)
    absent = TransferScore(dict.fromkeys(mse), base_position_m=4.0, why="pysindy is not installed")
    transfer = TransferResult(TransferScore(mse), {"diagnosed": diagnosed, "sindy": absent, "stepwise": rival})
    results = [result([WIND], [], transfer=transfer)]
    scores = score(results)
    assert [(one.name, one.logs) for one in scores.methods] == [("diagnosed", 1), ("stepwise", 1)]
    assert scores.missing == {"sindy": "pysindy is not installed"}
    # With a result on one log, it was there.
    other = TransferResult(TransferScore(mse), {"sindy": diagnosed})
    assert score([*results, result([WIND], [], transfer=other)]).missing == {}
