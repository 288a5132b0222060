"""Structures compared by the weak form: every basis, decoupled and coupled, on the same folds and the same test windows.

Every fit is one as ``fit`` makes it, its number of components chosen within the training windows of the fold. What is compared
is the prediction error in windows of the vessel's usual length, block by block, as that of two fits is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.log_windows import LogWindows, WindowPart
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import Split, TooShort
from ferryid.identify.sweeps.structure_comparison import StructureComparison
from ferryid.identify.sweeps.structure_ranking import StructureErrors, rank_structures
from ferryid.identify.sweeps.weak_sweep import (
    Fold,
    average_logs,
    folds_by_logs,
    folds_by_stretches,
    tested_parts,
    trained_parts,
)
from ferryid.identify.weak_rows import WeakRows
from ferryid.identify.windowed_data import KnownWindows, WindowedData
from ferryid.regression.bases import STRUCTURES, Basis, make_basis
from ferryid.signals.prepare import Opened
from ferryid.types import Floats, Ints, RunContext, no_progress
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile


def compare_weak(
    opened: Sequence[Opened],
    profile: Profile,
    settings: FitSettings,
    usable: Mapping[str, str],
    run: RunContext,
    *,
    block_s: float,
    folds: int,
) -> dict[str, StructureComparison]:
    """Cross-validate bases by the weak form, decoupled and coupled, and return the comparisons by the way of cutting.

    Parameters
    ----------
    opened
        The logs.
    profile, settings, run
        Vessel, how to fit, and progress.
    usable
        Bases as `make_basis` takes them, by the names that a fit takes.
    block_s
        Least length of a block [s].
    folds
        Number of folds by stretches.

    Raises
    ------
    TooShort
        For logs that are too short for the windows in a fold.
    FerryIdError
        For another residual than the measured force, and signals that contradict each other.
    """
    if settings.residual != "measured":
        raise FerryIdError(
            f"--residual {settings.residual}: the weak form explains the measured force. "
            "Fix: leave it out, or give --estimator derivative"
        )
    found: dict[str, list[_Compared]] = {}
    steadied: bool | None = None
    for name, full in usable.items():
        windows = _Windows.of(opened, profile, replace(settings, basis=full, structure="coupled"), run)
        cuts = {"blocks": folds_by_stretches(windows.judged, folds)}
        if len(opened) > 1:
            cuts["logs"] = folds_by_logs(windows.judged)
        for structure in STRUCTURES:
            run.progress(f"cross-validating {name}, {structure}")
            one = windows.with_structure(structure)
            if steadied is None:
                one.data().refuse_contradictions()
                # All structures are judged at the same velocities.
                steadied = one.tests().steadied
            for key, cut in cuts.items():
                found.setdefault(key, []).append(one.cross_validated(name, cut, block_s, steadied))
    return {
        key: rank_structures([one.tried for one in every], every[0].base, every[0].windows, every[0].folds)
        for key, every in found.items()
    }


@dataclass(frozen=True, eq=False)
class _Compared:
    """Errors of a structure in blocks, those of the base model there, shape (B, 3), the windows of each, and the folds."""

    tried: StructureErrors
    base: Floats
    windows: Floats
    folds: int


@dataclass(frozen=True, eq=False)
class _Windows:
    """Logs as windows that train and windows in which models are judged, with the functions of a basis."""

    profile: Profile
    settings: FitSettings
    functions: Basis
    trained: Sequence[LogWindows]
    judged: Sequence[LogWindows]

    @classmethod
    def of(cls, opened: Sequence[Opened], profile: Profile, settings: FitSettings, run: RunContext) -> _Windows:
        test_s = window_seconds(profile)
        train_s = settings.weak_window_s or test_s
        at = {length_s: replace(settings, weak_window_s=length_s) for length_s in (train_s, test_s)}
        made, functions = average_logs(opened, profile, at, run)
        return cls(profile, at[train_s], functions, made[train_s], made[test_s])

    def with_structure(self, structure: str) -> _Windows:
        """Return the same with another structure: it says which of the functions act where."""
        functions = make_basis(self.functions.name, structure=structure)
        return replace(self, settings=replace(self.settings, structure=structure), functions=functions)

    def data(self, fold: Fold | None = None) -> WindowedData:
        """Return the data of a fit to what trains in a fold, to all windows where None."""
        parts = _whole(self.trained) if fold is None else trained_parts(self.trained, fold)
        return WindowedData.of(self.profile, self.settings, self.functions, self.trained, parts, parts)

    def tests(self) -> KnownWindows:
        """Return all windows in which models are judged."""
        usual = replace(self.settings, weak_window_s=self.judged[0].length_s)
        split, whole = Split("folds", (), (), self.judged[0].purge_s), tuple(_whole(self.judged))
        return KnownWindows(self.profile, usual, self.functions, (), split, whole, whole)

    def cross_validated(self, name: str, folds: Sequence[Fold], block_s: float, steadied: bool) -> _Compared:
        """Fit without each fold in turn and test on its windows."""
        every, within = self.tests(), list[int]()
        errors, base, windows = list[Floats](), list[Floats](), list[int]()
        for fold in folds:
            test = replace(every, validated=tuple(tested_parts(self.judged, fold)), chosen=steadied)
            if not any(len(one) for one in test.validation):
                continue
            data = self.data(fold)
            if why := data.impossible:
                raise TooShort(
                    f"{self.judged[0].name}: {why} in a fold. Fix: give longer logs, or --estimator derivative"
                )
            made = estimate_correction(data, data.components(), 0, no_progress)
            within.append(made.components)
            forces = test.predicted(made.coefficients)
            for log, one, (force, plain, model) in zip(self.judged, test.validation, forces, strict=True):
                for places in _blocks(one, log, block_s):
                    errors.append(np.sum((force - model)[places] ** 2, axis=0))
                    base.append(np.sum((force - plain)[places] ** 2, axis=0))
                    windows.append(len(places))
        if len(within) < 2:
            raise TooShort(
                f"{self.judged[0].name}: cross-validation needs two folds with windows of {self.judged[0].length_s:.3g} s, "
                f"found {len(within)}. Fix: use a longer log or more logs"
            )
        whole = self.data()
        made = estimate_correction(whole, whole.components(), 0, no_progress)
        tried = StructureErrors(
            name, self.functions, made.functions.mask, made.components, tuple(within), np.array(errors)
        )
        return _Compared(tried, np.array(base), np.array(windows, dtype=np.float64), len(within))


def _whole(logs: Sequence[LogWindows]) -> list[WindowPart]:
    return [log.parts[0] for log in logs]


def _blocks(windows: WeakRows, log: LogWindows, block_s: float) -> list[Ints]:
    """Return the windows of every block of a log's tested windows: neighbours that begin within so many seconds or more."""
    if not len(windows):
        return []
    seconds = (windows.start[-1] + log.length - windows.start[0]) / log.rate_hz
    return np.array_split(np.arange(len(windows)), max(1, int(seconds / block_s)))
