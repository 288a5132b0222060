"""Logs that hold the same recording: copies, other formats, pieces; and logs that do not."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ferryid.signals.copies import ROWS, has_marks, motion_marks, same_recording, searchable
from ferryid.signals.stream import Recording
from ferryid.types import Floats


def recording(**columns: Floats) -> Recording:
    return cast(Recording, SimpleNamespace(streams={"/topic": SimpleNamespace(columns=columns)}))


def track(seed: int, n: int = 2000) -> dict[str, Floats]:
    steps = np.random.default_rng(seed).normal(size=(2, n))
    return dict(zip(("x", "y"), np.cumsum(steps, axis=1), strict=True))


def cut(columns: dict[str, Floats], part: slice) -> dict[str, Floats]:
    return {name: values[part] for name, values in columns.items()}


@pytest.mark.parametrize("part", [slice(None), slice(0, 1500), slice(300, None), slice(900, 1100)])
def test_a_copy_and_a_piece_are_the_same_recording(part: slice) -> None:
    whole = track(1)
    piece = recording(**cut(whole, part))
    assert same_recording(recording(**whole), piece)
    assert same_recording(piece, recording(**whole))


@pytest.mark.parametrize("part", [slice(None), slice(0, 1500), slice(300, None), slice(900, 1100)])
def test_marks_know_a_copy_and_a_piece_and_no_other_trial(part: slice) -> None:
    whole, piece = track(1), recording(**cut(track(1), part))
    assert has_marks(piece, [motion_marks(recording(**whole))])
    assert has_marks(recording(**whole), [motion_marks(piece)])
    assert not has_marks(recording(**track(2)), [motion_marks(piece)])
    single = {name: values.astype(np.float32).astype(np.float64) for name, values in whole.items()}
    assert has_marks(recording(**single), [motion_marks(piece)])


def test_marks_of_a_position_from_the_first_fix_of_each_piece_leave_it_to_the_velocity() -> None:
    whole = {**track(1), "u": track(3)["x"], "v": track(3)["y"]}
    piece = cut(whole, slice(500, 1500))
    moved = {**piece, "x": piece["x"] - 7.3, "y": piece["y"] + 2.1}
    assert has_marks(recording(**moved), [motion_marks(recording(**whole))])


def test_marks_of_a_log_that_lies_still_are_none() -> None:
    assert motion_marks(recording(x=np.zeros(500), y=np.zeros(500))) == {}
    assert motion_marks(recording(**cut(track(1), slice(0, ROWS - 1)))) == {}


def test_another_format_rounds_the_values() -> None:
    whole = track(1)
    single = {name: values.astype(np.float32).astype(np.float64) for name, values in whole.items()}
    assert same_recording(recording(**whole), recording(**single))


def to_digits(values: Floats, digits: int) -> Floats:
    return np.array([float(f"{one:.{digits}g}") for one in values])


@pytest.mark.parametrize(
    "rounded",
    [
        lambda values: np.round(values, 5),
        lambda values: np.round(values, 2),
        lambda values: to_digits(values, 4),
        lambda values: to_digits(values, 6),
        lambda values: 0.003 * np.round(values / 0.003),
    ],
    ids=["5 decimals", "2 decimals", "4 digits", "6 digits", "steps of 3 mm"],
)
def test_a_copy_with_fewer_digits_is_the_same_recording(rounded: Callable[[Floats], Floats]) -> None:
    whole, other = ({name: rounded(values) for name, values in track(seed).items()} for seed in (1, 2))
    for piece in (whole, cut(whole, slice(300, 1500))):
        assert same_recording(recording(**track(1)), recording(**piece))
        assert same_recording(recording(**piece), recording(**track(1)))
    assert not same_recording(recording(**track(1)), recording(**other))
    assert not same_recording(recording(**whole), recording(**other))


def test_a_manoeuvre_that_is_repeated_is_no_copy_of_one_with_fewer_digits() -> None:
    t = 0.1 * np.arange(2000)
    turn = {"x": 10.0 * np.sin(0.1 * t), "y": 10.0 * np.cos(0.1 * t)}
    # The same circle but for what a receiver of the best kind is off.
    noise = np.random.default_rng(5).normal(scale=0.003, size=(2, 2000))
    again = {name: values + off for (name, values), off in zip(turn.items(), noise, strict=True)}
    for decimals in (2, 3, 4, 5):
        rounded = {name: np.round(values, decimals) for name, values in again.items()}
        assert not same_recording(recording(**turn), recording(**rounded))


def test_a_straight_way_at_one_speed_is_no_copy_of_another() -> None:
    # In steps of 5 cm exactly, as of a simulator, its quantum looks like 5 cm.
    one = {"x": 0.05 * np.arange(500.0), "y": np.zeros(500)}
    other = {"x": 0.0171 + 0.05003 * np.arange(500.0), "y": np.zeros(500)}
    assert not same_recording(recording(**one), recording(**other))


def test_neighbouring_values_of_a_coarse_sensor_are_not_alike() -> None:
    steps = np.random.default_rng(7).integers(1, 3, size=(2, 500))
    one = dict(zip(("x", "y"), 0.1 * np.cumsum(steps, axis=1), strict=True))
    beside = {name: values + 0.1 for name, values in one.items()}
    assert same_recording(recording(**one), recording(**one))
    assert not same_recording(recording(**one), recording(x=beside["x"], y=one["y"] - 0.1))


def test_velocities_show_a_copy_whose_positions_count_from_another_fix() -> None:
    whole = {**track(1), "u": track(3)["x"], "v": track(3)["y"]}
    moved = {**whole, "x": whole["x"] - 7.3, "y": whole["y"] + 2.1}
    assert same_recording(
        recording(**whole), recording(**{name: np.round(values, 4) for name, values in moved.items()})
    )


def test_another_trial_is_not() -> None:
    assert not same_recording(recording(**track(1)), recording(**track(2)))


def test_pieces_that_overlap_by_half_are() -> None:
    whole = track(1)
    assert same_recording(recording(**cut(whole, slice(0, 1200))), recording(**cut(whole, slice(600, 2000))))


def test_a_vessel_that_lies_still_and_a_coarse_sensor_show_nothing() -> None:
    still = {"x": np.zeros(500), "y": np.zeros(500)}
    assert not same_recording(recording(**still), recording(**still))
    # Whole degrees that change now and then are alike in any two turns.
    turn = {"psi": np.repeat(np.arange(100.0), 5)}
    assert not same_recording(recording(**turn), recording(**turn))


def test_without_a_position_velocities_count() -> None:
    swell = {"u": track(3)["x"], "v": track(3)["y"]}
    assert same_recording(recording(**swell), recording(**swell))
    assert not same_recording(recording(**swell), recording(**track(3)))


def test_velocities_over_ground_count_before_a_coarse_heading() -> None:
    zigzag = np.round(20.0 * np.sin(0.01 * np.arange(2000)), 1)
    first, second = ({"vel_N": track(k)["x"], "vel_E": track(k)["y"], "psi": zigzag} for k in (3, 4))
    assert has_marks(recording(**first), [motion_marks(recording(**first))])
    assert not has_marks(recording(**second), [motion_marks(recording(**first))])
    assert not same_recording(recording(**second), recording(**first))


def test_of_many_logs_the_copies_are_those_of_each_pair() -> None:
    still = dict.fromkeys(("x", "y"), np.zeros(2000))
    logs = [recording(**one) for one in (track(1), track(2), cut(track(1), slice(700, 1500)), still, {})]
    found = searchable(logs)
    pairs = [[one.same(other) for other in found] for one in found]
    assert pairs == [[same_recording(one, other) for other in logs] for one in logs]
    assert pairs[2] == [True, False, True, False, False]
