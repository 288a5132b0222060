"""The commands that are made to fail, on the smallest logs that they accept, and what two runs of them must agree on."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
LOG = FIXTURES / "short.mcap"
TIMES = ("created", "seconds", "peak_bytes", "check", "done_before", "date", "files")
"""Keys of JSON, and columns, that differ between two runs."""


def _quiet(_: str) -> None:
    pass


def prepare(folder: Path) -> None:
    """Write the logs of a batch and of an archive, and its recipe."""
    for number in range(2):
        shutil.copy(LOG, folder / f"day{number}.mcap")
    (folder / "recipe.toml").write_text('steps = ["fit", "evaluate"]\n[fit]\ndelta = 0.4\nsigma = 0.4\ndraws = 20\n')


def ingest(folder: Path, out: Path) -> None:
    from ferryid.signals.ingest import ingest
    from ferryid.vessel import load_profile

    ingest([str(LOG)], load_profile("milliampere"), out, progress=_quiet)


def fit(folder: Path, out: Path) -> None:
    from ferryid.files import dump_json, write_result
    from ferryid.report.fit_report import fit_and_report
    from ferryid.types import RunContext
    from ferryid.vessel import load_profile

    made = fit_and_report([str(LOG)], load_profile("milliampere"), _settings(), RunContext(out))
    write_result(out / "result.json", dump_json(made.json))


def archive(folder: Path, out: Path) -> None:
    from ferryid.report.fit_report import fit_archive_and_report
    from ferryid.types import RunContext
    from ferryid.vessel import load_profile

    fit_archive_and_report(load_profile("milliampere"), _settings(), RunContext(out))


def archived(folder: Path, out: Path) -> None:
    """Leave what a fit of an archive needs."""
    from ferryid.signals.ingest import ingest
    from ferryid.vessel import load_profile

    logs = [str(folder / f"day{number}.mcap") for number in range(2)]
    ingest(logs, load_profile("milliampere"), out, progress=_quiet)


def diagnose(folder: Path, out: Path) -> None:
    from ferryid.diagnose.judging.model_update import store_updated_model
    from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
    from ferryid.report.diagnosis_report import report
    from ferryid.types import RunContext
    from ferryid.vessel import load_profile

    profile = load_profile("milliampere")
    found = diagnose([str(LOG)], profile, DiagnosisSettings(), RunContext(out, _quiet))
    report(store_updated_model(found, profile, None, out), out, ["ferryid", "diagnose"])


def batch(folder: Path, out: Path) -> None:
    from ferryid.batch import run, spread

    @contextmanager
    def here(*_: Any, **__: Any) -> Any:
        yield spread._Here()

    run.spread = here  # type: ignore[assignment]
    logs = [str(folder / f"day{number}.mcap") for number in range(2)]
    run.batch(logs, out, vessel="milliampere", recipe=folder / "recipe.toml", progress=_quiet, tell=_quiet)


def _settings() -> Any:
    from ferryid.identify.settings import FitSettings

    return FitSettings(delta=0.4, sigma=0.4, draws=20)


Command = Callable[[Path, Path], None]
COMMANDS: dict[str, tuple[Command, Command | None]] = {
    "ingest": (ingest, None),
    "fit": (fit, None),
    "diagnose": (diagnose, None),
    "batch": (batch, None),
    "archive": (archive, archived),
}
"""Each with what has to be there before, if anything."""


def contents(out: Path) -> dict[str, Any]:
    """Return what a command left, without times: JSON and tables as they are read, of other files their text."""
    found: dict[str, Any] = {}
    for path in sorted(path for path in out.rglob("*") if path.is_file()):
        name = path.relative_to(out).as_posix()
        if path.name == ".lock":
            continue
        if path.suffix == ".json":
            found[name] = _timeless(json.loads(path.read_text(encoding="utf-8")))
        elif path.suffix == ".parquet":
            table = pq.read_table(path)
            table = table.drop_columns([one for one in TIMES if one in table.column_names])
            found[name] = {key: np.asarray(table[key]).tolist() for key in table.column_names}
        elif path.suffix == ".html":
            text = path.read_text(encoding="utf-8")
            found[name] = text.rstrip().endswith("</html>") and len(re.findall("<h[1-6]", text))
        else:
            found[name] = path.read_text(encoding="utf-8")
    return found


def _timeless(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _timeless(value) for key, value in data.items() if key not in TIMES}
    if isinstance(data, list):
        return [_timeless(value) for value in data]
    return repr(data) if isinstance(data, float) else data


def differing(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """Return the names of files that differ."""
    return [name for name in sorted({*one, *other}) if repr(one.get(name)) != repr(other.get(name))]


def fresh(path: Path) -> Path:
    """Remove a folder, and return its path."""
    if os.path.lexists(path):
        shutil.rmtree(path)
    return path
