"""Whether a version may take the place of another: both are replayed on logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import isfinite, pi, sqrt
from typing import Any

from ferryid.compare.candidates import select_candidates
from ferryid.compare.comparison import compare
from ferryid.compare.comparison_result import CommonErrors, ModelPair, Ratio
from ferryid.compare.thresholds import COMPARE
from ferryid.models import Model
from ferryid.types import AXES, RunContext
from ferryid.vessel.profile import Profile

JUDGED_S = (10.0, 30.0, 60.0)
"""Horizons of the free runs that are compared [s]."""


_QUANTITIES = {
    "position_m": ("position", "m", 1.0),
    "heading_rad": ("heading", "deg", 180.0 / pi),
    "yaw_rate_radps": ("yaw rate", "deg/s", 180.0 / pi),
}
"""Name, unit, and factor on SI."""
_FORCE = "force"


@dataclass(frozen=True)
class ReplayRow:
    """Root-mean-square errors of both versions: of what, its unit, and the ratio of new to old with its interval."""

    quantity: str
    unit: str
    new: float
    old: float
    ratio: Ratio

    def to_json(self) -> dict[str, Any]:
        """Return the row as plain values."""
        return asdict(self)


@dataclass(frozen=True)
class Replay:
    """Two versions on the same rows and free runs of logs.

    Attributes
    ----------
    rows
        Errors of free runs; of the force where no free run is possible.
    trained
        Labels of the versions that were trained on one of the logs.
    logs
        Name and sha256 of each log.
    """

    rows: tuple[ReplayRow, ...]
    trained: tuple[str, ...]
    logs: tuple[Mapping[str, str], ...]

    @property
    def decides(self) -> bool:
        """Whether there is any interval: fewer than eight blocks give none, and then nothing is better or worse."""
        return any(isfinite(row.ratio.p) for row in self.rows)

    @property
    def free(self) -> bool:
        """Whether the rows are of free runs."""
        return not any(row.quantity.startswith(_FORCE) for row in self.rows)

    @property
    def worse(self) -> tuple[ReplayRow, ...]:
        """What the new version is worse in by more than chance, whatever the number of rows (Bonferroni)."""
        return tuple(
            row for row in self.rows if row.ratio.low > 1.0 and row.ratio.p * len(self.rows) < COMPARE.replay_level
        )

    @property
    def better(self) -> tuple[ReplayRow, ...]:
        """What it is better in, likewise."""
        return tuple(
            row for row in self.rows if row.ratio.high < 1.0 and row.ratio.p * len(self.rows) < COMPARE.replay_level
        )


def replay_versions(
    new: Model, old: Model, logs: Sequence[str], run: RunContext, vessel: Profile | None = None
) -> Replay:
    """Replay two versions on logs: their free runs from the same starts.

    Raises
    ------
    FerryIdError
        As `compare`.
    """
    field = select_candidates((new.label, old.label), (new, old), vessel)
    # Which version is current is not decided on fewer logs than were named.
    result = compare(field, logs, run, leave_out=False).result
    scope: CommonErrors = result.pooled if result.pooled is not None else result.logs[0]
    pair = _pair(scope.pairs, new.label, old.label)
    known = tuple({"name": log.name, "sha256": log.sha256} for log in result.logs)
    trained = tuple(label for label in (new.label, old.label) if scope.scores[label].trained)
    return Replay(_free_runs(scope, pair) or _forces(scope, pair), trained, known)


def _pair(pairs: Sequence[ModelPair], new: str, old: str) -> ModelPair:
    for pair in pairs:
        if (pair.first, pair.second) == (new, old):
            return pair
        if (pair.first, pair.second) == (old, new):
            return pair.inverse()
    raise AssertionError(f"{new} and {old} are not among the pairs compared")


def _free_runs(scope: CommonErrors, pair: ModelPair) -> tuple[ReplayRow, ...]:
    rows = []
    for h, horizon_s in enumerate(scope.free_run.horizons_s):
        for key, (quantity, unit, factor) in _QUANTITIES.items():
            new, old = (factor * scope.scores[label].free_run[key][h] for label in (pair.first, pair.second))
            ratio = pair.free_run[key][h]
            if horizon_s in JUDGED_S and all(map(isfinite, (new, old, ratio.p))):
                rows.append(ReplayRow(f"{quantity} after {horizon_s:g} s", unit, new, old, ratio))
    return tuple(rows)


def _forces(scope: CommonErrors, pair: ModelPair) -> tuple[ReplayRow, ...]:
    return tuple(
        ReplayRow(
            f"{_FORCE} in {axis}",
            "N·m" if axis == "yaw" else "N",
            sqrt(scope.scores[pair.first].mse[axis]),
            sqrt(scope.scores[pair.second].mse[axis]),
            _root(pair.mse[axis]),
        )
        for axis in AXES
    )


def _root(ratio: Ratio) -> Ratio:
    """Return the ratio of root-mean-square errors from that of the squares; p is of either."""
    return Ratio(sqrt(ratio.value), sqrt(ratio.low), sqrt(ratio.high), ratio.p)
