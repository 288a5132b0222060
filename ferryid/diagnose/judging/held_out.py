"""Whether what was found holds on data that it was not fitted to, and better there than what cannot be true.

The log is cut into contiguous blocks, dealt to folds in turn. For every fold the hypothesis, hull included, is fitted to the
windows of the other folds that stay a purge gap away, and judged on the windows of its own: so every window is judged once, by
a fit that has not seen it, as surely as the other folds know the hull (`ferryid.diagnose.inference.hull_uncertainty`). Which
effects were chosen, and when they begin, is known from the whole log.

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
    rest_of,
    starting_point,
)
from ferryid.diagnose.inference.folds import Folds, by_block, draws, subset
from ferryid.diagnose.inference.force_errors import force_errors, mass_of
from ferryid.diagnose.inference.hull_uncertainty import hull_uncertainty
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging.free_runs import FreeRuns, free_runs
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.effect import HELD
from ferryid.effects.force_model import Action, ForceModel, as_measured, touches
from ferryid.side_by_side import over
from ferryid.types import Floats

HEADING = "heading mirrored"
ACTING_BY_FORCE = frozenset({"measurements", "parts", "angles", "external", "air", "air_factors", "gust_std"})
"""What of a force model is touched by an effect that is a force itself: what the hull makes of it plays no part."""
IMITATION_STEPS, IMITATION_DIFFERENCE = 4, 0.05
"""Steps of the search for parameters with which a placebo is all but the effect, and their finite difference, in sizes."""


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
    fits_before, fits_after
        One for every fold, which leave these errors.
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
    fits_before: tuple[Fit, ...]
    fits_after: tuple[Fit, ...]


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
        heading's and the median of the shifted ones'.
    holds
        True where it improves held-out data, and beyond its placebos, none of which comes to `JUDGING.placebo_share`
        of it, in circles that on the mirrored heading to as much of what it cannot imitate of a true effect (`imitable`); or,
        of what the hull can imitate only by being off in all its coefficients together, where it improves them over the hull as
        it is in the model.
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
    folds = problem.folds
    if folds is None:
        return None
    base = held_out(problem, folds, ())
    full = held_out(problem, folds, found.candidates, found.values, found)
    whole = compare_held_out(problem, folds, base, full)
    proofs = tuple(over(lambda index: _proof(problem, folds, found, full, base, index), range(len(found.candidates))))
    return HeldOutEvidence(
        folds,
        whole,
        proofs,
        free_runs(problem, folds, whole.fits_before, whole.fits_after),
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
        part = problem.part(training)
        begin = (
            None
            if beside is None
            else starting_point(part, replace(beside, candidates=tuple(candidates), values=own_start))
        )
        return fit(part, candidates, own_start, begin=begin)

    gaps = np.empty((len(problem.windows.starts), int(problem.windows.channels.sum())))
    fits = over(made_of, folds.training)
    for k, made in enumerate(fits):
        own = folds.fold == k
        gaps[own] = subset(problem.windows, own).gap(fitted_force_model(problem.plain, made))
    return HeldOut(gaps, _errors(problem, folds, fits), tuple(fits))


def _errors(problem: EstimationProblem, folds: Folds, fits: Sequence[Fit]) -> Floats:
    errors = np.empty((len(problem.windows.starts), 3))
    for k, made in enumerate(fits):
        own = folds.fold == k
        force_model = fitted_force_model(problem.plain, made)
        errors[own] = force_errors(subset(problem.windows, own), force_model, problem.plain)
    return errors


def _with_hull_moved(problem: EstimationProblem, folds: Folds, one: HeldOut) -> HeldOut:
    """Return what a hypothesis leaves if the hull is moved in every fold to what its windows show of what is open."""
    white = problem.noise.white(one.gaps, problem.windows.runs)
    moves = [known.move(white) for known in hull_uncertainty(problem, folds)]
    fits = tuple(
        replace(made, hull=made.hull + problem.hull_spread * move) for made, move in zip(one.fits, moves, strict=True)
    )
    return HeldOut(one.gaps, _errors(problem, folds, fits), fits)


def compare_held_out(problem: EstimationProblem, folds: Folds, before: HeldOut, after: HeldOut) -> Improvement:
    """Return how much better the second of two hypotheses predicts.

    Where the errors of an axis grow, but not with the hull moved within what is open of it, the hull is what was wrong there,
    and the errors with it moved count for both.
    """
    picks = draws(folds.block)
    gains = _gains(problem, folds, before.gaps, after.gaps)
    score, score_low = float(gains.sum()), float(np.quantile(picks @ gains, 0.025))
    plain = _improvement(folds, picks, before, after, score, score_low)
    if not _grows(plain):
        return plain
    moved = [_with_hull_moved(problem, folds, one) for one in (before, after)]
    within = _improvement(folds, picks, moved[0], moved[1], score, score_low)
    return plain if _grows(within) else within


def _grows(made: Improvement) -> bool:
    return bool(np.min(made.removed) < -JUDGING.worsening)


def _improvement(
    folds: Folds, picks: Floats, before: HeldOut, after: HeldOut, score: float, score_low: float
) -> Improvement:
    sums = [by_block(one.errors**2, folds.block) for one in (before, after)]
    drawn = 1.0 - (picks @ sums[1]) / (picks @ sums[0])
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    return Improvement(
        before.errors,
        after.errors,
        np.mean(before.errors**2, axis=0),
        np.mean(after.errors**2, axis=0),
        1.0 - sums[1].sum(axis=0) / sums[0].sum(axis=0),
        low,
        high,
        score,
        score_low,
        before.fits,
        after.fits,
    )


def placebos(problem: EstimationProblem, candidate: Candidate, values: Floats) -> dict[str, Candidate]:
    """Return what should explain as much as a candidate if only its shape counted and not when or where it acted.

    Its force late by shares of the log, and its force on a vessel that turned the other way (heading mirrored), if it depends
    on the heading at all. In turning circles a force that comes late is the same force from another side, and no placebo of one
    that depends on the heading. Each has the parameters of the candidate, to be fitted like it; but what is fitted beside an
    effect and never reported, by how much its formula is off, stays as it was found: a placebo is the same force, elsewhere.
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
        shares = dict(zip(list(made), JUDGING.placebo_shifts, strict=True))
        made = {name: one for name, one in made.items() if not _circles(problem.windows, shares[name])}
        made[HEADING] = mirrored
    return made


