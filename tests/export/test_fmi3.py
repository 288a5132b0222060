"""The exported FMU: valid for a checker of the standard, compiled without a warning, and moving as ferryid moves."""

from __future__ import annotations

import io
import shutil
import subprocess
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import numpy as np
import pytest

from ferryid.export.exported import Exported, exported
from ferryid.export.formats import formats
from tests.export import simulators
from tests.export.models import MODELS, SHA
from tests.export.test_c import STRICT
from tests.export.test_simulators import of

INPUTS = ("X", "Y", "N", "wind_N", "wind_E", "current_N", "current_E", "payload_m", "payload_x")
OUTPUTS = ("u", "v", "r", "x", "y", "psi")


def unpacked(one: Exported, folder: Path) -> Path:
    with zipfile.ZipFile(io.BytesIO(formats()["fmi3"].render(one))) as archive:
        archive.extractall(folder)
    return folder


def test_the_head_says_what_it_is_of_and_how() -> None:
    content = formats()["fmi3"].render(exported(MODELS["diagnosed"], SHA))
    assert b"Written by ferryid export" in content[:4096]
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.namelist()[0] == "modelDescription.xml"
        root = ET.fromstring(archive.read("modelDescription.xml"))
        source = archive.read("sources/fmu.c").decode()
    assert root.get("fmiVersion") == "3.0"
    assert f'"{root.get("instantiationToken")}"' in source
    names = [one.get("name") for one in root.find("ModelVariables")]
    assert names[1:10] == list(INPUTS)
    assert names[10:16] == list(OUTPUTS)


def test_it_compiles_without_a_warning(tmp_path: Path) -> None:
    if shutil.which("gcc") is None:
        pytest.skip("no gcc on this machine")
    folder = unpacked(exported(MODELS["paper flows"], SHA), tmp_path)
    command = ["gcc", "-std=c99", *STRICT, "-fsyntax-only", folder / "sources" / "fmu.c"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", ["no basis", "paper flows"])
def test_a_checker_accepts_it_and_it_moves_as_ferryid_does(name: str, tmp_path: Path) -> None:
    fmpy = pytest.importorskip("fmpy", reason="no fmpy on this machine: the FMU was not checked")
    from fmpy.build import build_platform_binary
    from fmpy.validation import validate_fmu

    one = exported(MODELS[name], SHA)
    file = tmp_path / "vessel.fmu"
    file.write_bytes(formats()["fmi3"].render(one))
    assert validate_fmu(str(file)) == []
    folder = unpacked(one, tmp_path / "fmu")
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build")
    wind, current = np.array([[4.0, -2.0]]), np.array([[0.2, -0.1]])
    tau = np.array([150.0, 20.0, 60.0])
    given = (*tau, *wind[0], *current[0], 0.0, 0.0)
    # Its own method of co-simulation against one that is written apart.
    found = fmpy.simulate_fmu(
        str(folder),
        fmi_type="CoSimulation",
        stop_time=20.0,
        output_interval=0.1,
        start_values=dict(zip(INPUTS, given, strict=True)),
        output=[*OUTPUTS, "wrong_values", *(f"der_{state}" for state in OUTPUTS)],
    )
    assert found["wrong_values"].tolist() == [0.0] * 201

    def acceleration(nu: np.ndarray, force: np.ndarray) -> np.ndarray:
        zero = np.zeros((1, 3))
        return np.linalg.solve(one.mass, force - one.force(zero, nu[None], np.array([heading[0]]), wind, current)[0])

    rate = np.column_stack([found[f"der_{state}"] for state in OUTPUTS])
    states = np.column_stack([found[state] for state in OUTPUTS])
    heading = [0.0]
    for state, derivative in zip(states, rate, strict=True):
        heading[0] = state[5]
        c, s = np.cos(state[5]), np.sin(state[5])
        u, v, r = state[:3]
        assert derivative[3:] == pytest.approx([c * u - s * v, s * u + c * v, r], rel=1e-9)
        assert derivative[:3] == pytest.approx(acceleration(state[:3], tau), rel=1e-9, abs=1e-12)
    assert np.gradient(states, 0.1, axis=0)[1:-1] == pytest.approx(rate[1:-1], rel=0.01, abs=0.01)
    exchanged = fmpy.simulate_fmu(
        str(folder),
        fmi_type="ModelExchange",
        stop_time=20.0,
        output_interval=0.1,
        relative_tolerance=1e-8,
        start_values=dict(zip(INPUTS, given, strict=True)),
        output=list(OUTPUTS),
    )
    last = np.array([exchanged[state][-1] for state in OUTPUTS])
    assert last == pytest.approx(states[-1], rel=1e-4, abs=1e-4)


@pytest.mark.slow
def test_in_still_water_it_goes_where_ferryid_goes(tmp_path: Path) -> None:
    fmpy = pytest.importorskip("fmpy", reason="no fmpy on this machine: the FMU was not checked")
    from fmpy.build import build_platform_binary

    one = exported(MODELS["no basis"], SHA)
    folder = unpacked(one, tmp_path)
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build")
    tau = np.array([120.0, 0.0, -40.0])
    found = fmpy.simulate_fmu(
        str(folder),
        fmi_type="CoSimulation",
        stop_time=30.0,
        output_interval=0.5,
        start_values={"X": tau[0], "N": tau[2], "air": 0.0},
        output=list(OUTPUTS),
    )
    wanted = simulators.path(of(one.force), np.tile(tau, (600, 1)), 0.05)[-1]
    assert [found[state][-1] for state in ("x", "y", "psi")] == pytest.approx(wanted, rel=1e-6)
