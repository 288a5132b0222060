"""The proof with its real parts, in small."""

from __future__ import annotations

import re
from pathlib import Path

from ferryid.prove.judges import parts
from ferryid.prove.run import prove
from ferryid.prove.seal import verified


def test_a_gross_wind_in_five_minutes(tmp_path: Path) -> None:
    told: list[str] = []
    result = prove(
        tmp_path,
        parts(),
        seed=3,
        runs=0.1,
        only=("short: wind",),
        progress=lambda stage: None,
        tell=told.append,
    )
    assert result["counts"]["diagnosed"] == 1
    answers = verified(tmp_path / "proof")
    (truth,) = answers["cases"][0]["truths"]
    assert truth["effect"] == "wind"
    (cell,) = result["scores"]["cells"]
    assert cell["cell"] == "short: wind"
    # Every rival was asked, on a second log of the same wind.
    assert {one["name"] for one in result["scores"]["methods"]} == {"diagnosed", "thesis", "sindy", "stepwise"}
    page = (tmp_path / "proof" / "proof.md").read_text("utf-8")
    assert result["commitment"] in page
    for name in re.findall(r"\]\((proof/[^)]*svg)\)", page):
        if name != "proof/detection.svg" and name != "proof/errors.svg":
            assert (tmp_path / "proof" / name).read_text("utf-8").startswith("<?xml")
