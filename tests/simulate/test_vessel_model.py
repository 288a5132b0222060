"""A model as the simulated vessel: its hull moves, its effects act, and what cannot be is told."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.effects.force_model import COEFFICIENTS, UNITS, hull_of
from ferryid.errors import FerryIdError
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.models.coefficients.intervals import coefficient_intervals, term_interval
from ferryid.models.forces import MAPPED, model_estimator
from ferryid.models.model import Model
from ferryid.models.stored_effect import Conditions, Quantity
from ferryid.regression.bases import make_basis
from ferryid.simulate import Simulation, load_scenario, parse_scenario, simulate, write_log
from ferryid.simulate.vessel_model import sailed_by
from ferryid.types import RunContext
from ferryid.vessel import load_profile
from tests.models.test_store import made
from tests.models.test_stored_effect import BROKEN, FERRY, FOULED, HERE, WINDY, diagnosed, stored

TRIAL = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
duration_s = 60
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
path = { kind = "four-corner", dwell_s = 15 }
"""


def hull_alone(**changes: object) -> Model:
    """A diagnosed model without terms, whose hull is the profile's but for one coefficient."""
    nothing = np.zeros((0, 3))
    hull = {
        name: Quantity(value, value, value, unit)
        for name, value, unit in zip(COEFFICIENTS, hull_of(FERRY).tolist(), UNITS, strict=True)
    }
    model = replace(
        made(),
        scale={"delta": 1.0, "sigma": 1.0, "zeta": 1.0},
        settings={"basis": "none", "structure": "decoupled", "components": 0, "window_s": 1.0},
        terms=(),
        units=(),
        theta=nothing,
        low=nothing,
        high=nothing,
        intercept=np.zeros(3),
        covariance=np.zeros((3, 1, 1)),
        hull=hull,
    )
    return replace(model, **changes)


def test_a_hull_like_the_profiles_sails_alike() -> None:
    scenario = parse_scenario(TRIAL, "t")
    sailing = sailed_by(scenario, hull_alone())
    plain, same = simulate(scenario, 3), simulate(sailing.scenario, 3, vessel=sailing.vessel)
    np.testing.assert_array_equal(plain.truth.eta, same.truth.eta)
    assert sailing.notes == ()


def test_the_model_is_the_scenario_that_has_its_effects() -> None:
    by_hand = TRIAL + (
        "fouling = { surge = 1.8, sway = 1.3, yaw = 1.3 }\n"
        '[[thrusters.faults]]\nthruster = "thruster2"\nfactor = 0.6\n[true_hull]\nm11 = 1.25\n'
    )
    k = hull_alone().hull["m11"]
    model = hull_alone(
        vessel_effects=(FOULED, BROKEN),
        hull={**hull_alone().hull, "m11": replace(k, value=1.25 * k.value)},
        conditions=(Conditions("trial", HERE, (WINDY,)),),
    )
    sailing = sailed_by(parse_scenario(TRIAL, "t"), model)
    ours = simulate(sailing.scenario, 3, vessel=sailing.vessel)
    theirs = simulate(parse_scenario(by_hand, "t"), 3)
    np.testing.assert_allclose(ours.truth.eta, theirs.truth.eta, rtol=1e-9, atol=1e-12)
    # Neither the wind of the log nor the time at which the fault began there.
    assert (sailing.scenario.wind.north_mps, sailing.scenario.thrusters.faults[0].from_s) == (0.0, 0.0)


