"""A vessel of which surge velocity and yaw rate are measured and sway is not: a reduced model, not a refusal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ferryid.models.store import load_file
from tests.cli.recordings import POSITION, SURGE_ALONE, corners, profile, write
from tests.cli.test_bad_input import drawn, refused
from tests.cli.test_every_command import conforms

SAYS = "Sway velocity is not measured: taken as zero; the model is reduced to surge and yaw."


@pytest.mark.slow
@pytest.mark.parametrize("placed", [True, False])
def test_fit_judges_surge_and_yaw_and_keeps_the_sway_of_the_base_model(ferryid, tmp_path: Path, placed: bool) -> None:
    table, changes = corners(), [SURGE_ALONE]
    if not placed:
        changes.append((POSITION, ""))
    vessel = profile(tmp_path, *changes)
    log, out = write(table, tmp_path / "corners.csv"), ("--out", tmp_path / "out")
    assert ferryid("vessel", "check", vessel).code == 0
    told = ferryid("inspect", log, "--vessel", vessel)
    assert told.code == 0
    assert SAYS in " ".join(told.out.split())

    run = ferryid("fit", log, "--vessel", vessel, *out, "--json", "-")
    assert run.code == 0, run.err
    result = conforms(run.out)
    assert any(SAYS in warning for warning in result["warnings"])
    assert result["settings"]["axes"] == ["surge", "yaw"]
    assert "mean of surge and yaw" in " ".join(result["reasons"])
    assert result["scores"]["per_axis"]["sway"] is None
    assert result["scores"]["normalised_mse"] == pytest.approx(
        np.mean([result["scores"]["per_axis"][axis] for axis in ("surge", "yaw")])
    )
    names = {check["name"] for check in result["acceptance"]["checks"]}
    assert {"held_out_error_surge", "held_out_error_yaw", "inertia_surge", "damping_yaw"} <= names
    assert not any(name.endswith("_sway") or "position" in name for name in names)
    assert any(name.startswith("free_run_heading") for name in names)
    assert all(value is None for value in result["free_run"]["model"]["position_m"])
    assert SAYS in Path(result["report"]).read_text(encoding="utf-8")

    model = load_file(Path(result["model"]["path"]))
    with_sway = [any(part in term for part in ("v",)) for term in model.terms]
    assert any(with_sway)
    assert not model.theta[:, 1].any()
    assert not model.theta[with_sway].any()
    assert model.intercept[1] == 0.0
    assert model.theta[[not one for one in with_sway]][:, [0, 2]].any()
    assert not {"v", "v_dot"} & set(model.ranges)


@pytest.mark.slow
def test_a_reduced_model_is_evaluated_compared_exported_and_steers(ferryid, tmp_path: Path) -> None:
    vessel, out = profile(tmp_path, SURGE_ALONE), ("--out", tmp_path / "out")
    log = write(corners(), tmp_path / "corners.csv")
    name = "milliampere"
    for components in ("4", "8"):
        assert ferryid("fit", log, "--vessel", vessel, "--components", components, "--no-report", *out).code == 0
    told = tmp_path / "told.json"
    text = ferryid("evaluate", f"{name}@1", log, *out, "--json", told)
    assert text.code == 0
    assert "nan" not in text.out
    assert SAYS in " ".join(text.out.split())
    pooled = conforms(told.read_text(encoding="utf-8"))["pooled"]
    assert pooled["per_axis"]["sway"] is None
    assert pooled["mse"]["model"]["surge"] > 0.0
    text = ferryid("compare", f"{name}@1", f"{name}@2", "--on", log, *out, "--json", told)
    assert text.code == 0, text.err
    assert "sway" not in text.out.splitlines()[0]
    compared = conforms(told.read_text(encoding="utf-8"))
    assert compared["logs"][0]["scores"][f"{name}@1"]["mse"]["sway"] is None
    assert ferryid("export", f"{name}@1", "--to", "python", *out).code == 0
    scenario = tmp_path / "steered.toml"
    scenario.write_text(
        'schema = "ferryid.scenario/1"\ntitle = "steered by a reduced model"\nvessel = "milliampere"\n'
        "start = 2021-04-20T10:00:00Z\nseed = 1\nduration_s = 30\n"
        '[path]\nkind = "twelve-corner"\ndwell_s = 7.5\nsize = 0.3\n'
        f'[controller]\nmodel = "{tmp_path / "out" / "models" / name / "1.json"}"\n',
        encoding="utf-8",
    )
    assert ferryid("simulate", scenario, "--out", tmp_path / "simulated").code == 0


def test_diagnose_refuses_it_in_one_line(ferryid, tmp_path: Path) -> None:
    vessel, log = profile(tmp_path, SURGE_ALONE), write(corners(), tmp_path / "corners.csv")
    run = ferryid("diagnose", log, "--vessel", vessel, "--out", tmp_path / "out")
    refused(run, "surge velocity alone", "ferryid fit, which reduces the model")
    signals = drawn(run, tmp_path / "out")["logs"][0]["signals"]
    assert {one["column"] for one in signals} >= {"u", "psi"}


def test_an_archive_of_such_logs_is_reduced_too(ferryid, tmp_path: Path) -> None:
    vessel, out = profile(tmp_path, SURGE_ALONE), ("--out", tmp_path / "out")
    log = write(corners(), tmp_path / "corners.csv")
    assert ferryid("ingest", log, "--vessel", vessel, *out).code == 0
    run = ferryid("fit", "--archive", "--vessel", vessel, "--components", "6", "--no-report", *out, "--json", "-")
    assert run.code == 0, run.err
    result = conforms(run.out)
    assert result["scores"]["per_axis"]["sway"] is None
    conforms(Path(result["model"]["path"]).read_text("utf-8"))
    model = load_file(Path(result["model"]["path"]))
    assert not model.theta[:, 1].any()
    assert model.theta[:, [0, 2]].any()


def test_a_constant_sway_is_still_refused_and_surge_alone_is_the_remedy(ferryid, tmp_path: Path) -> None:
    table = corners()
    table["v [m/s]"][:] = 0.0
    log = write(table, tmp_path / "corners.csv")
    vessel = profile(tmp_path, (POSITION, ""))
    run = ferryid("fit", log, "--vessel", vessel, "--out", tmp_path / "out")
    refused(run, "constant signal v", "map surge velocity alone")
    assert not (tmp_path / "out" / "models").exists()
