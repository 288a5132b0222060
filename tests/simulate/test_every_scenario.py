"""Every bundled scenario runs, and its log goes through a fit like a recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.simulate import list_scenarios, load_scenario, simulate, write_log
from ferryid.types import RunContext
from ferryid.vessel import load_profile

pytestmark = pytest.mark.slow

NAMES = tuple(list_scenarios())
SUFFIXES = (".mcap", ".bag", "")
LOG_S = 300.0
LONGER_S = {"navigation-errors": 480.0}
"""Where rows are left out, so that more are needed to judge by."""
SELDOM_HZ = 5.0


@pytest.mark.parametrize("name", NAMES)
def test_scenario_runs_and_is_fitted(name: str, tmp_path: Path) -> None:
    scenario = load_scenario(name)
    simulation = simulate(scenario)
    truth, control = simulation.truth, simulation.control
    assert control.t[-1] + 1.0 / scenario.sensors.navigation_rate_hz == pytest.approx(scenario.duration_s)
    assert np.isfinite(truth.nu).all()
    log = tmp_path / f"{name}{SUFFIXES[NAMES.index(name) % len(SUFFIXES)]}"
    # Simulating is quick; writing and fitting a log takes as long as the log is, and most of its messages no fit reads.
    sensors = replace(scenario.sensors, imu_rate_hz=min(scenario.sensors.imu_rate_hz, SELDOM_HZ))
    scenario = replace(scenario, duration_s=min(scenario.duration_s, LONGER_S.get(name, LOG_S)), sensors=sensors)
    write_log(simulate(scenario), log)
    result = fit_logs(
        [str(log)],
        load_profile(scenario.vessel),
        FitSettings(delta=0.4, sigma=0.4, draws=20),
        RunContext(tmp_path / "out"),
    )
    scores = result.scores
    assert scores.seconds > 0.1 * scenario.duration_s
    assert scores.rows > 20
    assert np.isfinite(result.model.theta).all()
    assert np.isfinite([scores.force.mse_base, scores.force.mse_model]).all()
