"""One fit, or one sweep, over every log that was ingested: what is kept of each is added up, no row is read again.

Memory does not grow with the number of logs, apart from one cross-product each for the table of how well the model fits it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid import __version__
from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.identify.accept import accept
from ferryid.identify.archived_logs import folders
from ferryid.identify.basis import Basis, basis
from ferryid.identify.bootstrap import bootstrap
from ferryid.identify.cautions import general_cautions, of_logs
from ferryid.identify.choose import choose, deviation
from ferryid.identify.combine import spanned
from ferryid.identify.cross_products import CrossProducts, total
from ferryid.identify.crossed import FOLDS, MOST_GROUPS, Folds, FoldSums
from ferryid.identify.excitation import SECTORS, sector_coverage, singular_values, undetermined
from ferryid.identify.fit import curve_of, quiet, regress
from ferryid.identify.inertia import unforced
from ferryid.identify.kept_pieces import Kept, kept
from ferryid.identify.model import AXES, Model
from ferryid.identify.result import Excitation, FitResult, FreeRun
from ferryid.identify.scores import by_axis
from ferryid.identify.settings import FitSettings, check_components
from ferryid.identify.split import validating
from ferryid.identify.store import checked_name
from ferryid.vessel.profile import Profile

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

MOST_DRAWN = 500
"""Blocks that the bootstrap draws from; with more of them several logs' blocks are joined."""
_NOTHING = np.zeros(0)
NOT_RUN = FreeRun(
    _NOTHING,
    _NOTHING,
    _NOTHING,
    _NOTHING,
    _NOTHING,
    starts=0,
    example={},
    note="not run free: a fit over an archive sees sums and no motion; ferryid evaluate runs it on a log",
)


@dataclass(frozen=True, eq=False)
class _Log:
    """One log after its pieces were added up: what is told of it, and the sums of its validation rows."""

    name: str
    sha256: str
    files: tuple[str, ...]
    rate_hz: float
    rows: int
    training_rows: int
    validation: CrossProducts
    warnings: tuple[str, ...]


