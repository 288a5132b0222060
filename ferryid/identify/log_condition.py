"""What is told of the conditions that single logs have of their own besides wind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ferryid.identify.thresholds import IDENTIFY
from ferryid.types import Floats


@dataclass(frozen=True, eq=False)
class LogCondition:
    """A condition of one log, estimated with the hull.

    Attributes
    ----------
    log
        Name of the log.
    kind, title
        The kind of condition, by its name in files and in texts.
    names, units
        Of its parameters.
    values, covariance
        What the log has of it, shape (q,) and (q, q).
    """

    log: str
    kind: str
    title: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Floats
    covariance: Floats

    @property
    def standard_error(self) -> Floats:
        """Standard error of every parameter, shape (q,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def significant(self) -> bool:
        """Whether it differs from none."""
        # A tenth of a second to import: only where it is needed.
        from scipy.special import chdtri

        size = float(self.values @ np.linalg.solve(self.covariance, self.values))
        return size > float(chdtri(len(self.values), IDENTIFY.condition_level))

    def __str__(self) -> str:
        if not self.significant:
            return f"{self.log}: not distinguishable from zero"
        reach = 1.96 * self.standard_error
        each = zip(self.names, self.values, self.values - reach, self.values + reach, self.units, strict=True)
        told = ", ".join(f"{name} {at:.3g} ({low:.3g} to {high:.3g}) {unit}" for name, at, low, high, unit in each)
        return f"{self.log}: {told}"

    def to_json(self) -> dict[str, Any]:
        """Return its parameters as plain values."""
        each = zip(self.names, self.values.tolist(), self.standard_error.tolist(), self.units, strict=True)
        return {name: {"value": value, "standard_error": error, "unit": unit} for name, value, error, unit in each}


@dataclass(frozen=True)
class KindOutcome:
    """What speaks for a kind of condition.

    Attributes
    ----------
    kind, title
        The kind, by its name in files and in texts.
    included
        Whether it takes part in the estimate.
    reason
        Why it does, or not, as the end of a sentence.
    spread
        Standard deviation of each parameter between logs with its unit, by the parameter's name; empty where none was tried.
    evidence
        Logarithm of the marginal likelihood over that of none [nat].
    """

    kind: str
    title: str
    included: bool
    reason: str
    spread: tuple[tuple[str, float, str], ...] = ()
    evidence: float = float("nan")

    def __str__(self) -> str:
        return f"{self.title}: {'' if self.included else 'not estimated, as '}{self.reason}"

    def to_json(self) -> dict[str, Any]:
        """Return it as plain values."""
        return {
            "kind": self.kind,
            "included": self.included,
            "reason": self.reason,
            "evidence": self.evidence if np.isfinite(self.evidence) else None,
            "spread": {name: {"value": value, "unit": unit} for name, value, unit in self.spread},
        }


def conditions_json(winds: Sequence[Any], conditions: Sequence[LogCondition]) -> list[dict[str, Any]]:
    """Return all conditions that were estimated, one entry a log."""
    logs: dict[str, dict[str, Any]] = {one.log: one.to_json() for one in winds}
    for one in conditions:
        logs.setdefault(one.log, {"log": one.log})[one.kind] = one.to_json()
    return list(logs.values())
