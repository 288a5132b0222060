"""Whether the winds that several logs are given beside a common hull hold on stretches that neither was fitted to.

A steady wind moves a vessel by little against the rest of a single log, too little to prove it there; the same kind of wind in
many logs, with one hull for all of them, can be proved together. Blocks of every log are held out in turn, hull and winds are
fitted to the rest of all logs, and the gain is summed over blocks. Winds that cannot be true, on headings that the vessel did
not have, are fitted in their place: what they gain is what any two more parameters would.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.inference.autoregression import ORDER, AutoregressiveNoise
from ferryid.diagnose.inference.campaign_hull import CampaignHull, Member, fit_campaign_hull, induced
from ferryid.diagnose.inference.estimation import Candidate, apply_candidates
from ferryid.diagnose.inference.folds import DRAWS, folds_of, subset
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects.force_model import COEFFICIENTS, ForceModel
from ferryid.errors import FerryIdError
from ferryid.types import Floats

MIRRORED, EXCHANGED = "heading mirrored", "another log's heading"


@dataclass(frozen=True)
class Gains:
    """Gain in log-likelihood of held-out blocks over no wind at all, shape (blocks,), and the log of each."""

    blocks: Floats
    log: Floats

    @property
    def total(self) -> float:
        """Sum over blocks."""
        return float(self.blocks.sum())

    def interval(self, over: Gains | None = None) -> tuple[float, float]:
        """Return the 95 % block-bootstrap interval of the total, or of what it is more than another's."""
        apart = self.blocks - (0.0 if over is None else over.blocks)
        drawn = np.random.default_rng(0).integers(0, len(apart), size=(DRAWS, len(apart)))
        low, high = np.quantile(apart[drawn].sum(axis=1), [0.025, 0.975])
        return float(low), float(high)


def held_out_gains(
    variants: Mapping[str, Sequence[Member]], none: Sequence[Member], spread: Floats, induced_size: Floats
) -> dict[str, Gains]:
    """Return the gain of each variant of the members over those without effects.

    Parameters
    ----------
    variants
        The same logs with other effects or force models, by name.
    none
        The logs without effects.
    spread, induced_size
        As in `ferryid.diagnose.inference.campaign_hull.fit_campaign_hull`.

    Raises
    ------
    FerryIdError
        Where no log is long enough to hold anything out.
    """
    cut = [(i, folds) for i, one in enumerate(none) if (folds := folds_of(one.windows)) is not None]
    if not cut:
        raise FerryIdError("the logs: each is too short to hold stretches out. Fix: give logs of some minutes")
    kept = [i for i, _ in cut]
    weigh = fit_campaign_hull([next(iter(variants.values()))[i] for i in kept], spread, induced_size).noise

    def left(members: Sequence[Member]) -> list[Floats]:
        squares = [np.zeros(len(members[i].windows.starts)) for i in kept]
        for k in range(INFERENCE.folds):
            training = [replace(members[i], windows=folds.training[k]) for i, folds in cut]
            made = fit_campaign_hull(training, spread, induced_size)
            for place, (i, folds) in enumerate(cut):
                own = folds.fold == k
                gaps = residual_gaps(replace(members[i], windows=subset(members[i].windows, own)), made, place)
                squares[place][own] = _white_squares(gaps, weigh, folds.block[own])
        return squares

    number = [int(folds.block.max()) + 1 for _, folds in cut]
    log = np.repeat(np.array(kept, dtype=np.float64), number)
    before = left(none)
    gains = {}
    for name, members in variants.items():
        after = left(members)
        blocks = []
        for place, (_, folds) in enumerate(cut):
            sums = np.zeros(number[place])
            np.add.at(sums, folds.block, 0.5 * (before[place] - after[place]))
            blocks.append(sums)
        gains[name] = Gains(np.concatenate(blocks), log)
    return gains


def residual_gaps(member: Member, hull: CampaignHull, place: int) -> Floats:
    """Return the gaps that are left in some windows of a log, shape (J, c), with its hull and effects fitted elsewhere.

    Parameters
    ----------
    member
        With the windows to judge.
    hull, place
        The fit, and the log's place in it.
    """
    h = len(COEFFICIENTS)
    mean = hull.before + hull.spread * hull.step
    force_model = induced(replace(member.plain, hull=mean[:h]), mean[h:])
    return member.windows.gap(apply_candidates(force_model, member.candidates, hull.values[place]))


def _white_squares(gaps: Floats, noise: AutoregressiveNoise, block: NDArray[np.int64]) -> Floats:
    """Return the whitened square of every window; those that only start a block's autoregression count nothing."""
    squares = np.zeros(len(gaps))
    for k in np.unique(block):
        rows = np.flatnonzero(block == k)
        if len(rows) <= ORDER:
            continue
        white = noise.white(gaps[rows], ((0, len(rows)),)).reshape(-1, gaps.shape[1])
        squares[rows[ORDER:]] = np.sum(white**2, axis=1)
    return squares


def turn_heading(candidate: Candidate, psi: Floats) -> Candidate:
    """Return an effect that pushes as if the vessel had had another heading, shape (n,)."""

    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        measurements = force_model.measurements
        other = replace(measurements, eta=np.column_stack([measurements.eta[:, :2], psi]))
        pushed = candidate.effect.apply(replace(force_model, measurements=other), p, instance)
        return replace(force_model, external=pushed.external)

    return replace(candidate, effect=replace(candidate.effect, apply=apply))


def placebos(members: Sequence[Member]) -> dict[str, tuple[Member, ...]]:
    """Return the members with effects that cannot be true: on the mirrored heading, and on that of another log."""
    every = [member.windows.measurements.psi for member in members]
    others = [np.resize(every[(i + 1) % len(every)], len(psi)) for i, psi in enumerate(every)]
    return {
        MIRRORED: tuple(_moved(member, -psi) for member, psi in zip(members, every, strict=True)),
        EXCHANGED: tuple(_moved(member, psi) for member, psi in zip(members, others, strict=True)),
    }


def _moved(member: Member, psi: Floats) -> Member:
    return replace(member, candidates=tuple(turn_heading(candidate, psi) for candidate in member.candidates))
