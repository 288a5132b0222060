"""Coefficients of the hull that a fit turns round: of another sign than in the base model, beyond their uncertainty."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.effects.force_model import COEFFICIENTS, UNITS
from ferryid.models import Model
from ferryid.models.coefficients import coefficient_intervals
from ferryid.models.forces import hull_coefficients

MOST_NAMED = 4
"""Coefficients that are told with their intervals; the others are counted."""


def sign_changes(model: Model) -> tuple[str, ...]:
    """Return a sentence on the coefficients whose 95 % interval lies on the other side of zero than the base model's value."""
    base = hull_coefficients(replace(model, hull={}, theta=np.zeros_like(model.theta)))
    found = coefficient_intervals(model)
    turned = []
    for name, before, unit in zip(COEFFICIENTS, base.tolist(), UNITS, strict=True):
        value, low, high = found[name].tolist()
        if before * value < 0.0 and low * high > 0.0:
            turned.append(f"{name} {value:.4g} {unit} ({low:.4g} to {high:.4g}; base model {before:.4g})")
    if not turned:
        return ()
    more = f" and {len(turned) - MOST_NAMED} more" if len(turned) > MOST_NAMED else ""
    return (
        f"Of another sign than in the base model, beyond the 95 % interval: {'; '.join(turned[:MOST_NAMED])}{more}. "
        "The base model may be wrong in them, or they stand for a force that has no term.",
    )
