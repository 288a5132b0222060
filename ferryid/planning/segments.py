"""Manoeuvres that a plan is made of: each begins and ends at rest in the middle of the area, along its longer side.

So they can follow each other in any order, and what each tells is measured by itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi

import numpy as np

from ferryid.planning.limits import Limits
from ferryid.types import Floats

STEP_S = 1.0
"""Time between the poses of a manoeuvre of a vessel of 5 m; others by Froude's law."""
SHARES = (0.35, 0.65, 1.0)
"""Of the largest speeds, at which manoeuvres are drawn."""
PAUSE_S = 4.0
"""At rest after each manoeuvre of a vessel of 5 m."""
MULTISINE_S = 120.0
"""Length of a multisine of a vessel of 5 m."""
RISE_S = 40.0
"""In which it grows and fades."""
PERIODS_S = ((24.0, 31.0, 19.0), (40.0, 52.0, 29.0), (60.0, 37.0, 45.0), (80.0, 60.0, 33.0))
"""Periods north, east and about the mast of a vessel of 5 m: no two alike, so that no two motions are."""
PEAK = 0.8
"""Of the largest acceleration, which a multisine has where it is slow."""
MOST_TURNED = 2.5
"""Heading to either side [rad] that a multisine reaches at most."""
HOLD_S = 15.0
"""On each heading of a vessel of 5 m that is held."""


@dataclass(frozen=True)
class Segment:
    """A manoeuvre.

    Attributes
    ----------
    kind, says
        Its name, and what it is with its speeds, as a part of a sentence.
    poses
        North, east [m] and heading [rad, not wrapped] relative to middle and longer side, one every step, shape (n, 3).
    """

    kind: str
    says: str
    poses: Floats


def segments(limits: Limits, time: float) -> list[Segment]:
    """Return all manoeuvres for a vessel.

    Parameters
    ----------
    limits
        What it can do, and its room.
    time
        Factor on times from those of a vessel of 5 m.
    """
    draw = _Draw(limits, time)
    return [
        one
        for make in (draw.runs, draw.circles, draw.turns, draw.swings, draw.weaves, draw.multisines, draw.headings)
        for one in make()
    ]


