"""What is said of logs that are no recordings, and of the sensors of logs of which a foreign one was parted."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import pytest

from ferryid.diagnose import gathering
from ferryid.diagnose.gathering import Group, sort_out, with_own_sensors
from ferryid.diagnose.inference.stages import AveragedLog


def stand_in(path: str, sensors: str = "alone") -> AveragedLog:
    return cast(AveragedLog, SimpleNamespace(path=path, sensors=sensors))


def test_sensors_are_pooled_over_the_logs_of_one_vessel(monkeypatch: pytest.MonkeyPatch) -> None:
    def pooled(logs: Sequence[Any]) -> tuple[AveragedLog, ...]:
        assert {one.sensors for one in logs} == {"alone"}
        return tuple(stand_in(one.path, f"of {len(logs)}") for one in logs)

    monkeypatch.setattr(gathering, "with_common_sensors", pooled)
    unpooled = {name: stand_in(name) for name in ("a", "b", "foreign", "reference")}
    every = pooled(list(unpooled.values()))
    whole = Group(every[:3], every[3:])
    assert with_own_sensors(whole, unpooled) is whole
    found: Any = with_own_sensors(Group(every[:2], every[3:], ("note",)), unpooled)
    assert [(one.path, one.sensors) for one in found.logs] == [("a", "of 3"), ("b", "of 3")]
    assert [(one.path, one.sensors) for one in found.references] == [("reference", "of 3")]
    assert found.notes == ("note",)


def test_logs_that_are_no_recordings_for_one_reason_are_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    reasons = dict.fromkeys("abc", "it has no noise")
    monkeypatch.setattr(gathering, "_simulated", lambda one: reasons[one.path])
    logs = [stand_in(name) for name in reasons]
    kept, notes = sort_out(logs, "campaign")
    assert kept == logs
    assert notes == [
        "Each of the 3 logs is no recording of a vessel: it has no noise. What is found in them belongs to whatever made "
        "them, and not to a vessel."
    ]
    reasons["c"] = "its topic /gazebo holds messages of a simulator"
    assert [one.partition(" is no")[0] for one in sort_out(logs, "campaign")[1]] == ["a", "b", "c"]
