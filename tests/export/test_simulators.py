"""Models for Gazebo and PX4: driven by the equations of their plugins, a vessel goes where ferryid's own goes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from ferryid.export.exported import Exported, exported
from ferryid.export.formats import formats
from ferryid.export.planar_terms import planar_terms
from ferryid.models.forces import Estimator
from tests.export import simulators
from tests.export.models import MODELS, SHA

FLU = np.array([1.0, -1.0, -1.0])
STEP_S = 0.1


def of(force: Estimator) -> simulators.Acceleration:
    """Return ferryid's own acceleration, in FRD."""
    inverse = np.linalg.inv(
        np.array([force(np.eye(3)[k : k + 1], *still())[0] - force(np.zeros((1, 3)), *still())[0] for k in range(3)]).T
    )
    return lambda nu, tau: inverse @ (tau - force.at_constant_velocity(nu[None])[0])


def still() -> tuple[np.ndarray, ...]:
    return np.zeros((1, 3)), np.zeros(1), None, None


def manoeuvre(one: Exported, count: int = 600) -> np.ndarray:
    """Return forces in FRD that speed the vessel up and turn it both ways, shape (n, 3)."""
    t = np.arange(count) * STEP_S
    m = one.force.profile.hull.mass_kg
    size = one.force.profile.hull.length_m
    return m * np.column_stack([0.06 + 0.0 * t, 0.02 * np.sin(0.2 * t), 0.01 * size * np.sin(0.11 * t)])


def plain_hull(**changes: object) -> Exported:
    """Return a model of a hull alone that Gazebo can hold to the last term: no cubes, and a symmetric mass matrix."""
    one = exported(MODELS["no basis"], SHA)
    hull = one.force.profile.hull
    mass = hull.M.copy()
    mass[1, 2] = mass[2, 1] = 150.0
    damping = {name: value for name, value in hull.D.items() if name[2:] not in ("uuu", "vvv", "rrr")}
    changed = replace(
        hull, M=mass, D=damping | {"Y_uv": -40.0, "N_ur": -30.0}, x_g_m=0.2, inertia_z=hull.inertia_z + 67.0
    )
    return replace(one, force=replace(one.force, profile=replace(one.force.profile, hull=replace(changed, **changes))))


def apart(one: Exported, by: simulators.Acceleration) -> tuple[float, float]:
    """Return the greatest distance between the paths, and the length of that of ferryid [m]."""
    forces = manoeuvre(one)
    ned = simulators.path(of(one.force), forces, STEP_S)
    # North and east of a body that begins north are east's and north's x and y of one that begins east.
    enu = simulators.path(by, forces * FLU, STEP_S)
    found = enu * FLU
    assert np.hypot(*np.diff(ned[:, :2], axis=0).T).sum() > 20.0
    assert np.ptp(ned[:, 2]) > 1.0
    return float(np.hypot(*(found - ned)[:, :2].T).max()), float(np.hypot(*np.diff(ned[:, :2], axis=0).T).sum())


@pytest.mark.slow
def test_gazebo_goes_where_ferryid_goes() -> None:
    one = plain_hull()
    text = formats()["gazebo"].render(one)
    distance, _ = apart(one, simulators.gazebo(text))
    assert distance < 1e-6
    assert formats()["gazebo"].check(one, text)["missing"] == []


@pytest.mark.slow
def test_gazebo_takes_learned_terms_and_a_factor_on_the_force() -> None:
    """Quadratic terms of any sign and pair, and masses that were learned beside those of the hull."""
    made = plain_hull()
    learned = exported(MODELS["second order"], SHA)
    assert learned.force.basis is not None
    small = 0.05 * learned.force.theta
    # The masses stay symmetric.
    for row, term in zip(small, learned.force.basis.functions, strict=True):
        if term.name.endswith("_dot"):
            row[:] = 0.0
    force = replace(made.force, basis=learned.force.basis, theta=small, intercept=np.zeros(3), scale={"zeta": 1.2})
    one = replace(made, force=force)
    terms, beyond = planar_terms(one)
    assert beyond == ()
    assert np.abs(terms.product).max() > 0.0
    distance, _ = apart(one, simulators.gazebo(formats()["gazebo"].render(one)))
    assert distance < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(("form", "most"), [("gazebo", 0.01), ("px4", 0.15)])
