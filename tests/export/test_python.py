"""The exported Python module, in an interpreter that has nothing but the standard library."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ferryid.export.exported import exported
from ferryid.export.formats import formats
from ferryid.models.model import Model
from tests.export.models import MODELS, SHA, check, fitted, force, states

DRIVER = """
import importlib.util, json, sys
assert "site" not in sys.modules
spec = importlib.util.spec_from_file_location("vessel", sys.argv[1])
vessel = importlib.util.module_from_spec(spec)
spec.loader.exec_module(vessel)
answers = []
for row in json.load(sys.stdin):
    around = [row[name] for name in ("nu", "psi", "wind", "current", "payload")]
    tau = vessel.force(row["nu_dot"], *around)
    answers.append([tau, vessel.acceleration(tau, *around)])
json.dump({"answers": answers, "wrong": vessel.self_test()}, sys.stdout)
"""


def text_of(model: Model) -> str:
    return formats()["python"].render(exported(model, SHA))


def loaded(model: Model) -> SimpleNamespace:
    """Return the module's functions."""
    namespace: dict[str, object] = {"__name__": "vessel"}
    exec(compile(text_of(model), "vessel.py", "exec"), namespace)
    return SimpleNamespace(**namespace)


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_it_gives_the_force_and_back_the_acceleration(name: str, tmp_path: Path) -> None:
    model, module = MODELS[name], tmp_path / "vessel.py"
    module.write_text(text_of(model), encoding="utf-8")
    for state in states(model):
        run = subprocess.run(
            [sys.executable, "-I", "-S", "-c", DRIVER, module],
            input=json.dumps(state.rows),
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, run.stderr
        told = json.loads(run.stdout)
        assert told["wrong"] == 0
        found = np.array(told["answers"])
        check(found[:, 0], force(model, state))
        check(found[:, 1], state.nu_dot)


def test_it_checks_itself_in_one_line(tmp_path: Path) -> None:
    module = tmp_path / "vessel.py"
    text = text_of(MODELS["diagnosed"])
    for line, told, code in (
        ("zeta = 0.9 ", "every value as ferryid gives it", 0),
        ("zeta = 0.90000001 ", " values are wrong", 1),
    ):
        module.write_text(text.replace("zeta = 0.9 ", line), encoding="utf-8")
        run = subprocess.run([sys.executable, "-I", "-S", module], capture_output=True, text=True, check=False)
        assert (run.returncode, run.stderr) == (code, "")
        assert run.stdout.count("\n") == 1
        assert told in run.stdout


def test_a_flow_that_the_terms_need_is_asked_for() -> None:
    still = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0)
    for name, what in (("wind alone", "wind"), ("current alone", "current")):
        module = loaded(MODELS[name])
        with pytest.raises(ValueError, match=f"terms of the {what}"):
            module.force(*still)
        assert np.isfinite(module.force(*still, **{what: (0.0, 0.0)})).all()


def bare(**factors: float) -> Model:
    """Return the profile's hull alone."""
    model = fitted("modulus", "decoupled", **factors)
    return replace(model, theta=0.0 * model.theta, intercept=np.zeros(3))


ONLY = (0.0, 0.0, 0.0)


def test_at_rest_there_is_no_force_but_the_constant() -> None:
    assert loaded(bare()).force(ONLY, ONLY, 1.0) == (0.0, 0.0, 0.0)
    module = loaded(replace(bare(), intercept=np.array([3.0, -4.0, 0.5])))
    assert module.force(ONLY, ONLY, 1.0) == (3.0, -4.0, 0.5)


def test_ahead_at_a_steady_speed_there_is_damping_alone() -> None:
    drag = 27.632 * 1.5 + 110.064 * 1.5**2 + 13.965 * 1.5**3
    found = loaded(bare(delta=0.3, sigma=2.0, zeta=0.8)).force(ONLY, (1.5, 0.0, 0.0), -2.0)
    np.testing.assert_allclose(found, [2.0 * drag / 0.8, 0.0, 0.0], rtol=1e-12)


