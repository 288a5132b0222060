"""A campaign on page, terminal and in JSON: what all logs share stands once, what is one log's stays with it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.judging.diagnosis import Diagnosis, Withheld
from ferryid.diagnose.judging.finding import Estimate
from ferryid.diagnose.judging.hidden_gain import HiddenGain
from ferryid.diagnose.judging.hidden_signal import with_gains
from ferryid.effects.wording import MEANS_LITTLE
from ferryid.report.campaign import _sizes
from ferryid.report.diagnosis_page import as_text, render
from ferryid.report.diagnosis_report import as_json, report
from ferryid.report.diagnosis_timeline import timelines
from ferryid.report.diagnosis_words import estimate, notes_of, numbers_of, title
from tests.report.test_diagnosis import conforms, diagnosis, gain, wind

SHARED = "thruster1 gives 85 % of the force that its speed promises."


def campaign() -> list[Diagnosis]:
    """Return two logs of one weak thruster, each with a figure of a wind in the same words."""
    weak = replace(gain(), onset_s=None, evidence={"t": gain().evidence["t"]}, labels={})
    return [replace(diagnosis("partly_explained", log), findings=(wind(), weak)) for log in ("first", "second")]


@pytest.mark.slow
def test_what_all_logs_share_stands_once(tmp_path: Path) -> None:
    made = report(campaign(), tmp_path)
    text, page = as_text(campaign()), made.report.read_text(encoding="utf-8")
    assert text.count(SHARED) == page.count(SHARED) == 1
    assert text.index("In all logs:") < text.index(SHARED) < text.index("\nfirst ")
    assert page.index("<h2>In all logs</h2>") < page.index(SHARED) < page.index('id="log-1"')
    data = json.loads((made.report.parent / "diagnosis.json").read_text(encoding="utf-8"))
    conforms(data)
    assert [(one["effect"], one["log"]) for one in data["findings"]] == [
        ("thruster_gain", None),
        ("wind", "first"),
        ("wind", "second"),
    ]
    # The diagnosis of each log is whole.
    assert [len(one["findings"]) for one in data["logs"]] == [2, 2]


@pytest.mark.slow
@pytest.mark.blank
def test_what_has_a_figure_stays_with_its_log(tmp_path: Path) -> None:
    made = report(campaign(), tmp_path)
    assert made.report.read_text(encoding="utf-8").count(wind().says) == 2
    for log in (1, 2):
        assert (made.report.parent / f"{log}-finding-1-evidence.svg").exists()


@pytest.mark.slow
@pytest.mark.blank
def test_the_model_of_all_logs_stands_once(tmp_path: Path) -> None:
    several = [replace(one, model=str(tmp_path / "models" / "ferry" / "3.json")) for one in campaign()]
    text = " ".join(as_text(several).split())
    page = report(several, tmp_path).report.read_text(encoding="utf-8")
    assert text.count("ferryid evaluate ferry@3 LOG") == page.count("ferryid evaluate ferry@3 LOG") == 1
    assert text.index("ferry@3") > text.index(" second partly")
    assert page.index("ferry@3") < page.index('id="log-1"')


@pytest.mark.slow
@pytest.mark.blank
def test_which_logs_take_part_stands_before_all_logs(tmp_path: Path) -> None:
    split, rest = "No common hull fits a on one side and b on the other.", "Current of each log: not confirmed."
    several = [replace(one, notes=(split, rest), gathered=(split,)) for one in campaign()]
    page = report(several, tmp_path).report.read_text(encoding="utf-8")
    assert page.count(split) == page.count(rest) == 1
    assert page.index("<h2>Which logs take part</h2>") < page.index(split) < page.index('id="log-1"')
    assert page.index(rest) > page.index("Notes on all logs")
    assert "Which logs take part" not in report(campaign(), tmp_path).report.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.blank
def test_that_a_log_is_no_recording_stands_before_its_findings(tmp_path: Path) -> None:
    """Findings in what no sensor measured are read as a vessel's, where it stands last."""
    simulated, rest = "first.csv is no recording of a vessel: it is simulated.", "Not tested: gusts."
    one = replace(campaign()[0], notes=(rest, simulated), gathered=(simulated,))
    for told in (as_text([one]), report([one], tmp_path).report.read_text(encoding="utf-8")):
        assert told.count(simulated) == told.count(rest) == 1
        assert told.index(simulated) < told.index(one.findings[0].says[:30]) < told.index(rest)


