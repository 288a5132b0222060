"""What thrusters lose to the water's inflow and to each other's wakes, and what acts for a time, by hand."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin, sqrt

import numpy as np
import pytest

from ferryid.diagnose.inference.candidate import OtherHeading
from ferryid.effects import effects
from ferryid.effects.actuator_force import curve_force
from ferryid.effects.effect import Effect
from ferryid.effects.force_model import ForceModel, Measurements, acceleration, between, hull_of
from ferryid.types import Floats
from ferryid.vessel import load_profile, parse_profile
from ferryid.vessel.profile import Profile
from tests.effects import fixed_propellers

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


def test_no_more_than_twice_the_thrust_is_gained_from_behind() -> None:
    before = pushed([(100.0, 0.0), (50.0, 0.0)], (-9.0, 0.0, 0.0))
    assert np.array_equal(INFLOW.apply(before, np.array([0.25]), None).parts, 2.0 * before.parts)


def test_a_flow_in_whole_numbers_is_one_as_any_other() -> None:
    before = replace(pushed([(100.0, 0.0), (60.0, 0.0)], (1.0, 0.0, 0.0), 0.7), flow=np.ones((N, 2), dtype=np.int64))
    same = replace(before, flow=np.ones((N, 2)))
    np.testing.assert_array_equal(acceleration(before), acceleration(same))


@pytest.mark.parametrize("effect", [INFLOW, INTERACTION])
def test_rows_that_do_not_belong_together_are_refused(effect: Effect) -> None:
    before = pushed([(100.0, 0.0), (60.0, 0.0)], (1.0, 0.0, 0.0))
    short = replace(before.measurements, nu=before.measurements.nu[1:])
    turned = replace(before.measurements, eta=before.measurements.eta[1:])
    for wrong in (
        replace(before, flow=np.zeros((N + 1, 2))),
        replace(before, parts=before.parts[1:]),
        replace(before, measurements=short),
        replace(before, measurements=turned, flow=np.zeros((N, 2))),
        replace(before, parts=before.parts[:, :1]),
    ):
        with pytest.raises(ValueError, match=r"other lengths|of 2 actuators"):
            effect.apply(wrong, np.array([0.25]), None)


@pytest.mark.parametrize("effect", [INFLOW, INTERACTION])
def test_a_vessel_without_actuators_loses_nothing(effect: Effect) -> None:
    before = pushed([(100.0, 0.0), (60.0, 0.0)], (1.0, 0.0, 0.0))
    bare = replace(before.measurements, profile=replace(FERRY, actuators=()))
    nothing = replace(before, measurements=bare, parts=before.parts[:, :0], angles=before.angles[:, :0])
    assert effect.apply(nothing, np.array([0.25]), None).parts.shape == (N, 0, 3)


def two_in_line(kind: str) -> Profile:
    """Return a vessel with two propellers on its centreline, of a curve that is weaker astern, or ordered a force."""
    aft = load_fixed().actuators[0]
    thrust = None if kind == "force" else aft.thrust
    aft = replace(aft, kind=kind, position_m=(-2.0, 0.0), thrust=thrust, count=3 if kind == "propeller" else 1)
    return replace(load_fixed(), actuators=(aft, replace(aft, name="fore", position_m=(2.0, 0.0), count=1)))


def load_fixed() -> Profile:
    return parse_profile(fixed_propellers.text(), "fixed")


def in_line(profile: Profile, aft: Floats, fore: Floats) -> ForceModel:
    parts = np.zeros((len(aft), 2, 3))
    parts[:, 0, 0], parts[:, 1, 0] = aft, fore
    still = np.zeros((len(aft), 3))
    angles = np.full((len(aft), 2), np.nan)
    t = 0.2 * np.arange(len(aft))
    measurements = Measurements(profile, t, still, still, still, parts, angles, np.ones(len(aft), dtype=bool))
    return ForceModel(measurements, hull_of(profile), parts, angles, still)


def test_a_wake_is_weighed_by_the_most_of_all_units_on_the_side_to_which_they_push() -> None:
    # Ahead 4.5e-4 and astern 3e-4 N/rpm² at 1050 rpm, three units aft and one fore: the aft one blows at the other first.
    ahead, astern = 4.5e-4 * 1050.0**2, 3.0e-4 * 1050.0**2
    before = in_line(two_in_line("propeller"), np.array([-0.3 * ahead, 50.0]), np.array([-20.0, 0.36 * ahead]))
    after = INTERACTION.apply(before, np.array([0.4]), None)
    lost_fore = 0.4 * sqrt(0.3 * ahead / (3.0 * astern))
    lost_aft = 0.4 * sqrt(0.36)
    np.testing.assert_allclose(after.parts[:, 1, 0], [-20.0 * (1.0 - lost_fore), 0.36 * ahead], rtol=1e-12)
    np.testing.assert_allclose(after.parts[:, 0, 0], [-0.3 * ahead, 50.0 * (1.0 - lost_aft)], rtol=1e-12)


def test_without_a_curve_a_wake_is_weighed_by_the_most_of_the_log() -> None:
    before = in_line(two_in_line("force"), np.array([-9.0, -36.0]), np.array([20.0, 20.0]))
    after = INTERACTION.apply(before, np.array([0.4]), None)
    np.testing.assert_allclose(after.parts[:, 1, 0], [20.0 * (1.0 - 0.4 * 0.5), 20.0 * 0.6], rtol=1e-12)


@pytest.mark.parametrize(("away_m", "doubted"), [(10.0, False), (80.0, True)])
def test_a_mooring_that_pulls_alike_everywhere_may_be_a_constant_force(away_m: float, doubted: bool) -> None:
    turns = np.linspace(0.0, 4.0 * np.pi, 200)
    eta = np.column_stack([15.0 * np.cos(turns), 15.0 * np.sin(turns), turns])
    rest = np.zeros((200, 3))
    seen = Measurements(
        FERRY, turns, eta, rest, rest, np.zeros((200, 2, 3)), np.zeros((200, 2)), np.ones(200, dtype=np.bool_)
    )
    values = {"stiffness_north": 2.0, "stiffness_east": 2.0, "north": away_m, "east": 0.0}
    said = effects()["mooring"].doubt_where(values, seen)
    # The standard deviation over a circle is its radius, of the pull twice as much.
    assert said == (
        "its pull is 160 N on average and changes by 30 N where the vessel was: a wind, a current and the drift of waves "
        "push like that, too" if doubted else ""
    )  # fmt: skip


def test_a_mooring_pulls_to_its_place_whatever_the_heading() -> None:
    heading = radians(30.0)
    before = pushed([(0.0, 0.0), (0.0, 0.0)], (0.0, 0.0, 0.0), heading)
    after = effects()["mooring"].apply(before, np.array([2.0, 3.0, 10.0, -20.0]), None)
    north, east = 2.0 * 10.0, 3.0 * -20.0
    pulled = [cos(heading) * north + sin(heading) * east, cos(heading) * east - sin(heading) * north, 0.0]
    np.testing.assert_allclose(after.external, np.tile(pulled, (N, 1)), rtol=1e-13)


@pytest.mark.parametrize("onset_s", [0.0, 0.4])
@pytest.mark.parametrize("offset_s", [0.4, 5.0])
def test_a_momentum_acts_where_something_begins_within_the_log(onset_s: float, offset_s: float) -> None:
    before = pushed([(1.0, 0.0), (1.0, 0.0)], (0.0, 0.0, 0.0))
    acts = 0.0 < onset_s < offset_s
    found = between(before, replace(before), onset_s, offset_s, impulse=np.full((N, 3), 6.0)).external
    expected = np.zeros((N, 3))
    if acts:
        expected[2] = 6.0 / 0.2
    np.testing.assert_allclose(found, expected)
    # Beyond its end nothing does.
    late = between(before, before, 99.0, np.inf, impulse=np.full((N, 3), 6.0)).external
    assert np.array_equal(late, before.external)


def test_water_meets_another_heading_from_where_it_would_have_met_its_own() -> None:
    before = pushed([(1.0, 0.0), (1.0, 0.0)], (0.5, 0.0, 0.0))
    other = OtherHeading(np.full(N, radians(90.0)))
    current = effects()["current"]
    acted = other.acted(lambda one: current.act(one, np.array([1.0, 0.0]), None), before)
    # On the heading east, water that sets north comes from starboard; on the heading north that is water that sets west.
    assert acted.flow is not None
    np.testing.assert_allclose(acted.flow, np.tile([0.0, -1.0], (N, 1)), atol=1e-15)


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