class _Sums:
    """What a fit needs of all logs, added up for each window.

    Parameters
    ----------
    windows
        W, the number of windows.
    logs
        How many logs will be added.
    by_logs
        True: whole logs validate, one of every three in a row. False: blocks of every log.
    """

    def __init__(self, windows: int, logs: int, *, by_logs: bool) -> None:
        self.folds = FoldSums(windows, FOLDS)
        self.training: list[CrossProducts | None] = [None] * windows
        self.drawn: list[list[CrossProducts]] = [[] for _ in range(windows)]
        self.logs: list[_Log] = []
        self.ranges: list[Mapping[str, tuple[float, float]]] = []
        self.sectors = np.zeros(SECTORS, dtype=np.int64)
        self.force: list[Floats] = []
        self.base: list[Floats] = []
        self.validation_force: list[Floats] = []
        self._apiece = max(1, MOST_DRAWN // logs)
        self._short = 0
        self._whole = validating(logs) if by_logs else None

    def add(self, log: Kept) -> None:
        """Add one log."""
        one = log.studied
        validates = self._validates(one.test.blocks)
        self.folds.add(one.training, one.test, ~validates)
        training_rows = 0
        for window, pieces in enumerate(one.training):
            parts = [part for part in pieces.separately(~validates) if part.n]
            if parts:
                sums = total(parts)
                training_rows = sums.n
                before = self.training[window]
                self.training[window] = sums if before is None else before + sums
                self._draw(self.drawn[window], parts)
        self.force.append(one.force)
        self.base.append(one.base)
        self.validation_force.append(one.force[validates])
        self.ranges.append(log.ranges)
        self.sectors += log.sectors
        validation = one.test.summed(validates[:, None])
        rows = int(one.test.n.sum())
        self.logs.append(
            _Log(log.name, log.sha256, log.files, log.rate_hz, rows, training_rows, validation, log.warnings)
        )

    def _validates(self, blocks: int) -> Flags:
        if self._whole is not None:
            return np.full(blocks, self._whole[len(self.logs)])
        if blocks >= 3:
            return validating(blocks)
        # A log too short for blocks of its own is one block among those of its kind.
        self._short += 1
        return np.full(blocks, self._short % 3 == 2)

    def _draw(self, drawn: list[CrossProducts], parts: Sequence[CrossProducts]) -> None:
        """Add a log's training blocks to those that the bootstrap draws from, joined so that there are not too many."""
        joined = -(-len(parts) // self._apiece)
        for low in range(0, len(parts), joined):
            block = total(parts[low : low + joined])
            if len(drawn) < MOST_DRAWN:
                drawn.append(block)
            else:
                drawn[len(self.logs) % MOST_DRAWN] += block


def fit_archive(
    profile: Profile,
    settings: FitSettings,
    out: Path,
    logs: Sequence[str] = (),
    *,
    name: str = "",
    progress: Callable[[str], None] = quiet,
) -> FitResult:
    """Fit one correction to every log under an output folder; arguments as in `ferryid.identify.fit.fit`.

    Parameters
    ----------
    logs
        Names or paths of the logs to take, all that were ingested with the profile where none is given.

    Raises
    ------
    FerryIdError
        For logs that cannot be added up, by name.
    """
    name = checked_name(name or profile.name)
    settings = settings.on(profile)
    if settings.split == "every-kth":
        raise FerryIdError("--split every-kth: an archive keeps blocks, no rows. Fix: give blocks or logs")
    windows_s = settings.windows_s or (settings.window_s,)
    where = folders(out, profile, logs)
    sums = _Sums(len(windows_s), len(where), by_logs=settings.split == "logs")
    functions = _added(where, profile, settings, windows_s, sums.add, progress)
    check_components(settings.components, functions)
    validation = total([log.validation for log in sums.logs])
    if not validation.n or not any(one.n for one in sums.training if one is not None):
        raise FerryIdError(
            f"{sums.logs[0].name}: too little for training and validation, found {counted(len(sums.logs), 'log')} of "
            f"{counted(sum(log.rows for log in sums.logs), 'row')}. Fix: ingest more or longer logs"
        )
    progress("fitting")
    free = unforced(deviation(np.concatenate(sums.force)), deviation(np.concatenate(sums.base)))
    window, components = 0, settings.components
    if settings.windows_s or components == "auto":
        choice = choose(profile, settings, functions, windows_s, sums.folds.folds(), free, where=sums.logs[0].name)
        window, components = choice.window, choice.components
        settings = replace(settings, window_s=choice.window_s)
    training = sums.training[window]
    assert training is not None
    functions, model_fit, chosen, held = regress(profile, settings, functions, training, int(components), free)
    theta, intercept = model_fit.coefficients[chosen - 1], model_fit.intercepts[chosen - 1]
    progress("resampling blocks for the intervals")
    spread = bootstrap(
        sums.drawn[window], chosen, draws=settings.draws, seed=settings.seed, allowed=functions.mask, where=name
    )
    scores = _scores(sums, validation, theta, intercept, settings)
    verdict = accept(*(np.array([scores["mse"][part][axis] for axis in AXES]) for part in ("base", "model")))
    known = Excitation(
        singular_values=singular_values(training),
        ranges=spanned(sums.ranges),
        heading_coverage=sector_coverage(sums.sectors),
        undetermined=undetermined(training, functions.terms, functions.mask),
        vip=model_fit.vip(chosen),
    )
    model = Model(
        name=name,
        version=0,
        created=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        ferryid_version=__version__,
        profile_text=profile.text,
        scale=settings.scale,
        settings={
            **settings.plain(),
            "basis": functions.name,
            "components": chosen,
            "archive": True,
            "grid_hz": sorted({log.rate_hz for log in sums.logs}),
        },
        terms=functions.terms,
        units=functions.units,
        theta=theta,
        intercept=intercept,
        low=spread.low,
        high=spread.high,
        intercept_low=spread.intercept_low,
        intercept_high=spread.intercept_high,
        covariance=spread.covariance,
        ranges=known.ranges,
        training=tuple(
            {
                "name": log.name,
                "files": list(log.files),
                "sha256": log.sha256,
                "seconds": log.training_rows / log.rate_hz,
                "rows": log.training_rows,
            }
            for log in sums.logs
            if log.training_rows
        ),
        scores=scores,
        accepted=verdict.accepted,
    )
    warnings = (
        *held,
        *general_cautions(settings, known, scores, len(sums.logs), float(scores["seconds"])),
        *spread.notes,
        *of_logs([(log.name, log.warnings) for log in sums.logs]),
    )
    return FitResult(
        model,
        verdict,
        (),
        curve_of(model_fit, training, validation, scores, chosen),
        known,
        NOT_RUN,
        NOT_RUN,
        warnings,
        archive=tuple(_per_log(sums, theta, intercept)),
    )


def archive_folds(
    profile: Profile,
    settings: FitSettings,
    out: Path,
    windows_s: Sequence[float],
    logs: Sequence[str],
    folds: int,
    progress: Callable[[str], None],
) -> tuple[Basis, Flags, dict[str, Folds], list[dict[str, Any]]]:
    """Return what a sweep needs of an archive: basis, axes without force, folds by stretches and whole logs, and the logs."""
    where = folders(out, profile, logs)
    by = {"blocks": FoldSums(len(windows_s), folds)}
    if len(where) > 1:
        by["logs"] = FoldSums(len(windows_s), min(MOST_GROUPS, len(where)), whole=True)
    force, base, told = [], [], []

    def add(log: Kept) -> None:
        for sums in by.values():
            sums.add(log.studied.training, log.studied.test)
        force.append(log.studied.force)
        base.append(log.studied.base)
        rows = int(log.studied.test.n.sum())
        told.append(
            {
                "name": log.name,
                "sha256": log.sha256,
                "seconds": rows / log.rate_hz,
                "rows": rows,
                "warnings": [*log.warnings],
            }
        )

    functions = _added(where, profile, settings, windows_s, add, progress)
    free = unforced(deviation(np.concatenate(force)), deviation(np.concatenate(base)))
    return functions, free, {key: sums.folds() for key, sums in by.items()}, told


def _added(
    where: Sequence[Path],
    profile: Profile,
    settings: FitSettings,
    windows_s: Sequence[float],
    add: Callable[[Kept], None],
    progress: Callable[[str], None],
) -> Basis:
    """Add every log, one after the other, and return the basis that they share."""
    first: Kept | None = None
    for number, folder in enumerate(where):
        progress(f"adding up log {number + 1} of {len(where)}")
        log = kept(folder, profile, settings, windows_s)
        if first is not None and log.basis != first.basis:
            raise FerryIdError(
                f"{log.name}: its basis is {log.basis}, as its measurements allow, that of {first.name} {first.basis}: they do "
                "not add up. Fix: fit them apart, naming the logs of one kind"
            )
        first = first or log
        add(log)
    assert first is not None
    return basis(first.basis, structure=settings.structure)


def _scores(
    sums: _Sums, validation: CrossProducts, theta: Floats, intercept: Floats, settings: FitSettings
) -> dict[str, Any]:
    """Return the scores of a model file, from sums."""
    mse_base, mse_model = _errors(validation, theta, intercept)
    variance = deviation(np.concatenate(sums.validation_force)) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(mse_base > 0.0, mse_model / mse_base, np.nan)
        r2 = [np.where(variance > 0.0, 1.0 - mse / variance, np.nan) for mse in (mse_base, mse_model)]
    judged = ratio[np.isfinite(ratio)]
    trained = sum(log.training_rows / log.rate_hz for log in sums.logs)
    validated = sum(log.validation.n / log.rate_hz for log in sums.logs)
    return {
        "mse": {"base": by_axis(mse_base), "model": by_axis(mse_model)},
        "r2": {"base": by_axis(r2[0]), "model": by_axis(r2[1])},
        "per_axis": by_axis(ratio),
        "normalised_mse": float(judged.mean()) if judged.size else float("nan"),
        "rows": validation.n,
        "seconds": validated,
        "split": settings.split,
        "split_notes": [
            f"{counted(len(sums.logs), 'log')}: {trained:.0f} s train, {validated:.0f} s validate, "
            + ("whole logs, one of every three in a row." if settings.split == "logs" else "in blocks of every log.")
        ],
    }


def _errors(rows: CrossProducts, theta: Floats, intercept: Floats) -> tuple[Floats, Floats]:
    """Return the mean square error of base and new model per axis, shape (3,)."""
    both = rows.sse(np.array([np.zeros_like(theta), theta]), np.array([np.zeros_like(intercept), intercept]))
    return both[0] / max(rows.n, 1), both[1] / max(rows.n, 1)


def _per_log(sums: _Sums, theta: Floats, intercept: Floats) -> Iterator[dict[str, Any]]:
    """Yield how well the model fits each log: the ratio of MSE on its validation rows, NaN where it has none."""
    for log in sums.logs:
        base, new = _errors(log.validation, theta, intercept)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(base > 0.0, new / base, np.nan)
        yield {
            "name": log.name,
            "files": list(log.files),
            "sha256": log.sha256,
            "rows": log.rows,
            "validation_rows": log.validation.n,
            "per_axis": by_axis(ratio),
            "warnings": list(log.warnings),
        }
