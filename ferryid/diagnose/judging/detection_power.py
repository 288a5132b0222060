"""What a log could have shown: the chance of finding each effect at its usual size, the axes that moved, what to record next.

An effect of usual size adds a known change to the prediction errors. The hull and all that was found may imitate it as far as
their own uncertainty goes; what then is left of it, in units of the noise, is what the evidence for it would be made of.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import erf, inf, sqrt

import numpy as np

from ferryid.diagnose.inference.estimation import (
    PARAMETER_DIFFERENCE,
    Candidate,
    EstimationProblem,
    Fit,
    effect_slopes,
    fitted_force_model,
)
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.experiment_design import excited_by, shown_by
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS
from ferryid.effects.wording import listed, titled
from ferryid.types import Floats
from ferryid.vessel.circumstances import ANYWHERE, Circumstances

AXES = {
    axis: tuple(k for k, name in enumerate(COEFFICIENTS) if name.startswith(begins))
    for axis, begins in (("surge", ("m1", "X_")), ("sway", ("m2", "Y_")), ("yaw", ("m3", "N_")))
}
"""Places of each axis's coefficients in the hull's."""
HULL = "hull_parameters"
"""What a log tells of the hull's coefficients is told by axis."""


@dataclass(frozen=True)
class DetectionPower:
    """How well a candidate would have been found in a log.

    Attributes
    ----------
    candidate
        The effect.
    chance
        That it would have been found at its usual size, 0 to 1.
    usual
        Parameters of usual size, of the signs that show less.
    multiple
        Of that size at which the chance is even; infinite where none is large enough.
    """

    candidate: Candidate
    chance: float
    usual: Floats = field(default_factory=lambda: np.empty(0))
    multiple: float = inf


def detection_powers(problem: EstimationProblem, kept: Fit, library: Sequence[Candidate]) -> tuple[DetectionPower, ...]:
    """Return the chance of finding each candidate, beside what was found.

    With d the change of the whitened prediction errors that the effect makes at its usual size, N what hull and findings do,
    each within its prior, and S the information on the effect's parameters beside a prediction error of covariance ``C = I +
    NN'``, the logarithm of the marginal evidence is normal about ``½ d'C⁻¹d - ½ z'z - ½ log det(I + S)`` with a variance of
    ``d'C⁻¹d``; z are the parameters in their sizes. It has to exceed `INFERENCE.prior_odds`, and by as
    much more as the effect is rare where the log was recorded. Of effects that may go either way the less visible one counts.

    Parameters
    ----------
    problem, kept
        The log, and what was found in it.
    library
        The candidates; those that were found are left out.
    """
    force_model = fitted_force_model(problem.plain, kept)
    before = problem.white(force_model)
    nuisance = np.column_stack([problem.by_hull, effect_slopes(problem, kept)])
    inner = nuisance.T @ nuisance + np.eye(nuisance.shape[1])

    def apart(columns: Floats) -> Floats:
        # (I + NN')⁻¹ of the columns: hull and findings are not known, so that what they can imitate is worth less.
        return np.asarray(columns - nuisance @ np.linalg.solve(inner, nuisance.T @ columns))

    taken = {one.key for one in kept.candidates}
    made = []
    for candidate in library:
        # How visible what passes is depends on when it does, which is not known of one that was not found.
        if candidate.key in taken or candidate.effect.id == HULL or candidate.effect.passing:
            continue
        size = np.array([one.size for one in candidate.parameters])
        worst: DetectionPower | None = None
        for usual in _usual(candidate):
            there = problem.white(candidate.act(force_model, usual))
            change = there - before
            if not change.any():
                # Of what comes and goes by chance a force model holds no force: it is found in the noise, and not here.
                break
            columns = [
                (problem.white(candidate.act(force_model, usual + PARAMETER_DIFFERENCE * step)) - there)
                / PARAMETER_DIFFERENCE
                for step in np.diag(size)
            ]
            information = np.column_stack(columns).T @ apart(np.column_stack(columns))
            strength = float(change @ apart(change))
            occam = float(np.linalg.slogdet(np.eye(len(size)) + information)[1])
            evidence = 0.5 * (strength - len(size) - occam)
            above = evidence - INFERENCE.prior_odds - candidate.log_alternatives
            chance = 0.5 * (1.0 + erf(above / sqrt(2.0 * max(strength, 1.0))))
            # What speaks for it grows with the square of the size, and the rest stays.
            needed, gained = (
                0.5 * occam + INFERENCE.prior_odds + candidate.log_alternatives,
                0.5 * (strength - len(size)),
            )
            multiple = sqrt(max(needed, 0.0) / gained) if gained > 0.0 else inf
            if worst is None or chance < worst.chance:
                worst = DetectionPower(candidate, chance, usual, multiple)
        else:
            assert worst is not None
            made.append(worst)
    return tuple(made)


