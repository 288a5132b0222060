"""Campaigns that look like those at sea: ten short logs of one vessel on one day, whose profile has no hull model.

The wind is never measured and never steady; a receiver whose filter lags takes the place of the navigation that the autopilot
has; samples are repeated, and some are missing. The plant, and the effect that is concealed, are those of the other cases.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.effects import effects
from ferryid.simulate.sensors import Stream
from ferryid.types import Floats
from ferryid.validation.case import Case
from ferryid.validation.log_writer import streams, write_log
from ferryid.validation.plant.effects import complete_conditions, plant_effects
from ferryid.validation.plant.navigation import RATE_HZ
from ferryid.validation.plant.paths import duration_s
from ferryid.validation.plant.plant import build_plant
from ferryid.validation.plant.receiver import received
from ferryid.validation.plant.trial import CONTROL_EVERY, Trial, simulate_trial
from ferryid.validation.plant.vessels import VESSELS

LOG_S = (60.0, 300.0)
"""How long a log is [s]."""
APART_NS = 40 * 60 * 10**9
"""From the start of one log to that of the next [ns]."""
LAG_S = (0.2, 0.5)
"""Time constant of the receiver's filter [s]."""
RECEIVED_EVERY = 2
"""Samples of the plant between those of the receiver: 10 Hz."""
HELD = 0.04
"""Share of the receiver's samples that repeat the last one."""
MOST_GAPS, GAP_S = 2, (0.5, 3.0)
"""Most times in a log in which the receiver is not heard, and for how long [s]."""
CAMPAIGN_STREAM = 1_000
"""Number of the random stream of what all logs of a campaign share; the streams of logs are numbered from 0."""


def write_campaign(case: Case, folder: Path) -> tuple[Path, ...]:
    """Write the logs of a campaign into a folder and return their paths."""
    return tuple(
        write_log(_recorded(campaign_trial(case, number), case, number), folder, f"{case.name}-{number}", case.format)
        for number in range(case.logs)
    )


def campaign_trial(case: Case, number: int) -> Trial:
    """Return what the receiver reports of a log: a part of a trial of five minutes, the same for the same arguments."""
    seed, rows, rng = _drawn(case, number)
    conditions = _conditions(case, number)
    whole = simulate_trial(VESSELS[case.vessel], conditions, case.path, seed)
    return _part(replace(whole, reported=received(whole, rng, receiver_lag_s(case), conditions["noise"])), rows)


def _drawn(case: Case, number: int) -> tuple[int, slice, np.random.Generator]:
    """Return the seed of the trial that a log is a part of, its rows there, and what draws the receiver's errors."""
    rng = np.random.default_rng([case.seed, number])
    seed, length = int(rng.integers(2**31)), float(rng.uniform(*LOG_S))
    begin = float(rng.uniform(0.0, duration_s(case.path) - length))
    # From a sample on at which the autopilot gave orders.
    first = int(begin * RATE_HZ) // CONTROL_EVERY * CONTROL_EVERY
    return seed, slice(first, first + int(length * RATE_HZ)), rng


def receiver_lag_s(case: Case) -> float:
    """Return the time constant of the receiver's filter in a campaign [s]."""
    return float(np.random.default_rng([case.seed, CAMPAIGN_STREAM]).uniform(*LAG_S))


def realised_at_sea(case: Case) -> dict[str, dict[str, float]]:
    """Return parameters that only the simulated logs give, by effect, or by effect and number of the log (``wind 3``).

    The wind of a log is the mean of what blew in it. What a trial measures of an effect that is in a log is that log's; of a
    property of the vessel it is the mean over the logs. A delay is found together with the lag of the receiver.
    """
    concealed = {truth.effect for truth in case.truths}
    found: dict[str, dict[str, float]] = {}
    measured = [plant_effects()[name] for name in sorted(concealed) if plant_effects()[name].realised is not None]
    for number in range(case.logs):
        north, east = _air(case, number).mean(axis=0).tolist()
        found[f"wind {number}"] = {"north": north, "east": east}
        trial = campaign_trial(case, number) if measured else None
        for one in measured:
            values = one.realised(trial, _conditions(case, number)) if one.realised is not None and trial else {}
            if values:
                found[f"{one.id} {number}"] = dict(values)
    lasting = {name for name in concealed if name in effects() and effects()[name].vessel}
    for name in sorted(lasting):
        logs = [found.pop(f"{name} {number}", {}) for number in range(case.logs)]
        if any(logs):
            found[name] = {key: float(np.mean([one[key] for one in logs if one])) for key in next(filter(None, logs))}
    for truth in case.truths:
        if truth.effect == "time_delay":
            found[truth.effect] = {name: value + receiver_lag_s(case) for name, value in truth.values.items()}
    return found


def _air(case: Case, number: int) -> Floats:
    """Return the velocity of the air in a log, north and east [m/s], shape (n, 2)."""
    seed, rows, _ = _drawn(case, number)
    t = np.arange(rows.stop) / RATE_HZ
    return build_plant(VESSELS[case.vessel], t, _conditions(case, number), seed).air[rows]


def _conditions(case: Case, number: int) -> Mapping[str, Any]:
    """Return the settings of the plant in a log: what only acts from a later one on is left out before."""
    conditions = dict(case.conditions)
    if number < case.first_log:
        for name in plant_effects()[case.truths[0].effect].settings:
            conditions.pop(name, None)
    return complete_conditions(conditions)


def _part(trial: Trial, rows: slice) -> Trial:
    plant = replace(
        trial.plant, t=trial.plant.t[: rows.stop - rows.start], air=trial.plant.air[rows], water=trial.plant.water[rows]
    )
    return Trial(
        plant,
        plant.t,
        trial.reported[rows],
        trial.states[rows],
        trial.orders[rows],
        trial.wanted[rows],
        {name: load[rows] for name, load in trial.loads.items()},
        trial.thrust[rows],
    )


def _recorded(trial: Trial, case: Case, number: int) -> list[Stream]:
    """Return the messages of a log, at its time of the day, the receiver's as they arrive."""
    rng = np.random.default_rng([case.seed, number, 1])
    navigation, *others = streams(trial, int(rng.integers(2**31)))
    every = [_as_heard(navigation, rng), *others]
    later = number * APART_NS
    return [replace(one, stamp_ns=one.stamp_ns + later, receive_ns=one.receive_ns + later) for one in every]


def _as_heard(stream: Stream, rng: np.random.Generator) -> Stream:
    """Return the receiver's messages at its own rate, some of them repeating the last one, some missing."""
    heard = np.zeros(len(stream.stamp_ns), dtype=bool)
    heard[::RECEIVED_EVERY] = True
    for _ in range(int(rng.integers(0, MOST_GAPS + 1))):
        begin = int(rng.integers(0, len(heard)))
        heard[begin : begin + int(rng.uniform(*GAP_S) * RATE_HZ)] = False
    rows = np.flatnonzero(heard)
    repeated = rng.random(len(rows)) < HELD
    repeated[0] = False
    content = rows[np.maximum.accumulate(np.where(repeated, 0, np.arange(len(rows))))]
    return replace(
        stream,
        stamp_ns=stream.stamp_ns[rows],
        receive_ns=stream.receive_ns[rows],
        columns={name: values[content] for name, values in stream.columns.items()},
    )
