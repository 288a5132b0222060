"""Paths: poses asked for one after the other, or the way through their positions for a guidance law."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import atan2, degrees, pi, radians

Pose = tuple[float, float, float]
"""North, east [m] and heading; in degrees in the tables of this module, in radians in `SetPoints`."""
Waypoint = tuple[float, float]
"""North, east [m]."""

SAME_M = 1e-3
"""Positions nearer than this to each other are one [m]: a leg between them has no direction."""

TWELVE_CORNER: tuple[Pose, ...] = (
    *((0.0, -15.0, -90.0), (15.0, -15.0, 0.0), (15.0, 0.0, 0.0), (30.0, 0.0, 0.0)),
    *((30.0, -15.0, 0.0), (30.0, -15.0, 180.0), (15.0, -15.0, 180.0), (15.0, 0.0, 135.0)),
    *((0.0, 0.0, 135.0), (0.0, 0.0, -45.0), (0.0, -15.0, -45.0), (0.0, 0.0, 0.0)),
)
"""Aurlien (2021), Table 4.3."""

FOUR_CORNER: tuple[Pose, ...] = (
    (15.0, 0.0, 0.0),
    (15.0, 15.0, 0.0),
    (15.0, 15.0, -45.0),
    (0.0, 15.0, -45.0),
    (0.0, 0.0, 0.0),
)
"""Surge, sway, yaw, surge with sway, and all three at once, in the manner of Skjetne et al. (2017)."""

OPERATION: tuple[Waypoint, ...] = (
    *((0.0, 0.0), (35.0, -10.0), (70.0, 10.0), (105.0, 6.0), (109.0, 19.0), (98.0, 29.0), (62.0, 22.0)),
    *((38.0, 52.0), (58.0, 76.0), (20.0, 112.0), (-26.0, 96.0), (-46.0, 52.0), (-12.0, 20.0), (0.0, 0.0)),
)
"""A round of some 12 minutes in the manner of Aurlien (2021), Figure 5.16: two quick changes at the north end, then back."""


@dataclass(frozen=True)
class SetPoints:
    """Poses [m, m, rad] held for `dwell_s` each; headings unwrapped, so that each turn takes the shorter way."""

    poses: tuple[Pose, ...]
    dwell_s: float

    @property
    def duration_s(self) -> float:
        """Time that the whole path takes [s] when each pose is held for its time."""
        return self.dwell_s * len(self.poses)

    @property
    def waypoints(self) -> tuple[Waypoint, ...]:
        """Positions [m] from the start at 0, 0 on, for a guidance law; those alike in a row are one."""
        found: list[Waypoint] = [(0.0, 0.0)]
        for x, y, _ in self.poses:
            if (x - found[-1][0]) ** 2 + (y - found[-1][1]) ** 2 > SAME_M**2:
                found.append((x, y))
        return tuple(found)

    def at(self, t: float) -> Pose:
        """Return the pose asked for at time `t` [s]; the last one holds."""
        return self.poses[int(min(t / self.dwell_s, len(self.poses) - 1))]


def shorter_way(angle: float) -> float:
    """Wrap an angle [rad] to (-pi, pi]."""
    return pi - (pi - angle) % (2.0 * pi)


def set_points(poses: tuple[Pose, ...], dwell_s: float, size: float = 1.0, rounds: int = 1) -> SetPoints:
    """Turn poses in metres and degrees into set points from heading 0 on.

    Parameters
    ----------
    poses
        North, east [m], heading [deg].
    dwell_s
        Time for each [s].
    size
        Factor on the positions.
    rounds
        How many times the path is repeated.
    """
    unwrapped: list[Pose] = []
    heading = 0.0
    for x, y, psi in poses * rounds:
        heading += shorter_way(radians(psi) - heading)
        unwrapped.append((size * x, size * y, heading))
    return SetPoints(tuple(unwrapped), dwell_s)


def _zigzag() -> tuple[Pose, ...]:
    """Run north in legs of 12 m with the heading swung 30 degrees from side to side."""
    swings = (30.0, -30.0) * 5
    return tuple((12.0 * (leg + 1), 0.0, swing) for leg, swing in enumerate(swings))


def _crossing() -> tuple[Pose, ...]:
    """Leave the quay, cross a 100 m canal with the bow ahead, dock sideways, and come back."""
    return (
        (5.0, 0.0, 0.0),
        (95.0, 0.0, 0.0),
        (95.0, 0.0, 90.0),
        (100.0, 0.0, 90.0),
        (95.0, 0.0, 90.0),
        (95.0, 0.0, 180.0),
        (5.0, 0.0, 180.0),
        (0.0, 0.0, 180.0),
    )


def _operational() -> tuple[Pose, ...]:
    """Follow `OPERATION` with the bow ahead: each pose looks the way that its leg comes."""
    # Whole degrees: the last bit of atan2 differs between machines, and a log must not.
    ways = [float(round(degrees(atan2(to[1] - by[1], to[0] - by[0])))) for by, to in pairwise(OPERATION)]
    return tuple((x, y, way) for (x, y), way in zip(OPERATION, (ways[0], *ways), strict=True))


def _on_the_spot() -> tuple[Pose, ...]:
    """Turn once round in quarters to starboard, then back, without leaving the place."""
    quarters = (90.0, 180.0, -90.0, 0.0, -90.0, 180.0, 90.0, 0.0)
    return tuple((0.0, 0.0, heading) for heading in quarters)


PATHS: Mapping[str, Callable[[], tuple[Pose, ...]]] = {
    "twelve-corner": lambda: TWELVE_CORNER,
    "four-corner": lambda: FOUR_CORNER,
    "zigzag": _zigzag,
    "crossing": _crossing,
    "operational": _operational,
    "on-the-spot": _on_the_spot,
}
