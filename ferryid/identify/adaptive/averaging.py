"""Several models as one: the mean of the last ones (3.9), and a forgetting factor (5.1)."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np

from ferryid import __version__
from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.files import dump_json
from ferryid.models import ForceScores, Model, ModelScores, model_to_json, span_ranges
from ferryid.models.store import check_name
from ferryid.types import AXES, Floats
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Profile

NORMAL_95 = 1.959963984540054
"""Half the width of a 95 % interval in standard deviations."""
_SUM = 1e-9
"""Weights may miss a sum of one by this much, for decimals such as 0.333333333."""


def mean_of_last(models: Sequence[Model], count: int, *, name: str = "") -> Model:
    """Return the model whose force is the mean of the forces of the last `count` models, thesis (3.9).

    Parameters
    ----------
    models
        Models of one vessel and one basis, oldest first.
    count
        S, the number of models to average; all of them while there are fewer.
    name
        Name of the result; the newest model's where empty.

    Raises
    ------
    FerryIdError
        Without models, for S below one, or for models that do not belong together.
    """
    if count < 1:
        raise FerryIdError(f"mean of the last models: at least one is needed, {count} asked. Fix: ask for 1 or more")
    last = models[-count:]
    return weighted_mean(last, np.full(len(last), 1.0 / max(len(last), 1)), name=name)


def geometric_weights(count: int, factor: float) -> Floats:
    """Return ``[alpha_1 ... alpha_(P-1), beta]`` of (5.1), proportional to ``factor**(P - i)`` and summing to one.

    Parameters
    ----------
    count
        P, the number of models, oldest first.
    factor
        What a model still counts for when the next one comes, 0 to 1. 1 forgets nothing: the mean (3.9); 0 uses the
        newest model alone.

    Returns
    -------
    ndarray
        Shape (P,).

    Raises
    ------
    FerryIdError
        For a factor outside 0..1, or no model.
    """
    if not 0.0 <= factor <= 1.0:
        raise FerryIdError(f"forgetting factor: {factor} is none. Fix: give 0 (newest model alone) to 1 (mean of all)")
    if count < 1:
        raise FerryIdError("forgetting factor: there are no models to weigh. Fix: give one or more")
    weights = np.power(float(factor), np.arange(count - 1, -1, -1, dtype=float))
    return np.asarray(weights / weights.sum(), dtype=np.float64)


def weighted_mean(models: Sequence[Model], weights: Sequence[float] | Floats, *, name: str = "") -> Model:
    """Return the model whose force is the weighted mean of the models' forces, thesis (5.1).

    Base models with different factors delta, sigma and zeta are averaged exactly too: their force is linear in
    delta/zeta, sigma/zeta and 1/zeta.

    The covariance knows which models share training logs. Models without a common log are independent, and their
    covariances add up with the squared weights. How far models with common logs err together is not known, and for any
    dependence the covariance of a mean is at most the mean of the covariances (Jensen), which is used. Neither holds how
    far the vessel itself changed between the models. The intervals are normal ones, from the variances.

    Parameters
    ----------
    models
        Models of one vessel and one basis, oldest first.
    weights
        ``[alpha_1 ... alpha_(P-1), beta]``, none negative, summing to one, shape (P,).
    name
        Name of the result; the newest model's where empty.

    Returns
    -------
    Model
        Version 0, not judged and therefore not accepted. ``settings`` are the newest model's, and ``made_of`` and
        ``weights`` in them say what it consists of. `ranges` spans those of all models that count.

    Raises
    ------
    FerryIdError
        Where the models do not belong together or the weights are not possible.
    """
    share = _check_weights(models, weights)
    check_compatible(models)
    newest = models[-1]
    counting = [(model, w) for model, w in zip(models, share.tolist(), strict=True) if w > 0.0]
    theta, intercept = (
        np.asarray(sum(w * values for values, w in parts), dtype=np.float64)
        for parts in (
            [(model.theta, w) for model, w in counting],
            [(model.intercept, w) for model, w in counting],
        )
    )
    covariance = _covariance(counting)
    half = NORMAL_95 * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T
    own = {key: value for key, value in newest.settings.items() if key not in ("base_model", "updated", "notes")}
    coupled = any(model.settings["structure"] == "coupled" for model, _ in counting)
    return replace(
        newest,
        name=check_name(name or newest.name),
        version=0,
        created=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        ferryid_version=__version__,
        scale=_scale(counting),
        settings={
            **own,
            "structure": "coupled" if coupled else newest.settings["structure"],
            "made_of": [model_reference(model) for model in models],
            "weights": share.tolist(),
        },
        theta=theta,
        intercept=intercept,
        low=theta - half[:-1],
        high=theta + half[:-1],
        intercept_low=intercept - half[-1],
        intercept_high=intercept + half[-1],
        covariance=covariance,
        ranges=span_ranges([model.ranges for model, _ in counting]),
        training=merge_training_logs([model.training for model, _ in counting]),
        scores=unknown_scores(),
        accepted=False,
    )


def check_compatible(models: Sequence[Model]) -> None:
    """Refuse models that are of different vessels or have different terms.

    Raises
    ------
    FerryIdError
        Which two do not belong together, and why.
    """
    for model in models:
        if model.diagnosed:
            raise FerryIdError(
                f"model {model.label}: a diagnosis has changed its hull or forces, which cannot be averaged. "
                "Fix: average the models that were fitted"
            )
    first, *others = models
    vessel = parse_profile(first.profile_text, first.name)
    for other in others:
        # The terms do not tell over what length they are integrals: the name does.
        if other.terms != first.terms or other.settings["basis"] != first.settings["basis"]:
            raise FerryIdError(
                f"model {other.name}@{other.version}: its basis is {other.settings['basis']}, that of "
                f"{first.name}@{first.version} is {first.settings['basis']}, and their coefficients do not add up. "
                "Fix: fit the models with one basis"
            )
        if other.profile_text != first.profile_text:
            check_vessel(vessel, parse_profile(other.profile_text, other.name), f"{other.name}@{other.version}")


def check_vessel(vessel: Profile, other: Profile, model: str) -> None:
    """Refuse a model whose profile has another name, hull or wind areas: its coefficients correct another base model.

    Raises
    ------
    FerryIdError
        Which part differs.
    """
    if vessel.name != other.name:
        raise FerryIdError(
            f"model {model}: it is of the vessel {other.name}, {vessel.name} is needed. Fix: use models of one vessel"
        )
    a, b = vessel.hull, other.hull
    same_hull = (
        (a.mass_kg, a.inertia_z, a.x_g_m) == (b.mass_kg, b.inertia_z, b.x_g_m)
        and np.array_equal(a.M, b.M)
        and dict(a.D) == dict(b.D)
    )
    if not same_hull or vessel.wind != other.wind:
        part = "wind areas" if same_hull else "hull"
        raise FerryIdError(
            f"model {model}: the {part} of {other.name} changed since it was fitted, so that it corrects another base "
            "model. Fix: fit it again with the profile as it is now"
        )


def unknown_scores() -> ModelScores:
    """Return the scores of a model that was fitted to nothing itself."""
    unknown = np.full(len(AXES), math.nan)
    return ModelScores(
        ForceScores(unknown, unknown, unknown, unknown, unknown, math.nan),
        rows=0,
        seconds=0.0,
        split="none",
        split_notes=("Made of other models and not judged on any log.",),
    )


def _check_weights(models: Sequence[Model], weights: Sequence[float] | Floats) -> Floats:
    share = np.array(weights, dtype=np.float64)
    if not models:
        raise FerryIdError("weighted models: there are no models. Fix: give one or more")
    if share.shape != (len(models),):
        raise FerryIdError(
            f"weighted models: every model needs one weight, {counted(len(models), 'model')} came with weights of shape "
            f"{share.shape}. Fix: give {len(models)} weights"
        )
    if not (np.isfinite(share).all() and (share >= 0.0).all() and abs(share.sum() - 1.0) <= _SUM):
        raise FerryIdError(
            f"weighted models: weights must be 0 or more and sum to 1, found {share.tolist()}. "
            "Fix: divide them by their sum, or take geometric_weights"
        )
    return share


def _scale(counting: Sequence[tuple[Model, float]]) -> dict[str, float]:
    """Return the factors of the mean base model: force is linear in delta/zeta, sigma/zeta and 1/zeta."""
    scales = [tuple(float(model.scale.get(key, 1.0)) for key in ("delta", "sigma", "zeta")) for model, _ in counting]
    if len(set(scales)) == 1:
        delta, sigma, zeta = scales[0]
    else:
        zeta = 1.0 / sum(w / z for (_, _, z), (_, w) in zip(scales, counting, strict=True))
        delta = zeta * sum(w * d / z for (d, _, z), (_, w) in zip(scales, counting, strict=True))
        sigma = zeta * sum(w * s / z for (_, s, z), (_, w) in zip(scales, counting, strict=True))
    return {"delta": delta, "sigma": sigma, "zeta": zeta}


def _covariance(counting: Sequence[tuple[Model, float]]) -> Floats:
    """Return the covariance of the weighted mean, shape (3, K + 1, K + 1); see `weighted_mean`."""
    # A model is at most as exact as the mean of its group's covariances; groups share no log and are independent.
    groups: list[tuple[set[str], list[tuple[Model, float]]]] = []
    for model, w in counting:
        logs = {str(log["sha256"]) for log in model.training}
        members = [(model, w)]
        apart = []
        for known, others in groups:
            if known & logs:
                logs, members = logs | known, others + members
            else:
                apart.append((known, others))
        groups = [*apart, (logs, members)]
    total = np.zeros_like(counting[0][0].covariance)
    for _, members in groups:
        share = sum(w for _, w in members)
        for model, w in members:
            total += share * w * model.covariance
    return np.asarray(total, dtype=np.float64)


def model_reference(model: Model) -> str:
    """Return ``name@version#digest``: which model exactly, also where it was never stored; the date does not count."""
    text = dump_json(model_to_json(replace(model, created="")))
    return f"{model.name}@{model.version}#{hashlib.sha256(text.encode()).hexdigest()[:12]}"


def merge_training_logs(parts: Sequence[Sequence[Mapping[str, Any]]]) -> tuple[Mapping[str, Any], ...]:
    """Return every training log once; of one that is there several times, the entry with the most rows."""
    found: dict[str, Mapping[str, Any]] = {}
    for part in parts:
        for log in part:
            before = found.get(log["sha256"])
            if before is None or (log["rows"] or 0) > (before["rows"] or 0):
                found[log["sha256"]] = log
    return tuple(found.values())
