"""The same seed gives the same log on other processors, other libraries and without the compiler.

Other processors are played by taking features away from this one, in a process of its own. Each time some ordinary function
must come out otherwise than it does here, or the comparison would show nothing. A library's sine differs in one of a thousand
numbers only, which takes a trial of a minute to notice.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

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
import hashlib, json, math, sys
from dataclasses import replace
from pathlib import Path
import numba
import numpy as np
from ferryid.simulate import load_scenario, simulate, write_log

folder = Path(sys.argv[1])
simulation = simulate(replace(load_scenario(sys.argv[2]), duration_s=float(sys.argv[3])))
for name in ("t.mcap", "t.bag", "t_ros2"):
    write_log(simulation, folder / name, overwrite=True)
files = [path for path in sorted(folder.rglob("*")) if path.is_file()]
x = np.random.default_rng(1).normal(size=20000) * 5.0
total = 0.0
@numba.njit(fastmath=True)
def squares(values):
    total = 0.0
    for value in values:
        total += value * value
    return total
square = x[:10000].reshape(100, 100)
witnesses = {
    "numpy": np.exp(x).tobytes(),
    "libc": np.array([math.sin(value) for value in x.tolist()]).tobytes(),
    "blas": (square @ square).tobytes(),
    "compiler": float(squares(x)).hex().encode(),
}
log = {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
print(json.dumps({"log": log, "witnesses": {k: hashlib.sha256(v).hexdigest() for k, v in witnesses.items()}}))
"""


def dispatched() -> str:
    """Return the processor features that NumPy would choose between here."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    return " ".join(name for name in __cpu_dispatch__ if __cpu_features__.get(name))


OTHERS = {
    "numpy": {"NPY_DISABLE_CPU_FEATURES": dispatched()},
    "libc": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-AVX2,-FMA,-FMA4,-AVX512F"},
    "blas": {"OPENBLAS_CORETYPE": "Prescott"},
    "compiler": {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},
}


def trial(folder: Path, duration_s: float = 60.0, **environment: str) -> dict[str, dict[str, str]]:
    folder.mkdir()
    scenario = folder.parent / "everything.toml"
    scenario.write_text(SCENARIO)
    (folder.parent / "wind.csv").write_text("time,north,east\n0,0.5,0\n1,1,-1\n2,0,0.3\n")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(folder), str(scenario), str(duration_s)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    return trial(tmp_path_factory.mktemp("here") / "log")


@pytest.mark.parametrize("name", OTHERS)
def test_the_same_log_on_another_processor(here, tmp_path, name):
    there = trial(tmp_path / "log", **OTHERS[name])
    assert there["log"] == here["log"]
    assert len(here["log"]) == 4
    if there["witnesses"][name] == here["witnesses"][name]:
        pytest.skip(f"the log is the same, but so is everything: {OTHERS[name]} changes nothing on this machine")


def test_the_same_log_without_the_compiler(tmp_path):
    logs = [trial(tmp_path / f"log{off}", 3.0, NUMBA_DISABLE_JIT=off)["log"] for off in "01"]
    assert logs[0] == logs[1]
