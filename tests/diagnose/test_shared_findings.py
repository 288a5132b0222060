"""What one log of a vessel shows alone."""

from __future__ import annotations

from dataclasses import replace

from ferryid.diagnose.result import Diagnosis
from ferryid.diagnose.shared_findings import agreed
from tests.diagnose.test_hints import found


def log(name: str, *findings: str) -> Diagnosis:
    return Diagnosis(name, "ferry", "explained", tuple(found(effect, sway=0.5) for effect in findings), {}, {}, ())


def test_a_property_of_the_vessel_that_few_logs_show_is_a_hint() -> None:
    made = agreed([log("a", "thrust_inflow_loss"), log("b"), log("c"), log("d")])
    (one,) = made[0].findings
    assert not one.sure
    assert made[0].verdict == "unexplained"
    assert "Inflow loss" in made[0].notes[-1]
    assert made[1:] == (log("b"), log("c"), log("d"))


def test_what_half_of_them_show_stands_and_so_does_what_is_a_logs_own() -> None:
    both = [log("a", "thrust_inflow_loss", "wind"), log("b", "thrust_inflow_loss"), log("c"), log("d")]
    assert agreed(both) == tuple(both)
    wind = [log("a", "wind"), log("b"), log("c")]
    assert agreed(wind) == tuple(wind)
    # Two logs are too few to call one of them alone, and a fault that began in a log is that log's.
    two = [log("a", "thrust_inflow_loss"), log("b")]
    assert agreed(two) == tuple(two)
    began = log("a", "thruster_gain")
    began = replace(began, findings=(replace(began.findings[0], onset_s=30.0),))
    assert agreed([began, log("b"), log("c")])[0] == began


def test_what_else_is_sure_keeps_the_verdict() -> None:
    made = agreed([log("a", "thrust_inflow_loss", "wind"), log("b"), log("c"), log("d")])
    assert [one.sure for one in made[0].findings] == [False, True]
    assert made[0].verdict == "partly_explained"
