"""Whether a sender's stamps behave like a clock: they are compared with the times at which the recorder received them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted, verb
from ferryid.ingest.stray_times import stray_times
from ferryid.types import Nanoseconds

SECOND_NS = 1_000_000_000
CONSTANT_OFFSET_NS = SECOND_NS
"""Offsets below this are latency and kept; above, the sender's clock was set differently."""
STEP_NS = SECOND_NS
"""Receive and stamp must advance alike within this from one message to the next, else a clock may have been set."""
_CORRECTED_DRIFT_NS = 50_000_000
_LARGEST_CLOCK_DRIFT_PPM = 500.0
"""Quartz drifts by less; beyond it the stamps run on simulated time or the log was replayed at another speed."""
_LONGEST_LOG_NS = 30 * 86_400 * 1e9
_BLOCKS = 64
_BLOCK_SAMPLES = 256


@dataclass(frozen=True)
class ClockFacts:
    """What the comparison of both clocks gave."""

    offset_s: float = float("nan")
    drift_ppm: float = float("nan")
    jitter_s: float = float("nan")
    resets: int = 0
    replaced: int = 0


def compare_clocks(receive: Nanoseconds, stamp: Nanoseconds) -> tuple[str, tuple[str, ...], Nanoseconds, ClockFacts]:
    """Compare both clocks: why stamps cannot be used (or ""), notes, repaired stamps, facts."""
    count = len(stamp)
    if count == 0:
        return "", (), stamp, ClockFacts()
    unset = stamp <= 0
    zeros = int(np.count_nonzero(unset))
    if zeros == count and not (count > 1 and stamp.max() == 0 and stamp.min() < 0):
        return "all stamps are zero", (), stamp, ClockFacts()
    if zeros * 100 > count and zeros > 1:
        return f"{zeros} of {counted(count, 'stamp')} {verb(zeros, 'is')} zero", (), stamp, ClockFacts()
    notes: list[str] = []
    steps = np.diff(stamp)
    repeated = int(np.count_nonzero(steps == 0))
    if count > 2 and repeated == count - 1:
        return "all stamps are the same", (), stamp, ClockFacts()
    if repeated * 5 > count:
        return (
            f"{repeated} of {counted(count, 'stamp')} {verb(repeated, 'repeats')} the one before",
            (),
            stamp,
            ClockFacts(),
        )
    latency = receive - stamp
    usual = _median(latency[~unset] if zeros else latency)
    replaced = 0
    # A stamp in the future by itself is no late message (which would be old): the sender wrote nonsense.
    strange = unset | _alone_in_future(latency) | stray_times(stamp)[0]
    if strange.any():
        replaced = int(np.count_nonzero(strange))
        if replaced * 100 > max(count, 200):
            return (
                f"{replaced} of {counted(count, 'stamp')} {verb(replaced, 'makes')} no sense",
                (),
                stamp,
                ClockFacts(),
            )
        stamp = np.where(strange, receive - usual, stamp)
        latency = np.where(strange, usual, latency)
        notes.append(f"{counted(replaced, 'senseless stamp')} replaced by receive time less the usual latency")
    # Receive time and stamp advance alike unless a message was held up or a clock was set.
    jumps = np.flatnonzero(np.abs(np.diff(latency)) > STEP_NS)
    if len(jumps) * 10 > count:
        return (
            "stamps and receive times have nothing in common",
            tuple(notes),
            stamp,
            ClockFacts(replaced=replaced),
        )
    sets = _lasting_steps(latency, jumps)
    if sets:
        facts = ClockFacts(usual / SECOND_NS, float("nan"), float("nan"), len(sets), replaced)
        by_sender = sum(_is_senders(receive, stamp, place) for place in sets)
        where = f"{sets[0] + 1} of {count}"
        if by_sender:
            reason = (
                f"the sender's clock was set {counted(by_sender, 'time')} during the recording, first at row {where}"
            )
            return reason, tuple(notes), stamp, facts
        notes.append(
            f"the recorder's clock was set {counted(len(sets), 'time')} during the recording, first at row {where}: stamps are "
            "used, topics without stamps may be off"
        )
        return "", tuple(notes), stamp, facts
    places, middles, spread = _blocks(stamp, latency)
    slope = _theil_sen(places, middles)
    jitter = spread / SECOND_NS
    facts = ClockFacts(usual / SECOND_NS, slope * 1e6, jitter, 0, replaced)
    span = float(stamp.max() - stamp.min())
    # Over months the slope only reflects that a clock was set, by both sender and recorder alike.
    drifted = slope * span if np.isfinite(slope) and span < _LONGEST_LOG_NS else 0.0
    if abs(drifted) > _CORRECTED_DRIFT_NS:
        if abs(slope) * 1e6 > _LARGEST_CLOCK_DRIFT_PPM:
            notes.append(f"{_pace(slope)} (simulated time, or a replay?): stamps are used as they are")
        else:
            stamp = stamp + np.rint(slope * (stamp - stamp[0])).astype(np.int64)
            notes.append(
                f"the sender's clock drifts by {slope * 1e6:.1f} ppm, {drifted / SECOND_NS:.3f} s in all: taken out"
            )
    if -CONSTANT_OFFSET_NS <= usual < -1_000_000:
        notes.append(f"stamps are {-usual / SECOND_NS:.3f} s later than receipt: the sender's clock is ahead; kept")
    return "", tuple(notes), stamp, facts


