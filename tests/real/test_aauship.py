"""The section on AAUSHIP's folder, without the recordings where possible."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.real import aauship
from tests.real.aauship import Made, aims, reason

PLACE = "Left out of the campaign: boat.bag: position is needed by the profile, found no topic "


@pytest.mark.parametrize(
    ("note", "short"),
    [
        (f'{PLACE}"/gps1". The log has /imu.', "no /gps1"),
        ("a.bag is no recording of a vessel: each step.", "simulated, or reckoned, and not measured"),
        (
            "Left out of the campaign: a.bag: it is simulated among recorded logs, so.",
            "simulated, or reckoned, and not measured",
        ),
        ("Left out of the campaign: a: log shorter than the smoothing window.", "too short"),
        ("Current of each log, estimated with one hull.", ""),
    ],
)
def test_notes_give_the_reason_in_short(note: str, short: str) -> None:
    assert reason(note) == short


def finding(effect: str, probability: float) -> dict[str, object]:
    return {"effect": effect, "probability": probability}


def test_a_name_that_nothing_defends_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    logs = ["/x/a.bag", "/x/b.bag"]
    monkeypatch.setattr(aauship, "witnessed", lambda effect, path: "the gyro" if effect == "heading_wrap" else "")
    wrap = Made(3.0, [{"log": "a", "findings": [finding("heading_wrap", 0.9), finding("waves", 0.5)]}], [])
    first, second = aims({"one": wrap}, logs)
    assert first.endswith("| heading_wrap in a: the gyro | reached |")
    assert second.endswith("| 3 s | reached |")
    waves = Made(500.0, [{"log": "b", "findings": [finding("waves", 0.51)]}], [])
    first, second = aims({"one": wrap, "two": waves}, logs)
    assert first.endswith("| without one: waves in b | **missed** |")
    assert second.endswith("**missed** |")
    # What is said of a log that the tool holds to be simulated is the simulator's.
    simulated = Made(3.0, waves.logs, ["/x/b.bag is no recording of a vessel: so."])
    assert aims({"two": simulated}, logs)[0].endswith("| nothing named | reached |")
    left_out = (
        f'{PLACE}"/gps1". The log has /imu.',
        "Left out of the campaign: /x/quay.bag: the vessel keeps its way.",
    )
    together = Made(3.0, waves.logs, ["Each of the 9 logs is no recording of a vessel: so.", *left_out])
    assert aims({"two": together}, logs)[0].endswith("| nothing named | reached |")
    # One that is left out for what it says is one of them; one that cannot be read is not.
    assert together.refused(["boat", "b", "quay"]) == {aauship.SIMULATED: ["b", "quay"], "no /gps1": ["boat"]}


def test_the_gyro_of_the_boat_does_not_turn_where_the_heading_steps(shared_data: Callable[[str], Path]) -> None:
    steps, gyro = aauship.turned(str(shared_data("aauship/aauship_control_2017-05-24-16-52-19.bag")))
    assert len(steps) == 3
    assert max(map(abs, steps)) > 100.0
    assert max(map(abs, gyro)) < 10.0
