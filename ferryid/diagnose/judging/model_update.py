"""From diagnoses to a model: the refitted hull, the vessel's properties from all logs, and the conditions of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from math import hypot, isfinite, nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from ferryid import __version__
from ferryid.counts import counted, verb
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.judging.credibility import impossible_masses
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.learning import Learner
from ferryid.diagnose.judging.least_sizes import size_of
from ferryid.diagnose.judging.posterior import HullPosterior, Posterior
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS, UNITS
from ferryid.effects.wording import listed
from ferryid.files import alone
from ferryid.identify import Acceptance, accept
from ferryid.models import Conditions, ForceScores, Model, ModelScores, Quantity, StoredEffect, blank_model
from ferryid.models.forces import ModelForces
from ferryid.models.store import check_name, save
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile


def store_updated_model(
    diagnoses: Sequence[Diagnosis],
    profile: Profile,
    model: Model | None,
    out: Path,
    *,
    name: str = "",
    learner: Learner | None = None,
) -> tuple[Diagnosis, ...]:
    """Store the model that diagnoses lead to, and return them with its path; as they are where there is nothing to store.

    Parameters
    ----------
    diagnoses
        Of one vessel.
    profile
        The vessel.
    model
        The model that was examined; None for the profile's hull.
    out
        Output folder.
    name
        Name of the new model; that of the examined model, else the vessel's, where empty.
    learner
        Learns from the logs what the findings leave; None: nothing is learned.

    Raises
    ------
    FerryIdError
        For a name that a model cannot have, and a folder that cannot be written.
    """
    name = check_name(name or (model.name if model else profile.name))
    made, notes = update_model(diagnoses, profile, model, name)
    learned = None
    if learner is not None:
        wide = [replace(one, posterior=one.wider or one.posterior) for one in diagnoses]
        wider, more = update_model(wide, profile, model, name) if wide != list(diagnoses) else (None, ())
        diagnosed = made
        made, learned = learner.learn(made, name, wider)
        if learned.with_hints:
            diagnosed, diagnoses, notes = wider, wide, more
        if made is not None and diagnosed is not None:
            # The model of a fit has nothing of the diagnosis in it, and masses may be others with what was learned on top.
            doubts = () if learned.fit_alone else _doubts(made, diagnoses, profile)
            made = replace(made, accepted=made.accepted and not doubts)
            before = _doubts(diagnosed, diagnoses, profile)
            notes = (*(one for one in notes if one not in before), *doubts)
        notes = (*notes, learned.says)
        diagnoses = [replace(one, learned=learned) for one in diagnoses]
        if made is not None and not (learned.accepted or made.hull or made.terms or profile.hull.has_model):
            # Effects without a hull predict nothing.
            made = None
    if made is not None and made.scores is None:
        # Neither the diagnoses nor a fit could judge it.
        made = None
    path = None
    if made is not None:
        with alone(out / "models"):
            path = str(save(made, out).path)
    everywhere = learned is not None and learned.accepted
    return tuple(
        replace(
            one,
            model=path if one.posterior or everywhere else None,
            model_accepted=made is None or made.accepted,
            notes=(*one.notes, *(one.posterior.notes if one.posterior else ()), *notes),
        )
        if one.posterior or learned
        else one
        for one in diagnoses
    )


def update_model(
    diagnoses: Sequence[Diagnosis], profile: Profile, model: Model | None, name: str
) -> tuple[Model | None, tuple[str, ...]]:
    """Return the model that diagnoses lead to, None where they found nothing, and what a reader must know of it."""
    logs = [one.posterior for one in diagnoses if one.posterior is not None]
    if not logs:
        return None, ()
    vessel, notes = _properties(logs, profile, diagnoses)
    judged = [one for one in diagnoses if one.posterior is not None and one.before.get("mse")]
    # Logs that are short have no figures of their own.
    verdict, scores = _scores(judged) if judged else (None, None)
    start = blank_model(profile, name) if model is None else replace(model, name=name)
    refitted = [one.hull for one in logs if one.hull is not None]
    diagnosed_from = profile.name if model is None else model.label
    made = replace(
        start,
        version=0,
        created=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        ferryid_version=__version__,
        settings={**start.settings, "diagnosed_from": diagnosed_from},
        ranges=start.ranges or _spanned([one.ranges for one in logs]),
        training=_trained(start, logs),
        scores=scores,
        accepted=verdict is not None and verdict.accepted and bool(vessel),
        hull=_refitted(refitted, model) if len(refitted) == len(logs) else start.hull,
        vessel_effects=_composed(start.vessel_effects, vessel, profile),
        conditions=_added(start.conditions, logs),
    )
    doubts = _doubts(made, diagnoses, profile)
    return replace(made, accepted=made.accepted and not doubts), (*notes, *doubts)


def _doubts(made: Model, diagnoses: Sequence[Diagnosis], profile: Profile) -> tuple[str, ...]:
    """Return why a model that diagnoses lead to does not become the current one, as notes."""
    found = [one.posterior.doubt for one in diagnoses if one.posterior is not None and one.posterior.doubt]
    found = [f"{one[:1].upper()}{one[1:]}." for one in found]
    if made.hull:
        # A fit refuses such masses.
        found += impossible_masses(profile, ModelForces(made).altered_hull())
    return tuple(f"The model does not become the current one. {one}" for one in dict.fromkeys(found))


def _refitted(logs: Sequence[HullPosterior], model: Model | None) -> dict[str, Quantity]:
    """Return the hull that all logs speak for, beside the effects that the examined model has."""
    hull, covariance = _hull(logs)
    if model is not None and model.vessel_effects:
        # The force model that was refitted had these effects in it, which multiply coefficients and come on top again.
        known = ModelForces(model)
        factor = np.divide(known.altered_hull(), known.hull, out=np.ones_like(hull), where=known.hull != 0.0)
        hull, covariance = hull / factor, covariance / np.outer(factor, factor)
    return _quantities(hull, covariance)


def _hull(logs: Sequence[HullPosterior]) -> tuple[Floats, Floats]:
    """Return the hull that all logs together speak for, and its covariance; what was believed before counts once.

    The posterior of each log is a Gaussian; what the log adds to what was believed before is the difference of their
    precisions, and those of several logs add up.
    """
    free = logs[0].spread > 0.0
    hull, covariance = logs[0].mean.copy(), logs[0].covariance.copy()
    if all(one is logs[0] for one in logs):
        # One log, or one estimate from all of them.
        return hull, covariance
    place = np.ix_(free, free)
    prior = np.diag(logs[0].spread[free] ** -2.0)
    precision, weighed = prior.copy(), prior @ logs[0].before[free]
    for one in logs:
        own = np.diag(one.spread[free] ** -2.0)
        after = np.linalg.inv(one.covariance[place])
        precision += after - own
        weighed += after @ one.mean[free] - own @ one.before[free]
    covariance[place] = np.linalg.inv(precision)
    hull[free] = covariance[place] @ weighed
    return hull, covariance


def _quantities(hull: Floats, covariance: Floats) -> dict[str, Quantity]:
    ends = 1.96 * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return {
        name: Quantity(value, value - end, value + end, unit)
        for name, value, end, unit in zip(COEFFICIENTS, hull.tolist(), ends.tolist(), UNITS, strict=True)
    }


def _properties(
    logs: Sequence[Posterior], profile: Profile, diagnoses: Sequence[Diagnosis]
) -> tuple[tuple[StoredEffect, ...], tuple[str, ...]]:
    """Return the vessel's properties that the logs agree on, and what is to be told of them."""
    by_key: dict[tuple[str, str | None], list[StoredEffect]] = {}
    for log in logs:
        for one in log.vessel:
            by_key.setdefault(one.key, []).append(one)
    kept, notes = [], []
    for found in by_key.values():
        first = found[0]
        title = effects()[first.effect].title + (f" ({first.instance})" if first.instance else "")
        apart = _contradictions(found, profile)
        if apart:
            notes.append(
                f"{title} does not enter the model: the logs contradict each other about {', '.join(apart)}. "
                "Something changed between them; diagnose each by itself."
            )
            continue
        if absent := _absent(found, diagnoses, profile):
            notes.append(
                f"{title} does not enter the model: {listed([one.sources[0].log for one in found])} "
                f"{verb(len(found), 'shows')} it, and {listed(absent)} {verb(len(absent), 'does')} not, "
                "where half of it would have been seen. Something changed between them; diagnose each by itself."
            )
            continue
        if len(found) < len(logs):
            where = ", ".join(one.sources[0].log for one in found)
            notes.append(
                f"{title} was found in {len(found)} of {counted(len(logs), 'log')} ({where}) and holds for the vessel."
            )
        kept.append(_together(found))
    return tuple(kept), tuple(notes)


