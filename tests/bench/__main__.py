"""`python -m tests.bench [--quick] [--folder DIR] [--out FILE] [--only NAME]`."""

from __future__ import annotations

import argparse
import importlib
import statistics
import sys
import tempfile
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

from tests.bench import preparing, yardstick
from tests.bench.page import Section, drawing, growth, judged, packed, page, unpacked, yardsticks
from tests.evidence import ROOT, Lines, stamp

PAGE = "reports/benchmarks.md"
REPORT = ROOT / PAGE
DONE = ROOT / "build" / "bench" / "lines.jsonl"
"""Tables of a run that was ended."""
LOGS = Path(tempfile.gettempdir()) / "ferryid-bench-logs"
# In the order of the page; every one exposes run(quick) -> Section.
MODULES = ("ingest", "identify", "archive", "commands", "simulate", "diagnosis", "campaigns", "long", "cluster")


def main() -> int:
    """Run the benchmarks and write their page."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=main.__doc__)
    parser.add_argument("--quick", action="store_true", help="short logs, to see that everything runs")
    parser.add_argument("--folder", type=Path, default=LOGS, help="where the measured logs are kept between runs")
    parser.add_argument(
        "--out", type=Path, help="the page to write (default: reports/benchmarks.md; - for a quick run)"
    )
    parser.add_argument("--only", choices=MODULES, help="measure one part only")
    options = parser.parse_args()
    whole = not (options.quick or options.only)
    lines = Lines.of(DONE, PAGE)
    known = lines.known() if whole else {}
    sections: list[Section] = []
    for name in MODULES:
        if name in known:
            sections.append(unpacked(known[name]))
        elif options.only in (None, name):
            run = importlib.import_module(f"tests.bench.{name}").run
            if name == "ingest":
                run = partial(run, folder=options.folder)
            start, made_before_s = time.perf_counter(), preparing.spent_s()
            # A quick run has time for one measurement of the yardstick; a whole one measures it before every third part and at
            # the end: over a run it differed by less than a tenth.
            wanted = not sections or (not options.quick and len(sections) % 3 == 0)
            before = [yardstick.measured(options.folder)] if wanted else []
            section = run(options.quick)
            after = [yardstick.measured(options.folder)] if whole and name == MODULES[-1] else []
            took_s = time.perf_counter() - start
            made_s = preparing.spent_s() - made_before_s
            sections.append(replace(section, yardstick_s=(*before, *after), took_s=took_s, made_s=made_s))
            if whole:
                lines.add(name, packed(sections[-1]))
    target = options.out or (REPORT if whole else None)
    rows = [row for section in sections for row in judged(section, statistics.median(yardsticks(sections)))]
    curves = [curve for section in sections for curve in section.curves]
    if target is None or str(target) == "-":
        print(page(sections, options.quick))
    else:
        pictures = {"Every ratio over its goal": ("", drawing(rows))}
        if curves:
            pictures["Times over sizes"] = ("-growth", growth(curves))
        named = [(caption, f"{target.stem}{end}.svg") for caption, (end, _) in pictures.items()]
        for (_, picture), (_, svg) in zip(named, pictures.values(), strict=True):
            target.with_name(picture).write_text(svg, encoding="utf-8")
        target.write_text(page(sections, options.quick, named), encoding="utf-8")
        stamp(target)
        print(f"written to {target}")
    if whole:
        # The next run measures everything anew.
        DONE.unlink(missing_ok=True)
    for row in rows:
        if row.reached is False:
            print(f"goal missed: {row.what}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
