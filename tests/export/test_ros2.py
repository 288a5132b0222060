"""The exported ROS 2 parameters: legal names, every number a double and the very same."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from ferryid.effects.force_model import COEFFICIENTS
from ferryid.export.exported import exported
from ferryid.export.formats import formats
from ferryid.export.names import legal
from ferryid.models.forces.model_forces import acting_estimator
from ferryid.models.forces.residual import scale_hull
from tests.export.models import MODELS, RANGES, SHA


def parameters(name: str) -> dict[str, Any]:
    text = formats()["ros2"].render(exported(MODELS[name], SHA))
    data = YAML(typ="safe").load(text)
    assert list(data) == ["/**"]
    assert list(data["/**"]) == ["ros__parameters"]
    return data["/**"]["ros__parameters"]


@pytest.mark.parametrize("name", MODELS)
def test_every_number_is_there_and_the_same(name: str) -> None:
    model, told = MODELS[name], parameters(name)
    force = acting_estimator(model)
    hull = scale_hull(force.profile.hull, force.scale)
    assert told["model"] == {"label": model.label, "sha256": SHA, "vessel": model.name}
    assert [[told["mass_matrix"][f"m{i}{j}"] for j in (1, 2, 3)] for i in (1, 2, 3)] == hull.M.tolist()
    assert told["rigid_body"] == {"mass": hull.mass_kg, "x_g": hull.x_g_m, "inertia_z": hull.inertia_z}
    assert told["damping"] == {legal(key): hull.D.get(key, 0.0) for key in COEFFICIENTS[5:]}
    assert told["zeta"] == model.scale["zeta"]
    areas = force.profile.wind
    assert ("wind" in told) == (areas is not None)
    if areas is not None:
        assert (told["wind"]["frontal_area"], told["wind"]["delta"]) == (areas.frontal_m2, areas.delta)
    assert list(told.get("terms", {})) == [legal(term) for term in model.terms]
    rows = [[row[axis] for axis in ("surge", "sway", "yaw")] for row in told.get("terms", {}).values()]
    assert rows == model.theta.tolist()
    if model.terms:
        assert list(told["intercept"].values()) == model.intercept.tolist()
    assert told["ranges"] == {key: list(value) for key, value in RANGES.items()}


def test_integrals_along_the_hull_come_with_half_its_length() -> None:
    assert parameters("cross flow")["strips"] == {"half_length": 2.5}
    assert "strips" not in parameters("lift")


@pytest.mark.parametrize("name", MODELS)
def test_keys_are_names_and_numbers_are_doubles(name: str) -> None:
    def walk(node: Any) -> None:
        if isinstance(node, dict):
            assert node, "ROS 2 takes no empty mapping"
            for key, value in node.items():
                assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", key), key
                walk(value)
        elif isinstance(node, list):
            assert node
            assert all(isinstance(value, float) for value in node)
        else:
            assert isinstance(node, float | str), node

    walk(parameters(name))


def test_numbers_are_read_as_doubles_by_old_yaml_too() -> None:
    text = formats()["ros2"].render(exported(MODELS["rigid body"], SHA))
    numbers = re.findall(r"^ .*: (-?\d\S*)", text, re.MULTILINE)
    assert len(numbers) > 80
    for number in numbers:
        # YAML 1.1, which ROS 2's launch files are read with, wants a point and the exponent's sign.
        assert re.fullmatch(r"-?\d+\.\d*(e[+-]\d+)?", number), number


def test_effects_have_numbers_and_sentences() -> None:
    effects = parameters("diagnosed")["effects"]
    assert effects["thruster_gain_thruster2"]["factor"] == 0.6
    assert effects["thruster_gain_thruster2"]["acts_on"] == "thrusters"
    assert "60 %" in effects["thruster_gain_thruster2"]["says"]
    assert (effects["ventilation_thruster2"]["factor"], effects["ventilation_thruster2"]["from"]) == (0.5, 55.0)
    assert effects["dead_band_thruster1"]["ahead"] == 120.0
    assert {key: one["acts_on"] for key, one in effects.items()} == {
        "fouling": "hull",
        "thruster_gain_thruster2": "thrusters",
        "azimuth_offset_thruster1": "thrusters",
        "thruster_lag": "thrusters",
        "thrust_inflow_loss": "thrusters",
        "dead_band_thruster1": "thrusters",
        "astern_asymmetry_thruster2": "thrusters",
        "thrust_saturation_thruster1": "thrusters",
        "ventilation_thruster2": "thrusters",
        "heading_bias": "sensors",
    }
    assert "effects" not in parameters("no basis")
    assert not np.isnan(effects["thruster_lag"]["time_constant"])
