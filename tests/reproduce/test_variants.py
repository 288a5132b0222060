"""Changes of scenarios, and the small parts of studies that the page's sentences hang on."""

from __future__ import annotations

from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.identify.acceptance import force_mse
from ferryid.models.forces.estimator import model_estimator
from ferryid.reproduce.flight import Flight, controlled, fly, trial
from ferryid.reproduce.learning import BASE, MASTER, THESIS, hull_alone, learn, without_wind_areas
from ferryid.reproduce.studies import calm, flows, guidance, rounds
from ferryid.reproduce.studies.waves import kind_of
from ferryid.reproduce.study import number, percent
from ferryid.reproduce.variants import noiseless, prompt, rougher, stronger, windier


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    return fly(tmp_path_factory.mktemp("flight"), "windy", controlled(trial("experiment-1"), BASE), 1)


def test_weather_and_gains_are_multiplied_and_nothing_else_changes() -> None:
    scenario = trial("experiment-2")
    half = windier(scenario, 0.5)
    assert half.wind.north_mps == pytest.approx(-2.121 / 2)
    assert half.wind.east_mps == pytest.approx(-2.121 / 2)
    assert half.wind.gust_std_mps == pytest.approx(0.15)
    assert replace(half, wind=scenario.wind) == scenario
    triple = rougher(scenario, 3.0)
    assert triple.waves.significant_height_m == pytest.approx(0.3)
    assert [wake.height_m for wake in triple.wakes] == pytest.approx([0.45, 0.45])
    assert replace(triple, waves=scenario.waves, wakes=scenario.wakes) == scenario
    gains = stronger(scenario, 0.25).controller.gains
    assert gains.Kp == pytest.approx((50.0, 50.0, 175.0))
    assert gains.Kd == pytest.approx((175.0, 175.0, 550.0))
    assert gains.Ki == pytest.approx((2.0, 2.0, 6.25))


def test_sensors_without_noise_and_thrusters_without_lag() -> None:
    assert set(astuple(noiseless(trial("calm")).sensors.noise)) == {0.0}
    thrusters = prompt(trial("calm")).thrusters
    assert (thrusters.speed_lag_s, thrusters.azimuth_lag_s) == (0.0, 0.0)


@pytest.mark.slow
def test_a_model_learnt_without_wind_areas_stores_none(flight: Flight) -> None:
    assert flight.profile.wind is not None
    bare = without_wind_areas(flight.profile)
    assert bare.wind is None
    assert np.array_equal(bare.hull.M, flight.profile.hull.M)
    assert [one.name for one in bare.actuators] == [one.name for one in flight.profile.actuators]
    assert model_estimator(learn([flight.motion(1.0)], bare)).profile.wind is None


def test_which_third_functions_of_the_wind_are_odd() -> None:
    gamma = np.linspace(0.01, np.pi - 0.01, 50)
    even, wrapped, odd, double = (third for third in flows.THIRD.values())
    assert even(-gamma) == pytest.approx(even(gamma))
    assert odd(-gamma) == pytest.approx(-odd(gamma))
    assert double(-gamma) == pytest.approx(-double(gamma))
    # From 0 to 2 pi: its odd part is pi sin(gamma), another function of the basis.
    assert (wrapped(gamma) - wrapped(-gamma)) / 2 == pytest.approx(np.pi * np.sin(gamma))


@pytest.mark.slow
def test_a_constant_force_leaves_the_scatter_and_the_shift_of_the_mean(flight: Flight) -> None:
    motion, master = flight.motion(THESIS.window_s), hull_alone(flight.profile, MASTER)
    left = (motion.tau - master.of(motion))[motion.valid]
    # Where the same round stands for all three, the mean is taken off exactly.
    assert rounds._with_constant((flight, flight, flight), flight.profile) == pytest.approx(np.var(left, axis=0))


@pytest.mark.slow
def test_true_signals_in_a_calm_log_make_the_true_hull(tmp_path: Path) -> None:
    flight = fly(tmp_path, "noisy", controlled(trial("calm"), BASE), 1)
    silent = fly(tmp_path, "silent", controlled(noiseless(trial("calm")), BASE), 1)
    assert np.all(calm._noise(silent, 0.25) < 0.1)
    assert np.all(calm._noise(flight, 0.25)[1] > 0.2)
    settings = replace(THESIS, window_s=0.25)
    judged = flight.motion(1.0)
    unit = force_mse(hull_alone(flight.profile, MASTER), judged)
    errors = {what: force_mse(calm._model(flight, settings, what), judged) / unit for what in calm.REPLACED}
    assert np.all(errors["both"][:2] < 0.9 * errors["neither"][:2])
    assert errors["both"] == pytest.approx(np.ones(3), abs=0.05)


def test_responses_are_those_of_the_round_in_degrees(flight: Flight) -> None:
    body, ned = (guidance._response(flight, body=choice) for choice in (True, False))
    truth, control = flight.simulation.truth, flight.simulation.control
    assert body.panels[2].lines[0].y == pytest.approx(np.degrees(truth.nu[::25, 2]))
    assert ned.panels[2].lines[1].y == pytest.approx(np.degrees(control.eta_d[::10, 2]))
    assert ned.panels[0].lines[0].y == pytest.approx(truth.eta[::25, 0])
    assert (body.caption[-5:], ned.caption[-5:]) == ("5.17.", "5.18.")


def test_warnings_of_one_kind_differ_in_axis_unit_and_number() -> None:
    one = "In surge the log gives 305 kg (rigid body: 1.67e+03 kg), R² -1.30."
    other = "In yaw the log gives 4.28 kg·m² (rigid body: 4570 kg·m²), R² 0.2."
    assert kind_of(one) == kind_of(other)
    assert kind_of(one) != kind_of("In surge the model turns.")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-84.0, "−84"),
        (-24.21, "−24.2"),
        (240.4, "+240"),
        (0.004, "0.0"),
        (-0.04, "0.0"),
        (-0.47, "−0.5"),
        (99.97, "+100"),
    ],
)
def test_percentages_have_one_decimal_and_a_sign(value: float, text: str) -> None:
    assert percent(value) == text


def test_rounding_adds_no_digit() -> None:
    assert (number(99.98), number(9.997), number(0.99996)) == ("100", "10.0", "1.00")
    assert percent(3.14, "") == "3.1"
