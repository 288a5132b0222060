"""Times of a table: seconds to nanoseconds as numbers, dates and times as text, and guessing which column it is."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ferryid.ingest.log import Column
from ferryid.types import Nanoseconds

_READABLE = 0.75
"""Share of the cells that must be readable in a column that is guessed to be the time."""
_PREFIX = {3: "milli", 6: "micro", 9: "nano"}
UNIT_NS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
_DATETIME = re.compile(r"\s*\d{4}[-/.]\d{2}[-/.]\d{2}[ T_]\d{2}:\d{2}:\d{2}([.,:]\d*)?\s*(Z|[+-]\d{2}:?\d{2})?\s*$")
"""Scripts that name files after the time also write it as ``2024-03-07_15:34:58:780059``."""
_CLOCK = re.compile(r"\s*\d{1,2}:\d{2}:\d{2}([.,:]\d*)?\s*$")
_CLOCK_ROWS = 1000
_HALF_DAY_NS = 43_200 * 1_000_000_000
_TIME_NAME = re.compile(
    r"%?(rosbag|log|gps|unix|epoch|utc|receive|recv|elapsed|rec)?[ _.]*"
    r"(t|tvec|times?|timestamp|stamp|date|date[ _]?time|utc|secs?|seconds|zeit|tid|temps)(?:[ _.]*(\d|abs|rel|utc))?$"
)
_UNIT_WORD = re.compile(
    r"(?: *[\[(] *|[ _.]+)(s|sec|secs|seconds?|ms|msec|millis|us|usec|micros|ns|nsec|nanos) *[\])]?$"
)
_UNIT_OF_WORD = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "millis"), "ms"),
    **dict.fromkeys(("us", "usec", "micros"), "us"),
    **dict.fromkeys(("ns", "nsec", "nanos"), "ns"),
}
_TIME_WORDS = frozenset(
    [
        "t",
        "tid",
        "zeit",
        "temps",
        "tiempo",
        "tempo",
        "time",
        "stamp",
        "sec",
        "secs",
        "second",
        "seconds",
        "clock",
        "utc",
        "epoch",
        "tow",
    ]
)
_PARTS = frozenset(["nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds", "usec", "usecs"])
_NO_TIME = frozenset(["zone", "timezone", "timeout", "constant", "delay", "latency", "period", "rate", "step", "dt"])
"""Words that make a column with a word for time something else."""
_UNIT_NAMES = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
_EARLIEST_S, _LATEST_S = 5e8, 4.2e9
"""Times since 1970 lie between these (1985 and 2103)."""
_SLOWEST_S, _FASTEST_S = 5.0, 5e-5
"""Usual time between rows that is doubted outside these limits where another unit of time fits better."""
_LONGEST_DATE = 64
"""Characters; a longer cell is no date."""
_STAMP_SECONDS = re.compile(r"(.*stamp.*?)([._ ]?)(secs?|seconds)$")


@dataclass(frozen=True)
class TimePlan:
    """Which columns of a table are its times.

    `column` is in `unit` (``"s"``, ``"ms"``, ``"us"``, ``"ns"`` or ``"datetime"``); `stamp` holds no column, one in
    `unit`, or two that are seconds and nanoseconds. `note` tells what was guessed, empty where a profile states it.
    """

    column: str
    unit: str
    stamp: tuple[str, ...] = ()
    note: str = ""


def looks_like_datetime(text: str) -> bool:
    """Return True for ``2025/04/11 11:15:45.313`` and its kin, year first."""
    return _DATETIME.match(text) is not None


def looks_like_clock_time(text: str) -> bool:
    """Return True for a time of day without a date, ``11:15:45.313``."""
    return _CLOCK.match(text) is not None


def guess_time(sample: Mapping[str, Sequence[str]]) -> TimePlan | None:
    """Guess the time column from names and a sample of the rows, None where nothing looks like one.

    A name that is no more than a word for time comes first, then a column of dates, then a rising column with such a word
    somewhere in its name, before dates without a zone where it counts from 1970, and last a rising first column without a
    name. Other columns of the third kind are listed in the note.

    Parameters
    ----------
    sample
        Column name to its first values as text.
    """
    for name in sample:
        if _TIME_NAME.match(_without_unit(name)[0]) and (plan := _time_of(sample, name)) is not None:
            return _finer(sample, plan)
    found = {
        name: numbers
        for name, values in sample.items()
        if has_time_word(name) and (numbers := _rising(values, strict=False)) is not None and np.ptp(numbers) > 0.0
    }
    # A date without a zone may be of any, seconds since 1970 are not.
    since_1970 = [
        name
        for name, numbers in found.items()
        if _counts_from_1970(name, numbers) and 2 * len(set(sample[name])) > len(sample[name])
    ]
    for name, values in sample.items():
        if _are_datetimes(values) and not (since_1970 and _unzoned(values)):
            return _plan(sample, name, "datetime", "date and time")
        if since_1970 and _are_datetimes(values):
            # What gives way to them is not to be lost to a time of something else.
            found = {one: found[one] for one in (*since_1970, *found)}
    if found:
        name, others = next(iter(found)), list(found)[1:]
        plan = _plan(sample, name, *_unit_of(_without_unit(name)[1], found[name]))
        if not others:
            return plan
        listed = ", ".join(f'"{other}"' for other in others[:6])
        return replace(plan, note=f"{plan.note}, though {listed} may be it too: set time under [table] in the profile")
    # Without a name the first column may be the time; one with a name says that it is something else.
    name = next((one for one in sample if one == "column 1"), "")
    rising = _rising(sample.get(name, ()), strict=True)
    # A row counter also rises: an unnamed first column of whole numbers from 0 or 1 in steps of one is no time.
    if rising is None or (np.all(np.diff(rising) == 1.0) and rising[0] in (0.0, 1.0)):
        return None
    unit, why = _unit_of("", rising)
    return _plan(sample, name, unit, why + ", the first column and rising")


def _time_of(sample: Mapping[str, Sequence[str]], name: str) -> TimePlan | None:
    """Return a column as the time of a table, None where it has no dates and does not rise."""
    if _are_datetimes(sample[name]):
        return _plan(sample, name, "datetime", "date and time")
    if _are_clock_times(sample[name]):
        return _plan(sample, name, "datetime", "time of day, of which date is not known")
    numbers = _rising(sample[name], strict=False)
    return None if numbers is None else _plan(sample, name, *_unit_of(_without_unit(name)[1], numbers))


def _finer(sample: Mapping[str, Sequence[str]], plan: TimePlan) -> TimePlan:
    """Return another column that may be the time where most rows repeat the time of a plan, and far fewer that of the other.

    Dates are often written in whole seconds, beside a clock that counts milliseconds.
    """
    different = {name: len(set(values)) for name, values in sample.items() if has_time_word(name)}
    coarse = len(set(sample[plan.column]))
    if 2 * coarse > len(sample[plan.column]):
        return plan
    for name, count in different.items():
        if name != plan.column and count >= 2 * coarse and (other := _time_of(sample, name)) is not None:
            return replace(other, note=f'{other.note}, as most rows repeat the time of "{plan.column}"')
    return plan


def unit_doubt(numbers: NDArray[np.float64], unit: str) -> str:
    """Return what speaks against a stated unit of time, as a sentence with its remedy, or an empty string.

    Parameters
    ----------
    numbers
        Sample of the time column in the order of the rows, shape (n,).
    unit
        ``"s"``, ``"ms"``, ``"us"`` or ``"ns"``.
    """
    likely = guess_unit(numbers)
    if UNIT_NS[likely] == UNIT_NS[unit]:
        return ""
    scale = UNIT_NS[unit] * 1e-9
    step = _usual_step(numbers) * scale
    size = float(np.abs(numbers).max(initial=0.0)) * scale
    remedy = f'these look like {_UNIT_NAMES[likely]}, so set time_unit = "{likely}" under [table] in the profile'
    if size > _LATEST_S:
        return f'times of {size:.3g} s with time_unit = "{unit}": {remedy}'
    if UNIT_NS[likely] < UNIT_NS[unit] and step > _SLOWEST_S:
        return f'rows {step:.4g} s apart with time_unit = "{unit}": {remedy}'
    if UNIT_NS[likely] > UNIT_NS[unit] and 0.0 < step < _FASTEST_S:
        return f'rows {step:.2g} s apart with time_unit = "{unit}": {remedy}'
    return ""


def guess_unit(numbers: NDArray[np.float64]) -> str:
    """Guess the unit of times from their size, where they count from 1970, or else from the steps between rows."""
    size = float(np.abs(numbers).max(initial=0.0))
    step = _usual_step(numbers)
    for unit, nanoseconds in UNIT_NS.items():
        scale = 1e9 / nanoseconds
        if _EARLIEST_S * scale < size < _LATEST_S * scale and not step > 100.0 * scale:
            return unit
    if math.isnan(step):
        return "s"
    return next((unit for unit, nanoseconds in UNIT_NS.items() if step * nanoseconds * 1e-9 <= _SLOWEST_S), "ns")


def _usual_step(numbers: NDArray[np.float64]) -> float:
    """Median of the steps forward, NaN where there is none."""
    steps = np.diff(numbers[np.isfinite(numbers)])
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if len(steps) else math.nan


def _unit_of(word: str, numbers: NDArray[np.float64]) -> tuple[str, str]:
    """Unit of a time column by the word in its name, else by its numbers, and what to report of it."""
    if word in _UNIT_OF_WORD:
        return _UNIT_OF_WORD[word], _UNIT_OF_WORD[word]
    unit, step = guess_unit(numbers), _usual_step(numbers)
    if unit == "s" or not step > _SLOWEST_S or float(np.abs(numbers).max()) > _EARLIEST_S * 1e9 / UNIT_NS[unit]:
        return unit, unit
    return unit, f"{unit}, since steps of {step:.6g} are too long for seconds"


def has_time_word(name: str) -> bool:
    """True for a name with a word for time in it that does not count parts of a second (``stamp_nsecs``)."""
    words = re.findall(r"[a-z]+", re.sub(r"([a-z])([A-Z])", r"\1 \2", name).lower())
    if any(word in _PARTS or word in _NO_TIME for word in words):
        return False
    return any(word in _TIME_WORDS or "time" in word or "stamp" in word for word in words)


def guess_stamp(names: Sequence[str]) -> tuple[str, ...]:
    """Return the columns of a sender's stamp in seconds and nanoseconds, or ``()``."""
    present = set(names)
    for name in names:
        found = _STAMP_SECONDS.match(name)
        if found is None:
            continue
        stem, joint = found.group(1), found.group(2)
        for ending in ("nsecs", "nsec", "nanosec", "nanosecs", "nanoseconds"):
            if stem + joint + ending in present:
                return (name, stem + joint + ending)
    return ()


