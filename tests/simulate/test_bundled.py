"""What the titles of bundled scenarios promise."""

from __future__ import annotations

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from ferryid.simulate import load_scenario, simulate
from ferryid.simulate.plant.hull import hull_load, hydrodynamics
from ferryid.simulate.trial import sail
from ferryid.vessel.load import load_profile

FERRY = load_profile("milliampere")


@pytest.mark.parametrize("name", ["rpm-steps", "turning-circle", "zigzag"])
def test_straight_ahead_is_straight(name):
    scenario = load_scenario(name)
    truth, _ = sail(scenario, FERRY, scenario.seed)
    lead_s = scenario.duration_s if name == "rpm-steps" else scenario.manoeuvre.lead_s
    lead = truth.t < lead_s
    assert np.abs(truth.nu[lead, 0]).max() > 1.0
    assert np.abs(truth.eta[lead, 1:]).max() < 1e-9


def test_the_zigzag_overshoots_as_the_hull_keeps_no_course():
    # Linearised about straight ahead at 1 m/s, one of the two modes of sway and yaw grows.
    p, step = hydrodynamics(FERRY.hull), 1e-7
    slopes = [np.array(hull_load(p, 1.0, *direction)[1:]) / step for direction in ((step, 0.0), (0.0, step))]
    modes = np.linalg.eigvals(-np.linalg.solve(FERRY.hull.M[1:, 1:], np.column_stack(slopes)))
    assert modes.real.max() == pytest.approx(0.137, abs=0.01)
    truth, _ = sail(load_scenario("zigzag"), FERRY, 1)
    later = np.degrees(truth.eta[truth.t > 100.0, 2])
    assert later.max() - 20.0 == pytest.approx(70.0, abs=5.0)
    assert later.min() + 20.0 == pytest.approx(-70.0, abs=5.0)


def test_the_delays_of_navigation_errors_add_up():
    """By its stamps a thruster is 0.12 s ahead of the truth and the navigation 0.15 s behind it: 0.27 s apart."""
    simulation = simulate(replace(load_scenario("navigation-errors"), duration_s=150.0))
    truth, streams = simulation.truth, {stream.topic: stream for stream in simulation.streams}

    def shift(stream, values, true):
        t = (stream.stamp_ns - simulation.scenario.start_ns) * 1e-9
        shifts = np.arange(-0.4, 0.4, 0.01)
        misses = [np.square(values - np.interp(t + d, truth.t, true)).mean() for d in shifts]
        return shifts[int(np.argmin(misses))]

    state, odometry = streams["/thruster1/state"], streams["/navigation/odometry"]
    q = [odometry.columns[f"pose.pose.orientation.{axis}"] for axis in "zw"]
    heading = np.unwrap(2.0 * np.arctan2(*q)) - radians(2.0)
    ahead = shift(state, state.columns["speed"], truth.speeds[:, 0])
    behind = shift(odometry, heading, truth.eta[:, 2])
    assert ahead == pytest.approx(0.12, abs=0.02)
    assert behind == pytest.approx(-0.15, abs=0.05)


@pytest.mark.parametrize(("name", "number"), [("twelve-corner-gusty", 1), ("twelve-corner-waves", 2)])
def test_titles_promise_the_weather_alone(name, number):
    assert load_scenario(name).title.endswith(f"the weather of Experiment {number}")
