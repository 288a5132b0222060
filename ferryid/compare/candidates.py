"""Which models can be compared at all, and by which profile the logs are read."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from ferryid.effects.wording import listed
from ferryid.errors import FerryIdError
from ferryid.models import Model, blank_model, model_to_json
from ferryid.signals.copies import has_marks
from ferryid.signals.stream import Recording
from ferryid.signals.time_ranges import shares_data
from ferryid.vessel import parse_profile
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile

BASE = "base model"
"""What the hull in the profile, without any correction, is called among models."""


@dataclass(frozen=True)
class Candidate:
    """One model under a name that no other in the comparison has."""

    label: str
    model: Model

    @property
    def is_base(self) -> bool:
        """True for the hull in the profile alone."""
        return self.label == BASE


@dataclass(frozen=True)
class CandidateSet:
    """The models of a comparison, the base model first where there is one, and the profile that the logs are read by."""

    candidates: tuple[Candidate, ...]
    profile: Profile
    warnings: tuple[str, ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the models, in order."""
        return tuple(one.label for one in self.candidates)


def trained_on(model: Model, recording: Recording) -> bool:
    """Tell whether a model, or its diagnosis, has learnt from a log, from a copy of it in another form, or from a part."""
    seen = {str(log["sha256"]) for log in model.training} | {known.sha256 for known in model.conditions}
    if any(shares_data(one, recording.sha256) for one in seen):
        return True
    return has_marks(recording, [log["motion"] for log in model.training if "motion" in log])


def select_candidates(
    references: Sequence[str], models: Sequence[Model], vessel: Profile | None = None
) -> CandidateSet:
    """Return the models that are compared, or say why the comparison means nothing.

    Parameters
    ----------
    references
        How each model was asked for: tells models of one name and version apart.
    models
        The models.
    vessel
        Profile to read the logs and to measure the force by; the one that all models share where None.

    Raises
    ------
    FerryIdError
        For fewer than two models, models of different vessels, one model twice, and models whose profiles would measure another
        force or read a log otherwise, where no profile was given.
    """
    if len(models) < 2:
        raise FerryIdError(
            f"compare: two or more models are needed, found {len(models)}. "
            "Fix: name another before --on, or judge one against its base model with ferryid evaluate"
        )
    labels = _labels(references, models)
    profiles = [parse_profile(model.profile_text, label) for label, model in zip(labels, models, strict=True)]
    for (a, one), (b, other) in combinations(zip(labels, profiles, strict=True), 2):
        if one.name != other.name:
            raise FerryIdError(
                f"{a} and {b}: models of different vessels ({one.name}, {other.name}) cannot be compared. "
                "Fix: give models of one vessel"
            )
    if vessel is not None and vessel.name != profiles[0].name:
        raise FerryIdError(
            f"--vessel: models of {profiles[0].name} say nothing about {vessel.name}. "
            "Fix: give a profile of the vessel that the models are of"
        )
    for (a, one_model), (b, other_model) in combinations(zip(references, models, strict=True), 2):
        if _content(one_model) == _content(other_model):
            raise FerryIdError(
                f"{a} and {b}: the same model, and a comparison with itself means nothing. Fix: give two different models"
            )
    warnings = []
    if vessel is None:
        _check_shared(labels, profiles)
    else:
        for label, own in zip(labels, profiles, strict=True):
            if own.actuators != vessel.actuators:
                warnings.append(
                    f"{label} was fitted with another thrust ({_differing(own, vessel)}) than the profile given has: "
                    "where that measures another force, it counts as the model's error"
                )
    profile = vessel or profiles[0]
    lengths = sorted({window_seconds(one) for one in profiles})
    if vessel is None and len(lengths) > 1:
        # Whichever model is named first, they are judged alike.
        profile = replace(profile, window_s=lengths[-1])
        warnings.append(
            f"the profiles in the models average forces over {listed([f'{one:.3g}' for one in lengths])} s: the models are "
            f"judged in windows of {lengths[-1]:.3g} s; give --vessel for others"
        )
    candidates = [Candidate(label, model) for label, model in zip(labels, models, strict=True)]
    if vessel is None and any(_hull(own) != _hull(profile) for own in profiles):
        warnings.append("the models have different base models, so that none is listed; give --vessel for one")
    else:
        candidates.insert(0, Candidate(BASE, blank_model(profile, BASE)))
    return CandidateSet(tuple(candidates), profile, tuple(warnings))


def _labels(references: Sequence[str], models: Sequence[Model]) -> list[str]:
    plain = [model.label for model in models]
    return [
        label if plain.count(label) == 1 else f"{label} ({reference})"
        for label, reference in zip(plain, references, strict=True)
    ]


def _content(model: Model) -> str:
    """Return what a model holds beside its name, as text: of two that lack the same value, NaN, each says so alike."""
    return json.dumps(model_to_json(replace(model, name="", version=0, created="")), sort_keys=True)


def _check_shared(labels: Sequence[str], profiles: Sequence[Profile]) -> None:
    first = profiles[0]
    for label, other in zip(labels[1:], profiles[1:], strict=True):
        if first.actuators != other.actuators:
            raise FerryIdError(
                f"{labels[0]} and {label}: the profiles in them give another thrust ({_differing(first, other)}), so that the "
                "measured force of one is not that of the other. Fix: choose the profile that measures it with --vessel"
            )
        differing = _signals(first).symmetric_difference(_signals(other))
        if differing or first.table != other.table:
            named = listed(sorted({quantity for quantity, _ in differing})) or "layout of tables"
            raise FerryIdError(
                f"{labels[0]} and {label}: the profiles in them read a log differently ({named}). "
                "Fix: choose the profile to read it by with --vessel"
            )


def _signals(profile: Profile) -> set[tuple[str, str]]:
    return {(signal.quantity, repr(replace(signal, line=0))) for signal in profile.signals}


def _differing(one: Profile, other: Profile) -> str:
    """Return the names of the actuators that are not the same in two profiles."""
    mine, theirs = ({actuator.name: actuator for actuator in profile.actuators} for profile in (one, other))
    return listed([name for name in dict.fromkeys((*mine, *theirs)) if mine.get(name) != theirs.get(name)])


def _hull(profile: Profile) -> str:
    return repr((profile.hull, profile.wind))
