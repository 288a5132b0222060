"""A propeller that draws air: above a critical speed air gathers in its disc, below it is washed out again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span
from ferryid.validation.plant.motion import BODY
from ferryid.validation.plant.thrusters import FREE_OF_AIR, STATES
from ferryid.validation.plant.vessels import Vessel

if TYPE_CHECKING:
    from ferryid.validation.plant.plant import Plant
    from ferryid.validation.plant.trial import Trial

BAND = 10.0
"""Width of the band of the estimated effect [% of the largest force]."""


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a loss of a share of the force above a critical share of the most speed; both are measured in the trial."""
    one = vessel.thrusters[int(rng.integers(len(vessel.thrusters)))]
    air = (size, float(rng.uniform(0.6, 0.75)))
    return Injection({"air": {one.name: air}}, (Truth("ventilation", one.name, {}),))


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Let thrusters, by name, lose a share of their force with the air that they draw above a share of their most speed."""
    air = conditions["air"]
    plant.set_thrusters(air=np.array([air.get(one.name, FREE_OF_AIR) for one in plant.vessel.thrusters]))


def realised(trial: Trial, conditions: Conditions) -> Mapping[str, float]:
    """Return share and loading by least squares of the force, in the form of the estimated effect."""
    if not conditions["air"]:
        return {}
    (name,) = conditions["air"]
    vessel = trial.plant.vessel
    i = [one.name for one in vessel.thrusters].index(name)
    one = vessel.thrusters[i]
    n = trial.states[:, BODY + STATES * i]
    curve = np.where(n >= 0.0, one.ahead, one.astern) * n * np.abs(n)
    loads, lost = 100.0 * (n / one.most_rpm) ** 2, curve - trial.thrust[:, i, 0]

    def fitted(start: float) -> tuple[float, float]:
        share = np.clip((loads - start) / BAND, 0.0, 1.0)
        column = curve * share * share * (3.0 - 2.0 * share)
        loss = float(column @ lost) / max(float(column @ column), 1e-12)
        return float(np.sum((lost - loss * column) ** 2)), loss

    start = min(np.arange(15.0, 90.0, 0.25).tolist(), key=lambda at: fitted(at)[0])
    return {"factor": 1.0 - fitted(start)[1], "from": start}


EFFECT = PlantEffect(
    "ventilation",
    "share of the force that is lost",
    (0.03, 0.8),
    0.4,
    sample,
    rank=24,
    settings={"air": {}},
    act=act,
    realised=realised,
    neutral=1.0,
    positions=("from", "time_constant"),
)
