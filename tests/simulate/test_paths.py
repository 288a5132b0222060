"""Paths: the thesis's tables, the shorter way round, and what a guidance law follows."""

from __future__ import annotations

from itertools import pairwise
from math import atan2, degrees, hypot, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ferryid.simulate.paths import PATHS, TWELVE_CORNER, SetPoints, set_points, shorter_way


def test_twelve_corner_is_the_thesis_table() -> None:
    """Aurlien (2021), Table 4.3: corners 5 to 8 turn round at the far end, the last comes home."""
    assert len(TWELVE_CORNER) == 12
    assert TWELVE_CORNER[4:8] == ((30, -15, 0), (30, -15, 180), (15, -15, 180), (15, 0, 135))
    assert TWELVE_CORNER[-1] == (0, 0, 0)


@pytest.mark.parametrize("kind", sorted(PATHS))
def test_every_path_turns_by_half_a_turn_at_most(kind: str) -> None:
    path = set_points(PATHS[kind](), 60.0, rounds=2)
    headings = [0.0, *(pose[2] for pose in path.poses)]
    assert all(abs(b - a) <= pi + 1e-12 for a, b in pairwise(headings))
    assert path.duration_s == 120.0 * len(PATHS[kind]())


@given(st.floats(-1e3, 1e3))
def test_shorter_way_is_the_same_direction_within_half_a_turn(angle: float) -> None:
    way = shorter_way(angle)
    assert -pi < way <= pi + 1e-9
    turns = (angle - way) / (2.0 * pi)
    assert abs(turns - round(turns)) < 1e-9


def test_set_points_follow_the_clock() -> None:
    path = set_points(((10.0, 0.0, 0.0), (10.0, 5.0, 90.0)), 20.0, size=2.0)
    assert path.at(0.0) == path.at(19.9) == (20.0, 0.0, 0.0)
    assert path.at(20.0) == path.at(1e6) == (20.0, 10.0, pi / 2)


def test_turns_add_up_over_rounds() -> None:
    quarters = set_points(((0.0, 0.0, 90.0), (0.0, 0.0, 180.0), (0.0, 0.0, -90.0), (0.0, 0.0, 0.0)), 10.0, rounds=3)
    assert quarters.poses[-1][2] == pytest.approx(6.0 * pi)


def test_waypoints_start_where_the_vessel_is_and_never_repeat() -> None:
    path = SetPoints(((0.0, 0.0, 1.0), (5.0, 0.0, 0.0), (5.0, 0.0, 2.0), (0.0, 0.0, 0.0)), 10.0)
    assert path.waypoints == ((0.0, 0.0), (5.0, 0.0), (0.0, 0.0))
    assert set_points(PATHS["on-the-spot"](), 60.0).waypoints == ((0.0, 0.0),)


def test_operational_path_looks_where_it_goes_and_has_two_quick_changes() -> None:
    """Aurlien (2021), Figure 5.16 and section 5.5.3: a closed round, two waypoint changes in a row at its north end."""
    poses = PATHS["operational"]()
    legs = list(pairwise(poses))
    for (x, y, _), (to_x, to_y, heading) in legs:
        off = heading - degrees(atan2(to_y - y, to_x - x))
        assert abs((off + 180.0) % 360.0 - 180.0) <= 0.5
    lengths = [hypot(b[0] - a[0], b[1] - a[1]) for a, b in legs]
    assert poses[0][:2] == poses[-1][:2] == (0.0, 0.0)
    north = max(range(len(poses)), key=lambda i: poses[i][0])
    assert sum(length < 20.0 for length in lengths) == 2
    assert lengths[north - 1] < 20.0
    assert lengths[north] < 20.0
    assert 350.0 < sum(lengths) < 500.0


def test_points_within_a_millimetre_are_one() -> None:
    path = SetPoints(((0.0009, 0.0, 0.0), (5.0, 0.0, 0.0), (5.0006, 0.0006, 0.0), (5.0, 0.0011, 0.0)), 1.0)
    assert path.waypoints == ((0.0, 0.0), (5.0, 0.0), (5.0, 0.0011))


def test_the_last_pose_holds_however_short_the_others_are() -> None:
    assert SetPoints(((0.0, 0.0, 0.0), (5.0, 0.0, 0.0)), 1e-310).at(10.0) == (5.0, 0.0, 0.0)