def numbers_to_ns(values: Column, unit: str) -> tuple[Nanoseconds, NDArray[np.bool_]]:
    """Convert numeric times to whole nanoseconds.

    Returns
    -------
    tuple
        Times [ns], shape (n,), 0 where unreadable, and a mask that is True where a time was readable.
    """
    scale = UNIT_NS[unit]
    if values.dtype.kind in "iu":
        most = np.iinfo(np.int64).max // scale
        fits = (values >= -most) & (values <= most) if values.dtype.kind == "i" else values <= most
        return np.where(fits, values, 0).astype(np.int64) * np.int64(scale), fits
    seconds = values.astype(np.float64)
    with np.errstate(invalid="ignore"):
        good = np.abs(seconds) < 9.2e18 / scale
    whole = np.floor(np.where(good, seconds, 0.0))
    # Whole and fractional part apart: 1.7e9 s times 1e9 in one float would round to 256 ns twice.
    part = np.rint((np.where(good, seconds, 0.0) - whole) * scale)
    return whole.astype(np.int64) * np.int64(scale) + part.astype(np.int64), good


def stamps_to_ns(seconds: Column, nanoseconds: Column) -> tuple[Nanoseconds, NDArray[np.bool_]]:
    """Join columns of whole seconds and of nanoseconds; same returns as `numbers_to_ns`."""
    whole, good = numbers_to_ns(seconds, "s")
    part, also = numbers_to_ns(nanoseconds, "ns")
    good &= also & (np.abs(whole) < 1 << 62) & (np.abs(part) < 1 << 62)
    return np.where(good, whole + part, 0), good


