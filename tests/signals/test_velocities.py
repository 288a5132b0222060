"""Velocities that stay at one value while the pose moves are found; vessels at rest and coarse sensors are left alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.signals.faults import find_faults
from ferryid.signals.pose_limits import Samples
from ferryid.signals.poses import PoseFault
from ferryid.signals.recording import record
from ferryid.signals.velocities import HeldVelocity, held_sentences, held_velocities
from ferryid.vessel import load_profile

Floats = NDArray[np.float64]

RATE = 20.0
T = np.arange(0.0, 300.0, 1.0 / RATE)


def voyage(speed: float = 1.0, rest: tuple[float, float] = (0.0, 0.0), noise: float = 0.01) -> dict[str, Floats]:
    """Five minutes at 20 Hz with a winding heading, sway, and a rest of the vessel between two times."""
    rng = np.random.default_rng(1)
    goes = 1.0 - ((rest[0] <= T) & (rest[1] > T))
    r = goes * (0.06 * np.cos(0.05 * T) + 0.02)
    psi = np.cumsum(r) / RATE
    u, v = speed * goes * (1.0 + 0.4 * np.sin(0.11 * T)), speed * goes * 0.5 * np.cos(0.07 * T)
    way = np.cumsum((u + 1j * v) * np.exp(1j * psi)) / RATE
    size = {"x": noise, "y": noise, "psi": 0.1 * noise, "u": noise, "v": noise, "r": 0.1 * noise}
    columns = {"x": way.real, "y": way.imag, "psi": psi, "u": u, "v": v, "r": r}
    return {name: values + size[name] * rng.standard_normal(T.size) for name, values in columns.items()}


def samples(columns: dict[str, Floats]) -> Samples:
    return {name: ((T * 1e9).astype(np.int64), values) for name, values in columns.items()}


def rows(start: float, length: float) -> NDArray[np.bool_]:
    return np.asarray((start <= T) & (start + length > T))


def found(columns: dict[str, Floats]) -> tuple[HeldVelocity, ...]:
    return held_velocities(samples(columns), ())


@pytest.mark.parametrize("name", ["u", "v", "r"])
@pytest.mark.parametrize("seconds", [15.0, 120.0])
@pytest.mark.parametrize("at_zero", [True, False])
def test_a_velocity_that_stays_while_the_pose_moves_is_held(name: str, seconds: float, at_zero: bool) -> None:
    columns = voyage()
    inside = rows(85.0 if name == "v" else 120.0, seconds)
    columns[name][inside] = 0.0 if at_zero else -0.3 * np.sqrt(np.mean(columns[name] ** 2))
    held = [one for one in found(columns) if one.signal == name]
    (one,) = held
    assert one.samples == pytest.approx(np.count_nonzero(inside), abs=1)
    assert one.seconds == pytest.approx(seconds, abs=0.2)
    (said,) = held_sentences(held, samples(columns))
    assert said.startswith(f"{name}: the ")
    assert f"{one.samples} of 6000 samples left out." in said


def test_velocities_over_ground_are_compared_with_the_position_too() -> None:
    columns = voyage()
    columns["vel_N"], columns["vel_E"] = np.gradient(columns["x"], T), np.gradient(columns["y"], T)
    columns["vel_E"][rows(100.0, 40.0)] = 0.0
    assert [one.signal for one in found(columns)] == ["vel_E"]


def test_nothing_is_held_on_a_clean_voyage_or_without_a_pose() -> None:
    assert found(voyage()) == ()
    columns = voyage()
    columns["u"][rows(100.0, 40.0)] = 0.0
    assert found({name: columns[name] for name in "uvr"}) == ()


@pytest.mark.parametrize("wander", [0.0, 0.8])
def test_a_vessel_that_lies_still_holds_nothing(wander: float) -> None:
    columns = voyage(rest=(100.0, 220.0))
    columns["x"] += wander * np.sin(0.06 * T)  # a receiver's own
    for name in "uvr":
        columns[name][rows(100.0, 120.0)] = 0.0
    assert found(columns) == ()


@pytest.mark.parametrize("step", [0.05, 0.1, 0.25])
@pytest.mark.parametrize("speed", [0.1, 0.3, 1.0])
def test_a_coarse_velocity_may_repeat_while_the_vessel_moves_slowly(step: float, speed: float) -> None:
    columns = voyage(speed, noise=0.0)
    for name in "uv":
        columns[name] = np.round(columns[name] / step) * step
    assert found(columns) == ()


@pytest.mark.parametrize("band", [0.1, 0.3])
def test_a_velocity_with_a_dead_band_reads_zero_below_it(band: float) -> None:
    columns = voyage(0.5)
    for name in "uv":
        columns[name] = np.where(np.abs(columns[name]) < band, 0.0, columns[name])
    assert found(columns) == ()


def test_a_velocity_updated_once_a_second_is_not_held() -> None:
    columns = voyage()
    for name in "uv":
        columns[name] = np.repeat(columns[name][::20], 20)
    assert found(columns) == ()


def test_a_constant_is_not_held_and_a_wrong_pose_shows_nothing() -> None:
    columns = voyage()
    columns["v"] = np.zeros(T.size)
    assert found(columns) == ()
    columns = voyage()
    columns["u"][rows(100.0, 20.0)] = 0.0
    fault = PoseFault("position", "away", 5, 105 * 10**9, 106 * 10**9, 9.0)
    assert held_velocities(samples(columns), (fault,)) == ()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("log", "vessel"),
    [
        ("gunnerus/RVG_ManeuveringTests.csv", "gunnerus"),
        ("milliampere1", "milliampere-2025"),
        ("kvlcc2/HSVA_CPMC_KVLCC2_Z_20_10_S.dat", "kvlcc2-model"),
        ("vtec_usv/48000_2016-02-11-10-52-07.bag", "vtec-usv"),
        ("esso_osaka/random/random_31-Jul-2020_12_48_39.csv", "esso-osaka"),
    ],
)
def test_no_velocity_of_a_real_recording_is_held_against_its_pose(
    shared_data: Callable[[str], Path], log: str, vessel: str
) -> None:
    faults = find_faults(record(shared_data(log), load_profile(vessel)))
    assert not [one for one in faults.held if "while the" in one.reason]
