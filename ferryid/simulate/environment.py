"""Wind, current and payload: the wind's series over the trial, and what sensors tell log and controller of all three."""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np

from ferryid.simulate.noise import generator, gusts, interpolated, sample_times
from ferryid.simulate.scenario import Scenario, read_series
from ferryid.types import Floats

GUST_STEP_S = 0.02
"""Grid of the gusts [s], linear in between: their own, so that the rates of sensors do not change the weather."""


class Link(NamedTuple):
    """How a topic gets from its sensor to the recorder: when it is sampled, how late it arrives [s]."""

    phase_s: float
    latency_s: float
    jitter_s: float


WIND = Link(0.037, 0.045, 0.006)
CURRENT = Link(0.029, 0.08, 0.01)
PAYLOAD = Link(0.043, 0.12, 0.02)


def wind_series(scenario: Scenario, seed: int, n: int, step_s: float) -> tuple[Floats, Floats]:
    """Return the wind's north and east components [m/s] every `step_s` seconds: steady part, gusts, recorded series.

    Raises
    ------
    FerryIdError
        When the recorded series cannot be read.
    """
    wind = scenario.wind
    t = np.arange(n, dtype=np.float64) * step_s
    nodes = ceil((n - 1) * step_s / GUST_STEP_S) + 2
    swing = np.column_stack(
        [
            gusts(generator(seed, f"gust {axis}"), nodes, GUST_STEP_S, wind.gust_std_mps, wind.gust_time_s)
            for axis in ("north", "east")
        ]
    )
    blown = interpolated(t, np.arange(nodes, dtype=np.float64) * GUST_STEP_S, swing)
    blown += np.array((wind.north_mps, wind.east_mps))
    blown[(t < wind.from_s) | (t >= wind.until_s)] = 0.0
    if wind.series:
        grid, *recorded = read_series(scenario.file(wind.series))
        blown += interpolated(t, grid, np.column_stack(recorded))
    return blown[:, 0].copy(), blown[:, 1].copy()


def current_samples(scenario: Scenario, seed: int, t: Floats, current: Floats) -> tuple[Floats, Floats]:
    """Return when the current meter takes its samples [s], shape (n,), and what it shows, north and east, shape (n, 2) [m/s].

    Parameters
    ----------
    scenario, seed
        Of the trial.
    t, current
        Truth: ascending times [s], shape (m,), and the water's velocity over ground [m/s], shape (m, 2).
    """
    sensors = scenario.sensors
    taken = sample_times(float(t[-1]), sensors.current_rate_hz, CURRENT.phase_s)
    noise = generator(seed, "/weather/current").normal_columns(len(taken), 2)
    return taken, interpolated(taken, t, current) + sensors.noise.current_mps * noise


def payload_samples(scenario: Scenario, seed: int, t: Floats, payload: Floats) -> tuple[Floats, Floats]:
    """Return when a camera reads the waterline [s], shape (n,), and the mass [kg] and place [m] it makes of it, shape (n, 2).

    A little noise may weigh less than nothing.

    Parameters
    ----------
    scenario, seed
        Of the trial.
    t, payload
        Truth: ascending times [s], shape (m,), mass aboard [kg] and its place [m], shape (m, 2).
    """
    sensors = scenario.sensors
    taken = sample_times(float(t[-1]), sensors.payload_rate_hz, PAYLOAD.phase_s)
    values = interpolated(taken, t, payload)
    values[:, 0] += sensors.noise.payload_kg * generator(seed, "/payload/waterline").standard_normal(len(taken))
    return taken, values


def _wind_samples(scenario: Scenario, seed: int, t: Floats, wind: Floats) -> tuple[Floats, Floats]:
    """Return what an anemometer makes of the wind over ground; its errors act on both components alike."""
    sensors = scenario.sensors
    taken = sample_times(float(t[-1]), sensors.wind_rate_hz, WIND.phase_s)
    noise = generator(seed, "controller wind").normal_columns(len(taken), 2)
    return taken, interpolated(taken, t, wind) + sensors.noise.wind_speed_mps * noise


def controller_weather(
    scenario: Scenario, seed: int, cycles: Floats, t: Floats, wind: Floats, current: Floats, payload: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return wind, current and payload as the feedforward gets them, one row a control cycle, shape (m, 2) each.

    Current and payload are the very samples of the log. Each sample arrives with its topic's latency (without the jitter) and
    is held; zero before the first, and where the topic is left out. The wind's noise is drawn apart from that of the log: what
    an anemometer on board shows depends on how the vessel moves, which is not known before the trial is run; its size is
    that of the log's.

    Parameters
    ----------
    scenario, seed
        Of the trial.
    cycles
        Time of every control cycle [s], ascending, shape (m,).
    t
        Times of the truth [s], ascending, shape (n,).
    wind, current
        Truth over ground, north and east [m/s], shape (n, 2).
    payload
        Truth, mass aboard [kg] and its place [m], shape (n, 2).
    """
    sensors = scenario.sensors
    made = []
    for rate_hz, link, sample, truth in (
        (sensors.wind_rate_hz, WIND, _wind_samples, wind),
        (sensors.current_rate_hz, CURRENT, current_samples, current),
        (sensors.payload_rate_hz, PAYLOAD, payload_samples, payload),
    ):
        seen = np.zeros((len(cycles), 2))
        if rate_hz > 0.0:
            taken, values = sample(scenario, seed, t, truth)
            row = np.searchsorted(taken + link.latency_s, cycles, side="right") - 1
            seen[row >= 0] = values[row[row >= 0]]
        made.append(seen)
    return made[0], made[1], made[2]
