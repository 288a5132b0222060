"""What a recording has of sensor errors by itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from ferryid.validation.recorded.manifest import Recording
from ferryid.validation.recorded.own_errors import own_errors, own_forces
from tests.validation.recorded_logs import zigzag


@pytest.mark.slow
def test_small_errors_are_estimated_as_well(tmp_path: Path) -> None:
    log = str(zigzag(tmp_path / "zigzag.dat", 170.0))
    used = [("a", "yaw_rate_scale"), ("a", "lever_arm"), ("a", "thruster_gain"), ("b", "lever_arm")]
    found = own_errors([Recording("a", (log, log), "kvlcc2-model")], used)
    assert set(found) == {("a", "yaw_rate_scale"), ("a", "lever_arm")}
    assert found["a", "yaw_rate_scale"]["factor"] == pytest.approx(1.0, abs=0.01)
    assert found["a", "lever_arm"] == pytest.approx({"x": 0.0, "y": 0.0}, abs=0.1)


@pytest.mark.slow
def test_what_forces_show_is_estimated_as_well(tmp_path: Path) -> None:
    log = str(zigzag(tmp_path / "zigzag.dat", 170.0))
    gain, arm = ("thruster_gain", "propeller"), ("lever_arm", None)
    used = [("a", gain), ("a", arm), ("b", gain), ("groups", gain)]
    recordings = [Recording("a", (log,), "kvlcc2-model"), Recording("groups", (log,), "kvlcc2-model", before=(log,))]
    found = own_forces(recordings, used)
    # Kinematics shows an arm, and both groups have the same level.
    assert set(found) == {("a", gain)}
    assert 0.0 <= found["a", gain] <= 3.0