def test_the_conditions_of_a_log_prevail_when_asked_for() -> None:
    late = replace(BROKEN, sources=(replace(BROKEN.sources[0], onset_s=30.0),))
    aboard = stored("payload", mass=200.0, x=0.5, onset_s=20.0)
    model = hull_alone(vessel_effects=(late,), conditions=(Conditions("trial", HERE, (WINDY, aboard)),))
    held = sailed_by(parse_scenario(TRIAL, "t"), model, "trial").scenario
    by_path = sailed_by(parse_scenario(TRIAL, "t"), model, "logs/trial.mcap")
    assert (by_path.scenario, by_path.conditions) == (held, "trial")
    assert (held.wind.north_mps, held.wind.east_mps) == (-4.0, 3.0)
    assert (held.payload[0].mass_kg, held.payload[0].from_s) == (200.0, 20.0)
    assert held.thrusters.faults[0].from_s == 30.0
    left = replace(aboard, sources=(replace(aboard.sources[0], offset_s=45.0),))
    gone = sailed_by(
        parse_scenario(TRIAL, "t"), replace(model, conditions=(Conditions("trial", HERE, (left,)),)), "trial"
    )
    assert (gone.scenario.payload[0].from_s, gone.scenario.payload[0].until_s) == (20.0, 45.0)
    assert held.payload[0].until_s > held.duration_s
    with pytest.raises(FerryIdError, match=r'conditions of "trail" are not in the model.*Did you mean "trial"'):
        sailed_by(parse_scenario(TRIAL, "t"), model, "trail")
    passed = [
        replace(BROKEN, instance=name, sources=(replace(BROKEN.sources[0], sha256=HERE, onset_s=a, offset_s=b),))
        for name, a, b in (("thruster1", 10.0, 30.0), ("thruster2", 35.0, 50.0))
    ]
    both = sailed_by(
        parse_scenario(TRIAL, "t"), hull_alone(conditions=(Conditions("trial", HERE, tuple(passed)),)), "trial"
    ).scenario.thrusters.faults
    assert [(one.thruster, one.from_s, one.until_s) for one in both] == [
        ("thruster1", 10.0, 30.0), ("thruster2", 35.0, 50.0),
    ]  # fmt: skip
    twice = replace(model, conditions=(Conditions("trial", HERE, (WINDY, WINDY)),))
    with pytest.raises(FerryIdError, match="one steady wind, found two"):
        sailed_by(parse_scenario(TRIAL, "t"), twice, "trial")


def test_what_the_scenario_says_of_the_vessel_is_set_aside() -> None:
    sailing = sailed_by(load_scenario("thruster-fault"), hull_alone(vessel_effects=(FOULED,)))
    assert sailing.scenario.thrusters.faults == ()
    assert sailing.scenario.fouling.surge == 1.8
    assert sailing.scenario.wind == load_scenario("thruster-fault").wind
    assert sailing.notes == ("the scenario's [thrusters.faults] is set aside: the vessel is boat@0",)


def test_terms_that_no_hull_has_act_beside_it() -> None:
    functions = make_basis("modulus+wind-thesis+current-thesis", structure="decoupled")
    K, rng = len(functions.terms), np.random.default_rng(1)
    theta = np.where(functions.mask, 20.0 * rng.standard_normal((K, 3)), 0.0)
    for term, axis in (place for places in MAPPED.values() for place in places):
        # Those of the hull act on what moves through the water, and make its mass.
        theta[functions.terms.index(term) if term in functions.terms else [], axis] = 0.0
    model = replace(
        hull_alone(),
        settings={"basis": functions.name, "structure": "decoupled", "components": 3, "window_s": 1.0},
        terms=functions.terms,
        units=functions.units,
        theta=theta,
        low=theta,
        high=theta,
        intercept=np.array([5.0, -3.0, 2.0]),
        covariance=np.zeros((3, K + 1, K + 1)),
    )
    windy = (
        f"{TRIAL}[environment]\nwind = {{ north_mps = 2.0, east_mps = -3.0 }}\n"
        "current = { north_mps = 0.2, east_mps = 0.1 }\n"
    )
    sailing = sailed_by(parse_scenario(windy, "t"), model)
    truth = simulate(sailing.scenario, 3, vessel=sailing.vessel, terms=sailing.terms).truth
    n = len(truth.t)
    flows = [np.tile(flow, (n, 1)) for flow in ([2.0, -3.0], [0.2, 0.1])]
    needed = model_estimator(model)(truth.nu_dot, truth.nu, truth.eta[:, 2], *flows)
    np.testing.assert_allclose(needed, truth.tau, rtol=1e-6, atol=1e-6)


