"""Splits: no row on both sides, no shared window, the same rows every time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import signal

from ferryid.errors import FerryIdError
from ferryid.identify.split import Split, correlation_time, split_rows
from ferryid.signals.track import Motion

Flags = NDArray[np.bool_]
T = TypeVar("T")


def motion(valid: Flags, rate_hz: float = 10.0, log: str = "trial") -> Motion:
    n = valid.size
    zeros = np.zeros((n, 3))
    return Motion(log, np.arange(n) / rate_hz, rate_hz, zeros, zeros, zeros, zeros, valid, zeros)


@st.composite
def motions(draw: st.DrawFn) -> list[Motion]:
    logs = []
    for i in range(draw(st.integers(1, 3))):
        rate = draw(st.sampled_from([2.0, 10.0, 20.0]))
        valid = np.ones(round(draw(st.floats(60, 400)) * rate), dtype=bool)
        for _ in range(draw(st.integers(0, 4))):
            start = draw(st.integers(0, valid.size - 1))
            valid[start : start + draw(st.integers(1, valid.size // 4))] = False
        assume(valid.any())
        logs.append(motion(valid, rate, f"log{i}"))
    return logs


def unless_too_short(make: Callable[[], T]) -> T | None:
    try:
        return make()
    except FerryIdError as error:
        if "too short" not in str(error):
            raise
        return None


def gap_s(training: Flags, validation: Flags, rate_hz: float) -> float:
    """Least time between a training row and a validation row."""
    a, b = np.flatnonzero(training), np.flatnonzero(validation)
    if a.size == 0 or b.size == 0:
        return np.inf
    after = np.searchsorted(b, a)
    nearest = np.minimum(np.abs(a - b[np.minimum(after, b.size - 1)]), np.abs(a - b[np.maximum(after - 1, 0)]))
    return float(nearest.min()) / rate_hz


def check(parts: Split, logs: list[Motion], window_s: float, guard_s: float) -> None:
    for log, training, validation in zip(logs, parts.training, parts.validation, strict=True):
        assert not np.any(training & validation)
        assert not np.any((training | validation) & ~log.valid)
        # Rows this far apart share no sample: each smoothing window reaches half a window and a row of difference.
        assert gap_s(training, validation, log.rate_hz) >= window_s + 2 / log.rate_hz + guard_s - 0.5 / log.rate_hz


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(logs=motions(), window_s=st.floats(0, 2), guard_s=st.floats(0, 3))
def test_blocks_keep_apart(logs: list[Motion], window_s: float, guard_s: float) -> None:
    parts = unless_too_short(lambda: split_rows(logs, window_s=window_s, guard_s=guard_s))
    if parts is None:
        return
    check(parts, logs, window_s, guard_s)
    again = split_rows(logs, window_s=window_s, guard_s=guard_s)
    for log, one, two in zip(logs, parts.validation, again.validation, strict=True):
        np.testing.assert_array_equal(one, two)
        # Three of ten blocks, one of three; a short log among others is one block.
        assert 0.2 < one.sum() / log.valid.sum() < 0.55 or one.sum() in (0, log.valid.sum())


def test_ten_blocks_of_which_three_validate() -> None:
    log = motion(np.ones(6000, dtype=bool))
    parts = split_rows([log], window_s=1.0, guard_s=2.0, blocks=10)
    expected = np.zeros(6000, dtype=bool)
    for block in (1, 3, 8):
        expected[600 * block : 600 * block + 600] = True
    np.testing.assert_array_equal(parts.validation[0], expected)
    # Six borders, each with 3.2 s at 10 Hz taken from training.
    assert parts.training[0].sum() == 4200 - 6 * 32
    assert parts.purge_s == pytest.approx(3.2)
    assert parts.notes == ("trial: 10 blocks of 60 s; 401 s train, 180 s validate, 19 s purged in gaps of 3.2 s.",)


@pytest.mark.parametrize(("seconds", "length_s"), [(120, 120 / 9), (720, 40), (1440, 40), (7200, 200)])
def test_blocks_are_a_manoeuvre_long_and_neither_too_few_nor_too_many(seconds: int, length_s: float) -> None:
    validation = split_rows([motion(np.ones(10 * seconds, dtype=bool))], window_s=1.0, guard_s=2.0).validation[0]
    first = np.flatnonzero(validation)[0]  # the second of the first three blocks
    assert first / 10 == pytest.approx(length_s, abs=0.2)
    assert 0.3 < validation.mean() < 0.37


def test_blocks_do_not_keep_step_with_a_trial_that_repeats_itself() -> None:
    parts = split_rows([motion(np.ones(14400, dtype=bool))], window_s=1.0)
    phase = np.arange(14400) // 400 % 3
    for third in range(3):
        # Whatever recurs every three blocks is seen by training and by validation.
        assert parts.validation[0][phase == third].any()
        assert parts.training[0][phase == third].any()


def test_short_logs_are_blocks_among_themselves() -> None:
    logs = [motion(np.ones(300, dtype=bool), log=name) for name in "abcde"]
    parts = split_rows([*logs, motion(np.ones(6000, dtype=bool), log="long")], window_s=1.0)
    assert [mask.all() for mask in parts.validation] == [False, True, False, False, True, False]
    assert [mask.all() for mask in parts.training] == [True, False, True, True, False, False]
    assert parts.validation[-1].sum() == 5 * 400
    assert parts.notes[0] == "a: 1 block of 30 s; 30 s train, 0 s validate, 0 s purged in gaps of 3.2 s."


def test_every_kth_row_leaks_and_says_so() -> None:
    valid = np.ones(100, dtype=bool)
    valid[10:20] = False
    parts = split_rows([motion(valid)], "every-kth", window_s=1.0, every=3)
    assert parts.validation[0].sum() == 30
    assert parts.training[0].sum() == 60
    np.testing.assert_array_equal(np.flatnonzero(parts.validation[0])[:4], [2, 5, 8, 21])
    assert "too good" in parts.notes[0]
    assert parts.purge_s == 0.0


def test_whole_logs() -> None:
    logs = [motion(np.ones(100, dtype=bool), log=name) for name in ("a", "b", "c")]
    last = split_rows(logs, "logs", window_s=1.0)
    assert [mask.all() for mask in last.validation] == [False, False, True]
    named = split_rows(logs, "logs", window_s=1.0, validate=["a"])
    assert [mask.all() for mask in named.validation] == [True, False, False]
    assert [mask.all() for mask in named.training] == [False, True, True]


def test_what_cannot_be_split_is_refused_with_a_remedy() -> None:
    short = motion(np.ones(300, dtype=bool))
    with pytest.raises(FerryIdError, match=r"trial: too short for three blocks.*found 30\.0 s.*38\.4 s.*Fix: "):
        split_rows([short], window_s=1.0)
    with pytest.raises(FerryIdError, match=r"trial: a split by logs needs at least two.*Fix: "):
        split_rows([short], "logs", window_s=1.0)
    logs = [motion(np.ones(300, dtype=bool), log=name) for name in ("first", "second")]
    with pytest.raises(FerryIdError, match=r"no log called 'secnd' to validate on. Did you mean \"second\"\?"):
        split_rows(logs, "logs", window_s=1.0, validate=["secnd"])
    with pytest.raises(FerryIdError, match=r"every log validates.*Fix: "):
        split_rows(logs, "logs", window_s=1.0, validate=["first", "second"])
    with pytest.raises(FerryIdError, match=r'no split called "block". Did you mean "blocks"\?'):
        split_rows(logs, "block", window_s=1.0)


def test_the_correlation_time_is_that_of_a_first_order_process() -> None:
    rate, time_s = 10.0, 3.0
    decay = np.exp(-1 / (rate * time_s))
    noise = np.random.default_rng(0).normal(size=(200_000, 2))
    process = signal.lfilter([1.0], [1.0, -decay], noise, axis=0)
    everywhere = np.ones(200_000, dtype=bool)
    # Autocorrelation exp(-t / T) falls below 1/e at T.
    assert correlation_time(process, everywhere, rate) == pytest.approx(time_s, rel=0.1)
    holes = everywhere.copy()
    holes[::1000] = False
    spoilt = process.copy()
    spoilt[~holes] = np.nan
    assert correlation_time(spoilt, holes, rate) == pytest.approx(time_s, rel=0.1)
    assert correlation_time(noise, everywhere, rate) == pytest.approx(1 / rate)
    assert correlation_time(np.ones((100, 1)), everywhere[:100], rate) == 0.0