@dataclass(frozen=True)
class _Draw:
    limits: Limits
    time: float

    @property
    def step(self) -> float:
        return STEP_S * self.time

    def runs(self) -> Iterator[Segment]:
        """Straight out and back without turning: ahead and astern, sideways, and obliquely."""
        u, v, _ = self.limits.speed
        a, b, _ = self.limits.acceleration
        long, wide = self.limits.long, self.limits.wide
        for share in SHARES:
            yield self._run("run", f"ahead and astern at {share * u:.2g} m/s", (1.0, 0.0), share * u, 0.5 * a, long)
            yield self._run(
                "sideways", f"to starboard and port at {share * v:.2g} m/s", (0.0, 1.0), share * v, 0.5 * b, wide
            )
            slow = share * min(u, v)
            says = f"obliquely ahead and back at {slow:.2g} m/s"
            yield self._run("oblique", says, (np.sqrt(0.5), np.sqrt(0.5)), slow, 0.5 * min(a, b), min(long, wide))

    def _run(
        self, kind: str, says: str, way: tuple[float, float], speed: float, acceleration: float, room: float
    ) -> Segment:
        return self._made(kind, says, self._line(way, speed, acceleration, room))

    def _line(self, way: tuple[float, float], speed: float, acceleration: float, room: float) -> Floats:
        """Return the poses from the middle to one end, to the other, and back."""
        out, across, home = (self._travel(length, speed, acceleration) for length in (room, 2.0 * room, room))
        s = np.concatenate([out, room - across, home - room])
        return np.column_stack([s * way[0], s * way[1], np.zeros_like(s)])

    def circles(self) -> Iterator[Segment]:
        """Circles to both sides: with the bow ahead, with one heading, and with the bow to the middle of the circle."""
        u, v, r = self.limits.speed
        for share in SHARES:
            for sign, side in ((1.0, "starboard"), (-1.0, "port")):
                radius = 0.5 * self.limits.wide
                speed = share * min(u, r * radius)
                yield self._circle("circle", f"a circle to {side} at {speed:.2g} m/s", radius, speed, sign, "ahead")
                speed = share * min(v, r * radius)
                says = f"a circle to {side} with the bow to its middle at {speed:.2g} m/s"
                yield self._circle("orbit", says, radius, speed, sign, "middle")
            speed = share * min(u, v)
            says = f"a circle on one heading at {speed:.2g} m/s"
            yield self._circle("drift", says, 0.5 * self.limits.wide, speed, 1.0, "kept")

    def _circle(self, kind: str, says: str, radius: float, speed: float, sign: float, bow: str) -> Segment:
        a = 0.5 * min(self.limits.acceleration[:2])
        angle = self._travel(2.0 * pi * radius, speed, a) / radius
        if bow == "middle":
            # It begins ahead of the vessel, so that the way goes sideways.
            north = radius * (1.0 - np.cos(angle))
            east = -sign * radius * np.sin(angle)
            heading = sign * angle
        else:
            north = radius * np.sin(angle)
            east = sign * radius * (1.0 - np.cos(angle))
            heading = sign * angle if bow == "ahead" else np.zeros_like(angle)
        return self._made(kind, says, np.column_stack([north, east, heading]))

    def turns(self) -> Iterator[Segment]:
        """Once round on the spot, and back."""
        for share in SHARES:
            rate = share * self.limits.speed[2]
            once = self._travel(2.0 * pi, rate, 0.5 * self.limits.acceleration[2])
            heading = np.concatenate([once, 2.0 * pi - once])
            yield self._made("turn", f"a turn on the spot and back at {rate:.2g} rad/s", self._only(2, heading))

    def swings(self) -> Iterator[Segment]:
        """To and fro along and about one axis, quickly: what the mass resists."""
        names = ("ahead and astern", "to starboard and port", "about the mast")
        for axis, name in enumerate(names):
            for period in (16.0 * self.time, 32.0 * self.time):
                omega = 2.0 * pi / period
                size = min(0.6 * self.limits.acceleration[axis] / omega**2, 0.8 * self.limits.speed[axis] / omega)
                if axis < 2:
                    size = min(size, (self.limits.long, self.limits.wide)[axis])
                t = np.arange(0.0, 4.0 * period + self.step, self.step)
                grown = np.clip(np.minimum(t, 4.0 * period - t) / period, 0.0, 1.0)
                unit = f"{size:.2g} m" if axis < 2 else f"{np.degrees(size):.0f} deg"
                says = f"swings of {unit} {name} with a period of {period:.0f} s"
                yield self._made("swing", says, self._only(axis, size * grown * np.sin(omega * t)))

    def weaves(self) -> Iterator[Segment]:
        """Straight out and back while the heading swings: way on, drift and yaw rate together."""
        u, v, r = self.limits.speed
        for share in SHARES:
            speed = share * min(u, v)
            poses = self._line((1.0, 0.0), speed, 0.5 * self.limits.acceleration[0], self.limits.long)
            t = np.arange(len(poses)) * self.step
            period = 40.0 * self.time
            swing = min(0.7, 0.8 * r * period / (2.0 * pi))
            ends = np.clip(np.minimum(t, t[-1] - t) / period, 0.0, 1.0)
            poses[:, 2] = swing * ends * np.sin(2.0 * pi * t / period)
            says = f"ahead and astern at {speed:.2g} m/s with the heading swinging by {np.degrees(swing):.0f} deg"
            yield self._made("weave", says, poses)

    def headings(self) -> Iterator[Segment]:
        """Station keeping on eight headings: what comes from outside, and turns round the vessel."""
        rate = 0.5 * self.limits.speed[2]
        quarter = self._travel(0.25 * pi, rate, 0.5 * self.limits.acceleration[2])
        held = np.zeros(max(1, round(HOLD_S * self.time / self.step)))
        heading = np.concatenate([part for k in range(8) for part in (0.25 * pi * k + held, 0.25 * pi * k + quarter)])
        yield self._made("headings", "station keeping on eight headings", self._only(2, heading))

    def multisines(self) -> Iterator[Segment]:
        """Move along both axes and turn at once, each with a period of its own (multisine inputs, Morelli 2012)."""
        t = np.arange(0.0, MULTISINE_S * self.time + self.step, self.step)
        rise = np.clip(np.minimum(t, t[-1] - t) / (RISE_S * self.time), 0.0, 1.0)
        smooth = rise**2 * (3.0 - 2.0 * rise)
        drawn = set[str]()
        for share in SHARES:
            for periods in PERIODS_S:
                north, east, turn = (smooth * np.sin(2.0 * pi * t / (period * self.time)) for period in periods)
                rate, angular = (np.abs(one).max() for one in self._rates(turn))
                heading = turn * min(
                    share * self.limits.speed[2] / rate, PEAK * self.limits.acceleration[2] / angular, MOST_TURNED
                )
                way = np.column_stack([self.limits.long * north, self.limits.wide * east])
                way *= min(1.0, *self._room(way, heading, share))
                poses = np.column_stack([way, heading])
                speed = float(np.hypot(*self._rates(way)[0].T).max())
                told = ", ".join(f"{period * self.time:.0f}" for period in periods[:2])
                says = (
                    f"a multisine of up to {speed:.2g} m/s and {np.degrees(np.abs(heading).max()):.0f} deg, with periods "
                    f"of {told} and {periods[2] * self.time:.0f} s"
                )
                # Where the acceleration sets the limit, a larger share of the speed changes nothing.
                if says not in drawn:
                    drawn.add(says)
                    yield self._made("multisine", says, poses)

    def _rates(self, values: Floats) -> tuple[Floats, Floats]:
        """Return rates of change from step to step, one less, and how they change, two less, of values one every step."""
        first = np.diff(values, axis=0) / self.step
        return first, np.diff(first, axis=0) / self.step

    def _room(self, way: Floats, heading: Floats, share: float) -> Iterator[float]:
        """Yield by which factor a way [m], shape (n, 2), may be larger for each limit of speed and acceleration."""
        ahead = np.column_stack([np.cos(heading), np.sin(heading)])
        across = np.column_stack([-np.sin(heading), np.cos(heading)])
        for axis, direction in enumerate((ahead, across)):
            speed, acceleration = (
                np.abs(np.sum(one * direction[: len(one)], axis=1)).max() for one in self._rates(way)
            )
            yield share * self.limits.speed[axis] / speed
            yield PEAK * self.limits.acceleration[axis] / acceleration

    def _only(self, axis: int, values: Floats) -> Floats:
        poses = np.zeros((len(values), 3))
        poses[:, axis] = values
        return poses

    def _travel(self, way: float, speed: float, acceleration: float) -> Floats:
        """Return how far something has come every step, from rest to rest over a way."""
        peak = min(speed, (way * acceleration) ** 0.5)
        ramp = peak / acceleration
        cruise = way / peak - ramp
        t = np.arange(0.0, 2.0 * ramp + cruise + self.step, self.step)
        up = 0.5 * acceleration * np.minimum(t, ramp) ** 2
        flat = peak * np.clip(t - ramp, 0.0, cruise)
        left = np.clip(t - ramp - cruise, 0.0, ramp)
        return np.asarray(up + flat + peak * left - 0.5 * acceleration * left**2)

    def _made(self, kind: str, says: str, poses: Floats) -> Segment:
        rest = np.repeat(poses[-1:], max(1, round(PAUSE_S * self.time / self.step)), axis=0)
        return Segment(kind, says, np.vstack([poses, rest]))
