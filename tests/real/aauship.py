"""AAUSHIP's folder as it comes off the boat: which files are recordings, and what is found in them."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.signals.artificial import NO_RECORDING
from ferryid.signals.recording import record
from ferryid.vessel import parse_profile
from tests.real.places import DATA

BAGS = "aauship/*.bag"
SECONDS = 120.0
"""Aim for the command on the whole folder [s]."""
STEP_RAD = np.radians(30.0)
"""Steps of the heading from one sample to the next that the gyro is asked about."""
VESSEL = """schema = "ferryid.vessel/1"
name = "aauship"
title = "AAUSHIP, 13 kg boat with two fixed propellers"
source = "Aalborg University, 24 and 25 May 2017; mass and places of the propellers as given, thrust curve a guess of its size"

[hull]
length_m = 1.0
mass_kg = 13.0
k_zz_m = 0.25

[[actuator]]
name = "left"
kind = "propeller"
position_m = [-0.48, -0.05]
thrust = { kind = "quadratic", input = "rpm", ahead = 4.0e-5 }

[[actuator]]
name = "right"
kind = "propeller"
position_m = [-0.48, 0.05]
thrust = { kind = "quadratic", input = "rpm", ahead = 4.0e-5 }

# Pulses of -500 to 500, both orders on one topic.
[signals]
"left.speed.command" = { topic = "/lli_input", field = "Data", where = { DevID = 10, MsgID = 5 }, unit = "rpm" }
"right.speed.command" = { topic = "/lli_input", field = "Data", where = { DevID = 10, MsgID = 3 }, unit = "rpm" }
"""
ATTITUDE = 'heading = { topic = "/kf_attitude", field = "yaw", unit = "rad", frame = "NED" }\n'
TURNING = 'yaw_rate = { topic = "/kf_attitude", field = "yawd", unit = "rad/s", frame = "FRD" }\n'
PLACE = 'position = { topic = "/gps1", fields = ["latitude", "longitude"], unit = "rad", frame = "geodetic" }\n'
GYRO = 'yaw_rate = { topic = "/imu", field = "zgyro", unit = "rad/s", frame = "FLU" }\n'
MAPPINGS: Mapping[str, str] = {
    "receiver and attitude": PLACE + ATTITUDE + TURNING,
    "states of the boat's filter": (
        'position = { topic = "/kf_statesnew", fields = ["x", "y"], unit = "m", frame = "NED" }\n'
        'heading = { topic = "/kf_statesnew", field = "psi", unit = "rad", frame = "NED" }\n'
        'velocity = { topic = "/kf_statesnew", fields = ["u", "v"], unit = "m/s", frame = "FRD" }\n'
        'yaw_rate = { topic = "/kf_statesnew", field = "r", unit = "rad/s", frame = "FRD" }\n'
    ),
    "position of the controllers": (
        'position = { topic = "/kf_position", fields = ["xn", "yn"], unit = "m", frame = "NED" }\n' + ATTITUDE + TURNING
    ),
}
"""Signals that a crew may map, by what they are."""
SIMULATED = "simulated, or reckoned, and not measured"
REASONS: Mapping[str, str] = {
    r"is no recording of a vessel|no recording of a vessel|it is simulated among": SIMULATED,
    r'found no topic "([^"]+)"': "no {}",
    r"log shorter than": "too short",
    r"contradict each other": "its signals contradict each other",
    r"no common hull": "no common hull fits",
}
"""What a note says of a file, and the reason in short."""


@dataclass(frozen=True)
class Made:
    """What the command makes of the folder under one mapping.

    Attributes
    ----------
    seconds
        How long it took, the report included.
    logs
        Plain values of the diagnoses.
    notes
        Sentences on the whole.
    """

    seconds: float
    logs: Sequence[Mapping[str, Any]]
    notes: Sequence[str]

    def claimed(self, sure: bool) -> list[tuple[str, str]]:
        """Return effect and log of findings above the probability of a hint, or of the others."""
        return [
            (str(each["effect"]), str(one["log"]))
            for one in self.logs
            for each in one["findings"]
            if (each["probability"] > JUDGING.hint_probability) == sure
        ]

    def refused(self, files: Iterable[str]) -> dict[str, list[str]]:
        """Return the names of files that are no recordings that can be used, by the reason in short."""
        found: dict[str, list[str]] = {}
        for name in files:
            if self.simulated(name):
                found.setdefault(SIMULATED, []).append(name)
                continue
            for note in self.notes:
                if name in note and (why := reason(note)):
                    found.setdefault(why, []).append(name)
                    break
        return found

    def simulated(self, log: str) -> bool:
        """Return whether the tool says of a log that it is no recording: of all that it can read together where none is."""
        if any(f"{log}.bag" in note and reason(note) not in ("", SIMULATED) for note in self.notes):
            return False
        return any(
            NO_RECORDING in note and (f"{log}.bag {NO_RECORDING}" in note or note.startswith("Each of the "))
            for note in self.notes
        )


def reason(note: str) -> str:
    """Return in short why a file is not used, empty where a note does not say that."""
    for pattern, short in REASONS.items():
        if match := re.search(pattern, note):
            return short.format(*match.groups())
    return ""


def made(signals: str, logs: Sequence[str]) -> Made:
    """Run the command on logs with a profile that maps these signals."""
    with tempfile.TemporaryDirectory() as name:
        out, profile = Path(name), Path(name) / "aauship.toml"
        profile.write_text(VESSEL + signals, encoding="utf-8")
        began = time.monotonic()
        run = subprocess.run(
            [
                *(str(Path(sys.executable).with_name("ferryid")), "diagnose", *logs, "--vessel", str(profile)),
                *("--out", str(out), "--json", str(out / "found.json")),
            ],
            capture_output=True,
            text=True,
            check=False,
        )
        seconds = time.monotonic() - began
        assert run.returncode == 0, run.stderr
        found = json.loads((out / "found.json").read_text(encoding="utf-8"))
    return Made(seconds, found["logs"], list(dict.fromkeys(note for one in found["logs"] for note in one["notes"])))


def turned(log: str) -> tuple[list[float], list[float]]:
    """Return steps of the heading beyond `STEP_RAD` and what the gyro turned meanwhile [deg]; no diagnosis reads the gyro."""
    seen = record(log, parse_profile(VESSEL + PLACE + ATTITUDE + GYRO, "aauship.toml"), None)
    heading, gyro = seen.streams["/kf_attitude"], seen.streams["/imu"]
    psi, t = heading.columns["psi"], heading.time_ns * 1e-9
    steps = (np.diff(psi) + np.pi) % (2.0 * np.pi) - np.pi
    large = np.flatnonzero(np.abs(steps) > STEP_RAD)
    angle = np.concatenate([[0.0], np.cumsum(np.diff(gyro.time_ns * 1e-9) * gyro.columns["r"][1:])])
    at = np.interp(t, gyro.time_ns * 1e-9, angle)
    return np.degrees(steps[large]).tolist(), np.degrees(at[large + 1] - at[large]).tolist()


def witnessed(effect: str, path: str) -> str:
    """Return what defends a finding that is named, empty where nothing does."""
    if effect != "heading_wrap":
        return ""
    steps, gyro = turned(path)
    if not steps or max(map(abs, gyro)) > 0.25 * max(map(abs, steps)):
        return ""
    told = ", ".join(f"{one:.0f}" for one in steps)
    return (
        f"the heading steps by {told} deg from one sample to the next, while the gyro of /imu, which the profile does not map, "
        f"turned by {max(map(abs, gyro)):.1f} deg at most"
    )


def section() -> str:
    """Return the section on AAUSHIP."""
    logs = [str(path) for path in sorted(DATA.glob(BAGS))]
    results = {title: made(signals, logs) for title, signals in MAPPINGS.items()}
    lines = [
        "\n## AAUSHIP, a folder as it comes off the boat\n",
        f"{counted(len(logs), 'bag')} of a boat of one metre, of two days, as they are: `ferryid diagnose` of the whole folder "
        "as one campaign, the report included. Nobody measured wind or current, and no thrust curve is known; the profile has "
        "a guess of its size. Three mappings of the boat's signals are tried; that of the receiver is the one that measures.",
        "",
        "| mapped | taken as recordings | not taken | named | hints | time [s] |",
        "|---|---|---|---|---|---|",
    ]
    lines += [_row(title, one, logs) for title, one in results.items()]
    names = [Path(one).stem for one in logs]
    unmeasured = {
        name for one in results.values() for why, of in one.refused(names).items() if why == SIMULATED for name in of
    }
    lines += [
        "",
        f"Under some mapping, {len(unmeasured)} of {counted(len(logs), 'file')} show that they are {SIMULATED}.",
    ]
    for title, one in results.items():
        lines += ["", f"Not taken with *{title}*:", ""]
        lines += [f"- {why}: {', '.join(map(_short, names))}." for why, names in one.refused(names).items()]
    lines += ["", "| aim | | figure | |", "|---|---|---|---|", *aims(results, logs)]
    return "\n".join(lines)


def aims(results: Mapping[str, Made], logs: Sequence[str]) -> list[str]:
    """Return the rows of what is aimed at: names that something defends, and the time."""
    paths = {Path(one).stem: one for one in logs}
    named = [one for made_ in results.values() for one in made_.claimed(sure=True) if not made_.simulated(one[1])]
    defended = {one: witnessed(one[0], paths[one[1]]) for one in dict.fromkeys(named)}
    missing = [f"{effect} in {_short(log)}" for (effect, log), why in defended.items() if not why]
    slowest = max(one.seconds for one in results.values())
    told = "; ".join(f"{effect} in {_short(log)}: {why}" for (effect, log), why in defended.items() if why)
    figure = f"without one: {', '.join(missing)}" if missing else told or "nothing named"
    return [
        f"| every finding that is named is shown by an independent signal | all | "
        f"{figure} | {'**missed**' if missing else 'reached'} |",
        f"| the whole folder | at most {SECONDS:.0f} s | {slowest:.0f} s | "
        f"{'reached' if slowest <= SECONDS else '**missed**'} |",
    ]


def _row(title: str, one: Made, logs: Sequence[str]) -> str:
    taken = [each for each in one.logs if not one.simulated(str(each["log"]))]
    claims = (
        ", ".join(f"{effect} ({counted(count, 'log')})" for effect, count in _counts(one, sure).items()) or "none"
        for sure in (True, False)
    )
    return f"| {title} | {len(taken)} | {len(logs) - len(taken)} | {' | '.join(claims)} | {one.seconds:.0f} |"


def _counts(one: Made, sure: bool) -> dict[str, int]:
    """Return of how many recordings each effect is said."""
    found: dict[str, set[str]] = {}
    for effect, log in one.claimed(sure):
        if not one.simulated(log):
            found.setdefault(effect, set()).add(log)
    return {effect: len(of) for effect, of in found.items()}


def _short(name: str) -> str:
    return name.replace("aauship_control_2017-", "").replace("bags_2017-", "bags ")
