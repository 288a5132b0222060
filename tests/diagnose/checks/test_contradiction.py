"""Signs, angles and clocks that turn force against motion are refused; what is merely weak, or late, is left to the effects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ferryid.diagnose.checks import examine
from ferryid.diagnose.checks.contradiction import opposed
from ferryid.effects.picture import Scene
from ferryid.errors import FerryIdError
from ferryid.vessel import load_profile

PROFILE = load_profile("milliampere")
STEP_S = 0.2


@cache
def pushed() -> Scene:
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
    return Scene(PROFILE, t, np.column_stack([way.real, way.imag, psi]), nu, nu, parts, np.angle(force), usable)


WRONG: dict[str, tuple[Callable[[Scene], Scene], str]] = {
    "both reversed": (lambda one: replace(one, parts=-one.parts), "against the force of thruster1 and thruster2 "),
    "one reversed": (lambda one: replace(one, parts=one.parts * [[[-1.0], [1.0]]]), "against the force of thruster1 "),
    "angles to port": (lambda one: replace(one, parts=one.parts * [1.0, -1.0, -1.0]), "counted the other way round "),
    "navigation late": (lambda one: replace(one, parts=np.roll(one.parts, -150, axis=0)), "30 s later than the force"),
    "navigation early": (lambda one: replace(one, parts=np.roll(one.parts, 50, axis=0)), "10 s earlier than the force"),
}


@pytest.mark.parametrize("name", WRONG)
def test_force_and_motion_that_contradict_each_other_are_refused(name: str) -> None:
    wrong, says = WRONG[name]
    with pytest.raises(FerryIdError, match=rf"milliampere\.toml: force and motion .*{says}.*Fix: correct the sign"):
        examine(wrong(pushed()))


RIGHT: dict[str, Callable[[Scene], Scene]] = {
    "as it is": lambda one: one,
    "one weak": lambda one: replace(one, parts=one.parts * [[[0.5], [1.0]]]),
    "one dead": lambda one: replace(one, parts=one.parts * [[[0.0], [1.0]]]),
    "late by what a delay may be": lambda one: replace(one, parts=np.roll(one.parts, -10, axis=0)),
    "of another trial": lambda one: replace(one, parts=one.parts[::-1].copy()),
    "at rest": lambda one: replace(one, nu_raw=0.0 * one.nu_raw),
    "idle": lambda one: replace(one, parts=0.0 * one.parts),
}


@pytest.mark.parametrize("name", RIGHT)
def test_what_is_not_certain_is_left_alone(name: str) -> None:
    assert opposed(RIGHT[name](pushed())) == ""
