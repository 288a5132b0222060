"""Writing a simulated trial as a log: MCAP, ROS1 bag or ROS2 folder, the same bytes for the same trial."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from ferryid import __version__
from ferryid.files import replacing
from ferryid.simulate.output_paths import check_output
from ferryid.simulate.recorders import write_mcap
from ferryid.simulate.trial import Simulation

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
    # Both are whole before either gets its name.
    with ExitStack() as both:
        temporary = both.enter_context(replacing(out, new=not overwrite))
        if suffix == ".mcap":
            write_mcap(streams, temporary, chunk_bytes)
        elif suffix == ".bag":
            from ferryid.simulate.rosbag_recorders import write_ros1

            write_ros1(streams, temporary, chunk_bytes)
        else:
            from ferryid.simulate.rosbag_recorders import write_ros2

            with _inside(temporary, out.name) as folder:
                write_ros2(streams, folder, storage)
        if truth is not None:
            _write_truth(simulation, both.enter_context(replacing(truth, new=not overwrite)))


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


def _write_truth(simulation: Simulation, path: Path) -> None:
    """Write the true states as one Parquet table, the scenario in its metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    truth = simulation.truth
    columns = {"t": truth.t}
    for names, values in (
        (("x", "y", "psi"), truth.eta),
        (("u", "v", "r"), truth.nu),
        (("u_dot", "v_dot", "r_dot"), truth.nu_dot),
        (("X", "Y", "N"), truth.tau),
        (("wave_X", "wave_Y", "wave_N"), truth.wave),
        (("roll", "pitch"), truth.attitude),
        (("wind_N", "wind_E"), truth.wind),
        (("current_N", "current_E"), truth.current),
        (("payload_mass", "payload_x"), truth.payload),
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
    # Opened here: pyarrow takes no path with bytes that are no characters.
    with path.open("wb") as file:
        pq.write_table(table.replace_schema_metadata(metadata), file)
