"""Settings of the weak form swept: cross-validated prediction error of every window length and component count.

A window length is fitted with windows of this length and tested in windows of the vessel's usual one, so that lengths can be
compared. Every fit is one as ``fit`` makes it: conditions of logs, whitening, prior and bounds come of its training windows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.identify.archived_logs import archived_folders
from ferryid.identify.fit_data import Coefficients
from ferryid.identify.inertia.shares import without_inertia
from ferryid.identify.inputs import read_logs
from ferryid.identify.log_windows import LogWindows, WindowPart, average_log
from ferryid.identify.model_selection import Selection
from ferryid.identify.motion_data import numbered_names
from ferryid.identify.rows import basis_for
from ferryid.identify.settings import FitSettings, check_components
from ferryid.identify.split import Split, TooShort
from ferryid.identify.weak_archive import archived_windows
from ferryid.identify.windowed_data import KnownWindows, WindowedData
from ferryid.regression import fit_simpls
from ferryid.regression.bases import Basis
from ferryid.regression.cross_validation import MOST_GROUPS, Curves
from ferryid.signals.prepare import Opened, smoothed
from ferryid.types import AXES, Floats, RunContext
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile

USUAL = (0.25, 0.5, 1.0, 1.5, 2.0)
"""Window lengths that are usually tried, times the vessel's usual one."""
_WINDOWS_A_FOLD = 4
"""Least windows of a log that a fold of it tests in."""


@dataclass(frozen=True)
class Fold:
    """Parts of every log that test, from the first row to before the second; other rows train, but for a purge around them."""

    tested: tuple[tuple[int, int], ...]


def sweep_weak(
    logs: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    *,
    what: str,
    windows_s: Sequence[float],
    folds: int,
    archive: bool,
    opened: Sequence[Opened] = (),
) -> tuple[tuple[float, ...], str, float, dict[str, Selection], list[dict[str, Any]], list[str]]:
    """Cross-validate logs over window lengths and component counts of the weak form.

    Parameters
    ----------
    logs, profile, settings, run, folds, archive
        As in `ferryid.identify.sweeps.settings_sweep.sweep_settings`.
    what
        ``"components"``: at the settings' window length alone.
    windows_s
        Window lengths to try [s]; the usual ones where none is given.
    opened
        The logs, where they were read already.

    Returns
    -------
    tuple
        Window lengths [s], name of the basis, length of the test windows [s], choices by the way of cutting, what is told of
        the logs, and notes.

    Raises
    ------
    TooShort
        For logs that are too short for the windows in every fold.
    FerryIdError
        For other input that cannot be used, with cause and remedy.
    """
    if settings.residual != "measured":
        raise FerryIdError(
            f"--residual {settings.residual}: the weak form explains the measured force. "
            "Fix: leave it out, or give --estimator derivative"
        )
    test_s = window_seconds(profile)
    lengths_s = [settings.weak_window_s or test_s]
    if what != "components":
        lengths_s = sorted({float(one) for one in windows_s} or {max(0.5, each * test_s) for each in USUAL})
    # Says what is wrong with a length before any log is read.
    at = {length_s: replace(settings, weak_window_s=length_s) for length_s in (*lengths_s, test_s)}
    if archive:
        made, functions = _from_archive(logs, profile, at, run)
    else:
        made, functions = average_logs(opened or read_logs(logs, profile, settings, run), profile, at, run)
    check_components(settings.components, functions)
    cuts = {"blocks": folds_by_stretches(made[test_s], folds)}
    if len(made[test_s]) > 1:
        cuts["logs"] = folds_by_logs(made[test_s])
    notes, tried = [], []
    for length_s in lengths_s:
        why = _impossible(profile, at[length_s], functions, made[length_s], cuts)
        if why and (windows_s or what == "components"):
            raise TooShort(
                f"{made[test_s][0].name}: {why} in a fold. Fix: give shorter windows, longer logs, or --estimator derivative"
            )
        if why:
            notes.append(f"A window of {length_s:.3g} s was left out: {why} in a fold.")
        else:
            tried.append(length_s)
    if not tried:
        raise TooShort(
            f"{made[test_s][0].name}: too short to cross-validate the weak form. "
            "Fix: give more or longer logs, or --estimator derivative"
        )
    run.progress("cross-validating")
    by = {
        key: _select(profile, settings, [(at[one], made[one]) for one in tried], made[test_s], functions, cut)
        for key, cut in cuts.items()
    }
    told = [
        {
            "name": log.name,
            "sha256": log.sha256,
            "seconds": log.rows / log.rate_hz,
            "rows": log.rows,
            "warnings": [*log.warnings],
        }
        for log in made[test_s]
    ]
    return tuple(tried), functions.name, test_s, by, told, notes


