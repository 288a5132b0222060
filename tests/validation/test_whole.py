"""The validation run as it is, in small."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ferryid.validation.commitment import verified_answers
from ferryid.validation.evaluators import pipeline
from ferryid.validation.run import run_validation

pytestmark = [pytest.mark.slow, pytest.mark.draws]


def test_a_gross_wind_in_five_minutes(tmp_path: Path) -> None:
    result = run_validation(
        tmp_path,
        pipeline(),
        seed=3,
        runs=0.1,
        only=("short: wind",),
        progress=lambda stage: None,
        announce=lambda line: None,
    )
    assert result["counts"]["diagnosed"] == 1
    answers = verified_answers(tmp_path / "proof")
    (truth,) = answers["cases"][0]["truths"]
    assert truth["effect"] == "wind"
    (cell,) = result["scores"]["cells"]
    assert cell["cell"] == "short: wind"
    # Every rival was asked, on a second log of the same wind.
    assert {one["name"] for one in result["scores"]["methods"]} == {"diagnosed", "thesis", "sindy", "stepwise"}
    page = (tmp_path / "proof" / "proof.md").read_text("utf-8")
    assert result["commitment"] in page
    linked = re.findall(r"\]\((proof/[^)]*svg)\)", page)
    assert "proof/confusion.svg" in linked
    for name in linked:
        assert (tmp_path / "proof" / name).read_text("utf-8").startswith("<?xml")
