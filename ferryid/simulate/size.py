"""How much memory a trial takes, told before it is simulated."""

from __future__ import annotations

from math import ceil

from ferryid.errors import FerryIdError
from ferryid.simulate.scenario import Scenario

LONGEST_STEP_S = 0.02
"""Longest integration step [s]: the plant runs at 50 Hz or faster, in whole steps per control cycle."""
LARGEST_BYTES = 4e9
STEP_BYTES = 400
"""Measured, as are those below: the truth's row, and what is made of it."""
MESSAGE_BYTES = 250
IMU_BYTES = 500
FRAME_BYTES = 1600


def steps_per_cycle(rate_hz: float) -> int:
    """Return the integration steps in one control cycle."""
    return ceil(1.0 / rate_hz / LONGEST_STEP_S - 1e-9)


def check_size(scenario: Scenario, actuators: int) -> None:
    """Refuse a trial that would not fit into the memory of a small machine.

    Parameters
    ----------
    scenario
        The trial.
    actuators
        How many the vessel has.

    Raises
    ------
    FerryIdError
        Names the keys that take the most.
    """
    sensors, duration_s = scenario.sensors, scenario.duration_s
    pace = sensors.navigation_rate_hz
    share = {
        "navigation_rate_hz": pace * (steps_per_cycle(pace) * STEP_BYTES + (2 + actuators) * MESSAGE_BYTES),
        "thruster_rate_hz": sensors.thruster_rate_hz * actuators * MESSAGE_BYTES,
        "wind_rate_hz": sensors.wind_rate_hz * MESSAGE_BYTES,
        "current_rate_hz": sensors.current_rate_hz * MESSAGE_BYTES,
        "payload_rate_hz": sensors.payload_rate_hz * MESSAGE_BYTES,
        "reference_rate_hz": sensors.reference_rate_hz * MESSAGE_BYTES,
        "imu_rate_hz": sensors.imu_rate_hz * IMU_BYTES,
        "camera_rate_hz": sensors.camera_rate_hz * FRAME_BYTES,
    }
    needed = duration_s * sum(share.values())
    if needed > LARGEST_BYTES:
        first, second = sorted(share, key=lambda key: -share[key])[:2]
        raise FerryIdError(
            f"{scenario.where}: the trial would take {needed / 1e9:.1f} GB of memory, at most {LARGEST_BYTES / 1e9:g} GB are "
            f"used, found {first} = {getattr(sensors, first):g} for {duration_s:g} s. "
            f"Fix: lower {first}, {second} or duration_s"
        )
