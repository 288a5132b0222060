"""Whether what was found holds on data that it was not fitted to, and better there than what cannot be true.

The log is cut into contiguous blocks, dealt to folds in turn. For every fold the hypothesis, hull included, is fitted to the
windows of the other folds that stay a purge gap away, and judged on the windows of its own: so every window is judged once, by
a fit that has not seen it. Which effects were chosen, and when they begin, is known from the whole log.

Errors are judged in the weak form: ``M (a_picture - a_measured)`` averaged over a window, with the velocities' first derivative
moved onto the window's weight and the mass matrix of the plain force model, before and after alike. That is a force along the
vessel's axes, in N and N·m; no noisy signal was differentiated for it, and a refitted mass cannot shrink its own error. Where
positions were fitted, it is judged by velocities that the fit has not seen at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from ferryid.diagnose.inference.autoregression import ORDER
from ferryid.diagnose.inference.estimation import (
    Candidate,
    EstimationProblem,
    Fit,
    fit,
    fitted_force_model,
    starting_point,
)
from ferryid.diagnose.inference.folds import Folds, by_block, draws, folds_of, subset
from ferryid.diagnose.inference.force_errors import force_errors, mass_of
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging.free_runs import FreeRuns, free_runs
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.diagnose.parallel import over
from ferryid.effects.effect import HELD
from ferryid.effects.force_model import ForceModel, as_measured
from ferryid.types import Floats

HEADING = "heading mirrored"


@dataclass(frozen=True)
class HeldOut:
    """What a hypothesis leaves on windows it was not fitted to.

    Attributes
    ----------
    gaps
        On the channels that are fitted, shape (J, channels).
    errors
        As forces along the vessel's axes [N, N, N·m], shape (J, 3).
    fits
        One for every fold.
    """

    gaps: Floats
    errors: Floats
    fits: tuple[Fit, ...]


@dataclass(frozen=True)
class Improvement:
    """Held-out errors of two hypotheses.

    Attributes
    ----------
    before, after
        Force error of every window, shape (J, 3) [N, N, N·m].
    mse_before, mse_after
        Mean squares by axis, shape (3,) [N², N², N²m²].
    removed, low, high
        Fraction of the mean square that was removed, with its 95 % block-bootstrap interval, shape (3,).
    score, score_low
        Gain in log-likelihood of all channels under the noise of the better fit, with the same interval; positive where the
        second hypothesis predicts better.
    """

    before: Floats
    after: Floats
    mse_before: Floats
    mse_after: Floats
    removed: Floats
    low: Floats
    high: Floats
    score: float
    score_low: float


@dataclass(frozen=True)
class Proof:
    """Held-out evidence for one candidate, beside all the others that were found.

    Attributes
    ----------
    candidate
        What is judged.
    improvement
        By adding it to the others.
    placebos
        Score of each placebo in its place.
    beaten
        Lower end of the 95 % interval of how much better its score is than that of the placebos: the least of the mirrored
        heading's and the median of the shifted ones'. Infinite where there is no placebo.
    holds
        True where it improves held-out data, and beyond its placebos, none of which comes to `JUDGING.placebo_share`
        of it; or, of what the hull can imitate only by being off in all its coefficients together, where it improves them
        over the hull as it is in the model.
    free_runs
        By adding it to the others.
    """

    candidate: Candidate
    improvement: Improvement
    placebos: Mapping[str, float]
    beaten: float
    holds: bool
    free_runs: FreeRuns


@dataclass(frozen=True)
class HeldOutEvidence:
    """All held-out evidence for a hypothesis: as a whole, for each of its candidates, and in free runs."""

    folds: Folds
    whole: Improvement
    proofs: tuple[Proof, ...]
    free_runs: FreeRuns


def held_out_evidence(problem: EstimationProblem, found: Fit) -> HeldOutEvidence | None:
    """Return the held-out evidence for what was found; None for a log too short to hold anything out.

    Parameters
    ----------
    problem
        With the noise that the hypothesis leaves.
    found
        The hypothesis, fitted to the whole log.
    """
    folds = folds_of(problem.windows)
    if folds is None:
        return None
    base = held_out(problem, folds, ())
    full = held_out(problem, folds, found.candidates, found.values, found)
    proofs = tuple(_proof(problem, folds, found, full, base, index) for index in range(len(found.candidates)))
    return HeldOutEvidence(
        folds,
        compare_held_out(problem, folds, base, full),
        proofs,
        free_runs(problem, folds, base.fits, full.fits),
    )


def held_out(
    problem: EstimationProblem,
    folds: Folds,
    candidates: Sequence[Candidate],
    start: Sequence[Floats] | None = None,
    beside: Fit | None = None,
) -> HeldOut:
    """Return what a hypothesis leaves of the gaps of windows it was not fitted to.

    Parameters
    ----------
    problem
        Its noise weighs the windows, in all folds.
    folds
        From `folds_of`.
    candidates, start
        As in `ferryid.diagnose.inference.estimation.fit`.
    beside
        A fit whose hull is not far from theirs, where the fits begin; the profile's hull where None.
    """
    own_start = tuple(one.start for one in candidates) if start is None else tuple(start)

    def made_of(training: Windows) -> Fit:
        part = _part(problem, training)
        begin = (
            None
            if beside is None
            else starting_point(part, replace(beside, candidates=tuple(candidates), values=own_start))
        )
        return fit(part, candidates, own_start, begin=begin)

    gaps = np.empty((len(problem.windows.starts), int(problem.windows.channels.sum())))
    errors = np.empty((len(problem.windows.starts), 3))
    fits = over(made_of, folds.training)
    for k, made in enumerate(fits):
        own = folds.fold == k
        judged, force_model = subset(problem.windows, own), fitted_force_model(problem.plain, made)
        gaps[own] = judged.gap(force_model)
        errors[own] = force_errors(judged, force_model, problem.plain)
    return HeldOut(gaps, errors, tuple(fits))


def compare_held_out(problem: EstimationProblem, folds: Folds, before: HeldOut, after: HeldOut) -> Improvement:
    """Return how much better the second of two hypotheses predicts."""
    picks = draws(folds.block)
    sums = [by_block(one.errors**2, folds.block) for one in (before, after)]
    removed = 1.0 - sums[1].sum(axis=0) / sums[0].sum(axis=0)
    drawn = 1.0 - (picks @ sums[1]) / (picks @ sums[0])
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    gains = _gains(problem, folds, before.gaps, after.gaps)
    score_low = np.quantile(picks @ gains, 0.025)
    return Improvement(
        before.errors,
        after.errors,
        np.mean(before.errors**2, axis=0),
        np.mean(after.errors**2, axis=0),
        removed,
        low,
        high,
        float(gains.sum()),
        float(score_low),
    )


def placebos(problem: EstimationProblem, candidate: Candidate, values: Floats) -> dict[str, Candidate]:
    """Return what should explain as much as a candidate if only its shape counted and not when or where it acted.

    Its force late by shares of the log, and its force on a vessel that turned the other way (heading mirrored), if it depends
    on the heading at all. Each has the parameters of the candidate, to be fitted like it; but what is fitted beside an effect
    and never reported, by how much its formula is off, stays as it was found: a placebo is the same force, elsewhere.
    """
    unreported = candidate.effect.unreported(problem.plain.measurements, values)
    parameters = tuple(
        replace(one, size=HELD, neutral=value, start=value) if one.name in unreported else one
        for one, value in zip(candidate.parameters, values.tolist(), strict=True)
    )
    candidate = replace(candidate, parameters=parameters)
    seconds = float(problem.windows.measurements.t[-1] - problem.windows.measurements.t[0])
    made = {f"{share * seconds:.0f} s late": _shifted(candidate, share) for share in JUDGING.placebo_shifts}
    if candidate.effect.passing:
        # While it acts the heading hardly turns: on a mirrored one the same force only points elsewhere.
        return made
    mirrored = _mirrored(candidate)
    true = candidate.act(problem.plain, values)
    wrong = mirrored.act(problem.plain, values)
    size = np.linalg.norm(as_measured(true) - as_measured(problem.plain))
    # On a heading near north or south the mirrored force is the same: it would test nothing.
    if np.linalg.norm(as_measured(true) - as_measured(wrong)) > JUDGING.placebo_difference * size:
        made[HEADING] = mirrored
    return made


def _proof(problem: EstimationProblem, folds: Folds, found: Fit, full: HeldOut, base: HeldOut, index: int) -> Proof:
    candidate, values = found.candidates[index], found.values[index]
    others = [k for k in range(len(found.candidates)) if k != index]
    rest = [found.candidates[k] for k in others]
    start = [found.values[k] for k in others]
    without = held_out(problem, folds, rest, start, found) if rest else base
    made = compare_held_out(problem, folds, without, full)
    in_its_place = placebos(problem, candidate, values)

    def gains_of_placebos(weighed: EstimationProblem, bare: HeldOut, beside: Fit | None = None) -> dict[str, Floats]:
        judged = {
            name: held_out(weighed, folds, [*rest, placebo], [*start, placebo.start], beside)
            for name, placebo in in_its_place.items()
        }
        return {name: _gains(weighed, folds, bare.gaps, one.gaps) for name, one in judged.items()}

    gains, by_name = _gains(problem, folds, without.gaps, full.gaps), gains_of_placebos(problem, without, found)
    picks = draws(folds.block)
    beaten = _beaten(picks, gains, by_name)
    scores = {name: float(one.sum()) for name, one in by_name.items()}
    holds = made.score_low > 0.0 and beaten > 0.0
    # What acts seldom shows in a block or two, which half of the draws leave out.
    seldom = made.score > JUDGING.gain and made.score > JUDGING.gain + max(scores.values())
    holds = (holds or seldom) and not _matched(made.score, scores)
    if not holds and _hull_strains(problem, found, rest, start):
        rigid = replace(problem, hull_spread=np.zeros_like(problem.hull_spread))
        stiff = held_out(rigid, folds, rest, start)
        without, made = stiff, compare_held_out(problem, folds, stiff, full)
        # The same force late, or on a mirrored heading, has to be worse there too.
        own = held_out(rigid, folds, found.candidates, found.values)
        gains, by_name = _gains(problem, folds, stiff.gaps, own.gaps), gains_of_placebos(rigid, stiff)
        beaten = _beaten(picks, gains, by_name)
        scores = {name: float(one.sum()) for name, one in by_name.items()}
        holds = made.score_low > 0.0 and beaten > 0.0 and not _matched(made.score, scores)
    return Proof(candidate, made, scores, beaten, holds, free_runs(problem, folds, without.fits, full.fits))


def _matched(score: float, placebos: Mapping[str, float]) -> bool:
    late = sorted(value for name, value in placebos.items() if name != HEADING)
    return max(late[len(late) // 2], placebos.get(HEADING, -np.inf)) > JUDGING.placebo_share * score


def _beaten(picks: Floats, gains: Floats, by_name: Mapping[str, Floats]) -> float:
    """Return the lower end of how much more is gained than by the placebos; see `Proof`."""
    late = [one for name, one in by_name.items() if name != HEADING]
    rivals = [sorted(late, key=lambda one: float(one.sum()))[len(late) // 2]]
    rivals += [by_name[HEADING]] if HEADING in by_name else []
    return min(float(np.quantile(picks @ (gains - rival), 0.025)) for rival in rivals)


def _hull_strains(problem: EstimationProblem, found: Fit, rest: Sequence[Candidate], start: Sequence[Floats]) -> bool:
    """Tell whether the hull can stand in for a candidate only by being what nobody believes that it is.

    A hull refitted to a fouled log explains it as well as fouling does, held-out stretches included; what speaks against it
    is that all its coefficients are then off together. Such a candidate is judged against the hull as it is in the model.
    """
    without = fit(problem, rest, start)
    free = problem.hull_spread > 0.0
    strains = [
        float(np.sum(((one.hull - problem.plain.hull)[free] / problem.hull_spread[free]) ** 2))
        for one in (without, found)
    ]
    return without.evidence < found.evidence - JUDGING.gain and strains[0] > strains[1] + 2.0 * JUDGING.gain


def _part(problem: EstimationProblem, windows: Windows) -> EstimationProblem:
    return problem.part(windows)


def _gains(problem: EstimationProblem, folds: Folds, before: Floats, after: Floats) -> Floats:
    """Return the gain in log-likelihood of every block, shape (blocks,)."""
    runs, c = problem.windows.runs, before.shape[1]
    kept = np.concatenate([np.arange(a + ORDER, b) for a, b in runs if b - a > ORDER])
    left = [np.sum(problem.noise.white(gaps, runs).reshape(-1, c) ** 2, axis=1) for gaps in (before, after)]
    gained = np.zeros(len(folds.block))
    gained[kept] = 0.5 * (left[0] - left[1])
    return by_block(gained[:, None], folds.block)[:, 0]


def _shifted(candidate: Candidate, share: float) -> Candidate:
    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        force = _force_of(candidate, force_model, p)
        late = np.roll(force, round(share * len(force)), axis=0)
        return replace(force_model, external=force_model.external + late)

    return replace(candidate, effect=replace(candidate.effect, apply=apply), onset_s=0.0, offset_s=inf)


def _mirrored(candidate: Candidate) -> Candidate:
    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        measurements = force_model.measurements
        eta = np.column_stack([measurements.eta[:, :2], -measurements.psi])
        force = _force_of(candidate, replace(force_model, measurements=replace(measurements, eta=eta)), p)
        return replace(force_model, external=force_model.external + force)

    return replace(candidate, effect=replace(candidate.effect, apply=apply), onset_s=0.0, offset_s=inf)


def _force_of(candidate: Candidate, force_model: ForceModel, p: Floats) -> Floats:
    """Return what an effect changes, as a force [N, N, N·m], shape (n, 3)."""
    more = as_measured(candidate.act(force_model, p)) - as_measured(force_model)
    return np.asarray(more @ mass_of(force_model.hull).T)
