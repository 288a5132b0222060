"""Model files and the store: nothing is lost, nothing is overwritten, and wrong files are told in one line."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.models.model import Model, model_to_json
from ferryid.models.scores import ForceScores, ModelScores
from ferryid.models.store.listing import list_versions
from ferryid.models.store.versions import StoredModel, list_models, load, load_file, save
from ferryid.regression.bases.basis import make_basis
from ferryid.report import model_text
from ferryid.report.model_text import render_listing, render_model
from ferryid.vessel import load_profile


def made(accepted: bool = True, seed: int = 0) -> Model:
    functions = make_basis("modulus")
    K = len(functions.terms)
    rng = np.random.default_rng(seed)
    theta = rng.normal(size=(K, 3)) * 1e3 / 7
    covariance = rng.normal(size=(3, K + 1, K + 1))
    return Model(
        name="boat",
        version=0,
        created="2026-01-01T00:00:00Z",
        ferryid_version="0.1.0",
        profile_text=load_profile("milliampere").text,
        scale={"delta": 0.4, "sigma": 0.4, "zeta": 1.0},
        settings={"basis": "modulus", "structure": "coupled", "components": 7, "window_s": 1.0},
        terms=functions.terms,
        units=functions.units,
        theta=theta,
        intercept=rng.normal(size=3),
        low=theta - 1,
        high=theta + 1,
        intercept_low=rng.normal(size=3),
        intercept_high=rng.normal(size=3),
        covariance=covariance,
        ranges={"u": (-0.5, 1.25)},
        training=({"name": "log", "files": ["log.bag"], "sha256": "ab", "seconds": 60.0, "rows": 1200},),
        scores=ModelScores(
            replace(
                ForceScores.of(np.ones(3), np.array([0.4, 0.5, 0.6]), 2.0 * np.ones(3)),
                mse_constant_velocity=np.array([0.7, 0.8, 0.9]),
            ),
            60,
            6.0,
            "blocks",
            (),
        ),
        accepted=accepted,
    )


def test_a_model_comes_back_to_the_last_digit(tmp_path: Path) -> None:
    stored = save(made(), tmp_path)
    again = load_file(stored.path)
    for name in ("theta", "intercept", "low", "high", "intercept_low", "intercept_high", "covariance"):
        np.testing.assert_array_equal(getattr(again, name), getattr(stored.model, name))
    assert model_to_json(again) == model_to_json(stored.model)
    assert again.scores is not None
    np.testing.assert_array_equal(again.scores.force.mse_constant_velocity, [0.7, 0.8, 0.9])
    raw = json.loads(stored.path.read_text())
    del raw["scores"]["mse"]["constant_velocity"]
    stored.path.write_text(json.dumps(raw))
    older = load_file(stored.path).scores
    assert older is not None
    assert np.isnan(older.force.mse_constant_velocity).all()


def test_what_nobody_could_read_again_is_not_stored(tmp_path: Path) -> None:
    theta = made().theta
    theta[0, 0] = np.inf
    with pytest.raises(FerryIdError, match=r"missing or wrong.*The model is not stored.*Fix: report it"):
        save(replace(made(), theta=theta), tmp_path)
    assert not list(tmp_path.rglob("*.json"))
    assert not list(tmp_path.rglob("current"))


@pytest.mark.slow
def test_current_moves_only_on_acceptance(tmp_path: Path) -> None:
    assert save(made(), tmp_path).current
    rejected = save(made(accepted=False, seed=1), tmp_path)
    assert (rejected.model.version, rejected.current) == (2, False)
    assert load("boat", tmp_path).version == 1
    assert save(made(seed=2), tmp_path).current
    assert load("boat", tmp_path).version == 3
    stored = [one for one in list_models(tmp_path) if isinstance(one, StoredModel)]
    assert [(s.model.version, s.model.accepted, s.current) for s in stored] == [
        (1, True, False),
        (2, False, False),
        (3, True, True),
    ]


def test_the_same_model_at_another_time_is_the_same_version(tmp_path: Path) -> None:
    first = save(made(), tmp_path)
    before = first.path.read_bytes()
    again = save(replace(made(), created="2030-01-01T00:00:00Z"), tmp_path)
    assert again.model.version == first.model.version
    assert first.path.read_bytes() == before
    assert len(list_models(tmp_path)) == 1


def test_a_name_without_an_accepted_version_gives_the_newest(tmp_path: Path) -> None:
    save(made(accepted=False), tmp_path)
    save(made(accepted=False, seed=1), tmp_path)
    assert load("boat", tmp_path).version == 2
    assert load("boat@1", tmp_path).version == 1


@pytest.mark.parametrize(
    ("reference", "told"),
    [
        ("baot", 'Did you mean "boat"'),
        ("boat@7", "there are 1"),
        ("boat@first", "there are 1"),
        ("nowhere/m.json", "no such model file"),
    ],
)
def test_a_wrong_reference_is_told(tmp_path: Path, reference: str, told: str) -> None:
    save(made(), tmp_path)
    with pytest.raises(FerryIdError, match=told):
        load(reference, tmp_path)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda data: data.update(schema="ferryid.model/9", ferryid_version="3.2"), r"ferryid>=3\.2"),
        (lambda data: data.update(schema="something"), "not a ferryid model"),
        (lambda data: data.pop("coefficients"), "coefficients"),
        (lambda data: data["coefficients"]["yaw"].pop("u"), "missing or wrong"),
        (lambda data: data.update(schema="ferryid.model/0"), "not a ferryid model"),
        (lambda data: data["coefficients"]["yaw"]["u"].update(value=10**400), "missing or wrong"),
        (lambda data: data["coefficients"]["yaw"]["u"].update(value=float("inf")), "not finite"),
        (
            lambda data: data["base"]["D"].update(X_u=-500.0),
            r"base\.D\.X_u is not what follows from the vessel profile",
        ),
        (lambda data: data["base"]["D"].pop("X_u"), r"base\.D\.X_u is not what follows"),
        (lambda data: data["base"]["M"]["value"][1].__setitem__(1, 1.0), r"base\.M is not what follows"),
        (lambda data: data["base"]["M"].pop("value"), "missing or wrong"),
        (lambda data: data["scores"].update(interval=[]), "missing or wrong"),
        (lambda data: data["scores"].update(interval=[0.5]), "missing or wrong"),
    ],
)
def test_a_damaged_or_newer_file_is_told(tmp_path: Path, change, told: str) -> None:
    path = save(made(), tmp_path).path
    data = json.loads(path.read_text(encoding="utf-8"))
    change(data)
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(FerryIdError, match=told) as caught:
        load_file(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_cut_file_is_told(tmp_path: Path) -> None:
    path = save(made(), tmp_path).path
    path.write_text(path.read_text(encoding="utf-8")[:500], encoding="utf-8")
    with pytest.raises(FerryIdError, match="not readable as a model file"):
        load_file(path)


@pytest.mark.parametrize("text", ["[" * 100_000, '{"version": ' + "9" * 5000 + "}"])
def test_what_breaks_the_json_reader_is_told(tmp_path: Path, text: str) -> None:
    (tmp_path / "model.json").write_text(text, encoding="utf-8")
    with pytest.raises(FerryIdError, match="not readable as a model file"):
        load_file(tmp_path / "model.json")


DAMAGE = {
    "empty": lambda data: b"",
    "zeros": lambda data: bytes(len(data)),
    "cut": lambda data: data[: len(data) // 2],
    "binary": lambda data: bytes(range(256)),
    "no object": lambda data: b"[]",
    "other schema": lambda data: data.replace(b"ferryid.model/1", b"ferryid.fit/1"),
    "newer": lambda data: data.replace(b"ferryid.model/1", b"ferryid.model/9"),
    "profile": lambda data: data.replace(b"[hull]", b"[[[hull]"),
}


@pytest.mark.slow
@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_version_is_a_row_and_keeps_its_number(tmp_path: Path, damage: str) -> None:
    save(made(), tmp_path)
    path = save(made(seed=1), tmp_path).path
    before = path.read_bytes()
    path.write_bytes(DAMAGE[damage](before))
    assert path.read_bytes() != before
    result = list_versions(tmp_path)
    first, second = result["models"]
    assert (first["version"], "unreadable" in first) == (1, False)
    assert (second["name"], second["version"], second["current"]) == ("boat", 2, True)
    assert str(path) in second["unreadable"]
    assert "Fix: " in second["unreadable"]
    assert "unreadable" in render_listing(result, tmp_path).splitlines()[2]
    assert load("boat@1", tmp_path).version == 1
    assert save(made(seed=2), tmp_path).model.version == 3
    assert save(made(), tmp_path).model.version == 1
    with pytest.raises(FerryIdError, match="Did you mean"):
        load("baot", tmp_path)


def test_a_folder_in_place_of_the_current_version_is_reported_with_a_remedy(tmp_path: Path) -> None:
    save(made(), tmp_path)
    current = tmp_path / "models" / "boat" / "current"
    current.unlink()
    current.mkdir()
    assert "holds no number" in render_listing(list_versions(tmp_path), tmp_path).splitlines()[-1]
    with pytest.raises(FerryIdError, match=r"current: the number .*, found a folder\. Fix: move or delete that folder"):
        save(made(seed=1), tmp_path)
    assert load("boat@1", tmp_path).version == 1


@pytest.mark.parametrize(("text", "told"), [("", "no number"), ("x\n", "no number"), ("7\n", "names version 7")])
def test_a_damaged_note_of_the_current_version_is_told(tmp_path: Path, text: str, told: str) -> None:
    save(made(), tmp_path)
    (tmp_path / "models" / "boat" / "current").write_text(text, encoding="utf-8")
    with pytest.raises(FerryIdError, match=rf"current: .*{told}.* Fix: give a version as boat@NUMBER, there are 1"):
        load("boat", tmp_path)
    assert load("boat@1", tmp_path).version == 1
    assert told in render_listing(list_versions(tmp_path), tmp_path).splitlines()[-1]
    save(made(seed=1), tmp_path)
    assert load("boat", tmp_path).version == 2


def test_what_a_fit_estimated_of_single_logs_is_listed_and_shown(tmp_path: Path) -> None:
    estimated = {
        "current": {name: {"value": 0.2, "standard_error": 0.01, "unit": "m/s"} for name in ("north", "east")},
        "payload": {"mass": {"value": -80.0, "standard_error": 10.0, "unit": "kg"}},
    }
    model = replace(made(), training=({**made().training[0], "conditions": estimated},))
    save(model, tmp_path)
    (row,) = list_versions(tmp_path)["models"]
    current = "current: north 0.2 (0.18 to 0.22) m/s, east 0.2 (0.18 to 0.22) m/s"
    assert row["conditions"] == {"log": [current, "load: mass -80 (-99.6 to -60.4) kg"]}
    schema = json.loads(files("ferryid.schemas").joinpath("models.json").read_text(encoding="utf-8"))
    jsonschema.validate(json.loads(json.dumps(list_versions(tmp_path))), schema)
    listed = render_listing(list_versions(tmp_path), tmp_path)
    assert f"      log: {current}" in listed.splitlines()
    # It is the fit's own verdict all the same.
    assert "accepted" in listed.splitlines()[1]
    assert f"  log: {current}" in render_model(model).splitlines()


def test_a_model_is_shown_by_its_equations_of_motion_beside_the_base_model() -> None:
    """What a correction adds means little without what it is added to."""
    model = made()
    lines = render_model(model).splitlines()
    (row,) = (line for line in lines if line.startswith("m11 "))
    value, low, high, base, change, per_cent, unit = row.split()[1:]
    assert (per_cent, unit) == ("%", "kg")
    assert float(low) < float(value) < float(high)
    added = float(model.theta[model.terms.index("u_dot"), 0])
    assert float(value) - float(base) == pytest.approx(added, rel=1e-3, abs=0.1)
    assert float(change) == pytest.approx(100.0 * added / float(base), abs=0.06)
    assert lines.index(row) < next(k for k, line in enumerate(lines) if line.startswith("term "))


def test_a_coefficient_that_is_nothing_but_rounding_is_shown_as_none(monkeypatch: pytest.MonkeyPatch) -> None:
    found = dict(model_text.equation_coefficients(made()))
    m22 = float(found["m22"][0])
    found["m23"], found["m32"] = np.array([1e-3 * m22, -1.0, 1.0]), np.array([1e-18 * m22, -1.0, 1.0])
    monkeypatch.setattr(model_text, "equation_coefficients", lambda model: found)
    lines = render_model(made()).splitlines()
    value = {line.split()[0]: line.split()[1] for line in lines if line.startswith("m") and len(line.split()) > 5}
    assert float(value["m23"]) == pytest.approx(1e-3 * m22, rel=1e-3)
    assert value["m32"] == "0"


def test_a_model_without_a_correction_has_no_table_of_one() -> None:
    """That of a diagnosis may have none: its coefficients are those of the equations of motion."""
    nothing, none = np.zeros_like(made().theta), np.zeros(3)
    bare = replace(
        made(), theta=nothing, low=nothing, high=nothing, intercept=none, intercept_low=none, intercept_high=none
    )
    lines = render_model(bare).splitlines()
    assert "correction of the base model" not in "".join(lines)
    heads = [k for k, line in enumerate(lines) if line.startswith(("term ", "hull ", "coefficient "))]
    assert len(heads) == 1
    assert lines[heads[0] + 1].startswith("m11 ")
    assert any(line.startswith("term ") for line in render_model(made()).splitlines())
