"""A proof of small logs that hold nothing: what the real parts do, in no time, and a tally of how often."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from ferryid.errors import FerryIdError
from ferryid.prove.case import Case, Truth
from ferryid.prove.parts import Parts, Trial

ROOT = Path(__file__).resolve().parents[2]
LOGS = {"mcap": "short.mcap", "ros1": "short.bag", "ros2": "short_ros2"}
ENDS = {"mcap": ".mcap", "ros1": ".bag", "ros2": ""}
TALLY = "FERRYID_TEST_TALLY"
"""Variable with the file that every piece of work is counted in."""


@dataclass(frozen=True)
class Made:
    log: Path
    profile: Path
    acted: Mapping[str, Mapping[str, float]]


def count(what: str) -> None:
    with open(os.environ[TALLY], "a", encoding="utf-8") as file:
        file.write(what + "\n")


def counted() -> list[str]:
    return Path(os.environ[TALLY]).read_text("utf-8").split("\n")[:-1]


def draw(seed: int, runs: float, only: Sequence[str]) -> list[Case]:
    rng = Random(seed)
    return [
        Case(
            name=f"{number:04d}",
            cell="wind",
            kind="single",
            vessel="milliampere",
            path="short",
            format=tuple(LOGS)[number % 3],
            seed=rng.getrandbits(30),
            truths=(Truth("wind", None, {"north": rng.uniform(-9.0, 9.0), "east": 1.0}),),
        )
        for number in range(round(runs))
    ]


def generate(case: Case, folder: Path, *, again: bool = False) -> Made:
    count(f"generate {case.name} {again}")
    log, profile = folder / f"{case.name}{ENDS[case.format]}", folder / "vessel.toml"
    source = ROOT / "fixtures" / LOGS[case.format]
    (shutil.copytree if source.is_dir() else shutil.copy)(source, log)
    shutil.copy(ROOT / "ferryid" / "vessel" / "profiles" / "milliampere.toml", profile)
    return Made(log, profile, {"wind": {"force": 0.1 + float(case.truths[0].values["north"])}})


def chatty(case: Case, folder: Path, *, again: bool = False) -> Made:
    made = generate(case, folder, again=again)
    (folder / "truth.json").write_text("{}", encoding="utf-8")
    return made


def oracle(trial: Trial) -> dict[str, Any]:
    count(f"oracle {trial.case.name}")
    return {"north": trial.case.truths[0].values["north"], "log": trial.log.exists() and trial.profile.exists()}


def second(trial: Trial) -> dict[str, Any]:
    count(f"second {trial.case.name}")
    if trial.case.name == "0001":
        raise FerryIdError("this one cannot be used. Fix: none")
    return {"log": generate(trial.case, trial.folder, again=True).log.name, "model": trial.model}


def score(trials: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    verdicts = [one["diagnosis"]["verdict"] for one in trials]
    return {
        "targets": [{"what": "all were told", "reached": True}],
        "scores": {"verdicts": verdicts, "of": list(trials)},
    }


PARTS = Parts(draw, generate, {"oracle": oracle, "second": second}, score)
