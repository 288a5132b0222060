"""Guidance: goals worked by hand for each law, and paths followed to their end."""

from __future__ import annotations

from math import atan, atan2, cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ferryid.errors import FerryIdError
from ferryid.simulate.control.angle import shorter_way
from ferryid.simulate.control.guidance import LEG, SET_POINTS, UNDEFINED, Guidance, build_guidance, guide
from ferryid.simulate.paths import OPERATION, TWELVE_CORNER
from ferryid.simulate.sections import Guidance as Section

LOOK_AHEAD, ENCLOSURE, CARROT = 1, 2, 3
LAWS = (LOOK_AHEAD, ENCLOSURE, CARROT)
CORNER = ((0.0, 0.0), (30.0, 0.0), (30.0, 20.0))


def along(points, law, radius=5.0, look_ahead=10.0):
    return Guidance(law, np.zeros((1, 3)), 1.0, np.array(points, dtype=float), radius, look_ahead), np.zeros(3)


def goal(law, x, y, leg=0, **sizes):
    guidance, state = along(CORNER, law, **sizes)
    state[LEG] = leg
    return guide(guidance, state, 0.0, (x, y, 0.3)), state


def test_set_points_are_held_for_their_time_and_the_last_for_good(scenario):
    guidance, state = build_guidance(scenario(TWELVE_CORNER))
    path = scenario(TWELVE_CORNER).path
    for t in (0.0, 59.99, 60.0, 330.0, 719.0, 720.0, 1e6):
        assert guide(guidance, state, t, (3.0, 4.0, 5.0)) == path.at(t)


@pytest.mark.parametrize(
    ("x", "y", "expected", "leg"),
    [
        (10.0, 2.0, (20.0, 0.0, 0.0), 0),  # phase 1: two radii ahead of the projection
        (-1.0, 2.0, (5.0, 0.0, 0.0), 0),  # before the leg: waiting at one radius
        (0.0, 0.0, (5.0, 0.0, 0.0), 0),
        (24.0, 0.0, (34.0, 0.0, 0.0), 0),  # ahead of the corner, not yet in reach
        (26.0, 1.0, (30.0, 11.0, pi / 2), 1),  # in reach: the next leg, 1 m along it
        (26.0, -1.0, (30.0, 5.0, pi / 2), 1),  # phase 2: the carrot waits on the rim
        (31.0, 8.0, (30.0, 0.0, 0.0), 0),  # beyond a missed corner: aim at it again
    ],
)
def test_carrot_goals_worked_by_hand(x, y, expected, leg):
    """Aurlien (2021), Appendix B, with a radius of 5 m."""
    found, state = goal(CARROT, x, y)
    assert found == pytest.approx(expected)
    assert state[LEG] == leg


def test_the_carrot_stops_at_the_last_point():
    assert goal(CARROT, 29.0, 12.0, leg=1)[0] == pytest.approx((30.0, 20.0, pi / 2))
    assert goal(CARROT, 29.0, 19.0, leg=1)[0] == pytest.approx((30.0, 20.0, pi / 2))


@pytest.mark.parametrize("law", [LOOK_AHEAD, ENCLOSURE])
def test_at_the_last_point_the_heading_stays(law):
    guidance, state = along(CORNER, law)
    state[LEG] = 1
    _, _, psi = guide(guidance, state, 0.0, (30.0, 14.0, 0.0))
    assert psi == pytest.approx(pi / 2)
    for x, y in ((31.0, 18.0), (29.0, 20.5), (28.0, 22.0)):
        assert guide(guidance, state, 0.0, (x, y, 0.0)) == pytest.approx((30.0, 20.0, pi / 2))


@settings(max_examples=60, deadline=None)
@given(st.floats(0.5, 20), st.floats(-12, 12), st.floats(1, 12))
def test_look_ahead_heads_as_the_law_says(x, y, look_ahead):
    """chi_d = alpha + atan(-e / Delta): Fossen (2021), (12.71), on a leg that runs north."""
    found, _ = goal(LOOK_AHEAD, x, y, look_ahead=look_ahead)
    assert found == pytest.approx((x + look_ahead, 0.0, atan(-y / look_ahead)))


@settings(max_examples=60, deadline=None)
@given(st.floats(0.5, 18), st.floats(-12, 12))
def test_enclosure_aims_at_the_rim_or_the_nearest_point(x, y):
    (X, Y, psi), state = goal(ENCLOSURE, x, y)
    if abs(y) <= 10.0:
        assert hypot(X - x, Y - y) == pytest.approx(10.0)
        assert x <= X
    else:
        np.testing.assert_allclose((X, Y), (x, 0.0))
    assert state[UNDEFINED] == (abs(y) > 10.0)
    assert psi == pytest.approx(atan2(Y - y, X - x))


