"""An estimate with its interval, and the names of the axes."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str

    @classmethod
    def normal(cls, value: float, error: float, unit: str, lowest: float = -inf, highest: float = inf) -> Estimate:
        """Return an estimate whose error is normal, with this standard deviation.

        Its interval ends at the lowest and highest possible values, as no time constant is negative; the value is in it.
        """
        low, high = max(value - 1.96 * error, lowest), min(value + 1.96 * error, highest)
        return cls(value, min(low, value), max(high, value), unit)

    @property
    def digits(self) -> int:
        """Decimals that the interval supports, of three digits without one; a whole number has none."""
        width = self.high - self.low
        if width == 0.0 and float(self.value).is_integer():
            return 0
        if isfinite(width) and width > 0.0:
            return min(max(1 - _exponent(width), 0), 6)
        return min(max(2 - _exponent(self.value), 0), 6) if isfinite(self.value) else 0

    @property
    def error(self) -> float:
        """Standard error of a normal distribution with this interval; 0 where it has none."""
        half = 0.5 * (self.high - self.low)
        return half / 1.96 if isfinite(half) and isfinite(self.value) else 0.0


def _exponent(value: float) -> int:
    return int(f"{value:e}".partition("e")[2])
