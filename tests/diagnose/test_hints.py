"""Reasons that make a hint of a finding, one by one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ferryid.diagnose.hints import about_nothing, beside_gusts, beside_more, on_a_guessed_hull
from ferryid.diagnose.result import Finding


def found(effect: str, **improvement: float) -> Finding:
    """A finding that is sure, and removes so much of the squared error on some axes."""
    return Finding(
        effect=effect,
        instance="thruster1" if effect == "thruster_gain" else None,
        probability=0.99,
        parameters={},
        axes={},
        intervals=(),
        onset_s=None,
        regime="",
        improvement=improvement,
        held_out=True,
        rivals=(),
        unresolved_with=("current",),
        separating_manoeuvre="a slow turn",
        says="",
    )


def test_a_force_is_a_hint_where_only_the_log_itself_tells_of_the_hull() -> None:
    wind = found("wind", sway=0.4)
    hint = on_a_guessed_hull(wind)
    assert hint.probability == 0.5
    assert hint.unresolved_with == ("current", "hull_parameters")
    assert "to fit a hull model first" in str(hint.separating_manoeuvre)
    assert on_a_guessed_hull(replace(wind, probability=0.2)).probability == 0.2
    assert on_a_guessed_hull(hint) == hint


@pytest.mark.parametrize(("effect", "sure"), [("thruster_lag", False), ("time_delay", False), ("payload", True)])
def test_what_a_controllers_answer_looks_like_is_a_hint_beside_gusts(effect: str, sure: bool) -> None:
    one = beside_gusts(found(effect, yaw=0.3), {(effect, None): {"surge": 0.1, "yaw": 0.3}})
    assert one.sure == sure
    assert ("gusts" in one.unresolved_with) != sure
    # Of a sensor, nothing is removed.
    assert beside_gusts(found(effect), {}).sure == sure
    assert beside_gusts(found(effect, yaw=0.8), {(effect, None): {"surge": 0.1, "yaw": 0.8}}).sure


def test_what_explains_less_than_is_left_without_a_name_is_a_hint() -> None:
    several = [found("wind", sway=0.1), found("thruster_gain", yaw=0.14)]
    removed = {("wind", None): {"surge": 0.0, "sway": 0.62}, ("thruster_gain", "thruster1"): {"sway": 0.0, "yaw": 0.14}}
    everything = {"surge": 1.0, "sway": 1.0, "yaw": 1.0}
    findings, notes = beside_more(several, removed, everything)
    assert [one.sure for one in findings] == [True, False]
    assert findings[1].separating_manoeuvre == "a slow turn"
    (note,) = notes
    assert "Thruster force (thruster1)" in note
    assert "wind" not in note
    # Of what it leaves, a law is a tenth: it explains more. Nor is one its stand-in that acts elsewhere.
    for law in ({"yaw": 0.1}, {"sway": 0.9, "yaw": 0.0}):
        assert all(one.sure for one in beside_more(several, removed, law)[0])
    assert not beside_more(several, removed, {"yaw": 0.2})[0][1].sure
    assert beside_more(several, removed, {}) == (several, ())


def test_what_removes_hardly_anything_of_the_error_is_a_hint() -> None:
    several = [found("wind", sway=0.1), found("thruster_gain", yaw=0.09)]
    removed = {
        ("wind", None): {"surge": -0.2, "sway": 0.1},
        ("thruster_gain", "thruster1"): {"sway": 0.02, "yaw": 0.09},
    }
    for left in ({}, {"surge": 0.05}):
        findings, notes = beside_more(several, removed, left)
        assert [one.sure for one in findings] == [True, False]
        (note,) = notes
        assert note == (
            "On no axis does any of these remove 10 % of the error while it acts: Thruster force (thruster1). Take them as "
            "hints, of probability 0.5 at most."
        )


def test_gusts_about_a_wind_that_is_not_told_are_a_hint() -> None:
    both = [found("gusts"), found("waves")]
    assert [one.sure for one in about_nothing(both, [found("wind", sway=0.6)])] == [True, True]
    assert [one.sure for one in about_nothing(both, [replace(found("wind"), probability=0.4)])] == [False, True]
    assert [one.sure for one in about_nothing(both, [])] == [False, True]


def test_what_was_judged_by_no_force_is_left_alone() -> None:
    # Gusts are states of the filter, and remove nothing of the error.
    assert beside_more([found("gusts")], {}, {"sway": 1.0}) == ([found("gusts")], ())
    assert beside_more([found("wind", sway=0.1)], {("wind", None): {"sway": 0.6}}, {"sway": 1.0})[1] == ()
