"""Effects as a model file keeps them: by name, with parameters, intervals, and where they were found.

A property of hull or thrusters carries over to other logs. A condition belongs to the log that it was found in, by its hash.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ferryid.effects import Effect, effects
from ferryid.effects.force_model import COEFFICIENTS, LIFT, UNITS, ForceModel
from ferryid.effects.wording import timed
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class Quantity:
    """A value with its 95 % interval and unit."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Source:
    """The log that an effect was found in.

    Attributes
    ----------
    log, sha256
        Name and hash.
    onset_s, offset_s
        When it began and when it ended there [s], None where it acted from the start, and to the end.
    probability
        Of the finding.
    improvement
        Fraction of the held-out force MSE that it removed there, by axis.
    unresolved_with
        Effects that this log could not tell it from.
    """

    log: str
    sha256: str
    probability: float
    onset_s: float | None = None
    improvement: Mapping[str, float] = field(default_factory=dict)
    unresolved_with: tuple[str, ...] = ()
    offset_s: float | None = None


@dataclass(frozen=True)
class StoredEffect:
    """One effect of `ferryid.effects` with its parameters by name, in the effect's order."""

    effect: str
    instance: str | None
    parameters: Mapping[str, Quantity]
    sources: tuple[Source, ...]

    @property
    def key(self) -> tuple[str, str | None]:
        """Effect and instance."""
        return self.effect, self.instance

    @property
    def confirmed(self) -> bool:
        """Whether a log shows it by more than a hint: with a probability of more than one half."""
        return any(one.probability > 0.5 for one in self.sources)

    @property
    def values(self) -> dict[str, float]:
        """Parameters without their intervals."""
        return {name: one.value for name, one in self.parameters.items()}

    def onset_in(self, sha256: str) -> float:
        """Return when it begins in a log [s]; 0 in a log that it was not found in: what began before lasts."""
        return next((one.onset_s or 0.0 for one in self.sources if one.sha256 == sha256), 0.0)

    def offset_in(self, sha256: str) -> float:
        """Return when it ends in a log [s]; infinite in a log in which it was not seen to end."""
        ends = [one.offset_s for one in self.sources if one.sha256 == sha256 and one.offset_s is not None]
        return ends[0] if ends else math.inf

    def act(self, force_model: ForceModel, sha256: str) -> ForceModel:
        """Return the force model of a log with the effect in it."""
        p = np.array(list(self.values.values()))
        span = self.onset_in(sha256), self.offset_in(sha256)
        return effects()[self.effect].act(force_model, p, self.instance, *span)

    def says(self, sha256: str = "") -> str:
        """Return the effect as a sentence, without parameters of which no log told anything; of one log, with its times."""
        effect = effects()[self.effect]
        told = {
            name: one.value for name, one in self.parameters.items() if math.isfinite(one.low) or not effect.in_part
        }
        onset_s, offset_s = self.onset_in(sha256), self.offset_in(sha256)
        when = timed(onset_s if onset_s > 0.0 else None, offset_s if math.isfinite(offset_s) else None)
        hint = "" if self.confirmed else " It is a hint."
        return effect.says(told, self.instance) + (f" It {when}." if when else "") + hint


@dataclass(frozen=True)
class Conditions:
    """What one log was recorded in, and no other."""

    log: str
    sha256: str
    effects: tuple[StoredEffect, ...]


def hull_to_json(hull: Mapping[str, Quantity]) -> dict[str, Any]:
    """Return a refitted hull as it stands in a model file."""
    return {name: _plain(one) for name, one in hull.items()}


def effect_to_json(stored: StoredEffect) -> dict[str, Any]:
    """Return an effect as it stands in a model file."""
    return {
        "effect": stored.effect,
        "instance": stored.instance,
        "parameters": {name: _plain(one) for name, one in stored.parameters.items()},
        "found_in": [
            {
                "log": one.log,
                "sha256": one.sha256,
                "probability": one.probability,
                "onset_s": one.onset_s,
                "offset_s": one.offset_s,
                "improvement": dict(one.improvement),
                "unresolved_with": list(one.unresolved_with),
            }
            for one in stored.sources
        ],
    }


def conditions_to_json(conditions: Conditions) -> dict[str, Any]:
    """Return the conditions of a log as they stand in a model file."""
    return {
        "log": conditions.log,
        "sha256": conditions.sha256,
        "effects": [effect_to_json(one) for one in conditions.effects],
    }


def hull_from_json(data: Any) -> dict[str, Quantity]:
    """Read a refitted hull, without lift where a file has none; KeyError, TypeError or ValueError where a part is wrong."""
    if not isinstance(data, dict) or {*data, *LIFT} != set(COEFFICIENTS):
        raise ValueError("hull does not name the coefficients of a hull")
    none = {name: {"value": 0.0, "low": 0.0, "high": 0.0, "unit": UNITS[COEFFICIENTS.index(name)]} for name in LIFT}
    hull = {name: _quantity({**none, **data}[name], f"hull.{name}") for name in COEFFICIENTS}
    for name, unit in zip(COEFFICIENTS, UNITS, strict=True):
        if hull[name].unit != unit:
            raise ValueError(f"hull.{name} is in {hull[name].unit!r}, not {unit}")
    m11, m22, m23, m32, m33 = (hull[name].value for name in COEFFICIENTS[:5])
    if m11 <= 0.0 or m22 * m33 - m23 * m32 <= 0.0:
        raise ValueError("hull has no positive mass")
    return hull


