"""The logs that a fit starts from, and their order."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from ferryid.identify import inputs
from ferryid.identify.settings import FitSettings
from ferryid.signals.copies import GivenLogs
from ferryid.types import RunContext
from ferryid.vessel import load_profile

DAY_NS = 86_400 * 10**9
IN_1980_NS = 315_964_800 * 10**9
IN_2026_NS = 1_780_000_000 * 10**9


@pytest.mark.parametrize(
    ("begins", "given", "read"),
    [
        ({"a": IN_2026_NS, "b": IN_2026_NS + DAY_NS, "c": IN_2026_NS + 2 * DAY_NS}, "bca", "abc"),
        ({"a": IN_2026_NS, "b": IN_2026_NS + DAY_NS, "c": IN_2026_NS + 2 * DAY_NS}, "cab", "abc"),
        # Logs of a simulator begin at once, and a clock that was not set begins at zero.
        ({"a": IN_2026_NS, "b": IN_2026_NS, "c": IN_2026_NS}, "bca", "bca"),
        ({"a": IN_2026_NS, "b": IN_1980_NS, "c": IN_2026_NS + DAY_NS}, "cba", "cba"),
        ({"a": IN_2026_NS, "b": 0, "c": IN_2026_NS + DAY_NS}, "cba", "cba"),
    ],
    ids=["in 2026", "in another order", "at once", "clock of GPS not set", "no date"],
)
def test_logs_are_read_into_order_of_time(
    monkeypatch: pytest.MonkeyPatch, begins: dict[str, int], given: str, read: str
) -> None:
    def opened(path: str, *_: object, **__: object) -> SimpleNamespace:
        return SimpleNamespace(path=path, recording=SimpleNamespace(start_ns=begins[path]))

    monkeypatch.setattr(inputs, "open_track", opened)
    monkeypatch.setattr(GivenLogs, "add", lambda *_: None)
    found = inputs.read_logs(list(given), load_profile("milliampere"), FitSettings(), RunContext(Path("nowhere")))
    assert "".join(one.path for one in found) == read  # type: ignore[attr-defined]
