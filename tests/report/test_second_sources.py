"""Other instruments and repairs on the page, on a terminal and as JSON."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.second_sources import Comparison, Difference, SecondSources, Witness
from ferryid.diagnose.second_sources.candidates import Candidate
from ferryid.report.diagnosis_page import as_text, render
from ferryid.report.diagnosis_report import report
from ferryid.report.second_sources import lines
from tests.report.test_diagnosis import conforms, diagnosis

PLACE = Difference(
    "place",
    {"x": Estimate(2.1, 2.0, 2.2, "m"), "y": Estimate(-0.3, -0.4, -0.2, "m")},
    "2.10 ± 0.10 m ahead and 0.30 ± 0.10 m to port",
)


def compared(topic: str, kind: str, *differences: Difference, follows: bool = True) -> Comparison:
    return Comparison(
        Candidate(topic, ("x", "y"), kind), kind, "north, east", "", 0.97, 0.069, "m", differences, 2, 233, "receive",
        follows=follows,
    )  # fmt: skip


WITNESS = Witness("yaw rate", "scale", "", ("/a", "/b"), "The mapped yaw rate disagrees with two others.")
FOUND = SecondSources(
    (
        compared("/nav/pose", "position", PLACE),
        compared("/nav/estimate", "position", PLACE),
        compared("/ins", "velocity"),
        compared("/old", "heading", follows=False),
    ),
    (WITNESS,),
    {"never changes": 1},
    {"/nav/pose": 0, "/nav/estimate": 0},
)
SPIKES = "psi: 51 of 17701 samples were interpolated the wrong way round; removed."


@pytest.mark.slow
@pytest.mark.blank
def test_the_page_lists_instruments_and_repairs() -> None:
    page, _ = render((replace(diagnosis("explained"), sources=FOUND, repairs=(SPIKES,)),), "trial")
    for shown in ("Other instruments in the log", PLACE.says, "/nav/pose x, y", "0.069 m", WITNESS.says, SPIKES):
        assert shown in page
    assert "233 overlapping windows of 2 logs, receive times" in page
    assert "does not follow the mapped signal (97 %" in page
    assert "Passed over: 1 signal (never changes)." in page


def test_without_other_topics_and_repairs_nothing_is_shown() -> None:
    page, _ = render((diagnosis("matched"),), "trial")
    assert "Other instruments" not in page
    assert "Repaired while reading" not in page
    assert "instrument" not in as_text((diagnosis("matched"),))


def test_a_terminal_has_one_line_for_each_sender_and_kind() -> None:
    shown = lines(FOUND)
    assert shown[0] == f"instrument: {WITNESS.says}"
    assert sum("2.10" in line for line in shown) == 1
    assert shown[-1] == "instrument: 1 other signal agrees with the mapped ones."
    assert len(lines(replace(FOUND, compared=tuple(compared(f"/{k}", "position", PLACE) for k in range(9))))) == 5


@pytest.mark.slow
@pytest.mark.blank
def test_of_a_campaign_instruments_stand_once(tmp_path: Path) -> None:
    pair = tuple(replace(diagnosis("explained"), log=name, sources=FOUND) for name in ("one", "two"))
    assert render(pair, "trial")[0].count("Other instruments in the log") == 1
    assert as_text(pair).count(WITNESS.says) == 1
    plain = report(pair, tmp_path).json
    conforms(plain)
    assert plain["second_sources"]["odd_ones"][0]["agreeing"] == ["/a", "/b"]
    assert all("second_sources" not in one for one in plain["logs"])


@pytest.mark.slow
@pytest.mark.blank
def test_json_has_instruments_and_repairs(tmp_path: Path) -> None:
    plain = report((replace(diagnosis("explained"), sources=FOUND, repairs=(SPIKES,)),), tmp_path).json
    conforms(plain)
    assert plain["repairs"] == [SPIKES]
    first = plain["second_sources"]["compared"][0]
    assert (first["topic"], first["seems"], first["agrees"], first["sender"]) == ("/nav/pose", "position", False, 0)
    assert first["differences"][0]["parameters"]["x"] == {"value": 2.1, "low": 2.0, "high": 2.2, "unit": "m"}
