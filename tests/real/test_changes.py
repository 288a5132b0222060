"""What changed between two groups of real recordings, and corrections that leave a recording as it was."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.checks.screening import ScreenedLog, screen_sensors
from ferryid.diagnose.data.measurements import measure_log
from ferryid.diagnose.pipeline import DiagnosisSettings
from ferryid.diagnose.versus import Versus, compare_groups
from ferryid.types import IN_MEMORY, no_progress
from ferryid.validation.case import Truth
from ferryid.validation.recorded.case_sampling import concealed
from ferryid.validation.recorded.log import read_log
from ferryid.validation.recorded.writing import write_log
from ferryid.vessel import load_profile

PROFILE = load_profile("kvlcc2-model")
BEFORE, SINCE = ("20_10_P", "10_05", "35_05"), ("20_10_S", "30_05")


def run(shared_data: Callable[[str], Path], name: str) -> str:
    return str(shared_data(f"kvlcc2/HSVA_CPMC_KVLCC2_Z_{name}.dat"))


def altered(path: str, truth: Truth, folder: Path, name: str) -> str:
    return str(write_log(concealed(read_log(path, PROFILE), truth, 1).log, folder, name))


def screened(path: str) -> ScreenedLog:
    return screen_sensors(measure_log(path, PROFILE, IN_MEMORY), no_progress)


@pytest.mark.parametrize(
    "truth",
    [
        Truth("lever_arm", None, {"x": 0.78, "y": 0.24}),
        Truth("velocity_scale", None, {"factor": 0.85}),
    ],
    ids=lambda truth: truth.effect,
)
def test_what_is_corrected_leaves_velocities_and_forces_as_they_were(
    truth: Truth, shared_data: Callable[[str], Path], tmp_path: Path
) -> None:
    """The velocity in products and the thrust at another speed of the water kept what was taken out of the signals."""
    path = run(shared_data, "20_10_S")
    sound, found = screened(path), screened(altered(path, truth, tmp_path, "log"))
    assert [one.effect for one in found.sensors] == [truth.effect]
    a, b = sound.measurements, found.measurements
    rows = a.usable & b.usable
    assert np.sqrt(np.mean((a.nu - b.nu)[rows] ** 2, axis=0)) == pytest.approx(np.zeros(3), abs=2e-3)
    assert np.abs(a.parts - b.parts)[rows].max() < 0.02 * np.abs(a.parts[rows]).max()


def changed(truth: Truth | None, shared_data: Callable[[str], Path], folder: Path) -> Versus:
    before, since = ([run(shared_data, name) for name in names] for names in (BEFORE, SINCE))
    if truth is not None:
        since = [altered(path, truth, folder, f"log-{k}") for k, path in enumerate(since)]
    return compare_groups(before, since, PROFILE, DiagnosisSettings(), IN_MEMORY)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "parameter"),
    [
        (Truth("thruster_gain", "propeller", {"factor": 0.6}), "factor"),
        (Truth("heading_bias", None, {"angle": 6.0}), "angle"),
        (Truth("lever_arm", None, {"x": 0.78, "y": 0.24}), "x"),
        (Truth("yaw_rate_scale", None, {"factor": 0.9}), "factor"),
    ],
    ids=lambda value: value.effect if isinstance(value, Truth) else "",
)
def test_what_changed_between_tank_runs_is_named_and_nothing_else(
    truth: Truth, parameter: str, shared_data: Callable[[str], Path], tmp_path: Path
) -> None:
    found = changed(truth, shared_data, tmp_path)
    (one,) = found.judged.sure
    assert one.key == truth.key
    assert one.estimates[parameter].low <= truth.values[parameter] <= one.estimates[parameter].high
    assert found.judged.verdict == "different"


@pytest.mark.slow
def test_tank_runs_as_they_are_differ_in_nothing(shared_data: Callable[[str], Path], tmp_path: Path) -> None:
    found = changed(None, shared_data, tmp_path)
    assert found.judged.verdict == "alike"
    assert "No difference of the vessel found" in found.summary
