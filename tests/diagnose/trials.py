"""Simulated trials for tests, of a ferry whose true hull is ten per cent off its profile's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ferryid.diagnose.checks.screening import screen_sensors
from ferryid.diagnose.data.measurements import measure_log, read_measurements, window_lengths
from ferryid.diagnose.gathering import with_common_sensors
from ferryid.diagnose.inference.estimation import EstimationProblem, estimation_problem
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.stages import AveragedLog, average
from ferryid.diagnose.inference.weak_form import windows
from ferryid.effects.force_model import Measurements
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.types import IN_MEMORY, no_progress
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile

FERRY = load_profile("milliampere")
OFF = {
    "m11": 0.9,
    "m22": 1.1,
    "m33": 0.9,
    "X_u": 1.1,
    "Y_v": 0.9,
    "Y_|r|v": 1.1,
    "N_r": 1.1,
    "N_|r|r": 0.9,
    "N_|r|v": 1.1,
}
"""What the true hull is off the profile's."""


def sailed(folder: Path, name: str, scenario: str, seed: int) -> Measurements:
    """Simulate a scenario, TOML without a true hull, and return the measurements that its log shows."""
    log = folder / f"{name}.mcap"
    write_log(simulate(replace(parse_scenario(scenario, name), true_hull=OFF), seed), log)
    return read_measurements(str(log), FERRY)[0]


def averaged(paths: Sequence[str], vessel: Profile, withhold: Sequence[str] = ()) -> list[AveragedLog]:
    """Return logs as the first stages of a diagnosis leave them."""
    measured = [measure_log(path, vessel, IN_MEMORY, withhold=withhold) for path in paths]
    return list(with_common_sensors([average(screen_sensors(log, no_progress)) for log in measured]))


def trial_on(measurements: Measurements) -> EstimationProblem:
    """Return measurements ready for hypotheses."""
    seen = windows(measurements, *window_lengths(FERRY))
    return estimation_problem(seen, *prior_force_model(seen.measurements, FERRY))
