"""A campaign on page, terminal and in JSON: what all logs share stands once, what is one log's stays with it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.report.diagnosis_page import as_text
from ferryid.report.diagnosis_report import report
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
def test_what_has_a_figure_stays_with_its_log(tmp_path: Path) -> None:
    made = report(campaign(), tmp_path)
    assert made.report.read_text(encoding="utf-8").count(wind().says) == 2
    for log in (1, 2):
        assert (made.report.parent / f"{log}-finding-1-evidence.svg").exists()


@pytest.mark.slow
def test_the_model_of_all_logs_stands_once(tmp_path: Path) -> None:
    several = [replace(one, model=str(tmp_path / "models" / "ferry" / "3.json")) for one in campaign()]
    text = " ".join(as_text(several).split())
    page = report(several, tmp_path).report.read_text(encoding="utf-8")
    assert text.count("ferryid evaluate ferry@3 LOG") == page.count("ferryid evaluate ferry@3 LOG") == 1
    assert text.index("ferry@3") > text.index(" second partly")
    assert page.index("ferry@3") < page.index('id="log-1"')


@pytest.mark.slow
def test_which_logs_take_part_stands_before_all_logs(tmp_path: Path) -> None:
    split, rest = "No common hull fits a on one side and b on the other.", "Current of each log: not confirmed."
    several = [replace(one, notes=(split, rest), gathered=(split,)) for one in campaign()]
    page = report(several, tmp_path).report.read_text(encoding="utf-8")
    assert page.count(split) == page.count(rest) == 1
    assert page.index("<h2>Which logs take part</h2>") < page.index(split) < page.index('id="log-1"')
    assert page.index(rest) > page.index("Notes on all logs")
    assert "Which logs take part" not in report(campaign(), tmp_path).report.read_text(encoding="utf-8")


def test_a_single_log_shares_nothing() -> None:
    assert "In all logs" not in as_text(campaign()[:1])
