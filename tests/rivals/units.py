"""The units of work of the comparison of estimators, which processes of a pool import: those of a main module they cannot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.rivals.packing import packed
from tests.rivals.recorded import CASES, Case, recorded
from tests.rivals.second_logs import cases, try_case
from tests.rivals.simulated import KINDS, Kind, try_one

SECOND = "second log, case "
Unit = tuple[str, Callable[..., Any], tuple[Any, ...]]
"""Name of a unit of work, and what does it."""


def units(trials: int, second: int, folder: Path) -> list[Unit]:
    """Return all units of work: recordings, then the first trial of every kind, the second, and so on, then second logs."""
    every: list[Unit] = [(case.name, recorded_unit, (case,)) for case in CASES]
    every += [(trial_name(kind, seed), trial_unit, (kind, seed, folder)) for seed in range(trials) for kind in KINDS]
    every += [(f"{SECOND}{case.name}", try_case, (case, folder / "second")) for case in cases()[:second]]
    return every


def trial_name(kind: Kind, seed: int) -> str:
    """Return the name of the unit of a trial."""
    return f"{kind.name}, trial {seed}"


def trial_unit(kind: Kind, seed: int, folder: Path) -> list[dict[str, Any]]:
    """Return what the methods and the variants find in a trial, as plain values."""
    return [packed(one) for one in try_one(kind, seed, folder)]


def recorded_unit(case: Case) -> dict[str, Any] | None:
    """Return what comes of a set of recordings, as plain values; None where they are absent."""
    one = recorded(case)
    return None if one is None else one.plain()
