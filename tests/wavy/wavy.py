"""A model learnt in waves, used in calm water: the failure of Aurlien (2021), Experiment 2, and what mends it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

HULL = ("m11", "m22", "m33", "X_u", "X_|u|u", "Y_v", "Y_|v|v", "Y_|r|v", "Y_|v|r", "N_r", "N_|r|r", "N_|r|v")
ROOT = Path(__file__).resolve().parents[2]
TRUE_HULL = "\n[true_hull]\n" + "".join(f'"{name}" = {0.9 if k % 2 else 1.1}\n' for k, name in enumerate(HULL))
"""Ten per cent off the model, each coefficient the other way than the last."""
AXES = ("surge", "sway", "yaw")
HORIZON_S = 60


def wavy(folder: Path, rounds: int = 2) -> dict[str, Any]:
    """Learn from the bundled trial in waves by `fit` and by `diagnose`, and judge both on a calm trial of the same vessel.

    Parameters
    ----------
    folder
        For logs and models.
    rounds
        Of the path; a round lasts twelve minutes.
    """
    logs = {}
    for name, seed in (("waves", 52), ("calm", 99)):
        text = (ROOT / "ferryid" / "simulate" / "scenarios" / f"twelve-corner-{name}.toml").read_text(encoding="utf-8")
        scenario = folder / f"{name}.toml"
        text = text.replace("rounds = 2", f"rounds = {rounds}")
        scenario.write_text(text + TRUE_HULL, encoding="utf-8")
        logs[name] = folder / f"{name}.mcap"
        _ferryid("simulate", str(scenario), "--log", str(logs[name]), "--seed", str(seed), "--overwrite")
    out, told = folder / "out", {}
    for command, name in (("fit --estimator derivative", "corrected"), ("fit", "fitted"), ("diagnose", "diagnosed")):
        _ferryid(*command.split(), str(logs["waves"]), "--vessel", "milliampere", "--name", name, "--out", str(out))
        told[command] = _judged(_ferryid("evaluate", f"{name}@1", str(logs["calm"]), "--out", str(out)))
    return told


def lines(told: dict[str, Any]) -> list[str]:
    """Return the report of the study."""
    rows = []
    for command, one in told.items():
        mse = " | ".join(f"{one['mse'][axis]:.2f}" for axis in AXES)
        rows.append(
            f"| `{command}` | {mse} | {one['position_m']:.1f} ({one['base_position_m']:.1f}) | "
            f"{one['heading_deg']:.0f} ({one['base_heading_deg']:.0f}) |"
        )
    return [
        "# Learnt in waves, used in calm water",
        "",
        "Written by `make wavy`.",
        "",
        "The trial `twelve-corner-waves` (wind, waves and the wakes of boats, none of them measured) teaches a model, which is",
        "then judged on the calm trial, both with the true hull 10 % off the profile's. With `--estimator derivative`, as in",
        "the thesis's Experiment 2, `fit` corrects the force by regression on the smoothed motion, and attributes the waves to",
        "the hull. The weak form, which `fit` chooses by itself, averages them out, and has a steady force beside the hull.",
        "`diagnose` finds the wind, holds waves and gusts as states of its filter, and refits the hull beside them.",
        "Force error in calm water over the",
        f"base model's (1: no change), and errors of free runs after {HORIZON_S} s, the base model's in brackets:",
        "",
        "| learnt by | surge | sway | yaw | position [m] | heading [deg] |",
        "|---|---|---|---|---|---|",
        *rows,
        "",
    ]


def _judged(result: dict[str, Any]) -> dict[str, Any]:
    log = result["logs"][0]
    runs = log["free_run"]
    k = runs["model"]["horizons_s"].index(HORIZON_S)
    degrees = 57.29577951308232
    return {
        "mse": {axis: log["per_axis"][axis] for axis in AXES},
        "position_m": runs["model"]["position_m"][k],
        "base_position_m": runs["base"]["position_m"][k],
        "heading_deg": degrees * runs["model"]["heading_rad"][k],
        "base_heading_deg": degrees * runs["base"]["heading_rad"][k],
    }


def _ferryid(*arguments: str) -> dict[str, Any]:
    program = "from ferryid.cli.main import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments, "--json", "-"], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return dict(json.loads(done.stdout))