def effects_from_json(data: Any, profile: Profile, where: str, *, vessel: bool) -> tuple[StoredEffect, ...]:
    """Read a list of effects; KeyError, TypeError or ValueError where a part is missing or wrong.

    Raises
    ------
    FerryIdError
        For an effect that this version does not know, with its name.
    """
    if not isinstance(data, list):
        raise TypeError("effects are no list")
    return tuple(_effect(one, profile, where, vessel) for one in data)


def conditions_from_json(data: Any, profile: Profile, where: str) -> tuple[Conditions, ...]:
    """Read the conditions of logs; see `effects_from_json`."""
    if not isinstance(data, list):
        raise TypeError("conditions are no list")
    return tuple(
        Conditions(
            _text(one["log"]), _text(one["sha256"]), effects_from_json(one["effects"], profile, where, vessel=False)
        )
        for one in data
    )


def _effect(data: Mapping[str, Any], profile: Profile, where: str, vessel: bool) -> StoredEffect:
    name, instance = _text(data["effect"]), data["instance"]
    effect = effects().get(name)
    if effect is None:
        raise FerryIdError(
            f'{where}: holds the effect "{name}", which this version of ferryid does not know.'
            f"{did_you_mean(name, effects())} Fix: install the version that wrote the file, or take the effect out of it"
        )
    if instance not in effect.instances(profile):
        raise ValueError(f"{name} has no instance {instance!r}")
    sources = tuple(_source(one) for one in data["found_in"])
    if not sources:
        raise ValueError(f"{name} was found in no log")
    # What passed within a log is a condition of that log, of whatever it is.
    if (effect.vessel and not any(one.offset_s is not None for one in sources)) != vessel:
        raise ValueError(f"{name} is {'no property of the vessel' if vessel else 'no condition of a log'}")
    return StoredEffect(name, instance, _parameters(effect, data["parameters"], profile), sources)


def _parameters(effect: Effect, data: Mapping[str, Any], profile: Profile) -> dict[str, Quantity]:
    parameters = {name: _quantity(one, f"{effect.id}.{name}") for name, one in data.items()}
    known = effect.parameters_of(profile)
    # Files of before it was fitted: it changed nothing.
    parameters |= {
        one.name: Quantity(one.neutral, one.neutral, one.neutral, one.unit)
        for one in known
        if one.name in effect.later and one.name not in parameters
    }
    expected = {one.name: one.unit for one in known}
    found = {name: one.unit for name, one in parameters.items()}
    # What was chosen in view of a log may lack what later versions fit beside it, which comes last.
    complete = len(found) == len(expected) or (
        effect.choose is not None and list(expected)[: len(found)] == list(found)
    )
    if not complete or any(expected.get(name) != unit for name, unit in found.items()):
        told = ", ".join(f"{name} [{unit}]" for name, unit in expected.items())
        raise ValueError(f"{effect.id} takes the parameters {told}")
    return {name: parameters[name] for name in expected if name in parameters}


def _source(data: Mapping[str, Any]) -> Source:
    # Files of before effects could end have no offset.
    onset_s, offset_s = (_time(data.get(name), name) for name in ("onset_s", "offset_s"))
    return Source(
        _text(data["log"]),
        _text(data["sha256"]),
        _share(data["probability"], "probability"),
        onset_s,
        {str(axis): _finite(share, f"improvement.{axis}") for axis, share in data["improvement"].items()},
        tuple(_text(one) for one in _listed(data["unresolved_with"])),
        offset_s,
    )


def _time(value: Any, what: str) -> float | None:
    return None if value is None else _finite(value, what)


def _quantity(data: Mapping[str, Any], what: str) -> Quantity:
    # An interval may be unknown, a value may not.
    low, high = (math.nan if data[end] is None else _number(data[end], what) for end in ("low", "high"))
    return Quantity(_finite(data["value"], what), low, high, _text(data["unit"]))


def _plain(one: Quantity) -> dict[str, Any]:
    return {"value": one.value, "low": one.low, "high": one.high, "unit": one.unit}


def _finite(value: Any, what: str) -> float:
    number = _number(value, what)
    if not math.isfinite(number):
        raise ValueError(f"{what} is not finite")
    return number


def _share(value: Any, what: str) -> float:
    number = _finite(value, what)
    if not 0.0 <= number <= 1.0:
        raise ValueError(f"{what} is {number:g}, not within 0 and 1")
    return number


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{what} is no number")
    return float(value)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r:.40} is no text")
    return value


def _listed(value: Any) -> Sequence[Any]:
    if not isinstance(value, list):
        raise TypeError(f"{value!r:.40} is no list")
    return value
