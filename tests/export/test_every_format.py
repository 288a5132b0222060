"""What holds of every form of export: found by being there, the same bytes for the same model, no foreign text in the way."""

from __future__ import annotations

import ast
import io
import pkgutil
import re
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import ferryid.export.formats
from ferryid.effects import effects
from ferryid.errors import FerryIdError
from ferryid.export.exported import HULL, SENSORS, THRUSTERS, Acting, exported
from ferryid.export.formats import formats
from ferryid.export.model_file import export_model
from ferryid.export.names import identifier, legal, number, plain
from ferryid.export.physics import FACTORS, FUNCTIONS, physics
from ferryid.models.store.versions import save
from ferryid.regression.bases.basis import BASES, CURRENT, WIND
from ferryid.regression.bases.term import DIMENSIONS
from tests.export.models import MODELS, SHA
from tests.models.test_stored_effect import FERRY, stored

FORMATS = sorted(formats())


def test_a_file_is_a_form() -> None:
    files = [module.name for module in pkgutil.iter_modules(ferryid.export.formats.__path__)]
    assert files == [form.name for form in formats().values()] == FORMATS
    # No form replaces the file of another.
    assert len({form.suffix for form in formats().values()}) == len(FORMATS)


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_the_same_model_gives_the_same_bytes_anywhere(name: str, tmp_path: Path) -> None:
    texts = []
    for folder in ("a", "another/place"):
        save(MODELS["decoupled"], tmp_path / folder)
        result = export_model("milliampere", name, tmp_path / folder)
        texts.append(Path(result["file"]).read_bytes())
    assert texts[0] == texts[1]
    assert str(tmp_path).encode() not in texts[0]
    assert result["model"]["sha256"].encode() in texts[0]
    assert b"milliampere@1" in texts[0]
    for told in (b"go TO", b"NED", b"FRD", b"N m", b"u -0.5 to 1.25 m/s"):
        assert told in texts[0], told


def inside(archive: bytes) -> Iterator[str]:
    """Yield the texts of an archive."""
    with zipfile.ZipFile(io.BytesIO(archive)) as made:
        for name in made.namelist():
            text = made.read(name).decode()
            if name.endswith(".xml"):
                ET.fromstring(text)
            yield text


@pytest.mark.parametrize("name", [name for name, form in formats().items() if form.check is not None])
@pytest.mark.parametrize("model", ["no basis", "factors", "paper flows", "centre ahead", "cross flow everywhere"])
def test_parameters_for_another_program_state_their_error(name: str, model: str) -> None:
    one = exported(MODELS[model], SHA)
    form = formats()[name]
    text = form.render(one)
    checked = form.check(one, text)
    assert all(0.0 <= value < 3.0 for of in checked["error_share"].values() for value in of.values())
    assert checked["missing"], "every hull here has more than the program"
    assert all(term in text for term in checked["terms"])
    # What is counted as missing is what the errors are made of.
    for axis, error in checked["error_share"]["velocity"].items():
        assert error <= sum(part["share"][axis] for part in checked["missing"]) + 1e-9
    term = checked["terms"][-1]
    wrong = re.sub(f"<{term}>.*</{term}>", f"<{term}>1e9</{term}>", text)
    assert form.check(one, wrong)["error_share"]["velocity"]["yaw"] > 10.0


@pytest.mark.parametrize("name", FORMATS)
def test_foreign_text_stays_a_comment(name: str) -> None:
    nasty = replace(MODELS["no basis"], name='*/ "x\'\n#error {boom} \\ % ??/ """ æøå')
    text = formats()[name].render(exported(nasty, SHA))
    if isinstance(text, bytes):
        text = "".join(inside(text))
    assert text.isascii()
    assert "\n#error" not in text
    if name == "python":
        ast.parse(text)
    if name in ("gazebo", "px4"):
        assert next(iter(ET.fromstring(text))).tag == "model"
    if name == "c":
        assert text.count("*/") == text.count("/*")
        assert "\\" not in text


def test_names_are_legal_and_stay_apart() -> None:
    terms = {term.name for table in (BASES, WIND, CURRENT) for functions in table.values() for term in functions}
    assert len({legal(term) for term in terms}) == len(terms)
    assert legal("X_|u|u") == "X_abs_u_u"
    assert legal("V_rc^2 cos(gamma_rc)|cos(gamma_rc)|") == "V_rc_2_cos_gamma_rc_abs_cos_gamma_rc"
    assert legal("2nd boat") == "n_2nd_boat"
    assert identifier("5m-ferry.b", 2) == "n_5m_ferry_b_v2"
    assert len(identifier("x" * 80, 999)) <= 63
    assert identifier("_", -1).isidentifier()


@pytest.mark.parametrize("value", [1.0, -0.0, 1e-5, 1e22, 0.1 + 0.2, 5e-324, 1.7976931348623157e308, 123456789.0])
def test_numbers_come_back_to_the_last_bit(value: float) -> None:
    assert float(number(value)).hex() == value.hex()
    assert "." in number(value)


def test_text_is_plain() -> None:
    assert plain("milliAmpère: 2 N·s²/m, 5°") == "milliAmpere: 2 N*s^2/m, 5 deg"
    assert plain("N·s²/m⁴") == "N*s^2/m^4"
    assert plain("a\nb */ /* ???/ \\") == "a b * / / * ? ? ?/ /"


def test_every_factor_has_its_expression() -> None:
    assert set(FACTORS) == set(DIMENSIONS)


@pytest.mark.parametrize("name", MODELS)
def test_lines_need_nothing_that_is_not_given(name: str) -> None:
    lines = physics(exported(MODELS[name], SHA))
    known = {"u", "v", "r", "u_dot", "v_dot", "r_dot", "psi", *FUNCTIONS}
    known |= {f"{what}_{axis}" for what in ("wind", "current") for axis in "NE"} | {"payload_m", "payload_x"}
    known |= {one.name for one in lines.constants}
    for block in lines.blocks:
        for line in block.lines:
            needed = {node.id for node in ast.walk(ast.parse(line.expression)) if isinstance(node, ast.Name)}
            assert needed <= known, needed - known
            known.add(line.name)


def test_every_property_of_the_vessel_has_its_place() -> None:
    places = {}
    for effect in (name for name, one in effects().items() if one.vessel):
        instance = effects()[effect].instances(FERRY)[0]
        model = replace(MODELS["no basis"], vessel_effects=(stored(effect, instance),))
        (acting,) = exported(model, SHA).acting
        places[effect] = acting.on
        assert isinstance(acting, Acting)
    assert {key for key, on in places.items() if on == HULL} == {"fouling", "hull_parameters"}
    assert {key for key, on in places.items() if on == SENSORS} == {"heading_bias", "lever_arm"}
    assert set(places.values()) == {HULL, SENSORS, THRUSTERS}


def test_conditions_stay_behind_and_that_is_told() -> None:
    one = exported(MODELS["conditions"], SHA)
    told = one.left_out()
    assert told[0].startswith("not exported: steady wind of the log trial.")
    assert "hull alone" in told[1]
    assert exported(replace(one.model, conditions=()), SHA).left_out() == ()


def test_forces_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(FerryIdError, match="not finite"):
        exported(replace(MODELS["decoupled"], scale={"delta": 1.0, "sigma": 1.0, "zeta": 0.0}), SHA)