def _circles(windows: Windows, share: float) -> bool:
    """Return whether the vessel turns so steadily that its headings, late by a share, are its own but for an angle."""
    psi = windows.measurements.psi[windows.measurements.usable]
    apart = np.roll(psi, round(share * len(psi))) - psi
    around, off = (np.angle(np.exp(1j * one) / np.mean(np.exp(1j * one))) for one in (psi, apart))
    turns, differs = (float(np.degrees(np.sqrt(np.mean(one**2)))) for one in (around, off))
    return turns > JUDGING.circling_turn and differs < JUDGING.placebo_turn


def imitable(problem: EstimationProblem, candidate: Candidate, placebo: Candidate, values: Floats) -> float:
    """Return the share of what a candidate does to a log that a placebo can do with parameters of its own, 0 to 1.

    Of the squared whitened prediction errors that the effect changes and the hull cannot imitate within its prior, by
    Gauss-Newton steps from the candidate's parameters. On a vessel that turns steadily, a current on the mirrored heading gives
    the same in surge or in sway.
    """
    plain = problem.white(problem.plain)
    N = problem.by_hull
    inner = N.T @ N + np.eye(N.shape[1])

    def apart(change: Floats) -> Floats:
        return np.asarray(change - N @ np.linalg.solve(inner, N.T @ change))

    aim = apart(problem.white(candidate.act(problem.plain, values)) - plain)
    size = float(aim @ aim)
    limits = np.array([(one.low, one.high, one.size) for one in placebo.parameters])
    free = [k for k, one in enumerate(placebo.parameters) if one.size > HELD]
    at, least = values.copy(), 1.0

    def left(p: Floats) -> Floats:
        return aim - apart(problem.white(placebo.act(problem.plain, p)) - plain)

    for _ in range(IMITATION_STEPS):
        here = left(at)
        least = min(least, float(here @ here) / size) if size > 0.0 else 0.0
        moves = IMITATION_DIFFERENCE * limits[free, 2]
        slopes = [(left(at + move * np.eye(len(at))[k]) - here) / move for k, move in zip(free, moves, strict=True)]
        step = np.linalg.lstsq(np.column_stack(slopes), -here, rcond=None)[0]
        at[free] = np.clip(at[free] + step, limits[free, 0], limits[free, 1])
    return 1.0 - least


