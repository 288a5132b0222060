"""Manoeuvres of a plan: within the room, the speeds and the accelerations there are, from rest to rest in the middle."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.identifiability.trial import sailing
from ferryid.planning.limits import CLEARANCE, USED, Limits, limits_of
from ferryid.planning.segments import PEAK, STEP_S, segments
from ferryid.simulate.plant.thrust import curves_of, largest_force
from ferryid.vessel import load_profile

LIMITS = Limits((2.0, 1.2, 0.4), (0.3, 0.2, 0.1), 27.5, 17.5)


@pytest.mark.parametrize("time", [1.0, 2.5])
def test_manoeuvres_begin_and_end_at_rest_in_the_middle_and_keep_within_the_limits(time: float) -> None:
    step = STEP_S * time
    for one in segments(LIMITS, time):
        north, east, heading = one.poses.T
        assert np.allclose(one.poses[[0, -1], :2], 0.0, atol=1e-6), one.says
        assert np.allclose(one.poses[-1], one.poses[-2]), one.says
        turns = heading[-1] / (2.0 * np.pi)
        assert turns == pytest.approx(round(turns), abs=1e-6), one.says
        assert np.abs(north).max() <= LIMITS.long + 1e-6, one.says
        assert np.abs(east).max() <= LIMITS.wide + 1e-6, one.says
        speed = np.diff(one.poses, axis=0) / step
        assert np.hypot(speed[:, 0], speed[:, 1]).max() <= LIMITS.speed[0] * 1.001, one.says
        assert np.abs(speed[:, 2]).max() <= LIMITS.speed[2] * 1.001, one.says
        assert np.abs(np.diff(speed[:, 2])).max() / step <= LIMITS.acceleration[2] * 1.05, one.says


def test_every_axis_is_moved_by_itself_and_with_the_others() -> None:
    found = segments(LIMITS, 1.0)
    moved = {tuple((np.ptp(one.poses, axis=0) > 1e-6).tolist()) for one in found}
    assert {(True, False, False), (False, True, False), (False, False, True), (True, True, True)} <= moved
    assert len({one.says for one in found}) == len(found)


def test_a_multisine_moves_every_axis_at_once_up_to_a_limit_of_the_body_axes() -> None:
    found = [one for one in segments(LIMITS, 1.0) if one.kind == "multisine"]
    assert len(found) >= 4
    for one in found:
        north, east, heading = one.poses.T
        velocity = np.diff(north + 1j * east) / STEP_S * np.exp(-1j * heading[:-1])
        acceleration = np.diff(north + 1j * east, 2) / STEP_S**2 * np.exp(-1j * heading[:-2])
        used = np.array(
            [
                np.abs(part).max() / limit
                for several, limits in ((velocity, LIMITS.speed), (acceleration, LIMITS.acceleration))
                for part, limit in zip((several.real, several.imag), limits, strict=False)
            ]
        )
        assert used[:2].max() <= 1.001, one.says
        assert used[2:].max() <= PEAK * 1.1, one.says
        # No two axes move alike: what acts by their products can be told apart.
        rates = np.corrcoef(np.vstack([velocity.real, velocity.imag, np.diff(heading)]))
        assert np.abs(rates[np.triu_indices(3, 1)]).max() < 0.6, one.says
    assert any(
        np.abs(np.diff(one.poses[:, 2])).max() / STEP_S == pytest.approx(LIMITS.speed[2], rel=0.01) for one in found
    )


def test_speeds_are_those_at_which_damping_takes_the_force() -> None:
    vessel = sailing(load_profile("milliampere"))
    limits = limits_of(vessel, (60.0, 40.0))
    curves = curves_of(vessel)
    force = USED * sum(largest_force(curves, k, True) for k in range(len(vessel.actuators)))
    assert limits.acceleration[0] == pytest.approx(force / vessel.hull.M[0, 0])
    # A hull with quadratic damping alone: force = d u^2.
    hull = replace(vessel.hull, D={"X_|u|u": -400.0, "Y_|v|v": -800.0, "N_|r|r": -9e9})
    plain = limits_of(replace(vessel, hull=hull), (60.0, 40.0))
    assert plain.speed[0] == pytest.approx(sqrt(force / 400.0))
    assert plain.speed[1] == pytest.approx(sqrt(force / 800.0))


def test_room_is_half_the_sides_less_half_a_length_and_the_clearance() -> None:
    vessel = sailing(load_profile("milliampere"))
    for area in ((60.0, 40.0), (40.0, 60.0)):
        limits = limits_of(vessel, area)
        length = vessel.hull.length_m
        assert limits.long == pytest.approx(30.0 - 0.5 * length - CLEARANCE * length)
        assert limits.wide == pytest.approx(20.0 - 0.5 * length - CLEARANCE * length)
    with pytest.raises(
        FerryIdError, match=r"--area: 10x40 m has no room for the turning circle .* Fix: give at least 15x15"
    ):
        limits_of(vessel, (10.0, 40.0))
