"""Sizes on the console: said of one recording, effect by effect, with what was missed."""

from __future__ import annotations

from typing import Any

from ferryid.validation.recorded.summary import size_lines


def response(effect: str, named: dict[float, bool], recording: str = "trial") -> dict[str, Any]:
    return {"effect": effect, "recording": recording, "sizes": list(named), "named": list(named.values())}


def test_sizes_are_said_from_the_largest_miss_on() -> None:
    one = response("wind", {0.4: True, 3.5: True, 0.9: False, 1.7: True})
    assert size_lines([one]) == ["  wind: named from 1.7 m/s on; 3 of 4 sizes from 0.4 to 3.5 m/s named"]


def test_what_is_missed_at_the_largest_size_or_there_before_says_so() -> None:
    missed, before = response("wind", {0.4: True, 3.5: False}), response("payload", {})
    assert size_lines([missed, before]) == [
        "  wind: not named at the largest size; 1 of 2 sizes from 0.4 to 3.5 m/s named",
        "  payload: the recording as it was has this name",
    ]


def test_several_recordings_have_a_page_instead() -> None:
    assert size_lines([response("wind", {1.0: True}), response("wind", {1.0: True}, "other")]) == []
    assert size_lines([]) == []
