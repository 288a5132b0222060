"""Effects in model files: they come back as they were, what a fit writes has none, and damage is told in one line."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from math import nan
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS, UNITS, Measurements, hull_of, required_force
from ferryid.errors import FerryIdError
from ferryid.files import dump_json
from ferryid.models.forces.estimator import hull_coefficients, model_estimator
from ferryid.models.forces.hull_terms import unmapped_terms
from ferryid.models.forces.model_forces import ModelForces, acting_estimator
from ferryid.models.model import Model, model_to_json
from ferryid.models.store.versions import load_file, save
from ferryid.models.stored_effect import Conditions, Quantity, Source, StoredEffect, _parameters
from ferryid.vessel import load_profile
from tests.models.test_store import made

FERRY = load_profile("milliampere")
HERE = "ab" * 32
VESSEL = {
    "astern_asymmetry",
    "azimuth_offset",
    "azimuth_resolution",
    "dead_band",
    "fouling",
    "heading_bias",
    "hull_parameters",
    "lever_arm",
    "thrust_inflow_loss",
    "thrust_saturation",
    "thruster_gain",
    "thruster_interaction",
    "thruster_lag",
    "ventilation",
    "yaw_rate_scale",
}
CONDITIONS = {"current", "external_push", "gusts", "mooring", "payload", "shallow_water", "time_delay", "waves", "wind"}


def stored(effect: str, instance: str | None = None, *, onset_s: float | None = None, **values: float) -> StoredEffect:
    every = {one.name: one for one in effects()[effect].parameters_of(FERRY)}
    known = {name: values.get(name, one.neutral) for name, one in every.items()}
    parameters = {name: Quantity(value, value - 0.1, value + 0.1, every[name].unit) for name, value in known.items()}
    source = Source("trial", HERE, 0.97, onset_s, {"surge": 0.2, "sway": 0.1, "yaw": 0.0}, ("payload",))
    return StoredEffect(effect, instance, parameters, (source,))


FOULED = stored("fouling", surge=1.8, sway=1.3, yaw=1.3)
BROKEN = stored("thruster_gain", "thruster2", onset_s=720.0, factor=0.6)
WINDY = stored("wind", north=-4.0, east=3.0)


def diagnosed(model: Model | None = None, *, factor: float = 1.1) -> Model:
    model = model or made()
    values = factor * hull_coefficients(model)
    hull = {
        name: Quantity(value, value - 1.0, value + 1.0, unit)
        for name, value, unit in zip(COEFFICIENTS, values.tolist(), UNITS, strict=True)
    }
    return replace(model, hull=hull, vessel_effects=(FOULED, BROKEN), conditions=(Conditions("trial", HERE, (WINDY,)),))


def test_every_effect_is_known_to_be_of_the_vessel_or_of_a_log() -> None:
    for name, effect in effects().items():
        assert name in (VESSEL if effect.vessel else CONDITIONS), name


@pytest.mark.slow
def test_a_diagnosed_model_comes_back_and_keeps_to_its_schema(tmp_path: Path) -> None:
    path = save(diagnosed(), tmp_path).path
    again = load_file(path)
    assert again.hull == diagnosed().hull
    assert again.vessel_effects == (FOULED, BROKEN)
    assert again.conditions == diagnosed().conditions
    schema = json.loads(files("ferryid.schemas").joinpath("model.json").read_text(encoding="utf-8"))
    data = json.loads(path.read_text(encoding="utf-8"))
    data["scores"] = {}
    del schema["properties"]["scores"]
    jsonschema.validate(data, schema)
    data["vessel_effects"][0]["parameters"]["surge"].pop("unit")
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data, schema)


def test_a_hull_comes_back_with_its_lift_and_one_from_before_has_none(tmp_path: Path) -> None:
    lifts = diagnosed()
    lifts = replace(lifts, hull={**lifts.hull, "N_uv": Quantity(-40.0, -50.0, -30.0, "kg")})
    path = save(lifts, tmp_path).path
    assert load_file(path).hull["N_uv"].value == -40.0
    # What the model's own term with u v does is counted in.
    assert hull_coefficients(load_file(path))[COEFFICIENTS.index("N_uv")] == -40.0
    more, less = (model_estimator(one).profile.hull.D["N_uv"] for one in (load_file(path), diagnosed()))
    assert more - less == pytest.approx(-40.0 - diagnosed().hull["N_uv"].value)
    data = json.loads(path.read_text(encoding="utf-8"))
    for name in ("Y_uv", "Y_ur", "N_uv", "N_ur"):
        del data["hull"][name]
    path.write_text(json.dumps(data), encoding="utf-8")
    old = load_file(path).hull
    assert [old[name] for name in COEFFICIENTS[-4:]] == [Quantity(0.0, 0.0, 0.0, unit) for unit in UNITS[-4:]]
    assert [old[name] for name in COEFFICIENTS[:-4]] == [lifts.hull[name] for name in COEFFICIENTS[:-4]]


def test_a_model_of_a_fit_has_no_key_more() -> None:
    text = dump_json(model_to_json(made()))
    assert dump_json(model_to_json(diagnosed().undiagnosed())) == text
    assert not {"hull", "vessel_effects", "conditions"} & json.loads(text).keys()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda data: data["vessel_effects"][0].update(effect="fowling"), '"fowling".*Did you mean "fouling"'),
        (lambda data: data["vessel_effects"][0].update(effect="wind", instance=None), "wind is no property"),
        (lambda data: data["vessel_effects"][1].update(instance="thruster9"), "no instance 'thruster9'"),
        (lambda data: data["vessel_effects"][1]["parameters"]["factor"].update(value=None), "thruster_gain.factor"),
        (lambda data: data["vessel_effects"][1]["parameters"].pop("factor"), "takes the parameters factor"),
        (lambda data: data["vessel_effects"][1].update(found_in=[]), "found in no log"),
        (lambda data: data["vessel_effects"][1]["found_in"][0].update(onset_s="late"), "onset_s is no number"),
        (lambda data: data["vessel_effects"][1]["found_in"][0].update(offset_s=900.0), "thruster_gain is no property"),
        (lambda data: data["vessel_effects"][1]["found_in"][0].update(probability=1.4), "1.4, not within 0 and 1"),
        (
            lambda data: data["conditions"][0].update(effects=data["vessel_effects"][1:]),
            "thruster_gain is no condition of a log",
        ),
        (lambda data: data["conditions"][0]["effects"][0]["parameters"]["north"].update(unit="kn"), "wind takes"),
        (lambda data: data["conditions"][0].pop("sha256"), "sha256"),
        (lambda data: data.update(conditions={}), "no list"),
        (lambda data: data["hull"].pop("N_rrr"), "does not name"),
        (lambda data: data["hull"]["m11"].update(value=-3.0), "no positive mass"),
        (lambda data: data["hull"]["X_u"].update(unit="N"), "hull.X_u is in"),
        (lambda data: data["hull"]["X_u"].update(value=float("inf")), "hull.X_u is not finite"),
    ],
)
def test_damaged_physics_is_told(tmp_path: Path, change, told: str) -> None:
    path = save(diagnosed(), tmp_path).path
    data = json.loads(path.read_text(encoding="utf-8"))
    change(data)
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(FerryIdError, match=told) as caught:
        load_file(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_refitted_hull_counts_the_terms_in() -> None:
    model = replace(made(), settings={**made().settings, "structure": "decoupled"})
    rng = np.random.default_rng(2)
    nu_dot, nu = rng.normal(size=(2, 50, 3))
    psi = rng.normal(size=50)
    same = model_estimator(diagnosed(model, factor=1.0))(nu_dot, nu, psi, None, None)
    np.testing.assert_allclose(same, model_estimator(model)(nu_dot, nu, psi, None, None), rtol=1e-9)
    # A mass more takes its weight times the acceleration more.
    heavy = diagnosed(model, factor=1.0)
    more = {**heavy.hull, "m11": replace(heavy.hull["m11"], value=heavy.hull["m11"].value + 100.0)}
    at_rest = np.zeros((1, 3))
    pull = model_estimator(replace(heavy, hull=more))(np.array([[0.5, 0.0, 0.0]]), at_rest, np.zeros(1), None, None)
    before = model_estimator(heavy)(np.array([[0.5, 0.0, 0.0]]), at_rest, np.zeros(1), None, None)
    np.testing.assert_allclose(pull - before, [[50.0, 0.0, 0.0]], atol=1e-9)


def test_what_no_hull_has_is_named() -> None:
    left = unmapped_terms(made())
    assert "uv" in left
    assert "the constant" in left
    assert unmapped_terms(replace(made(), theta=0.0 * made().theta, intercept=np.zeros(3))) == ()


def test_the_vessels_own_effects_alter_the_hull_that_a_controller_needs() -> None:
    bare = replace(made(), scale={}, theta=0.0 * made().theta, intercept=np.zeros(3))
    model = diagnosed(bare, factor=1.0)
    k = COEFFICIENTS.index("X_|u|u")
    assert ModelForces(model).altered_hull()[k] == pytest.approx(1.8 * hull_of(FERRY)[k])
    nu = np.array([[1.0, 0.0, 0.0]])
    force = acting_estimator(model)(0.0 * nu, nu, np.zeros(1), None, None)
    clean = model_estimator(model)(0.0 * nu, nu, np.zeros(1), None, None)
    assert force[0, 0] - clean[0, 0] == pytest.approx(-0.8 * hull_of(FERRY)[k])


def test_a_fault_that_passed_is_a_condition_of_its_log(tmp_path: Path) -> None:
    passed = replace(BROKEN, sources=(replace(BROKEN.sources[0], offset_s=900.0),))
    model = replace(diagnosed(), vessel_effects=(FOULED,), conditions=(Conditions("trial", HERE, (WINDY, passed)),))
    path = save(model, tmp_path).path
    again = load_file(path)
    assert again.conditions == model.conditions
    assert again.conditions[0].effects[1].offset_in(HERE) == 900.0
    assert again.conditions[0].effects[1].says(HERE).endswith(" It began at 720 s and ended at 900 s.")
    assert "began" not in again.conditions[0].effects[1].says()
    assert again.conditions_of("cd" * 32) == ()
    # A file of before effects could end has no such key.
    data = json.loads(path.read_text(encoding="utf-8"))
    del data["conditions"][0]["effects"][0]["found_in"][0]["offset_s"]
    path.write_text(json.dumps(data), encoding="utf-8")
    assert load_file(path).conditions == model.conditions


def test_what_a_log_did_not_tell_is_not_said_of_the_model_either(tmp_path: Path) -> None:
    sides = {"south": -900.0, "north": 4.0, "west": -900.0, "east": 900.0}
    known = stored("shallow_water", factor=1.6, **sides)
    unreported = {
        name: replace(one, low=nan, high=nan) if name in ("south", "west", "east") else one
        for name, one in known.parameters.items()
    }
    shallow = replace(known, parameters=unreported)
    path = save(replace(diagnosed(), conditions=(Conditions("trial", HERE, (shallow,)),)), tmp_path).path
    again = load_file(path).conditions[0].effects[0]
    assert again.values == known.values, "it acts with what was fitted"
    assert again.says() == "Damping is 1.60 times as large up to 4 m north, as over shallow ground."
    assert "-900" in known.says()


def test_parameters_that_were_chosen_are_those_of_the_effect(tmp_path: Path) -> None:
    wind = stored("wind", north=2.0, east=1.0)
    path = save(replace(diagnosed(), conditions=(Conditions("trial", HERE, (wind,)),)), tmp_path).path

    def changed(change: Callable[[dict[str, Any]], object]) -> Path:
        data = json.loads(path.read_text(encoding="utf-8"))
        change(data["conditions"][0]["effects"][0]["parameters"])
        other = tmp_path / "other.json"
        other.write_text(json.dumps(data), encoding="utf-8")
        return other

    # A file of before the factors on a wind's load were fitted beside it has none.
    older = changed(lambda known: [known.pop(name) for name in ("C_X", "C_Y", "C_N")])
    assert load_file(older).conditions[0].effects[0].values == {"north": 2.0, "east": 1.0}
    for wrong in (lambda known: known.pop("north"), lambda known: known.update(south=known["north"])):
        with pytest.raises(FerryIdError, match="wind takes the parameters north"):
            load_file(changed(wrong))


def test_what_began_in_one_log_lasts_in_the_others() -> None:
    assert BROKEN.onset_in(HERE) == 720.0
    assert BROKEN.onset_in("cd" * 32) == 0.0
    assert diagnosed().conditions_of(HERE) == (WINDY,)
    assert diagnosed().conditions_of("cd" * 32) == ()


def test_zeta_divides_the_force_of_a_measured_payload_too() -> None:
    rng, n = np.random.default_rng(4), 20
    model = replace(made(), scale={"delta": 0.8, "sigma": 1.3, "zeta": 0.9}, theta=0.0 * made().theta)
    nu, nu_dot, psi = rng.normal(size=(n, 3)), rng.normal(size=(n, 3)), rng.uniform(-3.0, 3.0, n)
    payload = np.column_stack([rng.uniform(0.0, 400.0, n), rng.uniform(-1.0, 1.0, n)])
    measurements = Measurements(
        profile=FERRY,
        t=np.arange(float(n)),
        eta=np.column_stack([np.zeros((n, 2)), psi]),
        nu_raw=nu,
        nu=nu,
        parts=np.zeros((n, 2, 3)),
        angles=np.zeros((n, 2)),
        usable=np.ones(n, dtype=bool),
        payload=payload,
        wind=np.zeros((n, 2)),
    )
    found = required_force(ModelForces(model).plain(measurements), nu_dot)
    wanted = model_estimator(model)(nu_dot, nu, psi, measurements.wind, None, payload)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)


def test_a_loss_by_air_of_before_its_time_constant_was_fitted_acts_at_once() -> None:
    effect = effects()["ventilation"]
    known = effect.parameters_of(load_profile("milliampere"))
    data = {one.name: {"value": 0.5, "low": 0.4, "high": 0.6, "unit": one.unit} for one in known[:-1]}
    read = _parameters(effect, data, load_profile("milliampere"))
    assert list(read) == [one.name for one in known]
    assert read["time_constant"].value == 0.0
    with pytest.raises(ValueError, match="takes the parameters"):
        _parameters(effect, {known[0].name: data[known[0].name]}, load_profile("milliampere"))