def _absent(found: Sequence[StoredEffect], diagnoses: Sequence[Diagnosis], profile: Profile) -> list[str]:
    """Return the logs that do not show a property that acts all along in others, and would have shown half of it."""
    sources = [source for one in found for source in one.sources]
    if any(one.onset_s is not None for one in sources):
        # What set in within one log may last in the next, and was not in the one before.
        return []
    effect, instance = found[0].key
    candidate = Candidate.of(effects()[effect], instance, profile)
    size = min(size_of(candidate, np.array(list(one.values.values()))) for one in found)
    showing = {source.sha256 for source in sources}
    without = [one for one in diagnoses if one.posterior is None or one.posterior.training["sha256"] not in showing]
    return [
        one.log
        for one in without
        for least in one.least_sizes
        if (least.effect, least.instance) == (effect, instance)
        and least.value is not None
        and size >= JUDGING.absent_multiple * least.value
    ]


def _contradictions(found: Sequence[StoredEffect], profile: Profile) -> list[str]:
    """Return the parameters whose intervals lie apart between two logs, with their values."""
    sentences = []
    for parameter in effects()[found[0].effect].parameters_of(profile):
        several = [stored.parameters[parameter.name] for stored in found]
        values = [each.value for each in several]
        gap = max(each.low for each in several) - min(each.high for each in several)
        if gap > 0.0 and max(values) - min(values) > JUDGING.contradiction_share * parameter.size:
            sentences.append(
                f"{parameter.name} ({' against '.join(f'{value:.3g}' for value in values)} {parameter.unit})"
            )
    return sentences


