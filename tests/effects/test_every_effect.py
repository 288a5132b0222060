"""Every effect of the library: injected into a simulated trial it is found and sized; left out, nothing is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import read_measurements, window_lengths
from ferryid.diagnose.inference.estimation import estimation_problem
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.search import Search, search
from ferryid.diagnose.inference.weak_form import windows
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile
from tests.effects.fixed_propellers import write

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
BASE = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner", dwell_s = DWELL_S }
controller = { delta = 0.7, sigma = 0.7 }
"""
DWELL_S = {"shallow_water": 60.0} | dict.fromkeys(("external_push", "hull_parameters", "payload", "fouling"), 40.0)
"""Where the time at a corner must be longer than `BRIEF_S` for an effect to be sized: a place has edges to be crossed, what
passes must be seen before and after, and what trades with the hull needs more to be told from it."""
BRIEF_S = 20.0
LONGER_S = 40.0
"""Where nothing acts: what chance does is to be seen in more of it."""
BOTH_WAYS = ("astern_asymmetry",)
"""Effects of what milliAmpère never does: its thrusters turn round instead of running astern."""
HULL = ("m11", "m22", "m33", "X_u", "X_|u|u", "Y_v", "Y_|v|v", "Y_|r|v", "Y_|v|r", "N_r", "N_|r|r", "N_|r|v")
"""Coefficients that the true vessel has ten per cent off the profile's, either way."""
NAMES = tuple(name for name, effect in effects().items() if effect.unsteady is None)
"""Effects that change the force model; what comes and goes by chance is a state of the filter, and found as such."""
MODERATE = {
    "payload": {"mass": 300.0, "x": 0.7},
    "mooring": {"stiffness_north": 6.0, "stiffness_east": 5.0, "north": 5.0, "east": -5.0},
    "thruster_gain": {"factor": 0.8},
    "fouling": {"surge": 1.5, "sway": 1.5, "yaw": 1.5},
    "wind": {"north": -2.0, "east": 1.5, "C_X": 1.0, "C_Y": 1.0, "C_N": 1.0},
    "current": {"north": 0.1, "east": -0.08},
    "hull_parameters": {**dict.fromkeys(COEFFICIENTS, 1.0), "Y_|v|v": 2.0, "X_u": 2.2},
    "dead_band": {"ahead": 200.0, "astern": 0.0},
    "astern_asymmetry": {"factor": 0.8},
    "thrust_saturation": {"ahead": 160.0, "astern": 304.1227},
    "external_push": {"north": 60.0, "east": -50.0, "moment": 60.0},
    "ventilation": {"factor": 0.6, "from": 40.0, "time_constant": 0.0},
    "shallow_water": {"factor": 1.6, "south": 12.0, "north": 34.0, "west": -18.0, "east": 4.0, "added_mass": 0.0},
}
"""Where one size of every parameter would be gross, or no place for a ferry."""
INSTANCES = {"ventilation": "thruster1"}
"""The thruster that works hardest in the round, where the last one does not work hard enough."""
SPANS = {"external_push": {"onset": 200.0, "offset": 260.0}}
"""When those act that only pass [s]."""


def inline(value: Any) -> str:
    """Return a value as TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f'"{key}" = {inline(entry)}' for key, entry in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(inline(entry) for entry in value) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(float(value))


def base(dwell_s: float = BRIEF_S) -> str:
    """Return the scenario of a round."""
    return BASE.replace("DWELL_S", f"{dwell_s}")


def found_in(
    tables: dict[str, Any], seed: int, folder: Path, dwell_s: float = BRIEF_S, vessel: Profile = FERRY
) -> Search:
    """Simulate a round with these tables in its scenario, and search its log."""
    sensors = {"imu_rate_hz": 0.0, "camera_rate_hz": 0.0, **tables.get("sensors", {})}
    name = vessel.path if vessel is not FERRY else FERRY.name
    text = base(dwell_s).replace('vessel = "milliampere"', f'vessel = "{name}"') + "".join(
        f"{key} = {inline(value)}\n" for key, value in {**tables, "sensors": sensors}.items()
    )
    scenario = parse_scenario(text, "effect")
    signs = np.random.default_rng(seed).choice([0.9, 1.1], len(HULL)).tolist()
    hull = dict(scenario.true_hull)
    for coefficient, sign in zip(HULL, signs, strict=True):
        hull[coefficient] = sign * hull.get(coefficient, 1.0)
    log = folder / "trial.mcap"
    write_log(simulate(replace(scenario, true_hull=hull), seed), log)
    measurements, _ = read_measurements(str(log), vessel)
    seen = windows(measurements, *window_lengths(vessel))
    plain, spread = prior_force_model(seen.measurements, vessel)
    return search(estimation_problem(seen, plain, spread), lambda stage: None)


RELATED = ("fouling", "payload", "thruster_gain", "shallow_water", "hull_parameters")
"""Effects that explain more or less of the same."""


def moderate(name: str) -> dict[str, float]:
    """Return an effect's parameters at moderate size."""
    usual = {one.name: one.neutral + one.size for one in effects()[name].parameters_of(FERRY)}
    return {**usual, **MODERATE.get(name, {})}


