"""Poses that cannot be true: jumps, a lost vessel that is recorded as zeros or as its last pose, a heading turned by 180°.

A pose is compared with the vessel's own speeds in the same log, as they show over a second: where two successive fixes are
further apart than the vessel can have moved, one side of the step is wrong, or both have different origins. A slow
receiver repeats its fixes; that is no loss as long as it repeats them no longer than it usually does. Jumps cut a log into
stretches; the largest set of stretches that fit together, or are long enough for an origin of their own, is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.signals.heading_steps import heading_steps
from ferryid.signals.pose_limits import (
    Complex,
    Limits,
    Path,
    Samples,
    between,
    difference,
    finite,
    integral,
    way_over_ground,
)
from ferryid.signals.thresholds import SIGNALS
from ferryid.signals.track import Doubt
from ferryid.types import Floats, Nanoseconds
from ferryid.vessel.frames import wrap

USED = ("x", "y", "psi", "u", "v", "r", "vel_N", "vel_E")

_AHEAD = 24
"""So many jumps are looked past for the place where the pose comes back."""
_STEPS_SAID = 3
"""Steps of the heading of which each has a sentence."""


@dataclass(frozen=True)
class PoseFault:
    """One stretch in which a position or heading is wrong.

    Attributes
    ----------
    signal
        ``"position"`` or ``"heading"``.
    kind
        ``"jump"``: a step after which the pose stays, so that the step alone is left out; ``"away"``: between a jump and the
        one back; ``"flip"``: the same of a heading, by 180°; ``"off"``, ``"turned"``: the same as these two, but from the
        start or to the end of the log; ``"step"``: a smaller jump of a heading that stays and that its yaw rate does not have,
        see `ferryid.signals.heading_steps`; ``"zero"``: exactly zero; ``"held"``: repeats its last value; ``"frequent"``: jumps
        so often that no sample is known to be wrong, one fault for each jump, of which none is left out.
    samples
        Wrong samples; none in a jump or step.
    start_ns, end_ns
        Times of the last right sample before and the first right one after [ns], or of the first or last of all.
    size
        How far the pose is off, or jumps [m or rad].
    """

    signal: str
    kind: str
    samples: int
    start_ns: int
    end_ns: int
    size: float

    @property
    def left_out(self) -> bool:
        """False where jumps are too frequent to know which samples are wrong."""
        return self.kind != "frequent"

    @property
    def seconds(self) -> float:
        """Length between the right samples on either side [s]."""
        return (self.end_ns - self.start_ns) * 1e-9


def pose_faults(samples: Samples) -> tuple[PoseFault, ...]:
    """Return where positions and headings cannot be true, in order of time.

    Parameters
    ----------
    samples
        Of the names in `USED` those that the log has.
    """
    found: list[PoseFault] = []
    turning = integral(samples, "r")
    if "psi" in samples:
        found += _faults("heading", *finite(samples["psi"][0], samples["psi"][1].astype(np.complex128)), turning)
        found += _steps(samples, found)
    if "x" in samples and "y" in samples and samples["x"][1].size == samples["y"][1].size:
        place = samples["x"][1] + 1j * samples["y"][1]
        found += _faults("position", *finite(samples["x"][0], place), way_over_ground(samples))
    return tuple(sorted(found, key=lambda fault: (fault.start_ns, fault.signal)))


def _steps(samples: Samples, heading: Sequence[PoseFault]) -> list[PoseFault]:
    """Return steps of the heading away from what is wrong with it already."""
    if any(not fault.left_out for fault in heading):
        return []
    time_ns, psi = samples["psi"]
    wrong = np.zeros(time_ns.size, dtype=bool)
    for fault in (one for one in heading if one.samples):
        wrong |= (time_ns > fault.start_ns) & (time_ns < fault.end_ns)
    right = {**samples, "psi": (time_ns, np.where(wrong, np.nan, psi))}
    return [
        PoseFault("heading", "step", 0, start_ns, end_ns, abs(size))
        for start_ns, end_ns, size in heading_steps(right)
        if not any(start_ns < fault.end_ns and end_ns > fault.start_ns for fault in heading)
    ]


def step_doubts(faults: Sequence[PoseFault], t0_ns: int) -> tuple[Doubt, ...]:
    """Return what to mind of headings that step and stay: a sentence for each of the largest, with its time and size."""
    steps = sorted(
        (fault for fault in faults if fault.signal == "heading" and fault.kind in ("jump", "step")),
        key=lambda fault: -fault.size,
    )
    shown = sorted(steps[:_STEPS_SAID], key=lambda fault: fault.start_ns)
    said = [
        f"The heading steps by {np.degrees(fault.size):.0f}° at {(fault.end_ns - t0_ns) * 1e-9:.1f} s and stays there, which "
        "no turn of the vessel explains: on one side it is wrong by as much. Fix: check the compass, or use the parts before "
        "and after as two logs."
        for fault in shown
    ]
    if len(steps) > _STEPS_SAID:
        said.append(f"The heading steps and stays {counted(len(steps) - _STEPS_SAID, 'more time')}, by less.")
    return tuple(Doubt(one, False) for one in said)


def pose_reason(fault: PoseFault) -> str:
    """Return what is wrong with one stretch, to stand after "because"."""
    size = f"{fault.size:.2f} m" if fault.signal == "position" else f"{np.degrees(fault.size):.0f}°"
    return f"the {fault.signal} {_SAYS[fault.kind].rstrip(',')} ({size})"


def pose_sentences(faults: Sequence[PoseFault]) -> tuple[str, ...]:
    """Return what was found as sentences with numbers, one for each signal and kind."""
    said = []
    for signal in ("position", "heading"):
        for kind, what in _SAYS.items():
            those = [fault for fault in faults if fault.signal == signal and fault.kind == kind]
            if not those:
                continue
            times = "once" if len(those) == 1 else counted(len(those), "time")
            size = max(fault.size for fault in those)
            if kind == "frequent":
                far = f"{size:.2f} m" if signal == "position" else f"{np.degrees(size):.0f}°"
                said.append(
                    f"The {signal} jumps {counted(len(those), 'time')} farther than the vessel can move, by "
                    f"up to {far}: too often to "
                    "know which samples are wrong, so that none is left out. Check the sensor and its fields in the profile."
                )
                continue
            text = f"The {signal} {what} {times}, by up to " + (
                f"{size:.2f} m" if signal == "position" else f"{np.degrees(size):.0f}°"
            )
            if count := sum(fault.samples for fault in those):
                text += (
                    f", at most for {max(fault.seconds for fault in those):.2f} s, {counted(count, 'sample')} in all"
                )
            said.append(f"{text}; left out with {SIGNALS.pose_margin_s:g} s on either side.")
    return tuple(said)


_SAYS = {
    "jump": "jumps farther than the vessel can move, without a jump back,",
    "away": "jumps farther than the vessel can move, and back,",
    "off": "is farther from the rest of the log than the vessel can move, at its start or end,",
    "flip": "is turned by 180° and back",
    "turned": "is turned by 180° against the longer part of the log, which is taken for right (check the sensor),",
    "step": "steps without a turn of the yaw rate and stays,",
    "zero": "is exactly zero while the vessel is elsewhere",
    "held": "repeats its last value while the vessel moves on",
    "frequent": "",
}


def _faults(signal: str, time_ns: Nanoseconds, values: Complex, path: Path | None) -> list[PoseFault]:
    """Return the faults of one signal; a heading is a complex number without imaginary part here."""
    if time_ns.size < SIGNALS.pose_fixes:
        return []
    angle = signal == "heading"
    time_s = (time_ns - time_ns[0]) * 1e-9
    bad = np.zeros(time_ns.size, dtype=bool)
    limits = Limits.of(time_s, values, path, time_ns[0], angle=angle)
    found: list[PoseFault] = []
    for kind, runs in (("zero", _zeros(values, limits)), ("held", _held(time_s, values, limits))):
        for first, last in runs:
            if not bad[first : last + 1].any():
                bad[first : last + 1] = True
                sides = [k for k in (first - 1, last + 1) if 0 <= k < values.size]
                size = max(abs(complex(difference(values[[last, k]], angle=angle)[0])) for k in sides)
                found.append(_fault(signal, kind, time_ns, first, last, size))
    good = np.flatnonzero(~bad)
    for kind, first, last, size in _jumps(time_s[good], values[good], limits):
        if kind == "frequent":
            found.append(PoseFault(signal, kind, 0, int(time_ns[good[first]]), int(time_ns[good[last]]), size))
        elif last < first:
            found.append(PoseFault(signal, kind, 0, int(time_ns[good[last]]), int(time_ns[good[first]]), size))
        else:
            found.append(_fault(signal, kind, time_ns, int(good[first]), int(good[last]), size))
    return found


def _fault(signal: str, kind: str, time_ns: Nanoseconds, first: int, last: int, size: float) -> PoseFault:
    start, end = int(time_ns[max(first - 1, 0)]), int(time_ns[min(last + 1, time_ns.size - 1)])
    return PoseFault(signal, kind, last - first + 1, start, end, size)


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first and last index of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _zeros(values: Complex, limits: Limits) -> list[tuple[int, int]]:
    """Return runs of positions that are exactly zero in both coordinates, or headings in theirs, and left by a jump."""
    if limits.angle:
        return []  # a heading of zero is north; zeros between which it jumps are found as jumps
    found = []
    for first, last in _runs(values == 0.0):
        sides = [abs(complex(values[k])) for k in (first - 1, last + 1) if 0 <= k < values.size]
        # At its origin a vessel stays near it; the nearer side decides, so that a start there is none.
        if last > first and sides and all(limits.elsewhere(side) for side in sides):
            found.append((first, last))
    return found


def _held(time_s: Floats, values: Complex, limits: Limits) -> list[tuple[int, int]]:
    """Return runs of repeats that last longer than usual and after which the vessel is further on at once."""
    same = np.concatenate([[False], np.diff(values) == 0.0])
    longest = max(SIGNALS.held_periods * limits.period_s, SIGNALS.held_s)
    found = []
    for first, last in _runs(same):
        if time_s[last] - time_s[first - 1] <= longest:
            continue
        if last + 1 == values.size:
            lost = limits.travelled(float(time_s[first - 1]), float(time_s[last])) > SIGNALS.held_steps * limits.floor
        else:
            step = abs(complex(difference(values[last : last + 2], angle=limits.angle)[0]))
            lost = time_s[last + 1] - time_s[last] <= longest and limits.elsewhere(step)
            if lost and limits.path is not None:
                sides = time_s[[first - 1, last + 1]]
                lost = not limits.known(sides) or limits.travelled(*map(float, sides)) >= SIGNALS.held_way_share * step
        if lost:
            found.append((first, last))
    return found


def _jumps(time_s: Floats, values: Complex, limits: Limits) -> list[tuple[str, int, int, float]]:
    """Return kind, first and last index, and size, of the stretches between jumps that do not belong to the rest.

    For a jump to another origin, the last index is that before it, and the first that after it. Jumps that are too frequent
    come as one, whose indices are those of the first and the last.
    """
    fixes = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0.0]))
    if fixes.size < SIGNALS.pose_fixes:
        return []
    move = difference(values[fixes], angle=limits.angle)
    # What a slow receiver repeats was measured at its first sample, but not what repeats far beyond the usual.
    lasts = np.minimum(np.diff(time_s[fixes]), time_s[fixes[1:]] - time_s[fixes[1:] - 1] + 2.0 * limits.period_s)
    places = np.flatnonzero(limits.jump(np.abs(move), lasts))
    way = limits.ways(time_s[fixes[places]], time_s[fixes[places + 1]])
    # What the measured velocity explains is no jump, however fast.
    unexplained = np.abs(move[places]) > limits.floor + SIGNALS.measured_ways * np.abs(way)
    places, way = places[unexplained], way[unexplained]
    if places.size == 0:
        return []
    if places.size > max(2, SIGNALS.jump_share * fixes.size):
        first, last = int(fixes[places[0] + 1]), int(fixes[places[-1] + 1])
        return [("frequent", first, last, float(np.abs(move[places]).max()))] * int(places.size)
    starts = np.concatenate([[0], fixes[places + 1]])
    ends = np.concatenate([starts[1:] - 1, [values.size - 1]])
    off = move[places] - way
    clear = limits.jump(np.abs(off) / SIGNALS.clear_jump, lasts[places])
    stretches = _Stretches(time_s, values, limits, starts, ends, off, clear)
    links = stretches.kept()
    if sum(int(ends[k] - starts[k]) + 1 for k in links) < SIGNALS.consistent_share * values.size:
        links = list(range(len(starts)))  # no part is known to be the right one
    sizes = np.abs(wrap(off.real)) if limits.angle else np.abs(off)
    found = []
    for before, after in pairwise([-1, *links, len(starts)]):
        size = float(sizes[before if before >= 0 else after - 1]) if after < len(starts) or before < after - 1 else 0.0
        flip = limits.angle and abs(size - np.pi) < SIGNALS.flip_rad
        if after - before > 1:
            inside = before >= 0 and after < len(starts)
            kind = ("flip" if inside else "turned") if flip else ("away" if inside else "off")
            found.append((kind, int(starts[before + 1]), int(ends[after - 1]), size))
        elif before >= 0 and after < len(starts):
            found.append(("jump", int(starts[after]), int(ends[before]), size))
    return found


@dataclass(frozen=True)
class _Stretches:
    """The stretches between jumps.

    Attributes
    ----------
    starts, ends
        First and last index of every stretch.
    off, clear
        By how much every jump between them leads away from where the vessel can be, and whether that is beyond doubt.
    """

    time_s: Floats
    values: Complex
    limits: Limits
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    off: Complex
    clear: NDArray[np.bool_]

    def kept(self) -> list[int]:
        """Return the stretches whose samples are the most, of those that fit each other or are long on their own.

        A stretch that does not fit the one before costs `SIGNALS.origin_s`, that of a heading turned by 180°
        cannot follow at all.
        A return to where the vessel must be is worth as much as what is left out before it, up to what agrees on both sides.
        """
        size = (self.ends - self.starts + 1).astype(np.float64)
        cost = min(
            SIGNALS.origin_s * self.values.size / max(float(self.time_s[-1]), 1e-9),
            SIGNALS.origin_share * self.values.size,
        )
        total = np.concatenate([[0.0], np.cumsum(size)])
        long = np.concatenate([[0], np.cumsum(size > cost)])
        origin = np.concatenate([[0.0 + 0j], np.cumsum(self.off)])
        best, kept = size.copy(), size.copy()
        previous = np.full(len(size), -1)
        for j in range(1, len(size)):
            for i in range(j - 1, max(0, j - _AHEAD) - 1, -1):
                credit = min(float(total[j] - total[i + 1]), kept[i] + size[j])
                if best[i] + size[j] + credit <= best[j]:
                    continue
                apart = self._turn(origin[j] - origin[i])
                flips = self.limits.angle and abs(self._turn(self.off[i]) - np.pi) < SIGNALS.flip_rad
                value = best[i] + size[j]
                # Of many origins, some agree by chance.
                near = flips or long[j] - long[i + 1] <= 1
                if j > i + 1 and near and self._fits(i, j, apart, flips=flips):
                    value += 0.0 if flips else credit
                elif self.limits.angle and abs(apart - np.pi) < SIGNALS.flip_rad:
                    continue
                else:
                    value -= cost
                if value > best[j]:
                    best[j], kept[j], previous[j] = value, kept[i] + size[j], i
        chain = [int(np.argmax(best))]
        while previous[chain[-1]] >= 0:
            chain.append(int(previous[chain[-1]]))
        return chain[::-1]

    def _turn(self, change: complex) -> float:
        """Return the size of a change, of headings at most half a turn."""
        return float(abs((change.real + np.pi) % (2.0 * np.pi) - np.pi)) if self.limits.angle else float(abs(change))

    def _fits(self, i: int, j: int, apart: float, *, flips: bool) -> bool:
        """True where stretch j goes on where stretch i ended, from the jumps between or from the way between."""
        jump = self._turn(self.off[i])
        last, first = int(self.ends[i]), int(self.starts[j])
        lasts = float(self.time_s[first] - self.time_s[last])
        if flips:
            return bool(apart < SIGNALS.flip_rad)
        if self.clear[i] and apart <= SIGNALS.cancel_share * jump and lasts <= SIGNALS.cancel_s:
            return True
        move = complex(between(self.values, np.array([last]), np.array([first]), angle=self.limits.angle)[0])
        return self.limits.back(jump, move, float(self.time_s[last]), float(self.time_s[first]))
