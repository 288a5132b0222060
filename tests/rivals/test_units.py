"""A pool of processes can do every unit of the comparison."""

from __future__ import annotations

import pickle
from pathlib import Path

from tests.rivals.units import units


def test_other_processes_can_import_every_unit(tmp_path: Path) -> None:
    """A process that is started afresh does not load the main module of a package, and finds nothing of it."""
    every = units(1, 1, tmp_path)
    assert len({name for name, _, _ in every}) == len(every)
    for name, work, given in every:
        assert not work.__module__.endswith("__main__"), name
        again, _, _ = pickle.loads(pickle.dumps((work, given, name)))
        assert again is work