@pytest.mark.parametrize("name", NAMES)
def test_effect_is_found_where_it_acts(name: str, tmp_path: Path) -> None:
    effect = effects()[name]
    vessel = load_profile(write(tmp_path)) if name in BOTH_WAYS else FERRY
    instance = INSTANCES.get(name, effect.instances(vessel)[-1])
    parameters = effect.parameters_of(vessel)
    truth = moderate(name)
    span = SPANS.get(name, {})
    seed = 5 if name in RELATED else 3
    result = found_in(effect.scenario({**truth, **span}, instance), seed, tmp_path, DWELL_S.get(name, BRIEF_S), vessel)
    found = [(one.effect.id, one.instance) for one in result.fit.candidates]
    # Related effects are not mistaken for each other, nor named beside each other.
    assert (found if name in RELATED else found[:1]) == [(name, instance)]
    assert effect.says(truth, instance)
    for one, value, error in zip(parameters, result.fit.values[0], result.fit.errors(0), strict=True):
        assert abs(value - truth[one.name]) < max(4.0 * error, 0.15 * one.size), one.name
    for end, when in span.items():
        assert abs(getattr(result.fit.candidates[0], f"{end}_s") - when) < 2.0


def test_a_hull_model_that_is_wrong_all_over_is_named(tmp_path: Path) -> None:
    log = tmp_path / "trial.mcap"
    write_log(simulate(parse_scenario(base(), "effect"), 2), log)
    measurements, _ = read_measurements(str(log), FERRY)
    seen = windows(measurements, *window_lengths(FERRY))
    plain, spread = prior_force_model(seen.measurements, FERRY)
    result = search(estimation_problem(seen, replace(plain, hull=0.4 * plain.hull), 0.4 * spread), lambda stage: None)
    assert [one.effect.id for one in result.fit.candidates] == ["hull_parameters"]
    value, error = result.fit.values[0], result.fit.errors(0)
    certain = np.abs(value - 1.0) - 2.0 * error > result.fit.candidates[0].effect.minimum_change
    assert np.count_nonzero(certain) >= 5
    assert (np.abs(value - 2.5) < 4.0 * error)[certain].all()


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_found_where_nothing_acts(seed: int, tmp_path: Path) -> None:
    result = found_in({}, seed, tmp_path, LONGER_S)
    assert result.fit.candidates == ()
    assert result.rounds[0].none > 0.9


def test_nothing_is_found_of_sound_propellers_that_run_astern(tmp_path: Path) -> None:
    result = found_in({}, 3, tmp_path, LONGER_S, load_profile(write(tmp_path)))
    assert result.fit.candidates == ()
    assert "astern_asymmetry" not in result.untested


def test_a_limit_far_above_the_start_of_its_search_is_found(tmp_path: Path) -> None:
    """Of 496 N: the search begins at 30 % of that, and few of the log's forces reach the limit."""
    truth = {**moderate("thrust_saturation"), "ahead": 250.0}
    result = found_in(effects()["thrust_saturation"].scenario(truth, "thruster1"), 3, tmp_path)
    assert [one.key for one in result.fit.candidates] == [("thrust_saturation", "thruster1")]
    assert result.fit.values[0][0] == pytest.approx(250.0, rel=0.03)
