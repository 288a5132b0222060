"""Diagnoses: how their time and memory grow with the length of a log and with the number of logs, and where the time goes."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ferryid.signals.recording import record
from ferryid.validation.case import Case
from ferryid.validation.log_generation import generate
from ferryid.vessel import load_profile
from tests.bench.page import Curve, Row, Section, Timed, duration
from tests.bench.preparing import preparing
from tests.bench.processes import Sampled, imports, middle, sampled_process
from tests.bench.trials import VESSEL, written
from tests.evidence import ROOT

LENGTHS_S = {720: 5.0, 1440: 8.0, 3600: 45.0, 7200: 90.0}
"""Lengths of a single log [s], and the goal of each [s]; six hours are measured with gaps, in `tests.bench.long`."""
REPEATED_S, REPEATS = 720, 3
"""Logs up to this length [s] are diagnosed so many times, and the median counts."""
OF_PROOF_S = {"median": 5.0, "slowest": 10.0}
"""Cases of the published proof, by how long they took in its run, and the goal of each [s]."""
LOGS = {2: None, 5: None, 14: 20.0}
"""Logs of seven minutes in a campaign, and the goal of as many [s]."""
LINEAR = 1.1
"""Most power of the length, and of the number of logs, with which the time may grow."""
STEPS = {
    "reading": ("/data/measurements.py:measure_log",),
    "screening of the sensors": ("/checks/screening.py:screen_sensors", "/diagnose/gathering.py:with_common_sensors"),
    "averages over windows": ("/inference/stages.py:average",),
    "comparing the hulls of logs": ("/diagnose/gathering.py:part",),
    "estimating one hull of all logs": ("/judging/campaign.py:judge_campaign",),
    "conditions of single logs": ("/judging/campaign_conditions.py:judge_conditions",),
    "placebos of conditions": (
        "/judging/campaign_conditions.py:_against_placebos",
        "/judging/campaign_conditions.py:_against_others",
    ),
    "held-out blocks": ("/judging/campaign_evidence.py:held_out_loss",),
    "properties of all logs": ("/judging/campaign_properties.py:judge_properties",),
    "changes between logs": ("/judging/changes_between_logs.py:judge_change",),
    "estimating and selecting effects of each log": ("/inference/stages.py:estimate", "/inference/stages.py:select"),
    "judging effects of each log": ("/judging/judge.py:judge",),
    "the interval of an onset or end": ("/judging/findings.py:_time",),
    "conclusions": ("/judging/conclude.py:conclude",),
    "other instruments": ("/second_sources/sources.py:compare_second_sources",),
    "learning what is left": ("/judging/model_update.py:store_updated_model",),
    "page and figures": ("/report/diagnosis_report.py:report", "/report/page_process.py:drawings"),
}
"""Functions of the steps of a diagnosis."""
PACKAGES = ("numpy", "numba", "scipy.optimize", "scipy.signal", "pyarrow.parquet", "matplotlib.figure", "typer")
"""What any program for a diagnosis would import."""


def run(quick: bool) -> Section:
    """Measure diagnoses as whole processes; `quick` on a short log."""
    lengths = {240: None} if quick else LENGTHS_S
    logs = {} if quick else LOGS
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        single = {seconds: written([0], seconds) for seconds in lengths}
        part_s = 200 if quick else 420
        together = {count: written(range(1, 1 + count), part_s) for count in logs}
        rows, curves, where = list[Row | Timed](), list[Curve](), list[str]()
        for title, against, kind, goals in (
            ("diagnose, {:.0f} min", "length [min]", single, lengths),
            (f"campaign of {{:.0f}} logs of {part_s / 60:.2g} min", "number of logs", together, logs),
        ):
            times: dict[float, float] = {}
            for number, paths in kind.items():
                repeats = REPEATS if kind is single and number <= REPEATED_S and not quick else 1
                measured = _measured(paths, folder, repeats)
                size = number / 60 if kind is single else number
                what = title.format(size)
                times[size] = measured.took_s
                rows.append(_row(what, measured, goals[number], next(iter(times.values()))))
                if goals[number] is not None or quick:
                    shortest = kind is single and len(times) == 1
                    where.append(imports(PACKAGES).floor(what, measured) if shortest else measured.where(what))
            if len(times) > 1:
                curves.append(
                    Curve(f"diagnose, {'one log' if kind is single else 'campaign'}", against, list(times.items()))
                )
        if not quick:
            for what, measured, goal_s in _of_proof(folder):
                rows.append(_row(what, measured, goal_s, measured.took_s))
                where.append(measured.where(what))
        notes = [
            "Whole processes, report included, on tables that were ingested before; logs of up to "
            f"{REPEATED_S / 60:.0f} min {REPEATS} times, of which the median counts.",
            *(_growth(curve) for curve in curves),
            *where,
        ]
    return Section("Diagnosis", rows, notes, curves=curves)


def _of_proof(folder: Path) -> Iterator[tuple[str, Sampled, float]]:
    """Measure the median and the slowest of the single logs of 12 minutes of the published proof, each by itself.

    Yields
    ------
    tuple
        What it is, the measurement and its goal [s].
    """
    published = ROOT / "reports" / "proof"
    answers = json.loads((published / "answers.json").read_text(encoding="utf-8"))["answers"]["cases"]
    cases = {one.name: one for one in map(Case.from_json, answers) if one.path != "short"}
    lines = map(json.loads, (published / "diagnosed.jsonl").read_text(encoding="utf-8").splitlines())
    took = {one["name"]: float(one["result"]["seconds"]) for one in lines if one["name"] in cases}
    order = sorted(took, key=lambda name: took[name])
    for which, name in {"median": order[len(order) // 2], "slowest": order[-1]}.items():
        case = cases[name]
        with preparing():
            files = generate(case, folder / "proof" / name)
            record(files.log, load_profile(str(files.profile)), folder / "out")
        command = ("diagnose", str(files.log), "--vessel", str(files.profile), "--out", str(folder / "out"))
        yield (
            f"diagnose, the {which} log of the proof ({case.cell})",
            sampled_process(command, STEPS),
            OF_PROOF_S[which],
        )


def _measured(paths: list[Path], folder: Path, repeats: int) -> Sampled:
    """Return the middle one of diagnoses by their time, with the most memory of all; the logs were ingested before."""
    more = (*VESSEL, "--out", str(folder / "out"))
    for path in paths:
        record(path, load_profile("milliampere"), folder / "out")
    command = ("diagnose", *map(str, paths), *more)
    return middle([sampled_process(command, STEPS) for _ in range(repeats)])


def _row(what: str, run: Sampled, goal_s: float | None, smallest_s: float) -> Row | Timed:
    took, memory = run.took_s, f", {run.peak / 1e9:.2f} GB"
    if goal_s is None:
        return Row(what, duration(took) + memory, "the smallest of these", duration(smallest_s), took / smallest_s)
    return Timed(what, took, goal_s, memory, limit=run.limit)


def _growth(curve: Curve) -> str:
    """Return with which power of the size the time grows, as a sentence."""
    power = float(np.polyfit(*np.log(np.array(curve.points)).T, 1)[0])
    what = curve.against.partition(" [")[0]
    points = ", ".join(duration(took) for _, took in curve.points)
    word = "within" if power <= LINEAR else "**beyond**"
    return f"Time of {curve.what} grows with the {what} to the power of {power:.2f} ({points}), {word} {LINEAR:g}."
