"""Two short logs of one truth: another path, another seed."""

from __future__ import annotations

from pathlib import Path

from ferryid.simulate import simulate, write_log
from ferryid.simulate.scenario import parse_scenario

FERRY = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
controller = { delta = 0.7, sigma = 0.7 }
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
"""
PATHS = (
    'path = { kind = "four-corner" }\n',
    'path = { kind = "points", points = [[0, 0, 0], [14, 4, 60], [10, -8, 180], [-4, -10, 270], [0, 0, 0]] }\n',
)
NORTH_MPS, EAST_MPS = -5.0, 4.0
WIND = f"environment = {{ wind = {{ north_mps = {NORTH_MPS}, east_mps = {EAST_MPS} }} }}\n"
WEAK = 'thrusters = { faults = [{ thruster = "thruster1", factor = 0.6 }] }\n'


def two_logs(folder: Path, injected: str, seed: int = 1) -> tuple[str, str]:
    """Return the paths of a first and a second log of vessels that something is wrong with, as TOML."""
    logs = []
    for i, path in enumerate(PATHS):
        log = folder / f"log{i + 1}.mcap"
        write_log(simulate(parse_scenario(FERRY + path + injected, log.stem), seed + i), log)
        logs.append(str(log))
    return logs[0], logs[1]