def _proof(problem: EstimationProblem, folds: Folds, found: Fit, full: HeldOut, base: HeldOut, index: int) -> Proof:
    candidate, values = found.candidates[index], found.values[index]
    rest, start = rest_of(found, index)
    without = held_out(problem, folds, rest, start, found) if rest else base
    made = compare_held_out(problem, folds, without, full)
    in_its_place = placebos(problem, candidate, values)
    alone = list(in_its_place) == [HEADING]
    brief = len(candidate.times) == 2 and HEADING in in_its_place
    alike = imitable(problem, candidate, in_its_place[HEADING], values) if alone or brief else 0.0
    if brief and not alone and alike > JUDGING.placebo_all_but:
        # While it acts the heading hardly turns: what it does can be done on a mirrored one as well, which tests nothing.
        del in_its_place[HEADING]

    def gains_of_placebos(weighed: EstimationProblem, bare: HeldOut, beside: Fit | None = None) -> dict[str, Floats]:
        def gained(placebo: Candidate) -> Floats:
            made = held_out(weighed, folds, [*rest, placebo], [*start, placebo.start], beside)
            return _gains(weighed, folds, bare.gaps, made.gaps)

        return dict(zip(in_its_place, over(gained, in_its_place.values()), strict=True))

    gains, by_name = _gains(problem, folds, without.gaps, full.gaps), gains_of_placebos(problem, without, found)
    picks = draws(folds.block)
    beaten = _beaten(picks, gains, by_name)
    scores = {name: float(one.sum()) for name, one in by_name.items()}
    holds = made.score_low > 0.0 and beaten > 0.0
    # What acts seldom shows in a block or two, which half of the draws leave out.
    seldom = made.score > JUDGING.gain and made.score > JUDGING.gain + max(scores.values())
    holds = (holds or seldom) and not _matched(made.score, scores, alike)
    # What a hull that strains by far leaves of an effect says nothing of its size.
    little = holds and float(made.removed.max()) < JUDGING.least_removed
    least = JUDGING.gain if not holds else JUDGING.strained_gain if little else np.inf
    if least < np.inf and _hull_strains(problem, found, rest, start, least):
        rigid = replace(problem, hull_spread=np.zeros_like(problem.hull_spread))
        stiff = held_out(rigid, folds, rest, start)
        # The same force late, or on a mirrored heading, has to be worse there too.
        own = held_out(rigid, folds, found.candidates, found.values)
        # What held beside a refitted hull has to do so on that of the model, without what the refit adds.
        judged = own if holds else full
        over_stiff = compare_held_out(rigid, folds, stiff, judged)
        gains, by_stiff = _gains(rigid, folds, stiff.gaps, own.gaps), gains_of_placebos(rigid, stiff)
        beyond = _beaten(picks, gains, by_stiff)
        theirs = {name: float(one.sum()) for name, one in by_stiff.items()}
        held = over_stiff.score_low > 0.0 and beyond > 0.0 and not _matched(over_stiff.score, theirs, alike)
        if held or not holds:
            made, scores, beaten, holds = over_stiff, theirs, beyond, held
    return Proof(candidate, made, scores, beaten, holds, free_runs(problem, folds, made.fits_before, made.fits_after))


