"""When an effect acts: all beginnings and ends at once, in one linearisation, and the best of them sharpened by fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, log

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.inference.estimation import (
    NUDGE,
    Fit,
    Near,
    Suspect,
    Trial,
    effect_slopes,
    fit,
    imagined,
    near,
    without,
)
from ferryid.diagnose.inference.folds import block_s
from ferryid.diagnose.inference.noise_model import stride_s
from ferryid.effects.picture import Picture, as_measured
from ferryid.vessel.profile import Floats

Ints = NDArray[np.int64]

PART_S, FEWEST_PARTS = 8.0, 24
"""Length of the parts into which a log is cut [s], and how many there are at least: an effect begins and ends between two of
them. In a calm log seconds matter: what acts too long or too short by them leaves a push that nothing explains."""
MOST_NUMBERS = 1e7
"""Numbers that a scan holds at once; parts are longer in long logs."""
LEAST_BLOCKS = 2.0
"""Length of the shortest span that a name can be judged by, in blocks that are held out: a fit that is judged on one part of it
must have seen another."""
PROMISING = 3
"""Spans that are handed on to be fitted."""
NEARBY_S, FINEST_S = 8.0, 0.2
"""Steps [s] with which a time is searched for nearby, from the first down to the last."""
GLANCE = 3
"""Steps of a fit by which spans are compared."""


@dataclass(frozen=True)
class Ground:
    """A fit, linearised.

    Attributes
    ----------
    picture
        That the fit has of the log.
    left
        What it leaves, whitened, shape (w,).
    slopes
        Its derivatives by hull and effects, shape (w, k).
    inverse
        Of their cross-products and the prior, shape (k, k).
    """

    picture: Picture
    left: Floats
    slopes: Floats
    inverse: Floats


def ground_of(trial: Trial, made: Fit, begin: Near) -> Ground:
    """Return a fit linearised; `begin` is `ferryid.diagnose.inference.estimation.near` of it."""
    picture = imagined(trial.plain, made)
    slopes = np.column_stack([begin.by_hull, effect_slopes(trial, made)])
    inverse = np.linalg.inv(slopes.T @ slopes + np.eye(slopes.shape[1]))
    return Ground(picture, trial.white(picture), slopes, np.asarray(inverse, dtype=np.float64))


def promising(trial: Trial, ground: Ground, suspect: Suspect) -> list[Suspect]:
    """Return a suspect in the few spans, other than the whole log, in which it promises most beside a fit.

    Short ones are among them that can name nothing (see `brief`): left out, what came and went within seconds would be taken
    for something that lasts.

    The log is cut into parts; what a suspect adds in a part is linear in its parameters there, and what it adds in a span is
    the sum of the parts'. So one set of cross-products holds the evidence of every span, hull and other effects refitted.
    """
    edges = _edges(trial, suspect)
    parts = len(edges) - 1
    G, g = _cross_products(trial, ground, suspect, edges)
    a, b = np.triu_indices(parts + 1, 1)
    part = (a > 0) | (b < parts)
    a, b = a[part], b[part]
    gain = _gains(G, g, a, b, suspect)
    gain -= ((a > 0).astype(np.float64) + (b < parts)) * log(len(trial.windows.starts))
    found: list[tuple[int, int]] = []
    for k in np.argsort(-gain).tolist():
        if gain[k] <= 0.0 or len(found) == PROMISING:
            break
        # A neighbour tells nothing new.
        if all(max(abs(int(a[k]) - i), abs(int(b[k]) - j)) > 1 for i, j in found):
            found.append((int(a[k]), int(b[k])))
    return [
        replace(suspect, onset_s=float(edges[i]) if i > 0 else 0.0, offset_s=float(edges[j]) if j < parts else inf)
        for i, j in found
    ]


def part_s(trial: Trial, suspect: Suspect) -> float:
    """Return how long a part of the log is [s]."""
    return float(np.median(np.diff(_edges(trial, suspect))))


def brief(trial: Trial, suspect: Suspect) -> bool:
    """Tell whether a suspect acts for so short a time that it cannot be judged: it stands in for whatever came just then."""
    return bool(suspect.times) and lasts_s(trial, suspect) < LEAST_BLOCKS * block_s(trial.windows)


def lasts_s(trial: Trial, suspect: Suspect) -> float:
    """Return for how many seconds of data a suspect acts."""
    times = trial.steps.middle_s
    return float(np.count_nonzero((times >= suspect.onset_s) & (times < suspect.offset_s))) * stride_s(trial.steps)


def _edges(trial: Trial, suspect: Suspect) -> Floats:
    """Return where the log is cut [s], into parts of as many steps each: in a gap nothing begins or ends."""
    times = trial.steps.middle_s
    most = MOST_NUMBERS / (len(times) * trial.steps.channels.sum() * len(suspect.parameters))
    parts = max(FEWEST_PARTS, int(min(len(times) * stride_s(trial.steps) / PART_S, most)))
    return np.interp(np.linspace(0.0, len(times) - 1.0, parts + 1), np.arange(len(times)), times)


def _cross_products(trial: Trial, ground: Ground, suspect: Suspect, edges: Floats) -> tuple[Floats, Floats]:
    """Return cross-products of what a suspect adds in every part, shape (parts, p, parts, p), and of it with what is left."""
    steps, start = trial.steps, suspect.start
    part = np.clip(np.searchsorted(edges, steps.middle_s, side="right") - 1, 0, len(edges) - 2)
    own = part[:, None, None] == np.arange(len(edges) - 1)
    there = as_measured(suspect.effect.apply(ground.picture, start, suspect.instance))
    columns = []
    for k, one in enumerate(suspect.parameters):
        moved = start.copy()
        moved[k] += NUDGE * one.size
        change = as_measured(suspect.effect.apply(ground.picture, moved, suspect.instance)) - there
        columns.append(steps.mean(steps.along(change))[:, :, None] / NUDGE * own)
    p = len(columns)
    C = trial.sieve.white(np.stack(columns, axis=3).reshape(len(steps.starts), -1, (len(edges) - 1) * p))
    shared = ground.slopes.T @ C
    G = C.T @ C - shared.T @ ground.inverse @ shared
    return G.reshape(len(edges) - 1, p, len(edges) - 1, p), (C.T @ ground.left).reshape(-1, p)


def _gains(G: Floats, g: Floats, a: Ints, b: Ints, suspect: Suspect) -> Floats:
    """Return the gain in evidence of a suspect in the parts from a up to b, shape (spans,)."""
    parts, p = g.shape
    sums = np.zeros((parts + 1, p, parts + 1, p))
    sums[1:, :, 1:] = G.cumsum(axis=0).cumsum(axis=2)
    A = sums[b, :, b] - sums[a, :, b] - sums[b, :, a] + sums[a, :, a] + np.eye(p)
    total = np.concatenate([np.zeros((1, p)), g.cumsum(axis=0)])
    slope = total[b] - total[a]
    low, high = (
        np.array([(end - one.neutral) / one.size for one, end in zip(suspect.parameters, ends, strict=True)])
        for ends in ([one.low for one in suspect.parameters], [one.high for one in suspect.parameters])
    )
    z = np.clip(-np.linalg.solve(A, slope[:, :, None])[:, :, 0], low, high)
    gained = -np.sum(slope * z, axis=1) - 0.5 * np.einsum("si,sij,sj->s", z, A, z)
    return np.asarray(gained - 0.5 * np.linalg.slogdet(A)[1])


def sharpened(trial: Trial, made: Fit, index: int, begin: Near, step_s: float, finest_s: float = FINEST_S) -> Fit:
    """Return a fit with the ends of one suspect's span where they are likeliest nearby.

    Parameters
    ----------
    trial
        The log.
    made
        Fit of it.
    index
        Of the suspect; its span stays as long as `PART_S` at least.
    begin
        Where each fit begins.
    step_s, finest_s
        First step [s], which is halved where neither side is better, and the one to stop at.
    """
    times = trial.windows.middle_s
    best, step = made, step_s
    while step > finest_s:
        before = best.suspects[index]
        for end in before.times:
            middle = getattr(best.suspects[index], end)
            for time in (middle - step, middle + step):
                moved = best.suspects[index].moved(end, time)
                if lasts_s(trial, moved) < PART_S or not times[0] < time < times[-1]:
                    continue
                tried = fit(trial, swapped(best.suspects, index, moved), best.values, steps=GLANCE, begin=begin)
                best = max(best, tried, key=lambda one: one.evidence)
        step *= 0.5 if best.suspects[index] == before else 1.0
    return best


def timed(trial: Trial, made: Fit) -> Fit:
    """Return a fit with every span where it is likeliest: noise that is less now may show it better, and elsewhere."""
    for i, suspect in enumerate(made.suspects):
        if not suspect.times:
            continue
        bare, begin = without(trial, made, i), near(trial, made)
        ground = ground_of(trial, bare, near(trial, bare))
        spans = [suspect, *promising(trial, ground, suspect)]
        tried = [fit(trial, swapped(made.suspects, i, one), made.values, steps=GLANCE, begin=begin) for one in spans]
        best = max(tried, key=lambda one: one.evidence)
        step = max(NEARBY_S, 0.5 * part_s(trial, suspect))
        sharp = sharpened(trial, best, i, begin, step)
        made = fit(trial, sharp.suspects, sharp.values, begin=begin)
    return made


def swapped(suspects: Sequence[Suspect], index: int, other: Suspect) -> list[Suspect]:
    """Return the suspects with another in the place of one."""
    return [other if k == index else one for k, one in enumerate(suspects)]
