"""Writing a simulated trial as a log: MCAP, ROS1 bag or ROS2 folder, the same bytes for the same trial."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.rosbag2.enums import CompressionFormat

from ferryid import __version__
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.files import replacing
from ferryid.simulate.messages import serialised, typestore
from ferryid.simulate.sensors import Stream
from ferryid.simulate.trial import Simulation

STORAGES = ("sqlite3", "mcap")
CHUNK_BYTES = 768 * 1024


def write_log(
    simulation: Simulation,
    out: Path,
    truth: Path | None = None,
    *,
    storage: str = "sqlite3",
    overwrite: bool = False,
    chunk_bytes: int = CHUNK_BYTES,
) -> None:
    """Write the log of a trial, in the format that the name of `out` asks for.

    Parameters
    ----------
    simulation
        From `ferryid.simulate.simulate`.
    out
        ``*.mcap``, ``*.bag`` (ROS1), or a name without suffix for a ROS2 folder.
    truth
        Parquet file for the true states, None for no such file.
    storage
        Storage of a ROS2 folder: ``sqlite3`` or ``mcap``.
    overwrite
        Replace what is there.
    chunk_bytes
        Size of a chunk of an MCAP file or a bag before compression.

    Raises
    ------
    FerryIdError
        For a suffix or storage that is not one of these, existing output, or a place that cannot be written.
    """
    check_output(out, truth, storage=storage, overwrite=overwrite)
    suffix = out.suffix.lower()
    streams = [stream for stream in simulation.streams if len(stream.stamp_ns)]
    if suffix == ".mcap":
        with replacing(out) as temporary:
            _write_mcap(streams, temporary, chunk_bytes)
    elif suffix == ".bag":
        with replacing(out) as temporary:
            _write_ros1(streams, temporary, chunk_bytes)
    else:
        with replacing(out) as temporary, _inside(temporary, out.name) as folder:
            _write_ros2(streams, folder, storage)
    if truth is not None:
        with replacing(truth) as temporary:
            _write_truth(simulation, temporary)


def check_output(out: Path, truth: Path | None = None, *, storage: str = "sqlite3", overwrite: bool = False) -> None:
    """Refuse names and places that `write_log` cannot or must not write to; the parameters are the same."""
    if storage not in STORAGES:
        raise FerryIdError(
            f'{out}: storage of a ROS2 folder cannot be "{storage}".{did_you_mean(storage, STORAGES)} '
            f"Fix: use one of {', '.join(STORAGES)}"
        )
    suffix = out.suffix.lower()
    if suffix not in ("", ".mcap", ".bag"):
        raise FerryIdError(
            f'{out}: the suffix says which format to write, found "{suffix}". '
            "Fix: end the name in .mcap, .bag (ROS1), or nothing for a ROS2 folder"
        )
    _check_free(out, folder=suffix == "", overwrite=overwrite)
    if truth is not None:
        if truth.resolve() == out.resolve():
            raise FerryIdError(f"{truth}: log and truth cannot be the same file. Fix: give --truth another name")
        _check_free(truth, folder=False, overwrite=overwrite)


def _check_free(path: Path, *, folder: bool, overwrite: bool) -> None:
    """Refuse to replace anything unasked, and never a folder by a file or a folder that is not a recording."""
    if not path.exists():
        return
    if not overwrite:
        raise FerryIdError(f"{path}: exists already. Fix: choose another name, or replace it with --overwrite")
    if path.is_dir() != folder or (folder and not (path / "metadata.yaml").exists()):
        raise FerryIdError(
            f"{path}: cannot be replaced, found {'a folder that is no ROS2 recording' if path.is_dir() else 'a file'}. "
            "Fix: choose another name"
        )


@contextmanager
def _inside(temporary: Path, name: str) -> Iterator[Path]:
    """Give a folder called `name`, after which its storage file is named, and move it to `temporary` at the end."""
    holder = temporary.with_name(f"{temporary.name}.d")
    holder.mkdir()
    try:
        yield holder / name
        (holder / name).replace(temporary)
    finally:
        shutil.rmtree(holder)


def _in_order(streams: list[Stream], ros_version: int) -> Iterator[tuple[int, int, int, bytes]]:
    """Yield (receive time, stream index, stamp, bytes) of all messages as a recorder gets them."""
    receive = np.concatenate([stream.receive_ns for stream in streams])
    stamps = np.concatenate([stream.stamp_ns for stream in streams])
    index = np.repeat(np.arange(len(streams)), [len(stream.stamp_ns) for stream in streams])
    order = np.lexsort((index, receive))
    messages = [serialised(stream, ros_version) for stream in streams]
    for when, which, stamp in zip(receive[order].tolist(), index[order].tolist(), stamps[order].tolist(), strict=True):
        yield when, which, stamp, next(messages[which])


def _write_mcap(streams: list[Stream], path: Path, chunk_bytes: int) -> None:
    store = typestore(2)
    with path.open("wb") as file:
        writer = McapWriter(file, chunk_size=chunk_bytes, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library=f"ferryid {__version__}")
        schemas: dict[str, int] = {}
        channels = []
        for stream in streams:
            if stream.type not in schemas:
                text = store.generate_msgdef(stream.type, ros_version=2)[0]
                schemas[stream.type] = writer.register_schema(stream.type, "ros2msg", text.encode())
            channels.append(writer.register_channel(stream.topic, "cdr", schemas[stream.type]))
        counts = [0] * len(streams)
        for when, index, stamp, data in _in_order(streams, 2):
            writer.add_message(channels[index], when, data, publish_time=stamp, sequence=counts[index])
            counts[index] += 1
        writer.finish()  # type: ignore[no-untyped-call]


def _write_ros1(streams: list[Stream], path: Path, chunk_bytes: int) -> None:
    store = typestore(1)
    writer = Ros1Writer(path)
    writer.chunk_threshold = chunk_bytes
    writer.set_compression(Ros1Writer.CompressionFormat.LZ4)
    with writer:
        connections = [writer.add_connection(s.topic, s.type, typestore=store) for s in streams]
        for when, index, _, data in _in_order(streams, 1):
            writer.write(connections[index], when, data)


def _write_ros2(streams: list[Stream], folder: Path, storage: str) -> None:
    store = typestore(2)
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    writer = Ros2Writer(folder, version=9, storage_plugin=plugin)
    if plugin is StoragePlugin.MCAP:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    try:
        with writer:
            connections = [writer.add_connection(s.topic, s.type, typestore=store) for s in streams]
            for when, index, _, data in _in_order(streams, 2):
                writer.write(connections[index], when, data)
    except sqlite3.Error as error:
        raise FerryIdError(
            f"{folder.name}: the database cannot be written, {error}. Fix: check the space on the disk"
        ) from error


def _write_truth(simulation: Simulation, path: Path) -> None:
    """Write the true states as one Parquet table, the scenario in its metadata."""
    truth = simulation.truth
    columns = {"t": truth.t}
    for names, values in (
        (("x", "y", "psi"), truth.eta),
        (("u", "v", "r"), truth.nu),
        (("u_dot", "v_dot", "r_dot"), truth.nu_dot),
        (("X", "Y", "N"), truth.tau),
        (("wind_N", "wind_E"), truth.wind),
        (("current_N", "current_E"), truth.current),
        (tuple(f"n_{actuator.name}" for actuator in simulation.profile.actuators), truth.speeds),
        (tuple(f"alpha_{actuator.name}" for actuator in simulation.profile.actuators), truth.angles),
    ):
        columns.update(zip(names, values.T, strict=True))
    table = pa.table({name: pa.array(np.ascontiguousarray(values)) for name, values in columns.items()})
    metadata = {
        "ferryid": __version__,
        "scenario": simulation.scenario.name,
        "seed": str(simulation.seed),
        "start_ns": str(simulation.scenario.start_ns),
        "toml": simulation.scenario.text,
    }
    pq.write_table(table.replace_schema_metadata(metadata), path)
