"""Blocks that are long enough for the windows in which models are judged.

Windows go by the length of a vessel. Of a ship they are longer than the usual blocks, and there is none within a held-out
block: the fit would then be judged by force errors row by row, which are noise for the most part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ferryid.counts import counted
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import Split, TooShort, split_rows
from ferryid.identify.thresholds import IDENTIFY
from ferryid.regression import window_rows, window_starts
from ferryid.signals.track import Motion, segments
from ferryid.types import Flags
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile


def judged_split(motions: Sequence[Motion], profile: Profile, settings: FitSettings, window_s: float) -> Split:
    """Return which rows train and validate, in longer blocks where no model could be judged in the usual ones.

    Parameters
    ----------
    motions
        Logs.
    profile, settings
        Vessel, and how to fit.
    window_s
        Length of the smoothing window [s].

    Raises
    ------
    FerryIdError
        As `split_rows`.
    """
    usual = split_rows(motions, settings.split, window_s=window_s)
    length_s = window_seconds(profile)
    if settings.split != "blocks" or settings.by_thesis:
        return usual
    if _windows(usual.validation, motions, length_s) >= IDENTIFY.fewest_judged:
        return usual
    shortest_s = IDENTIFY.block_windows * length_s
    try:
        longer = split_rows(motions, "blocks", window_s=window_s, shortest_s=shortest_s)
    except TooShort:
        return usual
    if _windows(longer.validation, motions, length_s) < IDENTIFY.fewest_judged:
        return usual
    if _windows(longer.training, motions, length_s) < IDENTIFY.fewest_windows:
        return usual
    note = f"Blocks are {shortest_s:.3g} s or longer, or whole logs, as predictions are judged in windows of {length_s:.3g} s."
    return replace(longer, notes=(*longer.notes, note))


def judged_by_force(parts: Split, motions: Sequence[Motion], profile: Profile) -> str:
    """Return why held-out rows are too few for the windows in which models are judged, as a sentence with its remedy."""
    length_s = window_seconds(profile)
    count = _windows(parts.validation, motions, length_s)
    whole = "--split logs, which holds out whole logs, or " if len(motions) > 1 and parts.kind == "blocks" else ""
    return (
        f"The verdict is on force errors row by row, not on prediction errors: held-out data hold {counted(count, 'window')} "
        f"of {length_s:.3g} s, and {IDENTIFY.fewest_judged} are needed. Noise of the acceleration is most of a force "
        f"error, which says little of what the model predicts. Fix: {whole}give longer logs."
    )


def _windows(masks: Sequence[Flags], motions: Sequence[Motion], length_s: float) -> int:
    return sum(
        len(window_starts(segments(mask), window_rows(length_s, motion.rate_hz))[0])
        for mask, motion in zip(masks, motions, strict=True)
    )
