"""Poses: what no vessel can do is found as long as it lasts; honest slow, coarse, noisy and resting sensors are left alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.signals.pose_limits import Samples
from ferryid.signals.poses import PoseFault, pose_faults, pose_sentences

Floats = NDArray[np.float64]

RATE = 20.0
T = np.arange(0.0, 300.0, 1.0 / RATE)


def voyage(speed: float = 1.0, noise: float = 0.01, seed: int = 0) -> dict[str, Floats]:
    """A winding voyage of five minutes at 20 Hz, by default of a metre per second."""
    rng = np.random.default_rng(seed)
    psi = 0.8 * np.sin(0.05 * T) + 0.02 * T
    u = speed * (1.0 + 0.3 * np.sin(0.11 * T))
    way = np.cumsum(u * np.exp(1j * psi)) / RATE
    columns = {"x": way.real + 40.0, "y": way.imag - 25.0, "psi": psi, "u": u, "v": 0.0 * u, "r": np.gradient(psi, T)}
    size = {"x": noise, "y": noise, "psi": 0.1 * noise, "u": 0.1 * noise, "v": 0.1 * noise, "r": 0.1 * noise}
    return {name: values + size[name] * rng.standard_normal(T.size) for name, values in columns.items()}


def faults(columns: dict[str, Floats], *, alone: bool = False) -> tuple[PoseFault, ...]:
    """Return the faults of a voyage, where `alone` without velocities beside the pose."""
    time_ns = (T * 1e9).astype(np.int64)
    samples: Samples = {name: (time_ns, v) for name, v in columns.items() if not alone or name in ("x", "y", "psi")}
    return pose_faults(samples)


def rows(start: float, length: float) -> NDArray[np.bool_]:
    return np.asarray((start <= T) & (start + length > T))


def found(fault: PoseFault) -> tuple[str, str, float, float]:
    return fault.signal, fault.kind, round(fault.start_ns * 1e-9, 1), round(fault.end_ns * 1e-9, 1)


@pytest.mark.parametrize("metres", [3.0, -5.0, 15.0])
@pytest.mark.parametrize("seconds", [0.5, 4.0, 20.0])
def test_a_position_that_jumps_away_and_back_is_wrong_in_between(metres: float, seconds: float) -> None:
    columns = voyage()
    columns["x"] += metres * rows(100.0, seconds)
    (fault,) = faults(columns)
    assert found(fault) == ("position", "away", round(100.0 - 1 / RATE, 1), 100.0 + seconds)
    assert fault.samples == round(seconds * RATE)
    assert fault.size == pytest.approx(abs(metres), abs=0.2)


def test_a_position_that_stays_where_it_jumped_to_is_left_out_at_the_jump() -> None:
    columns = voyage()
    columns["y"] += 6.0 * (T >= 150.0)
    for alone in (False, True):
        (fault,) = faults(columns, alone=alone)
        assert (fault.kind, fault.samples) == ("jump", 0)
        assert fault.seconds == pytest.approx(1.0 / RATE)


@pytest.mark.parametrize("alone", [False, True])
def test_short_excursions_are_found_without_a_velocity_too(*, alone: bool) -> None:
    columns = voyage()
    columns["x"] += 12.0 * rows(60.0, 0.6)
    columns["y"] -= 7.0 * rows(200.0, 0.4)
    assert [found(fault)[1:] for fault in faults(columns, alone=alone)] == [
        ("away", 60.0, 60.6),
        ("away", 200.0, 200.4),
    ]


@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize(
    "spans", [[(100.0, 5.0)], [(0.0, 8.0)], [(50.0, 0.2), (90.0, 40.0), (200.0, 2.0)], [(280.0, 21.0)]]
)
def test_a_tracking_system_that_writes_zeros_has_lost_the_vessel(
    spans: list[tuple[float, float]], *, alone: bool
) -> None:
    columns = voyage()
    for start, length in spans:
        for name in ("x", "y", "psi"):
            columns[name] = np.where(rows(start, length), 0.0, columns[name])
    positions = [fault for fault in faults(columns, alone=alone) if fault.signal == "position"]
    assert [(fault.kind, fault.samples) for fault in positions] == [("zero", int(rows(*span).sum())) for span in spans]


def test_a_vessel_that_lies_at_the_origin_before_it_starts_was_measured() -> None:
    columns = voyage(noise=0.0)
    for name in ("x", "y"):
        columns[name] = np.concatenate([np.zeros(1200), columns[name] - columns[name][0]])[: T.size]
    assert faults({name: columns[name] for name in ("x", "y")}) == ()


@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize("seconds", [2.0, 10.0, 30.0])
def test_a_tracking_system_that_repeats_its_last_pose_has_lost_the_vessel(seconds: float, *, alone: bool) -> None:
    columns = voyage()
    lost = rows(100.0, seconds)
    for name in ("x", "y"):
        columns[name] = columns[name][np.maximum.accumulate(np.where(lost, 0, np.arange(T.size)))]
    (fault,) = faults(columns, alone=alone)
    assert found(fault)[:2] == ("position", "held")
    assert fault.samples == round(seconds * RATE)


def test_a_pose_that_is_repeated_to_the_end_while_the_velocity_goes_on_is_lost() -> None:
    columns = voyage()
    for name in ("x", "y"):
        columns[name] = np.where(T >= 270.0, columns[name][5400], columns[name])
    (fault,) = faults(columns)
    assert found(fault)[:2] == ("position", "held")
    assert faults(columns, alone=True) == ()  # it may have stopped


@pytest.mark.parametrize("seconds", [0.5, 10.0, 60.0])
@pytest.mark.parametrize("alone", [False, True])
def test_a_heading_that_is_turned_round_for_a_while_is_found(seconds: float, *, alone: bool) -> None:
    columns = voyage()
    columns["psi"] += np.pi * rows(100.0, seconds)
    (fault,) = faults(columns, alone=alone)
    assert found(fault) == ("heading", "flip", round(100.0 - 1 / RATE, 1), 100.0 + seconds)
    assert fault.size == pytest.approx(np.pi, abs=0.1)
    (says,) = pose_sentences([fault])
    assert says.startswith("The heading is turned by 180° and back once")


def every_second(values: Floats) -> Floats:
    """Fixes at 1 Hz, held in a stream at 20 Hz."""
    return values[np.arange(T.size) // 20 * 20]


def coarse(values: Floats) -> Floats:
    return np.round(values, 1)


def twice(values: Floats) -> Floats:
    return values[np.arange(T.size) // 2 * 2]


def stopping(values: Floats) -> Floats:
    """The vessel rests exactly for half a minute, and goes on from there."""
    at = np.where(T < 100.0, T, np.where(T < 130.0, 100.0, T - 30.0))
    return np.interp(at, T, values)


def irregular(values: Floats) -> Floats:
    """Fixes after 0.2 to 1.4 s, held in between."""
    times = np.cumsum(np.random.default_rng(2).uniform(0.2, 1.4, 1000))
    return values[
        np.searchsorted(T, np.concatenate([[0.0], times])[np.searchsorted(times, T, side="right")]).clip(0, T.size - 1)
    ]


@pytest.mark.parametrize("sensor", [every_second, coarse, twice, stopping, irregular])
@pytest.mark.parametrize("speed", [0.0, 0.2, 1.0, 8.0])
@pytest.mark.parametrize("noise", [0.0, 0.02, 0.5])
def test_honest_slow_coarse_and_resting_sensors_are_left_alone(sensor: object, speed: float, noise: float) -> None:
    columns = voyage(speed, noise)
    columns |= {name: sensor(columns[name]) for name in ("x", "y", "psi")}  # type: ignore[operator]
    for alone in (False, True):
        assert faults(columns, alone=alone) == ()


def test_a_receiver_whose_noise_is_metres_is_left_alone() -> None:
    assert faults(voyage(noise=3.0)) == ()


def test_one_fault_hides_no_other() -> None:
    columns = voyage()
    columns["x"] = np.where(rows(20.0, 3.0), 0.0, columns["x"])
    columns["y"] = np.where(rows(20.0, 3.0), 0.0, columns["y"])
    columns["psi"] += np.pi * rows(80.0, 6.0)
    columns["x"] += 9.0 * rows(150.0, 2.0) + 4.0 * (T > 220.0)
    kinds = [(fault.signal, fault.kind) for fault in faults(columns)]
    assert kinds == [("position", "zero"), ("heading", "flip"), ("position", "away"), ("position", "jump")]
    assert len(pose_sentences(faults(columns))) == 4


LONG = np.arange(12_000) / RATE


def of(time_s: Floats, **columns: Floats) -> tuple[PoseFault, ...]:
    """Return the faults of signals that share their times."""
    return pose_faults({name: ((time_s * 1e9).astype(np.int64), values) for name, values in columns.items()})


def left_out(faults: tuple[PoseFault, ...]) -> int:
    return sum(fault.samples for fault in faults if fault.left_out)


@pytest.mark.parametrize("measured", [True, False])
def test_a_log_that_starts_with_wrong_positions_loses_these_alone(*, measured: bool) -> None:
    noise = 0.01 * np.random.default_rng(3).standard_normal((2, LONG.size))
    x = LONG + noise[0]
    for first in range(0, 12_000, 2_400):
        x[first : first + 3] += 25.0
    velocity = {"u": np.ones(LONG.size), "v": 0.0 * LONG, "psi": 0.0 * LONG} if measured else {}
    assert left_out(of(LONG, x=x, y=noise[1], **velocity)) == 15


@pytest.mark.parametrize("measured", [True, False])
def test_a_log_that_starts_with_a_turned_heading_loses_the_turned_samples_alone(*, measured: bool) -> None:
    psi = 0.5 * np.sin(0.05 * LONG) + 0.001 * np.random.default_rng(3).standard_normal(LONG.size)
    rate = {"r": 0.025 * np.cos(0.05 * LONG)} if measured else {}
    for first in range(0, 12_000, 200):
        psi[first : first + 3] += np.pi
    assert left_out(of(LONG, psi=psi, **rate)) == 180


@pytest.mark.parametrize(("since", "share"), [(200.0, 100.0), (80.0, 80.0), (152.0, 148.0)])
@pytest.mark.parametrize("alone", [False, True])
def test_of_a_heading_that_stays_turned_round_the_longer_part_is_kept(
    since: float, share: float, *, alone: bool
) -> None:
    columns = voyage()
    columns["psi"] += np.pi * (since <= T)
    (fault,) = faults(columns, alone=alone)
    assert (fault.signal, fault.kind, fault.samples) == ("heading", "turned", round(share * RATE))
    (says,) = pose_sentences([fault])
    assert "is turned by 180° against the longer part of the log" in says


def test_positions_that_move_to_new_origins_are_kept() -> None:
    columns = voyage()
    columns["x"] += 3.0 * (T > 50.0) + 8.0 * (T > 90.0) - 5.0 * (T > 130.0) + 2.5 * (T > 200.0)
    for alone in (False, True):
        assert [(fault.kind, fault.samples) for fault in faults(columns, alone=alone)] == [("jump", 0)] * 4


def test_a_sprint_after_a_slow_voyage_is_no_jump() -> None:
    time_s = np.arange(1_830.0)
    u = np.where(time_s < 1_800.0, 0.3, 5.0)
    assert of(time_s, x=np.cumsum(u), y=0.0 * u, psi=0.0 * u, u=u, v=0.0 * u) == ()


def test_a_recorder_that_pauses_while_the_vessel_moves_makes_no_jump() -> None:
    time_s = np.arange(0.0, 1_800.0, 0.2)
    u = np.where(time_s < 1_700.0, 0.3, 5.0)
    runs = (time_s < 1_710.0) | (time_s > 1_790.0)
    columns = {"x": np.cumsum(u) * 0.2, "y": 0.0 * u, "psi": 0.0 * u, "u": u, "v": 0.0 * u}
    assert of(time_s[runs], **{name: values[runs] for name, values in columns.items()}) == ()


def test_a_spin_of_which_the_heading_is_measured_every_second_is_no_jump() -> None:
    r = np.where((LONG > 300.0) & (LONG < 308.0), 2.0, 0.01)
    psi = np.cumsum(r) / RATE
    assert of(LONG, psi=psi[np.arange(LONG.size) // 20 * 20], r=r) == ()


def test_a_vessel_that_rests_is_not_lost_where_its_position_is_corrected_afterwards() -> None:
    rests = (LONG >= 200.0) & (LONG < 320.0)
    u = np.where(rests, 0.0, 0.3)
    x = np.cumsum(u) / RATE + np.where(rests, 0.0, 0.01 * np.random.default_rng(3).standard_normal(LONG.size))
    x[rests] = x[rests][0]
    x += 0.5 * (LONG >= 320.0)
    assert of(LONG, x=x, y=0.0 * x, psi=0.0 * x, u=u, v=0.0 * u) == ()


def test_jumps_too_frequent_to_know_the_wrong_samples_are_reported_and_nothing_is_left_out() -> None:
    columns = voyage()
    columns["x"][::40] += 25.0
    reported = faults(columns)
    assert left_out(reported) == 0
    (says,) = pose_sentences(reported)
    assert says.startswith("The position jumps 299 times farther than the vessel can move, by up to 25.")
    assert "none is left out. Check the sensor" in says
