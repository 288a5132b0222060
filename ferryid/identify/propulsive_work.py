"""The work that the actuators do in a log by its record, beside what the vessel takes to keep its way in other logs.

Without a drive a vessel loses its way within some lengths. What the actuators do while it keeps it is what the water takes,
but for the kinetic energy at either end; at one speed that is about the same in every log. The force need not vary for that, as
it must where an acceleration is to follow it, and energy that surge, sway and yaw exchange in turns does not count.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ferryid.counts import counted
from ferryid.identify.inertia.shares import rigid_body
from ferryid.identify.thresholds import IDENTIFY
from ferryid.signals.track import Motion
from ferryid.types import Floats
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile


@dataclass(frozen=True, eq=False)
class PropulsiveWork:
    """What the recorded actuators do in the part of a log in which the vessel no longer only loses its way.

    Attributes
    ----------
    speed
        Root mean square of the surge velocity [m/s].
    work
        Work of the actuators [J].
    gained
        Kinetic energy at the end less that at the beginning [J].
    energy
        Mean kinetic energy [J].
    exposure
        Surge velocity to the powers 2 and 3, summed over time, shape (2,).
    spread
        Standard deviations of `work` over `exposure`, of the work itself and without what it accelerates, shape (2, 2).
    along
        Whether the vessel goes along its bow, and neither to and fro nor aside.
    under_way
        Whether the course turns with the bow, time and again, so that the motion is the vessel's own and no drift.
    """

    speed: float
    work: float
    gained: float
    energy: float
    exposure: Floats
    spread: Floats
    along: bool
    under_way: bool

    @property
    def resistance(self) -> Floats:
        """Work over exposure, shape (2,)."""
        return np.asarray(self.work / self.exposure)

    @property
    def driven(self) -> bool:
        """Whether the actuators clearly drive the vessel along its bow, more than they accelerate it."""
        least = (self.work - max(self.gained, 0.0)) / self.exposure
        # The kinetic energy is known by its ends: either scatter is no less than the error.
        return self.along and bool(np.all(least > IDENTIFY.odd_sigmas * self.spread.min(axis=0)))

    @property
    def most(self) -> Floats:
        """The most that the work and the way that is lost can have overcome, over exposure, shape (2,)."""
        lost = IDENTIFY.lost_way * max(-self.gained, 0.0)
        return np.asarray((self.work + lost) / self.exposure + IDENTIFY.odd_sigmas * self.spread[0])


def propulsive_work(motion: Motion, profile: Profile) -> PropulsiveWork | None:
    """Return what the actuators do in a log while the vessel keeps its way; None for a short one or unmeasured sway."""
    if not motion.sway_measured or len(windows := _windows(motion, profile)) < IDENTIFY.fewest_way_windows:
        return None
    # A vessel that has more energy than it will have in the mean may only lose its way.
    after = np.cumsum(windows[::-1, 0])[::-1] / np.arange(len(windows), 0, -1)
    windows = windows[int(np.argmax(windows[:, 0] <= after)) :]
    energy, work, gained, surge, sway = windows[:, :5].T
    velocity, bow = windows[:, 5:7], windows[:, 7:]
    speed = float(np.sqrt(np.mean(surge**2)))
    if len(windows) < IDENTIFY.fewest_way_windows or not speed > 0.0:
        return None
    # The power that water takes grows with a power of the speed between these: its drag is linear to quadratic.
    powers = _length_s(profile) * np.column_stack([surge**2, np.abs(surge) ** 3])
    exposure = powers.sum(axis=0)
    spread = [[_spread(one - power * (one.sum() / power.sum())) for power in powers.T] for one in (work, work - gained)]
    along = bool(
        abs(np.mean(surge)) >= IDENTIFY.least_direct * speed
        and np.sqrt(np.mean(sway**2)) <= IDENTIFY.most_aside * speed
    )
    turned = np.hypot(*velocity.mean(axis=0)) <= IDENTIFY.most_made_good * speed
    own = (turned or _swings(bow) >= IDENTIFY.fewest_swings) and _own(velocity, surge[:, None] * bow, bow)
    return PropulsiveWork(
        speed,
        float(work.sum()),
        float(gained.sum()),
        float(energy.mean()),
        exposure,
        np.array(spread) / exposure,
        along,
        along and own,
    )


def undriven(works: Mapping[str, PropulsiveWork]) -> dict[str, str]:
    """Return, of several logs, those in which a vessel is under way without the work that it takes, and a sentence on each.

    So it is where a propeller is recorded as standing still, or with the reversed sign. Where as many logs are so as show what
    it takes, the profile may be wrong, and none is left out.

    Parameters
    ----------
    works
        What the actuators do in each log, by its path.
    """
    usual = {path: one for path, one in works.items() if one.driven}
    if len(usual) < IDENTIFY.fewest_followed:
        return {}
    least = np.min([one.resistance for one in usual.values()], axis=0)
    slowest = IDENTIFY.slowest_way * float(np.median([one.speed for one in usual.values()]))
    odd = {
        path: one
        for path, one in works.items()
        if path not in usual
        and one.under_way
        and one.speed >= slowest
        and float(np.min(least * one.exposure)) >= IDENTIFY.ways_lost * one.energy
        and np.all(one.most < IDENTIFY.least_work * least)
    }
    if len(odd) >= len(usual):
        return {}
    others = counted(len(usual), "other log")
    return {path: _sentence(one, least, others) for path, one in odd.items()}


def _sentence(one: PropulsiveWork, least: Floats, others: str) -> str:
    at = int(np.argmin(least * one.exposure))
    share, spread = one.resistance[at] / least[at], one.spread[0, at] / least[at]
    causes = (
        "the sign of the actuators' thrust or speed changed"
        if share < -IDENTIFY.least_work
        else "the propulsion is recorded as standing still, or something else drove the vessel,"
    )
    return (
        f"the vessel keeps its way at {one.speed:.2g} m/s without the work of its actuators ({share:.2g} ± {spread:.1g} times "
        f"the least that it takes at this speed in {others}). Fix: see whether {causes} and correct that in this log, or give "
        "it a profile of its own"
    )


def _length_s(profile: Profile) -> float:
    """Return the length of windows [s]."""
    return IDENTIFY.response_window * window_seconds(profile)


def _windows(motion: Motion, profile: Profile) -> Floats:
    """Return the windows of a log in which all is known, one a row, shape (n, 9).

    Columns are the mean kinetic energy, the work of the actuators and the kinetic energy gained [J], and means of surge and
    sway velocity, of the velocity to north and east [m/s], and of the direction of the bow to north and east.
    """
    rows = max(1, round(_length_s(profile) * motion.rate_hz))
    count = len(motion.t) // rows
    mass, kept = rigid_body(profile.hull), slice(count * rows)
    nu, heading = motion.nu[kept], motion.eta[kept, 2]
    bow = np.column_stack([np.cos(heading), np.sin(heading)])
    velocity = nu[:, :1] * bow + nu[:, 1:2] * np.column_stack([-bow[:, 1], bow[:, 0]])
    momentum = nu @ mass
    powers = [np.sum(momentum * nu, axis=1) / 2.0, np.sum(motion.tau[kept] * nu, axis=1)]
    gained = np.sum(momentum * motion.nu_dot[kept], axis=1)
    columns = np.column_stack([*powers, gained, nu[:, :2], velocity, bow])
    columns[~motion.valid[kept]] = np.nan
    means = columns.reshape(count, rows, columns.shape[1]).mean(axis=1)
    means[:, 1:3] *= rows / motion.rate_hz
    return np.asarray(means[np.isfinite(means).all(axis=1)])


def _own(velocity: Floats, ahead: Floats, bow: Floats) -> bool:
    """Return whether the motion along the bow turns with it, beside any constant drift.

    Errors of the velocity are in the motion ahead too, but not in the heading: by that, the part of it that turns is none for
    what only drifts.

    Parameters
    ----------
    velocity
        To north and east, shape (n, 2).
    ahead
        That along the bow, shape (n, 2).
    bow
        Its direction, shape (n, 2).
    """
    from scipy.special import ndtr, stdtrit

    moved, along, turned = (one - one.mean(axis=0) for one in (velocity, ahead, bow))
    total = float(np.sum(turned * along))
    if not total:
        return False
    part = float(np.sum(turned * moved)) / total
    spread = _spread(np.sum(turned * (moved - part * along), axis=1)) / abs(total)
    sigmas = float(stdtrit(len(bow) - 3, ndtr(IDENTIFY.odd_sigmas)))
    return abs(part - 1.0) <= 1.0 - IDENTIFY.own_way and part > sigmas * spread


def _swings(bow: Floats) -> int:
    """Return how often a bow swings to one side and the other, by more than the standard deviation of its direction."""
    turned = bow - bow.mean(axis=0)
    side = turned @ np.linalg.svd(turned, full_matrices=False)[2][0]
    least, count, way, farthest = float(np.std(side)), 0, 0.0, float(side[0])
    for one in side.tolist():
        if way * (one - farthest) > 0.0:
            farthest = one
        elif abs(one - farthest) > least:
            count, way, farthest = count + 1, one - farthest, one
    return count


def _spread(values: Floats) -> float:
    """Return the standard deviation of a sum of values of which neighbours are correlated."""
    away = values - values.mean()
    variance = float(np.mean(away**2))
    if not variance:
        return 0.0
    alike = float(np.clip(np.mean(away[1:] * away[:-1]) / variance, 0.0, IDENTIFY.most_autocorrelation))
    return float(np.sqrt(len(values) * variance * (1.0 + alike) / (1.0 - alike)))
