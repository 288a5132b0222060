"""A heading that steps and stays is found against its yaw rate, whatever its size; turns, spikes and noise are none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.signals.align import align
from ferryid.signals.heading_steps import heading_steps
from ferryid.signals.pose_limits import Samples
from ferryid.signals.poses import pose_faults, step_doubts
from ferryid.signals.recording import record
from ferryid.vessel import load_profile

Floats = NDArray[np.float64]

RATE = 20.0
T = np.arange(0.0, 300.0, 1.0 / RATE)
R = 0.3 * np.sin(0.2 * T)


def samples(psi: Floats, r: Floats = R) -> Samples:
    time_ns = (T * 1e9).astype(np.int64)
    return {"psi": (time_ns, psi), "r": (time_ns, r)}


def turning(noise: float = 0.003) -> Floats:
    return np.cumsum(R) / RATE + noise * np.random.default_rng(2).standard_normal(T.size)


@pytest.mark.parametrize("degrees", [6.0, -10.0, 15.0])
def test_a_step_that_stays_is_found_with_time_and_size(degrees: float) -> None:
    psi = turning() + np.radians(degrees) * (T >= 150.0)
    ((start_ns, end_ns, size),) = heading_steps(samples(psi))
    assert start_ns <= 150.0e9 <= end_ns
    assert (end_ns - start_ns) * 1e-9 < 0.2
    assert np.degrees(size) == pytest.approx(degrees, abs=0.7)
    (fault,) = pose_faults(samples(psi))
    assert (fault.kind, fault.samples, fault.left_out) == ("step", 0, True)
    (doubt,) = step_doubts((fault,), 0)
    assert doubt.says.startswith(f"The heading steps by {abs(degrees):.0f}° at 150.0 s and stays there")
    assert not doubt.certain


def test_several_steps_are_said_by_size_and_counted() -> None:
    psi = turning()
    for k, at in enumerate((40.0, 80.0, 120.0, 160.0, 200.0)):
        psi += np.radians(7.0 + k) * (at <= T)
    faults = pose_faults(samples(psi))
    assert [fault.kind for fault in faults] == ["step"] * 5
    said = [doubt.says for doubt in step_doubts(faults, 0)]
    assert [one.split(" at ")[0] for one in said[:3]] == [f"The heading steps by {size}°" for size in (9, 10, 11)]
    assert said[3:] == ["The heading steps and stays 2 more times, by less."]


@pytest.mark.parametrize("gain", [0.5, 0.8, 1.3])
def test_a_yaw_rate_of_another_scale_is_no_step(gain: float) -> None:
    assert heading_steps(samples(turning(), gain * R)) == ()


def test_spikes_drift_noise_and_a_missing_yaw_rate_are_no_steps() -> None:
    spike = turning()
    spike[3000:3004] += 0.3
    assert heading_steps(samples(spike)) == ()
    assert heading_steps(samples(turning() + 0.002 * T)) == ()
    assert heading_steps(samples(turning(0.05))) == ()
    stepped = turning() + 0.2 * (T >= 150.0)
    assert heading_steps({"psi": samples(stepped)["psi"]}) == ()


def test_a_heading_that_turned_during_a_gap_did_not_step() -> None:
    psi = turning() + 0.3 * (T >= 150.0)
    psi[2900:3100] = np.nan
    assert heading_steps(samples(psi)) == ()


def test_steps_of_a_real_compass_are_warned_of(shared_data: Callable[[str], Path]) -> None:
    profile = load_profile("esso-osaka")
    track = align(record(shared_data("esso_osaka/zigzag/zigzag_31-Jul-2020_13_50_28.csv"), profile), profile)
    (doubt,) = (one.says for one in track.doubts if "steps" in one.says)
    assert doubt.startswith("The heading steps by 7° at 86.3 s and stays there")
    (left,) = track.left_out
    assert left.intervals[0].signals == ("psi",)
    assert left.intervals[0].start_s < 86.3 < left.intervals[0].end_s
