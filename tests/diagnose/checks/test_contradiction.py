"""Signs, angles and clocks that turn force against motion are refused; what is merely weak, or late, is left to the effects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ferryid.diagnose.checks import examine
from ferryid.diagnose.checks.contradiction import opposed
from ferryid.effects.force_model import Measurements
from ferryid.errors import FerryIdError
from ferryid.vessel import load_profile

PROFILE = load_profile("milliampere")
STEP_S = 0.2


@cache
def pushed() -> Measurements:
    """A body that turns slowly while two azimuths push it about, with drag, wind and noise."""
    random = np.random.default_rng(3)
    t = np.arange(0.0, 600.0, STEP_S)
    psi = 1.5 * np.sin(0.02 * t) + 0.01 * t
    steps = random.normal(size=(2, len(t) // 40 + 1, 2)) @ [1.0, 1.0j]
    force = np.repeat(steps, 40, axis=1)[:, : len(t)].T * [200.0, 120.0]
    over_ground = np.zeros(len(t), dtype=complex)
    for k in range(len(t) - 1):
        push = force[k].sum() * np.exp(1j * psi[k]) + 40.0
        over_ground[k + 1] = over_ground[k] + STEP_S * (push / 2400.0 - 0.05 * over_ground[k])
    body = over_ground * np.exp(-1j * psi) + random.normal(0.0, 0.01, (len(t), 2)) @ [1.0, 1.0j]
    way = np.cumsum(over_ground) * STEP_S
    nu = np.column_stack([body.real, body.imag, np.gradient(psi, STEP_S)])
    parts = np.stack([force.real, force.imag, force.imag * [1.8, -1.8]], axis=-1)
    usable = np.ones(len(t), dtype=np.bool_)
    return Measurements(PROFILE, t, np.column_stack([way.real, way.imag, psi]), nu, nu, parts, np.angle(force), usable)


WRONG: dict[str, tuple[Callable[[Measurements], Measurements], str]] = {
    "both reversed": (lambda one: replace(one, parts=-one.parts), "against the force of thruster1 and thruster2 "),
    "one reversed": (lambda one: replace(one, parts=one.parts * [[[-1.0], [1.0]]]), "against the force of thruster1 "),
    "angles to port": (lambda one: replace(one, parts=one.parts * [1.0, -1.0, -1.0]), "counted the other way round "),
    "navigation late": (lambda one: replace(one, parts=np.roll(one.parts, -150, axis=0)), "30 s later than the force"),
    "navigation early": (lambda one: replace(one, parts=np.roll(one.parts, 50, axis=0)), "10 s earlier than the force"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", WRONG)
def test_force_and_motion_that_contradict_each_other_are_refused(name: str) -> None:
    wrong, says = WRONG[name]
    with pytest.raises(FerryIdError, match=rf"milliampere\.toml: force and motion .*{says}.*Fix: correct the sign"):
        examine(wrong(pushed()))


RIGHT: dict[str, Callable[[Measurements], Measurements]] = {
    "as it is": lambda one: one,
    "one weak": lambda one: replace(one, parts=one.parts * [[[0.5], [1.0]]]),
    "one dead": lambda one: replace(one, parts=one.parts * [[[0.0], [1.0]]]),
    "late by what a delay may be": lambda one: replace(one, parts=np.roll(one.parts, -10, axis=0)),
    "of another trial": lambda one: replace(one, parts=one.parts[::-1].copy()),
    "at rest": lambda one: replace(one, nu_raw=0.0 * one.nu_raw),
    "idle": lambda one: replace(one, parts=0.0 * one.parts),
}


def swung(t: np.ndarray, force: np.ndarray, r: np.ndarray, *, push: float) -> Measurements:
    """Return a ship on a given turn: the stern pushes outward, and the hull's lift inward three times as hard."""
    u, v = np.full(len(t), 5.0), np.zeros(len(t))
    for k in range(len(t) - 1):
        # Sway of a hull that turns: drag, lift of the drift, and the slender body's own of the turn.
        v[k + 1] = v[k] + STEP_S * (push * force[k] - 0.02 * u[k] * v[k] - 0.6 * u[k] * r[k])
    psi = np.cumsum(r) * STEP_S
    over_ground = (u + 1j * v) * np.exp(1j * psi)
    way = np.cumsum(over_ground) * STEP_S
    nu = np.column_stack([u, v, r]) + np.random.default_rng(2).normal(0.0, 0.003, (len(t), 3)) * [1.0, 1.0, 0.01]
    mass = PROFILE.hull.mass_kg
    parts = np.zeros((len(t), 2, 3))
    parts[:, 0, 1] = mass * push * force
    parts[:, 1, 0] = 0.1 * mass
    usable = np.ones(len(t), dtype=np.bool_)
    return Measurements(PROFILE, t, np.column_stack([way.real, way.imag, psi]), nu, nu, parts, parts[:, :, 0], usable)


@pytest.mark.parametrize("turn_s", [60.0, 90.0, 150.0])
def test_a_stern_drive_that_pushes_outward_in_a_turn_is_no_contradiction(turn_s: float) -> None:
    t = np.arange(0.0, 900.0, STEP_S)
    helm = np.sign(np.sin(2.0 * np.pi * t / turn_s))
    r = np.zeros(len(t))
    for k in range(len(t) - 1):
        r[k + 1] = r[k] + STEP_S * (0.01 * helm[k] - r[k]) / 8.0
    assert opposed(swung(t, -helm, r, push=0.01)) == ""


@pytest.mark.slow
@pytest.mark.parametrize("period_s", [6.0, 8.0, 10.0])
def test_a_controller_in_a_swell_is_no_clock_that_is_late(period_s: float) -> None:
    random = np.random.default_rng(5)
    t = np.arange(0.0, 900.0, STEP_S)
    n = len(t)
    # A narrow band of waves pushes; the controller answers position and velocity.
    swell, place, over = np.zeros(n, complex), np.zeros(n, complex), np.zeros(n, complex)
    state = np.zeros(2, complex)
    turn = np.exp(STEP_S * (2j * np.pi / period_s - 0.005))
    force = np.zeros(n, complex)
    for k in range(n - 1):
        state = state * turn + random.normal(size=2) * 10.0
        swell[k] = state[0].real + 1j * state[1].real
        force[k] = -50.0 * place[k] - 1500.0 * over[k]
        over[k + 1] = over[k] + STEP_S * ((force[k] + 8.0 * swell[k]) / 2400.0 - 0.05 * over[k])
        place[k + 1] = place[k] + STEP_S * over[k + 1]
    nu = np.column_stack([over.real, over.imag, 0.0 * t])
    parts = np.stack([np.stack([force.real, force.imag, 0.0 * t], axis=-1), np.zeros((n, 3))], axis=1)
    eta = np.column_stack([place.real, place.imag, 0.0 * t])
    assert opposed(Measurements(PROFILE, t, eta, nu, nu, parts, parts[:, :, 0], np.ones(n, dtype=np.bool_))) == ""


@pytest.mark.parametrize("name", RIGHT)
def test_what_is_not_certain_is_left_alone(name: str) -> None:
    assert opposed(RIGHT[name](pushed())) == ""
