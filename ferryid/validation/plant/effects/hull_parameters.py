"""Wrong coefficients in the profile's hull: the plant stays as it is."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import Injection, PlantEffect, Span, injection, random_sign
from ferryid.validation.plant.vessels import Vessel

NAMES = ("m11", "m22", "m33", "X_|u|u", "Y_|v|v", "N_|r|r", "N_|v|r", "N_r")
"""Coefficients that matter in these trials."""
COUNT = 2
"""How many of them are wrong."""


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a profile that has some coefficients wrong: the true ones are larger or smaller by a share."""
    chosen = [NAMES[k] for k in rng.choice(len(NAMES), COUNT, replace=False)]
    true = {name: float((1.0 + size) ** random_sign(rng)) for name in chosen}
    factors = {name: 1.0 / factor for name, factor in true.items()}
    return injection("hull_parameters", true, {}, hull_factors=factors)


EFFECT = PlantEffect("hull_parameters", "share of a coefficient", (0.1, 1.5), 0.8, sample, rank=19, neutral=1.0)
