"""A model of the applied force: base model plus a linear correction, with everything needed to check it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ferryid import __version__
from ferryid.counts import verb
from ferryid.errors import FerryIdError
from ferryid.models.scores import ModelScores
from ferryid.models.stored_effect import (
    Conditions,
    Quantity,
    StoredEffect,
    conditions_from_json,
    conditions_to_json,
    effect_to_json,
    effects_from_json,
    hull_from_json,
    hull_to_json,
)
from ferryid.types import AXES, Floats
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Profile

SCHEMA = "ferryid.model/1"
NO_BASIS = "none"
"""Basis of a model without terms: a diagnosed hull."""


@dataclass(frozen=True)
class Model:
    """``tau = F_0(nu_dot, nu) + theta' phi + intercept``, thesis (3.3).

    Attributes
    ----------
    name, version
        Name in the store and version counted from 1 (0: not stored yet).
    created
        ISO 8601 time in UTC; the only field that differs between two runs on the same input.
    ferryid_version
        Version that wrote it.
    profile_text
        The vessel profile (TOML) that the model was fitted with, embedded so that other logs can be evaluated.
    scale
        ``{"delta": 1.0, "sigma": 1.0, "zeta": 1.0}`` factors on the base model's M and C, D, and tau (4.2)-(4.5).
    settings
        The fit's settings as plain values: basis, structure, components, window_s, smoother, split, residual, ...
    terms
        Basis function names, K of them.
    units
        Unit of each coefficient, K rows of three (N, N, N·m over the term's unit).
    theta
        Coefficients, shape (K, 3).
    intercept
        Shape (3,) [N, N, N·m].
    low, high
        95 % block-bootstrap interval of `theta`, shape (K, 3).
    intercept_low, intercept_high
        The same for `intercept`, shape (3,).
    covariance
        Bootstrap covariance of the coefficients per axis, shape (3, K + 1, K + 1), intercept last.
    ranges
        Ranges of validity, see `ferryid.models.validity`.
    training
        One entry a log: ``{"name", "files", "sha256", "seconds", "rows", "motion"}``, the last as of
        `ferryid.signals.copies.motion_marks`, which models from before, and of archives, lack.
    scores
        Force errors on validation rows; None of a model that was not judged.
    accepted
        Verdict at the time of the fit.
    hull
        The hull's coefficients as a diagnosis refitted them, by the names of `ferryid.effects.force_model.COEFFICIENTS`; those
        of acceleration and damping among `terms` are counted in. Empty in a model that was fitted alone.
    vessel_effects
        Properties of hull and thrusters, in the order in which they act.
    conditions
        What single logs were recorded in; they act in these alone.
    """

    name: str
    version: int
    created: str
    ferryid_version: str
    profile_text: str
    scale: Mapping[str, float]
    settings: Mapping[str, Any]
    terms: tuple[str, ...]
    units: tuple[tuple[str, str, str], ...]
    theta: Floats
    intercept: Floats
    low: Floats
    high: Floats
    intercept_low: Floats
    intercept_high: Floats
    covariance: Floats
    ranges: Mapping[str, tuple[float, float]]
    training: tuple[Mapping[str, Any], ...]
    scores: ModelScores | None
    accepted: bool
    hull: Mapping[str, Quantity] = field(default_factory=dict)
    vessel_effects: tuple[StoredEffect, ...] = ()
    conditions: tuple[Conditions, ...] = ()

    @property
    def label(self) -> str:
        """Name and version."""
        return f"{self.name}@{self.version}"

    @property
    def diagnosed(self) -> bool:
        """True where a diagnosis has changed hull or forces."""
        return bool(self.hull or self.vessel_effects or self.conditions)

    @property
    def blank(self) -> bool:
        """True where nothing is added to the base model."""
        return not (self.diagnosed or self.terms) and self.settings["basis"] == NO_BASIS

    @property
    def changed_scale(self) -> dict[str, float]:
        """The factors on the base model that are not one."""
        return {name: float(value) for name, value in self.scale.items() if value != 1.0}

    @property
    def learned(self) -> bool:
        """True where terms were learned beside a diagnosis."""
        return self.diagnosed and bool(self.settings.get("learned", False))

    def conditions_of(self, sha256: str) -> tuple[StoredEffect, ...]:
        """Return what a log was recorded in, by its hash; nothing for a log that was not diagnosed."""
        return tuple(one for known in self.conditions if known.sha256 == sha256 for one in known.effects)

    def undiagnosed(self) -> Model:
        """Return the model as it was before any diagnosis; where one has learned terms, the base model."""
        bare = replace(self, hull={}, vessel_effects=(), conditions=())
        if not self.learned:
            return bare
        nothing = np.zeros((0, 3))
        return replace(
            bare,
            settings={**self.settings, "basis": NO_BASIS},
            terms=(),
            units=(),
            theta=nothing,
            low=nothing,
            high=nothing,
            intercept=np.zeros(3),
            intercept_low=np.zeros(3),
            intercept_high=np.zeros(3),
            covariance=np.zeros((3, 1, 1)),
        )


def blank_model(profile: Profile, name: str) -> Model:
    """Return a model without terms, which is the profile's hull."""
    nothing = np.zeros((0, 3))
    return Model(
        name=name,
        version=0,
        created="",
        ferryid_version=__version__,
        profile_text=profile.text,
        scale={"delta": 1.0, "sigma": 1.0, "zeta": 1.0},
        settings={
            "basis": NO_BASIS,
            "structure": "decoupled",
            "components": 0,
            "window_s": 1.0,
            "smoother": "square",
        },
        terms=(),
        units=(),
        theta=nothing,
        intercept=np.zeros(3),
        low=nothing,
        high=nothing,
        intercept_low=np.zeros(3),
        intercept_high=np.zeros(3),
        covariance=np.zeros((3, 1, 1)),
        ranges={},
        training=(),
        scores=None,
        accepted=False,
    )


def model_to_json(model: Model) -> dict[str, Any]:
    """Return the model as the plain object that a model file holds."""
    coefficients: dict[str, Any] = {}
    for j, axis in enumerate(AXES):
        rows = {
            term: _interval(model.theta[k, j], model.low[k, j], model.high[k, j], model.units[k][j])
            for k, term in enumerate(model.terms)
        }
        unit = "N·m" if axis == "yaw" else "N"
        rows["1"] = _interval(model.intercept[j], model.intercept_low[j], model.intercept_high[j], unit)
        coefficients[axis] = rows
    base = parse_profile(model.profile_text, model.name).hull
    return {
        "schema": SCHEMA,
        "name": model.name,
        "version": model.version,
        "created": model.created,
        "ferryid_version": model.ferryid_version,
        "accepted": model.accepted,
        "settings": dict(model.settings),
        "base": {
            "scale": dict(model.scale),
            "M": {"value": base.M.tolist(), "unit": "kg, kg·m, kg·m²"},
            "D": dict(base.D),
        },
        "terms": list(model.terms),
        "coefficients": coefficients,
        "covariance": {axis: model.covariance[j].tolist() for j, axis in enumerate(AXES)},
        "ranges": {key: list(value) for key, value in model.ranges.items()},
        "training": [dict(log) for log in model.training],
        "scores": {} if model.scores is None else model.scores.to_json(),
        **_diagnosed(model),
        "profile": model.profile_text,
    }


def _diagnosed(model: Model) -> dict[str, Any]:
    # What a fit leaves has none of these keys, and stays the same file as ever.
    return {
        **({"hull": hull_to_json(model.hull)} if model.hull else {}),
        **({"vessel_effects": [effect_to_json(one) for one in model.vessel_effects]} if model.vessel_effects else {}),
        **({"conditions": [conditions_to_json(one) for one in model.conditions]} if model.conditions else {}),
    }


def _interval(value: float, low: float, high: float, unit: str) -> dict[str, Any]:
    return {"value": float(value), "low": float(low), "high": float(high), "unit": unit}


def model_from_json(data: Mapping[str, Any], where: str) -> Model:
    """Build a model from the object of a model file.

    Raises
    ------
    FerryIdError
        When it is not a model file, is from a newer schema (says which version to install), or lacks a part.
    """
    schema = str(data.get("schema", ""))
    kind, _, number = schema.partition("/")
    if kind != "ferryid.model" or not (number.isascii() and number.isdigit()) or not 0 < len(number.lstrip("0")) < 10:
        raise FerryIdError(
            f'{where}: not a ferryid model, its schema is "{schema or "missing"}". '
            "Fix: give a model file written by ferryid fit"
        )
    if int(number) > int(SCHEMA.partition("/")[2]):
        raise FerryIdError(
            f"{where}: written by ferryid {data.get('ferryid_version', '?')} in the newer form {schema}, "
            f"this is ferryid {__version__} and reads {SCHEMA}. "
            f"Fix: pip install 'ferryid>={data.get('ferryid_version', '')}'"
        )
    try:
        _check_parts(data)
        _check_base(data, where)
        terms = tuple(str(term) for term in data["terms"])
        rows = [data["coefficients"][axis] for axis in AXES]

        def column(part: str) -> Floats:
            return np.array([[row[term][part] for row in rows] for term in terms], dtype=float).reshape(-1, 3)

        def constant(part: str) -> Floats:
            return np.array([row["1"][part] for row in rows], dtype=float)

        return Model(
            name=str(data["name"]),
            version=int(data["version"]),
            created=str(data["created"]),
            ferryid_version=str(data["ferryid_version"]),
            profile_text=str(data["profile"]),
            scale={key: float(value) for key, value in data["base"]["scale"].items()},
            settings=dict(data["settings"]),
            terms=terms,
            units=tuple((rows[0][t]["unit"], rows[1][t]["unit"], rows[2][t]["unit"]) for t in terms),
            theta=column("value"),
            intercept=constant("value"),
            low=column("low"),
            high=column("high"),
            intercept_low=constant("low"),
            intercept_high=constant("high"),
            covariance=np.array([data["covariance"][axis] for axis in AXES], dtype=float),
            ranges={key: (float(low), float(high)) for key, (low, high) in data["ranges"].items()},
            training=tuple(data["training"]),
            scores=ModelScores.from_json(data["scores"]),
            accepted=bool(data["accepted"]),
            **_physics(data, where),
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        raise FerryIdError(
            f"{where}: a part of the model file is missing or wrong ({type(error).__name__}: {error}). "
            "Fix: fit again, or restore the file from a backup"
        ) from error


def _physics(data: Mapping[str, Any], where: str) -> dict[str, Any]:
    parts: dict[str, Any] = {}
    if "hull" in data:
        parts["hull"] = hull_from_json(data["hull"])
    if "vessel_effects" in data or "conditions" in data:
        profile = parse_profile(str(data["profile"]), where)
        parts["vessel_effects"] = effects_from_json(data.get("vessel_effects", []), profile, where, vessel=True)
        parts["conditions"] = conditions_from_json(data.get("conditions", []), profile, where)
    return parts


def _check_base(data: Mapping[str, Any], where: str) -> None:
    """Refuse a file whose base model is not that of the profile in it, which alone counts: a change there had no effect."""
    hull = parse_profile(str(data["profile"]), where).hull
    stated = np.array(data["base"]["M"]["value"], dtype=float)
    parts = [] if stated.shape == (3, 3) and _agree(stated, hull.M) else ["base.M"]
    damping = data["base"]["D"]
    parts += [
        f"base.D.{name}"
        for name in sorted({*damping, *hull.D})
        if name not in hull.D or name not in damping or not _agree(float(damping[name]), hull.D[name])
    ]
    if parts:
        raise FerryIdError(
            f"{where}: {' and '.join(parts[:3])} {verb(len(parts[:3]), 'is')} not what follows from the vessel profile that "
            "the file holds as text, and which is used. Fix: restore the file from a backup, or change a profile and fit"
        )


def _agree(stated: float | Floats, used: float | Floats) -> bool:
    """Tell whether numbers are alike to rounding."""
    return bool(np.allclose(stated, used, rtol=1e-6, atol=1e-9, equal_nan=True))


def _check_parts(data: Mapping[str, Any]) -> None:
    """Raise KeyError, TypeError or ValueError where a part that others rely on is missing or of another kind."""
    settings = data["settings"]
    for key in ("basis", "structure"):
        if not isinstance(settings[key], str):
            raise TypeError(f"settings.{key} is no text")
    if not 0.0 <= float(settings["window_s"]) <= 60.0:
        raise ValueError("settings.window_s is no window")
    if not all(math.isfinite(float(value)) for value in data["base"]["scale"].values()):
        raise ValueError("base.scale is not finite")
    if not all(math.isfinite(row["value"]) for axis in AXES for row in data["coefficients"][axis].values()):
        raise ValueError("a coefficient is not finite")
    for log in data["training"]:
        if not isinstance(log["name"], str) or not isinstance(log["sha256"], str):
            raise TypeError("training does not name its logs")
        for kept in log.get("motion", {}).values():
            if not kept["rows"] > 0 or not all(isinstance(one, int) and 0 <= one < 2**52 for one in kept["hashes"]):
                raise ValueError("the marks of a training log are no hashes of its rows")
