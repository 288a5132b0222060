"""Whether conditions that several logs are given beside a common hull hold on stretches that neither was fitted to.

A steady wind moves a vessel by little against the rest of a single log, too little to prove it there; the same kind of wind in
many logs, with one hull for all of them, can be proved together. Blocks of every log are held out in turn, everything is
estimated from the rest of all logs, and the gain is summed over blocks. Conditions that cannot be true, on headings that the
vessel did not have, are estimated in their place: what they gain is what any two more parameters would.

A block is held out by an update of the normal equations at the estimate, which is exact where the gaps are linear in what is
estimated; spreads and noise are those of all logs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ferryid.diagnose.inference.campaign_estimation import CampaignFit, believed_squares
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.candidate import Candidate, OtherHeading
from ferryid.diagnose.inference.folds import draws
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.side_by_side import over
from ferryid.types import Floats, Ints

MIRRORED, EXCHANGED, SHIFTED = "the heading mirrored", "another log's heading", "the heading at other times"


@dataclass(frozen=True)
class HeldOutLoss:
    """Loss of held-out blocks, shape (blocks,), the log of each, and the errors of every log's windows.

    The loss is twice the negative logarithm of the density that the rest predicts of a block, but for a constant: squares of
    its errors over the variance of noise and estimate together, and the logarithm of this variance. That of a block of which
    the rest predicts nothing is NaN. The errors are accelerations along the vessel's axes, shape (J, 3) for each log; what
    the rest cannot predict of a block shows none.
    """

    blocks: Floats
    log: Ints
    errors: tuple[Floats, ...]

    def gain(self, over: HeldOutLoss) -> Floats:
        """Return how much log-likelihood each block gains over another hypothesis, shape (blocks,).

        A block that the rest cannot predict under either of them gains nothing.
        """
        return np.nan_to_num(0.5 * (over.blocks - self.blocks), nan=0.0)


def interval(gains: Floats) -> tuple[float, float]:
    """Return the 95 % block-bootstrap interval of a sum of gains, shape (blocks,)."""
    low, high = np.quantile(draws(np.arange(len(gains))) @ gains, [0.025, 0.975])
    return float(low), float(high)


@dataclass(frozen=True)
class Gain:
    """Log-likelihood of held-out blocks gained, all blocks together [nat], with its 95 % block-bootstrap interval."""

    total: float
    low: float
    high: float

    @classmethod
    def of(cls, blocks: Floats) -> Gain:
        """Return the gain of some blocks, shape (blocks,)."""
        return cls(float(blocks.sum()), *interval(blocks))


def held_out_loss(made: CampaignFit) -> HeldOutLoss:
    """Return what an estimate leaves of every block if it does not know this block and what overlaps with it."""
    lines = made.campaign.linearised(made.common, made.own)
    found = over(lambda i: _log_loss(made, i, *lines[i]), range(len(made.parts)))
    log = np.repeat(np.arange(len(found)), [len(losses) for losses, _ in found])
    return HeldOutLoss(np.concatenate([one for one, _ in found]), log, tuple(errors for _, errors in found))


def _log_loss(made: CampaignFit, i: int, gaps: Floats, slopes: Floats) -> tuple[Floats, Floats]:
    """Return `HeldOutLoss.blocks` and `errors` of a log, by its gaps and their slopes."""
    part, windows, errors = made.parts[i], made.campaign.members[i].windows, gaps.copy()
    C = made.covariance(i)
    losses = []
    for block, near in held_out_blocks(windows):
        J, w = part.slopes[near].reshape(-1, C.shape[0]), part.gaps[near].ravel()
        shares, along = np.linalg.eigh(np.eye(len(w)) - J @ C @ J.T)
        # A combination of the errors that this block alone determines is not predicted: the prior would be judged by it.
        predicted = shares >= JUDGING.least_predicted
        if not predicted.any():
            losses.append(np.nan)
            continue
        along, known = along[:, predicted], shares[predicted]
        taken = C @ (J.T @ along)
        shift = taken @ ((along.T @ w) / known)
        of_block = part.slopes[block].reshape(-1, C.shape[0])
        left = part.gaps[block].ravel() + of_block @ shift
        # What the rest does not know of the block, such as the wind of a log that is held out as a whole, is no error of it.
        open_ = of_block @ taken
        variance = np.eye(len(left)) + of_block @ C @ of_block.T + (open_ / known) @ open_.T
        values, axes = np.linalg.eigh(variance)
        # Noise alone makes one: less is rounding.
        values = np.maximum(values, 1.0)
        losses.append(float(np.sum((axes.T @ left) ** 2 / values) + np.sum(np.log(values))))
        errors[block] += slopes[block] @ shift
    return np.array(losses), errors


def held_out_blocks(windows: Windows) -> Iterator[tuple[slice, slice]]:
    """Yield each block of a log that is held out, and the windows about it that know it.

    Windows overlap, and the noise's colour reaches back: those within a window's length know the block.
    """
    stride = max(1, int(np.median(np.diff(windows.starts)))) if len(windows.starts) > 1 else 1
    purge = -(-len(windows.weight) // stride)
    length = max(1, round(INFERENCE.block_windows * len(windows.weight) / stride))
    for first, end in windows.runs:
        count = max(1, round((end - first) / length))
        edges = np.linspace(first, end, count + 1).round().astype(int).tolist()
        for begin, stop in pairwise(edges):
            yield slice(begin, stop), slice(max(first, begin - purge), min(end, stop + purge))


def imitated_share(made: CampaignFit, none: CampaignFit, other: CampaignFit, rows: Sequence[int]) -> float:
    """Return the share of what a condition explains that another would explain too, if the condition is what acts.

    What the condition changes in the gaps, and nothing else, takes the place of the logs; hull and steady forces take up what
    they can of it, and either condition what it can beside them.

    Parameters
    ----------
    made, none, other
        The logs with the condition, without it, and with the other in its place, under one noise.
    rows
        Which parameters of a log's own conditions are the condition's.
    """
    campaign, still = made.campaign, made.own.copy()
    still[:, rows] = -made.common[campaign.means][rows]
    pairs = zip(campaign.gaps(made.common, made.own), campaign.gaps(made.common, still), strict=True)
    signals = [
        made.noise.white(i, there - without, campaign.members[i].windows.runs)
        for i, (there, without) in enumerate(pairs)
    ]
    alone, itself, instead = (_left(one, signals) for one in (none, made, other))
    return (alone - instead) / max(alone - itself, 1e-12)


def _left(fit: CampaignFit, signals: Sequence[Floats]) -> float:
    """Return what is left of whitened changes of the gaps, shape (J, 3) of each log, with what departs for it, squared."""
    parts = tuple(replace(part, gaps=one) for part, one in zip(fit.parts, signals, strict=True))
    begun = replace(fit, common=np.zeros_like(fit.common), own=np.zeros_like(fit.own), parts=parts)
    step, own = begun.normal.step(begun.common)
    left = believed_squares(fit.campaign, fit.spreads, step, own)
    for part, mine in zip(parts, own, strict=True):
        left += float(np.sum((part.gaps + part.slopes @ np.concatenate([step, mine])) ** 2))
    return left


def placebos(
    campaign: Campaign, effect: str, among: Sequence[str] = (MIRRORED, EXCHANGED, SHIFTED)
) -> dict[str, Campaign]:
    """Return the campaign with a condition that cannot be true: on the mirrored heading, on that of another log, or on a log's
    own half of its length away.

    Headings that are all but the vessel's own, as those of logs of one manoeuvre, make none; nor do those of another log that
    differ by the same angle all along, as in turning circles: from another side, the condition is the same on them.
    """
    every = [member.windows.measurements.psi for member in campaign.members]
    others = [np.resize(every[(i + 1) % len(every)], len(psi)) for i, psi in enumerate(every)]
    later = [np.roll(psi, len(psi) // 2) for psi in every]
    headings = {MIRRORED: [-psi for psi in every], EXCHANGED: others, SHIFTED: later}
    turns = {name: _turn(every, found, steady=name != MIRRORED) for name, found in headings.items()}
    return {name: _turned(campaign, effect, headings[name]) for name in among if turns[name] > JUDGING.placebo_turn}


def _turn(headings: Sequence[Floats], others: Sequence[Floats], *, steady: bool = False) -> float:
    """Return how far headings of several logs [rad] point away from others, root mean square [deg].

    With `steady`, but for the angle of each log by which they do so on average.
    """
    each = [one - other for one, other in zip(headings, others, strict=True)]
    if steady:
        each = [one - np.angle(np.nanmean(np.exp(1j * one))) for one in each]
    apart = np.concatenate(each)
    away = (apart[np.isfinite(apart)] + np.pi) % (2.0 * np.pi) - np.pi
    return float(np.degrees(np.sqrt(np.mean(away**2)))) if away.size else 0.0


def _turned(campaign: Campaign, effect: str, headings: Sequence[Floats]) -> Campaign:
    members = tuple(
        replace(
            member,
            conditions=tuple(turned(one, psi) if one.effect.id == effect else one for one in member.conditions),
        )
        for member, psi in zip(campaign.members, headings, strict=True)
    )
    return replace(campaign, members=members)


def turned(candidate: Candidate, psi: Floats) -> Candidate:
    """Return a condition that acts as if the vessel had had another heading, shape (n,)."""
    return replace(candidate, heading=OtherHeading(psi))


def without_conditions(campaign: Campaign) -> Campaign:
    """Return the campaign without any condition."""
    return with_conditions(campaign, frozenset())


def with_conditions(campaign: Campaign, effects: frozenset[str]) -> Campaign:
    """Return the campaign with the conditions of some effects alone."""

    def kept(member: Member) -> Member:
        return replace(member, conditions=tuple(one for one in member.conditions if one.effect.id in effects))

    return replace(campaign, members=tuple(kept(member) for member in campaign.members))
