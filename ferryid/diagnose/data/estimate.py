"""An estimate with its interval, and the names of the axes."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str

    @classmethod
    def normal(cls, value: float, error: float, unit: str) -> Estimate:
        """Return an estimate whose error is normal, with this standard deviation."""
        return cls(value, value - 1.96 * error, value + 1.96 * error, unit)
