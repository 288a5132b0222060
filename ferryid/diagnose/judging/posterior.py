"""What one log teaches about a vessel: its hull as it was refitted, and the effects that were believed, with their spread."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from math import isfinite, nan

import numpy as np

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.data.measurements import Survey
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, effect_slopes, fit
from ferryid.diagnose.inference.stochastic_disturbance import DisturbanceState
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.claims import Key
from ferryid.diagnose.judging.credibility import IN_THE_HULL, refitted_hull
from ferryid.diagnose.judging.finding import Finding
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS
from ferryid.models import Quantity, Source, StoredEffect
from ferryid.signals.copies import motion_marks
from ferryid.types import Floats


@dataclass(frozen=True)
class HullPosterior:
    """What is believed of the hull's coefficients.

    Attributes
    ----------
    before, spread
        Mean and standard deviations before the log, shape (26,) each.
    mean, covariance
        After it, shapes (26,) and (26, 26).
    """

    before: Floats
    spread: Floats
    mean: Floats
    covariance: Floats


@dataclass(frozen=True)
class Posterior:
    """What one log teaches.

    Attributes
    ----------
    training
        The log, as a model file lists what it was trained on.
    ranges
        Ranges of validity.
    vessel, conditions
        Properties of the vessel and conditions of the log, in the order in which they act.
    hull
        The hull as the log refitted it; None where it is for a fit to all logs to estimate, or cannot be the vessel's.
    doubt
        Why no model that has this may become the current one, as the end of a sentence; empty where it may.
    notes
        What did not enter and why, as sentences.
    """

    training: Mapping[str, object]
    ranges: Mapping[str, tuple[float, float]]
    vessel: tuple[StoredEffect, ...]
    conditions: tuple[StoredEffect, ...]
    hull: HullPosterior | None = None
    doubt: str = ""
    notes: tuple[str, ...] = ()


def posterior_of(
    problem: EstimationProblem,
    kept: Fit,
    states: Sequence[DisturbanceState],
    findings: Sequence[Finding],
    survey: Survey,
    *,
    known: bool = True,
    predictive: Collection[Key] = (),
) -> Posterior | None:
    """Return what a log teaches; None where no force was left out that is more likely than not.

    Parameters
    ----------
    problem, kept
        The log and what was found, hull included.
    states
        Disturbances that came and went by chance: conditions of the log, where a steady one was found as well.
    findings
        The same as it is told; those that are doubtful there do not count, and the hull is refitted without them.
    survey
        Of the log.
    known
        Whether the hull comes from a profile or a model.
    predictive
        Effects that enter though they are doubtful.
    """
    reported = {(one.effect, one.instance): one for one in findings}
    enters = {key for key, one in reported.items() if one.sure or key in predictive}
    accepted = [i for i, one in enumerate(kept.candidates) if one.key in enters]
    if not accepted:
        return None
    notes = [
        f"{one.effect.title} is too doubtful to enter a model."
        for i, one in enumerate(kept.candidates)
        if i not in accepted and one.key in reported
    ]
    if len(accepted) < len(kept.candidates):
        kept = fit(problem, [kept.candidates[i] for i in accepted], [kept.values[i] for i in accepted])
    log, recording = survey.used.log, survey.recording
    # Without what was doubtful, the hull may bend as far as it did with it.
    doubt = refitted_hull(problem, kept).doubt if known else ""
    stored = []
    for i, candidate in enumerate(kept.candidates):
        if candidate.effect.id != IN_THE_HULL:
            finding = reported[candidate.key]
            source = Source(
                log,
                recording.sha256,
                finding.probability,
                # Those that are told, which are the middles of their intervals.
                finding.onset_s or candidate.onset_s or None,
                dict(finding.improvement),
                finding.unresolved_with,
                finding.offset_s or (candidate.offset_s if isfinite(candidate.offset_s) else None),
            )
            # A fault that passed within the log is no property that others have.
            lasts = candidate.effect.vessel and source.offset_s is None
            if candidate.is_step:
                level = _level(kept, i, source) if lasts else _level_otherwise(kept, i, source)
                stored.append((True, level))
                if lasts:
                    continue
            unreported = candidate.effect.unreported(problem.plain.measurements, kept.values[i])
            errors = [
                nan if one.name in unreported else error
                for one, error in zip(candidate.parameters, kept.reported_errors(i).tolist(), strict=True)
            ]
            stored.append((lasts, stored_effect(candidate, kept.values[i], errors, finding.parameters, source)))
    for state in states:
        candidate = state.candidate
        if candidate.key in reported and reported[candidate.key].sure:
            finding = reported[candidate.key]
            source = Source(log, recording.sha256, finding.probability, finding.onset_s, offset_s=finding.offset_s)
            found = {
                name: Quantity(one.value, one.low, one.high, one.unit)
                if name in state.known
                else Quantity(one.value, nan, nan, one.unit)
                for name, one in state.estimates.items()
            }
            stored.append((False, StoredEffect(*candidate.key, found, (source,))))
    return Posterior(
        training=trained(survey),
        ranges=survey.used.ranges,
        vessel=tuple(one for vessel, one in stored if vessel),
        conditions=tuple(one for vessel, one in stored if not vessel),
        hull=None if doubt else _hull(problem, kept),
        doubt=doubt,
        notes=tuple(notes),
    )


def trained(survey: Survey) -> dict[str, object]:
    """Return a log as a model file lists what it was trained on."""
    used, recording = survey.used, survey.recording
    return {
        "name": used.log,
        "files": [str(file).rpartition("/")[2] for file in recording.files],
        "sha256": recording.sha256,
        "seconds": used.seconds,
        "rows": used.rows,
        "motion": motion_marks(recording),
    }


def stored_effect(
    candidate: Candidate, values: Floats, errors: Sequence[float], reported: Mapping[str, Estimate], source: Source
) -> StoredEffect:
    """Return an effect with its intervals: those that were told, or of these errors, unknown (NaN) where they are."""
    parameters = {}
    own = zip(candidate.parameters, values.tolist(), errors, strict=True)
    # The level from which a step goes is no part of it.
    for one, value, error in islice(own, 1 if candidate.is_step else None):
        # With the limit second, what is unknown stays so.
        low, high = max(value - 1.96 * error, one.low), min(value + 1.96 * error, one.high)
        if one.name in reported:
            low, high = min(reported[one.name].low, value), max(reported[one.name].high, value)
        parameters[one.name] = Quantity(value, low, high, one.unit)
    return StoredEffect(candidate.effect.id, candidate.instance, parameters, (source,))


def _level(kept: Fit, index: int, source: Source) -> StoredEffect:
    """Return the level to which a step of a fit leads, as a property that the vessel has from then on."""
    factor, otherwise = kept.values[index].tolist()
    slopes = INFERENCE.posterior_factor * np.array([otherwise, factor])
    error = float(np.sqrt(slopes @ kept.covariance(index) @ slopes))
    return _of_level(kept.candidates[index], factor * otherwise, error, source)


def _level_otherwise(kept: Fit, index: int, source: Source) -> StoredEffect:
    """Return the level to which a step of a fit returns, as a property that the vessel has all along."""
    level, error = kept.values[index][1], kept.reported_errors(index)[1]
    return _of_level(kept.candidates[index], float(level), float(error), replace(source, onset_s=None, offset_s=None))


def _of_level(step: Candidate, level: float, error: float, source: Source) -> StoredEffect:
    factor = replace(step, effect=effects()[step.effect.id], parameters=step.parameters[:1])
    return stored_effect(factor, np.array([level]), [error], {}, source)


def _hull(problem: EstimationProblem, kept: Fit) -> HullPosterior:
    """Return what is believed of the hull before and after a fit.

    The covariance is that of the linearised posterior, effects included. Factors on single coefficients, where the hull model
    was found wrong, are multiplied in.
    """
    h = len(COEFFICIENTS)
    parameters = [one for candidate in kept.candidates for one in candidate.parameters]
    sizes = np.array([one.size for one in parameters])
    J = np.column_stack([problem.by_hull, effect_slopes(problem, kept)])
    posterior = np.linalg.inv(J.T @ J + np.eye(J.shape[1]))
    units = np.append(problem.hull_spread, sizes)
    posterior = posterior * np.outer(units, units)
    into = np.zeros((h, h + len(parameters)))
    into[:, :h] = np.eye(h)
    hull, spread = kept.hull.copy(), problem.hull_spread.copy()
    column = h
    for candidate, values in zip(kept.candidates, kept.values, strict=True):
        for one, factor in zip(candidate.parameters, values.tolist(), strict=True):
            if candidate.effect.id == IN_THE_HULL:
                k = COEFFICIENTS.index(one.name)
                into[k, k], into[k, column] = factor, hull[k]
                spread[k] = float(np.hypot(spread[k], one.size * problem.plain.hull[k]))
                hull[k] *= factor
            column += 1
    return HullPosterior(problem.plain.hull, spread, hull, into @ posterior @ into.T)
