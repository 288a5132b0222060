"""Real recordings, one part held out at a time; where they are absent they are left out of the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from ferryid.errors import FerryIdError
from ferryid.identify.fit_data import Coefficients
from ferryid.signals.prepare import Opened, open_track
from ferryid.vessel import load_profile
from tests.real.places import DATA
from tests.rivals.methods import METHODS
from tests.rivals.output_error import fit_output_error
from tests.rivals.packing import packed_scores, unpacked_scores
from tests.rivals.scores import Score, judge, together
from tests.rivals.task import Task

FOLDS = 3
INSIDER = "output error, judged recordings"
"""Output error fitted to the very recordings that judge it: no rival, but what these terms can hardly do better than."""


@dataclass(frozen=True)
class Case:
    """Recordings of one vessel: profile, patterns of files, and into how many parts a single recording is cut."""

    name: str
    vessel: str
    learn: str
    judge: str = ""
    parts: int = 0


CASES = (
    Case("Esso Osaka, random manoeuvres", "esso-osaka", "esso_osaka/random/*.csv"),
    Case("Esso Osaka, zigzags", "esso-osaka", "esso_osaka/zigzag/*.csv"),
    Case(
        "Esso Osaka, random learnt, zigzags judged", "esso-osaka", "esso_osaka/random/*.csv", "esso_osaka/zigzag/*.csv"
    ),
    Case(
        "Esso Osaka, zigzags learnt, random judged", "esso-osaka", "esso_osaka/zigzag/*.csv", "esso_osaka/random/*.csv"
    ),
    Case("KVLCC2 model", "kvlcc2-model", "kvlcc2/*.dat"),
    Case("VTec S-III", "vtec-usv", "vtec_usv/*.bag"),
    Case("R/V Gunnerus", "gunnerus", "gunnerus/RVG_ManeuveringTests.csv", parts=4),
    Case("milliAmpère 2025", "milliampere-2025", "milliampere1", parts=2),
)


@dataclass(frozen=True)
class Recorded:
    """What came of one case: scores by method, how many recordings, how long together [s], and which could not be used.

    `insider` is the score of `INSIDER`, which is no rival.
    """

    case: Case
    scores: dict[str, Score]
    insider: Score
    logs: int
    seconds: float
    refused: tuple[str, ...]

    def plain(self) -> dict[str, Any]:
        """Return all but the case as plain values."""
        return {
            "scores": packed_scores(self.scores),
            "insider": packed_scores({INSIDER: self.insider}),
            "logs": self.logs,
            "seconds": self.seconds,
            "refused": list(self.refused),
        }

    @classmethod
    def of(cls, case: Case, plain: Mapping[str, Any]) -> Recorded:
        """Return what `plain` gave."""
        scores, insider = unpacked_scores(plain["scores"]), unpacked_scores(plain["insider"])[INSIDER]
        return cls(case, scores, insider, plain["logs"], plain["seconds"], tuple(plain["refused"]))


def recorded(case: Case) -> Recorded | None:
    """Judge all methods on a case; None where its recordings are absent."""
    if not DATA.is_dir() or not list(DATA.glob(case.learn)):
        return None
    refused: list[str] = []
    logs = opened(case.learn, case.vessel, refused)
    others = opened(case.judge, case.vessel, refused) if case.judge else []
    if case.parts:
        logs = [part for log in logs for part in parts(log, case.parts)]
    profile = load_profile(case.vessel)
    folds = [(logs, others)] if others else list(held_out(logs))
    scores = together([_judged(Task.of(profile, learnt), Task.of(profile, judged)) for learnt, judged in folds])
    insider = scores.pop(INSIDER)
    every = [*logs, *others]
    seconds = sum(float(one.measured.usable.sum()) / one.measured.rate_hz for one in every)
    return Recorded(case, scores, insider, len(every), seconds, tuple(refused))


def _judged(task: Task, test: Task) -> dict[str, Score]:
    return judge(task, test, {**METHODS, INSIDER: partial(_inside, test)})


def _inside(test: Task, _task: Task, draws: int) -> Coefficients:
    """Return output error's fit to what it is judged on."""
    return fit_output_error(test, draws)


def opened(pattern: str, vessel: str, refused: list[str]) -> list[Opened]:
    """Read recordings; the names of those that cannot be used are added to `refused`."""
    logs = []
    for path in sorted(DATA.glob(pattern)):
        try:
            logs.append(open_track(str(path), load_profile(vessel), None))
        except FerryIdError:
            refused.append(path.name)
    return logs


def parts(log: Opened, count: int) -> list[Opened]:
    """Cut a recording into contiguous parts of equal length."""
    measured, out = log.measured, []
    n = len(measured.t)
    for k in range(count):
        usable = measured.usable.copy()
        usable[: n * k // count] = usable[n * (k + 1) // count :] = False
        out.append(replace(log, measured=replace(measured, usable=usable)))
    return out


def held_out(logs: list[Opened]) -> Iterator[tuple[list[Opened], list[Opened]]]:
    """Yield recordings to learn from and to judge on: at most three folds, every recording judged once."""
    folds = min(len(logs), FOLDS)
    for fold in range(folds):
        yield (
            [one for k, one in enumerate(logs) if k % folds != fold],
            [one for k, one in enumerate(logs) if k % folds == fold],
        )