def datetimes_to_ns(texts: Sequence[str]) -> tuple[Nanoseconds, NDArray[np.bool_], str]:
    """Parse dates and times, year first, or times of day, without losing nanoseconds; no zone is taken as UTC.

    Times of day count from midnight before the first, and go on beyond the next.

    Some exporters write the fraction as an unpadded count of nanoseconds (``45.81833647`` for 45.081833647 s). Where
    fractions differ in length, both readings are tried and the one with fewer steps back in time is kept.

    Returns
    -------
    tuple
        Times [ns], shape (n,), 0 where unreadable; a mask, True where readable; a sentence on a
        repair, or an empty string.
    """
    # Some of the rows show it: a pattern matched on every row of a long table takes seconds.
    if _are_clock_times(texts[:: 1 + len(texts) // _CLOCK_ROWS]):
        # Hours of one digit become two.
        dated = [f"1970-01-01 {'0' * (text.strip()[1:2] == ':')}{text.strip()}" for text in texts]
        times, readable, note = datetimes_to_ns(dated)
        days = np.zeros(len(times), dtype=np.int64)
        days[readable] = np.concatenate(([0], np.cumsum(np.diff(times[readable]) < -_HALF_DAY_NS)))
        return times + 2 * _HALF_DAY_NS * days, readable, note
    rows = len(texts)
    width = min(max((len(text) for text in texts), default=0), _LONGEST_DATE)
    if rows == 0 or width < 19:
        return np.zeros(rows, dtype=np.int64), np.zeros(rows, dtype=bool), ""
    # Characters outside ASCII become "?", which no field of a date accepts.
    plain = (text.strip() for text in texts)
    raw = np.array([t.encode("ascii", "replace") if len(t) <= width else b"" for t in plain], dtype=f"S{width}")
    code = raw.view(np.uint8).reshape(rows, width).astype(np.int16)
    digit = code - ord("0")
    is_digit = (digit >= 0) & (digit <= 9)

    def number(first: int, count: int) -> NDArray[np.int64]:
        value = np.zeros(rows, dtype=np.int64)
        for place in range(first, first + count):
            value = value * 10 + digit[:, place]
        return value

    wanted_digits = [0, 1, 2, 3, 5, 6, 8, 9, 11, 12, 14, 15, 17, 18]
    good = is_digit[:, wanted_digits].all(axis=1)
    good &= np.isin(code[:, 4], [ord(c) for c in "-/."]) & (code[:, 4] == code[:, 7])
    good &= np.isin(code[:, 10], [ord(c) for c in " T_"])
    good &= (code[:, 13] == ord(":")) & (code[:, 16] == ord(":"))
    month, day = number(5, 2), number(8, 2)
    hour, minute, second = number(11, 2), number(14, 2), number(17, 2)
    year = number(0, 4)
    good &= (year > 1677) & (year < 2262)  # what 64 bits of nanoseconds hold
    good &= (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31) & (hour < 24) & (minute < 60) & (second <= 60)
    months = (np.where(good, year, 1970) - 1970) * 12 + np.where(good, month, 1) - 1
    first_day = months.astype("datetime64[M]").astype("datetime64[D]")
    days = first_day.astype(np.int64) + np.where(good, day, 1) - 1
    good &= (days.astype("datetime64[D]").astype("datetime64[M]").astype(np.int64)) == months
    base = ((days * 24 + hour) * 60 + minute) * 60 + second

    # The fraction: digits after a point at place 19, as long as they last.
    fraction = np.zeros(rows, dtype=np.int64)
    length = np.zeros(rows, dtype=np.int64)
    running = np.isin(code[:, 19], [ord(c) for c in ".,:"]) if width > 19 else np.zeros(rows, dtype=bool)
    pointed = running.copy()
    for place in range(20, width):
        running &= is_digit[:, place]
        keep = running & (length < 9)
        fraction = np.where(keep, fraction * 10 + digit[:, place], fraction)
        length += running
    offset_s = _zone_offset_s(texts, good, 19 + pointed + length, raw)
    length = np.minimum(length, 9)
    base = np.where(good, base - offset_s, 0)
    padded = base * 1_000_000_000 + fraction * 10 ** (9 - length)
    longest = int(length[good].max(initial=0))
    short = good & pointed & (length < longest)
    note = ""
    if longest in (3, 6, 9) and short.any():
        counted = base * 1_000_000_000 + fraction * 10 ** (9 - longest)
        if np.sum(np.diff(counted[good]) < 0) < np.sum(np.diff(padded[good]) < 0):
            note = (
                f"{_share(int(short.sum()), rows)} of the times have a fraction without its leading zeros "
                f"(an unpadded count of {_PREFIX[longest]}seconds): read as such"
            )
            padded = counted
    return np.where(good, padded, 0), good, note


def _share(part: int, whole: int) -> str:
    """A count, or percent where it is more than one in a hundred."""
    return f"{100 * part / whole:.0f} %" if part * 100 > whole else str(part)


def _zone_offset_s(
    texts: Sequence[str], good: NDArray[np.bool_], end: NDArray[np.int64], raw: Column
) -> NDArray[np.int64]:
    """Offset of each text's zone [s]; marks texts with anything else after the seconds as unreadable."""
    lengths = np.char.str_len(raw)
    offsets = np.zeros(len(texts), dtype=np.int64)
    tails: dict[bytes, int | None] = {b"": 0, b"Z": 0}
    for row in np.flatnonzero(good & (lengths > end)):
        tail = bytes(raw[row])[end[row] :].strip()
        if tail not in tails:
            found = re.fullmatch(rb"([+-])(\d{2}):?(\d{2})", tail)
            tails[tail] = (
                None if found is None else (1 if found[1] == b"+" else -1) * (int(found[2]) * 3600 + int(found[3]) * 60)
            )
        value = tails[tail]
        if value is None:
            good[row] = False
        else:
            offsets[row] = value
    return offsets


def _without_unit(name: str) -> tuple[str, str]:
    lowered = name.strip().lower()
    found = _UNIT_WORD.search(lowered)
    if found is None or found.start() == 0:
        return lowered, ""
    return lowered[: found.start()].rstrip(" _."), found.group(1)


def _rising(values: Sequence[str], *, strict: bool) -> NDArray[np.float64] | None:
    """The values as numbers if they rise, else None."""
    readable = [number for value in values if math.isfinite(number := _float_or_nan(value))]
    if not readable or len(readable) < _READABLE * len(values):
        return None
    numbers = np.array(readable)
    steps = np.diff(numbers)
    if strict:
        return numbers if len(steps) and bool((steps > 0).all()) else None
    return numbers if len(steps) == 0 or float(np.mean(steps >= 0)) > 0.8 else None


def _float_or_nan(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _are_datetimes(values: Sequence[str]) -> bool:
    readable = sum(looks_like_datetime(value) for value in values)
    return readable > 0 and readable >= _READABLE * len(values)


def _are_clock_times(values: Sequence[str]) -> bool:
    readable = sum(looks_like_clock_time(value) for value in values)
    return readable > 0 and readable >= _READABLE * len(values)


def _unzoned(values: Sequence[str]) -> bool:
    """True where no date states its zone."""
    return not any((found := _DATETIME.match(value)) is not None and found.group(2) for value in values)


def _counts_from_1970(name: str, numbers: NDArray[np.float64]) -> bool:
    """True for a time of which most numbers count from 1970 in its unit."""
    scale = 1e9 / UNIT_NS[_unit_of(_without_unit(name)[1], numbers)[0]]
    return _EARLIEST_S * scale < float(np.median(numbers)) < _LATEST_S * scale


def _plan(sample: Mapping[str, Sequence[str]], column: str, unit: str, says: str) -> TimePlan:
    stamp = guess_stamp(tuple(sample))
    note = f'time guessed: column "{column}" ({says})'
    if stamp:
        note += f', stamp in "{stamp[0]}" + "{stamp[1]}"'
    return TimePlan(column, unit, stamp, note)
