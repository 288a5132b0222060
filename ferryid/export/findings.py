"""Findings of a diagnosis as messages of ROS 2's diagnostics, at the times at which they begin and end."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.diagnose import JUDGING, SCHEMA
from ferryid.effects import effects
from ferryid.effects.wording import titled
from ferryid.errors import FerryIdError
from ferryid.simulate.messages import typestore
from ferryid.simulate.sensors import Stream

TOPIC = "/diagnostics"
VALUES = "/ferryid/finding/"
ENDS = ("onset", "offset")
"""Parameters that the times of the values tell already."""
CDR = b"\x00\x01\x00\x00"
"""The head of a message in the encapsulation that ROS 2 uses."""
OK, WARN = 0, 1
LASTING_S = 1.0
"""What is seen until so shortly before the end of a log has not ended [s]."""


@dataclass(frozen=True)
class Told:
    """What is told at a time [s]: level, name, a sentence, and numbers as text."""

    time_s: float
    level: int
    name: str
    says: str
    values: tuple[tuple[str, str], ...] = ()


def read_diagnosis(path: Path, log: str) -> Mapping[str, Any]:
    """Return the part of a diagnosis that is of a log.

    Parameters
    ----------
    path
        JSON as ``ferryid diagnose --json`` writes it, of one log or several.
    log
        Name of the log.

    Raises
    ------
    FerryIdError
        When it is no diagnosis, one of a newer form, or not of this log.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise FerryIdError(
            f"{path}: no such file, a diagnosis was to be read. Fix: give a JSON file written by ferryid diagnose --json"
        ) from error
    except (OSError, ValueError, RecursionError) as error:
        raise FerryIdError(
            f"{path}: not readable as a diagnosis ({error}). Fix: give a JSON file written by ferryid diagnose --json"
        ) from error
    found = data.get("schema", "missing") if isinstance(data, dict) else "missing"
    if found != SCHEMA:
        raise FerryIdError(
            f"{path}: not a diagnosis that this version reads, its schema is {str(found)!r}, not {SCHEMA}. "
            "Fix: give a JSON file written by ferryid diagnose --json"
        )
    with _whole(path):
        return _of_log(data, log, path)


def told_by(path: Path, diagnosis: Mapping[str, Any], end_s: float) -> tuple[Told, ...]:
    """Return what a diagnosis says, in the order of time.

    Parameters
    ----------
    path
        Its file, for messages.
    diagnosis
        Of `read_diagnosis`.
    end_s
        Last time of the log [s]; what lasts until then was not seen to end.

    Raises
    ------
    FerryIdError
        When a part is missing or wrong.
    """
    with _whole(path):
        # Sorted by time alone: what is told at one time keeps its order.
        return tuple(sorted(_verdict(diagnosis, end_s), key=lambda told: told.time_s))


@contextmanager
def _whole(path: Path) -> Iterator[None]:
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise FerryIdError(
            f"{path}: a part of the diagnosis is missing or wrong ({type(error).__name__}: {error}). "
            "Fix: run ferryid diagnose again"
        ) from error


def _of_log(data: Mapping[str, Any], log: str, path: Path) -> Mapping[str, Any]:
    several: Sequence[Mapping[str, Any]] = data.get("logs", [data])
    named = [one for one in several if one["log"] == log]
    if len(named) != 1:
        logs = ", ".join(str(one["log"]) for one in several)
        raise FerryIdError(
            f"{path}: is to be the diagnosis of the log {log}, found {logs or 'none'}. Fix: give the diagnosis of this very log"
            + (" alone" if named else "")
        )
    return named[0]


def _verdict(one: Mapping[str, Any], end_s: float) -> Iterator[Told]:
    verdict = str(one["verdict"])
    level = OK if verdict == "matched" else WARN
    yield Told(0.0, level, "ferryid: verdict", verdict.replace("_", " "))
    for finding in one["findings"]:
        yield from _finding(finding, end_s)


def _finding(finding: Mapping[str, Any], end_s: float) -> Iterator[Told]:
    instance, effect = finding["instance"], effects().get(str(finding["effect"]))
    name = f"ferryid: {titled(effect.title if effect else str(finding['effect']), instance)}"
    probability, says = finding["probability"], str(finding["says"])
    hint = probability is not None and float(probability) <= JUDGING.hint_probability
    values = tuple(_values(finding))
    for first, last in _spans(finding["where"], end_s):
        yield Told(first, OK if hint else WARN, name, f"A hint only: {says}" if hint else says, values)
        if last is not None:
            yield Told(last, OK, name, "No longer.")


