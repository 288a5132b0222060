"""Comparisons that mean nothing are refused with the reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.compare.candidates import BASE, select_candidates
from ferryid.errors import FerryIdError
from ferryid.models.model import Model
from ferryid.models.scores import ForceScores, ModelScores
from ferryid.vessel import load_profile
from tests.export.models import fitted

ONE = replace(fitted("modulus", "decoupled", seed=1), version=1)
OTHER = replace(fitted("modulus", "decoupled", seed=2), version=2)


def with_profile(model: Model, old: str, new: str) -> Model:
    assert old in model.profile_text
    return replace(model, profile_text=model.profile_text.replace(old, new))


def test_the_base_model_comes_first_and_versions_name_the_others() -> None:
    field = select_candidates(["a", "b"], [ONE, OTHER])
    assert field.labels == (BASE, "milliampere@1", "milliampere@2")
    assert field.candidates[0].is_base
    assert field.profile.name == "milliampere"
    assert field.warnings == ()


def test_two_of_one_name_and_version_are_told_apart_by_how_they_were_asked_for() -> None:
    field = select_candidates(["x/1.json", "y/1.json"], [ONE, replace(OTHER, version=1)])
    assert field.labels[1:] == ("milliampere@1 (x/1.json)", "milliampere@1 (y/1.json)")


@pytest.mark.parametrize(
    ("models", "told"),
    [
        ([ONE], "two or more models are needed, found 1"),
        ([ONE, fitted("modulus", "decoupled", vessel="revolt")], "different vessels (milliampere, revolt)"),
        ([ONE, OTHER, replace(ONE, name="copy", version=7, created="later")], "0 and 2: the same model"),
        ([ONE, with_profile(OTHER, "2.39675290e-2", "2.5e-2")], "another thrust (thruster1"),
        ([ONE, with_profile(OTHER, 'topic = "/control/tau_d"', 'topic = "/tau"')], "read a log differently (tau_d)"),
    ],
)
def test_what_means_nothing_is_refused(models: list[Model], told: str) -> None:
    with pytest.raises(FerryIdError) as refused:
        select_candidates([str(k) for k in range(len(models))], models)
    assert told in str(refused.value)
    assert "Fix: " in str(refused.value)


def test_a_model_without_a_score_is_the_same_as_itself() -> None:
    # Each reading of the file gives a NaN of its own, and none equals another.
    without_sway = np.array([1.0, 0.0, 1.0])
    scores = [ModelScores(ForceScores.of(np.ones(3), np.ones(3), without_sway), 9, 9.0, "blocks", ()) for _ in range(2)]
    assert np.isnan(scores[0].force.r2_model[1])
    twice = [replace(ONE, scores=each) for each in scores]
    with pytest.raises(FerryIdError, match="0 and 1: the same model"):
        select_candidates(["0", "1"], twice)


def test_a_profile_that_is_given_measures_the_force_and_its_difference_is_told() -> None:
    profile = load_profile("milliampere")
    field = select_candidates(["a", "b"], [ONE, with_profile(OTHER, "2.39675290e-2", "2.5e-2")], profile)
    assert field.profile is profile
    (warning,) = field.warnings
    assert warning.startswith("milliampere@2 was fitted with another thrust (thruster1")
    with pytest.raises(FerryIdError, match="say nothing about gunnerus"):
        select_candidates(["a", "b"], [ONE, OTHER], load_profile("gunnerus"))


def test_remarks_and_moved_lines_of_a_profile_are_no_difference() -> None:
    assert (
        select_candidates(
            ["a", "b"], [ONE, replace(OTHER, profile_text="# a remark\n\n" + OTHER.profile_text)]
        ).warnings
        == ()
    )


def test_without_one_base_model_none_is_listed() -> None:
    field = select_candidates(["a", "b"], [ONE, with_profile(OTHER, "mass_kg = 1670.0", "mass_kg = 1700.0")])
    assert BASE not in field.labels
    assert "different base models" in field.warnings[0]
