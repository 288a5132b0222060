"""Whether enough data were held out for a verdict."""

from __future__ import annotations

from ferryid.counts import counted
from ferryid.identify.acceptance import Check
from ferryid.identify.thresholds import IDENTIFY


def held_out_checks(seconds: float, blocks: int, split: str) -> tuple[Check, ...]:
    """Return whether validation data are long enough, and come in enough blocks.

    Parameters
    ----------
    seconds, blocks
        Length of the validation data [s], and number of blocks that they come in, over all logs.
    split
        How they were set apart.
    """
    least_s, least = IDENTIFY.validation_s, IDENTIFY.held_out_blocks
    more = "Fix: give longer logs, or more of them."
    time = f"Held-out data are {seconds:.0f} s long, and {least_s:g} s or more are needed"
    if split == "every-kth":
        found = (
            "Validation rows share smoothing windows with their neighbours that train, so that no block is held out, and "
            f"{least} are needed. Fix: --split blocks"
        )
    else:
        found = f"Held-out data come in {counted(blocks, 'block')}, and {least} or more are needed"
        found += "." if blocks >= least else f": fewer do not show how the error scatters. {more}"
    return (
        Check(
            "held_out_time",
            seconds >= least_s,
            seconds,
            least_s,
            "s",
            f"{time}." if seconds >= least_s else f"{time}. {more}",
        ),
        Check("held_out_blocks", blocks >= least, float(blocks), float(least), "blocks", found),
    )
