"""Parts of a recording: what differs between its manoeuvres is no event, beside a hull that only the part itself tells of."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose_and_store
from ferryid.types import RunContext
from ferryid.vessel import load_profile


@pytest.mark.slow
@pytest.mark.parametrize(("first_s", "last_s"), [(0.0, 2200.0), (3000.0, 5000.0)])
def test_no_force_is_named_in_a_part_of_speed_runs_and_circles(
    first_s: float, last_s: float, shared_data: Callable[[str], Path], tmp_path: Path
) -> None:
    """In the first a load of 97 t came aboard under way, in the second 150 t left and the thrusters weakened by 40 %."""
    log = shared_data("gunnerus/RVG_ManeuveringTests.csv")
    run = RunContext(tmp_path, ranges=((first_s, last_s),))
    (found,) = diagnose_and_store([str(log)], load_profile("gunnerus"), DiagnosisSettings(), run)
    assert {one.effect for one in found.findings if one.sure} <= {"yaw_rate_scale", "unknown"}
    assert any(one.effect == "payload" for one in found.findings)
