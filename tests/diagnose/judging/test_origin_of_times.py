"""Times of a diagnosis of a part of a log: where they begin is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from ferryid.diagnose.judging.conclude import origin_note
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
from ferryid.types import RunContext
from ferryid.vessel import load_profile

SHORT = Path(__file__).resolve().parents[3] / "fixtures" / "short.mcap"
FROM_20 = "Times are from the start of what was selected, 20 s into the log."


@pytest.mark.parametrize(
    ("sha256", "told"),
    [
        ("ab", ()),
        ("ab#t=0,60", ()),
        ("ab#t=20.0,60", (FROM_20,)),
        ("ab#t=12345.68,20000", ("Times are from the start of what was selected, 12345.7 s into the log.",)),
    ],
)
def test_only_a_start_that_was_cut_off_is_told(sha256: str, told: tuple[str, ...]) -> None:
    assert origin_note(sha256) == told


@pytest.mark.slow
def test_a_diagnosis_of_a_part_of_a_log_says_where_its_times_begin(tmp_path: Path) -> None:
    for ranges, told in (((("20", None),), 1), ((), 0)):
        (found,) = diagnose(
            [str(SHORT)], load_profile("milliampere"), DiagnosisSettings(), RunContext(tmp_path, ranges=ranges)
        )
        assert found.notes.count(FROM_20) == told
