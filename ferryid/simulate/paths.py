"""Paths as set points for the reference filter: which pose is asked for from which time on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import pi, radians

Pose = tuple[float, float, float]
"""North, east [m] and heading; in degrees in the tables of this module, in radians in `SetPoints`."""

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


@dataclass(frozen=True)
class SetPoints:
    """Poses [m, m, rad] held for `dwell_s` each; headings unwrapped, so that each turn takes the shorter way."""

    poses: tuple[Pose, ...]
    dwell_s: float

    @property
    def duration_s(self) -> float:
        """Time that the whole path takes [s]."""
        return self.dwell_s * len(self.poses)

    def at(self, t: float) -> Pose:
        """Return the pose asked for at time `t` [s]; the last one holds."""
        return self.poses[min(int(t / self.dwell_s), len(self.poses) - 1)]


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


PATHS: Mapping[str, Callable[[], tuple[Pose, ...]]] = {
    "twelve-corner": lambda: TWELVE_CORNER,
    "four-corner": lambda: FOUR_CORNER,
    "zigzag": _zigzag,
    "crossing": _crossing,
}
