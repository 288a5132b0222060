"""Thresholds of stored models: where they are valid, and from where they run free."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class ModelThresholds:
    """Models."""

    range_quantiles: tuple[float, ...] = threshold(
        (0.005, 0.995),
        "-",
        "quantiles of the training rows that are the ends of a range of validity",
        "convention: 99 % of the rows, without outliers",
    )
    leap_mps: float = threshold(
        5.0,
        "m/s",
        "speed, above twice the greatest measured one, at which a position has jumped and no free run passes",
        "convention: beyond noise of positions at any rate of a navigation",
    )


MODELS = ModelThresholds()
