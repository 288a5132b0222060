"""The exported MATLAB function, run by Octave where there is one."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from ferryid.export.exported import exported
from ferryid.export.formats import formats
from tests.export.models import MODELS, SHA, check, force, states


def octave(folder: Path, commands: str) -> str:
    """Return what Octave prints."""
    program = shutil.which("octave-cli") or shutil.which("octave")
    if program is None:
        pytest.skip("no Octave on this machine: the MATLAB function was not run")
    (folder / "drive.m").write_text(commands, encoding="utf-8")
    run = subprocess.run(
        [program, "--no-gui", "--norc", "--quiet", "drive.m"], cwd=folder, capture_output=True, text=True, check=False
    )
    return run.stdout + run.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_it_gives_the_acceleration_under_a_force(name: str, tmp_path: Path) -> None:
    model = MODELS[name]
    one = exported(model, SHA)
    (tmp_path / f"{one.name}.m").write_text(formats()["matlab"].render(one), encoding="utf-8")
    made = states(model, seed=2, count=5)
    commands = [f"printf('%d\\n', {one.name}());"]
    for state in made:
        for tau, row in zip(force(model, state).tolist(), state.rows, strict=True):
            optional = ", ".join(str(row[key] or []) for key in ("wind", "current", "payload"))
            x = [*row["nu"], 10.0, 20.0, row["psi"]]
            commands.append(f"[xdot, M] = {one.name}({x}', {tau}', {optional});")
            commands.append("disp(jsonencode({xdot, M}));")
    lines = octave(tmp_path, "\n".join(commands)).splitlines()
    assert lines[:2] == [f"{model.label}: every value as ferryid gives it", "0"]
    found = [json.loads(line) for line in lines[2:] if line.startswith("[")]
    start = 0
    for state in made:
        part = found[start : start + len(state.psi)]
        start += len(state.psi)
        rates = np.array([xdot for xdot, _ in part])
        # Octave writes 15 digits.
        check(rates[:, :3], state.nu_dot)
        c, s = np.cos(state.psi), np.sin(state.psi)
        u, v, r = state.nu.T
        check(rates[:, 3:], np.column_stack([c * u - s * v, s * u + c * v, r]))
        assert np.array([M for _, M in part]).shape == (len(part), 3, 3)


def test_the_self_test_finds_a_wrong_number(tmp_path: Path) -> None:
    one = exported(MODELS["decoupled"], SHA)
    text = formats()["matlab"].render(one)
    assert "p.X_u = -27.632;" in text
    (tmp_path / f"{one.name}.m").write_text(text.replace("p.X_u = -27.632;", "p.X_u = -27.6321;"), encoding="utf-8")
    assert "values are wrong" in octave(tmp_path, f"{one.name}();")


def test_a_flow_that_the_terms_need_is_asked_for(tmp_path: Path) -> None:
    one = exported(MODELS["wind alone"], SHA)
    (tmp_path / f"{one.name}.m").write_text(formats()["matlab"].render(one), encoding="utf-8")
    assert "terms of the wind" in octave(tmp_path, f"{one.name}(zeros(6, 1), [1 0 0]);")


def test_its_head_says_how_to_call_it() -> None:
    one = exported(MODELS["diagnosed"], SHA)
    text = formats()["matlab"].render(one)
    first, second, *_ = text.splitlines()
    assert first == f"function [xdot, M] = {one.name}(x, tau, wind, current, payload)"
    assert second.startswith(f"% {one.name.upper()} ")
    assert text.isascii()