def test_enclosure_before_the_leg_and_far_off_goes_to_its_start():
    (X, Y, _), state = goal(ENCLOSURE, -20.0, 30.0)
    assert (X, Y) == (0.0, 0.0)
    assert state[UNDEFINED] == 1.0


@pytest.mark.parametrize("law", LAWS)
def test_a_mirrored_path_gives_mirrored_goals(law):
    for x, y in ((3.0, 4.0), (28.0, -1.0), (33.0, 12.0), (12.0, -11.0)):
        guidance, state = along(CORNER, law)
        mirrored, other = along([(north, -east) for north, east in CORNER], law)
        X, Y, psi = guide(guidance, state, 0.0, (x, y, 0.1))
        assert guide(mirrored, other, 0.0, (x, -y, -0.1)) == pytest.approx((X, -Y, -psi), abs=1e-12)


@pytest.mark.parametrize("law", LAWS)
@settings(max_examples=15, deadline=None)
@given(st.floats(-pi, pi), st.floats(-50, 50), st.floats(-50, 50))
def test_a_turned_and_moved_path_gives_turned_and_moved_goals(law, turn, north, east):
    c, s = cos(turn), sin(turn)

    def moved(x, y):
        return c * x - s * y + north, s * x + c * y + east

    for x, y in ((3.0, 4.0), (28.0, -1.0), (12.0, -11.0)):
        guidance, state = along(CORNER, law)
        other, state_too = along([moved(*point) for point in CORNER], law)
        X, Y, psi = guide(guidance, state, 0.0, (x, y, 0.0))
        X_m, Y_m, psi_m = guide(other, state_too, 0.0, (*moved(x, y), 0.0))
        assert (X_m, Y_m) == pytest.approx(moved(X, Y), abs=1e-9)
        assert abs(shorter_way(psi_m - psi - turn)) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_the_whole_path_is_followed_and_ended_at(law, scenario):
    """A point that runs towards its goal, at most 1 m/s, passes every corner and stays at the last one."""
    poses = [(x, y, 0.0) for x, y in OPERATION]
    guidance, state = build_guidance(
        scenario(poses, guidance=Section(law=("", "look-ahead", "enclosure", "carrot")[law]))
    )
    x = y = heading = 0.0
    nearest = np.full(len(OPERATION), np.inf)
    for k in range(6000):
        X, Y, psi = guide(guidance, state, 0.1 * k, (x, y, heading))
        assert abs(psi - heading) <= pi + 1e-12
        heading = psi
        way = hypot(X - x, Y - y)
        speed = min(1.0, 0.2 * way)
        if way > 0.0:
            x, y = x + 0.1 * speed * (X - x) / way, y + 0.1 * speed * (Y - y) / way
        nearest = np.minimum(nearest, [hypot(x - a, y - b) for a, b in OPERATION])
    assert (nearest <= 5.0 + 1e-9).all()
    assert (x, y) == pytest.approx(OPERATION[-1], abs=0.1)
    assert state[LEG] == len(OPERATION) - 2


def test_headings_unwrap_round_and_round(scenario):
    """Three rounds of a square to starboard end at three full turns, less the last corner."""
    square = ((0.0, 0.0, 0.0), (20.0, 0.0, 0.0), (20.0, 20.0, 0.0), (0.0, 20.0, 0.0)) * 3
    guidance, state = build_guidance(scenario(square, guidance=Section(law="carrot")))
    for x, y, _ in square:
        psi = guide(guidance, state, 0.0, (x, y, 0.0))[2]
    assert psi == pytest.approx(2.0 * 2.0 * pi + pi)


def test_a_path_that_leads_nowhere_is_refused(scenario):
    with pytest.raises(FerryIdError, match=r'"carrot" follows a path, found no point away from the start\. Fix: '):
        build_guidance(scenario(((0.0, 0.0, 90.0),), guidance=Section(law="carrot")))


def test_shorter_way_wraps_to_the_half_open_interval():
    assert shorter_way(pi) == pytest.approx(pi)
    assert shorter_way(-pi) == pytest.approx(pi)
    assert shorter_way(3.5 * pi) == pytest.approx(-0.5 * pi)


def test_the_last_set_point_holds_beyond_any_whole_number():
    poses = np.array([[0.0, 0.0, 0.0], [5.0, 1.0, 2.0]])
    guidance = Guidance(SET_POINTS, poses, 1e-310, np.zeros((1, 2)), 5.0, 10.0)
    assert guide(guidance, np.zeros(3), 10.0, (0.0, 0.0, 0.0)) == (5.0, 1.0, 2.0)
