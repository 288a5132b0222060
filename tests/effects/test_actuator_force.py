"""Dead band, astern asymmetry and saturation of one actuator, against values worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ferryid.effects import effects
from ferryid.effects.actuator_force import along, curve_force, force_limits
from ferryid.effects.force_model import ForceModel, Measurements, hull_of
from ferryid.types import Floats
from ferryid.vessel import load_profile, parse_profile
from ferryid.vessel.profile import Profile
from ferryid.vessel.thrusters import force_at
from tests.effects import fixed_propellers

OF_ACTUATORS = ("dead_band", "astern_asymmetry", "thrust_saturation")
AHEAD, ASTERN = 4.5e-4, 3.0e-4
"""Thrust coefficients of the vessel [N/rpm²]; its speeds end at 1050 rpm, and so its forces at 496 and 331 N."""


@cache
def vessel() -> Profile:
    return parse_profile(fixed_propellers.text(), "fixed")


def turning(speeds: Floats, profile: Profile | None = None) -> ForceModel:
    """Return the force model of a vessel at rest whose first propeller turns at these speeds and the others do not."""
    profile = profile or vessel()
    n = len(speeds)
    force = np.where(speeds >= 0.0, AHEAD, ASTERN) * speeds * np.abs(speeds)
    parts = np.zeros((n, len(profile.actuators), 3))
    parts[:, 0] = force_at(profile.actuators[0], force, 0.0)
    measurements = Measurements(
        profile=profile,
        t=0.1 * np.arange(n),
        eta=np.zeros((n, 3)),
        nu_raw=np.zeros((n, 3)),
        nu=np.zeros((n, 3)),
        parts=parts,
        angles=np.full(parts.shape[:2], np.nan),
        usable=np.ones(n, dtype=np.bool_),
    )
    return ForceModel(measurements, hull_of(profile), parts, measurements.angles, np.zeros((n, 3)))


def left(effect: str, p: tuple[float, ...], speeds: list[float]) -> Floats:
    """Return the force along the first propeller with an effect of it [N]."""
    return along(effects()[effect].apply(turning(np.array(speeds)), np.array(p), "port"), 0)


def neutral(effect: str) -> Floats:
    return np.array([one.neutral for one in effects()[effect].parameters_of(vessel())])


@pytest.mark.parametrize("effect", OF_ACTUATORS)
def test_a_neutral_effect_changes_no_force_up_to_the_ends_of_the_curve(effect: str) -> None:
    before = turning(np.linspace(-1050.0, 1050.0, 211))
    after = effects()[effect].apply(before, neutral(effect), "port")
    np.testing.assert_allclose(after.parts, before.parts, rtol=1e-12)


@pytest.mark.parametrize("effect", OF_ACTUATORS)
def test_only_its_own_actuator_is_changed_and_its_moment_in_proportion(effect: str) -> None:
    before = turning(np.array([-900.0, -120.0, 120.0, 900.0]))
    p = {"dead_band": (200.0, 200.0), "astern_asymmetry": (0.5,), "thrust_saturation": (100.0, 100.0)}[effect]
    here, elsewhere = (effects()[effect].apply(before, np.array(p), name).parts for name in ("port", "bow"))
    assert not np.array_equal(here[:, 0], before.parts[:, 0])
    np.testing.assert_array_equal(here[:, 1:], before.parts[:, 1:])
    np.testing.assert_array_equal(elsewhere, before.parts)
    # One metre to port: a push ahead turns to starboard.
    np.testing.assert_allclose(here[:, 0, 2], 1.0 * here[:, 0, 0])


def test_the_side_force_of_a_rudder_stays() -> None:
    port = replace(vessel().actuators[0], kind="propeller_rudder")
    ruddered = replace(vessel(), actuators=(port, *vessel().actuators[1:]))
    before = turning(np.array([-500.0, 500.0]), ruddered)
    before.parts[:, 0] += [0.0, 20.0, -30.0]
    after = effects()["astern_asymmetry"].apply(before, np.array([0.6]), "port").parts[:, 0]
    # Of 75 N astern, one metre to port, 45 N are left: 30 N·m less to port.
    np.testing.assert_allclose(after - before.parts[:, 0], [[30.0, 0.0, 30.0], [0.0, 0.0, 0.0]], atol=1e-9)


def test_a_dead_band_takes_all_within_and_nothing_beyond_each_side_by_itself() -> None:
    speeds = [100.0, 150.0, 200.0, 250.0, 251.0, -200.0, -300.0, -375.0, -400.0]
    share = [0.0, 0.0, 0.5, 1.0, 1.0, 0.0, 0.5, 1.0, 1.0]
    plain = along(turning(np.array(speeds)), 0)
    np.testing.assert_allclose(left("dead_band", (200.0, 300.0), speeds), np.array(share) * plain, atol=0.3)


def test_a_dead_band_of_a_force_that_is_ordered_is_one_of_that_force() -> None:
    direct = replace(vessel(), actuators=tuple(replace(one, kind="force", thrust=None) for one in vessel().actuators))
    assert [one.unit for one in effects()["dead_band"].parameters_of(direct)] == ["N", "N"]
    model = turning(np.array([100.0, 200.0, -200.0]), direct)
    # Forces of 4.5, 18 and -12 N.
    after = effects()["dead_band"].apply(model, np.array([10.0, 12.0]), "port")
    np.testing.assert_allclose(along(after, 0), [0.0, 18.0, -6.0], atol=1e-9)


def test_astern_asymmetry_leaves_ahead_as_it_is() -> None:
    np.testing.assert_allclose(left("astern_asymmetry", (0.6,), [500.0, -500.0, 0.0]), [112.5, -45.0, 0.0])


def test_saturation_cuts_off_at_its_limits() -> None:
    # 90, 360 and -270 N; half-way through the bend of 10 N a quarter of it is missing.
    forces = left(
        "thrust_saturation", (200.0, 100.0), [np.sqrt(90.0 / AHEAD), np.sqrt(360.0 / AHEAD), -np.sqrt(270.0 / ASTERN)]
    )
    np.testing.assert_allclose(forces, [90.0, 200.0, -100.0])
    (within,) = left("thrust_saturation", (200.0, 100.0), [np.sqrt(200.0 / AHEAD)])
    assert within == pytest.approx(200.0 - 10.0**2 / 40.0)


@pytest.mark.parametrize("effect", ["dead_band", "thrust_saturation"])
def test_the_same_ahead_and_astern_is_symmetric(effect: str) -> None:
    same = parse_profile(fixed_propellers.text().replace("astern = 3.0e-4", "astern = 4.5e-4"), "same")
    speeds = np.linspace(20.0, 1000.0, 50)
    forces = AHEAD * speeds**2
    model = turning(speeds, same)
    there, back = (
        replace(model, parts=sign * model.parts, measurements=replace(model.measurements, parts=sign * model.parts))
        for sign in (1.0, -1.0)
    )
    p = np.array([180.0, 180.0])
    one, other = (along(effects()[effect].apply(each, p, "port"), 0) for each in (there, back))
    np.testing.assert_allclose(one, -other)
    assert (one < forces - 1.0).any()


def test_force_limits_are_those_of_the_curve() -> None:
    assert force_limits(vessel().actuators[0]) == pytest.approx((AHEAD * 1050.0**2, ASTERN * 1050.0**2))
    assert curve_force(vessel().actuators[0], np.array([-200.0])) == pytest.approx([-12.0])


SWINGING = 700.0 * np.sin(np.linspace(0.0, 60.0, 3000))


@pytest.mark.parametrize(
    ("effect", "speeds", "reason"),
    [
        ("astern_asymmetry", np.abs(SWINGING), "no actuator ran astern"),
        ("astern_asymmetry", -np.abs(SWINGING), "both ahead and astern"),
        ("dead_band", 600.0 + 0.1 * SWINGING, "near zero"),
        ("dead_band", 0.2 * SWINGING, "well above it"),
        ("dead_band", 0.0 * SWINGING, "near zero"),
        ("thrust_saturation", 0.5 * SWINGING, "varied its force about 30 %"),
        ("thrust_saturation", 0.0 * SWINGING + 900.0, "varied its force about 30 %"),
    ],
)
def test_what_a_log_does_not_show_of_any_actuator_is_not_tested(effect: str, speeds: Floats, reason: str) -> None:
    measurements = turning(speeds).measurements
    assert reason in effects()[effect].untestable(measurements)
    assert effects()[effect].testable_instances(measurements) == ()


@pytest.mark.parametrize("effect", OF_ACTUATORS)
def test_what_a_log_shows_is_tested_of_that_actuator_only(effect: str) -> None:
    measurements = turning(SWINGING).measurements
    assert effects()[effect].untestable(measurements) == ""
    assert effects()[effect].testable_instances(measurements) == ("port",)


@pytest.mark.parametrize("effect", OF_ACTUATORS)
def test_a_force_that_is_measured_has_it_already(effect: str) -> None:
    signals = tuple(replace(one, quantity=one.quantity.replace(".speed", ".force")) for one in vessel().signals)
    measured = replace(turning(SWINGING).measurements, profile=replace(vessel(), signals=signals))
    assert effects()[effect].instances(measured.profile) == ()
    assert effects()[effect].untestable(measured)


def test_sides_that_a_log_does_not_show_are_not_reported() -> None:
    band, limit = effects()["dead_band"], effects()["thrust_saturation"]
    measurements, free = turning(SWINGING).measurements, neutral("thrust_saturation")
    assert band.unreported(measurements, np.array([150.0, 0.0])) == {"astern"}
    assert band.unreported(measurements, np.zeros(2)) == frozenset()
    assert limit.unreported(measurements, np.array([150.0, free[1]])) == {"astern"}
    assert limit.says({"ahead": 150.0}, "port") == "port gives no more than 150 N ahead."
    assert band.says({"ahead": 150.0, "astern": 90.0}, "port") == (
        "port gives no force until its order exceeds 150 ahead and 90 astern."
    )


@pytest.mark.parametrize("effect", OF_ACTUATORS)
def test_the_simulated_thruster_does_what_the_estimate_assumes(effect: str) -> None:
    p = {"dead_band": [200.0, 300.0], "astern_asymmetry": [0.5], "thrust_saturation": [150.0, 100.0]}[effect]
    speeds = np.linspace(-1000.0, 1000.0, 81)
    hook = effects()[effect].simulated
    assert hook is not None
    assert hook.thrust is not None
    plain = along(turning(speeds), 0)
    simulated = [hook.thrust(p, speed, force) for speed, force in zip(speeds.tolist(), plain.tolist(), strict=True)]
    # A bend of 5 % about a limit is not simulated.
    np.testing.assert_allclose(simulated, left(effect, tuple(p), speeds.tolist()), atol=2.0)


def test_the_force_along_an_azimuth_thruster_follows_the_angle_that_an_effect_gives_it() -> None:
    ferry = load_profile("milliampere")
    n, angle = 3, 0.4
    parts = np.zeros((n, 2, 3))
    parts[:, 0] = force_at(ferry.actuators[0], np.full(n, 100.0), np.full(n, angle))
    still = np.zeros((n, 3))
    t = 0.1 * np.arange(n)
    measurements = Measurements(ferry, t, still, still, still, parts, np.full((n, 2), angle), np.ones(n, dtype=bool))
    before = ForceModel(measurements, hull_of(ferry), parts, measurements.angles, still)
    assert along(before, 0) == pytest.approx(np.full(n, 100.0))
    offset = effects()["azimuth_offset"].apply(before, np.array([20.0]), ferry.actuators[0].name)
    # The force goes with the thruster, and is as large along it as before.
    assert along(offset, 0) == pytest.approx(np.full(n, 100.0))
