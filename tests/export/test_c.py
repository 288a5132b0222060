"""The exported C header: compiled without a warning as C99 and C++, and run on random states."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from ferryid.export.exported import exported
from ferryid.export.formats import formats
from tests.export.models import MODELS, SHA, States, check, force, states

STRICT = ("-Wall", "-Wextra", "-Werror", "-pedantic")
COMPILERS = {
    "C99": ("gcc", "-std=c99"),
    "C++": ("g++", "-std=c++11", "-x", "c++"),
}
DRIVER = """
#include <stdio.h>
#include "vessel.h"

static const double *given(const double *pair) { return pair[0] == pair[0] ? pair : NULL; }

int main(void)
{
    double in[16], tau[3], rate[3];
    size_t i = 0;
    while (scanf("%lf", &in[i]) == 1) {
        if (++i < 13) continue;
        i = 0;
        NAME_force(in, in + 3, in[6], given(in + 7), given(in + 9), given(in + 11), tau);
        NAME_acceleration(tau, in + 3, in[6], given(in + 7), given(in + 9), given(in + 11), rate);
        printf("%.17g %.17g %.17g %.17g %.17g %.17g\\n", tau[0], tau[1], tau[2], rate[0], rate[1], rate[2]);
    }
    return NAME_self_test() == 0.0 ? 0 : 1;
}
"""


def built(text: str, name: str, folder: Path, language: str) -> Path:
    """Return a program around a header."""
    compiler, *flags = COMPILERS[language]
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler} on this machine")
    (folder / "vessel.h").write_text(text, encoding="utf-8")
    (folder / "main.c").write_text(DRIVER.replace("NAME", name), encoding="utf-8")
    done = subprocess.run(
        [compiler, *flags, *STRICT, folder / "main.c", "-o", folder / "main", "-lm"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder / "main"


def answers(program: Path, state: States) -> np.ndarray:
    nothing = np.full((len(state.psi), 2), np.nan)
    optional = [nothing if one is None else one for one in (state.wind, state.current, state.payload)]
    rows = np.column_stack([state.nu_dot, state.nu, state.psi, *optional])
    text = "\n".join(" ".join(repr(value) for value in row) for row in rows.tolist())
    run = subprocess.run([program], input=text, capture_output=True, text=True, check=False)
    assert run.returncode == 0, "the self-test found wrong values"
    return np.array([line.split() for line in run.stdout.splitlines()], dtype=float)


@pytest.mark.slow
@pytest.mark.parametrize("language", COMPILERS)
@pytest.mark.parametrize("name", MODELS)
def test_it_gives_the_force_and_back_the_acceleration(name: str, language: str, tmp_path: Path) -> None:
    one = exported(MODELS[name], SHA)
    program = built(formats()["c"].render(one), one.name, tmp_path, language)
    for state in states(one.model, seed=1):
        found = answers(program, state)
        check(found[:, :3], force(one.model, state))
        check(found[:, 3:], state.nu_dot)


def test_the_self_test_finds_a_wrong_number(tmp_path: Path) -> None:
    one = exported(MODELS["decoupled"], SHA)
    text = formats()["c"].render(one)
    right = f"{one.name}_X_u = -27.632;"
    assert right in text
    program = built(text.replace(right, f"{one.name}_X_u = -27.6321;"), one.name, tmp_path, "C99")
    run = subprocess.run([program], input="", capture_output=True, text=True, check=False)
    assert run.returncode == 1


@pytest.mark.slow
def test_without_a_flow_that_the_terms_need_it_gives_no_number(tmp_path: Path) -> None:
    one = exported(MODELS["wind alone"], SHA)
    program = built(formats()["c"].render(one), one.name, tmp_path, "C99")
    state = next(iter(states(one.model)))
    assert np.isnan(answers(program, States(state.nu_dot, state.nu, state.psi, None, None, None))).all()


def test_the_header_compiles_alone(tmp_path: Path) -> None:
    if shutil.which("gcc") is None:
        pytest.skip("no gcc on this machine")
    header = tmp_path / "vessel.h"
    header.write_text(formats()["c"].render(exported(MODELS["diagnosed"], SHA)), encoding="utf-8")
    command = ["gcc", "-std=c99", *STRICT, "-fsyntax-only", "-x", "c", header]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    text = header.read_text(encoding="utf-8")
    assert "THRUSTER_GAIN_THRUSTER2_FACTOR (0.6)" in text
    assert text.isascii()