def test_drifting_with_the_water_takes_no_force() -> None:
    # North-east on a heading of 30 degrees, as fast as the water.
    psi, north, east = np.radians(30.0), 0.6, 0.8
    nu = (np.cos(psi) * north + np.sin(psi) * east, np.cos(psi) * east - np.sin(psi) * north, 0.0)
    np.testing.assert_allclose(loaded(bare()).force(ONLY, nu, psi, None, (north, east)), ONLY, atol=1e-9)


def test_a_wind_pushes_to_where_it_goes() -> None:
    module = loaded(bare())
    # Pressure of 10 m/s on 2.9 m² with a drag of 0.5, and on 8.6 m² with 0.9 (thesis, Table 4.2).
    pressure = 0.5 * 1.225 * 100.0
    to_north = module.force(ONLY, ONLY, 0.0, (10.0, 0.0))
    np.testing.assert_allclose(to_north, [-pressure * 0.5 * 2.9, 0.0, 0.0], atol=1e-9)
    to_starboard = module.force(ONLY, ONLY, 0.0, (0.0, 10.0))
    np.testing.assert_allclose(to_starboard, [0.0, -pressure * 0.9 * 8.6, 0.0], atol=1e-9)


def test_a_payload_takes_its_mass_times_its_acceleration() -> None:
    module = loaded(bare(zeta=0.5))
    empty, full = (module.force((0.0, 0.2, 0.1), ONLY, 0.0, None, None, load) for load in (None, (100.0, 2.0)))
    # It stands 2 m ahead, where the hull moves aside by 0.2 + 2 * 0.1 m/s²; zeta divides that force too.
    np.testing.assert_allclose(np.subtract(full, empty), [0.0, 80.0, 160.0], rtol=1e-12)
    np.testing.assert_allclose(
        np.subtract(module.mass((100.0, 2.0)), module.mass()), [[200, 0, 0], [0, 200, 400], [0, 400, 800]], rtol=1e-12
    )


def test_effects_on_the_hull_are_counted_in_and_others_are_numbers() -> None:
    module, text = loaded(MODELS["diagnosed"]), text_of(MODELS["diagnosed"])
    clean = loaded(replace(MODELS["diagnosed"], vessel_effects=()))
    hull = MODELS["diagnosed"].hull
    ahead = ((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), 0.0)
    more = module.force(*ahead)[0] - clean.force(*ahead)[0]
    assert more == pytest.approx(-0.8 * hull["X_|u|u"].value * 4.0)
    assert module.thruster_gain_thruster2_factor == 0.6
    assert module.azimuth_offset_thruster1_angle == 12.0
    assert module.heading_bias_angle == 2.0
    assert not hasattr(module, "fouling_surge")
    assert "thruster2 gives 60 % of the force" in " ".join(text.replace("#", " ").split())
    assert "steady wind of the log trial" in " ".join(text.replace("#", " ").split())


def test_a_mass_that_cannot_be_inverted_leaves_the_force() -> None:
    model = bare()
    theta = model.theta.copy()
    theta[model.terms.index("u_dot"), 0] = -2389.657
    one = exported(replace(model, theta=theta), SHA)
    assert any("cannot be inverted" in told for told in one.warnings())
    assert all((case.rate is None) == (case.payload is None) for case in one.cases)
    assert loaded(one.model).self_test() == 0
    theta[model.terms.index("u_dot"), 0] = -3000.0
    assert any("not positive definite" in told for told in exported(replace(model, theta=theta), SHA).warnings())


def test_a_mass_whose_axes_are_one_cannot_be_inverted() -> None:
    # Surge and sway take the same force for the same acceleration.
    model = fitted("modulus", "coupled")
    theta = 0.0 * model.theta
    rows = [model.terms.index(name) for name in ("u_dot", "v_dot", "r_dot")]
    theta[rows, 0] = 0.0, 2533.911, 62.386
    theta[rows, 1] = 2389.657, 0.0, 0.0
    one = exported(replace(model, theta=theta), SHA)
    assert any("cannot be inverted" in told for told in one.warnings())
    assert one.cases[0].rate is None
    assert loaded(one.model).self_test() == 0
