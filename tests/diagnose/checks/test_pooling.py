"""Errors of sensors that several logs of a vessel show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.checks import clock_offset, examine, examine_together, yaw_rate_scale
from ferryid.diagnose.checks.check import Check, Lasting, SensorFinding
from ferryid.diagnose.checks.pooling import Common, Examined, pool, pool_check
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from tests.diagnose.checks.test_short_logs import turning

CLOCK = clock_offset.CHECK.lasting
assert isinstance(CLOCK, Lasting)
ROWS, LATE_S = 8, 0.8


def logs(*values: float, error: float = 0.05) -> list[dict[str, Estimate]]:
    return [{"seconds": Estimate.normal(one, error, "s")} for one in values]


def test_a_common_value_is_known_better_than_that_of_one_log_and_worse_where_logs_scatter() -> None:
    alike, apart = (Common.of(np.array(values), np.full(4, 0.05)) for values in ([0.3] * 4, [0.1, 0.2, 0.4, 0.5]))
    assert alike.error == pytest.approx(0.025)
    assert alike.scatter == 0.0
    assert apart.value == pytest.approx(0.3)
    assert apart.scatter == pytest.approx(np.std([0.1, 0.2, 0.4, 0.5], ddof=1), rel=0.1)
    width = [one.estimate("s").high - one.estimate("s").low for one in (alike, apart)]
    # Of four logs the scatter is hardly known: Student's distribution of three degrees of freedom.
    assert width[1] == pytest.approx(2.0 * 3.182 * np.std([0.1, 0.2, 0.4, 0.5], ddof=1) / 2.0, rel=0.02)
    assert width[1] > 5.0 * width[0]


@pytest.mark.parametrize(("k", "scatter"), [(3, 0.0), (9, 0.0), (9, 0.1)])
def test_intervals_of_common_values_hold_the_truth(k: int, scatter: float) -> None:
    rng = np.random.default_rng(4)
    held = 0
    for _ in range(400):
        errors = rng.uniform(0.03, 0.1, k)
        one = Common.of(0.3 + np.hypot(errors, scatter) * rng.normal(size=k), errors).estimate("s")
        held += one.low <= 0.3 <= one.high
    assert 0.92 <= held / 400 <= 1.0


def test_evidence_of_logs_adds_up() -> None:
    few, many = pool(logs(0.2, 0.2), CLOCK, 0.1), pool(logs(*[0.2] * 8), CLOCK, 0.1)
    assert few is not None
    assert many is not None
    assert many.evidence > 3.5 * few.evidence
    assert many.parameters["seconds"].value == pytest.approx(0.2)


def test_a_log_that_differs_has_no_say() -> None:
    found = pool(logs(0.3, 0.31, 0.29, 0.3, -0.9), CLOCK, 0.1)
    assert found is not None
    assert found.apart == {4}
    assert found.parameters["seconds"].value == pytest.approx(0.3)


@pytest.mark.parametrize(
    "values",
    [(0.3, 0.31, -0.4, -0.41), (0.9, 0.1, 0.5, -0.3), (0.3, 0.9), (0.01, 0.02, 0.0, 0.01), (0.05, 0.05, 0.05)],
    ids=["two against two", "all over", "two that differ", "nothing", "too small to matter"],
)
def test_what_logs_do_not_share_is_no_property_of_the_vessel(values: tuple[float, ...]) -> None:
    assert pool(logs(*values, error=0.02), CLOCK, 0.1) is None


def late(measured: Measurements, rows: int = ROWS) -> Measurements:
    """Return measurements whose positions come some rows late."""
    eta = np.column_stack([np.roll(measured.eta[:, :2], rows, axis=0), measured.eta[:, 2]])
    return replace(measured, eta=eta, usable=np.arange(len(eta)) >= rows)


def together(every: list[Measurements]) -> tuple[Examined, ...]:
    return examine_together(every, [examine(one)[0] for one in every], [False] * len(every))


def test_what_several_logs_show_is_corrected_in_all_of_them() -> None:
    # The last is too short to show anything by itself.
    every = [late(turning(seed)) for seed in (3, 4, 5)] + [late(turning(6, 30.0))]
    assert [bool(examine(one)[0]) for one in every] == [True, True, True, False]
    found = together(every)
    (first,) = found[0].findings
    assert first.effect == "clock_offset"
    assert first.vessel
    assert first.parameters["seconds"].low <= LATE_S <= first.parameters["seconds"].high
    assert all(one.findings == [first] for one in found)
    late_by = first.parameters["seconds"].value
    for measured, one in zip(every, found, strict=True):
        shown = np.interp(measured.t + late_by, measured.t, measured.eta[:, 0])
        inside = one.measurements.usable
        assert inside.sum() > 0.9 * len(inside)
        assert np.abs(one.measurements.eta[inside, 0] - shown[inside]).max() < 1e-9
    # By itself no log as short as these is corrected.
    assert examine(every[0])[1] is every[0]


def test_a_log_that_differs_keeps_its_own_and_says_so() -> None:
    every = [*(late(turning(seed)) for seed in (3, 4, 5)), late(turning(6), 16), turning(7)]
    found = together(every)
    assert [[each.vessel for each in one.findings] for one in found] == [[True], [True], [True], [False], []]
    own = found[3].findings[0].parameters["seconds"]
    assert own.low <= 2.0 * LATE_S <= own.high
    assert "It keeps its own." in found[3].notes[0]
    assert "Nothing is corrected in it." in found[4].notes[0]
    assert found[4].measurements is every[4]
    assert "2 logs differ from it" in found[0].findings[0].says


def test_what_logs_show_that_differ_from_the_rest_is_not_what_the_rest_have() -> None:
    # Two logs show errors that have nothing to do with each other; the others, which show none, agree on something small.
    names = (1.5, -1.5, 0.3, 0.3, 0.3, 0.3)
    small = turning(7, 30.0)
    found = [{"clock_offset": own(value)} if k < 2 else {} for k, value in enumerate(names)]
    every = [Examined(one, replace(small)) for one in found]
    value_of = {id(one.measurements): value for one, value in zip(every, names, strict=True)}
    check = replace(clock_offset.CHECK, estimate=lambda one: logs(value_of[id(one)])[0])
    pool_check(check, (), every)
    assert [[each.vessel for each in one.findings] for one in every] == [[False], [False], [], [], [], []]
    # With one more that shows it, they are counted alone.
    again = [Examined(one, replace(small)) for one in (*found[:2], *[{"clock_offset": own(0.3)}] * 2, {}, {})]
    value_of |= {id(one.measurements): value for one, value in zip(again, names, strict=True)}
    pool_check(check, (), again)
    assert [[each.vessel for each in one.findings] for one in again] == [[False], [False], *[[True]] * 4]
    assert "2 of 6 logs show it alone as well, 2 logs differ from it" in again[2].findings[0].says


def test_a_scale_that_differs_from_log_to_log_is_no_instruments() -> None:
    def scales(check: Check, *values: float) -> list[Examined]:
        every = [Examined({check.id: SensorFinding(check.id, *shown(one))}, turning(7, 30.0)) for one in values]
        pool_check(check, (), every)
        return every

    def shown(value: float) -> tuple[dict[str, Estimate], str, Callable[[Measurements], Measurements]]:
        return {"factor": Estimate.normal(value, 0.005, "-")}, "Scaled.", lambda one: one

    found = scales(yaw_rate_scale.CHECK, 1.037, 1.106, 1.2)
    assert all("its size differs between the logs" in one.findings[0].doubt for one in found)
    assert all(one.findings[0].vessel and not one.findings[0].doubt for one in scales(yaw_rate_scale.CHECK, 1.1, 1.1))
    # One log alone has nothing to compare with, and a clock may be set anew for every log.
    assert scales(yaw_rate_scale.CHECK, 1.1)[0].findings[0].doubt == ""
    clocks = [Examined({"clock_offset": own(one)}, turning(7, 30.0)) for one in (0.5, 1.5)]
    pool_check(clock_offset.CHECK, (), clocks)
    assert [one.findings[0].doubt for one in clocks] == ["", ""]


def own(seconds: float) -> SensorFinding:
    return SensorFinding("clock_offset", logs(seconds)[0], "Late.", lambda one: one)


def test_one_log_alone_and_copies_of_it_are_no_campaign() -> None:
    once, clean = late(turning(3)), turning(7)
    own = [examine(one)[0] for one in (once, once, clean)]
    found = examine_together([once, once, clean], own, [False, True, False])
    assert not any(finding.vessel for one in found for finding in one.findings)
    assert [len(one.findings) for one in found] == [1, 1, 0]
    # A copy of a log of a campaign is corrected as the log is, and counts for nothing.
    every = [once, once, late(turning(4))]
    found = examine_together(every, [examine(one)[0] for one in every], [False, True, False])
    assert all(one.findings == found[0].findings for one in found)
    assert "2 of 2 logs show it alone as well" in found[0].findings[0].says
    assert found[0].findings[0].parameters == together([once, every[2]])[0].findings[0].parameters
