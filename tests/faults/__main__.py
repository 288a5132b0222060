"""Faults at every operation, as a table: ``python -m tests.faults [COMMAND...] [--sample N] [--seed N]``."""

from __future__ import annotations

import argparse
import os
import random
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.faults.cases import FAULTS, Result, rows
from tests.faults.commands import COMMANDS


def table(results: list[Result]) -> str:
    """Return how many cases there were of each command and fault, and how many went wrong, as a Markdown table."""
    cases = Counter((one.case.command, one.case.fault) for one in results)
    wrong = Counter((one.case.command, one.case.fault) for one in results if one.wrong)
    lines = ["| | " + " | ".join(FAULTS) + " |", "|---|" + "---:|" * len(FAULTS)]
    for name in COMMANDS:
        cells = [
            f"{cases[name, fault]}" + (f" ({wrong[name, fault]} wrong)" if wrong[name, fault] else "")
            for fault in FAULTS
        ]
        if any(cases[name, fault] for fault in FAULTS):
            lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.faults")
    parser.add_argument("commands", nargs="*", choices=[*COMMANDS, []], default=[])
    parser.add_argument("--sample", type=int)
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(10**6))
    asked = parser.parse_args()
    begun, results = time.monotonic(), []
    # In memory, where nothing waits for a disk.
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="ferryid-faults-", dir=memory) as folder:
        for one in rows(Path(folder), asked.commands or tuple(COMMANDS), sample=asked.sample, seed=asked.seed):
            results.append(one)
            if one.wrong:
                print(
                    f"{one.case.command}, {one.case.fault} at {one.case.at} ({one.operation}): {one.wrong}", flush=True
                )
    print(f"seed {asked.seed}, {len(results)} cases, {time.monotonic() - begun:.0f} s\n\n{table(results)}")
    return int(any(one.wrong for one in results))


if __name__ == "__main__":
    sys.exit(main())
