"""A whole archive of recordings, and the installation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ferryid.api.arguments import OUT, Logs, Progress, Ranges, outcome_of, paths_of, quiet
from ferryid.side_by_side import blas_on_one_thread

if TYPE_CHECKING:
    from ferryid.report.outcome import Outcome


@blas_on_one_thread
def batch(
    logs: Logs,
    out: str | Path = OUT,
    *,
    vessel: str | None = None,
    recipe: Path | None = None,
    processes: int = 2,
    dask: str | None = None,
    memory_limit: str = "4G",
    again: bool = False,
    progress: Progress = quiet,
    ranges: Ranges = (),
    tell: Progress = quiet,
) -> Outcome:
    """Fit, evaluate and diagnose every log of an archive; what is done stays done. See `ferryid.batch.run.batch`."""
    from ferryid.batch.run import batch as run_batch
    from ferryid.batch.run import render_batch

    result = run_batch(
        paths_of(logs), Path(out), vessel=vessel, recipe=recipe, processes=processes, dask=dask, memory_limit=memory_limit,
        again=again, ranges=tuple(ranges), progress=progress, tell=tell,
    )  # fmt: skip
    return outcome_of(result.to_json(), render_batch(result))


def doctor(out: str | Path = OUT) -> Outcome:
    """Return the state of this installation; ``json["problems"]`` is empty where every command can run."""
    from ferryid.doctor import examine, render

    result = examine(Path(out))
    return outcome_of(result, render(result))
