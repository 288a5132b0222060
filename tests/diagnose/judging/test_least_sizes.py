"""Sizes that a log would not have shown: by noise, by what is worth a name, as vectors and shares, with sentences."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, inf
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging import Diagnosis
from ferryid.diagnose.judging.detection_power import DetectionPower
from ferryid.diagnose.judging.least_sizes import LeastSize, least_sizes
from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel
from ferryid.report import least_sizes as shown
from tests.diagnose.judging.test_detection_power import FERRY, NOTHING, linear

FORCE = 100.0
"""Root mean square of what is measured, in the unit of the stand-in's gaps."""


def candidate(effect: str, instance: str | None = None) -> Candidate:
    return Candidate(effects()[effect], instance, effects()[effect].parameters_of(FERRY))


def problem() -> EstimationProblem:
    """A trial whose gaps are the sums of the external forces along surge."""

    def gap(force_model: ForceModel) -> Any:
        return force_model.external[:, :1] + force_model.parts.sum(axis=1)[:, :1]

    made: Any = linear(0.1)
    windows = SimpleNamespace(gap=gap, measured=np.full((50, 1), FORCE), channels=np.array([True]))
    return cast(EstimationProblem, SimpleNamespace(**{**vars(made), "windows": windows}))


def least(effect: str, usual: list[float], multiple: float, instance: str | None = None) -> LeastSize:
    power = DetectionPower(candidate(effect, instance), 0.5, np.array(usual), multiple)
    (one,) = least_sizes(problem(), NOTHING, [power])
    return one


def test_a_push_that_noise_hides_is_the_length_of_its_vector() -> None:
    one = least("external_push", [300.0, 400.0, 10.0], 1.5)
    assert one.value == pytest.approx(1.5 * hypot(300.0, 400.0))
    assert one.unit == "N"
    assert one.says == "External push: below 750 N would not have been seen here."


def test_a_percentage_above_a_hundred_is_written_out() -> None:
    assert LeastSize("thruster_gain", "aft", 1.328, "-", "").text == "130 %"
    assert LeastSize("heading_bias", None, 0.0123, "deg", "").text == "0.012 deg"


def test_what_all_logs_of_a_campaign_show_is_not_among_what_was_not_found() -> None:
    # The log's own fit has no such candidate; the finding comes from all logs together.
    powers = [DetectionPower(candidate("external_push"), 0.5, np.array([300.0, 400.0, 10.0]), 1.5)]
    assert len(least_sizes(problem(), NOTHING, powers, {("wind", None)})) == 1
    assert least_sizes(problem(), NOTHING, powers, {("external_push", None)}) == ()


def test_what_hardly_moves_the_vessel_is_not_named_whatever_the_evidence() -> None:
    one = least("external_push", [30.0, 0.0, 0.0], 1e-3)
    assert one.value == pytest.approx(INFERENCE.void_share * FORCE)


def test_no_size_that_an_effect_may_have_is_enough() -> None:
    assert least("external_push", [300.0, 400.0, 10.0], inf).value is None
    assert least("external_push", [300.0, 400.0, 10.0], 1e4).text == "not at any size"


def test_a_terminal_has_a_line_on_the_largest_of_several_thrusters() -> None:
    sizes = (
        LeastSize("wind", None, 1.13, "m/s", ""),
        LeastSize("thruster_gain", "fore", 0.04, "-", ""),
        LeastSize("thruster_gain", "aft", None, "-", ""),
        *(LeastSize(f"other{k}", None, 0.1234, "-", "") for k in range(5)),
    )
    made = Diagnosis("log.bag", "boat", "matched", (), {}, {})
    assert shown.line(made) == ""
    made = replace(made, least_sizes=sizes)
    assert shown.line(made) == (
        "would not have been seen here: steady wind below 1.1 m/s, thruster force at any size, other0 below 12 %, other1 below "
        "12 %, other2 below 12 % (and 2 effects more in the report)"
    )
    assert shown.proof(made) == "ferryid prove --real log.bag --vessel PROFILE.toml --only wind"
    assert shown.proof_note(made) == ", with the file of the profile boat in the place of PROFILE.toml"
    assert shown.proof(replace(made, profile="boat")) == "ferryid prove --real log.bag --vessel boat --only wind"
    own = replace(made, path="sea trial/log.bag", profile="boats/vessel.toml")
    assert shown.proof(own) == "ferryid prove --real 'sea trial/log.bag' --vessel boats/vessel.toml --only wind"
    assert shown.proof_note(own) == ""
