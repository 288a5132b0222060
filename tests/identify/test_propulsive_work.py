"""Logs in which a vessel keeps its way without the work that it takes, by the record of its actuators."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.identify.engagement import ForceResponse, force_response_of, odd_forces
from ferryid.identify.propulsive_work import PropulsiveWork, propulsive_work, undriven
from ferryid.signals.prepare import open_track
from ferryid.signals.track import Motion
from ferryid.types import Floats
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile

TANKER = load_profile("esso-osaka")
SECONDS, RATE_HZ, RESISTANCE = 300.0, 10.0, 6.0
EXPOSURE = SECONDS * 0.3 ** np.array([2.0, 3.0])


def works(share: float = 1.0, gained: float = 0.0, speed: float = 0.3, spread: float = 0.02) -> PropulsiveWork:
    """Return the work of actuators that do a share of what the vessel takes, a vessel of 4 J."""
    exposure = EXPOSURE * (speed / 0.3) ** np.array([2.0, 3.0])
    full = RESISTANCE * exposure[0]
    spreads = np.full((2, 2), spread * full) / exposure
    return PropulsiveWork(speed, share * full, gained, full / 20.0, exposure, spreads, along=True, under_way=True)


def others(number: int = 4) -> dict[str, PropulsiveWork]:
    return {f"run{k}.csv": works(1.0 + 0.1 * k) for k in range(number)}


def moving(surge: Floats, heading: Floats, force: Floats, current: tuple[float, float] = (0.0, 0.0)) -> Motion:
    """Return the motion of a vessel that goes along its bow through water that moves, by its surge force alone."""
    bow = np.column_stack([np.cos(heading), np.sin(heading)])
    drift = np.column_stack([bow @ current, bow @ (current[1], -current[0])])
    nu = np.column_stack([surge, np.zeros_like(surge), np.gradient(heading, 1.0 / RATE_HZ)])
    nu[:, :2] += drift
    tau = np.column_stack([force, np.zeros_like(force), np.zeros_like(force)])
    t = np.arange(len(surge)) / RATE_HZ
    eta = np.column_stack([np.zeros_like(t), np.zeros_like(t), heading])
    valid = np.ones(len(t), dtype=bool)
    return Motion("run.csv", t, RATE_HZ, eta, nu, np.gradient(nu, 1.0 / RATE_HZ, axis=0), tau, valid, nu)


TIME = np.arange(SECONDS * RATE_HZ) / RATE_HZ
ZIGZAG = np.radians(20.0) * np.sin(2.0 * np.pi * TIME / 40.0)


def noisy(speed: float, seed: int = 0) -> Floats:
    return speed + 0.01 * np.random.default_rng(seed).standard_normal(len(TIME))


def under_way(motion: Motion) -> bool:
    found = propulsive_work(motion, TANKER)
    assert found is not None
    return found.under_way


def test_a_propeller_that_stands_still_by_its_record_leaves_its_log_out() -> None:
    assert undriven({**others(), "odd.csv": works(-0.05)}) == {
        "odd.csv": "the vessel keeps its way at 0.3 m/s without the work of its actuators (-0.05 ± 0.02 times the least that "
        "it takes at this speed in 4 other logs). Fix: see whether the propulsion is recorded as standing still, or something "
        "else drove the vessel, and correct that in this log, or give it a profile of its own"
    }


def test_a_propeller_of_the_wrong_sign_leaves_its_log_out() -> None:
    found = undriven({**others(), "odd.csv": works(-1.0)})
    assert "without the work of its actuators (-1 ± 0.02 times" in found["odd.csv"]
    assert "Fix: see whether the sign of the actuators' thrust or speed changed and correct" in found["odd.csv"]


@pytest.mark.parametrize(
    "log",
    [
        works(0.5),
        works(0.3),
        # It loses its way.
        works(0.0, gained=-0.2 * RESISTANCE * EXPOSURE[0]),
        # What is not sure, slow, short, or no way of its own.
        works(0.0, spread=0.1),
        works(0.0, speed=0.12),
        replace(works(0.0), energy=1.1 * RESISTANCE * EXPOSURE[0]),
        replace(works(0.0), under_way=False),
    ],
)
def test_logs_that_may_be_sound_stay(log: PropulsiveWork) -> None:
    assert undriven({**others(), "log.csv": log}) == {}


def test_as_many_logs_as_show_what_it_takes_or_too_few_leave_none_out() -> None:
    odd = {f"odd{k}.csv": works(0.0) for k in range(3)}
    assert undriven({**others(3), **odd}) == {}
    assert list(undriven({**others(4), **odd})) == list(odd)
    assert undriven({**others(1), "odd0.csv": works(0.0)}) == {}


def test_a_vessel_under_way_is_seen_by_a_course_that_turns_with_its_bow() -> None:
    force = np.zeros_like(TIME)
    assert under_way(moving(noisy(0.3), ZIGZAG, force))
    assert under_way(moving(noisy(0.3), TIME / 20.0, force, current=(0.1, 0.0)))
    # Neither with the current, nor straight on, nor to and fro.
    assert not under_way(moving(noisy(0.0), ZIGZAG, force, current=(0.3, 0.0)))
    assert not under_way(moving(noisy(0.3), 0.0 * ZIGZAG, force))
    assert not under_way(moving(noisy(0.3) * np.sign(np.sin(TIME / 20.0)), ZIGZAG, force))


def test_the_work_is_that_of_the_part_in_which_the_way_is_kept() -> None:
    speed = 0.3 + 0.3 * np.exp(-TIME / 30.0)
    found = propulsive_work(moving(speed, ZIGZAG, np.full_like(TIME, 0.5)), TANKER)
    assert found is not None
    assert found.speed < 0.33
    assert found.driven
    assert found.resistance[0] * found.speed == pytest.approx(0.5, rel=0.05)
    # One that only loses it is never judged.
    lengths = np.log(1.0 + TIME / 30.0)
    coasting = moving(0.3 / (1.0 + TIME / 30.0), np.radians(20.0) * np.sin(5.0 * lengths), np.zeros_like(TIME))
    assert propulsive_work(coasting, TANKER) is None


def test_a_vessel_without_measured_sway_or_a_short_log_is_not_judged() -> None:
    motion = moving(noisy(0.3), ZIGZAG, np.full_like(TIME, 0.5))
    assert propulsive_work(replace(motion, sway_measured=False), TANKER) is None
    valid = np.arange(len(TIME)) < 200
    assert propulsive_work(replace(motion, valid=valid), TANKER) is None


def altered(profile: Profile, factor: float) -> Profile:
    """Return a profile by which the propeller turns, and pushes, by another factor than it is recorded to."""
    endings = (".speed", ".thrust")
    signals = tuple(
        replace(one, sign=factor * one.sign) if one.quantity.endswith(endings) else one for one in profile.signals
    )
    return replace(profile, signals=signals)


def responses(paths: list[str], profile: Profile) -> Mapping[str, ForceResponse | None]:
    return {path: force_response_of(open_track(path, profile, None), profile) for path in paths}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("logs", "vessel", "fewest"), [("esso_osaka/zigzag/*.csv", "esso-osaka", 7), ("kvlcc2/*.dat", "kvlcc2-model", 4)]
)
def test_zigzags_without_revolutions_or_with_reversed_ones_are_left_out(
    logs: str, vessel: str, fewest: int, shared_data: Callable[[str], Path]
) -> None:
    profile = load_profile(vessel)
    folder, _, pattern = logs.rpartition("/")
    paths = [str(one) for one in sorted(shared_data(folder).glob(pattern))]
    sound = responses(paths, profile)
    assert odd_forces(sound, profile) == {}
    for factor in (0.0, -1.0):
        odd = responses(paths, altered(profile, factor))
        found = [odd_forces({**sound, path: odd[path]}, profile) for path in paths]
        assert all(not set(one) - {path} for one, path in zip(found, paths, strict=True))
        assert sum(map(len, found)) >= fewest


@pytest.mark.slow
def test_thrusters_that_a_log_shows_at_rest_for_a_part_of_it_leave_it_in(shared_data: Callable[[str], Path]) -> None:
    boat = load_profile("vtec-usv")
    paths = [str(one) for one in sorted(shared_data("vtec_usv").glob("exp*.bag"))]
    assert odd_forces(responses(paths, boat), boat) == {}
