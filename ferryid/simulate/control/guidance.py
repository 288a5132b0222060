"""Guidance: where the reference filter is sent, cycle by cycle, to visit the points of a path or to follow it."""

from __future__ import annotations

from math import atan2, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ferryid.compiled import borrowing
from ferryid.errors import FerryIdError
from ferryid.simulate.control.angle import shorter_way
from ferryid.types import Floats

if TYPE_CHECKING:
    from ferryid.simulate.scenario import Scenario

Triple = tuple[float, float, float]

SET_POINTS, LOOK_AHEAD, ENCLOSURE, CARROT = 0, 1, 2, 3
LAWS = ("set-points", "look-ahead", "enclosure", "carrot")

LEG, HEADING, UNDEFINED = 0, 1, 2
"""Places in the state of the guidance: index of the leg, last heading asked for [rad], and how many times the point of
enclosure steering did not exist."""


class Guidance(NamedTuple):
    """A law and what it follows.

    Attributes
    ----------
    law
        Place in `LAWS`.
    poses
        Set points north, east [m] and heading [rad, not wrapped], shape (n, 3); used by set points alone.
    dwell_s
        Time for each of them [s].
    points
        Corners of the path, north and east [m], from the start on and no two alike in a row, shape (m, 2).
    radius
        A corner is passed within this distance [m].
    look_ahead
        Distance along the path, or the radius of the circle around the vessel [m].
    """

    law: int
    poses: Floats
    dwell_s: float
    points: Floats
    radius: float
    look_ahead: float


def build_guidance(scenario: Scenario) -> tuple[Guidance, Floats]:
    """Return the guidance along the scenario's path and its state at the start, shape (3,).

    Raises
    ------
    FerryIdError
        When a law that follows a path is given one that leads nowhere.
    """
    path, chosen = scenario.path, scenario.guidance
    poses = np.array(path.poses, dtype=np.float64).reshape(-1, 3)
    points = path.waypoints
    law = LAWS.index(chosen.law)
    if law != SET_POINTS and len(points) < 2 and not scenario.manoeuvre.kind:
        raise FerryIdError(
            f'{scenario.where}: the guidance "{chosen.law}" follows a path, found no point away from the start. '
            'Fix: give [path] at least one point elsewhere, or use law = "set-points"'
        )
    guidance = Guidance(law, poses, path.dwell_s, np.array(points), chosen.radius_m, chosen.look_ahead_m)
    return guidance, np.zeros(3)


@borrowing
def guide(guidance: Guidance, gstate: Floats, t: float, eta: Triple) -> Triple:
    """Return the goal of the reference filter: north, east [m] and heading [rad, not wrapped].

    A path is followed leg by leg. A corner within reach starts the next leg; beyond the end of a leg whose corner was missed,
    every law aims at the corner again. The last point is a place to stop, so that no goal lies beyond it.

    Parameters
    ----------
    guidance
        From `build_guidance`.
    gstate
        Its state, shape (3,), moved on in place.
    t
        Time from the start [s].
    eta
        Measured pose.

    References
    ----------
    Aurlien (2021), section 3.1 and Appendix B; Fossen (2021), section 12.3 on both forms of line-of-sight steering.
    """
    if guidance.law == SET_POINTS:
        i = int(min(t / guidance.dwell_s, len(guidance.poses) - 1.0))
        return guidance.poses[i, 0], guidance.poses[i, 1], guidance.poses[i, 2]
    points, radius = guidance.points, guidance.radius
    leg, last = int(gstate[LEG]), len(points) - 2
    if leg < last and _distance(points[leg + 1, 0] - eta[0], points[leg + 1, 1] - eta[1]) <= radius:
        leg += 1
        gstate[LEG] = leg
    x0, y0 = points[leg, 0], points[leg, 1]
    x1, y1 = points[leg + 1, 0], points[leg + 1, 1]
    length = _distance(x1 - x0, y1 - y0)
    c, s = (x1 - x0) / length, (y1 - y0) / length
    along = (eta[0] - x0) * c + (eta[1] - y0) * s
    if guidance.law == CARROT:
        ahead = _carrot(along, radius)
    elif guidance.law == LOOK_AHEAD:
        ahead = along + guidance.look_ahead
    else:
        across = (eta[1] - y0) * c - (eta[0] - x0) * s
        reach2 = guidance.look_ahead * guidance.look_ahead - across * across
        if reach2 >= 0.0:
            ahead = along + sqrt(reach2)
        else:
            # No point of the leg is that near: the nearest is the way back to it.
            gstate[UNDEFINED] += 1.0
            ahead = max(along, 0.0)
    if along > length or (leg == last and ahead > length):
        x, y = x1, y1
    else:
        x, y = x0 + ahead * c, y0 + ahead * s
    if guidance.law == CARROT:
        gstate[HEADING] += shorter_way(atan2(y1 - y0, x1 - x0) - gstate[HEADING])
    elif leg < last or _distance(x - eta[0], y - eta[1]) > radius:
        # A direction to a point means little on top of it, and at a stop the heading stays.
        gstate[HEADING] += shorter_way(atan2(y - eta[1], x - eta[0]) - gstate[HEADING])
    return x, y, gstate[HEADING]


@borrowing
def _carrot(along: float, radius: float) -> float:
    """Return how far along the leg the carrot is: twice the radius ahead, and waiting at the radius before the leg starts."""
    return along + 2.0 * radius if along > 0.0 else radius


@borrowing
def _distance(x: float, y: float) -> float:
    return sqrt(x * x + y * y)
