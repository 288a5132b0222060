"""A fit in the weak form over every log that was ingested, from the windows that are kept of each: no row is read again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.identify.archived_logs import archived_folders, refuse_other_basis
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.log_windows import LogWindows, WindowPart
from ferryid.identify.outcome import FitOutcome
from ferryid.identify.pipeline import accept_estimate
from ferryid.identify.settings import FitSettings, check_components
from ferryid.identify.some_logs import some_logs
from ferryid.identify.split import validation_blocks
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.window_length import TRAINING_LENGTHS, best_length
from ferryid.identify.window_store import load_windows
from ferryid.identify.windowed_data import WindowedData
from ferryid.regression.bases import Basis, make_basis
from ferryid.side_by_side import over
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile

T = TypeVar("T")
_AT_A_TIME = 16
"""Logs that are read before progress is told again."""


def fit_weak_archive(
    profile: Profile, settings: FitSettings, run: RunContext, names: Sequence[str], name: str
) -> FitOutcome:
    """Fit one correction in the weak form to every log under an output folder; see `ferryid.identify.archive.fit_archive`."""
    if settings.windows_s:
        raise FerryIdError(
            "--window auto: smoothing windows are chosen by sums of the derivative's rows, and the weak form hardly depends "
            "on them. Fix: give --window 1, or --estimator derivative"
        )
    where = archived_folders(run.tables or run.out, profile, names)
    data = _usual(profile, settings, where, run)
    judged = sum(len(one) for one in data.windows.validation)
    if judged < IDENTIFY.fewest_judged:
        raise FerryIdError(
            f"{data.where}: too little for validation in the weak form, found {counted(len(data.logs), 'log')} with "
            f"{counted(judged, 'overlapping validation window')} of {data.windows.length_s:.3g} s. "
            "Fix: ingest more or longer logs, or give --estimator derivative"
        )
    data = (
        _with_best_length(data, where, run)
        if settings.weak_window_s is None
        else _of_length(data, where, settings.weak_window_s, run)
    )
    run.progress("fitting")
    data.refuse_contradictions()
    estimate = estimate_correction(data, data.components(), settings.draws, run.progress)
    return accept_estimate(data, estimate, name, run)


def _usual(profile: Profile, settings: FitSettings, where: Sequence[Path], run: RunContext) -> WindowedData:
    """Return the data with windows of the usual length."""
    usual = replace(settings, weak_window_s=None)
    logs, functions = archived_windows(where, profile, usual, run.progress, divided=settings.split == "blocks")
    check_components(settings.components, functions)
    trained, validated = _divided(logs, settings.split)
    # The data hold the parts themselves: those that another length replaces are let go.
    bare = [replace(log, parts=()) for log in logs]
    return WindowedData.of(profile, settings, functions, bare, trained, validated)


def _with_best_length(data: WindowedData, where: Sequence[Path], run: RunContext) -> WindowedData:
    """Return the data with training windows of the length that tells most, of some of the logs where there are many."""
    places = some_logs([len(part.measured) for part in data.trained])
    some = data.of_logs(places)
    candidates = {1.0: some}
    for share in TRAINING_LENGTHS[1:]:
        candidates[share] = _of_length(some, [where[place] for place in places], share * data.windows.length_s, run)
    best = best_length(candidates)
    if best is some:
        return data
    return best if len(places) == len(where) else _of_length(data, where, best.windows.training_length_s, run)


def _of_length(data: WindowedData, where: Sequence[Path], length_s: float, run: RunContext) -> WindowedData:
    """Return the data with training windows of another length [s]."""
    settings = replace(data.settings, weak_window_s=length_s)
    divided = data.settings.split == "blocks"
    trained = [
        one if one.rows and before.rows else one.none()
        for one, before in zip(
            _read(where, data.profile, settings, run.progress, divided, lambda log: log.parts[0]),
            data.trained,
            strict=True,
        )
    ]
    return replace(data, trained=tuple(trained), training_s=length_s)


def archived_windows(
    where: Sequence[Path],
    profile: Profile,
    settings: FitSettings,
    progress: Callable[[str], None],
    *,
    divided: bool,
) -> tuple[tuple[LogWindows, ...], Basis]:
    """Return the windows of every log, and the basis that they share.

    Raises
    ------
    FerryIdError
        For a log of another basis, by name.
    """
    logs = _read(where, profile, settings, progress, divided, lambda log: log)
    return tuple(logs), make_basis(logs[0].basis, structure=settings.structure)


def _read(
    where: Sequence[Path],
    profile: Profile,
    settings: FitSettings,
    progress: Callable[[str], None],
    divided: bool,
    keep: Callable[[LogWindows], T],
) -> list[T]:
    """Return what is kept of the windows of every log."""
    first: LogWindows | None = None
    kept: list[T] = []
    for low in range(0, len(where), _AT_A_TIME):
        progress(f"adding log {low + 1} of {len(where)}")
        some = where[low : low + _AT_A_TIME]
        logs = over(lambda folder: load_windows(folder, profile, settings, divided=divided), some)
        first = first or logs[0]
        for log in logs:
            refuse_other_basis((first.name, first.basis), (log.name, log.basis))
        kept += [keep(log) for log in logs]
    return kept


def _divided(logs: Sequence[LogWindows], split: str) -> tuple[list[WindowPart], list[WindowPart]]:
    """Return training and validation parts of every log."""
    whole = validation_blocks(len(logs)) if split == "logs" else np.zeros(len(logs), dtype=bool)
    trained, validated, short = [], [], 0
    for number, log in enumerate(logs):
        one = log.whole
        if one is None:
            train, held_out = log.parts
        else:
            validates = bool(whole[number])
            if split != "logs":
                # A log too short for blocks of its own is one block among those of its kind.
                short += 1
                validates = short % IDENTIFY.validates_every == 2
            train, held_out = (one.none(), one) if validates else (one, one.none())
        trained.append(train)
        validated.append(held_out)
    return trained, validated
