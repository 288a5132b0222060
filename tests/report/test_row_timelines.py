"""What the interactive figures of sweeps, comparisons of groups and batches show: every value of the static ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.batch.trend import trends_of
from ferryid.diagnose import Difference, Versus
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.candidate import Candidate
from ferryid.diagnose.judging.group_differences import JudgedGroups
from ferryid.effects import effects
from ferryid.identify import FitSettings, Selection
from ferryid.identify.sweeps import Ratios, Structure, StructureComparison, Sweep
from ferryid.regression.bases import make_basis
from ferryid.regression.cross_validation.folds import Curves
from ferryid.report.batch_page import timelines
from ferryid.report.batch_rows import BatchResult
from ferryid.report.batch_timeline import APART_S
from ferryid.report.structures_timeline import structures_timeline
from ferryid.report.sweep_timeline import sweep_timeline
from ferryid.report.timeline import Strip, Trace
from ferryid.report.versus_timeline import versus_timeline
from ferryid.types import Floats
from ferryid.vessel import load_profile
from tests.batch.rows import finding, result, row

PROFILES = {"milliampere": load_profile("milliampere")}


def traces(strip: Strip) -> dict[str, Trace]:
    return {one.label: one for one in strip.traces}


def ends(trace: Trace) -> Floats:
    assert trace.low is not None
    assert trace.high is not None
    return np.column_stack([trace.low, trace.high])


def sweep(*windows_s: float) -> tuple[Sweep, Selection]:
    """Return a sweep of 4 components in which the base model makes no error in yaw."""
    mse = 10.0 + np.arange(len(windows_s) * 12.0).reshape(len(windows_s), 4, 3)
    curves = Curves(mse, 0.1 * mse, np.array([20.0, 40.0, 0.0]), 5, 100, np.stack([mse] * 5, axis=1))
    choice = Selection(0, windows_s[0], 2, np.zeros(3, dtype=bool), curves)
    what = "both" if len(windows_s) > 1 else "components"
    return Sweep(what, "ferry", (), windows_s, {"blocks": choice}, (), settings=FitSettings()), choice


def test_one_window_shows_every_axis_with_its_standard_error() -> None:
    found, choice = sweep(1.0)
    made = sweep_timeline(found, choice)
    (strip,) = made.strips
    assert made.t.tolist() == [1.0, 2.0, 3.0, 4.0]
    assert traces(strip)["sway"].values == pytest.approx(choice.over_base[0, :, 1])
    assert ends(traces(strip)["surge"]) == pytest.approx(np.outer(choice.over_base[0, :, 0], [0.9, 1.1]))
    assert np.isnan(traces(strip)["yaw"].values).all()
    (span,) = made.spans
    assert (span.first, span.last, span.label) == (1.5, 2.5, "choice: 2 components at a window of 1 s")


def test_several_windows_show_the_score_and_every_axis_with_a_line_each() -> None:
    windows_s = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    found, choice = sweep(*windows_s)
    made = sweep_timeline(found, choice)
    assert [strip.label.partition(":")[0] for strip in made.strips] == ["score", "surge", "sway", "yaw"]
    score, _ = choice.curves.normalised()
    for k, window_s in enumerate(windows_s):
        assert traces(made.strips[0])[f"{window_s:g} s"].values == pytest.approx(score[k])
        assert traces(made.strips[2])[f"{window_s:g} s"].values == pytest.approx(choice.over_base[k, :, 1])
    looks = {(one.colour, one.dash) for one in made.strips[0].traces}
    assert len(looks) == len(windows_s)


def structure(title: str, p: float, value: float, terms: int) -> Structure:
    ratios = Ratios(*(np.array([factor * value, 1.0, 0.0]) for factor in (1.0, 0.8, 1.3)))
    allowed = np.ones((terms, 3), dtype=bool)
    return Structure(title, "coupled", make_basis("modulus"), allowed, 2, (2,), np.ones(3), value, p, ratios, ratios)


def test_structures_are_grouped_by_what_is_said_of_them() -> None:
    every = (structure("a", 1.0, 1.0, 9), structure("b", 0.4, 1.1, 5), structure("c", 0.01, 40.0, 2))
    made = structures_timeline(StructureComparison(every, np.ones(3), 5, 100, 20))
    assert made.axis.names == ("a, coupled", "b, coupled", "c, coupled")
    surge, _, yaw = (traces(strip) for strip in made.strips)
    nan = np.nan
    assert surge["supported"].values == pytest.approx([nan, 1.1, nan], nan_ok=True)
    assert surge["cannot be distinguished from the best"].values == pytest.approx([1.0, nan, nan], nan_ok=True)
    assert surge["poorer"].values == pytest.approx([nan, nan, 40.0], nan_ok=True)
    assert ends(surge["poorer"])[2] == pytest.approx([32.0, 52.0])
    assert np.isnan(yaw["poorer"].values).all(), "nothing has no logarithm"
    # An interval down to zero ends below all values.
    wide = replace(every[0].against_best, low=np.zeros(3))
    made = structures_timeline(
        StructureComparison((replace(every[0], against_best=wide), *every[1:]), np.ones(3), 5, 100, 20)
    )
    assert ends(traces(made.strips[0])["cannot be distinguished from the best"])[0] == pytest.approx([0.5, 1.3])
    # What no structure is is not offered.
    made = structures_timeline(StructureComparison(every[:2], np.ones(3), 5, 100, 20))
    assert "poorer" not in traces(made.strips[0])


def versus(*differences: Difference, compared: tuple[Difference, ...] = ()) -> Versus:
    return Versus("ferry", {}, JudgedGroups(differences, compared, (), (), 1.0), (), "", "")


def test_properties_are_drawn_in_usual_sizes_within_a_frame() -> None:
    gain = Candidate.of(effects()["thruster_gain"], "thruster1", PROFILES["milliampere"])
    (factor,) = gain.parameters
    low, value, high = (factor.neutral + k * factor.size for k in (-2.0, -1.0, 0.5))
    differs = Difference.of(replace(gain, group="B"), {"factor": Estimate(value, low, high, "-")}, 9.0, 0.1, {})
    vague = Estimate(factor.neutral, factor.neutral - 50.0 * factor.size, factor.neutral + 1.0 * factor.size, "-")
    # Of what acts in A, the other sign is that of B relative to A.
    other = Difference.of(replace(gain, group="A"), {"factor": vague}, -1.0, 0.1, {})
    made = versus_timeline(versus(differs, compared=(other,)))
    assert made is not None
    (strip,) = made.strips
    assert ends(traces(strip)["differs"])[0] == pytest.approx([-2.0, 0.5])
    assert traces(strip)["differs"].values[0] == pytest.approx(-1.0)
    assert ends(traces(strip)["no difference seen"])[1] == pytest.approx([-1.0, 50.0])
    assert strip.frame == pytest.approx((-3.15, 3.15))
    assert made.axis.names[0] == "Thruster force (thruster1): factor"
    assert versus_timeline(versus()) is None


def season() -> BatchResult:
    """Return logs whose third and fourth are of one day, given out of order, beside one of no use."""
    several = [
        row("s/4b.mcap", 4, findings=(finding("thruster_gain", "thruster1", 0.3, factor=0.7),)),
        row("s/1.mcap", 1),
        row("s/2.mcap", 2, findings=(finding("thruster_gain", "thruster1", factor=0.9),)),
        row("s/4.mcap", 4, findings=(finding("thruster_gain", "thruster1", factor=0.8),)),
    ]
    bad = {"fit": None, "evaluate": None, "diagnose": None, "start_ns": None, "duration_s": None}
    several.insert(1, row("s/bad.mcap", status="refused", reason="short", **bad))
    return result(*several, trends=trends_of(several, PROFILES))


def test_findings_over_dates_lead_to_the_rows_of_their_logs() -> None:
    made = timelines(season())[0]
    assert made.title == "Thruster force (thruster1), milliampere"
    assert made.axis.names == (
        "2024-05-01 00:00 1.mcap",
        "2024-05-02 00:00 2.mcap",
        "2024-05-04 00:00 4b.mcap",
        "2024-05-04 00:00 4.mcap",
    )
    assert made.axis.links == ("#log-3", "#log-4", "#log-1", "#log-5")
    day = 86400.0
    assert made.t - made.t[0] == pytest.approx([0.0, day, 3.0 * day, 3.0 * day + APART_S])
    (strip,) = made.strips
    nan = np.nan
    assert traces(strip)["found"].values == pytest.approx([nan, 0.9, nan, 0.8], nan_ok=True)
    assert traces(strip)["a hint"].values == pytest.approx([nan, nan, 0.7, nan], nan_ok=True)
    assert ends(traces(strip)["a hint"])[2] == pytest.approx([-0.3, 1.7])
    assert traces(strip)["not found"].values == pytest.approx([1.0, nan, nan, nan], nan_ok=True)


def test_errors_stand_in_their_order_where_a_log_has_no_date() -> None:
    whole = season()
    undated = replace(whole, rows=(*whole.rows[:4], replace(whole.rows[4], date=None)), trends=())
    (made,) = timelines(undated).values()
    assert made.axis.kind == "number"
    assert made.t.tolist() == [1.0, 2.0, 3.0, 4.0]
    assert made.axis.links == ("#log-1", "#log-3", "#log-4", "#log-5")
    surge = traces(made.strips[0])
    assert surge["base model"].values == pytest.approx([20.0, 10.0, 200.0**0.5, 20.0])
    assert surge["evaluated, whole log"].values == pytest.approx([18.0, 9.0, 162.0**0.5, 18.0])
