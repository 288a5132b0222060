"""Short-crested waves and boats' wakes: their pressure over the sides and ends of a box (Froude and Krylov)."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from scipy.signal import welch

from ferryid.compiled import compiled
from ferryid.types import Floats
from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.navigation import RATE_HZ
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.trial import Trial
from ferryid.validation.plant.vessels import GRAVITY, RHO, Vessel

COMPONENTS = 45
DRIFT = 0.25
"""Mean force of waves over what a wall would feel that throws them all back."""


class SeaConstants(NamedTuple):
    """Waves: amplitude [m], frequency [rad/s], way [rad], phase, middle and width in time [s], shape (k,); and the hull."""

    amplitude: Floats
    omega: Floats
    way: Floats
    phase: Floats
    middle: Floats
    width: Floats
    length: float
    beam: float
    draught: float
    more: Floats
    drift: Floats


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a sea of a significant height [m]; the forces that it exerts are measured in the trial."""
    period = float(rng.uniform(0.9, 1.4)) * np.sqrt(vessel.length)
    settings = {"wave_height": size, "wave_period": float(period), "wave_direction": float(rng.uniform(0.0, 360.0))}
    return injection("waves", {}, settings)


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Add the load of waves and wakes."""
    if conditions["wave_height"] > 0.0 or len(conditions["wakes"]):
        sea = sea_constants(rng, plant.vessel, conditions)
        times, sizes = np.array(conditions["wave_course"]).reshape(-1, 2).T

        def load(t: float, y: Floats, out: Floats) -> None:
            sea_load(sea, t, y[0], y[1], y[5], out)
            if times.size:
                out *= np.interp(t, times, sizes)

        plant.loads["waves"] = load


def realised(trial: Trial, conditions: Conditions) -> Mapping[str, float]:
    """Return the mean frequency of the moment [Hz], and standard deviations of force [N] and moment [N·m]."""
    if conditions["wave_height"] == 0.0:
        return {}
    X, Y, N = trial.loads["waves"][:, [0, 1, 5]].T
    frequency, power = welch(N, RATE_HZ, nperseg=min(4096, len(N)))
    return {
        "peak_frequency": float((frequency * power).sum() / power.sum()),
        "force_std": float(np.sqrt(0.5 * (X.var() + Y.var()))),
        "moment_std": float(N.std()),
    }


def sea_constants(rng: np.random.Generator, vessel: Vessel, conditions: Conditions) -> SeaConstants:
    """Return the components of a sea and of wakes, shape (k,)."""
    rows = []
    drift = np.zeros(2)
    way = np.radians(conditions["wave_direction"])
    if conditions["wave_height"] > 0.0:
        peak = 1.0 / conditions["wave_period"]
        edges = np.geomspace(0.6, 2.6, COMPONENTS + 1) * peak
        f = rng.uniform(edges[:-1], edges[1:])
        sigma = np.where(f > peak, 0.09, 0.07)
        bump = np.exp(-0.5 * ((f / peak - 1.0) / sigma) ** 2)
        power = f**-5 * np.exp(-1.25 * (f / peak) ** -4) * 3.3**bump * np.diff(edges)
        power *= (conditions["wave_height"] / 4.0) ** 2 / power.sum()
        ways = way + np.radians(conditions["wave_spread"]) * rng.standard_normal(COMPONENTS)
        for k in range(COMPONENTS):
            rows.append((np.sqrt(2.0 * power[k]), 2.0 * pi * f[k], ways[k], rng.uniform(0.0, 2.0 * pi), 0.0, 0.0))
        size = DRIFT * RHO * GRAVITY * conditions["wave_height"] ** 2 / 16.0 * np.sqrt(vessel.length * vessel.beam)
        drift = size * np.array([np.cos(way), np.sin(way)])
    for at, height, period, duration, direction in conditions["wakes"]:
        # Three near frequencies, as behind a hull, under one envelope.
        for factor in (0.93, 1.0, 1.07):
            phase = rng.uniform(0.0, 2.0 * pi)
            rows.append((height / 6.0, 2.0 * pi * factor / period, np.radians(direction), phase, at, duration / 4.0))
    columns = np.array(rows).reshape(-1, 6).T.copy()
    amplitude, omega, ways, phases, middles, widths = (columns[k] for k in range(6))
    added = vessel.added
    # Water that the hull turns aside pushes as much again as its share of the mass.
    more = 1.0 + np.array([added["11"], added["22"], added["33"]]) / vessel.mass
    return SeaConstants(
        amplitude, omega, ways, phases, middles, widths, vessel.length, vessel.beam, vessel.draught, more, drift
    )


@compiled
def sea_load(sea: SeaConstants, t: float, north: float, east: float, psi: float, out: Floats) -> None:
    """Write the load of the waves at a place and time, shape (6,) [N, N·m]."""
    for i in range(6):
        out[i] = 0.0
    for i in range(len(sea.omega)):
        amplitude = sea.amplitude[i]
        if sea.width[i] > 0.0:
            amplitude *= np.exp(-0.5 * ((t - sea.middle[i]) / sea.width[i]) ** 2)
        if amplitude < 1e-9:
            continue
        k = sea.omega[i] ** 2 / GRAVITY
        kx, ky = k * cos(sea.way[i] - psi), k * sin(sea.way[i] - psi)
        phase = sea.omega[i] * t - k * (north * cos(sea.way[i]) + east * sin(sea.way[i])) + sea.phase[i]
        a, b = 0.5 * kx * sea.length, 0.5 * ky * sea.beam
        over = (1.0 - np.exp(-k * sea.draught)) / k
        pressure = RHO * GRAVITY * amplitude
        sinc_a = sin(a) / a if abs(a) > 1e-6 else 1.0
        sinc_b = sin(b) / b if abs(b) > 1e-6 else 1.0
        # Sides: pressure on port less that on starboard, over the length; ends the same over the beam.
        side, end = sin(phase), cos(phase)
        out[0] += sea.more[0] * pressure * over * -2.0 * sin(a) * sinc_b * sea.beam * side
        out[1] += sea.more[1] * pressure * over * -2.0 * sin(b) * sinc_a * sea.length * side
        out[2] -= pressure * np.exp(-k * sea.draught) * sea.length * sea.beam * sinc_a * sinc_b * end
        # First moment of the pressure along the length: the derivative of sinc.
        arm = 0.5 * sea.length * ((sin(a) - a * cos(a)) / (a * a) if abs(a) > 1e-4 else a / 3.0)
        out[5] += sea.more[1] * pressure * over * 2.0 * sin(b) * arm * sea.length * end
        out[3] += 0.3 * sea.draught * pressure * over * 2.0 * sin(b) * sinc_a * sea.length * side
    c, s = cos(psi), sin(psi)
    out[0] += c * sea.drift[0] + s * sea.drift[1]
    out[1] += c * sea.drift[1] - s * sea.drift[0]


EFFECT = PlantEffect(
    "waves",
    "m",
    (0.0005, 0.12),
    0.05,
    sample,
    rank=4,
    settings={
        "wave_height": 0.0,
        "wave_period": 2.5,
        "wave_direction": 0.0,
        "wave_spread": 20.0,
        "wave_course": (),
        "wakes": (),
    },
    act=act,
    stream=2,
    realised=realised,
    stochastic=True,
)
"""Significant height [m], peak period [s], where the sea goes to [deg], and its spread about that [deg]; its course: rows of
time [s] and a factor on its forces, linear in between; wakes of boats: time [s], height [m], period [s], duration [s],
direction [deg]."""
