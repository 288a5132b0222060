"""Runs the notebooks in docs/notebooks and keeps their outputs: ``python -m tests.docs.notebooks``."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "notebooks"
LONGEST_S = 900
"""A cell may take [s], on a machine that does much else."""


def notebooks() -> list[Path]:
    """Return the notebooks."""
    return sorted(FOLDER.glob("*.ipynb"))


def run(path: Path, folder: Path) -> Any:
    """Return a notebook with the outputs of a run in an empty folder; an error in a cell is raised."""
    book = nbformat.read(path, as_version=4)
    NotebookClient(
        book,
        timeout=LONGEST_S,
        resources={"metadata": {"path": str(folder)}},
        record_timing=False,
        # What is printed comes in as many pieces as the machine is slow.
        coalesce_streams=True,
    ).execute()
    # What the run, not the notebook, determines.
    book.metadata = {"kernelspec": book.metadata["kernelspec"], "language_info": {"name": "python"}}
    return book


if __name__ == "__main__":
    for one in notebooks():
        if len(sys.argv) > 1 and one.stem not in sys.argv[1:]:
            continue
        with tempfile.TemporaryDirectory() as empty:
            nbformat.write(run(one, Path(empty)), one)
        sys.stdout.write(f"{one}\n")
