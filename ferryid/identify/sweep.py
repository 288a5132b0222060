"""Settings swept: cross-validated error of every smoothing window and component count, and which to choose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ferryid.identify.choose import (
    Choice,
    Studied,
    choose,
    folds_by_blocks,
    folds_by_logs,
)
from ferryid.identify.settings import FitSettings
from ferryid.vessel.profile import Profile

KINDS = ("components", "window", "both")
SCHEMA = "ferryid.sweep/1"


@dataclass(frozen=True)
class Swept:
    """Cross-validation of logs over windows and component counts.

    Attributes
    ----------
    windows_s
        Windows [s] that were tried.
    by_blocks, by_logs
        What contiguous stretches of every log say, and what whole logs say; None where there are fewer than two logs.
    """

    windows_s: tuple[float, ...]
    by_blocks: Choice
    by_logs: Choice | None


def swept(
    profile: Profile, settings: FitSettings, windows_s: Sequence[float], logs: Sequence[Studied], basis: Any
) -> Swept:
    """Cross-validate logs of which the pieces are known; arguments are those of `ferryid.identify.choose.choose`."""
    blocks = choose(profile, settings, basis, windows_s, logs, folds_by_blocks(logs))
    whole = choose(profile, settings, basis, windows_s, logs, folds_by_logs(logs)) if len(logs) > 1 else None
    return Swept(tuple(windows_s), blocks, whole)
