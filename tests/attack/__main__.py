"""`python -m tests.attack [--cases N] [--seed S] [--only NUMBER] [--format NAME] [--out FILE] [--workers N]`."""

from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import signal
import sys
import time
from pathlib import Path

from tests.attack.case import draw, formats
from tests.attack.check import examine, reported_undamaged, write
from tests.attack.page import grouped, listed, page, table
from tests.attack.run import Result, attack, warm_up
from tests.evidence import stamp

REPORT = Path(__file__).resolve().parents[2] / "reports" / "attack.md"
NOT_COVERED = Path(__file__).with_name("not_covered.md")
SHOWN = 3


def main() -> int:
    """Attack the readers, and write the page of it."""
    parser = argparse.ArgumentParser(prog="python -m tests.attack", description=main.__doc__)
    parser.add_argument("--cases", type=int, default=2000, help="how many cases")
    parser.add_argument(
        "--seed", type=int, action="append", help="of the run; again for another run (default: the time)"
    )
    parser.add_argument("--only", type=int, help="run the case of this number alone, and keep its log")
    parser.add_argument("--keep", type=Path, default=Path("attack-case"), help="the folder that keeps it")
    parser.add_argument("--format", default="", choices=["", *formats()], help="one format only")
    parser.add_argument("--workers", type=int, default=min(os.cpu_count() or 1, 2), help="processes")
    parser.add_argument("--out", type=Path, default=REPORT, help="the page to write (- for none)")
    options = parser.parse_args()
    seeds = options.seed or [int(time.time())]
    if options.only is not None:
        return _one(seeds[0], options.only, options.format, options.keep)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    runs, failed = [], 0
    for seed in seeds:
        print(f"attack: seed {seed}, {options.cases} cases", flush=True)
        start, results = time.monotonic(), list[Result]()
        # Interrupted, a run shows what it found so far.
        with contextlib.suppress(KeyboardInterrupt):
            for result in attack(seed, iter(range(1, options.cases + 1)), workers=options.workers, only=options.format):
                results.append(result)
                if result.outcome.violations:
                    print(
                        f"violation: --seed {seed} --only {result.number}: {result.format}, {result.what[:150]}",
                        flush=True,
                    )
                if len(results) % 250 == 0:
                    rate = len(results) / (time.monotonic() - start)
                    bad = sum(bool(each.outcome.violations) for each in results)
                    print(f"{len(results)} cases, {rate:.0f} per second, {bad} with a violation", flush=True)
        seconds, bad = time.monotonic() - start, sum(bool(each.outcome.violations) for each in results)
        text = table(results)
        shown = "\n\n".join(filter(None, (text, listed(seed, results, options.format))))
        runs.append((seed, len(results), seconds, shown, bad))
        failed += bad
        print(text)
        _show(seed, results, options.format)
        print(f"seed {seed}: {len(results)} cases in {seconds:.0f} s, {bad} with a violation", flush=True)
    if str(options.out) != "-":
        bases = [
            f"{name}: {base.name}, {base.count} messages" for name, (each, _) in formats().items() for base in each
        ]
        options.out.write_text(page(runs, bases, NOT_COVERED.read_text(encoding="utf-8")), encoding="utf-8")
        stamp(options.out)
        print(f"written to {options.out}")
    return 1 if failed else 0


def _show(seed: int, results: list[Result], only: str) -> None:
    for form, kind, text, group in grouped(results):
        print(f"\n{len(group)} × {form}, {kind}: {text}")
        for result in itertools.islice(group, SHOWN):
            flag = f" --format {only}" if only else ""
            print(f"  {result.base}: {result.what[:150]}")
            print(f"    {' | '.join(result.outcome.violations)[:300]}")
            print(f"    python -m tests.attack --seed {seed} --only {result.number}{flag}")


def _one(seed: int, number: int, only: str, keep: Path) -> int:
    """Run one case in this process, so that a debugger can follow."""
    import tempfile

    warm_up()
    case = draw(seed, number, only)
    print(f"case {number} of seed {seed}: {case.base.format}, {case.base.name}; {case.kind}: {case.mutated.what}")
    expected = case.mutated
    print(f"expected: {case.base.count if expected.total is None else expected.total} messages, missing up to "
          f"{expected.missing}, extra up to {expected.extra}, content may differ: {expected.content}, "
          f"counted: {expected.counted}")  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="attack-one-") as folder:
        temporary = Path(folder) / "tmp"
        temporary.mkdir()
        tempfile.tempdir = str(temporary)
        reported_undamaged(case.base, Path(folder) / "undamaged")
        outcome = examine(case, Path(folder) / "case", temporary)
        tempfile.tempdir = None
    write(case.mutated, keep)
    print(f"{outcome.result} in {outcome.seconds:.2f} s of processor time with {outcome.memory / 1e6:.0f} MB")
    for line in outcome.reported:
        print(f"reported: {line}")
    for violation in outcome.violations:
        print(f"VIOLATION {violation}")
    print(f"its log is kept: {keep / case.base.path}")
    return 1 if outcome.violations else 0


if __name__ == "__main__":
    sys.exit(main())
