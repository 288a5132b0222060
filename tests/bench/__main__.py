"""`python -m tests.bench [--quick] [--folder DIR] [--out FILE] [--only NAME]`."""

from __future__ import annotations

import argparse
import importlib
import sys
from functools import partial
from pathlib import Path

from tests.bench.page import drawing, packed, page, unpacked
from tests.evidence import ROOT, Lines, stamp

PAGE = "reports/benchmarks.md"
REPORT = ROOT / PAGE
DONE = ROOT / "build" / "bench" / "lines.jsonl"
"""Tables of a run that was ended."""
# In the order of the page; every one exposes run(quick) -> Section.
MODULES = ("ingest", "identify", "archive", "commands", "simulate", "diagnosis", "long")


def main() -> int:
    """Run the benchmarks and write their page."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=main.__doc__)
    parser.add_argument("--quick", action="store_true", help="short logs, to see that everything runs")
    parser.add_argument("--folder", type=Path, help="where the measured logs are kept between runs")
    parser.add_argument(
        "--out", type=Path, help="the page to write (default: reports/benchmarks.md; - for a quick run)"
    )
    parser.add_argument("--only", choices=MODULES, help="measure one part only")
    options = parser.parse_args()
    whole = not (options.quick or options.only)
    lines = Lines.of(DONE, PAGE)
    known = lines.known() if whole else {}
    sections = []
    for name in MODULES:
        if name in known:
            sections.append(unpacked(known[name]))
        elif options.only in (None, name):
            run = importlib.import_module(f"tests.bench.{name}").run
            if name == "ingest" and options.folder:
                run = partial(run, folder=options.folder)
            sections.append(run(options.quick))
            if whole:
                lines.add(name, packed(sections[-1]))
    target = options.out or (REPORT if whole else None)
    if target is None or str(target) == "-":
        print(page(sections, options.quick))
    else:
        picture = target.with_suffix(".svg")
        picture.write_text(drawing(sections), encoding="utf-8")
        target.write_text(page(sections, options.quick, picture.name), encoding="utf-8")
        stamp(target)
        print(f"written to {target}")
    if whole:
        # The next run measures everything anew.
        DONE.unlink(missing_ok=True)
    missed = [row.what for section in sections for row in section.rows if row.reached is False]
    for what in missed:
        print(f"goal missed: {what}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
