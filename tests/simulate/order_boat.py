"""A small boat that is driven by orders alone, and its trials with propellers that follow these late."""

from __future__ import annotations

from pathlib import Path

from ferryid.simulate import load_scenario, simulate
from ferryid.simulate.trial import Simulation
from ferryid.validation.prior_profile import NAVIGATION

PROFILE = """schema = "ferryid.vessel/1"
name = "cat"
source = "made up for tests"
[hull]
length_m = 1.3
beam_m = 0.9
mass_kg = 30.0
inertia_z = 4.0
M = { m11 = 34.0, m22 = 55.0, m23 = 0.0, m32 = 0.0, m33 = 6.0 }
D = { X_u = -8.0, "X_|u|u" = -12.0, Y_v = -25.0, "Y_|v|v" = -60.0, N_r = -4.0, "N_|r|r" = -4.0 }
[[actuator]]
name = "left"
kind = "propeller"
position_m = [-0.5, -0.35]
thrust = { kind = "quadratic", input = "rpm", ahead = 2.0e-5, astern = 1.2e-5, valid = [-1000, 1000] }
[[actuator]]
name = "right"
kind = "propeller"
position_m = [-0.5, 0.35]
thrust = { kind = "quadratic", input = "rpm", ahead = 2.0e-5, astern = 1.2e-5, valid = [-1000, 1000] }
"""
SCENARIO = """schema = "ferryid.scenario/1"
vessel = "boat.toml"
seed = 5
[manoeuvre]
kind = "rpm-steps"
speed_rpm = 900
hold_s = 8
duration_s = 240
[thrusters]
speed_lag_s = {lag}
speed_rate_rpmps = 1e6
[sensors]
imu_rate_hz = 0
camera_rate_hz = 0
"""


def profile_text(*lines: str, feedback: bool = False) -> str:
    """Return the profile with more lines in the table of each order, or with feedback in the place of orders."""
    what, topic = ("", "state") if feedback else (".command", "command")
    return (
        PROFILE
        + NAVIGATION.partition("[signals.tau_d]")[0]
        + "".join(
            "\n".join(
                [
                    f'[signals."{name}.speed{what}"]',
                    f'topic = "/{name}/{topic}"',
                    'field = "speed"',
                    'unit = "rpm"',
                    *lines,
                    "",
                ]
            )
            for name in ("left", "right")
        )
    )


def sailed(folder: Path, *lines: str, lag_s: float = 0.0) -> Simulation:
    """Return a trial, kept in a folder, in which orders are followed with a lag [s], or as the profile states in `lines`."""
    (folder / "boat.toml").write_text(profile_text(*lines))
    (folder / "trial.toml").write_text(SCENARIO.format(lag=lag_s))
    return simulate(load_scenario(str(folder / "trial.toml")))
