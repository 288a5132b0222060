"""Models as the thesis makes them: SIMPLS on every row of the rounds so far, with nothing held back."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from ferryid.identify import FitSettings
from ferryid.identify.adaptive import data_matrix, fit_motions
from ferryid.models import Model
from ferryid.models.forces import Estimator
from ferryid.regression import CrossProducts, QrFactor, Rows, factorise
from ferryid.signals.track import Motion
from ferryid.vessel.load import parse_profile
from ferryid.vessel.profile import Profile

BASE = {"delta": 0.4, "sigma": 0.4, "zeta": 1.0}
"""The thesis's base model, (4.2)-(4.5)."""
MASTER = {"delta": 1.0, "sigma": 1.0, "zeta": 1.0}

THESIS = FitSettings(
    basis="thesis",
    structure="coupled",
    components=12,
    window_s=1.0,
    inertia="fitted",
    estimator="derivative",
    accept="thesis",
    delta=0.4,
    sigma=0.4,
)
"""Basis (3.4), every function in every axis, and the choices of section 5.3."""


def learn(motions: Sequence[Motion], profile: Profile, settings: FitSettings = THESIS) -> Model:
    """Return the model that the thesis would make of these rounds, (3.1)-(3.3); the motions' window is the settings'."""
    return fit_motions(profile, motions, settings, name="reproduction").model


def products(motions: Sequence[Motion], profile: Profile, settings: FitSettings = THESIS) -> CrossProducts | QrFactor:
    """Return what SIMPLS needs of basis and residual."""
    data = data_matrix(profile, motions, settings)
    return factorise(Rows.of(data.X, data.Y), names=data.functions.terms, where=motions[0].log)


def hull_alone(profile: Profile, scale: dict[str, float]) -> Estimator:
    """Return the estimator of the profile's hull, scaled."""
    return Estimator(profile, scale)


def without_anemometer(motion: Motion) -> Motion:
    """Return a log as it would be had nobody measured wind and current."""
    return replace(motion, wind=None, current=None)


def without_wind_areas(profile: Profile) -> Profile:
    """Return a profile that knows nothing of the wind on its vessel; models learnt with it store it so."""
    text = re.sub(r"^\[wind\].*?(?=^\[|\Z)", "", profile.text, flags=re.MULTILINE | re.DOTALL)
    return parse_profile(text, profile.name)
