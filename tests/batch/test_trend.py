"""Trends: told where dates matter, by ranks that can be counted by hand, and seldom where there is nothing."""

from __future__ import annotations

from dataclasses import replace
from math import comb

import numpy as np
import pytest
from scipy.stats import rankdata

from ferryid.batch import trend as trending
from ferryid.batch.trend import trend, trends_of
from ferryid.report.batch_rows import DiagnosisSummary, FindingSummary, ParameterEstimate, SummaryRow
from ferryid.vessel import load_profile
from tests.batch.rows import row as any_row


def test_growth_and_its_chance() -> None:
    kind, change = trend([1.0, 1.1, 1.3, 1.6, 2.0, 2.5])
    assert kind == "grows"
    # Two of all 6! = 720 orders are monotone; 4000 shuffles see that within their scatter.
    assert change["chance"] == pytest.approx(2 / 720, abs=3 * (2 / 720 / 4000) ** 0.5)
    assert (change["before"], change["after"]) == pytest.approx((1.05, 2.25))
    assert trend([6.0, 5.0, 4.0, 3.0, 2.0, 1.0])[0] == "falls"


def test_a_step_and_its_chance() -> None:
    kind, change = trend([0.0] * 7 + [200.0, 205.0, 195.0, 210.0, 190.0])
    assert kind == "steps"
    assert change["at"] == 7
    assert (change["before"], change["after"]) == (0.0, 200.0)
    # As far apart are only those orders in which the five are all last, or all first.
    assert change["chance"] == pytest.approx(2 / comb(12, 5), abs=3 * (2 / comb(12, 5) / 4000) ** 0.5)


@pytest.mark.slow
def test_steady_values_seldom_look_like_a_trend() -> None:
    rng = np.random.default_rng(0)
    told = [trend(rng.standard_normal(n))[0] is not None for n in range(6, 30) for _ in range(40)]
    # Two tests at one in a hundred each.
    assert np.mean(told) < 0.02 + 3.0 * (0.02 / len(told)) ** 0.5


def test_too_few_or_all_alike() -> None:
    assert trend([1.0, 2.0, 3.0, 4.0, 5.0]) == (None, {})
    assert trend([3.0] * 20) == (None, {})
    assert trend([]) == (None, {})


def test_ranks_are_those_of_scipy() -> None:
    for seed in range(5):
        y = np.random.default_rng(seed).integers(0, 6, 15).astype(np.float64)
        assert np.array_equal(trending._ranks(y), rankdata(y))


def row(
    day: int, verdict: str = "matched", date: str | None = "", vessel: str = "milliampere", **found: dict[str, float]
) -> SummaryRow:
    """Return a row with findings; their probability is 0.9 but where ``p`` says else."""
    findings = tuple(
        FindingSummary(
            effect,
            None,
            values.get("p", 0.9),
            {
                name: ParameterEstimate(value, value - 1.0, value + 1.0, "-")
                for name, value in values.items()
                if name != "p"
            },
            "",
        )
        for effect, values in found.items()
    )
    return replace(
        any_row(f"day{day}"),
        vessel=vessel,
        date=f"2024-05-{day:02d}T00:00:00+00:00" if date == "" else date,
        diagnose=DiagnosisSummary("", None, verdict, findings, {}, {}),
    )


PROFILES = {"milliampere": load_profile("milliampere")}


def test_over_dates_whatever_their_order_with_absence_as_neutral() -> None:
    days = [row(day) for day in (1, 2, 3)] + [
        row(day, fouling={"surge": 1.0 + 0.1 * day, "p": 0.9 if day % 2 else 0.4}) for day in range(4, 11)
    ]
    # What could not be tested says nothing of absence.
    days.append(row(11, "not_testable"))
    (found,) = trends_of(days[::-1], PROFILES)
    assert [point.log for point in found.points] == [f"day{day}" for day in range(4, 11)]
    assert [where.log for where in found.absent] == ["day1", "day2", "day3"]
    assert found.neutral == 1.0
    assert found.kind == "grows"
    assert found.sentence == (
        "milliampere: Fouling, surge grows from 1 to 1.9 (first and last third), 2024-05-01 to 2024-05-10 "
        "(4 of 7 findings are hints)"
    )


def test_a_payload_steps_and_its_place_has_no_meaning_without_it() -> None:
    rows = [row(day) for day in range(1, 7)] + [row(day, payload={"mass": 200.0, "x": 0.5}) for day in range(7, 13)]
    found = {one.parameter: one for one in trends_of(rows, PROFILES)}
    assert found["mass"].sentence == (
        "milliampere: Payload, mass steps from 0 to 200 between 2024-05-06 and 2024-05-07"
    )
    assert found["x"].neutral is None
    assert found["x"].kind is None


def test_without_dates_in_the_order_of_the_logs_and_no_times_within_them() -> None:
    rows = [row(day, date=None if day == 3 else "", wind={"north": 1.0, "onset": 9.0}) for day in (5, 3, 1)]
    (found,) = trends_of(rows, PROFILES)
    assert found.parameter == "north"
    assert not found.dated
    assert [point.log for point in found.points] == ["day5", "day3", "day1"]


def test_vessels_by_themselves() -> None:
    rows = [row(1, fouling={"surge": 1.2}), row(2, vessel="revolt", fouling={"surge": 1.3})]
    found = trends_of(rows, {**PROFILES, "revolt": load_profile("revolt")})
    assert [(one.vessel, len(one.points)) for one in found] == [("milliampere", 1), ("revolt", 1)]
