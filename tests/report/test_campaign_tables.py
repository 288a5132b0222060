"""Tables of several logs: effects over logs, winds log by log beside withheld measurements, on page and terminal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose import UNKNOWN, Diagnosis, Estimate, Finding, Withheld
from ferryid.diagnose.judging.hidden_gain import HiddenGain
from ferryid.report import campaign
from ferryid.report.diagnosis_page import as_text, render
from tests.report.test_diagnosis import diagnosis, gain, wind


def flow(north: float, east: float, probability: float = 0.98) -> Finding:
    parameters = {
        "north": Estimate(north, north - 0.5, north + 0.5, "m/s"),
        "east": Estimate(east, east - 0.5, east + 0.5, "m/s"),
    }
    return replace(
        wind(),
        parameters=parameters,
        probability=probability,
        evidence={},
        labels={},
        says=f"A wind of {north}, {east} m/s.",
    )


def hidden(found: Finding | None, north: float, east: float) -> Withheld:
    sizes = {} if found is None else found.parameters
    return Withheld("wind", sizes, {"north": north, "east": east}, "The wind was hidden.")


def log(name: str, *findings: Finding, withheld: Withheld | None = None) -> Diagnosis:
    shown = (withheld,) if withheld else ()
    return replace(diagnosis("partly_explained", name), findings=findings, withheld=shown, notes=(), model=None)


def three() -> list[Diagnosis]:
    """Return winds of 1 m/s to the north, 2 m/s to the east, and one that is a hint; a weak thruster in the second log."""
    north, east, hint = flow(1.0, 0.0), flow(0.0, 2.0), flow(0.0, -1.0, 0.4)
    return [
        log("a", north, withheld=hidden(north, 2.0, 0.0)),
        log("b", gain(), east, withheld=hidden(east, 2.0, 2.0)),
        log("c", hint, withheld=hidden(hint, 0.0, -1.0)),
    ]


def test_an_effect_has_a_row_with_its_logs_and_its_size_over_those_that_are_sure() -> None:
    first, second = campaign.effect_rows(three())
    assert (first["name"], first["logs"]) == ("Steady wind", "2 of 3, perhaps 1 more")
    assert first["size"] == "north 0.0 to 1.0 m/s; east 0.0 to 2.0 m/s"
    assert first["probability"] == "0.40 to 0.98"
    assert second["logs"] == "1 of 3"
    only = campaign.effect_rows(three()[2:])
    assert [row["logs"] for row in only] == ["perhaps 1 of 1"]
    assert only[0]["size"] == "north 0.0 m/s (-0.5 to 0.5); east -1.0 m/s (-1.5 to -0.5)"


def test_a_wind_stands_beside_what_was_withheld() -> None:
    rows = campaign.flow_rows(three(), "wind")
    assert [row["found"] for row in rows] == [
        "1.00 m/s towards 0°",
        "2.00 m/s towards 90°",
        "1.00 m/s towards 270°",
    ]
    assert [row["measured"] for row in rows][1] == "2.83 m/s towards 45°"
    assert [row["off"] for row in rows] == ["0°", "45°", "0°"]
    assert campaign.flow_rows(three(), "current") == []


def test_what_was_withheld_is_summed_up() -> None:
    said = campaign.withheld_summary(three(), "wind")
    # Angles of 0, 45 and 0 degrees; strengths of 1/2, 1/√2 and 1; of the six components three lie within half a metre.
    assert "0 deg off; at 0.71 of its strength" in said
    assert "hold 4 of 6 components" in said
    gain = HiddenGain.of(np.full(20, 1.0), np.full(20, 4.0), 3)
    shown = [replace(one, withheld=tuple(replace(each, gain=gain) for each in one.withheld)) for one in three()]
    assert campaign.withheld_summary(shown, "wind").count("25 % of it") == 1
    none = [log("a", withheld=hidden(None, 1.0, 0.0))]
    assert campaign.withheld_summary(none, "wind").endswith("withheld from 1 log, and it was found in 0.")
    assert campaign.flow_rows(none, "wind")[0]["off"] == "–"
    assert campaign.withheld_summary([log("a", flow(1.0, 0.0))], "wind") == ""


@pytest.mark.parametrize("apart", [0.0, 30.0, 179.0, 180.0])
@pytest.mark.parametrize("towards", [10.0, 170.0, 350.0])
def test_an_angle_between_flows_is_the_smaller_one(apart: float, towards: float) -> None:
    there = np.deg2rad([towards, towards + apart])
    pair = flow(np.cos(there[0]), np.sin(there[0]))
    off = hidden(pair, 2.0 * np.cos(there[1]), 2.0 * np.sin(there[1])).off
    assert off == pytest.approx((apart, 0.5))


def test_a_calm_has_no_direction() -> None:
    assert hidden(flow(1.0, 0.0), 0.0, 0.0).off is None


def test_force_errors_are_medians_over_logs() -> None:
    every = []
    for share in (0.5, 0.7, 1.5):
        one = diagnosis("explained")
        every.append(replace(one, after={"mse": {axis: share * value for axis, value in one.before["mse"].items()}}))
    assert "surge 0.70 (0.50 to 1.50)" in campaign.error_sentence(every)
    assert campaign.error_sentence([replace(diagnosis("matched"), findings=())]) == ""


def test_a_terminal_shows_tables_within_its_width_and_leaves_each_log_to_the_page() -> None:
    long = replace(
        three()[0], log="a recording of a very long name, the first of three", repairs=("A step.", "Another.")
    )
    every = [long, *three()[1:]]
    text = as_text(every)
    assert max(len(line) for line in text.splitlines()) <= 100
    assert "a recording " in text
    assert "…" in text
    assert "2 repairs made while reading 1 log" in text
    assert "A wind of" not in text
    assert "\N{NO-BREAK SPACE}" not in text


def test_a_log_with_two_of_a_kind_counts_once() -> None:
    law, hint = (
        replace(gain(), effect=UNKNOWN, instance=None),
        replace(gain(), probability=0.4, effect=UNKNOWN, instance=None),
    )
    assert not hint.sure
    every = [log("a", law, hint), log("b", law, law), log("c", hint, hint)]
    assert [row["logs"] for row in campaign.effect_rows(every)] == ["2 of 3, perhaps 1 more"]
    assert [row["logs"] for row in campaign.effect_rows(every[:2])] == ["2 of 2"]
    assert [campaign.names_of(one) for one in every] == [
        "something without a name",
        "something without a name",
        "perhaps something without a name",
    ]


def test_what_all_logs_have_is_no_name_of_each() -> None:
    every = [log(name, gain(), *one) for name, one in (("a", [flow(1.0, 0.0)]), ("b", []))]
    common = (every[0].findings[0],)
    assert [campaign.names_of(one, common) for one in every] == [
        "steady wind, beside what all logs have",
        "only what all logs have",
    ]
    own = replace(every[0], findings=every[0].findings[1:])
    assert campaign.names_of(own, common) == "steady wind"
    assert campaign.names_of(replace(every[1], findings=()), common) == "–"
    assert campaign.names_of(every[1]) == "thruster force (thruster1)"


def test_a_log_that_could_not_be_used_has_its_reason_on_the_terminal() -> None:
    copy = replace(log("copy"), verdict="not_testable", notes=("It is the same recording.",))
    text = as_text([*three(), copy])
    assert "copy: It is the same recording." in text
    assert "with 1 note" not in text


@pytest.mark.slow
def test_the_page_draws_the_wind_of_each_log_once() -> None:
    page, drawings = render(three(), "trials")
    assert "all-wind" in drawings
    assert drawings["all-wind"].count("measured, withheld") == 1
    assert page.index("Steady wind of each log") < page.index("Log by log") < page.index('id="log-1"')
    assert campaign.flow_figure([log("a", withheld=hidden(None, 1.0, 0.0))], "wind") == ""
