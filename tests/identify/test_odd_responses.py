"""Logs of several in which the vessel goes against the applied force, or does not follow it, where it does in the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.identify.engagement import ForceResponse, force_response_of, odd_forces
from ferryid.signals.prepare import open_track
from ferryid.vessel import load_profile

BOAT, TANKER = load_profile("vtec-usv"), load_profile("esso-osaka")


def follows(surge: float, sway: float, yaw: float, spread: Sequence[float] = (0.06, 0.2, 0.08)) -> ForceResponse:
    """Return how a vessel follows the applied force on each axis."""
    sigmas = np.full(3, 2.3)
    return ForceResponse(np.array([surge, sway, yaw]), np.asarray(spread), sigmas, np.ones(3, dtype=bool), np.ones(3))


def others(number: int = 4) -> dict[str, ForceResponse | None]:
    return {f"run{k}.csv": follows(0.85 + 0.02 * k, 0.8, 0.9) for k in range(number)}


def test_a_rudder_of_the_wrong_sign_leaves_its_log_out() -> None:
    found = odd_forces({**others(), "odd.csv": follows(0.9, -0.1, -0.8)}, TANKER)
    assert found == {
        "odd.csv": "the yaw moment of the actuators turns the vessel the other way (-0.8 ± 0.08 times what the base model "
        "expects; 0.9 in the 4 other logs). Fix: see whether the sign of propeller.rudder changed, and correct that in this "
        "log, or give it a profile of its own"
    }


def test_a_propeller_of_the_wrong_sign_leaves_its_log_out() -> None:
    found = odd_forces({**others(), "odd.csv": follows(-0.8, 0.6, 0.3)}, TANKER)
    assert list(found) == ["odd.csv"]
    assert "the surge force of the actuators accelerates the vessel the other way (-0.8" in found["odd.csv"]
    assert "the sign of the actuators' thrust or speed changed" in found["odd.csv"]


def test_exchanged_thrusters_leave_their_log_out() -> None:
    found = odd_forces({**others(), "odd.bag": follows(0.9, np.nan, -1.1)}, BOAT)
    assert "see whether actuators are exchanged (port and starboard, bow and stern)" in found["odd.bag"]


@pytest.mark.parametrize(
    "odd",
    [
        follows(0.4, 0.4, 0.45),
        follows(1.8, 1.6, 1.7),
        # A turn to and fro under one weak thruster of two.
        follows(0.0, np.nan, 1.4),
        follows(0.9, 0.1, 0.25),
        # Nothing that is not sure.
        follows(0.9, 0.8, -0.25),
        follows(0.9, 0.8, -0.9, spread=(0.06, 0.2, 0.3)),
        follows(1.0, 1.0, 1.0, spread=(0.5, 0.5, 0.5)),
    ],
)
def test_weak_late_and_unsure_forces_stay(odd: ForceResponse) -> None:
    assert odd_forces({**others(), "odd.csv": odd}, BOAT) == {}


def test_one_actuator_without_an_answer_on_an_axis_leaves_its_log_out() -> None:
    odd = follows(0.9, 0.3, 0.01, spread=(0.06, 0.3, 0.04))
    found = odd_forces({**others(), "odd.csv": odd}, TANKER)
    assert "the vessel does not follow the yaw moment of the actuators (0.01 ± 0.04 times" in found["odd.csv"]
    # With two a weak one may explain it.
    assert odd_forces({**others(), "odd.csv": odd}, BOAT) == {}
    nothing = follows(0.0, np.nan, 0.15, spread=(0.02, np.nan, 0.2))
    assert list(odd_forces({**others(), "odd.csv": nothing}, BOAT)) == ["odd.csv"]


def test_where_most_logs_disagree_none_is_left_out() -> None:
    against = {f"odd{k}.csv": follows(0.9, -0.1, -0.8) for k in range(3)}
    assert odd_forces({**others(3), **against}, TANKER) == {}
    assert odd_forces({**others(2), **against}, TANKER) == {}
    assert list(odd_forces({**others(4), **against}, TANKER)) == list(against)
    # Of two that disagree neither is known to be right.
    assert odd_forces({**others(1), "odd0.csv": against["odd0.csv"]}, TANKER) == {}


def test_logs_that_do_not_show_it_are_not_counted() -> None:
    unsure = {"short.csv": None, "calm.csv": follows(1.0, 1.0, 1.0, spread=(0.5, 0.5, 0.5))}
    found = odd_forces({**others(3), **unsure, "odd.csv": follows(0.9, -0.1, -0.8)}, TANKER)
    assert list(found) == ["odd.csv"]
    assert "0.9 in the 3 logs that show it" in found["odd.csv"]


@pytest.mark.slow
def test_altered_runs_of_a_tanker_are_left_out_and_no_other(shared_data: Callable[[str], Path]) -> None:
    runs = [str(one) for one in sorted(shared_data("esso_osaka/random").glob("*.csv"))[:5]]
    sound = {path: force_response_of(open_track(path, TANKER, None), TANKER) for path in runs}
    assert odd_forces(sound, TANKER) == {}
    for ending, factor, said in (
        (".rudder", -1.0, "turns the vessel the other way"),
        (".speed", -1.0, "accelerates the vessel the other way"),
    ):
        signals = tuple(
            replace(one, sign=factor * one.sign) if one.quantity.endswith(ending) else one for one in TANKER.signals
        )
        altered = replace(TANKER, signals=signals)
        for path in runs:
            odd = force_response_of(open_track(path, altered, None), altered)
            found = odd_forces({**sound, path: odd}, TANKER)
            assert list(found) == [path]
            assert said in found[path]


@pytest.mark.slow
def test_no_true_log_is_left_out_for_its_forces(shared_data: Callable[[str], Path]) -> None:
    for folder, logs, vessel in (("esso_osaka", "*/*.csv", "esso-osaka"), ("kvlcc2", "*.dat", "kvlcc2-model")):
        profile = load_profile(vessel)
        paths = sorted(shared_data(folder).glob(logs))
        found = {str(one): force_response_of(open_track(str(one), profile, None), profile) for one in paths}
        assert len(found) == {"esso-osaka": 18, "kvlcc2-model": 5}[vessel]
        assert odd_forces(found, profile) == {}
