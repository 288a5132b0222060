"""Figures of merit, worked by hand from a few lines."""

from __future__ import annotations

import json
import subprocess
import sys
from math import inf, isnan
from typing import Any

import pytest

from ferryid.effects import effects
from ferryid.effects.shallow_water import HEAVIER
from ferryid.effects.wind import COEFFICIENTS
from ferryid.prove.case import Case, Truth
from ferryid.prove.names import (
    NONE,
    OTHER,
    REFUSED,
    UNKNOWN,
    Share,
    confusion,
    false_names,
    first_name,
    hints_of_nothing,
    instead,
    names,
    strictly_wrong,
    wrong,
)
from ferryid.prove.recovery import FACTORS, SIDES, neutral, recoveries
from ferryid.prove.score import detections, score, to_json
from ferryid.prove.second_log import claimed, claims, median_interval, methods
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
) -> dict[str, Any]:
    parameters = {
        name: {"value": value, "low": value - half, "high": value + half, "unit": ""}
        for name, value in (values or {}).items()
    }
    return {
        "effect": effect,
        "instance": instance,
        "probability": p,
        "parameters": parameters,
        "improvement": {},
        "onset": None,
        "offset": None,
        "unresolved_with": [],
        "rivals": [],
        **more,
    }


def line(
    truths: list[Truth],
    findings: list[dict[str, Any]],
    cell: str = "wind",
    kind: str = "single",
    allowed: tuple[str, ...] = (),
    level: int | None = None,
    size: float = 0.0,
    **more: Any,
) -> dict[str, Any]:
    case = Case("1", cell, kind, "ferry", "square", "mcap", 1, level, size, tuple(truths), allowed)
    told = {"verdict": "explained", "findings": findings, "notes": []}
    return {"case": case.as_json(), "told": told, "seconds": 2.0, **more}


def test_what_is_named_is_right_wrong_or_one_of_what_cannot_be_told_apart() -> None:
    wind = finding("wind", {"north": 3.0, "east": 4.0})
    refused = line([WIND], [])
    refused["told"] = {"verdict": "refused", "error": "trial.mcap: nothing in it"}
    lines = {
        "right": line([WIND], [wind]),
        "second": line([WIND], [finding("current"), wind]),
        "apart": line([WIND], [finding("current", unresolved_with=["wind"])]),
        "doubted": line([WIND], [finding("current", p=0.5)]),
        "allowed": line([WIND], [finding("gusts")], allowed=("gusts",)),
        "thruster": line([WEAK], [finding("thruster_gain", instance="thruster2")], cell="thruster_gain"),
        "unknown": line([], [finding("unknown")], cell="wake", kind="outside"),
        "clean": line([], [finding("wind", p=0.51)], cell="clean", kind="clean"),
        "refused": refused,
    }
    assert {name for name, one in lines.items() if wrong(one)} == {"second", "thruster", "clean"}
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
    made = confusion([*lines.values(), line([WIND, WEAK], [wind], cell="pair", kind="pair")])
    assert made.rows == ("wind", "thruster_gain", "wake", "clean")
    assert made.columns == ("current", "gusts", "wind", OTHER, UNKNOWN, NONE, REFUSED)
    assert made.counts == ((2, 1, 1, 0, 0, 1, 1), (0, 0, 0, 1, 0, 0, 0), (0, 0, 0, 0, 1, 0, 0), (0, 0, 1, 0, 0, 0, 0))
    first = score(list(lines.values())).cells[0]
    assert (first.first, first.every, first.false, first.refused) == (Share(1, 6), Share(2, 6), Share(1, 6), 1)


def test_a_hull_is_right_only_in_a_coefficient_that_is_wrong() -> None:
    hull = Truth("hull_parameters", None, {"N_r": 1.3, "m22": 0.8})

    def told(**values: float) -> dict[str, Any]:
        found = finding("hull_parameters", {name.replace("Y_rv", "Y_|r|v"): one for name, one in values.items()})
        return line([hull], [found], cell="hull_parameters", allowed=("hull_parameters",))

    right, beside = told(Y_rv=0.3, N_r=1.2), told(Y_rv=0.3)
    assert (names(right), first_name(right)) == ([("hull_parameters", None)], "hull_parameters")
    assert (names(beside), first_name(beside)) == ([("hull_parameters", "other coefficients")], OTHER)
    assert (wrong(beside), len(strictly_wrong(beside)), strictly_wrong(right)) == ([], 1, [])
    assert [one.found for one in recoveries([beside])] == [0]
    assert [one.found for one in recoveries([right])] == [1, 1]
    # Where no hull is concealed, it is an exception that is counted without.
    clean = line([], [finding("hull_parameters", {"N_r": 1.2})], "clean", "clean", allowed=("hull_parameters",))
    assert (names(clean), wrong(clean)) == ([("hull_parameters", None)], [])
    assert score([right, beside, clean]).strict == Share(2, 3)


