"""Where a vessel is tried, and what drives it: which manoeuvres it can be asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin

import numpy as np

from ferryid.vessel.order_response import orders_alone
from ferryid.vessel.profile import Actuator, Profile

SMALL_LEVER = 1e-6
"""Least singular value of the actuators' directions, moments over the longest lever, at which they are independent."""


@dataclass(frozen=True)
class Drive:
    """What drives and turns a vessel. That of nothing known is several thrusters that turn and push every way.

    Attributes
    ----------
    single
        True for one actuator, which may be several units that are driven as one.
    turned
        True where thrusters turn.
    rudder
        True where a rudder turns in the wake of a propeller.
    on_the_spot, sideways
        True where the vessel turns, and moves sideways, at rest. A rudder needs a flow.
    """

    single: bool = False
    turned: bool = True
    rudder: bool = False
    on_the_spot: bool = True
    sideways: bool = True


@dataclass(frozen=True)
class Circumstances:
    """Where a vessel is tried and what drives it.

    Attributes
    ----------
    setting
        One of `ferryid.vessel.profile.SETTINGS`; empty where that is not known.
    drive
        What its actuators can do.
    followed_unseen
        True where the actuators are known by their orders alone, and the profile does not state how late these are followed.
    """

    setting: str = ""
    drive: Drive = Drive()
    followed_unseen: bool = False

    @classmethod
    def of(cls, profile: Profile) -> Circumstances:
        """Return those that a profile states."""
        unseen = orders_alone(profile) and not any(one.states_response for one in profile.signals)
        return cls(profile.setting, drive_of(profile.actuators), unseen)


ANYWHERE = Circumstances()
"""Where neither the place nor the vessel is known."""


def drive_of(actuators: Sequence[Actuator]) -> Drive:
    """Return what drives and turns a vessel with these actuators; `Drive()` where there are none."""
    if not actuators:
        return Drive()
    kinds = {one.kind for one in actuators}
    lever = max(max(abs(one.position_m[0]), abs(one.position_m[1])) for one in actuators) or 1.0
    directions = [
        (ahead, aside, (one.position_m[0] * aside - one.position_m[1] * ahead) / lever)
        for one in actuators
        for ahead, aside in (
            ((1.0, 0.0), (0.0, 1.0)) if one.kind == "azimuth" else ((cos(one.angle_rad), sin(one.angle_rad)),)
        )
    ]
    every = np.array(directions)
    return Drive(
        single=len(actuators) == 1,
        turned="azimuth" in kinds,
        rudder="propeller_rudder" in kinds,
        on_the_spot=bool(np.abs(every[:, 2]).max() > SMALL_LEVER),
        sideways=bool(np.linalg.matrix_rank(every, tol=SMALL_LEVER) == 3),
    )