def test_findings_that_one_reason_makes_hints_are_told_together() -> None:
    notes = (
        "Steady wind is a hint: it is brief.",
        "Not tested: gusts.",
        "Thruster force (bow) is a hint: it is brief.",
        "Steady wind is a hint: it is weak.",
        "Payload is a hint: it is brief.",
    )
    assert notes_of(replace(campaign()[0], notes=notes)) == [
        "Each of steady wind, thruster force (bow) and payload is a hint: it is brief.",
        "Not tested: gusts.",
        "Steady wind is a hint: it is weak.",
    ]


def test_a_single_log_shares_nothing() -> None:
    assert "In all logs" not in as_text(campaign()[:1])


def test_what_the_sensors_of_the_vessel_show_stands_once_beside_a_log_that_differs() -> None:
    late = replace(gain(), effect="clock_offset", instance=None, says="Velocity lags position by 0.80 s.", vessel=True)
    own = replace(late, says="Velocity lags position by 0.30 s.", vessel=False)
    several = [
        replace(diagnosis("partly_explained", log), findings=(one,))
        for log, one in (("first", late), ("second", late), ("third", own))
    ]
    text = as_text(several)
    assert text.count(late.says) == 1
    assert text.index("In several logs:") < text.index(late.says)
    assert "In all logs:" in as_text(several[:2])
    found = as_json(several)["findings"]
    assert [(one["says"], one["log"]) for one in found] == [(late.says, None), (own.says, "third")]


def test_findings_have_the_same_numbers_in_the_figures_and_below_them() -> None:
    weak, blows = campaign()[0].findings[1], wind()
    late = replace(weak, effect="clock_offset", instance=None, vessel=True)
    evidence = {"t": blows.evidence["t"], "before": np.zeros((len(blows.evidence["t"]), 3))}
    several = [
        replace(one, findings=(late, blows, replace(weak, says=f"{one.log}.")), evidence=evidence) for one in campaign()
    ]
    one = timelines(several, 2)[0]
    assert one is not None
    assert [mark.title for mark in one.marks] == [title(each.effect, each.instance) for each in (blows, weak)]
    assert one.marks[0].trace == "1. Steady wind explains"
    assert one.marks[0].trace in [trace.label for strip in one.strips for trace in strip.traces]
    (alone,) = timelines(several[:1], 1).values()
    assert alone is not None
    assert len(alone.marks) == 3


def test_the_share_of_a_withheld_sensor_stands_once_for_all_logs() -> None:
    blocks = np.array([10.0, 20.0, 15.0, 30.0, 25.0])
    share = HiddenGain.of(0.5 * blocks, blocks, 2)
    wind_N = {"north": 1.0, "east": 0.0}
    hidden = with_gains((Withheld("wind", {}, wind_N, "The wind was hidden."),), {"wind": share}, told=False)
    several = [replace(diagnosis("matched", log), withheld=hidden) for log in ("first", "second")]
    assert " ".join(as_text(several).split()).count(share.says("wind")) == 1


def test_sure_findings_of_all_logs_stand_before_hints() -> None:
    hint = replace(
        gain(), onset_s=None, evidence={}, labels={}, probability=0.5, says="Perhaps it lags.", instance="other"
    )
    sure = replace(gain(), onset_s=None, evidence={}, labels={}, probability=0.99, says="It is weak.")
    several = [replace(diagnosis("partly_explained", log), findings=(hint, sure)) for log in ("first", "second")]
    text = as_text(several)
    assert text.index(sure.says) < text.index(hint.says)


def test_a_copy_has_its_sentence_in_the_summary() -> None:
    several = [replace(one, copies=(("/logs/again.bag", "/logs/first.bag"),)) for one in campaign()]
    for shown in (several, several[:1]):
        told = " ".join(as_text(shown).split())
        assert "1 further log is a copy and left out of the estimate: again.bag (of first.bag)." in told
    assert "a copy" not in as_text(campaign())