_Made = Mapping[float, Sequence[LogWindows]]
"""Windows of every log, by their length [s]."""


def average_logs(
    logs: Sequence[Opened], profile: Profile, at: Mapping[float, FitSettings], run: RunContext
) -> tuple[_Made, Basis]:
    """Return windows of every log, by their length [s], and the basis that all logs allow."""
    settings = next(iter(at.values()))
    opened = [smoothed(one, settings.window_s, settings.smoother) for one in logs]
    motions = numbered_names([one.motion for one in opened])
    functions = basis_for(settings, motions)
    made = {}
    for length_s, each in at.items():
        run.progress(f"averaging over {length_s:.3g} s")
        made[length_s] = [
            average_log(
                profile,
                each,
                functions,
                motion,
                divided=False,
                sha256=one.recording.sha256,
                files=one.recording.files,
                warnings=(*one.doubts, *one.left_out),
            )
            for one, motion in zip(opened, motions, strict=True)
        ]
    return made, functions


def _from_archive(
    logs: Sequence[str], profile: Profile, at: Mapping[float, FitSettings], run: RunContext
) -> tuple[_Made, Basis]:
    where = archived_folders(run.tables or run.out, profile, logs)
    made, functions = {}, None
    for length_s, each in at.items():
        made[length_s], functions = archived_windows(where, profile, each, run.progress, divided=False)
    assert functions is not None
    return made, functions