def _spans(where: Mapping[str, Any], end_s: float) -> list[tuple[float, float | None]]:
    """Return from when until when something acts [s]; the end is None where it was not seen to end."""
    spans = where["intervals"] or [[where["onset"], where.get("offset")]]
    times = [(float(first or 0.0), end_s if last is None else float(last)) for first, last in spans]
    return [(first, last if last < end_s - LASTING_S else None) for first, last in times]


def _values(finding: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "probability", _probability(finding["probability"])
    for name, one in finding["parameters"].items():
        unit = "" if one["unit"] == "-" else f" {one['unit']}"
        yield name, f"{_text(one['value'])}{unit} ({_text(one['low'])} to {_text(one['high'])})"
    for axis, share in finding["improvement"].items():
        yield f"held-out error removed, {axis}", _text(share)
    if finding["unresolved_with"]:
        yield "not separated from", ", ".join(finding["unresolved_with"])


def finding_values(path: Path, diagnosis: Mapping[str, Any], t0_ns: int, end_s: float) -> list[Stream]:
    """Return the parameters of findings as numbers over time, once a second, NaN while a finding does not act.

    Viewers plot numbers; the diagnostics hold texts. Arguments are those of `told_by`, and `t0_ns` as of `diagnostics`.
    """
    seconds = np.arange(0.0, end_s + 1.0)
    seconds[-1] = min(seconds[-1], end_s)
    times = t0_ns + np.round(seconds * 1e9).astype(np.int64)
    streams: list[Stream] = []
    with _whole(path):
        for finding in diagnosis["findings"]:
            acts = np.zeros(len(seconds), dtype=bool)
            for first, last in _spans(finding["where"], end_s):
                acts |= (seconds >= first) & (seconds <= (end_s if last is None else last))
            of = "/".join(str(one) for one in (finding["effect"], finding["instance"]) if one)
            for name, one in finding["parameters"].items():
                if name in ENDS or one["value"] is None:
                    continue
                values = np.where(acts, float(one["value"]), np.nan)
                messages = tuple(CDR + value.tobytes() for value in values.astype("<f8"))
                topic = re.sub(r"[^\w/]", "_", f"{VALUES}{of}/{name}")
                streams.append(Stream(topic, "std_msgs/msg/Float64", "", times, times, {}, whole=messages))
    return streams


def _probability(value: float | None) -> str:
    """Return a probability as reports tell it, without pretending to certainty."""
    if value is None or not isfinite(value):
        return "unknown"
    return "above 0.99" if value > 0.99 else "below 0.01" if value < 0.01 else f"{value:.2f}"


def _text(value: float | None) -> str:
    return "unknown" if value is None or not isfinite(value) else f"{value:.4g}"


def diagnostics(told: Sequence[Told], t0_ns: int, vessel: str) -> Stream:
    """Return what is told as messages; those of one time are one message.

    Parameters
    ----------
    told
        In the order of time.
    t0_ns
        Time of the log's first row [ns].
    vessel
        Its name.
    """
    types = typestore(2).types
    by_time: dict[int, list[Any]] = {}
    for one in told:
        status = types["diagnostic_msgs/msg/DiagnosticStatus"](
            level=one.level,
            name=one.name,
            message=one.says,
            hardware_id=vessel,
            values=[types["diagnostic_msgs/msg/KeyValue"](key=key, value=value) for key, value in one.values],
        )
        by_time.setdefault(t0_ns + round(one.time_s * 1e9), []).append(status)
    messages = []
    for when, several in by_time.items():
        stamp = types["builtin_interfaces/msg/Time"](*divmod(when, 10**9))
        header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
        array = types["diagnostic_msgs/msg/DiagnosticArray"](header=header, status=several)
        messages.append(bytes(typestore(2).serialize_cdr(array, "diagnostic_msgs/msg/DiagnosticArray")))
    times = np.array(list(by_time), dtype=np.int64)
    return Stream(TOPIC, "diagnostic_msgs/msg/DiagnosticArray", "", times, times, {}, whole=tuple(messages))
