"""What no effect of the library is: conditions that change, and vessels that the profile does not describe."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import numpy as np

from ferryid.prove.known import SURGE, SWAY, YAW
from ferryid.prove.plant.vessels import Vessel


@dataclass(frozen=True)
class Outside:
    """One thing outside the library: how it is drawn, what names would say it in part, and what the profile is told wrong.

    ``draw(vessel, duration_s, rng)`` gives conditions of the plant. `lacks` are coefficients that the model has not; `moved` is
    by how many lengths its first thruster is believed to lie further forward.
    """

    title: str
    draw: Callable[[Vessel, float, np.random.Generator], dict[str, Any]]
    allowed: tuple[str, ...] = ()
    lacks: tuple[str, ...] = ()
    moved: float = 0.0


def _nothing(vessel: Vessel, duration_s: float, rng: np.random.Generator) -> dict[str, Any]:
    return {}


def _way(rng: np.random.Generator, low: float, high: float) -> tuple[float, float]:
    angle, size = rng.uniform(0.0, 2.0 * pi), rng.uniform(low, high)
    return float(size * cos(angle)), float(size * sin(angle))


def _squall(vessel: Vessel, duration_s: float, rng: np.random.Generator) -> dict[str, Any]:
    north, east = _way(rng, 3.0, 6.0)
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
    return {"current": _way(rng, 0.15, 0.3), "current_turn": turn}


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


OUTSIDE: Mapping[str, Outside] = {
    "squall": Outside("a wind of a few minutes", _squall, ("wind", "gusts")),
    "veering wind": Outside("a wind that turns by half a circle", _veering, ("wind", "gusts")),
    "turning current": Outside("a current that turns right round", _turning_current, ("current",)),
    "boat wakes": Outside("wakes of four passing boats", _wakes, ("waves", "gusts")),
    "no cross damping": Outside(
        "a model whose sway and yaw do not damp each other",
        _nothing,
        (),
        # All but damping along the axis itself.
        tuple(name for name in (*SWAY, *YAW) if name not in ("Y_v", "Y_|v|v", "N_r", "N_|r|r")),
    ),
    "no damping of second order": Outside(
        "a model with linear damping only",
        _nothing,
        ("fouling",),
        tuple(name for name in (*SURGE, *SWAY, *YAW) if len(name) > 3),
    ),
    "thruster elsewhere": Outside("a thruster that lies elsewhere than in the profile", _nothing, moved=0.08),
}
