"""Settings swept: cross-validated error of every smoothing window and component count, and which to choose."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.effects.wording import listed
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identify.archive import archive_folds
from ferryid.identify.basis import Basis
from ferryid.identify.cautions import of_logs
from ferryid.identify.choose import (
    Choice,
    Studied,
    choose,
    folds_by_blocks,
    folds_by_logs,
    force_free,
    studied,
    tried,
)
from ferryid.identify.crossed import FOLDS, TEST_WINDOW_S, Folds
from ferryid.identify.model import AXES
from ferryid.identify.rows import basis_of
from ferryid.identify.settings import WINDOWS_S, FitSettings
from ferryid.signals.prepare import Opened, open_track, refuse_twice
from ferryid.signals.smooth import smooth_measured
from ferryid.vessel.profile import Profile

KINDS = ("components", "window", "both")
Flags = NDArray[np.bool_]

SCHEMA = "ferryid.sweep/1"
BY = {"blocks": "contiguous stretches of every log", "logs": "whole logs"}


@dataclass(frozen=True)
class Sweep:
    """What a sweep found.

    Attributes
    ----------
    what
        One of `KINDS`.
    vessel, logs
        Name of the vessel; of each log its name, SHA-256, seconds, rows and warnings.
    settings
        How was fitted; its basis is the one that all logs allow.
    windows_s
        Windows that were tried [s].
    by
        Cross-validation by contiguous stretches of every log (``"blocks"``) and, of several logs, by whole ones (``"logs"``).
    notes
        What a reader must know, as sentences.
    """

    what: str
    vessel: str
    logs: tuple[Mapping[str, Any], ...]
    settings: FitSettings
    windows_s: tuple[float, ...]
    by: Mapping[str, Choice]
    notes: tuple[str, ...]

    @property
    def choice(self) -> Choice:
        """What to fit with: the choice by stretches, which every set of logs has."""
        return self.by["blocks"]


def sweep(
    what: str,
    logs: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    out: Path,
    *,
    windows_s: Sequence[float] = (),
    folds: int = FOLDS,
    archive: bool = False,
    progress: Callable[[str], None],
) -> Sweep:
    """Cross-validate logs over smoothing windows and component counts.

    Parameters
    ----------
    what
        ``"components"``: at the settings' window. ``"window"``: at the settings' component count, or the best of each
        window. ``"both"``: every combination.
    logs
        Paths; parts of one recording joined by ``+``.
    profile, settings
        The vessel and how to fit.
    out
        Output folder, whose ``logs`` keep the ingested tables.
    windows_s
        Windows to try [s]; the usual ones where none is given.
    folds
        Number of folds by stretches, 2 to 20.
    archive
        True: take what is kept of the logs that were ingested to `out`, all of them where `logs` is empty.
    progress
        Called with the name of each stage.

    Raises
    ------
    FerryIdError
        For input that cannot be used, with file, cause and remedy.
    """
    if what not in KINDS:
        raise FerryIdError(
            f'sweep: there is nothing called "{what}" to sweep.{did_you_mean(what, (*KINDS, "basis"))} Fix: choose one of '
            f"{', '.join(KINDS)} or basis"
        )
    check_folds(folds)
    if what == "components" and windows_s:
        raise FerryIdError("--windows: components are swept at one window. Fix: give --window, or sweep both")
    if what != "components" and settings.smoother == "kalman":
        raise FerryIdError(
            "--smoother: the Kalman smoother finds its window by likelihood, so that windows cannot be swept. "
            "Fix: sweep components, or take another --smoother"
        )
    settings = replace(settings, windows_s=tuple(windows_s)).on(profile)
    if what != "window":
        settings = replace(settings, components="auto")
    fixed = (settings.window_s,) if what == "components" else tuple(windows_s)
    if archive:
        windows = fixed or WINDOWS_S
        functions, free, cuts, told = archive_folds(profile, settings, out, windows, logs, folds, progress)
    else:
        windows, functions, free, cuts, told = _from_logs(logs, profile, settings, out, fixed, folds, progress)
    if what != "components" and len(windows) < 2:
        raise FerryIdError(
            f"{told[0]['name']}: nothing to compare, as all windows come to {windows[0]:g} s at this log's rate. "
            "Fix: give --windows that are apart, or a higher --rate"
        )
    progress("cross-validating")
    by = {
        key: choose(profile, settings, functions, windows, cut, free, where=str(told[0]["name"]))
        for key, cut in cuts.items()
    }
    return Sweep(
        what,
        profile.name,
        tuple(told),
        replace(settings, basis=functions.name),
        windows,
        by,
        (*_notes(by, windows, settings), *of_logs([(log["name"], log["warnings"]) for log in told])),
    )


def _from_logs(
    logs: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    out: Path,
    windows_s: Sequence[float],
    folds: int,
    progress: Callable[[str], None],
) -> tuple[tuple[float, ...], Basis, Flags, dict[str, Folds], list[dict[str, Any]]]:
    """Return windows, basis, axes without force, folds by stretches and whole logs, and what is told of the logs."""
    opened = read_logs(logs, profile, settings, out, progress)
    windows = tried(windows_s, [one.measured for one in opened])
    functions = basis_of(settings, [smooth_measured(one.measured, TEST_WINDOW_S) for one in opened])
    pieces = []
    for one in opened:
        progress(f"cutting {one.recording.name} into pieces")
        pieces.append(studied(profile, settings, functions, one.measured, windows, blocks=folds))
    cuts = {"blocks": folds_by_blocks(pieces, folds)} | ({"logs": folds_by_logs(pieces)} if len(pieces) > 1 else {})
    told = [log_json(one, log) for one, log in zip(opened, pieces, strict=True)]
    return windows, functions, force_free(pieces), cuts, told


def check_folds(folds: int) -> None:
    """Refuse what is no number of folds."""
    if not 2 <= folds <= 20:
        raise FerryIdError(f"--folds: {folds} is no number of folds. Fix: give 2 to 20, {FOLDS} is usual")


def read_logs(
    logs: Sequence[str], profile: Profile, settings: FitSettings, out: Path, progress: Callable[[str], None]
) -> list[Opened]:
    """Return several logs before smoothing, each once; arguments and errors are those of `sweep`."""
    opened = []
    for path in logs:
        progress(f"reading {Path(path).name}")
        opened.append(open_track(path, profile, out, rate_hz=settings.rate_hz))
    refuse_twice(opened)
    return opened


def log_json(one: Opened, log: Studied) -> dict[str, Any]:
    """Return name, hash, length and warnings of a log."""
    rows = int(log.test.n.sum())
    return {
        "name": one.recording.name,
        "sha256": one.recording.sha256,
        "seconds": rows / one.measured.rate_hz,
        "rows": rows,
        "warnings": [*one.doubts, *one.left_out],
    }


def _notes(by: Mapping[str, Choice], windows_s: Sequence[float], settings: FitSettings) -> list[str]:
    notes = []
    blocks, logs = by["blocks"], by.get("logs")
    if logs is not None and (blocks.window_s, blocks.components) != (logs.window_s, logs.components):
        notes.append(
            f"By whole logs the choice is {_told(logs)}. Take it where the model is for other days than those of these logs."
        )
    for key, one in by.items():
        if one.held.any():
            axes = listed([axis for axis, held in zip(AXES, one.held, strict=True) if held])
            notes.append(f"By {BY[key]} the base model's inertia was held in {axes}, as a fit does.")
        if one.curves.folds < FOLDS:
            notes.append(
                f"Only {counted(one.curves.folds, 'fold')} by {BY[key]}: their scatter, and so the choice, is rough."
            )
    if len(windows_s) > 1 and blocks.window_s in (windows_s[0], windows_s[-1]):
        end = "shortest" if blocks.window_s == windows_s[0] else "longest"
        notes.append(f"The window chosen is the {end} that was tried.")
    if settings.residual != "measured":
        notes.append(f"Fitted to the {settings.residual} residual, tested against measured force.")
    return notes


def _told(choice: Choice) -> str:
    return f"{counted(choice.components, 'component')} at a window of {choice.window_s:g} s"


def sweep_json(found: Sweep, report: str | None = None) -> dict[str, Any]:
    """Return a sweep in the form of schema ``ferryid.sweep/1``."""
    return {
        "schema": SCHEMA,
        "what": found.what,
        "vessel": found.vessel,
        "logs": [dict(log) for log in found.logs],
        "settings": {**found.settings.plain(), **found.settings.scale},
        "windows_s": list(found.windows_s),
        "components": list(range(1, found.choice.curves.mse.shape[1] + 1)),
        "test_window_s": TEST_WINDOW_S,
        "by": {key: _choice_json(choice) for key, choice in found.by.items()},
        "choice": {"window_s": found.choice.window_s, "components": found.choice.components},
        "notes": list(found.notes),
        "report": report,
    }


def _choice_json(choice: Choice) -> dict[str, Any]:
    curves = choice.curves
    score, band = curves.normalised()
    axes = list(enumerate(AXES))
    return {
        "folds": curves.folds,
        "rows": curves.rows,
        "base_mse": {axis: float(curves.base[j]) for j, axis in axes},
        "mse": {axis: curves.mse[:, :, j].tolist() for j, axis in axes},
        "standard_error": {axis: curves.standard_error[:, :, j].tolist() for j, axis in axes},
        "score": score.tolist(),
        "score_standard_error": band.tolist(),
        "choice": {"window_s": choice.window_s, "components": choice.components},
        "held_inertia": [axis for j, axis in axes if choice.held[j]],
    }


def render_sweep(found: Sweep) -> str:
    """Return a sweep for a terminal."""
    lines = [headline(found), ""]
    for key, choice in found.by.items():
        title = f"by {BY[key]}, {counted(choice.curves.folds, 'fold')}, {counted(choice.curves.rows, 'row')}"
        lines += [title, *(_matrix(found, choice) if found.what == "both" else _table(found, choice)), ""]
    lines += [f"note: {note}" for note in found.notes]
    return "\n".join(lines).rstrip()


def headline(found: Sweep) -> str:
    """Return the choice in one sentence."""
    choice = found.choice
    ratio = choice.over_base[choice.window, choice.components - 1]
    told = ", ".join(f"{axis} {value:.3g}" for axis, value in zip(AXES, ratio, strict=True) if np.isfinite(value))
    return f"Choice: {_told(choice)}. Cross-validated force MSE over the base model's: {told}."


def _table(found: Sweep, choice: Choice) -> list[str]:
    """Return a line for each component count, or for each window: MSE per axis over the base model's, and the score."""
    score, band = choice.curves.normalised()
    windows, counts = range(len(found.windows_s)), range(score.shape[1])
    if found.what == "window":
        cells = [(window, choice.components - 1, f"{found.windows_s[window]:g} s") for window in windows]
    else:
        cells = [(choice.window, count, f"{count + 1}") for count in counts]
    title = "window" if found.what == "window" else "components"
    lines = [f"  {title:<12}" + "".join(f"{axis:>10}" for axis in AXES) + f"{'score':>10}"]
    for window, count, name in cells:
        ratios = "".join(f"{value:>10.4g}" for value in choice.over_base[window, count])
        chosen = (window, count) == (choice.window, choice.components - 1)
        lines.append(
            f"{'*' if chosen else ' '} {name:<12}{ratios}{score[window, count]:>10.4f} ± {band[window, count]:.4f}"
        )
    lines.append("  axes: MSE over the base model's; score: each axis over its least MSE, mean; * the choice")
    return lines


def _matrix(found: Sweep, choice: Choice) -> list[str]:
    """Return a line for each component count, a column for each window."""
    score, band = choice.curves.normalised()
    best = np.unravel_index(int(np.argmin(score)), score.shape)
    near = score <= score[best] + band[best]
    lines = ["  components" + "".join(f"{window_s:>9g} s" for window_s in found.windows_s)]
    for count in range(score.shape[1]):
        cells = []
        for window in range(len(found.windows_s)):
            chosen = (window, count) == (choice.window, choice.components - 1)
            mark = "*" if chosen else "·" if near[window, count] else " "
            cells.append(f"{score[window, count]:>10.4f}{mark}")
        lines.append(f"  {count + 1:<10}" + "".join(cells))
    lines.append("  each axis over its least MSE, mean; · within one standard error of the least; * the choice")
    return lines
