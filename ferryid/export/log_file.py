"""Writing a log with the forces that a model makes of it as an MCAP file for PlotJuggler, Foxglove and the like."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid import __version__
from ferryid.errors import FerryIdError
from ferryid.export.findings import diagnostics, finding_values, read_diagnosis, told_by
from ferryid.export.frames import BODY, WORLD, transform_streams
from ferryid.export.layouts import check_layouts, foxglove, layout_files, plotjuggler
from ferryid.export.model_file import SCHEMA
from ferryid.files import parts_of, replacing, resolved, write_text
from ferryid.models import Model
from ferryid.models.forces import base_force
from ferryid.models.prediction import Prediction, predict, predict_base, signal_map
from ferryid.signals.prepare import Prepared, prepare
from ferryid.signals.recording import log_name
from ferryid.signals.track import Motion
from ferryid.simulate.logs import CHUNK_BYTES
from ferryid.simulate.output_paths import check_output
from ferryid.simulate.recorders import write_mcap
from ferryid.simulate.sensors import Stream
from ferryid.types import Floats, TimeRanges
from ferryid.vessel.profile import Profile

_FORCE = "/ferryid/force/"
_END_BYTES = 1 << 20
"""Of a file, which hold its list of topics."""
WINDOW_S = 1.0
"""Smoothing window without a model [s], that of a fit."""
WRENCH = ("wrench.force.x", "wrench.force.y", "wrench.torque.z")
TWIST = ("twist.linear.x", "twist.linear.y", "twist.angular.z")


def export_log(
    log: str,
    mcap: Path,
    out: Path,
    *,
    profile: Profile | None = None,
    model: Model | None = None,
    diagnosis: Path | None = None,
    overwrite: bool = False,
    ranges: TimeRanges = (),
    progress: Callable[[str], None],
) -> dict[str, Any]:
    """Write measured and estimated force, what is left over, motion, and findings, at the log's own times.

    Parameters
    ----------
    log
        A file or folder; parts of one recording joined by ``+``.
    mcap
        File to write.
    out
        Output folder, for the ingested tables.
    profile
        Signal map of the log; the profile inside the model where None.
    model
        The model, None for the profile's hull alone.
    diagnosis
        JSON of a diagnosis of this log, None for no findings.
    overwrite
        Replace an MCAP file that is there.
    ranges
        What of the log is exported; all of it where empty.
    progress
        Called with the name of each stage.

    Returns
    -------
    dict
        Schema ``ferryid.export/1``.

    Raises
    ------
    FerryIdError
        For a log, model or diagnosis that cannot be used together, and a place that cannot or must not be written to.
    """
    if model is not None:
        profile = signal_map(model, profile)
    if profile is None:
        raise FerryIdError(
            f"{log}: where its signals are is not known, found neither model nor profile. Fix: give --model or --vessel"
        )
    _check_place(log, mcap, overwrite=overwrite)
    found = None if diagnosis is None else read_diagnosis(diagnosis, log_name(log))
    settings = {} if model is None else model.settings
    window_s, smoother = float(settings.get("window_s", WINDOW_S)), str(settings.get("smoother", "square"))
    progress(f"reading {Path(log).name}")
    prepared = prepare(
        log,
        profile,
        out,
        window_s=window_s,
        smoother=smoother,
        rate_hz=settings.get("rate_hz"),
        keep_track=True,
        ranges=ranges,
    )
    motion, track = prepared.motion, prepared.track
    assert track is not None
    estimated: Prediction | None = None
    if model is None:
        base = base_force(profile, motion, {})
    else:
        estimated = predict(model, prepared, profile, window_s=window_s, smoother=smoother)
        base = predict_base(model, prepared, profile, window_s=window_s, smoother=smoother).tau
    progress("writing")
    streams = _streams(motion, track.t0_ns, base, None if estimated is None else estimated.tau)
    if diagnosis is not None and found is not None:
        told = told_by(diagnosis, found, float(motion.t[-1]))
        streams.append(diagnostics(told, track.t0_ns, profile.name))
        streams += finding_values(diagnosis, found, track.t0_ns, float(motion.t[-1]))
    _check_any(streams, prepared)
    about = {
        "version": __version__,
        "vessel": profile.name,
        "model": "" if model is None else model.label,
        "log": motion.log,
        "log_sha256": prepared.recording.sha256,
        "window_s": f"{window_s:g}",
        "smoother": smoother,
    }
    with replacing(mcap, new=not overwrite, by="--mcap") as temporary:
        write_mcap(streams, temporary, CHUNK_BYTES, library=f"ferryid {__version__}", metadata={"ferryid": about})
    topics = [one.topic for one in streams]
    layouts = layout_files(mcap)
    for place, text in zip(layouts, (plotjuggler(topics, mcap), foxglove(topics)), strict=True):
        write_text(place, text, by="--mcap")
    return {
        "schema": SCHEMA,
        "kind": "log",
        "file": str(mcap),
        "log": {"name": motion.log, "sha256": prepared.recording.sha256},
        "vessel": profile.name,
        "model": None if model is None else model.label,
        "window_s": window_s,
        "start_ns": track.t0_ns,
        "topics": [{"topic": one.topic, "type": one.type, "messages": len(one.stamp_ns)} for one in streams],
        "layouts": [str(place) for place in layouts],
        "rows": len(motion.t),
        "rows_left_out": int((~_known(motion, motion.nu)).sum()),
        "warnings": [*prepared.doubts, *prepared.left_out, *(() if estimated is None else estimated.idle)],
    }


def _check_place(log: str, mcap: Path, *, overwrite: bool) -> None:
    if mcap.suffix.lower() != ".mcap":
        raise FerryIdError(f'{mcap}: is written as MCAP, found the suffix "{mcap.suffix}". Fix: end the name in .mcap')
    read = [Path(part) for part in parts_of(log)]
    for one in read:
        # A file more in the folder of a recording would be read as a part of it.
        if one.is_dir() and resolved(mcap).is_relative_to(resolved(one)):
            raise FerryIdError(f"{mcap}: lies in the log that it is made from, {one}. Fix: give it another place")
    check_output(mcap, overwrite=overwrite, inputs=read)
    check_layouts(mcap)
    if mcap.is_file() and not _is_export(mcap):
        raise FerryIdError(f"{mcap}: cannot be replaced, found no export. Fix: give --mcap another name")


def _is_export(mcap: Path) -> bool:
    """Tell whether a file is one of ours, by the topics listed at its end: no recording may be lost to `overwrite`."""
    with mcap.open("rb") as file:
        file.seek(max(0, mcap.stat().st_size - _END_BYTES))
        return f"{_FORCE}measured".encode() in file.read()


def _known(motion: Motion, values: Floats) -> NDArray[np.bool_]:
    return np.asarray(motion.valid & np.isfinite(values).all(axis=1))


def _streams(motion: Motion, t0_ns: int, base: Floats, tau: Floats | None) -> list[Stream]:
    """Return every topic, without the rows of which a value is not known."""
    times = t0_ns + np.round(motion.t * 1e9).astype(np.int64)

    def stream(topic: str, kind: str, frame: str, fields: tuple[str, ...], values: Floats) -> Stream:
        rows = _known(motion, values)
        columns = dict(zip(fields, values[rows].T, strict=True))
        return Stream(topic, f"geometry_msgs/msg/{kind}", frame, times[rows], times[rows], columns)

    forces = {"measured": motion.tau, "base": base, **({} if tau is None else {"model": tau})}
    forces["residual"] = motion.tau - (base if tau is None else tau)
    half = 0.5 * motion.eta[:, 2]
    pose = np.column_stack([motion.eta[:, :2], np.cos(half), np.sin(half)])
    where = ("pose.position.x", "pose.position.y", "pose.orientation.w", "pose.orientation.z")
    made = [stream(f"{_FORCE}{name}", "WrenchStamped", BODY, WRENCH, force) for name, force in forces.items()]
    made.append(stream("/ferryid/velocity", "TwistStamped", BODY, TWIST, motion.nu))
    made.append(stream("/ferryid/pose", "PoseStamped", WORLD, where, pose))
    placed = _known(motion, motion.eta)
    if placed.any():
        made += transform_streams(times[placed], motion.eta[placed])
    return [one for one in made if len(one.stamp_ns)]


def _check_any(streams: list[Stream], prepared: Prepared) -> None:
    if not any(one.topic.startswith(_FORCE) for one in streams):
        raise FerryIdError(
            f"{prepared.motion.log}: no row of it has both motion and force, so there is nothing to write. "
            "Fix: see what is missing with ferryid inspect --vessel"
        )