def test_hints_of_what_is_not_there_are_counted() -> None:
    doubtful = [finding(name, p=0.5) for name in ("wind", "current", "unknown")]
    assert hints_of_nothing(line([WIND], doubtful)) == [("current", None)]
    assert score([line([WIND], doubtful), line([WIND], doubtful[:1])]).hinted == Share(1, 2)


def test_errors_are_those_of_vectors_and_intervals_those_of_parameters() -> None:
    lines = [
        # A vector of 5 that is off by 0.4, with one component outside of its interval.
        line([WIND], [finding("wind", {"north": 3.24, "east": 4.32}, 0.3)]),
        # A factor of 0.81 for one of 0.8 is 5 % of the 0.2 that are lost; 4 s late, with an interval that ends after 3.
        line(
            [WEAK],
            [finding("thruster_gain", {"factor": 0.81, "onset": 304.0}, 3.0, "thruster1", onset=304.0)],
        ),
        # Named, but not since when.
        line([WEAK], [finding("thruster_gain", {"factor": 0.8}, 0.01, "thruster1")]),
        # Doubtful, and of the wrong thruster: neither is a measurement of the truth.
        line([WIND], [finding("wind", {"north": 9.0, "east": 9.0}, p=0.4)]),
        line([WEAK], [finding("thruster_gain", {"factor": 0.1}, instance="thruster2")]),
    ]
    everything, gain, wind = recoveries(lines)
    assert (everything.effect, gain.effect, wind.effect) == ("all", "thruster_gain", "wind")
    assert (everything.found, gain.found, wind.found) == (3, 2, 1)
    assert wind.errors == pytest.approx((0.08,))
    assert wind.reaches == pytest.approx((0.24 / 0.3, 0.32 / 0.3))
    assert wind.covered == Share(1, 2)
    assert gain.errors == pytest.approx((0.05, 0.0))
    assert gain.times_s == (4.0, inf)
    assert (gain.in_time, gain.times_held) == (Share(1, 2), Share(0, 2))
    assert everything.median_error == pytest.approx(0.05)
    assert everything.within == Share(3, 3)


def test_a_disturbance_is_measured_by_what_it_did() -> None:
    gusts = Truth("gusts", None, {"std": 1.0, "time_constant": 8.0})
    told = finding("gusts", {"std": 1.32, "time_constant": 9.0})
    acted = {"gusts": {"std": 1.2, "time_constant": 10.0}}
    assert recoveries([line([gusts], [told], acted=acted)])[0].errors == pytest.approx((0.1, 0.1))


def test_places_on_the_chart_have_intervals_but_no_relative_error() -> None:
    shoal = Truth("shallow_water", None, {"factor": 1.5, "north": 10.0, "east": 2.0})
    found = recoveries([line([shoal], [finding("shallow_water", {"factor": 1.45, "north": 10.05, "east": 9.0})])])[0]
    assert found.errors == pytest.approx((0.1,))
    assert found.covered == Share(2, 3)


def test_what_changes_nothing_is_what_the_library_says() -> None:
    profile = load_profile("milliampere")
    never_told = {*COEFFICIENTS, HEAVIER.name}
    for effect in effects().values():
        for one in effect.parameters_of(profile):
            if one.name not in SIDES.get(effect.id, ()) and one.name not in never_told:
                assert neutral(effect.id) == one.neutral, (effect.id, one.name)
    assert {one for one in FACTORS if one not in effects()} == {"yaw_rate_scale", "velocity_scale"}


def test_claims_are_held_against_a_second_log() -> None:
    def judged(surge: float) -> dict[str, Any]:
        return {
            "base": {"position_m": 4.0},
            "diagnosed": {"mse": {"surge": surge, "sway": 1.0, "yaw": 1.0}, "position_m": 1.0, "base_position_m": 2.0},
            "sindy": {"mse": {"surge": 2.0, "sway": 1.0, "yaw": 1.0}, "position_m": 8.0},
            "thesis": None,
        }

    one = finding("wind", improvement={"surge": 0.5, "sway": 0.2, "yaw": 0.0})
    two = finding("fouling", improvement={"surge": 0.4, "sway": 0.0, "yaw": 0.0})
    both = line([WIND], [one, two], second=judged(0.35), rival_names={"sindy": ["current"], "stepwise": ["wind"]})
    # Each removes its share of what the other leaves: 1 - 0.5 * 0.6.
    assert claimed(both) == pytest.approx({"surge": 0.7, "sway": 0.2, "yaw": 0.0})
    whole = line([WIND], [one], second=judged(0.9))
    whole["told"]["after"] = {
        "ratio": {axis: {"value": 0.4, "low": 0.3, "high": 0.5} for axis in ("surge", "sway", "yaw")}
    }
    assert claimed(whole)["surge"] == pytest.approx(0.6)
    hint = line(
        [WIND], [finding("wind", p=0.3, improvement={"surge": 0.9, "sway": 0.0, "yaw": 0.0})], second=judged(0.1)
    )
    alone = line([WIND], [one])
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
    # A log of which no rival was asked counts in no row.
    unasked = judged(0.01)
    del unasked["sindy"], unasked["thesis"]
    assert methods([both, whole, line([WIND], [one], second=unasked)]) == methods([both, whole])


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


