"""Thresholds of statements on which of two models is better."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class CompareThresholds:
    """Comparison."""

    alike: float = threshold(
        0.005,
        "of the mean square",
        "difference below which two models are alike, however certain",
        "convention: half a per cent, too little to prefer one",
    )
    significance: float = threshold(
        0.05, "-", "probability by chance, corrected for all comparisons, below which one is better", "convention: 5 %"
    )
    maybe: float = threshold(
        0.5,
        "-",
        "corrected probability up to which what is significant by itself may be a difference",
        "convention: an even chance",
    )
    statement_s: float = threshold(
        30.0, "s", "longest horizon of free runs of which statements are made", "convention: a manoeuvre"
    )
    diverged: float = threshold(
        0.1, "of the free runs", "that may diverge in a comparison", "convention: a tenth; means of the others flatter"
    )
    outside: float = threshold(
        0.05, "of the rows", "outside a range of validity above which a warning is given", "convention: five per cent"
    )
    replay_level: float = threshold(
        0.05,
        "-",
        "probability by chance of a ratio between two versions, over the number of ratios, below which one counts as worse",
        "convention: 5 % (Bonferroni)",
    )


COMPARE = CompareThresholds()
