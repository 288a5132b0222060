"""What is told of a condition of single logs that held-out stretches speak against."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ferryid.diagnose.judging.campaign_conditions import ConditionTest, note
from ferryid.diagnose.judging.campaign_evidence import Gain, HeldOutLoss
from ferryid.effects import effects

PLACE = {"trials/long.bag": 0, "trials/short.bag": 1}
SHORT = np.array([0, 0, 1])


def told(lost: tuple[float, float, float], high: float, log: np.ndarray = SHORT) -> str:
    """Return the note on a current that loses log-likelihood on the stretches of two logs."""
    current = SimpleNamespace(effect=effects()["current"])
    campaign = SimpleNamespace(members=[SimpleNamespace(conditions=[current])] * 2, conditions=[current])
    loss = [HeldOutLoss(np.array(squares), log, ()) for squares in ((0.0, 0.0, 0.0), tuple(2.0 * one for one in lost))]
    fit = SimpleNamespace(campaign=campaign)
    test = ConditionTest("current", fit, fit, tuple(loss), 1.0, Gain(-sum(lost), -999.0, high), {})  # type: ignore[arg-type]
    return note(cast("ConditionTest", test), PLACE)


def test_the_log_that_loses_most_is_named() -> None:
    text = told((10.0, 20.0, 90.0), -40.0)
    assert text.endswith("Those stretches are predicted worse with it, most in short.bag (-90 nat).")


def test_a_log_of_several_stretches_knows_its_own() -> None:
    text = told((50.0, 60.0, 90.0), -40.0)
    assert text.endswith("most in long.bag (-110 nat).")


@pytest.mark.parametrize("high", [0.0, 5.0])
def test_what_may_be_no_worse_has_no_more_to_tell(high: float) -> None:
    assert "predicted worse" not in told((10.0, 20.0, 90.0), high)


@pytest.mark.parametrize(
    ("doubts", "expected"),
    [
        ({0: "", 1: ""}, "confirmed"),
        ({0: "", 1: "it is small"}, "confirmed in 1 log, a hint in 1 log, as it is small"),
        ({0: "it is small", 1: "it is small"}, "it is confirmed in none: a hint in 2 logs, as it is small"),
        ({}, "it is confirmed in none: no log distinguishes it from none"),
    ],
)
def test_what_all_logs_confirm_is_said_to_be_a_hint_in_those_where_it_is_one(
    doubts: dict[int, str], expected: str
) -> None:
    current = SimpleNamespace(effect=effects()["current"])
    campaign = SimpleNamespace(members=[SimpleNamespace(conditions=[current])] * 2, conditions=[current])
    test = SimpleNamespace(
        effect="current",
        fit=SimpleNamespace(campaign=campaign),
        beside=(),
        confirmed=True,
        seen=lambda i: 0.9 if i in doubts else 0.1,
        value_doubt=doubts.get,
        evidence=20.0,
        gain=Gain(30.0, 10.0, 50.0),
        placebos={},
    )
    text = note(cast("ConditionTest", test), PLACE)
    assert f"{expected}. Over none" in text
