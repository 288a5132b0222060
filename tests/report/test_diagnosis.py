"""The report of a diagnosis: verdict first, every number with its unit, every verdict in its schema."""

from __future__ import annotations

import inspect
import json
import re
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path
from typing import Any

import jsonschema
import matplotlib as mpl
import numpy as np
import pytest

from ferryid import __version__
from ferryid.diagnose.checks import clock_offset
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.spectra import Band
from ferryid.diagnose.judging.credibility import HullChange as Moved
from ferryid.diagnose.judging.diagnosis import Diagnosis, Withheld
from ferryid.diagnose.judging.error_profiles import profile_of
from ferryid.diagnose.judging.finding import Finding, LawTerm, Rival
from ferryid.diagnose.judging.least_sizes import LeastSize
from ferryid.diagnose.judging.locate import Location
from ferryid.diagnose.judging.verdict import VERDICTS, Remainder
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS
from ferryid.errors import FerryIdError
from ferryid.files import dump_json
from ferryid.report.diagnosis_errors import force_rows, free_run_caution, free_run_rows, ratio_of
from ferryid.report.diagnosis_figures import _profile, binned, in_regime
from ferryid.report.diagnosis_page import as_text, render
from ferryid.report.diagnosis_report import as_json, patient, report
from ferryid.report.diagnosis_words import (
    NOT_CORRECTED,
    about_errors,
    changed,
    estimate,
    headline,
    new_model,
    numbers,
    rivals,
    said,
    summary,
    trust,
    where,
)
from ferryid.report.evaluation_text import NOT_ACCEPTED
from ferryid.report.figures import STYLE, canvas
from ferryid.report.least_sizes import proof
from ferryid.signals.contiguous import LogPart
from ferryid.types import AXES
from ferryid.vessel import load_profile
from tests.report.pages import needs_nothing

T = np.arange(0.0, 720.0, 2.0)


def by_axis(surge: float, sway: float, yaw: float) -> dict[str, float]:
    return {"surge": surge, "sway": sway, "yaw": yaw}


def wind() -> Finding:
    heading = (T * 1.3) % 360.0
    explained = 40.0 * np.sin(np.radians(heading - 135.0))
    noise = 6.0 * np.random.default_rng(1).standard_normal(T.size)
    return Finding(
        effect="wind",
        instance=None,
        probability=0.998,
        parameters={"north": Estimate(-3.02, -3.21, -2.83, "m/s"), "east": Estimate(2.96, 2.81, 3.11, "m/s")},
        axes=by_axis(0.1, 0.6, 0.3),
        intervals=((0.0, 720.0),),
        regime="headings 150-210 deg",
        improvement=by_axis(0.41, 0.9, 0.95),
        held_out=True,
        rivals=(Rival("current", None, -310.0), Rival("heading_bias", None, -4.0)),
        unresolved_with=("current",),
        separating_manoeuvre="a slow turn on the spot through all headings",
        says="A steady wind of 4.2 m/s towards 135 deg was left out.",
        evidence={
            "t": T,
            "before": explained + noise,
            "after": noise,
            "explained": explained,
            "regressor": heading,
        },
        labels={"residual": "sway force left over [N]", "regressor": "heading [deg]"},
    )


def gain() -> Finding:
    late = T >= 312.0
    explained = np.where(late, -0.15 * (200.0 + 120.0 * np.sin(T / 23.0)), 0.0)
    noise = 9.0 * np.random.default_rng(2).standard_normal(T.size)
    return Finding(
        effect="thruster_gain",
        instance="thruster1",
        probability=0.93,
        parameters={"factor": Estimate(0.8497, 0.8312, 0.8683, "-"), "onset": Estimate(312.0, 308.5, 315.1, "s")},
        axes=by_axis(0.7, 0.04, 0.26),
        intervals=((312.0, 720.0),),
        onset_s=312.0,
        improvement=by_axis(0.6, -0.05, 0.01),
        says="thruster1 gives 85 % of the force that its speed promises.",
        evidence={"t": T, "before": explained + noise, "after": noise, "explained": explained},
        labels={"residual": "surge force left over [N]"},
    )


def run(scale: float) -> dict[str, Any]:
    horizons = [5.0, 10.0, 20.0, 30.0]
    errors = [0.1 * scale * h for h in horizons]
    return {
        "horizons_s": horizons,
        "position_m": errors,
        "heading_rad": [0.02 * e for e in errors],
        "speed_mps": [0.1 * e for e in errors],
        "yaw_rate_radps": [0.002 * e for e in errors],
        "starts": 12,
        "note": "",
    }


def diagnosis(verdict: str, log: str = "trial") -> Diagnosis:
    """Return a diagnosis made by hand, with everything that its verdict can have."""
    findings = {"explained": (wind(), gain()), "partly_explained": (wind(),)}.get(verdict, ())
    bend = np.column_stack([20.0 * np.sin(T / 40.0), 60.0 * np.sin(np.radians(T * 1.3)), 15.0 * np.cos(T / 60.0)])
    noise = np.random.default_rng(3).standard_normal((T.size, 3)) * [5.0, 8.0, 6.0]
    structure = 0.0 if verdict in ("matched", "not_testable") else bend
    evidence = {
        "t": T,
        "before": structure + noise,
        "after": noise,
        "heading": (T * 1.3) % 360.0,
        "speed": 1.0 + 0.8 * np.sin(T / 70.0),
    }
    before = {"mse": by_axis(400.0, 3600.0, 900.0), "free_run": run(1.0), "rows": 100}
    after = {
        "mse": by_axis(100.0, 360.0, 45.0),
        "free_run": run(0.3),
        "ratio": {
            axis: {"value": value, "low": value - 0.04, "high": value + 0.05}
            for axis, value in by_axis(0.25, 0.1, 0.05).items()
        },
        "free_run_ratio": {"horizon_s": 20.0, "position_m": {"value": 0.3, "low": 0.25, "high": 0.37}},
        "placebos": {"time shifted": by_axis(404.0, 3564.0, 918.0)},
    }
    notes = [
        "Current was not tested: the log never turns.",
        "Waves: the band above 0.1 Hz is as the noise of the model.",
    ]
    made = Diagnosis(
        log=log,
        vessel="milliampere",
        verdict=verdict,
        findings=findings,
        before=before,
        after=after if findings else {},
        notes=tuple(notes),
        model="ferryid-out/models/milliampere/2.json" if findings else None,
        evidence=evidence,
        withheld=(
            Withheld(
                "wind",
                {"north": Estimate(-3.02, -3.21, -2.83, "m/s")},
                {"north": -2.9},
                "The wind that was hidden blew at 4.1 m/s towards 134 deg: 1 deg and 0.1 m/s from what was found.",
            ),
        )
        if findings
        else (),
    )
    return replace(made, before={}, evidence={}) if verdict == "not_testable" else made


