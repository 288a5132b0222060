"""Fits on the recordings of real vessels: reports/real.md and its figures."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ferryid.identify.outcome import FitOutcome
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.report import figures
from ferryid.report.headline import headline_of
from ferryid.report.structure import worst_and_best_minute
from ferryid.types import AXES, RunContext
from ferryid.vessel import load_profile
from tests.evidence import stamp
from tests.real.places import DATA, FOLDER, REPORTS


@dataclass(frozen=True)
class Case:
    """One fit: what it is called, its vessel, its logs, and how it is set."""

    name: str
    vessel: str
    logs: tuple[str, ...]
    about: str
    split: str = "blocks"


CASES = (
    Case(
        "vtec-usv",
        "vtec-usv",
        (
            "vtec_usv/48000_2016-02-11-10-52-07.bag",
            "vtec_usv/52000_2016-02-11-10-40-10.bag",
            "vtec_usv/exp52_v_2016-02-11-11-14-28.bag",
        ),
        "VTec S-III, a small differential-thrust USV in a pool: three ROS1 bags without headers, thrust as ordered.",
    ),
    Case(
        "esso-osaka",
        "esso-osaka",
        tuple(f"esso_osaka/random/random_06-Aug-2020_16_24_25_{i}.csv" for i in (1, 3, 4, 5, 6)),
        "Esso Osaka, 3 m free-running tanker model on a pond: five runs with measured wind; the last validates.",
        "logs",
    ),
    Case(
        "gunnerus",
        "gunnerus",
        ("gunnerus/RVG_ManeuveringTests.csv",),
        "R/V Gunnerus at full scale: two and a half hours of turning circles, zigzags and speed runs at 2 Hz, orders only.",
    ),
    Case(
        "milliampere-2025",
        "milliampere-2025",
        ("milliampere1",),
        "The ferry milliAmpère in 2025, four azimuth thrusters: a ROS 2 bag exported to one CSV per topic.",
    ),
    Case(
        "kvlcc2-model",
        "kvlcc2-model",
        tuple(f"kvlcc2/HSVA_CPMC_KVLCC2_Z_{n}.dat" for n in ("10_05", "20_10_P", "30_05", "35_05", "20_10_S")),
        "KVLCC2, 7 m tanker model in a towing tank: five zigzags with measured thrust; the last validates.",
        "logs",
    ),
)


def write() -> None:
    """Fit every case and write the page."""
    sections = [HEAD]
    with tempfile.TemporaryDirectory() as out:
        for case in CASES:
            print(case.name, flush=True)
            result = fit_logs(
                [str(DATA / log) for log in case.logs],
                load_profile(case.vessel),
                FitSettings(split=case.split),
                RunContext(Path(out)),
            )
            sections.append(section(case, result, FOLDER))
    (REPORTS / "real.md").write_text("\n".join(sections), encoding="utf-8")
    stamp(REPORTS / "real.md")


HEAD = """# Fits on recordings of real vessels

What `ferryid diagnose` says of the same recordings stands in [real/diagnosis.md](real/diagnosis.md).

Made by `make real` with the recordings at hand (they are not part of the project) and the default settings. *Base* is
the model in the bundled profile: where a vessel has no hull model, that is rigid-body mass alone, which is easily improved
upon. The numbers are of validation rows, which the fit did not use. The prediction error is that of the acceleration in
windows of some seconds, as a force on the base model's mass; the free run is the harder test: the model gets the measured state
once, then only the forces.

The validation rows trained no coefficient, but some defaults (decoupled structure, blocks of 40 s, the limits within which an
inertia is believed) were chosen after looking at scores on these same recordings. Take the figures as somewhat flattering:
an untouched recording is the only fair test of the defaults.
"""


def section(case: Case, result: FitOutcome, folder: Path) -> str:
    """Return one vessel's part of the page and write its figures."""
    scores = result.scores.to_json()
    last = result.logs[-1]
    minutes = worst_and_best_minute(last)
    start = minutes[0] if minutes else None
    (folder / f"{case.name}-forces.svg").write_text(
        figures.forces(last, start, None if start is None else start + 60.0), encoding="utf-8"
    )
    lines = [
        f"\n## {case.name}\n",
        case.about,
        "",
        f"**{headline_of(result)}** {' '.join(result.acceptance.reasons)}",
        "",
    ]
    lines += ["| validation | " + " | ".join(AXES) + " |", "|---|" + "---|" * 3]
    for label, part in (
        (f"rms {result.scores.measure} error, base [N, N, N·m]", "base"),
        (f"rms {result.scores.measure} error, new", "model"),
    ):
        lines.append(f"| {label} | " + " | ".join(f"{scores['mse'][part][axis] ** 0.5:.3g}" for axis in AXES) + " |")
    lines.append(
        "| MSE over the base model's | " + " | ".join(f"{scores['per_axis'][axis]:.3f}" for axis in AXES) + " |"
    )
    lines.append("")
    if result.estimators:
        shown = "; ".join(
            f"{one.name} {one.folds:.3f} on folds of the training rows, {one.held_out:.3f} held out"
            f"{' (chosen)' if one.chosen else ''}"
            for one in result.estimators
        )
        lines += [f"Squared prediction error over the base model's by estimator: {shown}.", ""]
    base, new = result.free_run_base, result.free_run_model
    lines += [
        "| free run, horizon | " + " | ".join(f"{h:g} s" for h in new.horizons_s) + " |",
        "|---|" + "---|" * len(new.horizons_s),
    ]
    for label, key, factor in (("position [m]", "position_m", 1.0), ("heading [deg]", "heading_rad", np.degrees(1.0))):
        for who, run in (("base", base), ("new", new)):
            cells = (f"{value * factor:.3g}" if np.isfinite(value) else "–" for value in getattr(run, key))
            lines.append(f"| {label}, {who} | " + " | ".join(cells) + " |")
    lines.append("")
    for run, who in ((base, "Base model"), (new, "New model")):
        if run.note:
            lines.append(f"{who}: {run.note}.\n")
    lines += [f"- {warning.replace(f'{DATA}/', '')}" for warning in result.warnings]
    lines += ["", "What the data-quality check found: ", ""]
    for log in result.logs:
        told = [str(remark) for remark in log.data_quality["remarks"]]
        shown = told[:8] + ([f"... and {len(told) - 8} more remarks"] if len(told) > 8 else [])
        lines.append(f"- {log.motion.log}: " + " ".join(shown))
    lines += ["", f"![Worst minute of {case.name}](real/{case.name}-forces.svg)"]
    if new.example or base.example:
        (folder / f"{case.name}-free-run.svg").write_text(figures.free_run_example(base, new), encoding="utf-8")
        lines += ["", f"![A free run of {case.name}](real/{case.name}-free-run.svg)"]
    return "\n".join(lines)
