"""Thresholds of what windows keep, of what rows determine, and of intervals by resampling."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class RegressionThresholds:
    """Regression."""

    least_kept: float = threshold(
        0.5,
        "of the variance",
        "what windows must keep of an axis's velocity, or of the force on it",
        "convention: half; 0.01 and 0.00 in yaw on a boat of a metre that zigzags within two seconds, 0.6 and more on others",
    )
    shorter_keeps: float = threshold(
        0.3,
        "of the variance",
        "what shorter windows must keep of it to be proposed",
        "convention: of white noise at 10 Hz, windows of a second keep 0.23",
    )
    fewest_rows: int = threshold(8, "rows", "fewest rows of a window", "convention: below, its weight is no curve")
    condition_index: float = threshold(
        100.0,
        "-",
        "condition index above which a direction is not determined",
        "convention: Belsley, Kuh and Welsch (1980) call 30 strong and 100 severe",
    )
    variance_share: float = threshold(
        0.5,
        "of a coefficient's variance",
        "share from a weak direction above which a term belongs to it",
        "convention: Belsley, Kuh and Welsch (1980)",
    )
    same_column: float = threshold(
        1e-10, "-", "distance of a correlation from one below which two columns are the same", "derived: rounding"
    )
    null_eigenvalue: float = threshold(
        1e-13,
        "of the largest",
        "eigenvalues of the cross-products below it are rounding",
        "derived: their condition is known up to 3e6 only",
    )
    null_singular: float = threshold(
        1e-14, "of the largest", "singular values of the basis below it are rounding", "derived: double precision"
    )
    condition_for_qr: float = threshold(
        1e3,
        "-",
        "condition of the standardised basis above which rows are factorised by QR",
        "derived: cross-products determine coefficients to 2e-16 times its square",
    )
    fewest_blocks: int = threshold(
        10,
        "blocks",
        "least number in a bootstrap, for which blocks of short logs are shorter than their memory",
        "convention: fewer have no scatter to draw from",
    )
    few_blocks: int = threshold(
        20,
        "blocks",
        "fewer give intervals that are too narrow, and a warning",
        "convention: intervals by fewer undercover",
    )
    most_blocks: int = threshold(
        500,
        "blocks",
        "more are joined to longer ones",
        "convention: more describe the scatter no better; longer are safer",
    )
    paired_block_s: float = threshold(
        30.0, "s", "shortest block of a paired comparison", "convention: longer than errors of a navigation filter last"
    )
    paired_mean_s: float = threshold(
        3.0, "s", "means whose memory gives the length of blocks", "convention: a shorter memory does not matter"
    )
    paired_fewest_blocks: int = threshold(
        8, "blocks", "fewer give no interval", "convention: fewer have no scatter to draw from"
    )
    paired_most_blocks: int = threshold(
        500, "blocks", "more are joined to longer ones", "convention: as in the bootstrap of coefficients"
    )
    paired_level: float = threshold(0.95, "-", "confidence level of a paired comparison", "convention: 95 %")


REGRESSION = RegressionThresholds()