@pytest.mark.slow
def test_a_fit_to_what_a_fitted_model_sailed_gives_its_coefficients_back(tmp_path: Path) -> None:
    scenario = load_scenario("twelve-corner-calm")
    # Base model and truth are far apart, so that the terms that are fitted are large.
    settings = FitSettings(delta=0.4, sigma=0.4)

    def fit_to(simulation: Simulation, name: str) -> Model:
        write_log(simulation, tmp_path / name)
        return fit_logs([str(tmp_path / name)], FERRY, settings, RunContext(tmp_path)).model

    model = fit_to(simulate(scenario, 3), "profile.mcap")
    sailing = sailed_by(scenario, model)
    again = fit_to(simulate(sailing.scenario, 5, vessel=sailing.vessel, terms=sailing.terms), "model.mcap")
    wanted, found = coefficient_intervals(model), coefficient_intervals(again)
    for term in ("vr", "rr"):
        wanted[term], found[term] = (term_interval(one, term, 0) for one in (model, again))
    out = [name for name in found if not found[name][1] <= wanted[name][0] <= found[name][2]]
    assert out == []


def test_what_cannot_be_sailed_is_told() -> None:
    scenario = parse_scenario(TRIAL, "t")
    coupled = replace(diagnosed(), settings={**diagnosed().settings, "structure": "coupled"})
    with pytest.raises(FerryIdError, match=r"boat@0: the simulated vessel cannot have .* u_dot, "):
        sailed_by(scenario, coupled)
    with pytest.raises(FerryIdError, match="a trial of milliampere cannot be sailed by boat@0, a model of revolt"):
        sailed_by(scenario, hull_alone(profile_text=load_profile("revolt").text))
    light = hull_alone(conditions=(Conditions("trial", HERE, (stored("payload", mass=-200.0, x=0.5),)),))
    with pytest.raises(FerryIdError, match=r'with payload of boat@0, t[.]toml:.*"mass_kg" must be'):
        sailed_by(scenario, light, "trial")


def without_limits(text: str) -> str:
    """Return the ferry's profile with thrust curves that never end."""
    return re.sub(
        r'^kind = "polynomial"\ninput = "rpm"\ncoefficients = .*\nvalid = .*$',
        'kind = "quadratic"\ninput = "rpm"\nahead = 8.0e-4\nastern = 8.0e-4',
        text,
        flags=re.MULTILINE,
    )


def test_a_model_without_limits_of_its_propellers_has_those_of_the_scenarios_vessel(tmp_path: Path) -> None:
    model = hull_alone()
    text = without_limits(model.profile_text)
    model, limits = replace(model, profile_text=text), "valid = [-900.0, 900.0]"
    scenario = parse_scenario(TRIAL.replace('"milliampere"', f'"{tmp_path / "own.toml"}"'), "t")
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"no limit in its thrust curve\. Fix: name a profile in the scenario"):
        simulate(scenario, 3, vessel=sailed_by(scenario, model).vessel)
    (tmp_path / "own.toml").write_text(text.replace("astern = 8.0e-4", f"astern = 8.0e-4\n{limits}"), encoding="utf-8")
    sailing = sailed_by(scenario, model)
    assert [one.thrust.valid for one in sailing.vessel.actuators if one.thrust is not None] == [(-900.0, 900.0)] * 2
    assert len(simulate(scenario, 3, vessel=sailing.vessel).truth.eta) > 0
    # Those of another curve are not its own.
    other = text.replace("astern = 8.0e-4", f"astern = 7.0e-4\n{limits}")
    (tmp_path / "own.toml").write_text(other, encoding="utf-8")
    assert all(
        one.thrust is None or one.thrust.valid[1] == np.inf for one in sailed_by(scenario, model).vessel.actuators
    )
