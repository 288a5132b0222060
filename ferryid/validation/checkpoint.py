"""Checkpoints: a file of JSON lines a stage, one line a case, written whole as soon as the case is done."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from ferryid.batch.spread import Spread
from ferryid.files import finite, unwritable, write_text
from ferryid.json_record import Record
from ferryid.validation.pace import Pace

T = TypeVar("T")


@dataclass(frozen=True)
class Line(Record):
    """A line of a checkpoint file: the name of a case, and its result as plain data."""

    name: str
    result: Any

    def text(self) -> str:
        """Return the line as it is written."""
        return json.dumps(self.to_json(), allow_nan=False) + "\n"


def completed(path: Path) -> dict[str, Any]:
    """Return the results in a file by the name of their case; lines that broke off count as not done."""
    if not path.exists():
        return {}
    data = path.read_bytes()
    whole = data[: data.rfind(b"\n") + 1]
    if whole != data:
        with path.open("r+b") as file:
            file.truncate(len(whole))
    results = {}
    for text in whole.splitlines():
        try:
            line = Line.from_json(json.loads(text))
            results[line.name] = line.result
        except ValueError:  # what a crash of the machine left of it: to be done again
            continue
    return results


def discard(path: Path, names: Iterable[str]) -> None:
    """Have some cases of a stage done again."""
    gone, lines = set(names), completed(path)
    if gone & set(lines):
        kept = [Line(name, result) for name, result in lines.items() if name not in gone]
        write_text(path, "".join(line.text() for line in kept))


def run_stage(
    stage: str,
    path: Path,
    work: Mapping[str, T],
    function: Callable[[T], Any],
    workers: Spread,
    *,
    progress: Callable[[str], None],
    pace: Pace | None = None,
) -> dict[str, Any]:
    """Do what is left of some work, and return the results of all of it by name, in the order of the work.

    Parameters
    ----------
    stage
        Name of the stage, for people.
    path
        JSON lines of this and earlier times.
    work
        What `function` is given, by the name of its case.
    function
        Returns plain data.
    workers
        What carries it out.
    progress
        Called with what is done and the time left.
    pace
        Of the run whose stage this is; None where it is all there is.
    """
    done = {name: result for name, result in completed(path).items() if name in work}
    left = [name for name in work if name not in done]
    if left:
        pace = pace or Pace((stage,), len(work))
        progress(pace.begun(stage, len(done)))
        pace.begin()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            file = path.open("a", encoding="utf-8")
        except OSError as error:
            raise unwritable(path, error) from error
        with file:
            for count, (number, result) in enumerate(workers.over(function, [work[name] for name in left]), 1):
                done[left[number]] = written = finite(result)
                try:
                    file.write(Line(left[number], written).text())
                    file.flush()
                except OSError as error:
                    raise unwritable(path, error) from error
                progress(pace.told(stage, len(done), count))
        progress("")
    return {name: done[name] for name in work}
