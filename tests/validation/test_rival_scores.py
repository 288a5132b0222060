"""Rivals on the cases of the diagnosis: what counts as a name of theirs, and how they are scored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose import Estimate
from ferryid.errors import FerryIdError
from ferryid.signals.prepare import Prepared
from ferryid.validation.case import Case, Truth
from ferryid.validation.name_scores import Share
from ferryid.validation.recorded.scores import score_recorded
from ferryid.validation.records import RIVALS, CaseResult, Diagnosis, Finding, RivalDiagnoses, RivalName
from ferryid.validation.rival_scores import as_it_is, rival_scores
from ferryid.validation.rivals import naming, output_error
from ferryid.validation.rivals.learner import LearnedModel
from ferryid.vessel import load_profile
from tests.proof.__main__ import Part, _rivals
from tests.validation.two_logs import two_logs

FERRY = load_profile("milliampere")
LOSS = Truth("thruster_gain", "thruster1", {"factor": 0.8})
WEAKENS = 'thrusters = { faults = [{ thruster = "thruster1", factor = 0.6, from_s = 150.0 }] }\n'
SCALE = Truth("yaw_rate_scale", None, {"factor": 1.1})


def finding(effect: str, instance: str | None = None, **values: float) -> Finding:
    return Finding(effect, instance, 1.0, {name: Estimate(one, one, one, "-") for name, one in values.items()})


def case(
    name: str, truth: Truth | None, own: Finding | None, rivals: Mapping[str, Finding | None] | None
) -> CaseResult:
    made = Case(name, "cell", "clean" if truth is None else "single", "ferry", "log", "table", 1, 2, 0.1)
    made = replace(made, truths=() if truth is None else (truth,))
    evaluation = None
    if rivals is not None:
        evaluation = RivalDiagnoses(
            {key: Diagnosis("explained", 4.0, () if one is None else (one,)) for key, one in rivals.items()}
        )
    return CaseResult(made, {}, Diagnosis("explained", 2.0, () if own is None else (own,)), {RIVALS: evaluation})


def test_rivals_and_diagnosis_are_scored_on_the_same_cases() -> None:
    right, wrong = finding("thruster_gain", "thruster1", factor=0.78), finding("thruster_gain", "thruster2", factor=0.8)
    results = [
        case("0", LOSS, right, {"stepwise": wrong, "thesis": finding("payload")}),
        case("1", SCALE, None, {"stepwise": None, "thesis": None}),
        # One that no rival was given counts for none of them.
        case("2", LOSS, right, None),
    ]
    own, stepwise, thesis = rival_scores(results, as_it_is)
    assert (own.name, own.right, own.wrong, own.seconds) == ("diagnosed", Share(1, 2), Share(0, 2), 2.0)
    assert own.median_error == pytest.approx(0.1)
    assert (stepwise.right, stepwise.able, stepwise.wrong) == (Share(0, 2), Share(0, 1), Share(1, 2))
    assert (stepwise.median_error, stepwise.parameters) == (None, 0)
    assert "thruster_gain" in naming.NAMEABLE["output error"]
    assert not {"gusts", "yaw_rate_scale", "external_push"} & set(naming.NAMEABLE["output error"])
    # It has no term for a thruster, nor for a gyro.
    assert (thesis.able, thesis.wrong, thesis.seconds) == (Share(0, 0), Share(1, 2), 4.0)
    assert rival_scores(results[2:], as_it_is) == ()


def test_in_a_recording_counts_what_the_recording_as_it_was_does_not_show() -> None:
    right, always = finding("thruster_gain", "thruster1", factor=0.8), finding("payload")
    results = [
        case("0", None, None, {"stepwise": always, "output error": right}),
        case("1", LOSS, right, {"stepwise": always, "output error": right}),
    ]
    own, stepwise, output = score_recorded(results, ()).rivals
    assert own.right == Share(1, 1)
    assert (stepwise.right, stepwise.wrong) == (Share(0, 1), Share(0, 2))
    assert (output.right, output.wrong) == (Share(0, 1), Share(0, 2))


def test_the_page_has_a_row_for_each_method() -> None:
    results = [case("0", LOSS, finding("thruster_gain", "thruster1", factor=0.78), {"stepwise": None})]
    part = Part("simulated", {}, "", {}, rival_scores(results, as_it_is))
    lines = _rivals([part])
    assert [line.split("|")[2].strip() for line in lines[2:]] == ["ferryid", "stepwise"]
    assert "| 10 % of 1 |" in lines[2]
    assert _rivals([replace(part, rivals=())]) == []


def test_a_chosen_term_names_its_effect_with_the_size_of_its_coefficient(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(prepared: Prepared) -> None:
        raise AssertionError

    def learn(log: str, profile: object, out: Path) -> LearnedModel:
        names = (
            RivalName("thruster_gain", "thruster1", 0.5, ("thruster_gain thruster1 factor from 300 s",)),
            RivalName("payload", None, 0.2, ("mass aboard",)),
            RivalName("constant in surge", None, 0.1, ("constant in surge",)),
        )
        coefficients = {"thruster_gain thruster1 factor from 300 s": -1.5, "mass aboard": 0.5, "constant in surge": 9.0}
        return LearnedModel("stepwise", nothing, names, coefficients)  # type: ignore[arg-type]

    loss, load = naming._of_sparse(learn, "log", FERRY, Path("out"))
    assert (loss.key, loss.onset) == (("thruster_gain", "thruster1"), 300.0)
    assert loss.parameters["factor"].value == pytest.approx(1.0 - 1.5 * 0.2)
    assert (load.key, load.onset) == (("payload", None), None)
    assert load.parameters["mass"].value > 0.0

    def refusing(log: str, profile: object, out: Path) -> tuple[Finding, ...]:
        raise FerryIdError("too short. Fix: record more")

    monkeypatch.setattr(naming, "NAMERS", {"stepwise": refusing, "thesis": lambda *_: (finding("fouling"),)})
    found = naming.diagnoses("log", FERRY, Path("out")).methods
    assert (found["stepwise"].verdict, found["stepwise"].error) == ("refused", "too short. Fix: record more")
    assert found["thesis"].findings[0].effect == "fouling"


@pytest.mark.slow
def test_output_error_names_a_thruster_that_weakens_with_its_factor(tmp_path: Path) -> None:
    # One that is weak all along is less drag to it: it fits a hull without a prior.
    first = output_error.diagnose(two_logs(tmp_path, WEAKENS)[0], FERRY, tmp_path)[0]
    assert first.key == ("thruster_gain", "thruster1")
    assert first.onset is not None
    assert first.parameters["factor"].value == pytest.approx(0.6, abs=0.06)
    assert np.isfinite([first.parameters["factor"].low, first.parameters["factor"].high]).all()
