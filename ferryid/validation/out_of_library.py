"""Conditions that no effect of the library describes: weather that changes, and profiles that lack physics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import numpy as np

from ferryid.validation.plant.vessels import Vessel
from ferryid.validation.prior_profile import SURGE, SWAY, YAW, damping


@dataclass(frozen=True)
class OutOfLibrary:
    """Something outside the library.

    ``draw(vessel, duration_s, rng)`` returns conditions of the plant. `allowed` are effects that describe it in part,
    `omitted_terms` coefficients that the profile lacks; `thruster_shift` is by how many lengths the profile has the first
    thruster too far forward.
    """

    title: str
    draw: Callable[[Vessel, float, np.random.Generator], dict[str, Any]]
    allowed: tuple[str, ...] = ()
    omitted_terms: tuple[str, ...] = ()
    thruster_shift: float = 0.0


def _nothing(vessel: Vessel, duration_s: float, rng: np.random.Generator) -> dict[str, Any]:
    return {}


def _random_vector(rng: np.random.Generator, low: float, high: float) -> tuple[float, float]:
    angle, size = rng.uniform(0.0, 2.0 * pi), rng.uniform(low, high)
    return float(size * cos(angle)), float(size * sin(angle))


def _squall(vessel: Vessel, duration_s: float, rng: np.random.Generator) -> dict[str, Any]:
    north, east = _random_vector(rng, 3.0, 6.0)
    begin, seconds = rng.uniform(0.2, 0.6) * duration_s, rng.uniform(0.15, 0.25) * duration_s
    times = (0.0, begin, begin + 20.0, begin + seconds, begin + seconds + 20.0)
    return {"wind_series": [[float(t), on * north, on * east] for t, on in zip(times, (0, 0, 1, 1, 0), strict=True)]}


def _veering(vessel: Vessel, duration_s: float, rng: np.random.Generator) -> dict[str, Any]:
    start, speed, way = rng.uniform(0.0, 2.0 * pi), rng.uniform(3.0, 5.0), float(rng.choice([-1.0, 1.0]))
    shares = np.linspace(0.0, 1.0, 25)
    angles = start + way * pi * shares
    rows = np.column_stack([shares * duration_s, speed * np.cos(angles), speed * np.sin(angles)])
    return {"wind_series": rows.tolist()}


def _turning_current(vessel: Vessel, duration_s: float, rng: np.random.Generator) -> dict[str, Any]:
    turn = float(rng.choice([-1.0, 1.0])) * 360.0 / (duration_s / 60.0)
    return {"current": _random_vector(rng, 0.15, 0.3), "current_turn": turn}


def _wakes(vessel: Vessel, duration_s: float, rng: np.random.Generator) -> dict[str, Any]:
    return {
        "wakes": [
            [
                float(rng.uniform(0.1, 0.9)) * duration_s,
                float(rng.uniform(0.1, 0.2)),
                float(rng.uniform(1.8, 2.4)),
                30.0,
                float(rng.uniform(0.0, 360.0)),
            ]
            for _ in range(4)
        ]
    }


def _hump(vessel: Vessel, duration_s: float, rng: np.random.Generator) -> dict[str, Any]:
    speed = float(rng.uniform(0.4, 0.7)) * vessel.speed_mps
    coefficients = damping(vessel)
    drag = coefficients["X_u"] * speed + coefficients["X_|u|u"] * speed**2
    return {"hump": (speed, 0.12 * vessel.speed_mps, float(rng.uniform(0.5, 1.0)) * abs(drag))}


OUT_OF_LIBRARY: Mapping[str, OutOfLibrary] = {
    "squall": OutOfLibrary("a wind of a few minutes", _squall, ("wind", "gusts")),
    "veering wind": OutOfLibrary("a wind that turns by half a circle", _veering, ("wind", "gusts")),
    "turning current": OutOfLibrary("a current that turns right round", _turning_current, ("current",)),
    "boat wakes": OutOfLibrary("wakes of four passing boats", _wakes, ("waves", "gusts")),
    "resistance hump": OutOfLibrary("a hump of resistance at one speed", _hump, ("fouling",)),
    "no cross damping": OutOfLibrary(
        "a model whose sway and yaw do not damp each other",
        _nothing,
        (),
        # All but damping along the axis itself.
        tuple(name for name in (*SWAY, *YAW) if name not in ("Y_v", "Y_|v|v", "N_r", "N_|r|r")),
    ),
    "no damping of second order": OutOfLibrary(
        "a model with linear damping only",
        _nothing,
        ("fouling",),
        tuple(name for name in (*SURGE, *SWAY, *YAW) if len(name) > 3),
    ),
    "thruster elsewhere": OutOfLibrary(
        "a thruster that lies elsewhere than in the profile", _nothing, thruster_shift=0.08
    ),
}
