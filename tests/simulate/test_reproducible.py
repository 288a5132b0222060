"""The same seed gives the same bytes on one machine, and equal numbers on others and without the compiler.

Another machine is played by taking features away from this one, in a process of its own. The loops in which most arithmetic is
done are compiled for it; the others are plain Python there, as it takes a minute to compile them all.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.slow

SCENARIO = """
schema = "ferryid.scenario/1"
title = "Everything at once"
vessel = "milliampere"
start = 2021-04-20T10:00:00Z
seed = 5
duration_s = 60

[path]
kind = "operational"

[guidance]
law = "carrot"

[controller]
delta = 0.4
sigma = 0.4

[controller.reference]
omega_radps = [0.8, 0.8, 0.8]

[environment.wind]
north_mps = -3.0
east_mps = 4.0
gust_std_mps = 1.0
series = "wind.csv"

[environment.current]
north_mps = 0.2
east_mps = -0.1
turn_degpmin = 20

[environment.waves]
significant_height_m = 0.2
direction_deg = 30

[[environment.wakes]]
at_s = 1.0
height_m = 0.2
duration_s = 2.0

[environment.shallow]
north_m = [-5, 5]
east_m = [-5, 5]
damping_factor = 1.5

[environment.mooring]
stiffness_north_Npm = 20

[[payload]]
mass_kg = 200
x_m = 1.0
from_s = 1.0

[fouling]
surge = 1.2

[thrusters]
force_lag_s = 0.1
inflow_loss_per_mps = 0.1
interaction_fraction = 0.1

[[thrusters.faults]]
thruster = "thruster2"
factor = 0.8
offset_deg = 5
from_s = 1.5

[sensors]
wind_rate_hz = 10
current_rate_hz = 5
payload_rate_hz = 5
azimuth_step_deg = 1
thruster_clock_offset_ms = 30
clock_offset_ms = 40
dropouts_per_min = 30
dropout_s = 0.3

[sensors.navigation]
antenna_m = [1.0, 0.5]
heading_bias_deg = 3
delay_s = 0.12
dropouts_per_min = 30
dropout_s = 0.3
"""

PROGRAM = """
import sys

if sys.argv[4:]:
    from types import SimpleNamespace

    import numba
    from ferryid import compiler

    # What effects add would be called by an address where it is compiled.
    numba.config.DISABLE_JIT = 1
    from ferryid.effects import native
    numba.config.DISABLE_JIT = 0
    native.numba = SimpleNamespace(njit=lambda function: function)
    dispatcher_of = compiler.dispatcher_of
    compiler.dispatcher_of = lambda function, **how: (
        dispatcher_of(function, **how) if function.__module__ in sys.argv[4:] else function
    )

from dataclasses import replace
from pathlib import Path
import numpy as np
from ferryid.simulate import load_scenario, simulate, write_log

folder = Path(sys.argv[1])
simulation = simulate(replace(load_scenario(sys.argv[2]), duration_s=float(sys.argv[3])))
for name in ("t.mcap", "t.bag", "t_ros2"):
    write_log(simulation, folder / name)
arrays = {}
for stream in simulation.streams:
    arrays[f"{stream.topic} stamp"], arrays[f"{stream.topic} receive"] = stream.stamp_ns, stream.receive_ns
    arrays.update({f"{stream.topic} {path}": values for path, values in stream.columns.items()})
# What a library's functions give tells one machine from another, whether or not a trial does.
np.savez(folder.with_suffix(".npz"), **arrays, library=np.sin(np.linspace(-50.0, 50.0, 100_001)))
"""


def dispatched() -> str:
    """Return the processor features that NumPy would choose between here."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    return " ".join(name for name in __cpu_dispatch__ if __cpu_features__.get(name))


OTHER_MACHINE = {
    "NPY_DISABLE_CPU_FEATURES": dispatched(),
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-AVX2,-FMA,-FMA4,-AVX512F",
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
}


COMPILED_THERE = tuple(f"ferryid.simulate.{name}" for name in ("noise", "plant.hull", "plant.waves", "plant.wind"))
"""Modules whose loops are compiled for another machine."""
BRIEF_S = 3.0
"""Within which everything in the scenario has begun: plain Python takes a thousand times as long."""


def trial(
    folder: Path, duration_s: float = 60.0, compiled: tuple[str, ...] = (), **environment: str
) -> tuple[dict[str, bytes], dict[str, np.ndarray]]:
    """Return the files of a trial that another process simulates, and the arrays that they were made of.

    Where modules are given, no other than theirs are compiled.
    """
    folder.mkdir()
    scenario = folder.parent / "everything.toml"
    scenario.write_text(SCENARIO)
    (folder.parent / "wind.csv").write_text("time,north,east\n0,0.5,0\n1,1,-1\n2,0,0.3\n")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(folder), str(scenario), str(duration_s), *compiled],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )
    assert done.returncode == 0, done.stderr
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with np.load(folder.with_suffix(".npz")) as arrays:
        return files, dict(arrays)


def assert_equal(found: dict[str, np.ndarray], expected: dict[str, np.ndarray]) -> None:
    """Times and single-precision numbers agree to their last digit, all others to 1e-9 of the largest."""
    assert set(found) == set(expected)
    for name, values in expected.items():
        if values.dtype == np.float64:
            np.testing.assert_allclose(found[name], values, rtol=0.0, atol=1e-9 * max(np.abs(values).max(), 1.0))
        else:
            np.testing.assert_allclose(
                found[name], values, rtol=2.0**-23 if values.dtype == np.float32 else 0.0, atol=0
            )


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    return trial(tmp_path_factory.mktemp("here") / "log")


def test_the_same_bytes_in_another_process(here, tmp_path):
    assert len(here[0]) == 4
    assert trial(tmp_path / "log")[0] == here[0]


@pytest.fixture(scope="module")
def brief(tmp_path_factory):
    return trial(tmp_path_factory.mktemp("brief") / "log", BRIEF_S)


def test_equal_numbers_on_another_machine(brief, tmp_path):
    _, arrays = trial(tmp_path / "log", BRIEF_S, COMPILED_THERE, **OTHER_MACHINE)
    assert_equal(arrays, brief[1])
    if np.array_equal(arrays["library"], brief[1]["library"]):
        pytest.skip("nothing can be taken away from this machine: its sines are the same to the last bit")


def test_equal_numbers_without_the_compiler(brief, tmp_path):
    assert_equal(trial(tmp_path / "log", BRIEF_S, NUMBA_DISABLE_JIT="1")[1], brief[1])
