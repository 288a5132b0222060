"""A validation run of small logs that hold nothing: what the real pipeline does, in no time, and a tally of how often."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

from ferryid.errors import FerryIdError
from ferryid.json_record import Record
from ferryid.validation.case import Case, Truth
from ferryid.validation.interfaces import Evaluator, Pipeline, Trial
from ferryid.validation.records import CaseResult
from ferryid.validation.source_hash import source_hash

if TYPE_CHECKING:
    from ferryid.validation.targets import Target

ROOT = Path(__file__).resolve().parents[2]
LOGS = {"mcap": "short.mcap", "ros1": "short.bag", "ros2": "short_ros2"}
ENDS = {"mcap": ".mcap", "ros1": ".bag", "ros2": ""}
TALLY = "FERRYID_TEST_TALLY"
"""Variable with the file that every piece of work is counted in."""
QUICK = (
    "-c",
    f"""
import json, os, sys, time
print(json.dumps({{"sources": {source_hash()!r}}}), flush=True)
for line in sys.stdin:
    time.sleep(0.05)
    verdict = "not_testable" if os.path.isdir(os.environ["TMPDIR"]) else "crashed"
    print(json.dumps({{"verdict": verdict, "seconds": 0.05}}), flush=True)
""",
)
"""What a worker is to run that answers as one whose logs hold nothing, and loads nothing to do so; as such a one it needs the
folder for temporary files that it was given."""


@dataclass(frozen=True)
class Made:
    log: Path
    profile: Path
    more: tuple[Path, ...] = ()
    before: tuple[Path, ...] = ()


@dataclass(frozen=True)
class OracleMade(Record):
    north: float
    log: bool


@dataclass(frozen=True)
class TransferMade(Record):
    log: str


@dataclass(frozen=True)
class Scored(Record):
    verdicts: tuple[str, ...]
    of: tuple[Any, ...]


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


def generate(case: Case, folder: Path, *, transfer: bool = False) -> Made:
    count(f"generate {case.name} {transfer}")
    log, profile = folder / f"{case.name}{ENDS[case.format]}", folder / "vessel.toml"
    source = ROOT / "fixtures" / LOGS[case.format]
    (shutil.copytree if source.is_dir() else shutil.copy)(source, log)
    shutil.copy(ROOT / "ferryid" / "vessel" / "profiles" / "milliampere.toml", profile)
    return Made(log, profile)


def realise(case: Case) -> dict[str, dict[str, float]]:
    return {"wind": {"force": 0.1 + float(case.truths[0].values["north"])}}


def chatty(case: Case, folder: Path, *, transfer: bool = False) -> Made:
    made = generate(case, folder, transfer=transfer)
    (folder / "truth.json").write_text("{}", encoding="utf-8")
    return made


def oracle(trial: Trial) -> OracleMade:
    count(f"oracle {trial.case.name}")
    return OracleMade(trial.case.truths[0].values["north"], trial.log.exists() and trial.profile.exists())


def transfer(trial: Trial) -> TransferMade | None:
    count(f"transfer {trial.case.name}")
    if trial.case.name == "0001":
        raise FerryIdError("this one cannot be used. Fix: none")
    if trial.case.name == "0002":
        return None
    return TransferMade(generate(trial.case, trial.folder, transfer=True).log.name)


def score(results: Sequence[CaseResult]) -> Scored:
    plain = [
        {
            "case": one.case.to_json(),
            "realised": one.realised,
            **{name: None if found is None else found.to_json() for name, found in one.evaluations.items()},
        }
        for one in results
    ]
    return Scored(tuple(one.diagnosis.verdict for one in results), tuple(plain))


def targets(scores: Scored) -> list[Target]:
    # Not in the processes that import this file, which score nothing: it loads what evaluates.
    from ferryid.validation.targets import Target

    return [Target("every log has a verdict", True, True), Target("no log is wrong", None, False, tested=False)]


PIPELINE = Pipeline(
    draw,
    generate,
    realise,
    {"oracle": Evaluator(oracle, OracleMade), "transfer": Evaluator(transfer, TransferMade)},
    score,
    targets,
)
