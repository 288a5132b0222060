"""When an effect acts: all beginnings and ends at once, in one linearisation, and the best of them sharpened by fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, log

import numpy as np

from ferryid.diagnose.inference.estimation import (
    MAX_ITERATIONS,
    PARAMETER_DIFFERENCE,
    Candidate,
    EstimationProblem,
    Fit,
    StartingPoint,
    effect_slopes,
    fit,
    fitted_force_model,
    starting_point,
    without,
)
from ferryid.diagnose.inference.folds import block_s
from ferryid.diagnose.inference.noise_model import stride_s
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects.force_model import ForceModel, as_measured
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats, Ints

LATER_BLOCKS = 8
"""Blocks of parts whose cross-products are taken from the rows since they began."""
MOST_VALUES = 1e7
"""Numbers that a scan holds at once; parts are longer in long logs."""
FINE_TIMES = 40
"""So many times at most are tried about either end of a promising span."""
FIRST_TIME_STEP_S, LAST_TIME_STEP_S = 8.0, 0.2
"""Steps [s] with which a time is searched for nearby, from the first down to the last."""
COMPARING_ITERATIONS = 3
"""Steps of a fit by which spans are compared."""
LIKELIER = 0.02
"""Log evidence [nat] that another time must gain: a fit that is not quite at its top gains a little wherever it goes on."""


@dataclass(frozen=True)
class Linearisation:
    """A fit, linearised.

    Attributes
    ----------
    force_model
        That the fit has of the log.
    left
        What it leaves, whitened, shape (w,).
    slopes
        Its derivatives by hull and effects, shape (w, k).
    inverse
        Of their cross-products and the prior, shape (k, k).
    """

    force_model: ForceModel
    left: Floats
    slopes: Floats
    inverse: Floats


def linearise(problem: EstimationProblem, made: Fit, begin: StartingPoint) -> Linearisation:
    """Return a fit linearised; `begin` is `ferryid.diagnose.inference.estimation.starting_point` of it."""
    force_model = fitted_force_model(problem.plain, made)
    slopes = np.column_stack([begin.by_hull, effect_slopes(problem, made)])
    inverse = np.linalg.inv(slopes.T @ slopes + np.eye(slopes.shape[1]))
    return Linearisation(force_model, problem.white(force_model), slopes, np.asarray(inverse, dtype=np.float64))


def likeliest_start(problem: EstimationProblem, linearisation: Linearisation, candidate: Candidate) -> Floats:
    """Return where a fit of a candidate beside others begins: of its starts, the one beside which these leave the least.

    An effect that ends at a limit of its own, such as a dead band, has no slope towards limits that are far from a start.
    """
    starts = [candidate.start_at(share) for share in candidate.start_shares]
    if len(starts) == 1:
        return starts[0]

    def left(start: Floats) -> float:
        white = problem.white(candidate.act(linearisation.force_model, start))
        pull = linearisation.slopes.T @ (white - linearisation.left)
        return float(white @ white - pull @ linearisation.inverse @ pull)

    return min(starts, key=left)


def promising_spans(problem: EstimationProblem, linearisation: Linearisation, candidate: Candidate) -> list[Candidate]:
    """Return a candidate in the few spans, other than the whole log, in which it promises most beside a fit.

    Short ones are among them that are never reported (see `is_brief`): without these, what came and went within seconds would
    be taken for something that lasts.

    The log is cut into parts; what a candidate adds in a part is linear in its parameters there, and what it adds in a span is
    the sum of the parts'. So one set of cross-products holds the evidence of every span, hull and other effects refitted.

    What only passes has to stand out: see `stands_out`. Each span has its ends where it promises most nearby: see `_sharpened`.
    """
    edges, a, b, gain = _scan(problem, linearisation, candidate)
    found: list[tuple[int, int]] = []
    for k in np.argsort(-gain).tolist():
        if gain[k] <= 0.0 or len(found) == INFERENCE.fitted_spans:
            break
        i, j = int(a[k]), int(b[k])
        # A neighbour tells nothing new.
        if any(max(abs(i - other[0]), abs(j - other[1])) <= 1 for other in found):
            continue
        if not candidate.effect.passing or _is_event(float(gain[k]), a, b, gain, i, j):
            found.append((i, j))
    return [_sharpened(problem, linearisation, candidate, edges, i, j) for i, j in found]


def _sharpened(
    problem: EstimationProblem, linearisation: Linearisation, candidate: Candidate, edges: Floats, i: int, j: int
) -> Candidate:
    """Return a candidate in the span from one edge to another, its ends where it promises most within a part of these.

    Noise that swings gives the evidence a top every period: between two edges there are several, and a search that goes uphill
    ends on the nearest. What is brief stays as it is (see `is_brief`): it is no name, and would take what the ends of something
    that lasts leave.
    """
    last = len(edges) - 1
    coarse = replace(
        candidate, onset_s=float(edges[i]) if i > 0 else 0.0, offset_s=float(edges[j]) if j < last else inf
    )
    if is_brief(problem, coarse):
        return coarse
    most = max(1, min(FINE_TIMES, int(0.5 * _most_parts(problem, candidate))))
    begins, ends = (_steps_about(problem, edges, k, most) for k in (i, j))
    fine = np.unique(np.concatenate([edges[[0, last]], begins, ends]))
    a, b = (np.searchsorted(fine, times) for times in (begins, ends))
    a, b = (one.ravel() for one in np.meshgrid(a, b))
    lasts = fine[b] - fine[a]
    allowed = (lasts >= shortest_s(problem, candidate)) & (lasts <= longest_s(problem, candidate))
    a, b = a[allowed], b[allowed]
    if not len(a):
        return coarse
    G, g = _cross_products(problem, linearisation, candidate, fine)
    best = int(np.argmax(_gains(G, g, a, b, candidate)))
    onset, offset = float(fine[a[best]]), float(fine[b[best]])
    return replace(coarse, onset_s=onset if i > 0 else 0.0, offset_s=offset if j < last else inf)


def _steps_about(problem: EstimationProblem, edges: Floats, k: int, most: int) -> Floats:
    """Return times of steps within a part of an edge, `most` and its own [s]; of either end of the log that alone.

    None is outside the middles of the windows, between which a time is estimated.
    """
    if k in (0, len(edges) - 1):
        return edges[[k]]
    times, middles = problem.steps.middle_s, problem.windows.middle_s
    near = times[(times > max(edges[k - 1], middles[0])) & (times < min(edges[k + 1], middles[-1]))]
    return np.unique(np.append(near[:: max(1, -(-len(near) // most))], edges[k]))


def stands_out(problem: EstimationProblem, linearisation: Linearisation, candidate: Candidate) -> bool:
    """Tell whether a candidate that only passes is an event in its span, beside a fit that lacks it; True for any other."""
    if not candidate.effect.passing:
        return True
    edges, a, b, gain = _scan(problem, linearisation, candidate)
    i = int(np.argmin(np.abs(edges - candidate.onset_s)))
    j = int(np.argmin(np.abs(edges - min(candidate.offset_s, edges[-1]))))
    near = gain[(np.abs(a - i) <= 1) & (np.abs(b - j) <= 1)]
    return _is_event(float(near.max(initial=-inf)), a, b, gain, i, j)


def largest_gain(problem: EstimationProblem, linearisation: Linearisation, candidate: Candidate) -> float:
    """Return the most evidence that a candidate promises in any span other than the whole log, beside a fit."""
    return float(_scan(problem, linearisation, candidate)[3].max(initial=-inf))


def _is_event(own: float, a: Ints, b: Ints, gain: Floats, i: int, j: int) -> bool:
    """Tell whether the evidence of a span from part i up to j is far above that of all that neither overlap nor touch it.

    Where nothing pushes, those have what unsteady forces, a hull that is off and noise make of a push. What is no stronger is
    one of these, and what came twice alike is no event but something unsteady.
    """
    apart = (b < i) | (a > j)
    return own > INFERENCE.contrast * float(gain[apart].max(initial=0.0))


def _scan(
    problem: EstimationProblem, linearisation: Linearisation, candidate: Candidate
) -> tuple[Floats, Ints, Ints, Floats]:
    """Return where the log is cut [s], and spans by their first part and the one after their last with their evidence."""
    edges = _edges(problem, candidate)
    parts = len(edges) - 1
    a, b = np.triu_indices(parts + 1, 1)
    tried = (a > 0) | (b < parts)
    if candidate.effect.passing:
        lasts = edges[b] - edges[a]
        tried &= (lasts >= shortest_s(problem, candidate)) & (lasts <= longest_s(problem, candidate))
    a, b = a[tried], b[tried]
    if not len(a):
        return edges, a, b, np.empty(0)
    G, g = _cross_products(problem, linearisation, candidate, edges)
    gain = _gains(G, g, a, b, candidate)
    gain -= ((a > 0).astype(np.float64) + (b < parts)) * log(len(problem.windows.starts))
    return edges, a, b, gain


def shortest_s(problem: EstimationProblem, candidate: Candidate) -> float:
    """Return for how many seconds of data a candidate acts at least; what passes faster may be an error of the navigation."""
    window_s = len(problem.windows.weight) * problem.windows.measurements.step_s
    return max(INFERENCE.span_s, INFERENCE.passing_windows * window_s) if candidate.effect.passing else INFERENCE.span_s


def longest_s(problem: EstimationProblem, candidate: Candidate) -> float:
    """Return for how many seconds a candidate may act; infinite for one that may act throughout."""
    if not candidate.effect.passing:
        return inf
    times = problem.steps.middle_s
    return min(candidate.effect.longest_s, EFFECTS.longest_share * float(times[-1] - times[0]))


def passes(problem: EstimationProblem, candidate: Candidate) -> bool:
    """Tell whether a candidate's span is one of an effect that passes: not the whole log, and short."""
    return bool(candidate.times) and span_s(problem, candidate) <= longest_s(problem, candidate)