def oracle(gain: float, effect: str = "wind", floor: float = 4.6) -> dict[str, Any]:
    return {
        "seconds": 1.0,
        "recovered": [{"effect": effect, "instance": None, "gain": gain, "floor": floor, "named": gain > floor}],
    }


def curve_lines() -> list[dict[str, Any]]:
    """Return 20 clean logs, and five sizes of a wind four times: named from 2 on, by an oracle from 1 on."""
    wind = finding("wind", {"north": 3.0, "east": 4.0})
    clean = [line([], [], "clean", "clean", oracle=oracle(0.2 * k)) for k in range(20)]
    sizes = (0.25, 0.5, 1.0, 2.0, 4.0)
    return clean + [
        line([WIND], [wind] if size >= 2.0 else [], level=k, size=size, oracle=oracle(8.0 * size**2))
        for k, size in enumerate(sizes)
        for _ in range(4)
    ]


def test_detection_curves_of_a_diagnosis_and_of_its_oracle() -> None:
    lines = curve_lines()
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
    (without,) = detections([{**one, "oracle": None} for one in lines], {})
    assert (without.oracle, without.ratio) == (None, None)


def test_what_became_of_what_the_oracle_alone_named() -> None:
    weak = line([WEAK], [finding("wind")], "thruster_gain")
    key = ("thruster_gain", "thruster1")
    assert instead(line([WIND], []), ("wind", None)) == "none"
    assert instead(line([WIND], [finding("unknown")]), ("wind", None)) == "unknown"
    assert instead(line([WIND], [finding("wind", p=0.5), finding("current")]), ("wind", None)) == "a hint"
    assert instead(weak, key) == "taken for wind"
    weak["told"] = {
        **weak["told"],
        "notes": ["Thruster force (thruster1) was suspected, but dropped: a law explains more."],
    }
    assert instead(weak, key) == "dropped"
    assert instead(weak, ("thruster_gain", "thruster2")) == "taken for wind"
    (lost,) = (one.instead for one in score(curve_lines()).detections)
    assert lost == {"none": 4}
    small = [
        {
            **one,
            "oracle": {**one["oracle"], "recovered": [{**each, "idle": True} for each in one["oracle"]["recovered"]]},
        }
        for one in curve_lines()
    ]
    (lost,) = (one.instead for one in score(small).detections)
    assert lost == {"too small to be worth a name": 4}


def test_the_size_of_a_cell_is_that_of_what_it_is_called_after() -> None:
    gusts = Truth("gusts", None, {"std": 1.0, "time_constant": 8.0})
    wind = finding("wind", {"north": 3.0, "east": 4.0})
    lines = [line([WIND, gusts], [wind], cell="gusts", level=k, size=1.0 + k) for k in range(5)]
    assert detections(lines, {})[0].blind.named == 0


def test_scores_are_plain_data() -> None:
    scores = score(curve_lines())
    plain = json.loads(json.dumps(to_json(scores), allow_nan=False))
    assert plain["runs"] == 40
    assert plain["false_names"]["clean"]["interval"][0] == 0.0
    assert plain["detections"][0]["blind"]["says"] == scores.detections[0].blind.says
    assert plain["seconds"] == [2.0, 2.0]
    assert plain["recoveries"][0]["covered"]["of"] == 16
    # Nothing was held against a second log: no number, rather than one that no reader of JSON knows.
    assert plain["claims"][0]["claimed"] is None


def test_scores_of_nothing_are_no_error() -> None:
    empty = score([])
    assert empty.runs == 0
    json.dumps(to_json(empty), allow_nan=False)


def test_the_proof_draws_nothing() -> None:
    code = "import sys, ferryid.prove.oracle, ferryid.prove.score; print('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_a_rival_that_is_not_installed_is_told_and_not_counted() -> None:
    errors = {"surge": 0.5, "sway": 0.6, "yaw": 0.7}
    none = {"mse": dict.fromkeys(errors), "position_m": None, "base_position_m": 4.0, "why": "pysindy is not installed"}
    second = {
        "base": {"mse": errors},
        "diagnosed": {"mse": errors, "position_m": 1.0, "base_position_m": 4.0},
        "sindy": none,
        "stepwise": {"mse": errors, "position_m": 2.0, "base_position_m": 4.0},
    }
    scores = score([line([WIND], [], second=second)])
    assert [(one.name, one.logs) for one in scores.methods] == [("diagnosed", 1), ("stepwise", 1)]
    assert scores.missing == {"sindy": "pysindy is not installed"}
    # Once it could be asked, it was there.
    assert (
        score([line([WIND], [], second=second), line([WIND], [], second={"sindy": second["diagnosed"]})]).missing == {}
    )