def _matched(score: float, placebos: Mapping[str, float], alike: float) -> bool:
    """Return whether a placebo comes near.

    Where circles leave that on the mirrored heading alone, it may gain what it can imitate of a true effect.
    """
    late = sorted(value for name, value in placebos.items() if name != HEADING)
    share = JUDGING.placebo_share
    if not late:
        return placebos[HEADING] > (share + (1.0 - share) * alike) * score
    return max(late[len(late) // 2], placebos.get(HEADING, -np.inf)) > share * score


def _beaten(picks: Floats, gains: Floats, by_name: Mapping[str, Floats]) -> float:
    """Return the lower end of how much more is gained than by the placebos; see `Proof`."""
    late = [one for name, one in by_name.items() if name != HEADING]
    rivals = [sorted(late, key=lambda one: float(one.sum()))[len(late) // 2]] if late else []
    rivals += [by_name[HEADING]] if HEADING in by_name else []
    return min(float(np.quantile(picks @ (gains - rival), 0.025)) for rival in rivals)


def _hull_strains(
    problem: EstimationProblem, found: Fit, rest: Sequence[Candidate], start: Sequence[Floats], least: float
) -> bool:
    """Tell whether the hull can stand in for a candidate only by being what nobody believes that it is.

    By `least` both in evidence and in what the prior of its coefficients costs [nat].

    A hull refitted to a fouled log explains it as well as fouling does, held-out stretches included; what speaks against it
    is that all its coefficients are then off together. Such a candidate is judged against the hull as it is in the model.
    """
    without = fit(problem, rest, start)
    free = problem.hull_spread > 0.0
    strains = [
        float(np.sum(((one.hull - problem.plain.hull)[free] / problem.hull_spread[free]) ** 2))
        for one in (without, found)
    ]
    return without.evidence < found.evidence - least and strains[0] > strains[1] + 2.0 * least


def _gains(problem: EstimationProblem, folds: Folds, before: Floats, after: Floats) -> Floats:
    """Return the gain in the logarithm of the predictive probability of every block, shape (blocks,)."""
    runs, c = problem.windows.runs, before.shape[1]
    kept = np.concatenate([np.arange(a + ORDER, b) for a, b in runs if b - a > ORDER])
    known = hull_uncertainty(problem, folds)
    left = []
    for white in (problem.noise.white(gaps, runs) for gaps in (before, after)):
        squares = np.zeros_like(white)
        for one in known:
            squares[one.rows] = white[one.rows] * one.weighed(white)
        left.append(np.sum(squares.reshape(-1, c), axis=1))
    gained = np.zeros(len(folds.block))
    gained[kept] = 0.5 * (left[0] - left[1])
    return by_block(gained[:, None], folds.block)[:, 0]


def _shifted(candidate: Candidate, share: float) -> Candidate:
    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        force = _force_of(candidate, force_model, p)
        late = np.roll(force, round(share * len(force)), axis=0)
        return force_model.replaced(external=force_model.external + late)

    return _in_its_place(candidate, apply)


def _mirrored(candidate: Candidate) -> Candidate:
    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        measurements = force_model.measurements
        eta = np.column_stack([measurements.eta[:, :2], -measurements.psi])
        force = _force_of(candidate, force_model.replaced(measurements=replace(measurements, eta=eta)), p)
        return force_model.replaced(external=force_model.external + force)

    return _in_its_place(candidate, apply)


def _in_its_place(candidate: Candidate, apply: Action) -> Candidate:
    """Return a candidate that does something else with the same parameters, all along."""
    if candidate.touched is not None and candidate.touched <= ACTING_BY_FORCE:
        apply = touches(*candidate.touched, "external")(apply)
    return replace(candidate, effect=replace(candidate.effect, apply=apply), onset_s=0.0, offset_s=inf)


def _force_of(candidate: Candidate, force_model: ForceModel, p: Floats) -> Floats:
    """Return what an effect changes, as a force [N, N, N·m], shape (n, 3)."""
    acted = candidate.act(force_model, p)
    if candidate.touched is not None and candidate.touched <= ACTING_BY_FORCE:
        force = acted.external - force_model.external
        return force if acted.parts is force_model.parts else force + (acted.parts - force_model.parts).sum(axis=1)
    return np.asarray((as_measured(acted) - as_measured(force_model)) @ mass_of(force_model.hull).T)
