"""From a log to measurements, and the plain force model of a profile or a model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import measure_log, read_measurements, window_lengths
from ferryid.diagnose.data.simulated import simulated
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.effects.force_model import COEFFICIENTS, Measurements, acceleration
from ferryid.effects.hull_spread import default_hull_spread
from ferryid.errors import FerryIdError
from ferryid.models.forces.estimator import model_estimator
from ferryid.models.model import Model
from ferryid.regression.bases.basis import make_basis
from ferryid.signals.stream import POSE_AND_VELOCITY
from ferryid.types import IN_MEMORY
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force
from tests.vessel.hull_matrices import forward

SHORT = str(Path(__file__).resolve().parents[3] / "fixtures" / "short.mcap")
FERRY = load_profile("milliampere")


@pytest.fixture(scope="module")
def short() -> Measurements:
    """The measurements of the short fixture, nothing smoothed."""
    return read_measurements(SHORT, FERRY, window_s=0.0)[0]


def model_of(
    structure: str, theta_of: Callable[[tuple[int, int]], np.ndarray], profile_text: str = FERRY.text
) -> Model:
    functions = make_basis("thesis", structure=structure)
    theta = np.where(functions.mask, theta_of(functions.mask.shape), 0.0)
    k = len(functions.terms)
    return Model(
        name="m",
        version=1,
        created="",
        ferryid_version="",
        profile_text=profile_text,
        scale={"delta": 1.1, "sigma": 0.8, "zeta": 1.05},
        settings={"basis": functions.name, "structure": structure, "window_s": 1.0},
        terms=functions.terms,
        units=functions.units,
        theta=theta,
        intercept=np.array([3.0, -4.0, 5.0]),
        low=theta,
        high=theta,
        intercept_low=np.zeros(3),
        intercept_high=np.zeros(3),
        covariance=np.tile(np.eye(k + 1), (3, 1, 1)),
        ranges={},
        training=(),
        scores=None,
        accepted=True,
    )


def test_each_thruster_pushes_along_its_angle_and_turns_by_its_lever(short: Measurements) -> None:
    assert short.parts.shape == (len(short.t), 2, 3)
    for k, lever_m in enumerate((1.8, -1.8)):
        surge, sway, moment = short.parts[:, k].T
        # A thruster may push astern along its angle, never across it.
        np.testing.assert_allclose(surge * np.sin(short.angles[:, k]), sway * np.cos(short.angles[:, k]), atol=1e-9)
        np.testing.assert_allclose(moment, lever_m * sway, atol=1e-9)


def test_the_thrusters_together_are_the_applied_force() -> None:
    measurements, survey = read_measurements(SHORT, FERRY, window_s=0.0)
    assert survey.motion is not None
    rows = survey.motion.valid & measurements.usable
    np.testing.assert_allclose(measurements.parts.sum(axis=1)[rows], survey.motion.tau[rows], atol=1e-9)


def test_the_velocity_is_kept_as_measured_beside_the_calmer_one() -> None:
    measurements, survey = read_measurements(SHORT, FERRY)
    assert survey.motion is not None
    np.testing.assert_array_equal(measurements.nu_raw[measurements.usable], survey.motion.raw_nu[measurements.usable])
    assert np.isfinite(measurements.nu).all()
    rough, calm = (np.abs(np.diff(values, axis=0)).mean(axis=0) for values in (measurements.nu_raw, measurements.nu))
    assert np.all(calm < rough)


@pytest.mark.slow
def test_a_withheld_wind_is_hidden_and_kept() -> None:
    seen, _ = read_measurements(SHORT, FERRY, window_s=0.0)
    assert seen.wind is not None
    blind, survey = read_measurements(SHORT, FERRY, window_s=0.0, withhold=("wind",))
    assert blind.wind is None
    assert survey.motion is not None
    assert survey.motion.wind is None
    np.testing.assert_array_equal(survey.hidden["wind"][: len(seen.t)][seen.usable], seen.wind[seen.usable])


@pytest.mark.parametrize(("what", "told"), [("wimd", 'Did you mean "wind"?'), ("heading", "choose one of")])
def test_what_cannot_be_withheld_is_refused(what: str, told: str) -> None:
    with pytest.raises(FerryIdError, match="--withhold") as caught:
        read_measurements(SHORT, FERRY, withhold=(what,))
    assert told in str(caught.value)


def test_what_the_log_does_not_have_cannot_be_withheld(shared_data: Callable[[str], Path]) -> None:
    log = shared_data("kvlcc2/HSVA_CPMC_KVLCC2_Z_10_05.dat")
    with pytest.raises(FerryIdError, match="wind cannot be withheld"):
        read_measurements(str(log), load_profile("kvlcc2-model"), withhold=("wind",))


def test_a_vessel_without_actuators_is_refused() -> None:
    with pytest.raises(FerryIdError, match="no actuator in the profile"):
        read_measurements(SHORT, replace(FERRY, actuators=()))


def test_the_plain_force_model_moves_as_the_hull_in_the_measured_wind(short: Measurements) -> None:
    force_model, spread = prior_force_model(replace(short, current=None, payload=None), FERRY)
    assert FERRY.wind is not None
    assert short.wind is not None
    tau = short.parts.sum(axis=1) + wind_force(FERRY.wind, short.wind, short.psi, short.nu)
    np.testing.assert_allclose(acceleration(force_model), forward(FERRY.hull, short.nu, tau), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(spread, 0.12 * np.abs(force_model.hull))


def test_without_wind_the_air_is_still(short: Measurements) -> None:
    force_model, _ = prior_force_model(replace(short, wind=None, current=None, payload=None), FERRY)
    assert FERRY.wind is not None
    # Still air meets a vessel from ahead.
    assert np.all(force_model.external[short.nu[:, 0] > 0.1, 0] < 0.0)


@pytest.mark.parametrize("weather", [False, True])
def test_a_model_becomes_a_force_model_of_the_same_force(short: Measurements, weather: bool) -> None:
    def around(shape: tuple[int, int]) -> np.ndarray:
        return 30.0 * np.random.default_rng(1).standard_normal(shape)

    measurements = replace(short, payload=None, current=None, wind=short.wind if weather else None)
    model = model_of("decoupled", around)
    force_model, spread = prior_force_model(measurements, FERRY, model)
    nu_dot = acceleration(force_model)
    needed = model_estimator(model)(nu_dot, measurements.nu, measurements.psi, measurements.wind, None)
    np.testing.assert_allclose(needed, measurements.parts.sum(axis=1), atol=1e-6)
    fitted = dict(zip(COEFFICIENTS, force_model.hull, strict=True))
    surge = model.theta[:, 0]
    assert fitted["m11"] == pytest.approx(1.1 / 1.05 * FERRY.hull.M[0, 0] + surge[model.terms.index("u_dot")])
    assert fitted["X_u"] == pytest.approx(0.8 / 1.05 * FERRY.hull.D["X_u"] - surge[model.terms.index("u")])
    # Two columns of the basis stand for X_|u|u, and the covariance of a sum of independent ones is 2.
    place = COEFFICIENTS.index("X_|u|u")
    assert spread[place] == pytest.approx(np.hypot(0.12 * fitted["X_|u|u"], np.sqrt(2.0)))


def test_a_model_that_couples_surge_inertia_is_refused(short: Measurements) -> None:
    with pytest.raises(FerryIdError, match="--structure decoupled"):
        prior_force_model(short, FERRY, model_of("coupled", np.ones))


def test_a_model_of_another_vessel_is_refused(short: Measurements) -> None:
    other = model_of("decoupled", np.zeros, load_profile("revolt").text)
    with pytest.raises(FerryIdError, match="does not apply to"):
        prior_force_model(short, FERRY, other)


def test_windows_follow_froude() -> None:
    assert window_lengths(FERRY) == pytest.approx((8.0, 2.0))
    longer = replace(FERRY, hull=replace(FERRY.hull, length_m=20.0))
    assert window_lengths(longer) == pytest.approx((16.0, 4.0))


@pytest.mark.parametrize("vessel", ["milliampere-2025", "esso-osaka", "gunnerus", "kvlcc2-model", "vtec-usv"])
def test_a_hull_without_a_model_may_have_any_damping(short: Measurements, vessel: str) -> None:
    spread = default_hull_spread(load_profile(vessel), short.nu)
    assert spread.shape == (len(COEFFICIENTS),)
    assert np.all(np.isfinite(spread) & (spread > 0.0))


def test_a_tanker_may_lift_as_tankers_do_and_a_known_hull_as_it_is_known(short: Measurements) -> None:
    # Kijima et al. (1990) with the KVLCC2's length, breadth, draught and block coefficient.
    tanker = load_profile("kvlcc2-model")
    L, T = tanker.hull.length_m, tanker.hull.draught_m
    plate = 0.5 * 1000.0 * L * T
    spread = dict(zip(COEFFICIENTS, default_hull_spread(tanker, short.nu), strict=True))
    usual = {"Y_uv": 0.4 * plate, "Y_ur": 0.08 * plate * L, "N_uv": 0.13 * plate * L, "N_ur": 0.05 * plate * L**2}
    for name, value in usual.items():
        assert 0.3 * value < spread[name] < 5.0 * value, name
    assert prior_force_model(short, FERRY)[1][-4:].tolist() == [0.0, 0.0, 0.0, 0.0]


def test_broad_beliefs_hold_what_was_measured_of_a_ferry(short: Measurements) -> None:
    # Table 4.1 was identified on the real vessel: nothing of it may lie far outside what its size alone lets one believe.
    spread = default_hull_spread(FERRY, short.nu)
    known = np.array([0.0, *([0.0] * 4), *(FERRY.hull.D.get(name, 0.0) for name in COEFFICIENTS[5:])])
    rigid = np.array([FERRY.hull.mass_kg, FERRY.hull.mass_kg, 0.0, 0.0, FERRY.hull.inertia_z])
    known[:5] = np.array([2389.657, 2533.911, 62.386, 28.141, 5068.91]) - rigid
    assert np.all(np.abs(known) < 5.0 * spread)


def test_a_tanker_with_propeller_and_rudder_is_measured(shared_data: Callable[[str], Path]) -> None:
    log = shared_data("esso_osaka/random/random_06-Aug-2020_16_24_25_1.csv")
    profile = load_profile("esso-osaka")
    measurements, survey = read_measurements(str(log), profile, withhold=("wind",), window_s=0.0)
    assert survey.motion is not None
    rows = survey.motion.valid & measurements.usable
    np.testing.assert_allclose(measurements.parts.sum(axis=1)[rows], survey.motion.tau[rows], atol=1e-9)
    assert np.isnan(measurements.angles).all()
    assert np.isfinite(survey.hidden["wind"]).mean() > 0.9


def test_a_log_of_a_campaign_keeps_what_is_needed_again_alone() -> None:
    whole, survey = read_measurements(SHORT, FERRY)
    kept = measure_log(SHORT, FERRY, IN_MEMORY)
    np.testing.assert_array_equal(kept.measurements.nu, whole.nu)
    assert kept.survey.motion is None
    assert kept.survey.used == survey.used
    assert survey.motion is not None
    assert kept.survey.used.rows == np.count_nonzero(survey.motion.valid)
    recording, streams = survey.recording, kept.survey.recording.streams
    assert (kept.survey.recording.start_ns, kept.survey.recording.end_ns) == (recording.start_ns, recording.end_ns)
    samples = {name: len(one.time_ns) for one in streams.values() for name in one.columns}
    assert {"x", "y", "psi", "u", "v"} <= set(samples) <= set(POSE_AND_VELOCITY)
    assert all(len(one.time_ns) <= 2 for one in streams.values() if not one.columns)
    assert simulated(kept.survey.recording, whole) == simulated(recording, whole)
