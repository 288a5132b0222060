"""Results of one unit of work each, kept as lines of JSON, so that a run that was ended goes on where it stood."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.evidence import state
from tests.rivals.scores import Score
from tests.rivals.simulated import Findings, Found

PAGE = "reports/rivals.md"


@dataclass(frozen=True)
class Lines:
    """A file of results, of which only those of the present sources count.

    Attributes
    ----------
    path
        The file; it need not be there.
    sources
        Hash of all sources that results depend on.
    """

    path: Path
    sources: str

    @classmethod
    def of(cls, path: Path) -> Lines:
        """Return the lines in a file for the sources as they are."""
        every = json.dumps(state(PAGE), sort_keys=True)
        return cls(path, hashlib.sha256(every.encode()).hexdigest()[:16])

    def known(self) -> dict[str, Any]:
        """Return the results that are there, by the name of their unit; the last line may be cut off."""
        found = {}
        for line in self._read():
            if line["sources"] == self.sources:
                found[line["unit"]] = line["result"]
        return found

    def _read(self) -> Iterator[dict[str, Any]]:
        if not self.path.exists():
            return
        for text in self.path.read_text(encoding="utf-8").splitlines():
            try:
                yield json.loads(text)
            except json.JSONDecodeError:
                continue

    def add(self, unit: str, result: Any) -> None:
        """Append a result."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"sources": self.sources, "unit": unit, "result": result})
        begun = self.path.exists() and not self.path.read_bytes().endswith(b"\n")
        with self.path.open("a", encoding="utf-8") as file:
            file.write(("\n" if begun else "") + text + "\n")


def packed(findings: Findings) -> dict[str, Any]:
    """Return findings as plain values."""
    return {name: one if isinstance(one, str) else _plain(one) for name, one in findings.items()}


def unpacked(plain: dict[str, Any]) -> Findings:
    """Return the findings of `packed`."""
    return {name: one if isinstance(one, str) else _made(Found, one) for name, one in plain.items()}


def packed_scores(scores: dict[str, Score]) -> dict[str, Any]:
    """Return scores as plain values."""
    return {name: _plain(one) for name, one in scores.items()}


def unpacked_scores(plain: dict[str, Any]) -> dict[str, Score]:
    """Return the scores of `packed_scores`."""
    return {name: _made(Score, {**one, "failed": tuple(one["failed"])}) for name, one in plain.items()}


def _plain(one: Found | Score) -> dict[str, Any]:
    values = {name: getattr(one, name) for name in one.__dataclass_fields__}
    return {
        name: {"shape": value.shape, "values": value.ravel().tolist()} if isinstance(value, np.ndarray) else value
        for name, value in values.items()
    }


def _made(kind: Callable[..., Any], values: dict[str, Any]) -> Any:
    return kind(
        **{
            name: np.array(value["values"], dtype=np.float64).reshape(value["shape"])
            if isinstance(value, dict)
            else value
            for name, value in values.items()
        }
    )