def _together(found: Sequence[StoredEffect]) -> StoredEffect:
    """Return one effect from several logs, each weighed by its inverse variance.

    Where the logs differ by more than their intervals say, the interval of the mean is widened by as much; Birge (1932). What
    has no interval in some log has none then, and logs count alike for it.
    """
    sources = tuple(source for stored in found for source in stored.sources)
    if all(_plain(one) == _plain(found[0]) for one in found):
        # One log, or one estimate from all of them.
        return replace(found[0], sources=sources)
    parameters = {}
    for name, one in found[0].parameters.items():
        several = [stored.parameters[name] for stored in found]
        values = np.array([each.value for each in several])
        if not all(isfinite(each.high - each.low) for each in several):
            parameters[name] = Quantity(float(values.mean()), nan, nan, one.unit)
            continue
        variance = np.maximum(np.array([(each.high - each.low) / 3.92 for each in several]), 1e-12) ** 2
        weight = 1.0 / variance
        mean = float(np.sum(weight * values) / np.sum(weight))
        excess = float(np.sum(weight * (values - mean) ** 2)) / (len(found) - 1)
        end = 1.96 * sqrt(max(1.0, excess) / float(np.sum(weight)))
        parameters[name] = Quantity(mean, mean - end, mean + end, one.unit)
    return replace(found[0], parameters=parameters, sources=sources)


