"""``python -m tests.rivals`` writes reports/rivals.md.

What each trial and each set of recordings gives is appended to a file of lines as soon as it is known: a run that was ended
goes on from there, as long as no source has changed. ``--page`` writes the page from what is there, without any run.
Real recordings are left out, and the page says so, where they are absent.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import Any

from tests.evidence import Lines, stamp
from tests.real.places import REPORTS, ROOT
from tests.rivals import second_logs
from tests.rivals.packing import unpacked
from tests.rivals.page import (
    ELSEWHERE,
    HEAD,
    RECORDED_HEAD,
    SIMULATED_HEAD,
    better,
    better_simulated,
    recorded_section,
    simulated_section,
    targets,
    variants_section,
)
from tests.rivals.recorded import CASES, Recorded
from tests.rivals.simulated import KINDS, Findings
from tests.rivals.units import SECOND, Unit, trial_name, units

WORK = ROOT / "build" / "rivals"


def main() -> None:
    """Do what is not done yet, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.rivals")
    parser.add_argument("--trials", type=int, default=13, help="simulated trials of each kind")
    parser.add_argument("--second", type=int, default=30, help="cases of the proof with a second log")
    parser.add_argument("--processes", type=int, default=2, help="processes side by side")
    parser.add_argument("--page", action="store_true", help="write the page from what is known; run nothing")
    options = parser.parse_args()
    lines = Lines.of(WORK / "lines.jsonl", "reports/rivals.md")
    if not options.page:
        if not lines.known():
            # Simulated logs of other sources may lack what these write.
            shutil.rmtree(WORK / "logs", ignore_errors=True)
        run(units(options.trials, options.second, WORK / "logs"), lines, options.processes)
    (REPORTS / "rivals.md").write_text(page(lines.known()), encoding="utf-8")
    stamp(REPORTS / "rivals.md")


def run(every: Sequence[Unit], lines: Lines, processes: int) -> None:
    """Do the units that are not known yet, and append what each gives."""
    known = lines.known()
    left = [unit for unit in every if unit[0] not in known]
    if processes < 2:
        for name, work, given in left:
            lines.add(name, work(*given))
            print(name, flush=True)
        return
    with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
        begun = {pool.submit(work, *given): name for name, work, given in left}
        for done in as_completed(begun):
            lines.add(begun[done], done.result())
            print(begun[done], flush=True)


def page(known: dict[str, Any]) -> str:
    """Return the page from the results of units."""
    lines, ahead = [SIMULATED_HEAD], list[str]()
    simulated, varied = dict[str, list[Findings]](), dict[str, list[Findings]]()
    for kind in KINDS:
        start = trial_name(kind, 0)[:-1]
        trials = [one for name, one in known.items() if name.startswith(start)]
        if not trials:
            continue
        simulated[kind.name] = [unpacked(one[0]) for one in trials]
        varied[kind.name] = [unpacked(one[1]) for one in trials if one[1]]
        lines += simulated_section(kind.name, simulated[kind.name])
        ahead += better_simulated(kind.name, simulated[kind.name])
    varied = {name: trials for name, trials in varied.items() if trials}
    lines += variants_section(varied) if varied else []
    second = [one for name, one in known.items() if name.startswith(SECOND)]
    lines += second_logs.section(second) if second else []
    lines.append(RECORDED_HEAD)
    absent = [case.name for case in CASES if known.get(case.name) is None]
    recordings = [Recorded.of(case, known[case.name]) for case in CASES if case.name not in absent]
    for one in recordings:
        lines += recorded_section(one)
        ahead += better(one)
    if absent:
        lines.append(f"\nNot at hand, and so left out: {', '.join(absent)}.\n")
    lines += [ELSEWHERE, *(ahead or ["Nowhere."]), ""]
    return "\n".join([HEAD, *targets(simulated, recordings, absent, second), *lines])


if __name__ == "__main__":
    main()
