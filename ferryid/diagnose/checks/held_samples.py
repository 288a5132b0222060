"""Held samples: a sensor's last value, repeated while nothing new was measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.result import Estimate
from ferryid.effects.picture import Scene
from ferryid.vessel.profile import Floats

NAMES = ("north", "east", "heading", "surge", "sway", "yaw rate")
USUAL = 4.0
"""Runs this many times as long as the usual one are not explained by the sensor's rate."""
SHORTEST_ROWS, SHORTEST_S = 5, 0.4
COARSE = 0.1
"""A sensor whose changes are so few different ones has a resolution that makes repeats; a hold has to end in a jump then."""
JUMP = 4.0
LEAST_SHARE, LEAST_S = 0.005, 2.0
"""Holds that are neither this share of the log nor one as long as this do no harm."""


def find(scene: Scene) -> SensorFinding | None:
    """Return the share of the log in which some channel is held, and the longest time of it."""
    columns = np.column_stack([scene.eta, scene.nu_raw])
    held = np.column_stack([held_rows(column, scene.usable, scene.step_s) for column in columns.T])
    rows = held.any(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]]).astype(np.int8))).reshape(-1, 2)
    share = float(rows.sum()) / max(int(scene.usable.sum()), 1)
    longest = float((edges[:, 1] - edges[:, 0]).max(initial=0)) * scene.step_s
    if share < LEAST_SHARE and longest < LEAST_S:
        return None
    names = [name for name, column in zip(NAMES, held.T, strict=True) if column.any()]
    percent = 100.0 * share

    def correct(seen: Scene) -> Scene:
        return replace(seen, usable=seen.usable & ~rows)

    return SensorFinding(
        "held_samples",
        {"share": Estimate(percent, percent, percent, "%"), "longest": Estimate(longest, longest, longest, "s")},
        f"Old samples were repeated {len(edges)} times, for up to {longest:.1f} s, "
        f"{percent:.1f} % of the log ({', '.join(names)}).",
        correct,
        {"first_s": scene.t[edges[:, 0]], "last_s": scene.t[edges[:, 1] - 1]},
    )


def held_rows(values: Floats, usable: NDArray[np.bool_], step_s: float) -> NDArray[np.bool_]:
    """Return which rows only repeat an earlier one for longer than the channel's rate and resolution explain, shape (n,)."""
    held = np.zeros(len(values), dtype=np.bool_)
    repeat = (np.diff(values) == 0.0) & usable[1:] & usable[:-1]
    step = np.abs(np.diff(values))[usable[1:] & usable[:-1]]
    changes = step[step > 0.0]
    if not repeat.any() or len(changes) < 10:
        return held
    edges = np.flatnonzero(np.diff(np.concatenate([[False], repeat, [False]]).astype(np.int8))).reshape(-1, 2)
    lengths = edges[:, 1] - edges[:, 0] + 1
    usual = float(np.median(np.concatenate([lengths, np.ones(max(len(changes) - len(lengths), 0))])))
    long = lengths > max(USUAL * usual, SHORTEST_ROWS, SHORTEST_S / step_s)
    coarse = np.unique(np.round(changes, 9)).size < COARSE * len(changes)
    for first, last in edges[long].tolist():
        missed = abs(float(values[min(last + 1, len(values) - 1)] - values[last]))
        if values[first] != 0.0 and (not coarse or missed > JUMP * float(np.median(changes))):
            held[first + 1 : last + 1] = True
    return held


CHECK = Check("held_samples", "Values held without a measurement", find, place=5)
