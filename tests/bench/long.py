"""Long logs: how time and memory of every command grow from half an hour to three, and a diagnosis of six hours, with gaps.

The longer logs are two recordings joined: as a recorder splits them. Navigation misses 5 s about every ten minutes,
and each thruster 1 s about every twenty.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from tests.bench.page import Curve, Row, Section, Timed, duration
from tests.bench.processes import whole_process
from tests.bench.trials import SCALE, VESSEL, written

GOAL = 6.6
"""Six times the log may take a tenth more than six times the time."""
LARGEST_GB = 2.0
DIAGNOSIS_S = 240.0
"""What a diagnosis of six hours may take."""


def run(quick: bool) -> Section:
    """Measure every command on a log of half an hour and on one of three hours; `quick` a few on 6 minutes and on 12."""
    one_s, part_s = (360, 360) if quick else (1800, 5400)
    rows, curves = list[Row | Timed](), list[Curve]()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # Each begins five seconds after the one before has ended.
        whole = "+".join(map(str, written(range(2), part_s, gaps=True, after_s=5)))
        (one,) = map(str, written([7], one_s, gaps=True))
        commands = _commands(folder)
        if quick:
            commands = {title: commands[title] for title in ("inspect", "ingest", "fit", "evaluate", "fit --archive")}
        for title, command in commands.items():
            (base, little), (took, much) = (
                whole_process([part.format(log=log, out=folder / out) for part in command])
                for log, out in ((one, "short"), (whole, "long"))
            )
            curves.append(Curve(title, "length, with gaps [min]", [(one_s / 60, base), (2 * part_s / 60, took)]))
            ratio = took / base
            values = (
                f"{duration(took)}, {much / 1e9:.2f} GB",
                "the shorter log",
                f"{duration(base)}, {little / 1e9:.2f} GB",
            )
            rows.append(Row(title, *values, ratio, f"≤ {GOAL:g}", ratio <= GOAL and much / 1e9 <= LARGEST_GB))
        if not quick:
            # Shorter ones are measured with the other diagnoses.
            six = "+".join(map(str, written([2, 3], 10_800, gaps=True, after_s=5)))
            took, much = whole_process(("diagnose", six, *VESSEL, "--out", str(folder / "six")))
            kept = much / 1e9 <= LARGEST_GB
            rows.append(Timed("diagnose, 6 h", took, DIAGNOSIS_S, f", {much / 1e9:.2f} GB", otherwise=kept))
    length = "12 min against 6" if quick else "3 h against half an hour"
    notes = [
        f"Whole processes, {length}; the goal holds the growth of time, and {LARGEST_GB:g} GB of memory. "
        "Ingestion comes first, so that the commands after it read the kept tables.",
    ]
    return Section("Long logs with gaps", rows, notes, curves=curves)


def _commands(folder: Path) -> dict[str, tuple[str, ...]]:
    """Return every command that reads logs, in an order in which each finds what it needs."""
    out = ("--out", "{out}")
    recipe = folder / "recipe.toml"
    recipe.write_text('steps = ["fit"]\n', encoding="utf-8")
    return {
        "inspect": ("inspect", "{log}", *VESSEL),
        "ingest": ("ingest", "{log}", *VESSEL, *out),
        "fit": ("fit", "{log}", *VESSEL, *SCALE, *out),
        "fit --window auto": ("fit", "{log}", *VESSEL, *SCALE, *out, "--window", "auto"),
        "evaluate": ("evaluate", "milliampere@1", "{log}", *out),
        "compare": ("compare", "milliampere@1", "milliampere@2", "--on", "{log}", *out),
        "sweep both": ("sweep", "both", "{log}", *VESSEL, *SCALE, *out),
        "sweep basis": ("sweep", "basis", "{log}", *VESSEL, *SCALE, *out),
        "fit --archive": ("fit", "--archive", *VESSEL, *SCALE, *out),
        "export to MCAP": ("export", "{log}", "--mcap", "{out}/log.mcap", "--model", "milliampere@1", *VESSEL, *out),
        "batch with fits": ("batch", "{log}", *VESSEL, "--recipe", str(recipe), *out),
    }
