"""Windows of the weak form of one log, kept as a file beside the log's tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.files import remove_abandoned, replacing
from ferryid.identify.block_sum_store import key_of, path_of
from ferryid.identify.log_windows import LogWindows, WindowPart, average_log
from ferryid.identify.rows import basis_for
from ferryid.identify.settings import FitSettings
from ferryid.identify.weak_rows import WeakRows
from ferryid.identify.window_loads import LoadSamples, sample_weights
from ferryid.signals.cache import folder_of, load
from ferryid.signals.parquet import read_table, write_table
from ferryid.signals.prepare import smoothed, track_of
from ferryid.types import Floats, Ints
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile

SCHEMA = "ferryid.windows/1"
_SHARED = ("force", "inertia", "by_velocity", "heading", "run", "start")
"""What does not depend on the velocity that enters products."""
_OWN = ("functions", "steady", "bare", "by_pose")


def load_windows(folder: Path, profile: Profile, settings: FitSettings, *, divided: bool) -> LogWindows:
    """Return the windows of the log in a folder of ``out/logs``; they are worked out and kept where they are not yet.

    Parameters
    ----------
    folder
        Holds the recording, as `ferryid.signals.cache` wrote it with this very profile.
    profile, settings
        Vessel, and how to fit.
    divided
        Whether training and validation rows are kept apart, as a split by blocks has them.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, and a folder that cannot be written.
    """
    key = key_of(
        profile,
        settings,
        window_s=float(settings.window_s),
        weak_window_s=float(settings.weak_window_s or window_seconds(profile)),
        divided=divided,
    )
    path = path_of(folder, "windows", key)
    remove_abandoned(folder)
    if path.exists():
        try:
            return _read(path, key)
        except (FerryIdError, LookupError, TypeError, ValueError, AttributeError):
            pass  # a damaged file, or one of another log, is made anew
    made = _compute(folder, profile, settings, divided=divided)
    write_windows(path, key, made)
    return made


def _compute(folder: Path, profile: Profile, settings: FitSettings, *, divided: bool) -> LogWindows:
    recording = load(folder)
    prepared = smoothed(track_of(recording, profile, settings.rate_hz), settings.window_s, settings.smoother)
    return average_log(
        profile,
        settings,
        basis_for(settings, [prepared.motion]),
        prepared.motion,
        divided=divided,
        sha256=recording.sha256,
        files=[Path(file).name for file in recording.files],
        warnings=(*prepared.doubts, *prepared.left_out),
    )


def write_windows(path: Path, key: Mapping[str, Any], log: LogWindows) -> None:
    """Keep the windows of a log in a file; `key` says by what they are found again."""
    values: list[Floats] = []
    parts = []
    for part in log.parts:
        arrays = _arrays(part)
        values += [np.asarray(one, dtype=np.float64).ravel(order="F") for one in arrays.values()]
        parts.append(
            {
                "arrays": [[name, list(one.shape)] for name, one in arrays.items()],
                "force": part.force.tolist(),
                "base": part.base.tolist(),
                # In a list, which keeps their order: two fits of the same windows give the same model file.
                "ranges": [[name, *span] for name, span in part.ranges.items()],
                "sectors": part.sectors.tolist(),
                "rows": part.rows,
                "blocks": part.blocks,
            }
        )
    told = {
        "schema": SCHEMA,
        "key": key,
        "name": log.name,
        "sha256": log.sha256,
        "files": log.files,
        "basis": log.basis,
        "rate_hz": log.rate_hz,
        "length_s": log.length_s,
        "purge_s": log.purge_s,
        "rows": log.rows,
        "parts": parts,
        "warnings": log.warnings,
    }
    with replacing(path) as draft:
        write_table(draft, {"values": np.concatenate(values)}, told)


def _arrays(part: WindowPart) -> dict[str, np.ndarray]:
    """Return what is kept of windows by name; what both velocities give alike is kept once."""
    arrays: dict[str, np.ndarray] = {"second": part.second, "nu": part.nu}
    arrays |= {name: getattr(part.measured, name) for name in _SHARED}
    arrays |= {name: getattr(part.measured, name) for name in _OWN}
    if np.all(arrays["inertia"] == arrays["inertia"][:1]):
        arrays["inertia"] = arrays["inertia"][:1]
    for name in _OWN:
        steadied = getattr(part.steadied, name)
        if not np.array_equal(steadied, arrays[name], equal_nan=True):
            arrays[f"steadied_{name}"] = steadied
    if part.load_measured is not None and part.load_steadied is not None:
        arrays |= {"load_psi": part.load_measured.psi, "load_nu": part.load_measured.nu}
        if not np.array_equal(part.load_steadied.nu, part.load_measured.nu, equal_nan=True):
            arrays["steadied_load_nu"] = part.load_steadied.nu
    return arrays


def _read(path: Path, key: Mapping[str, Any]) -> LogWindows:
    columns, told = read_table(path)
    place = folder_of(Path(), told["name"], told["sha256"], key["profile_sha256"]).name
    if told["schema"] != SCHEMA or told["key"] != key or path.parent.name != place:
        raise FerryIdError(f"{path}: not what was asked for. Fix: delete it, it will be computed again")
    values, parts, low = columns["values"], [], 0
    weight = sample_weights(told["length_s"], told["rate_hz"])[1]
    for one in told["parts"]:
        arrays = {}
        for name, shape in one["arrays"]:
            high = low + int(np.prod(shape))
            arrays[name] = np.ascontiguousarray(values[low:high].reshape(shape, order="F"))
            low = high
        parts.append(_part(arrays, one, weight))
    if low != len(values) or not all(_is_whole(part) for part in parts):
        raise FerryIdError(f"{path}: damaged. Fix: delete it, it will be computed again")
    return LogWindows(
        name=told["name"],
        sha256=told["sha256"],
        files=tuple(told["files"]),
        basis=told["basis"],
        rate_hz=told["rate_hz"],
        length_s=told["length_s"],
        purge_s=told["purge_s"],
        rows=told["rows"],
        parts=tuple(parts),
        warnings=tuple(told["warnings"]),
    )


def _part(arrays: Mapping[str, Floats], told: Mapping[str, Any], weight: Floats) -> WindowPart:
    J = len(arrays["run"])
    shared: dict[str, Any] = {name: arrays[name] for name in _SHARED}
    shared["inertia"] = np.broadcast_to(arrays["inertia"], (J, 3, 3))
    shared |= {name: _rows(arrays[name]) for name in ("run", "start")}
    own: list[dict[str, Any]] = [
        {name: arrays[name] for name in _OWN},
        {name: arrays.get(f"steadied_{name}", arrays[name]) for name in _OWN},
    ]
    measured, steadied = (WeakRows(**shared, **each) for each in own)
    loads: list[LoadSamples | None] = [None, None]
    if "load_psi" in arrays:
        psi, nu = arrays["load_psi"], arrays["load_nu"]
        loads = [LoadSamples(psi, each, weight) for each in (nu, arrays.get("steadied_load_nu", nu))]
    return WindowPart(
        measured=measured,
        steadied=steadied,
        load_measured=loads[0],
        load_steadied=loads[1],
        second=_rows(arrays["second"]),
        nu=arrays["nu"],
        force=np.array(told["force"], dtype=np.float64),
        base=np.array(told["base"], dtype=np.float64),
        ranges={name: (low, high) for name, low, high in told["ranges"]},
        sectors=np.array(told["sectors"], dtype=np.int64),
        rows=int(told["rows"]),
        blocks=int(told["blocks"]),
    )


def _rows(values: Floats) -> Ints:
    """Return numbers of rows, kept as floats (n,)."""
    if not np.isfinite(values).all():
        raise ValueError("a row without a number")
    return values.astype(np.int64)


def _is_whole(part: WindowPart) -> bool:
    """Tell whether the arrays of a part have the shapes of one another and hold numbers."""
    J, (_, K) = len(part.measured), part.measured.functions.shape
    shapes = {"functions": (J, K), "heading": (J, 2), "start": (J,), "inertia": (J, 3, 3)}
    vectors = ("force", "steady", "bare", "by_velocity", "by_pose")
    alike = all(
        getattr(windows, name).shape == shapes.get(name, (J, 3))
        for windows in (part.measured, part.steadied)
        for name in (*shapes, *vectors)
    )
    known = (part.nu, part.force, part.base, part.measured.functions, part.measured.force, part.measured.by_velocity)
    return (
        alike
        and part.nu.shape == (len(part.second), 3)
        and part.force.shape == part.base.shape == (3, 3)
        and all(np.isfinite(one).all() for one in known)
    )
