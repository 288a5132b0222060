"""`python -m tests.reach [--runs N] [--only NAME,...] [--seed N] [--processes N] [--out DIR] [--cache DIR]`."""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path

# Before numpy is imported, here and in the processes: each run keeps to one core.
os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

from ferryid.report.proof_figures import confusion_matrix, parameter_errors
from tests.reach import wavy
from tests.reach.cells import KINDS, cells, draws
from tests.reach.page import page, results
from tests.reach.record import run_all, version
from tests.reach.scores import WITHIN, score

REPORTS = Path(__file__).resolve().parents[2] / "reports"
RUNS = 10


def main() -> int:
    """Conceal physics in simulated trials, diagnose them, and write how often the truth was named."""
    parser = argparse.ArgumentParser(prog="python -m tests.reach", description=main.__doc__)
    parser.add_argument("--runs", type=int, default=RUNS, help="runs of each single effect; other cells in proportion")
    parser.add_argument("--only", default="", help="cells, kinds or places, with commas between")
    parser.add_argument("--seed", type=int, default=0, help="of all draws")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1, help="runs at once")
    parser.add_argument("--out", type=Path, default=REPORTS, help="folder of the report")
    parser.add_argument("--cache", type=Path, default=Path("ferryid-out") / "reach", help="folder of the finished runs")
    options = parser.parse_args()
    chosen = {name.strip() for name in options.only.split(",") if name.strip()}
    every = [cell for cell in cells() if not chosen or chosen & {cell.name, cell.kind, cell.place, cell.key}]
    if not every and "wavy" not in chosen:
        parser.error(
            f"--only: no cell of this name. Kinds are {', '.join(KINDS)}; cells {', '.join(c.name for c in cells())}"
        )
    work = [draw for cell in every for draw in draws(cell, options.runs, options.seed)]
    of = version()
    lines = []
    start = time.perf_counter()
    for line in run_all(work, of, options.cache / "runs.jsonl", options.processes):
        lines.append(line)
        if sys.stderr.isatty():
            left = (time.perf_counter() - start) / len(lines) * (len(work) - len(lines))
            print(f"\r{len(lines)} of {len(work)} runs, {left / 60.0:.0f} min left ", end="", file=sys.stderr)
    lines.sort(key=lambda line: [line["draw"][key] for key in ("place", "cell", "number")])
    settings = {"runs": options.runs, "seed": options.seed, "version": of, "only": options.only}
    told = results(lines, every, settings)
    section: list[str] = []
    if not chosen or "wavy" in chosen:
        with tempfile.TemporaryDirectory() as scratch:
            told["wavy"] = wavy.wavy(Path(scratch))
        section = wavy.lines(told["wavy"])
    folder = options.out / "diagnosis"
    folder.mkdir(parents=True, exist_ok=True)
    (options.out / "diagnosis.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    (options.out / "diagnosis.md").write_text(page(lines, every, settings, "diagnosis", section), encoding="utf-8")
    (folder / "confusion.svg").write_text(confusion_matrix(*told["confusion"].values()), encoding="utf-8")
    by_cell = {
        cell.key: score(
            line for line in lines if line["draw"]["cell"] == cell.name and line["draw"]["place"] == cell.place
        ).errors
        for cell in every
    }
    (folder / "errors.svg").write_text(
        parameter_errors({key: found for key, found in by_cell.items() if found}, WITHIN), encoding="utf-8"
    )
    for row in told["targets"]:
        if not row["reached"]:
            print(f"target missed: {row['what']}", file=sys.stderr)
    print(f"written to {options.out / 'diagnosis.md'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