def span_s(problem: EstimationProblem, candidate: Candidate) -> float:
    """Return how long a candidate acts within the log [s], gaps included."""
    times = problem.steps.middle_s
    return min(candidate.offset_s, float(times[-1])) - max(candidate.onset_s, float(times[0]))


def part_s(problem: EstimationProblem, candidate: Candidate) -> float:
    """Return how long a part of the log is [s]."""
    return float(np.median(np.diff(_edges(problem, candidate))))


def is_brief(problem: EstimationProblem, candidate: Candidate) -> bool:
    """Tell whether a candidate acts for so short a time that it cannot be judged: it stands in for whatever came just then."""
    return bool(candidate.times) and lasts_s(problem, candidate) < INFERENCE.span_blocks * block_s(problem.windows)


def lasts_s(problem: EstimationProblem, candidate: Candidate) -> float:
    """Return for how many seconds of data a candidate acts."""
    times = problem.steps.middle_s
    return float(np.count_nonzero((times >= candidate.onset_s) & (times < candidate.offset_s))) * stride_s(
        problem.steps
    )


def _edges(problem: EstimationProblem, candidate: Candidate) -> Floats:
    """Return where the log is cut [s], into parts of as many steps each: in a gap nothing begins or ends.

    A part is as long as the shortest span of the candidate.
    """
    times = problem.steps.middle_s
    shortest = len(times) * stride_s(problem.steps) / shortest_s(problem, candidate)
    parts = max(INFERENCE.span_parts, int(min(shortest, _most_parts(problem, candidate))))
    return np.interp(np.linspace(0.0, len(times) - 1.0, parts + 1), np.arange(len(times)), times)