@cache
def explained() -> tuple[str, dict[str, str]]:
    """Return page and drawings of the richest diagnosis."""
    return render((diagnosis("explained"),), "trial")


def conforms(data: dict[str, Any]) -> None:
    schema = json.loads(files("ferryid.schemas").joinpath("diagnosis.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(data, schema)


class Structure(HTMLParser):
    """Checks that tags close in order, and counts captions and figures."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.counts = {"figure": 0, "figcaption": 0}

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag not in ("meta", "link"):
            self.open.append(tag)
        if tag in self.counts:
            self.counts[tag] += 1

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.mark.slow
@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_keeps_to_the_schema_and_leaves_a_whole_page(verdict: str, tmp_path: Path) -> None:
    outcome = report((diagnosis(verdict),), tmp_path)
    conforms(outcome.json)
    folder = outcome.report.parent
    written = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    assert written == json.loads(dump_json(outcome.json))
    assert written["verdict"] == verdict
    page = outcome.report.read_text(encoding="utf-8")
    structure = Structure()
    structure.feed(page)
    assert structure.open == []
    assert structure.counts["figure"] == structure.counts["figcaption"] == len(list(folder.glob("*.svg")))
    assert needs_nothing(page)
    assert headline(diagnosis(verdict)) in page
    assert headline(diagnosis(verdict)) in outcome.text.replace("\n", " ")
    assert str(outcome.report) in outcome.text
    assert page.count("<svg") == {"not_testable": 0, "explained": 8, "partly_explained": 6}.get(verdict, 3)


@pytest.mark.slow
def test_the_letter_has_its_order() -> None:
    page = explained()[0]
    places = [
        page.index(text)
        for text in (
            "Explained: the model left out steady wind (4.23 m/s) or current and thruster force (thruster1, factor 0.850)",
            wind().says,
            "North -3.02 m/s",
            "<svg",
            "These data cannot distinguish it from current.",
            gain().says,
            "Current was not tested",
            "with over without",
            "Where the recording and the model differ",
        )
    ]
    assert places == sorted(places)


def test_a_verdict_is_told_with_what_changed() -> None:
    assert headline(diagnosis("explained")) == (
        "Explained: the model left out steady wind (4.23 m/s) or current and thruster force (thruster1, factor 0.850); "
        "with them, the squared force error on held-out data falls by 75 % in surge, 90 % in sway and 95 % in yaw."
    )
    assert headline(diagnosis("matched")).startswith("Matched: nothing")


def test_a_headline_names_no_hint_that_is_hardly_likely() -> None:
    for probability, told in ((0.06, " Perhaps some of it is steady wind."), (0.04, "")):
        one = replace(diagnosis("unexplained"), findings=(replace(wind(), probability=probability),))
        assert headline(one).endswith(f"surely accounts for it.{told}")
        campaign = summary([one, replace(one, log="other")])
        assert ("Perhaps the model left out steady wind." in campaign) == bool(told)
    # It may be all that keeps a log from being explained.
    hint = replace(wind(), probability=0.04)
    one = replace(diagnosis("partly_explained"), findings=(gain(), hint), remainder=Remainder())
    assert headline(one).endswith(" Unlikely, but not excluded: steady wind.")


def test_the_verdict_does_not_call_a_fault_corrected_that_is_left_as_it_is() -> None:
    assert NOT_CORRECTED in inspect.getsource(clock_offset.find)
    offset = replace(wind(), effect="clock_offset", unresolved_with=(), says="Position lags velocity by 0.21 s.")
    left = replace(offset, says=f"{offset.says} It is not corrected in so short a log.")
    held = replace(offset, effect="held_samples")
    for findings, told in (
        ((offset,), "sensors have faults, corrected here: clock offset"),
        ((left,), "sensors have faults, not corrected here: clock offset"),
        ((held, left), "sensors have faults, corrected here: held samples, and not corrected here: clock offset"),
    ):
        one = replace(diagnosis("explained"), findings=findings)
        assert f"the {told}" in headline(one)
        assert f"The {told}." in summary([one, replace(one, log="other")])
    some = [replace(diagnosis("explained"), findings=(one,)) for one in (offset, left)]
    assert "The sensors have faults, corrected here: clock offset (not in every log)." in summary(some)


def test_a_free_run_that_turned_too_often_is_told_in_turns() -> None:
    before, after = (
        {"free_run": {"horizons_s": [60.0], "heading_rad": [value], "position_m": [40.0]}} for value in (16.7, 0.1)
    )
    position, heading = free_run_rows(replace(diagnosis("explained"), before=before, after=after))
    assert heading["cells"][:2] == ["957 (2.7 turns)", "5.73"]
    assert position["cells"][:2] == ["40", "40"]


def test_free_runs_that_surely_err_more_with_the_findings_are_cautioned_of() -> None:
    made = diagnosis("explained")

    def after_runs(heading: float, low: float) -> Diagnosis:
        runs = [
            {"horizons_s": [60.0], "position_m": [one], "heading_rad": [other]}
            for one, other in ((40.0, 0.5), (60.0, 0.5 * heading))
        ]
        # Of a position that one block alone shows no interval is known: that says nothing.
        ratios = {"horizon_s": 60.0, "heading_rad": {"value": heading, "low": low, "high": 2.0}}
        before, after = ({**part, "free_run": run} for part, run in zip((made.before, made.after), runs, strict=True))
        return replace(made, before=before, after={**after, "free_run_ratio": ratios})

    assert free_run_caution(after_runs(1.2, 0.9)) == ""
    assert free_run_caution(after_runs(1.05, 1.01)) == ""
    said = free_run_caution(after_runs(1.2, 1.1))
    assert said.startswith("Free runs err more with the findings, in heading (1.20 times),")
    assert said in " ".join(as_text([after_runs(1.2, 1.1)]).split())
    # Without findings there is nothing to compare.
    assert free_run_caution(replace(after_runs(1.2, 1.1), findings=())) == ""


def test_of_free_runs_that_diverge_no_number_is_shown() -> None:
    made = diagnosis("explained")

    def with_speeds(before: float, after: float) -> Diagnosis:
        runs = [{"horizons_s": [60.0], "position_m": [40.0], "speed_mps": [one]} for one in (before, after)]
        return replace(
            made,
            before={**made.before, "free_run": runs[0]},
            after={**made.after, "free_run": runs[1], "free_run_ratio": {}},
        )

    assert [row["cells"] for row in free_run_rows(with_speeds(1.0, 2.0))] == [["40", "40", "1.00"], ["1", "2", "2.00"]]
    assert [row["cells"] for row in free_run_rows(with_speeds(131252.0, 2.0))] == [
        ["diverges", "40", "–"],
        ["diverges", "2", "–"],
    ]
    # Without the findings they diverge, with them they do not: that is no caution.
    assert free_run_caution(with_speeds(131252.0, 2.0)) == ""
    assert free_run_caution(with_speeds(1.0, 131252.0)).startswith("Free runs diverge with the findings, whatever")
    assert free_run_caution(with_speeds(1e5, 1e4)).startswith("Free runs diverge with the findings, as they do without")


def test_the_verdict_says_why_all_findings_remove_less_than_one_of_them_alone() -> None:
    """A hull that is refitted without the findings makes up for some of them."""
    made = diagnosis("explained")
    much = replace(made.findings[0], improvement={"surge": 0.9})
    told = headline(replace(made, findings=(much, *made.findings[1:])))
    assert told.endswith("and 95 % in yaw from what a hull refitted without them leaves.")
    little = replace(made.findings[0], improvement={"surge": 0.8})
    assert headline(replace(made, findings=(little, *made.findings[1:]))).endswith("and 95 % in yaw.")


def test_what_no_size_would_have_shown_stands_in_the_verdict() -> None:
    unseen = [LeastSize(name, None, None, "-", "") for name in ("wind", "current", "payload", "fouling", "fouling")]
    seen = LeastSize("heading_bias", None, 1.0, "deg", "")
    told = headline(replace(diagnosis("matched"), least_sizes=(*unseen, seen)))
    assert told == (
        "Matched as far as this log can show, which is not all: nothing is found missing from the model, but steady wind, "
        "current, payload and 1 more would not have been seen at any size."
    )
    assert headline(replace(diagnosis("matched"), least_sizes=(seen,))).startswith("Matched: nothing")


def test_the_command_that_measures_sizes_conceals_what_any_record_can_carry() -> None:
    """Twin propellers push in no sway, so that no load can be concealed in their records; an error of a sensor always can."""
    sizes = [
        LeastSize("payload", None, None, "kg", ""),
        LeastSize("wind", None, 2.0, "m/s", ""),
        LeastSize("heading_bias", None, 1.0, "deg", ""),
    ]
    assert proof(replace(diagnosis("matched"), least_sizes=tuple(sizes))).endswith(" --only heading_bias")
    assert proof(replace(diagnosis("matched"), least_sizes=tuple(sizes[:2]))).endswith(" --only wind")
    assert proof(replace(diagnosis("matched"), least_sizes=tuple(sizes[:1]))) == ""


def test_copies_stand_once_in_the_json_of_a_campaign() -> None:
    logs = [replace(diagnosis("matched"), log=name, copies=(("b.csv", "a.bag"),)) for name in ("a", "c")]
    told = as_json(logs)
    assert told["copies"] == [{"log": "b.csv", "of": "a.bag"}]
    assert all("copies" not in one for one in told["logs"])
    assert as_json(logs[:1])["copies"] == told["copies"]
    assert "copies" not in as_json([diagnosis("matched")])
    schema = json.loads(files("ferryid.schemas").joinpath("diagnosis.json").read_text(encoding="utf-8"))
    for several in (logs, logs[:1]):
        jsonschema.validate(json.loads(json.dumps({**as_json(several), "report": "x"})), schema)


def test_a_joined_log_has_a_diagnosis_of_each_of_the_logs_that_were_given() -> None:
    parts = tuple(LogPart(f"bags/bag{k}.mcap", 20.0 * k, 20.0 * k + 19.9) for k in range(3))
    one = replace(
        diagnosis("explained"), log="bag0-and-2-more", path="+".join(part.path for part in parts), parts=parts
    )
    late = replace(
        wind(), onset_s=25.0, intervals=((25.0, 59.9),), parameters={"onset": Estimate(25.0, 24.0, 27.0, "s")}
    )
    one = replace(one, findings=(late,))
    schema = json.loads(files("ferryid.schemas").joinpath("diagnosis.json").read_text(encoding="utf-8"))
    for told in (as_json([one]), as_json([one, diagnosis("explained")])):
        jsonschema.validate(json.loads(json.dumps({**told, "report": "x"})), schema)
        assert [part["path"] for part in told["joined"][0]["parts"]] == [part.path for part in parts]
        assert [each["log"] for each in told["logs"]][:3] == ["bag0.mcap", "bag1.mcap", "bag2.mcap"]
        assert all(each["joined"] == one.log and each["verdict"] == one.verdict for each in told["logs"][:3])
    before, begins, acts = as_json([one])["logs"]
    assert before["findings"] == []
    (found,) = begins["findings"]
    assert (found["where"]["onset"], found["where"]["intervals"]) == (5.0, [[5.0, pytest.approx(19.9)]])
    assert found["parameters"]["onset"] == {"value": 5.0, "low": 4.0, "high": 7.0, "unit": "s"}
    (found,) = acts["findings"]
    assert (found["where"]["onset"], found["where"]["intervals"]) == (None, [[0.0, pytest.approx(19.9)]])
    assert found["parameters"] == {}


def test_a_finding_is_told_in_numbers() -> None:
    assert numbers(wind()) == "North -3.02 m/s (-3.21 to -2.83); east 2.96 m/s (2.81 to 3.11) (95 % intervals)."
    assert where(wind()) == (
        "It acts throughout, and shows in sway (60 %), yaw (30 %) and surge (10 %); clearest at headings 150-210 deg."
    )
    assert where(gain()) == "It shows in surge (70 %) and yaw (26 %)."
    assert "; it began at 312.0 s (308.5 to 315.1)" in numbers(gain())
    passed = replace(gain(), offset_s=500.0, intervals=((312.0, 500.0),))
    assert where(passed).startswith("It began at 312 s and ended at 500 s, and shows")
    assert where(replace(passed, onset_s=None)).startswith("It ended at 500 s, and shows")
    assert said(replace(wind(), probability=0.4)).startswith("Perhaps: ")
    assert said(replace(wind(), probability=0.04)).startswith("Unlikely: ")
    assert said(wind()) == wind().says
    assert trust(wind()) == (
        "Probability above 0.99, among the effects that were tried. With it, the squared force error on data that it was not "
        "fitted to falls by 41 % in surge, 90 % in sway and 95 % in yaw."
    )
    assert trust(gain()) == (
        "Probability 0.93. With it, the squared force error on the very data that it was fitted to falls by 60 % in surge "
        "and rises by 5 % in sway."
    )


def test_another_thruster_that_does_as_well_is_told_by_its_name() -> None:
    other = (Rival("thruster_gain", "thruster2", -1.0), Rival("thruster_gain", "bow", -9.0))
    told = rivals(replace(gain(), unresolved_with=("thruster_gain",), rivals=other))
    assert told[0] == "These data cannot distinguish it from thruster force (thruster2)."


def test_rivals_are_told_by_how_much_less_likely_they_are() -> None:
    told = rivals(wind())
    assert told[0] == "These data cannot distinguish it from current."
    # exp(4) is 54.6; exp(310) is 10 to the 134.6, which nobody needs to know.
    assert told[1] == "Of the other effects that were tried in its place, heading bias is 55 times less likely."
    assert told[2] == "Any other is less likely by a factor of more than a million: current would be next."
    assert told[3] == "To separate them, record this: a slow turn on the spot through all headings."
    assert rivals(gain()) == []
    far = rivals(replace(wind(), rivals=(Rival("current", None, -310.0),), unresolved_with=()))
    assert far[0] == (
        "Any other effect that was tried in its place is less likely by a factor of more than a million: current would be next."
    )


def test_another_shape_of_the_thrust_curve_is_unresolved_though_the_evidence_is_clear() -> None:
    others = (Rival("ventilation", "fore", -37.0), Rival("thrust_inflow_loss", None, -300.0))
    limit = replace(
        gain(), effect="thrust_saturation", instance="fore", unresolved_with=("ventilation",), rivals=others
    )
    told = rivals(limit)
    assert told[0] == "These data cannot distinguish it from ventilation."
    assert told[1].startswith("The evidence is against ventilation (fore), but that explains nearly as much")
    assert told[2].endswith("less likely by a factor of more than a million: inflow loss would be next.")
    assert "against" not in " ".join(rivals(replace(limit, unresolved_with=())))


def test_a_delay_that_is_alike_is_not_said_to_be_far_less_likely_as_well() -> None:
    lag = replace(
        gain(),
        effect="thruster_lag",
        instance=None,
        unresolved_with=("time_delay",),
        rivals=(Rival("time_delay", None, -11.0), Rival("current", None, -20.0)),
    )
    told = rivals(lag)
    assert told[:2] == [
        "These data cannot distinguish it from time delay.",
        "The evidence is against time delay, but that explains nearly as much, and formulas are idealised.",
    ]
    assert not any("time delay" in line for line in told[2:3])
    # Near in evidence, it is as likely as it is said to be; and what is unresolved for another reason has no formula alike.
    near = rivals(replace(lag, rivals=(Rival("time_delay", None, -1.0),)))
    assert "against" not in " ".join(near)
    other = rivals(replace(lag, unresolved_with=("hull_parameters",), rivals=(Rival("hull_parameters", None, -11.0),)))
    assert "against" not in " ".join(other)


def test_where_is_told_by_what_is_known_of_it() -> None:
    some = replace(wind(), intervals=((100.0, 180.0), (400.0, 460.0)), regime="all along", axes={"yaw": 1.0})
    assert where(some) == "It acts from 100 to 180 s and 400 to 460 s, and shows in yaw (100 %)."
    assert where(replace(some, intervals=((0.0, 500.0),))) == "It acts from 0 s to 500 s, and shows in yaw (100 %)."
    fast = replace(some, intervals=((0.0, 720.0),), band_hz=(0.1, 0.2), regime="speeds of 1 to 2 m/s")
    assert where(fast).endswith("in yaw (100 %), mostly between 0.1 and 0.2 Hz; clearest at speeds of 1 to 2 m/s.")


def nameless() -> Finding:
    """Return something unsteady, which nothing explains: there is no after."""
    burst = np.where((T > 200.0) & (T < 260.0), 50.0, 5.0) * np.random.default_rng(4).standard_normal(T.size)
    return replace(
        wind(),
        effect="unknown",
        parameters={},
        intervals=((200.0, 260.0),),
        says="An unsteady disturbance acts.",
        evidence={"t": T, "before": burst},
        labels={"residual": "yaw moment left over [N·m]"},
        band_hz=(0.1, 0.2),
    )


@pytest.mark.slow
@pytest.mark.blank
def test_what_has_no_name_is_no_fault_of_the_sensors() -> None:
    one = replace(diagnosis("partly_explained"), findings=(wind(), nameless()))
    assert headline(one).startswith("Partly explained: the model left out steady wind (4.23 m/s) or current; with it,")
    assert "sensors" not in headline(one)
    page, drawings = render((one,), "trial")
    assert "2. Something without a name" in page
    # Nothing explains it, so that there is no figure of what it adds.
    assert {name for name in drawings if name.startswith("finding-2")} == {"finding-2-time"}
    assert "that it is not due to chance" in trust(nameless())
    alone = replace(one, verdict="unexplained", findings=(nameless(),))
    assert headline(alone).startswith("Unexplained:")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (Estimate(0.8497, 0.8312, 0.8683, "-"), "0.850 (0.831 to 0.868)"),
        (Estimate(512.3, 470.1, 555.0, "kg"), "512 kg (470 to 555)"),
        (Estimate(0.4, float("nan"), float("nan"), "s"), "0.400 s"),
    ],
)
def test_a_value_has_the_digits_that_its_interval_supports(given: Estimate, told: str) -> None:
    assert estimate(given) == told


def test_what_changed_says_falls_and_rises_and_keeps_silent_on_trifles() -> None:
    assert changed(by_axis(0.5, -0.1, 0.01)) == "falls by 50 % in surge and rises by 10 % in sway"
    assert changed(by_axis(0.0, 0.01, -0.01)) == "stays as it was"
    assert changed({}) == ""


def test_ratio_comes_from_the_errors_where_none_is_given() -> None:
    one = replace(diagnosis("explained"), after={"mse": by_axis(100.0, 360.0, 45.0)})
    assert {axis: ratio_of(one)[axis].value for axis in AXES} == pytest.approx(by_axis(0.25, 0.1, 0.05))


def test_tables_hold_roots_ratios_and_placebos() -> None:
    page = re.sub(r"<svg.*?</svg>", "", explained()[0], flags=re.DOTALL)
    for cell in ("20", "60", "30", "0.25 (0.21 to 0.30)", "0.10 (0.06 to 0.15)", "1.01", "0.99", "1.02"):
        assert re.search(rf"<td data-of=\"[^\"]+\">{re.escape(cell)}</td>", page), cell
    # The free run at the horizon that has an interval, 20 s: 2 m without and 0.6 m with.
    of = [f'<td data-of="{name}">' for name in ("without", "with", "with over without")]
    assert f"position after 20 s [m]</td>{of[0]}2</td>{of[1]}0.6</td>{of[2]}0.30 (0.25 to 0.37)" in page


@pytest.mark.slow
@pytest.mark.blank
def test_tables_fold_where_a_page_is_narrow() -> None:
    """Every cell says by itself what it is of, as there is no heading above it on a telephone."""
    page = render((diagnosis("explained"), diagnosis("matched")), "trials")[0]
    assert "@media (max-width: 600px)" in page
    tables = re.findall(r'<table class="fold">(.*?)</table>', page, re.DOTALL)
    assert len(tables) == page.count("<table") == 8
    for row in "".join(tables).split("<tr>"):
        assert all("data-of=" in cell for cell in re.findall(r"<td[^>]*>", row)[1:])


def nothing(horizons: int) -> list[None]:
    return [None] * horizons


def test_free_run_is_told_at_the_longest_horizon_that_has_data() -> None:
    before, after = run(1.0), run(0.3)
    # Positions end after 10 s, there are no headings at all, and of the yaw rate one of the two runs ends early.
    before["position_m"][2:] = after["position_m"][2:] = nothing(2)
    before["heading_rad"] = after["heading_rad"] = nothing(4)
    after["yaw_rate_radps"][3:] = nothing(1)
    one = replace(
        diagnosis("explained"),
        before={**diagnosis("explained").before, "free_run": before},
        after={"mse": by_axis(100.0, 360.0, 45.0), "free_run": after},
    )
    assert [row["name"] for row in free_run_rows(one)] == [
        "position after 10 s [m]",
        "speed after 30 s [m/s]",
        "yaw rate after 20 s [deg/s]",
    ]
    assert free_run_rows(one)[0]["cells"] == ["1", "0.3", "0.30"]
    blind = {**before, **{key: nothing(4) for key in ("position_m", "speed_mps", "yaw_rate_radps")}}
    assert free_run_rows(replace(one, before={"mse": {}, "free_run": blind})) == []


@pytest.mark.slow
@pytest.mark.blank
def test_the_table_says_what_its_errors_are_of_and_what_is_not_in_them() -> None:
    moved = Moved("Y_v", "kg/s", -200.0, -230.0, -1.25)
    gusts = replace(nameless(), effect="gusts")
    one = replace(
        diagnosis("partly_explained"),
        findings=(wind(), gusts, nameless()),
        before={**diagnosis("partly_explained").before, "window_s": 8.0},
        moved=moved,
    )
    absent, hull, windows = about_errors(one)
    assert absent == "Not subtracted from these errors, and left in both rows: gusts and unexplained forces."
    assert "the coefficient Y_v moved farthest, from -200 to -230 kg/s: 1.2 prior standard deviations" in hull
    assert "windows of 8 s" in windows
    assert "ferryid evaluate" in windows
    page, text = unbroken(render((one,), "trial")[0]), unbroken(as_text((one,)))
    for line in (absent, hull, windows):
        assert line.replace("'", "&#39;") in page
        assert line in text
    assert about_errors(replace(diagnosis("explained"), before={})) == []


def test_errors_that_no_finding_changes_are_told_once() -> None:
    same = {"mse": by_axis(400.0, 3600.0, 900.0)}
    alone = replace(diagnosis("explained"), findings=(nameless(),), before=same, after=same, verdict="unexplained")
    (row,) = force_rows(alone)
    assert about_errors(alone) == ["Not subtracted from these errors: unexplained forces."]
    assert row["name"] == "root-mean-square error"
    waves = replace(nameless(), effect="waves", unresolved_with=())
    waves = replace(alone, findings=(waves,), verdict="explained")
    assert headline(waves) == "Explained: the model left out waves."


@pytest.mark.slow
def test_the_sign_of_what_is_left_over_is_told_once_where_it_is_drawn() -> None:
    for page in (explained()[0], render((diagnosis("matched"),), "trial")[0]):
        assert unbroken(page).count("model minus measured") == 1
    assert "model minus measured" not in render((diagnosis("not_testable"),), "trial")[0]


@pytest.mark.slow
@pytest.mark.blank
def test_the_page_says_when_how_and_by_what_it_was_made(tmp_path: Path) -> None:
    one = replace(diagnosis("explained"), duration_s=719.6)
    outcome = report((one,), tmp_path, ("ferryid", "diagnose", "a log.csv"))
    page = outcome.report.read_text(encoding="utf-8")
    assert f"{datetime.now(UTC):%Y-%m-%d}" in page
    assert f"ferryid {__version__}." in page
    assert "The log lasts 12 min 0 s." in page
    assert "ferryid diagnose &#39;a log.csv&#39;" in page
    assert outcome.json["duration_s"] == 719.6
    conforms(outcome.json)


@pytest.mark.slow
@pytest.mark.blank
def test_a_note_is_told_once() -> None:
    twice = replace(diagnosis("explained"), notes=("The same.", "Another.", "The same."))
    for told in (render((twice,), "trial")[0], as_text((twice,))):
        assert told.count("The same.") == 1
    other = replace(diagnosis("matched"), notes=("The same.",))
    page, text = render((twice, other), "trials")[0], as_text((twice, other))
    assert page.count("The same.") == text.count("The same.") == page.count("Another.") == 1
    assert "Every log by itself is in the report, with 1 note." in text


def test_parameters_are_told_in_words_and_symbols_stay_symbols() -> None:
    one = Estimate(0.8, 0.7, 0.9, "m/s")
    assert numbers(replace(wind(), parameters={"std": one})).startswith("Standard deviation 0.80 m/s")
    assert numbers(replace(wind(), parameters={"m11": one})).startswith("m11 0.80 m/s")


@pytest.mark.parametrize("name", sorted(effects()))
def test_no_parameter_is_told_by_a_name_that_is_no_word(name: str) -> None:
    for parameter in effects()[name].parameters_of(load_profile("milliampere")):
        told = numbers(replace(wind(), parameters={parameter.name: Estimate(0.8, 0.7, 0.9, parameter.unit)}))
        words = set(re.findall(r"\w+", told))
        assert not words & {"std", "Std", "per", "Per", "mps", "seconds", "Seconds"}
        assert parameter.name in COEFFICIENTS or "_" not in told


@pytest.mark.slow
@pytest.mark.blank
def test_how_far_the_hull_went_is_in_the_json(tmp_path: Path) -> None:
    moved = Moved("Y_v", "kg/s", -200.0, -230.0, -1.25)
    outcome = report((replace(diagnosis("explained"), moved=moved),), tmp_path)
    conforms(outcome.json)
    assert outcome.json["hull_moved"] == vars(moved)


def gusts() -> Finding:
    """Return gusts of a force by their spectrum, as a diagnosis gives it."""
    frequency = np.linspace(0.01, 1.0, 100)
    explained = 1e4 / (1.0 + (20.0 * frequency) ** 2)
    return replace(
        nameless(),
        effect="gusts",
        axes=by_axis(0.1, 0.7, 0.2),
        says="The wind was gusty.",
        evidence={"frequency": frequency, "before": explained + 5000.0, "explained": explained},
        labels={"residual": "sway force left over [N²/Hz]", "regressor": "frequency [Hz]"},
    )


@pytest.mark.slow
def test_what_comes_and_goes_is_shown_by_its_spectrum() -> None:
    one = replace(diagnosis("explained"), findings=(wind(), gusts()))
    page, drawings = render((one,), "trial")
    assert {name for name in drawings if name.startswith("finding-2")} == {"finding-2-spectrum"}
    drawing = drawings["finding-2-spectrum"]
    for label in (
        "frequency [Hz]",
        "sway force left over [N²/Hz]",
        "without the finding",
        "with it",
        "what it explains",
    ):
        assert f">{label}</text>" in drawing
    assert "orange is nowhere far below it" in unbroken(page)
    strong = gusts().evidence["explained"] >= 0.5 * gusts().evidence["explained"].max()
    explained = gusts().evidence["explained"][strong]
    share = 100.0 * explained.sum() / (explained + 5000.0).sum()
    told = f"where it is strongest, below 0.05 Hz, it is {share:.0f} % of the power left over in sway"
    assert told in unbroken(page)
    assert told in unbroken(as_text((one,)))


def unbroken(text: str) -> str:
    return re.sub(r"\s+", " ", text)


def test_terminal_text_holds_the_same() -> None:
    text = as_text((diagnosis("explained"),))
    for part in (wind().says, "North -3.02 m/s", "note: Current was not tested", "withheld wind", "2.json"):
        assert part in text
    assert max(len(line) for line in text.splitlines()) <= 110


@pytest.mark.slow
def test_names_and_sentences_are_escaped() -> None:
    evil = "<script>alert(1)</script>"
    one = replace(diagnosis("explained"), log=evil, notes=(evil,))
    one = replace(one, findings=(replace(one.findings[0], says=evil, labels={"residual": evil, "regressor": evil}),))
    assert evil not in render((one,), evil)[0]


@pytest.mark.slow
def test_figures_carry_units_and_only_what_there_is() -> None:
    drawings = explained()[1]
    assert "sway force left over [N]" in drawings["finding-1-evidence"]
    assert "heading [deg]" in drawings["finding-1-evidence"]
    assert ">its ends</text>" in drawings["finding-2-time"]
    assert ">its ends</text>" not in drawings["finding-1-time"]
    passed = replace(diagnosis("explained"), findings=(replace(gain(), offset_s=500.0),))
    assert ">its ends</text>" in render((passed,), "trial")[1]["finding-1-time"]
    bare = replace(diagnosis("explained"), findings=(replace(wind(), evidence={}, labels={}),), evidence={})
    assert set(render((bare,), "trial")[1]) == {"free-run-errors"}
    assert render((diagnosis("explained"),), "trial") == explained()


@pytest.mark.slow
@pytest.mark.blank
def test_several_logs_are_one_object_and_one_page(tmp_path: Path) -> None:
    several = (diagnosis("matched", "a"), diagnosis("explained", "b"), diagnosis("not_testable", "c"))
    outcome = report(several, tmp_path)
    conforms(outcome.json)
    assert outcome.json["verdict"] == "explained"
    assert [one["log"] for one in outcome.json["logs"]] == ["a", "b", "c"]
    assert {one["log"] for one in outcome.json["findings"]} == {"b"}
    # 100 rows each of a and b; nothing changes in a.
    assert outcome.json["before"]["mse"]["surge"] == pytest.approx(400.0)
    assert outcome.json["after"]["mse"]["surge"] == pytest.approx(250.0)
    assert outcome.text.startswith("Of 3 logs, 1 matched, 1 explained and 1 not testable.")
    assert outcome.report.parent.name == "diagnosis-a-and-2-more-without-wind"


def test_bins_hold_the_mean_and_an_interval_that_knows_what_is_independent() -> None:
    """A slope comes back; the interval is as wide as separate visits scatter, not as narrow as single values would have it."""
    rng = np.random.default_rng(0)
    x = np.tile(np.linspace(0.0, 1.0, 200), 30)
    offset = np.repeat(rng.standard_normal(30), 200)
    bins = binned(x, 5.0 * x + offset)
    truth = 5.0 * bins.place
    assert len(bins.place) == 10
    assert bins.often.all()
    assert np.mean(np.abs(bins.mean - truth) <= bins.half) == 1.0
    # Student's t of 29 degrees of freedom, 97.5 %, from the tables: 2.045.
    expected = 2.045 * np.std(offset[::200], ddof=1) / np.sqrt(30)
    np.testing.assert_allclose(bins.half, expected, rtol=0.05)


def test_bins_with_too_few_windows_are_no_means() -> None:
    once = binned(np.linspace(0.0, 1.0, 50), np.zeros(50))
    assert np.isnan(once.mean).all()
    assert np.isnan(once.half).all()
    assert not once.often.any()


def test_a_bin_of_one_long_visit_has_an_interval_from_its_pieces() -> None:
    """Forty windows in each of ten places, each visited once: five pieces of eight windows."""
    rng = np.random.default_rng(1)
    y = np.repeat(rng.standard_normal(50), 8)
    bins = binned(np.repeat(np.arange(10.0), 40), y)
    assert not bins.often.any()
    # Student's t of 4 degrees of freedom, 97.5 %, from the tables: 2.776.
    pieces = y[::8].reshape(10, 5)
    np.testing.assert_allclose(bins.half, 2.776 * np.std(pieces, axis=1, ddof=1) / np.sqrt(5), rtol=1e-3)
    np.testing.assert_allclose(bins.mean, pieces.mean(axis=1))


def test_only_means_of_separate_visits_are_joined_by_lines() -> None:
    """A place that was visited often, one that was visited once for long, and between them a few stray windows."""
    x = np.concatenate([np.tile([0.0] * 5 + [10.0] * 5, 6), [5.0, 5.0], np.full(40, 20.0)])
    finding = replace(
        wind(),
        evidence={"t": np.arange(x.size, dtype=float), "before": x + 1.0, "after": np.ones(x.size), "regressor": x},
    )
    drawn: list[tuple[str, Any]] = []
    with mpl.rc_context(STYLE):
        (ax,) = canvas(1, 3.0)[1]
        _profile(ax, x, finding.evidence["before"], "black", "all")
        drawn = [
            (line.get_linestyle(), line.get_ydata()) for line in ax.get_lines() if line.get_label() in ("all", "_once")
        ]
    joined = next(values for style, values in drawn if style == "-")
    alone = next(values for style, values in drawn if style == "None")
    assert sorted(joined[np.isfinite(joined)]) == [1.0, 11.0]
    assert 6.0 not in alone
    assert 21.0 in alone


def test_whose_log_it_is_must_be_known(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match=r"--vessel.*Fix:"):
        patient(None, None, tmp_path)
    assert patient("milliampere", None, tmp_path)[0].name == "milliampere"


def location() -> Location:
    """Return a location made by hand: headings from 0 to 90 deg and the band from 0.1 to 0.2 Hz stand out before."""
    rng = np.random.default_rng(7)
    calm = rng.standard_normal((T.size, 3))
    heading = (T * 1.3) % 360.0
    loud = calm * np.where(heading < 90.0, 5.0, 1.0)[:, None]
    errors = 20.0 * loud
    profile = profile_of("heading", "deg", heading, np.linspace(0.0, 360.0, 13), loud, calm, errors)
    power = np.array([400.0, 900.0, 25.0])
    bands = (Band(0.0, 0.1, power, power), Band(0.1, 0.2, 9.0 * power, power))
    shares = np.array([0.5, 0.3, 0.2])
    return Location(
        shares, shares, T, errors, errors, ((10.0, 500.0),), 10.0, None, (profile,), bands, "headings 0 to 90 deg"
    )


@pytest.mark.slow
def test_where_the_whole_log_differs_is_drawn_and_in_the_json(tmp_path: Path) -> None:
    one = replace(diagnosis("explained"), located=location(), findings=(replace(wind(), band_hz=(0.1, 0.2)), gain()))
    outcome = report((one,), tmp_path)
    conforms(outcome.json)
    located = outcome.json["located"]
    assert located["onset"] == 10.0
    profile = located["profiles"][0]
    assert profile["by"] == "heading"
    # Five times the noise is 25 times its square; afterwards there is the noise alone.
    assert profile["before"][1]["sway"] == pytest.approx(25.0, rel=0.5)
    assert profile["after"][1]["sway"] == pytest.approx(1.0, rel=0.5)
    assert profile["before"][6]["sway"] == profile["after"][6]["sway"]
    assert located["bands"][1] == {
        "low_hz": 0.1,
        "high_hz": 0.2,
        "before": {"surge": 3600.0, "sway": 8100.0, "yaw": 225.0},
        "after": {"surge": 400.0, "sway": 900.0, "yaw": 25.0},
    }
    assert outcome.json["findings"][0]["where"]["band_hz"] == [0.1, 0.2]
    drawings = {path.stem: path.read_text(encoding="utf-8") for path in outcome.report.parent.glob("*.svg")}
    assert {"left-over", "regime-1", "bands"} <= set(drawings)
    assert "heading [deg]" in drawings["regime-1"]
    # Small print is what nobody reads on a telephone.
    sizes = [float(size) for size in re.findall(r"font-size: ([\d.]+)px", drawings["regime-1"] + drawings["bands"])]
    assert sizes
    assert min(sizes) >= 10.0
    assert "frequency [Hz]" in drawings["bands"]
    assert "by-heading" not in drawings


def test_where_too_few_windows_tell_not_even_noise_is_shaded() -> None:
    """Headings from 90 to 270 deg were never sailed: of twelve bins the six in the middle have no shade."""
    calm = np.random.default_rng(8).standard_normal((T.size, 3))
    half = (T * 1.3) % 180.0
    heading = np.where(half < 90.0, half, half + 180.0)
    drawing = in_regime(
        diagnosis("explained"), profile_of("heading", "deg", heading, np.linspace(0.0, 360.0, 13), calm, calm, calm)
    )
    shades = re.findall(r'<path d="([^"]+)" clip-path="[^"]+" style="fill: #e8eef4', drawing)
    across = np.array([float(x) for shade in shades for x in re.findall(r"[ML] ([\d.]+) ", shade)])
    turned = 360.0 * (across - across.min()) / np.ptp(across)
    assert {round(one) for one in turned} == {0, 30, 60, 90, 270, 300, 330, 360}


@pytest.mark.slow
@pytest.mark.blank
def test_a_law_is_in_the_json(tmp_path: Path) -> None:
    term = LawTerm("sway", "r|r|", Estimate(-34.0, -38.0, -30.0, "N/(rad/s)²"), "in sway -34 N")
    one = replace(diagnosis("unexplained"), findings=(replace(nameless(), law=(term,)),))
    outcome = report((one,), tmp_path)
    conforms(outcome.json)
    told = outcome.json["findings"][0]["where"]["law"]
    assert told == [
        {
            "on": "sway",
            "quantity": "r|r|",
            "coefficient": {"value": -34.0, "low": -38.0, "high": -30.0, "unit": "N/(rad/s)²"},
            "says": "in sway -34 N",
        }
    ]


@pytest.mark.parametrize(
    ("value", "told"), [(17.683, "17.7 N"), (0.01234, "0.0123 N"), (4.0, "4 N"), (1234.5, "1234 N")]
)
def test_a_value_without_an_interval_has_three_digits(value: float, told: str) -> None:
    assert estimate(Estimate(value, value, value, "N")) == told


def test_a_model_that_was_not_accepted_is_to_be_judged_before_it_is_used() -> None:
    made = Diagnosis("log", "ferry", "deviation", (), {}, {}, model="ferryid-out/models/g/2.json")
    assert new_model(made).endswith("2.json; use it with: ferryid evaluate g@2 LOG")
    assert new_model(replace(made, model_accepted=False)).endswith(
        f"it is {NOT_ACCEPTED}. Judge it on a log of another day with: ferryid evaluate g@2 LOG"
    )
