"""Feedforward: the same force as the estimator of every model gives, and hand-worked limits."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import pi

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.files import dump_json
from ferryid.models.forces.estimator import Estimator, model_estimator
from ferryid.models.model import model_to_json
from ferryid.regression.bases.basis import BASES, CURRENT, STRUCTURES, WIND, Basis, make_basis, with_hull_length
from ferryid.regression.bases.term import DIMENSIONS, Term
from ferryid.simulate.control.feedforward import ahead_of, build_feedforward, feedforward_of
from ferryid.simulate.sections import Control, Sensors
from ferryid.vessel import load_profile

PROFILE = load_profile("milliampere")
SCALE = {"delta": 0.8, "sigma": 1.3, "zeta": 1.1}
STILL = (0.0, 0.0)
REST = (0.0, 0.0, 0.0)


def states(seed, n=8):
    rng = np.random.default_rng(seed)
    nu_dot, nu = rng.normal(size=(2, n, 3))
    wind, current = 4.0 * rng.normal(size=(n, 2)), rng.normal(size=(n, 2))
    payload = np.column_stack([rng.uniform(0, 500, n), rng.uniform(-2, 2, n)])
    return nu_dot, nu, rng.uniform(-9, 9, n), wind, current, payload


def assert_equal(estimated, measured, seed):
    """Compare with the estimator, whose force is summed in another order and with other elementary functions."""
    wind_on, current_on, payload_on = measured
    feedforward = feedforward_of(estimated, weather=wind_on, flow=current_on, load=payload_on)
    nu_dot, nu, psi, wind, current, payload = states(seed)
    expected = estimated(
        nu_dot,
        nu,
        psi,
        wind if wind_on else None,
        current if current_on else None,
        *((payload,) if payload_on else ()),
    )
    rows = zip(nu_dot, nu, psi, wind, current, payload, strict=True)
    found = [ahead_of(feedforward, *(tuple(part) if np.ndim(part) else float(part) for part in row)) for row in rows]
    # Terms cancel: the rounding is that of the largest.
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("name", "wind", "current", "structure"), [*product(BASES, (None, *WIND), (None, *CURRENT), STRUCTURES)]
)
def test_every_basis_gives_the_force_of_its_estimator(name, wind, current, structure):
    functions = make_basis(with_hull_length(name, 5.0, "test"), wind=wind, current=current, structure=structure)
    rng = np.random.default_rng(3)
    theta = np.where(functions.mask, 100.0 * rng.normal(size=functions.mask.shape), 0.0)
    for seed, (wind_on, current_on, payload_on) in enumerate(product((False, True), repeat=3)):
        if (wind_on or wind is None) and (current_on or current is None):
            estimated = Estimator(PROFILE, SCALE, functions, theta, rng.normal(size=3))
            assert_equal(estimated, (wind_on, current_on, payload_on), seed)


def test_vessels_without_wind_areas_leave_the_wind_to_the_terms():
    functions = make_basis("modulus", wind="paper")
    theta = np.random.default_rng(5).normal(size=functions.mask.shape)
    estimated = Estimator(replace(PROFILE, wind=None), SCALE, functions, theta, np.ones(3))
    assert_equal(estimated, (True, True, True), 1)


def test_every_factor_has_its_place():
    """Also those that no basis has used so far, and products of three of them."""
    names = list(DIMENSIONS)
    terms = [Term(" ".join(part), part, (0,)) for part in [(a,) for a in names] + [*zip(names, names[5:], names[9:])]]  # noqa: B905
    functions = Basis("all", "coupled", tuple(terms), np.ones((len(terms), 3), dtype=bool), length_m=5.0)
    theta = np.random.default_rng(7).normal(size=(len(terms), 3))
    assert_equal(Estimator(PROFILE, SCALE, functions, theta, np.zeros(3)), (True, True, False), 4)


def test_steady_run_against_a_current():
    """1 m/s over ground up a current of 0.5 m/s: damping of 1.5 m/s, and nothing across."""
    feedforward = feedforward_of(Estimator(PROFILE, {}), flow=True)
    tau = ahead_of(feedforward, REST, (1.0, 0.0, 0.0), pi / 2, STILL, (0.0, -0.5), STILL)
    assert tau[0] == pytest.approx(27.632 * 1.5 + 110.064 * 1.5**2 + 13.965 * 1.5**3, rel=1e-12)
    assert tau[1:] == pytest.approx((0.0, 0.0), abs=1e-9)


def test_headwind_at_rest():
    """10 m/s from ahead: q CD_lAF A_F pushed back, held against by the same force ahead."""
    feedforward = feedforward_of(Estimator(PROFILE, {}), weather=True)
    tau = ahead_of(feedforward, REST, REST, 0.0, (-10.0, 0.0), STILL, STILL)
    assert tau == pytest.approx((0.5 * 1.225 * 100.0 * 0.5 * 2.9, 0.0, 0.0), abs=1e-9)


def test_payload_turning_about_the_origin():
    """300 kg at 2 m forward on a steady turn at rest: m x r² outwards is held inwards, and 300 · 2² adds to the inertia."""
    bare, loaded = (feedforward_of(Estimator(PROFILE, {}), load=load) for load in (False, True))
    load = (300.0, 2.0)
    turn, spin = (REST, (0.0, 0.0, 0.4)), ((0.0, 0.0, 0.1), REST)
    for (nu_dot, nu), expected in ((turn, (-300.0 * 2.0 * 0.16, 0.0, 0.0)), (spin, (0.0, 60.0, 120.0))):
        tau = np.array(ahead_of(loaded, nu_dot, nu, 0.0, STILL, STILL, load))
        without = ahead_of(bare, nu_dot, nu, 0.0, STILL, STILL, load)
        np.testing.assert_allclose(tau - without, expected, atol=1e-9)


def test_what_is_not_measured_is_not_used():
    feedforward = feedforward_of(Estimator(PROFILE, SCALE))
    motion = ((0.1, -0.2, 0.05), (0.7, 0.1, -0.2), 0.3)
    assert ahead_of(feedforward, *motion, (9.0, 4.0), (1.0, 1.0), (500.0, 1.0)) == ahead_of(
        feedforward, *motion, STILL, STILL, STILL
    )


def test_a_motion_mirrored_to_port_takes_a_mirrored_force():
    feedforward = feedforward_of(Estimator(PROFILE, SCALE), weather=True, flow=True, load=True)
    one = ahead_of(feedforward, (0.1, -0.2, 0.05), (0.7, 0.1, -0.2), 0.3, (3.0, -2.0), (0.2, 0.1), (200.0, 1.0))
    other = ahead_of(feedforward, (0.1, 0.2, -0.05), (0.7, -0.1, 0.2), -0.3, (3.0, 2.0), (0.2, -0.1), (200.0, 1.0))
    assert other == (one[0], -one[1], -one[2])


def test_a_scenario_takes_a_model_given_or_named(scenario, model, tmp_path):
    made = model("modulus+wind-paper+current-thesis")
    (tmp_path / "3.json").write_text(dump_json(model_to_json(made)))
    sensors = Sensors(wind_rate_hz=5.0, current_rate_hz=1.0, payload_rate_hz=1.0)
    given = build_feedforward(scenario(sensors=sensors), PROFILE, made)
    named = scenario(sensors=sensors, controller=Control(model="3.json"), folder=tmp_path)
    nu_dot, nu, psi, wind, current, payload = states(2, n=1)
    expected = model_estimator(made)(nu_dot, nu, psi, wind, current, payload)[0]
    for feedforward in (given, build_feedforward(named, PROFILE, None)):
        parts = (
            tuple(part[0]) if part.ndim > 1 else float(part[0]) for part in (nu_dot, nu, psi, wind, current, payload)
        )
        np.testing.assert_allclose(ahead_of(feedforward, *parts), expected, rtol=1e-11)


@pytest.mark.parametrize(("name", "what"), [("thesis+wind-thesis", "wind"), ("modulus+current-paper", "current")])
def test_a_model_that_needs_what_is_not_measured_is_refused(scenario, model, name, what):
    with pytest.raises(FerryIdError, match=rf"boat@3 needs measured {what}, found {what}_rate_hz = 0\. Fix: "):
        build_feedforward(scenario(), PROFILE, model(name))


def test_a_model_of_another_vessel_is_refused(scenario, model):
    made = model("modulus")
    with pytest.raises(FerryIdError, match=r"boat@3 belongs to milliampere, found the vessel other\. Fix: "):
        build_feedforward(scenario(), replace(PROFILE, name="other"), made)


def test_a_missing_model_file_is_told_in_one_line(scenario, tmp_path):
    with pytest.raises(FerryIdError, match=r"nowhere\.json: not readable .* Fix: [^\n]*$"):
        build_feedforward(scenario(controller=Control(model="nowhere.json"), folder=tmp_path), PROFILE, None)