def test_logs_that_are_left_out_have_their_sentence_in_the_summary() -> None:
    unused = (
        ("/logs/towed.bag", "Left out of the campaign: /logs/towed.bag: not engaged"),
        ("/logs/b.csv", "Left out"),
    )
    several = [replace(one, unused=unused) for one in campaign()]
    for shown in (several, several[:1]):
        assert "2 logs are left out of the campaign: towed.bag and b.csv." in " ".join(as_text(shown).split())
        assert as_json(shown)["logs_left_out"] == [{"log": path, "says": says} for path, says in unused]
    assert all("logs_left_out" not in one for one in as_json(several)["logs"])
    one = [replace(several[0], unused=unused[:1])]
    assert "1 log is left out of the campaign: towed.bag." in " ".join(as_text(one).split())
    many = [replace(several[0], unused=tuple((f"/logs/{k}.bag", "Left out") for k in range(9)))]
    assert "9 logs are left out of the campaign: 0.bag, 1.bag, 2.bag, 3.bag, 4.bag and 4 more." in " ".join(
        as_text(many).split()
    )
    assert "left out of the campaign" not in as_text(campaign())
    assert "logs_left_out" not in as_json(campaign())
    assert "2 logs are left out of the campaign" in " ".join(render(several, "t")[0].split())


def test_a_number_without_an_interval_is_told_once() -> None:
    assert estimate(Estimate(15.0, 15.0, 15.0, "-")) == "15"
    assert estimate(Estimate(0.25, 0.25, 0.25, "s")) == "0.250 s"
    assert estimate(Estimate(0.25, 0.2, 0.3, "s")) == "0.25 s (0.20 to 0.30)"
    assert estimate(Estimate(-0.0002, -0.0304, 0.03, "m/s")) == "0.000 m/s (-0.030 to 0.030)"


@pytest.mark.parametrize(
    ("effect", "seconds", "told"),
    [
        ("clock_offset", (-0.8, -0.5), "delay of the velocity after the position 0.50 to 0.80 s"),
        ("clock_offset", (0.8, 0.5), "delay of the position after the velocity 0.50 to 0.80 s"),
        ("time_delay", (-0.1, -0.1), "delay of the actuators' data after the navigation's 0.10 s"),
        ("time_delay", (-0.1, 0.3), "delay of the navigation's data after the actuators' -0.10 to 0.30 s"),
    ],
)
def test_a_delay_says_what_is_late(effect: str, seconds: tuple[float, float], told: str) -> None:
    late = [{"seconds": Estimate(one, one - 0.11, one + 0.12, "s")} for one in seconds]
    assert _sizes(effect, late) == told


def test_a_delay_of_one_log_has_its_interval_the_right_way_round() -> None:
    late = {"seconds": Estimate(-0.8, -0.87, -0.76, "s")}
    assert numbers_of(late, "clock_offset") == "delay of the velocity after the position 0.80 s (0.76 to 0.87)"
    assert numbers_of(late, "payload") == "delay -0.80 s (-0.87 to -0.76)"


def idle_campaign() -> tuple[list[Diagnosis], str]:
    """Return a campaign whose vessel hardly follows the applied force, and the note on that."""
    little = (
        f"In these 3 logs together the applied forces accelerate the vessel by surge 0.05. {MEANS_LITTLE} Fix: look"
    )
    return [replace(one, notes=("Other.", little), gathered=(little,)) for one in campaign()], little


def test_that_forces_mean_little_stands_right_below_the_headline() -> None:
    several, little = idle_campaign()
    text = as_text(several)
    assert " ".join(text.split("\n\n")[1].split()) == f"note: {little}"
    assert text.count("surge 0.05") == 1


@pytest.mark.slow
@pytest.mark.blank
def test_that_forces_mean_little_stands_first_on_the_page(tmp_path: Path) -> None:
    several, little = idle_campaign()
    page = report(several, tmp_path).report.read_text(encoding="utf-8")
    assert page.count(little) == 1
    assert page.index('class="verdict') < page.index(little) < page.index("<h2>")
    assert "Which logs take part" not in page
