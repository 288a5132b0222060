"""The few message types that simulated logs are made of are those of ROS 2."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from rosbags.typesys import Stores, get_typestore

from ferryid.simulate.usual_messages import USUAL, usual_typestore


@pytest.mark.parametrize("name", USUAL)
def test_a_usual_type_is_that_of_ros2(name: str) -> None:
    usual, jazzy = usual_typestore(), get_typestore(Stores.ROS2_JAZZY)
    assert usual.fielddefs[name] == jazzy.fielddefs[name]
    assert usual.generate_msgdef(name, ros_version=2) == jazzy.generate_msgdef(name, ros_version=2)


@pytest.mark.slow
def test_a_simulation_loads_no_other_types(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from ferryid.simulate import load_scenario, simulate, write_log;"
        "write_log(simulate(load_scenario('four-corner'), 1), Path(sys.argv[1]));"
        "print([name for name in sys.modules if name.startswith('rosbags.typesys.stores.ros')])"
    )
    run = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "log.mcap")], capture_output=True, text=True, check=True
    )
    assert run.stdout.strip() == "[]"