def _plain(stored: StoredEffect) -> dict[str, tuple[float | None, ...]]:
    """Return parameters with their ends; None for an end that is not known, which is as another that is not."""
    return {
        name: (one.value, *(end if isfinite(end) else None for end in (one.low, one.high)))
        for name, one in stored.parameters.items()
    }


def _composed(
    before: Sequence[StoredEffect], found: Sequence[StoredEffect], profile: Profile
) -> tuple[StoredEffect, ...]:
    """Return effects with those found on top of them: factors multiply, all else adds up."""
    late = {one.key: one for one in found}
    result = []
    for one in before:
        more = late.pop(one.key, None)
        result.append(one if more is None else _on_top(one, more, profile))
    return (*result, *late.values())


def _on_top(one: StoredEffect, more: StoredEffect, profile: Profile) -> StoredEffect:
    neutral = {parameter.name: parameter.neutral for parameter in effects()[one.effect].parameters_of(profile)}
    parameters = {}
    for name, a in one.parameters.items():
        b = more.parameters[name]
        x, y = 0.5 * (a.high - a.low), 0.5 * (b.high - b.low)
        if neutral[name] == 1.0:
            value, end = a.value * b.value, hypot(a.value * y, b.value * x)
        else:
            value, end = a.value + b.value, hypot(x, y)
        parameters[name] = Quantity(value, value - end, value + end, a.unit)
    return replace(one, parameters=parameters, sources=(*one.sources, *more.sources))


def _added(before: Sequence[Conditions], logs: Sequence[Posterior]) -> tuple[Conditions, ...]:
    """Return the conditions of all logs; what was found in a log that had conditions already comes after these."""
    known = {one.sha256: one for one in before}
    for log in logs:
        if log.conditions:
            sha256 = str(log.training["sha256"])
            old = known.get(sha256, Conditions(str(log.training["name"]), sha256, ()))
            known[sha256] = replace(old, effects=(*old.effects, *log.conditions))
    return tuple(known.values())


def _trained(start: Model, logs: Sequence[Posterior]) -> tuple[Mapping[str, Any], ...]:
    known = {str(log["sha256"]): log for log in start.training}
    for one in logs:
        known.setdefault(str(one.training["sha256"]), one.training)
    return tuple(known.values())


def _spanned(several: Sequence[Mapping[str, tuple[float, float]]]) -> dict[str, tuple[float, float]]:
    return {name: (min(one[name][0] for one in several), max(one[name][1] for one in several)) for name in several[0]}


def _scores(diagnoses: Sequence[Diagnosis]) -> tuple[Acceptance, ModelScores]:
    """Return held-out force errors without and with the findings, pooled over logs, as a model file has its scores."""
    weights = np.array([float(one.before.get("rows", 0)) for one in diagnoses])
    weights = weights / weights.sum() if weights.sum() > 0.0 else np.full(len(diagnoses), 1.0 / len(diagnoses))
    before, after = (
        weights @ np.array([[float(getattr(one, part)["mse"][axis]) for axis in AXES] for one in diagnoses])
        for part in ("before", "after")
    )
    verdict = accept(before, after)
    unknown = np.full(len(AXES), nan)
    ratio = np.array([verdict.per_axis[axis] for axis in AXES])
    scores = ModelScores(
        ForceScores(before, after, unknown, unknown, ratio, verdict.normalised_mse),
        rows=sum(int(one.before.get("rows", 0)) for one in diagnoses),
        seconds=sum(float(str(one.posterior.training["seconds"])) for one in diagnoses if one.posterior),
        split="blocks",
        split_notes=("Of windows of the weak form, held out in contiguous blocks; with the conditions of each log.",),
    )
    return verdict, scores