def _pace(slope: float) -> str:
    if slope <= -1.0:
        return "receive times stand still while stamps advance"
    return f"stamps advance {1 / (1 + slope):.4g} times as fast as the recorder's clock"


def spread_sample(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """At most 16384 values, in runs spread over the whole array."""
    most = _BLOCKS * _BLOCK_SAMPLES
    if len(values) <= most:
        return values
    starts = np.linspace(0, len(values) - _BLOCK_SAMPLES, _BLOCKS).astype(np.int64)
    sampled: NDArray[np.int64] = values[starts[:, None] + np.arange(_BLOCK_SAMPLES)].reshape(-1)
    return sampled


def _median(values: Nanoseconds) -> int:
    """Median to the nanosecond, which floats cannot hold at 1.7e18."""
    sample = spread_sample(values)
    middle = (len(sample) - 1) // 2
    return int(np.partition(sample, middle)[middle])


def _alone_in_future(latency: Nanoseconds) -> NDArray[np.bool_]:
    """Rows whose latency falls by more than a second and comes back with the next row."""
    alone = np.zeros(len(latency), dtype=bool)
    if len(latency) < 3:
        return alone
    change = np.diff(latency)
    if int(change.min()) >= -STEP_NS:
        return alone
    alone[1:-1] = (change[:-1] < -STEP_NS) & (change[1:] > STEP_NS)
    # A held-up message before a normal one also falls and may rise again: only below the usual is it the future.
    return alone & (latency < _median(latency) - STEP_NS)


def _lasting_steps(latency: Nanoseconds, jumps: NDArray[np.intp]) -> list[int]:
    """Of the places where the latency jumps, those where it stays: medians of the stretches on both sides differ."""
    edges = [0, *(int(place) + 1 for place in jumps), len(latency)]
    stretches = [(a, b) for a, b in pairwise(edges) if b - a >= 3]
    lasting = []
    for (start, middle), (after, end) in pairwise(stretches):
        if abs(_median(latency[after:end]) - _median(latency[start:middle])) > STEP_NS // 2:
            lasting.append(after - 1)
    return lasting


def _is_senders(receive: Nanoseconds, stamp: Nanoseconds, place: int) -> bool:
    """True where at this step the stamp departs from the usual period by more than the receive time does."""
    period = _median(np.diff(stamp))
    by_stamp = abs(int(stamp[place + 1] - stamp[place]) - period)
    by_receive = abs(int(receive[place + 1] - receive[place]) - period)
    return by_stamp >= by_receive


def _blocks(stamp: Nanoseconds, latency: Nanoseconds) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Medians of stamp and latency [ns, from the first] in up to 64 blocks, and the latency's spread in blocks [ns]."""
    count = len(stamp)
    blocks = min(_BLOCKS, max(1, count // 8))
    edges = np.linspace(0, count, blocks + 1).astype(np.int64)
    places, middles, spreads = np.empty(blocks), np.empty(blocks), np.empty(blocks)
    base = int(latency[0])
    for number, (start, end) in enumerate(pairwise(edges)):
        stride = max(1, int(end - start) // _BLOCK_SAMPLES)
        values = (latency[start:end:stride] - base).astype(np.float64)
        middles[number] = _middle(values)
        spreads[number] = _middle(np.abs(values - middles[number]))
        places[number] = float(stamp[(start + end) // 2] - stamp[0])
    return places, middles, 1.4826 * float(np.median(spreads))


def _middle(values: NDArray[np.float64]) -> float:
    """Median of finite values; `numpy.median` takes ten times as long for a few hundred."""
    half = len(values) // 2
    if len(values) % 2:
        return float(np.partition(values, half)[half])
    low, high = np.partition(values, (half - 1, half))[half - 1 : half + 1].tolist()
    return float(low + high) / 2.0


def _theil_sen(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Median of the slopes between all pairs of points; NaN for fewer than four points."""
    if len(x) < 4:
        return float("nan")
    first, second = np.triu_indices(len(x), 1)
    run = x[second] - x[first]
    apart = run != 0
    return float(np.median((y[second] - y[first])[apart] / run[apart])) if apart.any() else float("nan")
