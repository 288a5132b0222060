"""A new check of the sensors is one file: that of the documents is found, sizes its error and corrects it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose import checks as home
from ferryid.diagnose.checks import checks, examine
from tests.diagnose.checks.test_checks import quiet
from tests.docs.pages import ROOT, blocks

pytestmark = pytest.mark.slow

OFFSET = np.array([0.0, 0.0, 0.02])


@pytest.fixture
def added(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Add the check: one file in a folder of its own."""
    (block,) = (one for one in blocks(ROOT / "docs" / "extending.md") if "CHECK = Check(" in one.text)
    (tmp_path / "yaw_rate_offset.py").write_text(block.text, encoding="utf-8")
    monkeypatch.setattr(home, "__path__", [*home.__path__, str(tmp_path)])
    checks.cache_clear()
    yield
    checks.cache_clear()


@pytest.mark.usefixtures("added")
def test_it_is_found_sized_and_corrected() -> None:
    clean = quiet(1)
    off = replace(clean, nu_raw=clean.nu_raw + OFFSET, nu=clean.nu + OFFSET)
    (finding,), corrected = examine(off)
    assert finding.effect == "yaw_rate_offset"
    offset = finding.parameters["offset"]
    assert offset.low < OFFSET[2] < offset.high
    np.testing.assert_allclose(corrected.nu_raw, clean.nu_raw, atol=1e-3)
    assert examine(clean)[0] == ()


def test_without_its_file_there_is_no_such_check() -> None:
    assert "yaw_rate_offset" not in {check.id for check in checks()}