def test_what_a_plugin_has_no_term_for_costs_what_it_states(form: str, most: float) -> None:
    one = exported(MODELS["no basis"], SHA)
    text = formats()[form].render(one)
    distance, length = apart(one, getattr(simulators, form)(text))
    assert 0.0 < distance < most * length
    # The stated share, by equations that are written apart.
    rng = np.random.default_rng(0)
    low, high = np.array([[-0.5, -0.4, -0.2], [1.25, 0.4, 0.2]])
    nu = rng.uniform(low, high, size=(4000, 3))
    mass = np.linalg.inv(np.array([getattr(simulators, form)(text)(np.zeros(3), row) for row in np.eye(3)]).T)
    by = getattr(simulators, form)(text)
    found = np.array([-(mass @ by(row * FLU, np.zeros(3))) for row in nu]) * FLU
    wanted = one.force.at_constant_velocity(nu)
    share = np.sqrt(((found - wanted) ** 2).mean(axis=0) / (wanted**2).mean(axis=0))
    stated = formats()[form].check(one, text)["error_share"]["velocity"]
    assert share == pytest.approx(np.array(list(stated.values())), rel=0.15, abs=1e-3)


def test_px4_is_ferryid_straight_ahead() -> None:
    one = plain_hull()
    forces = manoeuvre(one) * (1.0, 0.0, 0.0)
    by = simulators.px4(formats()["px4"].render(one))
    ned, enu = simulators.path(of(one.force), forces, STEP_S), simulators.path(by, forces * FLU, STEP_S)
    assert enu[-1, 0] > 20.0
    assert enu[:, 0] == pytest.approx(ned[:, 0], rel=1e-9)


def test_px4_floats_with_its_origin_in_the_waterline() -> None:
    one = exported(MODELS["no basis"], SHA)
    plugin = ET.fromstring(formats()["px4"].render(one)).find("model/plugin")
    assert plugin is not None
    get = {
        key: float(simulators.text(plugin, key)) for key in ("hullRadius", "waterLevel", "waterDensity", "boatLength")
    }
    radius, depth = get["hullRadius"], get["waterLevel"]
    segment = radius**2 * np.arccos((radius - depth) / radius) - (radius - depth) * np.sqrt(
        2 * radius * depth - depth**2
    )
    assert 2.0 * segment * get["boatLength"] * get["waterDensity"] == pytest.approx(
        2509.1, abs=0.1
    )  # the mass ahead, with the water


def test_a_plugin_that_would_run_away_is_announced() -> None:
    one = plain_hull()
    assert "runs away" not in formats()["px4"].render(one)
    mass = one.force.profile.hull.M.copy()
    mass[1, 1] = 3.1 * one.force.profile.hull.mass_kg
    assert "yDotV is not below the mass of the link" in formats()["px4"].render(plain_hull(M=mass))


def test_thrusters_push_where_the_profile_has_them() -> None:
    one = exported(MODELS["no basis"], SHA)
    model = ET.fromstring(formats()["gazebo"].render(one)).find("model")
    assert model is not None
    assert model.findtext("link[@name='thruster2_azimuth']/pose") == "-1.8 0.0 0 0 0 0"
    plugins = model.findall("plugin[@filename='gz-sim-thruster-system']")
    assert [plugin.findtext("joint_name") for plugin in plugins] == ["thruster1_joint", "thruster2_joint"]
    joints = {joint.get("name") for joint in model.findall("joint")}
    assert joints == {f"thruster{k}{part}_joint" for k in (1, 2) for part in ("", "_azimuth")}
    # Thesis, equation (4.1), at full speed either way.
    most, least = (float(plugins[0].findtext(f"{end}_thrust_cmd") or "nan") for end in ("max", "min"))
    assert most == pytest.approx(496.8, abs=0.1)
    assert -290.0 < least < -280.0
    # The whole vessel weighs what its hull does.
    assert simulators.spatial_inertia(model)[0, 0] == pytest.approx(1670.0)


@pytest.mark.parametrize("vessel", ["esso-osaka", "gunnerus", "revolt", "vtec-usv", "kvlcc2-model"])
@pytest.mark.parametrize("form", ["gazebo", "px4"])
def test_every_bundled_vessel_can_be_exported(vessel: str, form: str) -> None:
    from ferryid.vessel import load_profile

    profile = load_profile(vessel)
    one = exported(MODELS["no basis"], SHA)
    one = replace(one, force=replace(one.force, profile=profile, scale={}), ranges=(("u", -0.5, 3.0, "m/s"),))
    model = ET.fromstring(formats()[form].render(one)).find("model")
    assert model is not None
    rigid = simulators.spatial_inertia(model)
    assert np.linalg.eigvalsh(rigid).min() > 0.0
    moment = profile.hull.mass_kg * profile.hull.x_g_m if form == "gazebo" else 0.5 * (one.mass[1, 2] + one.mass[2, 1])
    assert rigid[1, 5] == pytest.approx(moment, abs=1e-6 * profile.hull.mass_kg)
