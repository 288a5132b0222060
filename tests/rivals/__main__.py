"""``python -m tests.rivals`` writes reports/rivals.md.

Real recordings are left out, and the page says so, where they are absent.
"""

from __future__ import annotations

import argparse
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from tests.evidence import stamp
from tests.real.places import REPORTS
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
from tests.rivals.recorded import CASES, recorded
from tests.rivals.simulated import KINDS, Findings, try_all


def main() -> None:
    """Run all comparisons and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.rivals")
    parser.add_argument("--trials", type=int, default=5, help="simulated trials of each kind")
    count = parser.parse_args().trials
    lines, ahead, absent = [SIMULATED_HEAD], [], []
    simulated, varied = dict[str, list[Findings]](), dict[str, list[Findings]]()
    recordings = []
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(2, get_context("spawn")) as pool:
        kinds = KINDS if count else ()
        trying = [pool.submit(try_all, kind, count, Path(folder)) for kind in kinds]
        recording = [pool.submit(recorded, case) for case in CASES]
        for kind, task in zip(kinds, trying, strict=True):
            found, varied[kind.name] = task.result()
            simulated[kind.name] = found
            print(kind.name, flush=True)
            lines += simulated_section(kind.name, found)
            ahead += better_simulated(kind.name, found)
        lines += variants_section(varied) if varied else []
        lines.append(RECORDED_HEAD)
        for case, result in zip(CASES, recording, strict=True):
            one = result.result()
            print(case.name, flush=True)
            if one is None:
                absent.append(case.name)
                continue
            recordings.append(one)
            lines += recorded_section(one)
            ahead += better(one)
    if absent:
        lines.append(f"\nNot at hand, and so left out: {', '.join(absent)}.\n")
    lines += [ELSEWHERE, *(ahead or ["Nowhere."]), ""]
    lines = [HEAD, *targets(simulated, recordings, absent), *lines]
    (REPORTS / "rivals.md").write_text("\n".join(lines), encoding="utf-8")
    stamp(REPORTS / "rivals.md")


if __name__ == "__main__":
    main()