def _usual(candidate: Candidate) -> list[Floats]:
    """Return parameters of usual size: all larger than neutral, and every other one of those that may be smaller, smaller.

    What can only be smaller than neutral, such as a share that is left, is smaller in both; what can only be larger, larger.
    """
    neutral = np.array([one.neutral for one in candidate.parameters])
    size = np.array([one.size for one in candidate.parameters])
    low, high = (np.array([getattr(one, end) for one in candidate.parameters]) for end in ("low", "high"))
    larger = np.where(high > neutral, 1.0, -1.0)
    either = np.flatnonzero((low < neutral) & (high > neutral))
    other = larger.copy()
    other[either[::2]] = -1.0
    return [np.clip(neutral + sign * size, low, high) for sign in ([larger, other] if either.size else [larger])]


def unexcited_axes(problem: EstimationProblem) -> tuple[str, ...]:
    """Return the axes of whose hull coefficients the log tells next to nothing."""
    information = problem.by_hull.T @ problem.by_hull
    found = []
    for axis, places in AXES.items():
        most = float(np.linalg.eigvalsh(information[np.ix_(places, places)])[-1])
        if 1.0 / sqrt(1.0 + max(most, 0.0)) > JUDGING.excited_share:
            found.append(axis)
    return tuple(found)


def is_testable(every: Sequence[DetectionPower], axes: Sequence[str]) -> bool:
    """Tell whether a log in which nothing was found can be said to match: more than half of the effects would have shown."""
    return 2 * sum(one.chance >= JUDGING.detection_chance for one in every) > len(every) and len(axes) < len(AXES)


def recording_advice(
    every: Sequence[DetectionPower], axes: Sequence[str], where: Circumstances = ANYWHERE
) -> list[str]:
    """Return what a log of some vessel and place could not show, and what to record next, in sentences; each thing once."""
    sentences = []
    if axes:
        what = " and ".join(axes)
        sentences.append(
            f"The vessel was hardly moved in {what}: the hull cannot be identified there. "
            f"To excite {'it' if len(axes) == 1 else 'them'}, record {'; '.join(excited_by(axis, where) for axis in axes)}."
        )
    by_manoeuvre: dict[str, dict[str, list[str]]] = {}
    for one in every:
        if one.chance < JUDGING.detection_chance:
            known = by_manoeuvre.setdefault(shown_by(one.candidate.effect.id, where), {})
            known.setdefault(one.candidate.effect.title.lower(), []).extend(filter(None, [one.candidate.instance]))
    if by_manoeuvre:
        parts = [
            f"for {listed([titled(title, ', '.join(of)) for title, of in names.items()])}, record {manoeuvre}"
            for manoeuvre, names in by_manoeuvre.items()
        ]
        sentences.append(f"Not everything would have shown at its usual size. To make sure: {'; '.join(parts)}.")
    return sentences


def untested_notes(untested: Mapping[str, str]) -> list[str]:
    """Return a sentence for every reason why effects, by id, could not be tested."""
    by_reason: dict[str, list[str]] = {}
    for effect, reason in untested.items():
        by_reason.setdefault(reason, []).append(effects()[effect].title.lower())
    return [f"Not tested: {listed(titles)}, since {reason}." for reason, titles in by_reason.items()]
