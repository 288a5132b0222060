"""The notebooks run, and their committed outputs are those of a run."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import nbformat
import pytest

from tests.docs.notebooks import notebooks, run

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
NEAR = 0.05
"""Numbers of another processor may differ by this much, or by three in their last digit."""


def shown(book: Any) -> list[tuple[int, str, str]]:
    """Return the texts that a notebook shows: number of the cell, kind and text; of pictures and pages that they are there."""
    found = []
    for place, cell in enumerate(book.cells):
        for output in cell.get("outputs", ()):
            assert output.output_type != "error", f"cell {place}: {output.get('evalue')}"
            if output.output_type == "stream":
                found.append((place, output.name, output.text))
                continue
            for kind, content in sorted(output.data.items()):
                found.append((place, kind, content if kind == "text/plain" else ""))
    return found


def alike(text: str, other: str) -> bool:
    """Tell whether two texts are the same but for small differences of numbers, and of the spaces that align them."""
    one, two = ([part for part in re.split(rf"\s+|({NUMBER.pattern})", each) if part] for each in (text, other))
    return len(one) == len(two) and all(_alike(a, b) for a, b in zip(one, two, strict=True))


def _alike(a: str, b: str) -> bool:
    if a == b:
        return True
    if not (NUMBER.fullmatch(a) and NUMBER.fullmatch(b)):
        return False
    last = 10.0 ** -len(a.partition(".")[2])
    return math.isclose(float(a), float(b), rel_tol=NEAR, abs_tol=3.0 * last)


@pytest.mark.slow
@pytest.mark.parametrize("path", notebooks(), ids=lambda path: path.stem)
def test_the_outputs_are_those_of_a_run(path: Path, tmp_path: Path) -> None:
    kept, made = (shown(book) for book in (nbformat.read(path, as_version=4), run(path, tmp_path)))
    assert [one[:2] for one in kept] == [one[:2] for one in made], "Fix: python -m tests.docs.notebooks"
    for (place, kind, old), (_, _, new) in zip(kept, made, strict=True):
        assert alike(old, new), f"cell {place}, {kind}: {old}\n{new}\nFix: python -m tests.docs.notebooks"


@pytest.mark.slow
def test_what_a_slow_machine_prints_in_pieces_is_one_output(tmp_path: Path) -> None:
    code = "import time\nprint('first', flush=True)\ntime.sleep(0.5)\nprint('second')"
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code)])
    book.metadata = nbformat.read(notebooks()[0], as_version=4).metadata
    nbformat.write(book, tmp_path / "pieces.ipynb")
    assert shown(run(tmp_path / "pieces.ipynb", tmp_path)) == [(0, "stdout", "first\nsecond\n")]


@pytest.mark.parametrize("path", notebooks(), ids=lambda path: path.stem)
def test_every_cell_was_run_in_order_and_shows_something(path: Path) -> None:
    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    counts = [cell.execution_count for cell in book.cells if cell.cell_type == "code"]
    assert counts == list(range(1, len(counts) + 1))
    assert len(shown(book)) > 5
    # No page is kept twice: notebooks stay small.
    assert path.stat().st_size < 400_000


def test_numbers_may_differ_a_little_and_words_not() -> None:
    assert alike("wind 4.02 m/s  (3.9)", "wind 4.01 m/s (3.9)")
    assert not alike("wind 4.02 m/s", "wind 4.92 m/s")
    assert not alike("wind 4.02 m/s", "current 4.02 m/s")
