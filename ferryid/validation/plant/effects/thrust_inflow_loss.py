"""Thrust that is lost to water flowing into the propeller."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.trial import Trial
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a loss, as a share per m/s at 60 % of full speed; what it amounts to is measured in the trial."""
    return injection("thrust_inflow_loss", {}, {"inflow": size})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Let thrust fall with the inflow [s/m]."""
    plant.set_thrusters(inflow=conditions["inflow"])


def realised(trial: Trial, conditions: Conditions) -> Mapping[str, float]:
    """Return the loss per m/s of inflow by least squares of loss over force times inflow, the form of the estimated effect."""
    if conditions["inflow"] == 0.0:
        return {}
    _, push, flow = trial.thrust.T
    force = np.abs(push)
    lost = np.abs(push) - trial.thrust[:, :, 0].T * np.sign(push)
    return {"per_mps": float((lost * force * flow).sum() / ((force * flow) ** 2).sum())}


EFFECT = PlantEffect(
    "thrust_inflow_loss",
    "s/m",
    (0.01, 0.6),
    0.25,
    sample,
    rank=11,
    settings={"inflow": 0.0},
    act=act,
    realised=realised,
)
