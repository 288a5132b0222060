"""A new effect is one file, for the diagnosis and for the simulator."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import ferryid.effects
from ferryid.effects import effects
from ferryid.errors import FerryIdError
from ferryid.simulate import parse_scenario, simulate
from ferryid.simulate.added_effects import simulated
from ferryid.simulate.scenario import check_against
from ferryid.vessel import load_profile
from tests.effects.test_every_effect import found_in

FERRY = load_profile("milliampere")
PUSH = '''
"""A push that is steady over ground, with a moment."""

from dataclasses import replace
from functools import partial
from math import cos, sin

import numpy as np

from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.simulated import Simulated, entry
from ferryid.vessel.frames import to_body


def parameters_of(profile):
    return tuple(Parameter(name, unit, 40.0, -1e4, 1e4) for name, unit in (("north", "N"), ("east", "N"), ("moment", "N·m")))


def apply(force_model, p, instance):
    n = len(force_model.measurements.t)
    X, Y = to_body(np.full(n, p[0]), np.full(n, p[1]), force_model.measurements.psi)
    return replace(force_model, external=force_model.external + np.column_stack([X, Y, np.full(n, p[2])]))


def load(p, t, x, y, psi, u, v, r, u_r, v_r):
    c, s = cos(psi), sin(psi)
    return c * p[0] + s * p[1], c * p[1] - s * p[0], p[2]


EFFECT = Effect(
    "push", "Push", parameters_of, apply, lambda values, instance: "Something pushes.", partial(entry, "push"),
    simulated=Simulated(load),
)
'''
DEAD_BAND = '''
"""Dead band: a thruster that turns too slowly gives no force."""

from dataclasses import replace
from functools import partial

from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.simulated import Simulated, entry


def thrust(p, speed, force):
    return 0.0 if abs(speed) < p[0] else force


EFFECT = Effect(
    "stuck", "Dead band", lambda profile: (Parameter("ahead", "rpm", 50.0, 0.0, 500.0),),
    lambda force_model, p, instance: force_model,
    lambda values, instance: f"{instance} sticks.", partial(entry, "stuck"),
    instances=lambda profile: tuple(one.name for one in profile.actuators), simulated=Simulated(thrust=thrust),
)
'''
SCENARIO = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
duration_s = 40
sensors = { imu_rate_hz = 0, camera_rate_hz = 0 }
"""
STEPS = SCENARIO + 'manoeuvre = { kind = "rpm-steps", levels = [0.3, 1.0], hold_s = 15, lead_s = 1 }\n'


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Add two effects: a file for each in a folder of their own."""
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "push.py").write_text(PUSH, encoding="utf-8")
    (tmp_path / "library" / "stuck.py").write_text(DEAD_BAND, encoding="utf-8")
    monkeypatch.setattr(ferryid.effects, "__path__", [*ferryid.effects.__path__, str(tmp_path / "library")])
    effects.cache_clear()
    yield
    effects.cache_clear()


@pytest.mark.slow
@pytest.mark.usefixtures("library")
def test_a_load_acts_on_the_hull_while_it_lasts() -> None:
    push = '[[effects]]\neffect = "push"\nnorth = 30\neast = -20\nmoment = 15\nfrom_s = 20\nuntil_s = 30\n'
    plain, pushed = (simulate(parse_scenario(text, "t"), 1).truth for text in (STEPS, STEPS + push))
    first = int(np.searchsorted(plain.t, 20.0 - 1e-9))
    np.testing.assert_array_equal(pushed.nu_dot[:first], plain.nu_dot[:first])
    c, s = np.cos(plain.eta[first, 2]), np.sin(plain.eta[first, 2])
    force = [30.0 * c - 20.0 * s, -20.0 * c - 30.0 * s, 15.0]
    np.testing.assert_allclose(FERRY.hull.M @ (pushed.nu_dot - plain.nu_dot)[first], force, atol=1e-8)
    step = np.abs(np.diff(pushed.nu_dot[:, 2]))
    after = int(np.searchsorted(plain.t, 30.0 - 1e-9))
    assert step[after - 1] == pytest.approx(15.0 / FERRY.hull.M[2, 2], rel=0.2)


@pytest.mark.slow
@pytest.mark.usefixtures("library")
def test_a_change_of_thrust_acts_on_its_thruster() -> None:
    stuck = '[[effects]]\neffect = "stuck"\nthruster = "thruster1"\nahead = 300\n'
    both = simulate(parse_scenario(STEPS, "t"), 1).truth
    one = simulate(parse_scenario(STEPS + stuck, "t"), 1).truth
    slow = (one.speeds[:, 0] < 300.0) & (one.speeds[:, 0] > 10.0)
    assert slow.any()
    assert (one.speeds[:, 0] > 300.0).any()
    # The same orders, whatever they do: half of the force is missing while the one thruster is slow.
    np.testing.assert_array_equal(one.speeds, both.speeds)
    np.testing.assert_allclose(one.tau[slow, 0], 0.5 * both.tau[slow, 0], rtol=1e-9)
    np.testing.assert_allclose(one.tau[one.speeds[:, 0] > 300.0], both.tau[one.speeds[:, 0] > 300.0], rtol=1e-9)


@pytest.mark.usefixtures("library")
@pytest.mark.parametrize(
    ("entry", "match"),
    [
        ('effect = "pusch"', r't:\d+: .*cannot be "pusch".*Did you mean "push"'),
        ('effect = "push"\nnorht = 1', r':\d+: "push" has no parameter "norht".*use north \[N\], east'),
        ('effect = "push"\nnorth = 1e5', r':\d+: "north" must lie from -10000 to 10000 N, found 100000'),
        ('effect = "push"\nthruster = "thruster1"', r"acts on the whole vessel"),
        ('effect = "stuck"\nahead = 5', r'effect of one thruster of milliampere.*Fix: thruster = "thruster1"'),
        ('effect = "push"\nnorth = 1\nfrom_s = 30\nuntil_s = 20', r'"until_s" must come after'),
        ('effect = "push"\nnorth = "much"', r'"north" must be a number'),
    ],
)
def test_an_entry_that_makes_no_sense_is_told(entry: str, match: str) -> None:
    with pytest.raises(FerryIdError, match=match):
        check_against(parse_scenario(f"{STEPS}[[effects]]\n{entry}\n", "t"), FERRY)


@pytest.mark.slow
@pytest.mark.usefixtures("library")
def test_it_is_found_where_it_acts(tmp_path: Path) -> None:
    truth = {"north": 40.0, "east": -30.0, "moment": 30.0}
    result = found_in(effects()["push"].scenario(truth, None), 3, tmp_path)
    assert [one.effect.id for one in result.fit.candidates[:1]] == ["push"]
    found = dict(zip(truth, result.fit.values[0], strict=True))
    errors = result.fit.errors(0)
    for (name, value), error in zip(truth.items(), errors, strict=True):
        assert abs(found[name] - value) < max(4.0 * error, 6.0), name


def test_without_its_file_there_is_no_such_effect() -> None:
    assert "push" not in effects()
    with pytest.raises(FerryIdError, match='cannot be "push"'):
        parse_scenario(f'{STEPS}[[effects]]\neffect = "push"\n', "t")


@pytest.mark.slow
def test_a_mooring_is_one_by_its_section_and_by_its_name() -> None:
    spring = "stiffness_north_Npm = 20\nstiffness_east_Npm = 30\nnorth_m = 5\neast_m = -5\nfrom_s = 10"
    named = 'effect = "mooring"\nstiffness_north = 20\nstiffness_east = 30\nnorth = 5\neast = -5\nfrom_s = 10'
    section, entry = (
        simulate(parse_scenario(STEPS + text, "t"), 1).truth
        for text in (f"[environment.mooring]\n{spring}\n", f"[[effects]]\n{named}\n")
    )
    np.testing.assert_array_equal(section.eta, entry.eta)
    assert "mooring" in simulated()
