"""A weak propeller with a rudder behind it: the rudder feels the thrust that acts, as in the forces of the profile itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel, Measurements, hull_of
from ferryid.effects.measurements import actuator_forces, rudder_states
from ferryid.types import Floats
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile

TANKER, FERRY, CATAMARAN = (load_profile(name) for name in ("kvlcc2-model", "milliampere", "vtec-usv"))
N = 40


def measured(profile: Profile, columns: dict[str, Floats], current: Floats | None = None) -> Measurements:
    nu = np.column_stack([np.linspace(0.4, 1.2, N), np.linspace(-0.1, 0.1, N), np.linspace(-0.02, 0.02, N)])
    every = np.ones(N, dtype=bool)
    through_water = nu if current is None else nu - np.column_stack([current, np.zeros(N)])
    parts, angles = actuator_forces(profile, columns, through_water, every)
    return Measurements(
        profile=profile,
        t=np.asarray(0.2 * np.arange(N), dtype=np.float64),
        eta=np.zeros((N, 3)),
        nu_raw=nu,
        nu=nu,
        parts=parts,
        angles=angles,
        usable=every,
        current=current,
        rudders=rudder_states(profile, columns, through_water, every),
    )


def of(measurements: Measurements) -> ForceModel:
    return ForceModel(
        measurements, hull_of(measurements.profile), measurements.parts, measurements.angles, np.zeros((N, 3))
    )


def weak(measurements: Measurements, factor: float, name: str) -> Floats:
    return effects()["thruster_gain"].apply(of(measurements), np.array([factor]), name).parts


@pytest.mark.parametrize("factor", [0.0, 0.6, 1.0, 1.5])
@pytest.mark.parametrize("current", [None, np.tile([0.2, -0.1], (N, 1))], ids=["still", "current"])
def test_a_rudder_feels_the_thrust_that_acts(factor: float, current: Floats | None) -> None:
    columns = {"F_propeller": np.linspace(5.0, 40.0, N), "delta_propeller": np.linspace(-0.5, 0.5, N)}
    found = weak(measured(TANKER, columns, current), factor, "propeller")
    lower = measured(TANKER, columns | {"F_propeller": factor * columns["F_propeller"]}, current)
    np.testing.assert_allclose(found, lower.parts, rtol=1e-9, atol=1e-9)
    if factor == 0.6:
        # A rudder lives on the vessel's own flow too, so that it loses less than the propeller.
        share = found[-1, 0, 1] / measured(TANKER, columns, current).parts[-1, 0, 1]
        assert 0.6 < share < 0.95


def test_without_a_rudder_the_force_is_multiplied() -> None:
    columns = {
        f"{what}_thruster{k}": np.full(N, 0.3 * k + 100.0 * (what == "F")) for what in ("F", "alpha") for k in (1, 2)
    }
    columns |= {f"n_thruster{k}": np.full(N, 300.0) for k in (1, 2)}
    plain = measured(FERRY, columns)
    assert plain.rudders is None
    found = weak(plain, 0.7, "thruster2")
    np.testing.assert_allclose(found[:, 1], 0.7 * plain.parts[:, 1])
    np.testing.assert_array_equal(found[:, 0], plain.parts[:, 0])
    # Measurements that lack the states of their rudders, as those of rows that nobody recorded, have the share alone.
    bare = replace(measured(TANKER, {"F_propeller": np.full(N, 9.0), "delta_propeller": np.full(N, 0.1)}), rudders=None)
    np.testing.assert_allclose(weak(bare, 0.7, "propeller"), 0.7 * bare.parts)


def test_a_step_goes_from_a_level_that_is_not_the_thrust_curves() -> None:
    """Half of 160 % of the curve between 2 and 4 s."""
    columns = {f"n_thruster{k}": np.full(N, 300.0) for k in range(1, 3)}
    columns |= {f"alpha_thruster{k}": np.zeros(N) for k in range(1, 3)}
    measurements = measured(FERRY, columns)
    plain = ForceModel(measurements, hull_of(FERRY), measurements.parts, measurements.angles, np.zeros((N, 3)))
    step = effects()["thruster_gain"].step
    assert step is not None
    p = np.array([0.5, 1.6])
    found = step.act(plain, p, "thruster2", 2.0, 4.0).parts[:, 1, 0] / plain.parts[:, 1, 0]
    inside = (measurements.t >= 2.0) & (measurements.t < 4.0)
    np.testing.assert_allclose(found, np.where(inside, 0.8, 1.6))
    # Nothing else has changed, and a step that is none is a level.
    np.testing.assert_array_equal(step.act(plain, p, "thruster2", 2.0).parts[:, 0], plain.parts[:, 0])
    level = effects()["thruster_gain"].apply(plain, p[1:], "thruster2")
    np.testing.assert_allclose(step.act(plain, np.array([1.0, 1.6]), "thruster2", 2.0).parts, level.parts)


def test_a_factor_by_level_is_a_power_of_the_thrust_over_its_usual_size() -> None:
    by_level = effects()["thruster_gain"].by_level
    assert by_level is not None
    force = np.where(np.arange(N) % 2 == 0, 10.0, 40.0)
    columns = {"F_cmd_left": force, "F_cmd_right": np.full(N, 5.0)}
    plain = of(measured(CATAMARAN, columns))
    usual = np.sqrt(np.mean(force**2))
    after = by_level.apply(plain, np.array([0.9, -0.5]), "left").parts
    np.testing.assert_allclose(after[:, 0], plain.parts[:, 0] * (0.9 * (force / usual) ** -0.5)[:, None])
    np.testing.assert_array_equal(after[:, 1], plain.parts[:, 1])
    # Without a power it is the factor, of a thruster that stands still, too, and of a propeller with a rudder.
    np.testing.assert_allclose(
        by_level.apply(plain, np.array([0.9, 0.0]), "right").parts[:, 1], 0.9 * plain.parts[:, 1]
    )
    still = of(measured(CATAMARAN, columns | {"F_cmd_left": np.zeros(N)}))
    assert not by_level.apply(still, np.array([0.9, -0.5]), "left").parts[:, 0].any()
    ruddered = {"F_propeller": np.linspace(5.0, 40.0, N), "delta_propeller": np.linspace(-0.5, 0.5, N)}
    same = by_level.apply(of(measured(TANKER, ruddered)), np.array([0.6, 0.0]), "propeller").parts
    np.testing.assert_allclose(same, weak(measured(TANKER, ruddered), 0.6, "propeller"))


def test_a_factor_that_is_not_zero_is_not_said_to_be() -> None:
    gain = effects()["thruster_gain"]
    assert gain.says({"factor": 0.001}, "port") == "port gives less than 1 % of the force of its thrust curve."
    assert gain.says({"factor": 0.0}, "port") == "port gives 0 % of the force of its thrust curve."
    assert gain.says({"factor": 0.6}, "port") == "port gives 60 % of the force of its thrust curve."