def folds_by_stretches(logs: Sequence[LogWindows], folds: int) -> list[Fold]:
    """Return folds of contiguous stretches of every log, each in as many as it has windows for, from where the last ended."""
    tested = [[(0, 0)] * len(logs) for _ in range(folds)]
    first = 0
    for number, log in enumerate(logs):
        start = log.parts[0].measured.start
        parts = min(folds, max(1, len(start) // _WINDOWS_A_FOLD))
        if not len(start):
            continue
        stretches = np.array_split(start, parts)
        edges = [int(one[0]) for one in stretches] + [int(start[-1]) + log.length]
        for place in range(parts):
            tested[(first + place) % folds][number] = edges[place], edges[place + 1]
        first = (first + parts) % folds
    return [Fold(tuple(one)) for one in tested]


def folds_by_logs(logs: Sequence[LogWindows]) -> list[Fold]:
    """Return folds of whole logs."""
    groups = min(MOST_GROUPS, len(logs))
    end = np.iinfo(np.int64).max
    return [
        Fold(tuple((0, end) if number % groups == group else (0, 0) for number in range(len(logs))))
        for group in range(groups)
    ]


def trained_parts(logs: Sequence[LogWindows], fold: Fold) -> list[WindowPart]:
    """Return the windows of every log that train in a fold."""
    parts = []
    for log, (low, high) in zip(logs, fold.tested, strict=True):
        purge = round(log.purge_s * log.rate_hz)
        whole = log.parts[0]
        parts.append(whole if low == high else whole.without(low - purge, min(high, 2**62) + purge, log.length))
    return parts


def tested_parts(logs: Sequence[LogWindows], fold: Fold) -> list[WindowPart]:
    """Return those that test."""
    return [log.parts[0].between(*rows, log.length) for log, rows in zip(logs, fold.tested, strict=True)]


def _impossible(
    profile: Profile,
    settings: FitSettings,
    functions: Basis,
    logs: Sequence[LogWindows],
    cuts: Mapping[str, Sequence[Fold]],
) -> str:
    """Return why windows of a length cannot be fitted in every fold; empty where they can."""
    for fold in (one for cut in cuts.values() for one in cut):
        parts = trained_parts(logs, fold)
        if why := WindowedData.of(profile, settings, functions, logs, parts, parts).impossible:
            return why
    return ""


def _select(
    profile: Profile,
    settings: FitSettings,
    lengths: Sequence[tuple[FitSettings, Sequence[LogWindows]]],
    judged: Sequence[LogWindows],
    functions: Basis,
    folds: Sequence[Fold],
) -> Selection:
    """Return length and component count of the least prediction error; see `_rule`."""
    whole = [log.parts[0] for log in judged]
    usual = replace(settings, weak_window_s=judged[0].length_s)
    split = Split("folds", (), (), judged[0].purge_s)
    every = KnownWindows(profile, usual, functions, (), split, tuple(whole), tuple(whole))
    tests = [
        (fold, replace(every, validated=tuple(tested_parts(judged, fold)), chosen=every.steadied)) for fold in folds
    ]
    tests = [(fold, test) for fold, test in tests if any(len(one) for one in test.validation)]
    if len(tests) < 2:
        raise TooShort(
            f"{judged[0].name}: cross-validation needs two folds with windows of {judged[0].length_s:.3g} s, "
            f"found {len(tests)}. Fix: use a longer log or more logs"
        )
    first, logs = lengths[0]
    whole_data = WindowedData.of(profile, first, functions, logs, _parts(logs), _parts(logs))
    whole_data.refuse_contradictions()
    fitted = functions.mask.any(axis=0)
    held = whole_data.without_force & fitted if settings.inertia == "auto" else np.zeros(3, dtype=bool)
    mask = without_inertia(functions.mask, functions.terms, held)
    judges = np.array([axis in settings.axes for axis in AXES])
    errors, base = list[list[Floats]](), list[Floats]()
    for each, logs in lengths:
        for fold, test in tests:
            parts = trained_parts(logs, fold)
            data = WindowedData.of(profile, each, functions, logs, parts, parts)
            found = [test.errors(one) for one in _counts(data, replace(functions, mask=mask))]
            # An axis that is not measured has no error in any fold, its base model neither.
            errors.append([np.where(judges, one.mse_model, 0.0) for one in found])
            base.append(np.where(judges, found[0].mse_base, 0.0))
    rows = np.array([sum(len(one) for one in test.validation) for _, test in tests], dtype=np.float64)
    by_fold = np.array(errors).reshape(len(lengths), len(tests), len(functions.terms), 3)
    curves = Curves(
        mse=np.einsum("wfai,f->wai", by_fold, rows / rows.sum()),
        standard_error=np.std(by_fold, axis=1, ddof=1) / sqrt(len(tests)),
        base=rows @ np.array(base[: len(tests)]) / rows.sum(),
        folds=len(tests),
        rows=int(rows.sum()),
        by_fold=by_fold,
    )
    window, components = _rule(curves, settings)
    return Selection(window, float(lengths[window][0].weak_window_s or 0.0), components, held, curves)


def _parts(logs: Sequence[LogWindows]) -> list[WindowPart]:
    return [log.parts[0] for log in logs]


def _counts(data: WindowedData, functions: Basis) -> Iterator[Coefficients]:
    """Return the corrections with 1, 2, ... components, as a fit makes them."""
    most = len(functions.terms)
    none = np.full((most, 3), np.nan)
    regression = fit_simpls(data.training, most, allowed=functions.mask)
    gains, before = none, none
    for found, offset in zip(regression.coefficients, regression.intercepts, strict=True):
        # Beyond an axis's own functions nothing changes any more.
        if not np.allclose(found, before, rtol=1e-12, atol=0.0):
            gains, before = data.feasible(found, functions.mask).gains, found
        theta, intercept = data.force_form(gains, offset)
        yield Coefficients(theta, intercept, none, none, none[0], none[0], np.zeros(0))


def _rule(curves: Curves, settings: FitSettings) -> tuple[int, int]:
    """Return number of window length and of components (1..A).

    Of every length the count that a fit takes, the largest that is not worse than the best beyond chance, or the settings'
    own; of these the length of least error.
    """
    score = curves.normalised()[0]
    if settings.components != "auto":
        counts = [int(settings.components)] * len(score)
    else:
        counts = [
            replace(curves, mse=curves.mse[w : w + 1], by_fold=curves.by_fold[w : w + 1]).most_supported()
            for w in range(len(score))
        ]
    window = int(np.argmin([score[w, count - 1] for w, count in enumerate(counts)]))
    return window, counts[window]
