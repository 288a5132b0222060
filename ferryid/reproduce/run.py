"""Carrying out a reproduction: every study, its figures, the page and the JSON result."""

from __future__ import annotations

import importlib
import multiprocessing
import pkgutil
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import nullcontext
from pathlib import Path
from types import ModuleType
from typing import Any

import ferryid.reproduce.studies
from ferryid import __version__
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.files import replacing, write_text
from ferryid.report.thesis_figures import draw
from ferryid.reproduce.lab import Lab, seeds
from ferryid.reproduce.page import page
from ferryid.reproduce.study import Study, plain

SCHEMA = "ferryid.reproduce/1"
WHAT = ("thesis",)
MOST_PROCESSES = 64


def studies() -> dict[str, ModuleType]:
    """Return every study's module by its name, in the order of the page."""
    found = {
        one.name: importlib.import_module(f"{ferryid.reproduce.studies.__name__}.{one.name}")
        for one in pkgutil.iter_modules(ferryid.reproduce.studies.__path__)
    }
    return dict(sorted(found.items(), key=lambda item: item[1].PLACE))


def reproduce(
    what: str,
    out: Path,
    *,
    only: Sequence[str] = (),
    repetitions: int = 7,
    processes: int = 2,
    progress: Callable[[str], None],
) -> dict[str, Any]:
    """Carry out a reproduction and write its page and figures.

    Parameters
    ----------
    what
        ``"thesis"``.
    out
        Folder; the page is ``<what>.md`` in it, the figures lie in ``<what>/``.
    only
        Names of studies; all where empty.
    repetitions
        Number of seeds.
    processes
        How many to share the work among; 1 stays in this one.
    progress
        Called with the name of each stage.

    Returns
    -------
    dict
        Schema ``ferryid.reproduce/1``.

    Raises
    ------
    FerryIdError
        For a study that does not exist, or a number that is not possible.
    """
    if what not in WHAT:
        raise FerryIdError(
            f'"{what}": there is nothing of this name to reproduce.{did_you_mean(what, WHAT)} Fix: choose of {", ".join(WHAT)}'
        )
    if not 1 <= processes <= MOST_PROCESSES:
        raise FerryIdError(f"--processes: {processes} is no number of processes. Fix: give 1 to {MOST_PROCESSES}")
    chosen, numbers = _chosen(only), seeds(repetitions)
    with tempfile.TemporaryDirectory(prefix="ferryid-") as folder, _pool(processes) as pool:
        lab = Lab(numbers, Path(folder), pool, progress)
        done: list[Study] = [module.study(lab) for module in chosen.values()]
    progress("drawing")
    path = out / f"{what}.md"
    with replacing(out / what) as pictures:
        pictures.mkdir(parents=True)
        for study in done:
            for drawing in study.drawings:
                (pictures / f"{drawing.name}.svg").write_text(draw(drawing), encoding="utf-8")
    write_text(path, page(done, numbers, what))
    progress("")
    return {
        "schema": SCHEMA,
        "what": what,
        "ferryid_version": __version__,
        "seeds": list(numbers),
        "page": str(path),
        "figures": str(out / what),
        "studies": [plain(study) for study in done],
    }


def _chosen(only: Sequence[str]) -> dict[str, ModuleType]:
    known = studies()
    for name in only:
        if name not in known:
            raise FerryIdError(
                f'--only: there is no study called "{name}".{did_you_mean(name, known)} Fix: choose of {", ".join(known)}'
            )
    return {name: module for name, module in known.items() if not only or name in only}


def _pool(processes: int) -> Any:
    """Return a context of worker processes, or of None where this one does the work.

    They are started afresh: a forked copy of a process with threads (NumPy's, PyArrow's) may hang.
    """
    if processes == 1:
        nothing: nullcontext[Executor | None] = nullcontext(None)
        return nothing
    return ProcessPoolExecutor(processes, mp_context=multiprocessing.get_context("spawn"))


def render_reproduction(result: dict[str, Any]) -> str:
    """Return a short account of a reproduction as text."""
    lines = []
    for study in result["studies"]:
        lines += ["", study["title"]]
        for row in study["rows"]:
            theirs = "-" if row["theirs"] is None else row["theirs"]
            ours = row["ours"]
            lines.append(
                f"  {row['quantity']} [{row['unit'] or '1'}]: theirs {theirs}, "
                f"ours {ours['median']:.3g} ({ours['low']:.3g} to {ours['high']:.3g})"
            )
    lines += ["", f"page:    {result['page']}", f"figures: {result['figures']}"]
    return "\n".join(lines[1:] if lines and not lines[0] else lines)
