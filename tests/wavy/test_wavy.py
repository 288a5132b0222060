"""Waves that nobody measured do not spoil the hull that a diagnosis learns among them, where they spoil a regression."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.command_line.in_process import invoke
from tests.wavy import wavy as study
from tests.wavy.wavy import AXES, lines, wavy

pytestmark = pytest.mark.slow


def test_a_hull_learnt_in_waves_serves_in_calm_water(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def here(*arguments: str) -> dict[str, Any]:
        run = invoke(*arguments, "--json", "-")
        assert run.code == 0, run.err
        return dict(json.loads(run.out))

    # Without eight processes that begin by importing everything.
    monkeypatch.setattr(study, "_ferryid", here)
    told = wavy(tmp_path, rounds=1)
    corrected, fitted, diagnosed = told["fit --estimator derivative"], told["fit"], told["diagnose"]
    assert corrected["mse"]["sway"] > 1.1
    assert corrected["position_m"] > corrected["base_position_m"]
    assert sum(diagnosed["mse"][axis] for axis in AXES) < 0.8 * sum(corrected["mse"][axis] for axis in AXES)
    assert sum(fitted["mse"][axis] for axis in AXES) < 0.8 * sum(corrected["mse"][axis] for axis in AXES)
    assert fitted["position_m"] < corrected["position_m"]
    assert diagnosed["mse"]["yaw"] < 0.5
    assert diagnosed["position_m"] < 0.8 * diagnosed["base_position_m"]
    assert diagnosed["heading_deg"] < 0.8 * diagnosed["base_heading_deg"]
    assert any("`diagnose`" in line for line in lines(told))