def _most_parts(problem: EstimationProblem, candidate: Candidate) -> float:
    """Return how many parts a scan has room for."""
    return MOST_VALUES / (len(problem.steps.middle_s) * int(problem.steps.channels.sum()) * len(candidate.parameters))


def _cross_products(
    problem: EstimationProblem, linearisation: Linearisation, candidate: Candidate, edges: Floats
) -> tuple[Floats, Floats]:
    """Return cross-products of what a candidate adds in every part, shape (parts, p, parts, p), and of it with what is left."""
    steps, start, parts = problem.steps, candidate.start, len(edges) - 1
    part = np.clip(np.searchsorted(edges, steps.middle_s, side="right") - 1, 0, parts - 1)
    there = as_measured(candidate.effect.apply(linearisation.force_model, start, candidate.instance))
    columns = []
    for k, one in enumerate(candidate.parameters):
        moved = start.copy()
        moved[k] += PARAMETER_DIFFERENCE * one.size
        change = as_measured(candidate.effect.apply(linearisation.force_model, moved, candidate.instance)) - there
        columns.append(steps.mean(steps.along(change)) / PARAMETER_DIFFERENCE)
    p, count = len(columns), len(steps.starts)
    every = np.zeros((count, columns[0].shape[1], parts, p))
    every[np.arange(count), :, part] = np.stack(columns, axis=2)
    C = problem.whitening_filter.white(every.reshape(count, -1, parts * p))
    shared = linearisation.slopes.T @ C
    begun = np.searchsorted(part, np.arange(parts)) * (len(C) // count)
    G = _products_of_later(C, begun, p) - shared.T @ linearisation.inverse @ shared
    return G.reshape(parts, p, parts, p), (C.T @ linearisation.left).reshape(-1, p)


def _products_of_later(C: Floats, begun: Ints, p: int) -> Floats:
    """Return ``C.T @ C`` of columns that begin one after the other: p of each part, zero in the rows before `begun`."""
    G = np.empty((C.shape[1], C.shape[1]))
    edges = np.linspace(0, len(begun), LATER_BLOCKS + 1).astype(int).tolist()
    for first, end in pairwise(edges):
        if first < end:
            own, rows = slice(first * p, end * p), slice(int(begun[first]), None)
            G[: end * p, own] = C[rows, : end * p].T @ C[rows, own]
            G[own, : first * p] = G[: first * p, own].T
    return G


def _gains(G: Floats, g: Floats, a: Ints, b: Ints, candidate: Candidate) -> Floats:
    """Return the gain in evidence of a candidate in the parts from a up to b, shape (spans,)."""
    parts, p = g.shape
    sums = np.zeros((parts + 1, p, parts + 1, p))
    sums[1:, :, 1:] = G.cumsum(axis=0).cumsum(axis=2)
    A = sums[b, :, b] - sums[a, :, b] - sums[b, :, a] + sums[a, :, a] + np.eye(p)
    total = np.concatenate([np.zeros((1, p)), g.cumsum(axis=0)])
    slope = total[b] - total[a]
    low = np.array([(one.low - one.neutral) / one.size for one in candidate.parameters])
    high = np.array([(one.high - one.neutral) / one.size for one in candidate.parameters])
    z = np.clip(-np.linalg.solve(A, slope[:, :, None])[:, :, 0], low, high)
    gained = -np.sum(slope * z, axis=1) - 0.5 * np.einsum("si,sij,sj->s", z, A, z)
    return np.asarray(gained - 0.5 * np.linalg.slogdet(A)[1])


def refine_span(
    problem: EstimationProblem,
    made: Fit,
    index: int,
    begin: StartingPoint,
    step_s: float,
    finest_s: float = LAST_TIME_STEP_S,
) -> Fit:
    """Return a fit with the ends of one candidate's span where they are likeliest nearby.

    Parameters
    ----------
    problem
        The log.
    made
        Fit of it.
    index
        Of the candidate; its span stays as long as `INFERENCE.span_s` at least.
    begin
        Where each fit begins.
    step_s, finest_s
        First step [s], which is halved where neither side is better, and the one to stop at.
    """
    times = problem.windows.middle_s
    best, step = made, step_s
    while step > finest_s:
        before = best.candidates[index]
        for end in before.times:
            middle = getattr(best.candidates[index], end)
            for time in (middle - step, middle + step):
                moved = best.candidates[index].moved(end, time)
                if lasts_s(problem, moved) < shortest_s(problem, moved) or not times[0] < time < times[-1]:
                    continue
                if span_s(problem, moved) > longest_s(problem, moved):
                    continue
                tried = fit(
                    problem,
                    replace_candidate(best.candidates, index, moved),
                    best.values,
                    steps=COMPARING_ITERATIONS,
                    begin=begin.moved_to(best.hull),
                    least=best.evidence,
                )
                best = tried if tried.evidence > best.evidence + LIKELIER else best
        step *= 0.5 if best.candidates[index] == before else 1.0
    return best


def refit_spans(problem: EstimationProblem, made: Fit) -> Fit:
    """Return a fit with every span where it is likeliest: noise that is less now may show it better, and elsewhere.

    What has ended may have been taken for something that lasts, beside another that sets in when it ends and makes up for it:
    so the times of the others are tried as its ends, too.
    """
    for i, candidate in enumerate(made.candidates):
        shared = _spans_to_others(problem, made.candidates, i) if candidate.effect.onset else []
        if not candidate.times and not shared:
            continue
        bare, begin = without(problem, made, i), starting_point(problem, made)
        spans = [candidate]
        if candidate.times:
            spans += promising_spans(problem, linearise(problem, bare, starting_point(problem, bare)), candidate)
        tried = [
            fit(
                problem,
                replace_candidate(made.candidates, i, one),
                made.values,
                steps=MAX_ITERATIONS if one in shared else COMPARING_ITERATIONS,
                begin=begin,
            )
            for one in [*spans, *shared]
        ]
        best = max(tried, key=lambda one: one.evidence)
        step = max(FIRST_TIME_STEP_S, 0.5 * part_s(problem, candidate))
        sharp = refine_span(problem, best, i, begin, step)
        made = turned(problem, fit(problem, sharp.candidates, sharp.values, begin=begin), i)
    return made


def turned(problem: EstimationProblem, made: Fit, index: int) -> Fit:
    """Return a fit in which a step begins in the log, where it would end in it: its two levels change places."""
    step = made.candidates[index]
    if not step.is_step or step.times != ("offset_s",):
        return made
    factor, otherwise = made.values[index]
    begins = replace(step, onset_s=step.offset_s, offset_s=inf)
    # A factor of zero has no inverse, and an inverse may lie beyond what is searched.
    values = np.array([min(1.0 / max(factor, 1e-6), step.parameters[0].high), factor * otherwise])
    return fit(
        problem,
        replace_candidate(made.candidates, index, begins),
        [values if k == index else one for k, one in enumerate(made.values)],
        begin=starting_point(problem, made),
    )


def _spans_to_others(problem: EstimationProblem, candidates: Sequence[Candidate], index: int) -> list[Candidate]:
    """Return a candidate in spans that begin or end when one of the others begins or ends."""
    own = candidates[index]
    times = [getattr(one, end) for k, one in enumerate(candidates) if k != index for end in one.times]
    spans = [own.moved(end, time) for time in times for end in ("onset_s", "offset_s") if end not in own.times]
    return [
        one
        for one in spans
        if one.onset_s < one.offset_s
        and lasts_s(problem, one) >= shortest_s(problem, one)
        and span_s(problem, one) <= longest_s(problem, one)
    ]


def replace_candidate(candidates: Sequence[Candidate], index: int, other: Candidate) -> list[Candidate]:
    """Return the candidates with another in the place of one."""
    return [other if k == index else one for k, one in enumerate(candidates)]
