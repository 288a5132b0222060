"""A model that was fitted on a scaled base model, beside the profile's hull as it is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ferryid.identify.outcome import LogFit
from ferryid.models import Model
from ferryid.models.forces import Estimator, effective_mass, model_estimator, without_inputs
from ferryid.models.prediction import Prediction, window_errors, window_scores
from ferryid.types import AXES
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile


def beside_profile(model: Model, profile: Profile, logs: Sequence[LogFit]) -> tuple[str, ...]:
    """Say how a model predicts held-out windows beside the profile's hull, where its base model is that hull scaled.

    A base model that was made wrong is easily bettered, which says nothing of the hull at hand.

    Parameters
    ----------
    model
        The model that has not seen the held-out rows.
    profile
        The vessel.
    logs
        The logs; without any, as of a fit to sums, nothing is said.
    """
    if not model.changed_scale or not profile.hull.has_model:
        return ()
    new, hull = model_estimator(model), Estimator(profile, {})
    mass, length_s = effective_mass(profile, {}, (), np.zeros((0, 3))), window_seconds(profile)
    reduced = not profile.measures_sway
    found = []
    for log in logs:
        # As of the base model of a fit: it knows no measured wind, current or payload.
        bare = without_inputs(log.motion)
        both = (Prediction(hull.of(bare), bare, hull), Prediction(new.of(log.motion), log.motion, new))
        one = window_errors(both, log.motion, log.validation, mass, length_s, reduced=reduced)
        found.append((one.force, *one.errors, one.accelerating))
    if not sum(len(force) for force, *_ in found):
        return ()
    scores = window_scores(*(np.concatenate(columns) for columns in zip(*found, strict=True)))
    scores = scores.without_sway() if reduced else scores
    known = {axis: float(ratio) - 1.0 for axis, ratio in zip(AXES, scores.ratio, strict=True) if np.isfinite(ratio)}
    if not known:
        return ()
    mean = float(np.mean(list(known.values())))
    return (
        f"Beside the profile's hull, not scaled, the squared prediction error on the same data is {100.0 * abs(mean):.1f} % "
        f"{'below' if mean < 0.0 else 'above'}: {', '.join(f'{axis} {100.0 * one:+.1f} %' for axis, one in known.items())}.",
    )
