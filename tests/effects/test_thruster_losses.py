"""What thrusters lose to the water's inflow and to each other's wakes, by hand."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin, sqrt

import numpy as np
import pytest

from ferryid.effects import effects
from ferryid.effects.actuator_force import curve_force
from ferryid.effects.force_model import ForceModel, Measurements, between, hull_of
from ferryid.types import Floats
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")
N = 6
INFLOW, INTERACTION = effects()["thrust_inflow_loss"], effects()["thruster_interaction"]


def pushed(forces: list[tuple[float, float]], nu: tuple[float, float, float], psi: float = 0.0) -> ForceModel:
    """Return the force model of a ferry whose thrusters push with (X, Y) [N] each, in every row alike."""
    parts = np.zeros((N, 2, 3))
    for k, (X, Y) in enumerate(forces):
        x, y = FERRY.actuators[k].position_m
        parts[:, k] = X, Y, x * Y - y * X
    angles = np.tile([np.arctan2(Y, X) for X, Y in forces], (N, 1))
    motion = np.tile(nu, (N, 1))
    eta = np.tile([0.0, 0.0, psi], (N, 1))
    measurements = Measurements(FERRY, 0.2 * np.arange(N), eta, motion, motion, parts, angles, np.ones(N, dtype=bool))
    return ForceModel(measurements, hull_of(FERRY), parts, angles, np.zeros((N, 3)))


def test_thrust_falls_by_the_velocity_along_the_push_of_each_thruster() -> None:
    u, v, r = 0.8, -0.3, 0.2
    forces = [(100.0, 0.0), (0.0, 50.0)]
    before = pushed(forces, (u, v, r))
    after = INFLOW.apply(before, np.array([0.25]), None)
    (x_0, y_0), (x_1, _) = (one.position_m for one in FERRY.actuators)
    assert x_0 != x_1
    kept = [1.0 - 0.25 * (u - r * y_0), 1.0 - 0.25 * (v + r * x_1)]
    np.testing.assert_allclose(after.parts, before.parts * np.array(kept)[None, :, None], rtol=1e-13)


def test_water_that_moves_along_takes_no_thrust() -> None:
    heading, speed = radians(30.0), 0.6
    before = replace(
        pushed([(100.0, 0.0), (60.0, 0.0)], (speed, 0.0, 0.0), heading),
        flow=np.tile([speed * cos(heading), speed * sin(heading)], (N, 1)),
    )
    np.testing.assert_allclose(INFLOW.apply(before, np.array([0.25]), None).parts, before.parts, rtol=1e-13)


def test_no_more_than_all_thrust_is_lost_and_none_of_no_thrust() -> None:
    before = pushed([(100.0, 0.0), (0.0, 0.0)], (9.0, 0.0, 0.0))
    assert np.array_equal(INFLOW.apply(before, np.array([0.25]), None).parts, np.zeros((N, 2, 3)))


def test_a_flow_of_other_rows_is_refused() -> None:
    before = replace(pushed([(100.0, 0.0), (60.0, 0.0)], (1.0, 0.0, 0.0)), flow=np.zeros((N + 1, 2)))
    with pytest.raises(ValueError, match="7 rows of flow, 6 of motion"):
        INFLOW.apply(before, np.array([0.25]), None)


def wake(angle_deg: float, share: float) -> ForceModel:
    """Return the fore thruster in the wake of the aft one: so many degrees beside it, at a share of the most that it gives."""
    ahead, aside = (a - b for a, b in zip(FERRY.actuators[1].position_m, FERRY.actuators[0].position_m, strict=True))
    angle = np.arctan2(aside, ahead) + np.pi + radians(angle_deg)
    force = share * largest()
    across = np.arctan2(aside, ahead) + 0.5 * np.pi
    return pushed(
        [(force * np.cos(angle), force * np.sin(angle)), (80.0 * np.cos(across), 80.0 * np.sin(across))], (0, 0, 0)
    )


def largest() -> float:
    """Return the most that the aft thruster gives ahead [N]."""
    actuator = FERRY.actuators[0]
    assert actuator.thrust is not None
    factor = 60.0 if actuator.thrust.input_unit == "rps" else 1.0
    return float(curve_force(actuator, factor * np.array([actuator.thrust.valid[1]]))[0])


@pytest.mark.parametrize(("angle_deg", "share"), [(0.0, 1.0), (0.0, 0.25), (17.0, 1.0), (-17.0, 0.25), (100.0, 1.0)])
def test_a_wake_takes_the_root_of_its_share_and_the_sixteenth_power_of_its_cosine(
    angle_deg: float, share: float
) -> None:
    before = wake(angle_deg, share)
    after = INTERACTION.apply(before, np.array([0.3]), None)
    lost = 0.3 * sqrt(share) * max(cos(radians(angle_deg)), 0.0) ** 16
    np.testing.assert_allclose(after.parts[:, 1], (1.0 - lost) * before.parts[:, 1], rtol=1e-9)
    # The one in front pushes across: its wake goes nowhere near the other.
    np.testing.assert_allclose(after.parts[:, 0], before.parts[:, 0], rtol=1e-9)


@pytest.mark.parametrize(("onset_s", "offset_s"), [(0.4, np.inf), (0.0, 0.6), (0.4, 0.8), (0.39, 0.81), (9.0, np.inf)])
@pytest.mark.parametrize("place", ["parts", "external", "flow", "load", "damping_factor"])
def test_between_two_times_and_nowhere_else(onset_s: float, offset_s: float, place: str) -> None:
    before = pushed([(1.0, 0.0), (1.0, 0.0)], (0.0, 0.0, 0.0))
    shape = {"parts": (N, 2, 3), "external": (N, 3), "flow": (N, 2), "load": (N, 5), "damping_factor": (N,)}[place]
    after = replace(before, **{place: np.full(shape, 7.0)})
    old: Floats | None = getattr(before, place)
    blank = np.full(shape, 1.0 if place == "damping_factor" else 0.0) if old is None else old
    rows = (before.measurements.t >= onset_s) & (before.measurements.t < offset_s)
    found = getattr(between(before, after, onset_s, offset_s), place)
    assert np.array_equal(found[rows], np.full(shape, 7.0)[rows])
    assert np.array_equal(found[~rows], blank[~rows])
    # What was there before and ends where the other has nothing.
    back = getattr(between(after, before, onset_s, offset_s), place)
    assert np.array_equal(back[rows], blank[rows])
    assert np.array_equal(back[~rows], np.full(shape, 7.0)[~rows])
