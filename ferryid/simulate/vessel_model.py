"""A model as the vessel that is simulated: its hull and its effects in the place of the scenario's."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

from ferryid.effects import effects
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.models import Conditions, Model, StoredEffect
from ferryid.models.forces import UnmappedTerms, beside_the_hull, hull_coefficients, replace_hull_coefficients
from ferryid.signals.recording import log_name
from ferryid.simulate.check_scenario import vessel_of
from ferryid.simulate.plant.beside import FACTORS
from ferryid.simulate.scenario import Scenario, scenario_of
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Actuator, Profile

VESSEL_KEYS = (
    ("true_hull",),
    ("fouling",),
    ("thrusters", "faults"),
    ("thrusters", "force_lag_s"),
    ("thrusters", "inflow_loss_per_mps"),
    ("thrusters", "interaction_fraction"),
)
"""What a scenario says of the vessel itself, which a model takes the place of."""


@dataclass(frozen=True)
class Sailing:
    """A scenario as a model sails it: what was changed in it, the vessel, and what of the scenario was set aside.

    `terms` is what the model has beside the hull of the vessel. `conditions` is the name, in the model, of the log whose
    conditions prevail, however it was given; empty without one.
    """

    scenario: Scenario
    vessel: Profile
    notes: tuple[str, ...]
    terms: UnmappedTerms
    conditions: str = ""


def sailed_by(scenario: Scenario, model: Model, conditions: str = "") -> Sailing:
    """Return a scenario with a model as its vessel.

    Properties of the vessel act from the start: what began during a log lasts. The controller goes on to believe
    in what the scenario says.

    Parameters
    ----------
    scenario
        From `load_scenario`.
    model
        The vessel.
    conditions
        Name, file or path of a log that the model was diagnosed on, whose conditions are to prevail; none where empty.

    Raises
    ------
    FerryIdError
        For a model of another vessel, one with terms that neither a hull nor the simulator has, a log that the model knows no
        conditions of, and conditions that a scenario cannot have.
    """
    expected = vessel_of(scenario)
    own = parse_profile(model.profile_text, model.name)
    if own.name != expected.name:
        raise FerryIdError(
            f"{scenario.where}: a trial of {expected.name} cannot be sailed by {model.label}, a model of {own.name}. "
            "Fix: give a model and a scenario of one vessel"
        )
    terms = beside_the_hull(model)
    left = [one.name for one in terms.functions if not set(one.factors) <= set(FACTORS)]
    if left:
        raise FerryIdError(
            f"{model.label}: the simulated vessel cannot have the model's terms {', '.join(left)}: neither a hull nor the "
            "simulator has them. Fix: fit with --structure decoupled and a basis of velocities such as modulus, or give this "
            'model to the controller ([controller] model = "FILE")'
        )
    chosen = _conditions(model, conditions) if conditions else None
    if chosen is not None:
        # A diagnosis estimates winds and loads in units of the force as it was measured.
        terms = replace(terms, zeta=1.0)
    data = tomllib.loads(scenario.text)
    aside = [place for place in VESSEL_KEYS if _taken(data, place)]
    data, dropped = _without_vessel_effects(data)
    aside += [("effects",)] if dropped else []
    sha256 = "" if chosen is None else chosen.sha256
    stored = (*model.vessel_effects, *(() if chosen is None else chosen.effects))
    for one in stored:
        data = _merged(data, _tables(one, sha256))
    try:
        changed = scenario_of(data, scenario.text, scenario.where, scenario.folder)
    except FerryIdError as error:
        raise FerryIdError(f"with {', '.join(_names(stored))} of {model.label}, {error}") from error
    return Sailing(
        changed,
        replace(
            own,
            hull=replace_hull_coefficients(own.hull, hull_coefficients(model)),
            actuators=_limited(own.actuators, expected.actuators),
        ),
        tuple(f"the scenario's [{'.'.join(place)}] is set aside: the vessel is {model.label}" for place in aside),
        terms,
        "" if chosen is None else chosen.log,
    )


def _limited(actuators: Sequence[Actuator], expected: Sequence[Actuator]) -> tuple[Actuator, ...]:
    """Return the actuators of a model, those whose thrust curve has no end with the ends that the scenario's vessel has.

    A recording needs none, while a simulated propeller does. A curve is the same one if it differs in nothing else.
    """
    ends = {one.name: one.thrust for one in expected}

    def limited(one: Actuator) -> Actuator:
        curve, other = one.thrust, ends.get(one.name)
        if curve is None or other is None or all(isfinite(end) for end in curve.valid):
            return one
        low, high = (own if isfinite(own) else given for own, given in zip(curve.valid, other.valid, strict=True))
        ended = replace(curve, valid=(low, high))
        return replace(one, thrust=ended) if ended == replace(other, valid=(low, high)) else one

    return tuple(limited(one) for one in actuators)


def _conditions(model: Model, log: str) -> Conditions:
    known = {one.log: one for one in model.conditions}
    # A model lists logs by name; a path stands for the log of its name.
    log = log if log in known or log_name(log) not in known else log_name(log)
    if log not in known:
        found = f"those of {', '.join(known)}" if known else "none"
        raise FerryIdError(
            f'{model.label}: the conditions of "{log}" are not in the model, found {found}.{did_you_mean(log, known)} '
            "Fix: name one of the logs that ferryid models lists conditions of"
        )
    several = [one.key for one in known[log].effects]
    # Two thrusters may both have failed for a while; a scenario has one fault of each.
    twice = [key[0] for key in several if several.count(key) > 1]
    if twice:
        raise FerryIdError(
            f"{model.label}: a scenario has one {effects()[twice[0]].title.lower()}, found two of it for {log}, found one "
            "after the other. Fix: diagnose the log again from the profile"
        )
    return known[log]


def _tables(stored: StoredEffect, sha256: str) -> dict[str, Any]:
    values = stored.values
    if effects()[stored.effect].onset:
        values["onset"] = stored.onset_in(sha256)
        if isfinite(offset := stored.offset_in(sha256)):
            values["offset"] = offset
    return effects()[stored.effect].scenario(values, stored.instance)


def _taken(data: dict[str, Any], place: Sequence[str]) -> bool:
    """Remove a key from nested tables; tell whether it was there."""
    for name in place[:-1]:
        data = data.get(name, {})
    return data.pop(place[-1], None) is not None


def _without_vessel_effects(data: dict[str, Any]) -> tuple[dict[str, Any], bool]:
    """Return tables without entries of ``[[effects]]`` that are properties of the vessel; tell whether there were any."""
    given = data.get("effects", [])
    kept = [one for one in given if not effects()[one["effect"]].vessel]
    return {**data, "effects": kept}, len(kept) < len(given)


def _merged(data: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """Return tables with more in them: arrays of tables grow, everything else gives way."""
    result = dict(data)
    for key, value in more.items():
        old = result.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            result[key] = _merged(old, value)
        elif isinstance(old, list) and isinstance(value, list) and all(isinstance(one, dict) for one in (*old, *value)):
            result[key] = [*old, *value]
        else:
            result[key] = value
    return result


def _names(stored: Sequence[StoredEffect]) -> list[str]:
    return [effects()[one.effect].title.lower() for one in stored]
