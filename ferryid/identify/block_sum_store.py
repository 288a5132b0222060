"""What a fit needs of one log, kept as a file beside the log's tables: its pieces, and what else is told of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ferryid import __version__
from ferryid.errors import FerryIdError
from ferryid.files import remove_abandoned, replacing
from ferryid.identify.excitation import heading_sectors
from ferryid.identify.log_sums import LogSums, sum_log
from ferryid.identify.rows import basis_for, known_rows
from ferryid.identify.settings import TEST_WINDOW_S, FitSettings
from ferryid.identify.split import block_number, purge_seconds
from ferryid.models import payload_kg, validity_ranges
from ferryid.models.forces import compute_residual
from ferryid.regression.cross_validation import BlockSums
from ferryid.signals.cache import folder_of, load
from ferryid.signals.parquet import read_table, write_table
from ferryid.signals.prepare import track_of
from ferryid.signals.smooth import smooth_measured
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

SCHEMA = "ferryid.pieces/4"
_VELOCITIES = 128
"""Rows whose velocities are kept of a log, evenly spaced: damping is judged at them."""
_MATTERS = ("basis", "smoother", "residual", "rate_hz", "delta", "sigma", "zeta")
"""Settings that change the pieces; all others are chosen when they are added up."""


@dataclass(frozen=True, eq=False)
class StoredSums:
    """One log as it is kept.

    Attributes
    ----------
    name, sha256, files
        Of the log.
    basis
        Name of the basis that its measurements allow.
    rate_hz
        Rows per second.
    ranges
        Ranges of validity, as in a model file.
    sectors
        Rows in each of twelve sectors of heading.
    sums
        Its block sums at every window.
    visited
        Velocities of evenly spaced rows, shape (n, 3).
    warnings
        Signals that contradict each other, and which rows are not used and why, as sentences.
    """

    name: str
    sha256: str
    files: tuple[str, ...]
    basis: str
    rate_hz: float
    ranges: Mapping[str, tuple[float, float]]
    sectors: Sequence[int]
    sums: LogSums
    visited: Floats
    warnings: tuple[str, ...] = ()


def load_block_sums(folder: Path, profile: Profile, settings: FitSettings, windows_s: Sequence[float]) -> StoredSums:
    """Return what is kept of the log in a folder of ``out/logs``; it is worked out and kept where it is not yet.

    Parameters
    ----------
    folder
        Holds the recording, as `ferryid.signals.cache` wrote it with this very profile.
    profile, settings
        Vessel, and how to fit.
    windows_s
        Smoothing windows [s].

    Raises
    ------
    FerryIdError
        For a log that cannot be used, and a folder that cannot be written.
    """
    key = key_of(profile, settings, windows_s=[float(window_s) for window_s in windows_s])
    path = path_of(folder, "pieces", key)
    remove_abandoned(folder)
    if path.exists():
        try:
            return _read(path, key)
        except (FerryIdError, LookupError, TypeError, ValueError, AttributeError):
            pass  # a damaged file, or one of another log, is made anew
    made = _compute(folder, profile, settings, windows_s)
    write_block_sums(path, key, made)
    return made


def key_of(profile: Profile, settings: FitSettings, **more: Any) -> dict[str, Any]:
    """Return all that what is kept of a log depends on, besides the log."""
    return {
        "version": __version__,
        "profile_sha256": profile.sha256,
        **more,
        **{name: getattr(settings, name) for name in _MATTERS},
    }


def path_of(folder: Path, kind: str, key: Mapping[str, Any]) -> Path:
    """Return the file of what is kept of the log in a folder."""
    digest = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()
    return folder / f"{kind}-{digest[:16]}.parquet"


def _compute(folder: Path, profile: Profile, settings: FitSettings, windows_s: Sequence[float]) -> StoredSums:
    recording = load(folder)
    opened = track_of(recording, profile, settings.rate_hz)
    motion = smooth_measured(opened.measured, TEST_WINDOW_S)
    functions = basis_for(settings, [motion])
    error = compute_residual(profile, motion, settings.scale)
    used = known_rows(motion, functions, error, error)
    purge_s = purge_seconds(motion.rate_hz, max(TEST_WINDOW_S, *windows_s))
    blocks = block_number(np.count_nonzero(used) / motion.rate_hz, purge_s)
    return StoredSums(
        name=recording.name,
        sha256=recording.sha256,
        files=tuple(Path(file).name for file in recording.files),
        basis=functions.name,
        rate_hz=motion.rate_hz,
        ranges=validity_ranges(
            motion.nu[used], motion.nu_dot[used], None if motion.payload is None else payload_kg(motion, used)
        ),
        sectors=heading_sectors(motion.eta[used, 2]).tolist(),
        sums=sum_log(
            profile,
            settings,
            functions,
            opened.measured,
            windows_s,
            blocks=blocks if blocks >= 3 else 1,
        ),
        visited=motion.nu[used][:: max(1, -(-int(used.sum()) // _VELOCITIES))],
        warnings=(*opened.doubts, *opened.left_out),
    )


def write_block_sums(path: Path, key: Mapping[str, Any], log: StoredSums) -> None:
    """Keep a log in a file; `key` says by what it is found again."""
    one = log.sums
    every = (*one.training, one.test)
    # Rows trained on are often those tested on: then they are kept once.
    same = [k for k, pieces in enumerate(one.training) if np.array_equal(pieces.products, one.test.products)]
    stored = every[:-1] if same else every
    width = one.test.K + one.test.m + 1
    upper = np.triu_indices(width)
    sums = np.concatenate([pieces.products[..., *upper].ravel() for pieces in stored])
    told = {
        "schema": SCHEMA,
        "key": key,
        "name": log.name,
        "sha256": log.sha256,
        "files": log.files,
        "basis": log.basis,
        "rate_hz": log.rate_hz,
        # In a list, which keeps their order: two fits of the same pieces give the same model file.
        "ranges": [[name, *span] for name, span in log.ranges.items()],
        "sectors": list(log.sectors),
        "columns": [one.test.K, one.test.m],
        "n": [pieces.n.tolist() for pieces in stored],
        "shift": [pieces.shift.tolist() for pieces in stored],
        "test": same[0] if same else len(stored) - 1,
        "force": one.force.tolist(),
        "base": one.base.tolist(),
        "reference": one.reference.tolist(),
        "visited": log.visited.tolist(),
        "warnings": log.warnings,
    }
    with replacing(path) as draft:
        write_table(draft, {"sums": sums}, told)


def _read(path: Path, key: Mapping[str, Any]) -> StoredSums:
    columns, told = read_table(path)
    place = folder_of(Path(), told["name"], told["sha256"], key["profile_sha256"]).name
    if told["schema"] != SCHEMA or told["key"] != key or path.parent.name != place:
        raise FerryIdError(f"{path}: not what was asked for. Fix: delete it, it will be computed again")
    K, m = told["columns"]
    width = K + m + 1
    counts = np.array(told["n"], dtype=np.int64)
    products = np.empty((*counts.shape, width, width))
    upper = np.triu_indices(width)
    packed = columns["sums"].reshape(*counts.shape, -1)
    products[..., *upper] = packed
    products[..., upper[1], upper[0]] = packed
    shifts, force, base, reference, visited = (
        np.array(told[name], dtype=np.float64) for name in ("shift", "force", "base", "reference", "visited")
    )
    whole = np.array_equal(products[..., -1, -1], counts) and np.isfinite(packed).all()
    moments = force.shape == base.shape == reference.shape == (counts.shape[1], 3, 3)
    if not whole or not moments or shifts.shape != (len(counts), K + m) or visited.shape != (len(visited), 3):
        raise FerryIdError(f"{path}: damaged. Fix: delete it, it will be computed again")
    pieces = [BlockSums(n, K, m, shift, one) for n, shift, one in zip(counts, shifts, products, strict=True)]
    windows = len(key["windows_s"])
    return StoredSums(
        name=told["name"],
        sha256=told["sha256"],
        files=tuple(told["files"]),
        basis=told["basis"],
        rate_hz=told["rate_hz"],
        ranges={name: (low, high) for name, low, high in told["ranges"]},
        sectors=told["sectors"],
        sums=LogSums(
            told["name"],
            tuple(pieces[:windows]),
            pieces[told["test"]],
            force,
            base,
            reference,
        ),
        visited=visited,
        warnings=tuple(told["warnings"]),
    )
