"""A fitted model as the plant against the same model as it is exported, which shares no code with the plant."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ferryid.export.exported import exported
from ferryid.export.formats import formats
from ferryid.models.model import Model
from ferryid.simulate import parse_scenario
from ferryid.simulate.sections import Payload, Waves, Wind
from ferryid.simulate.vessel_model import sailed_by
from tests.export.models import SHA, States, fitted, states

TRIAL = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
duration_s = 60
path = { kind = "four-corner", dwell_s = 15 }
"""
FORCE = (300.0, -200.0, 150.0)
NOTHING = (0.0, 0.0)
MODELS = {
    "modulus": fitted("modulus", "decoupled", delta=0.7, sigma=1.6, seed=3),
    "thesis": fitted("thesis", "decoupled", delta=0.4, sigma=0.4, zeta=1.25, seed=2),
    "wind": fitted("modulus+wind-paper", "decoupled", delta=1.1, zeta=0.8, seed=6),
    "lift": fitted("lift", "decoupled", delta=0.9, zeta=1.1, seed=13),
}


def module_of(model: Model) -> SimpleNamespace:
    """Return the functions of the exported Python module."""
    namespace: dict[str, object] = {"__name__": "vessel"}
    exec(compile(formats()["python"].render(exported(model, SHA)), "vessel.py", "exec"), namespace)
    return SimpleNamespace(**namespace)


def accelerations(adrift, model: Model, state: States) -> np.ndarray:
    """Return those of the plant under `FORCE` in each state."""
    sailing = sailed_by(parse_scenario(TRIAL, "t"), model)
    found = []
    for row in state.rows:
        run = adrift(
            sailing.vessel,
            seconds=0.02,
            terms=sailing.terms,
            wind=Wind(*(row["wind"] or NOTHING)),
            payload=(Payload(*(row["payload"] or NOTHING)),),
        )
        _, rows = run.push((0.0, 0.0, row["psi"], *row["nu"]), FORCE, 0.02)
        found.append(rows[0, 6:9])
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_it_moves_as_the_exported_model_says(adrift, name: str) -> None:
    model = MODELS[name]
    module = module_of(model)
    for state in states(model):
        # In a current the hull's coefficients act through the water, a fit's over ground.
        if state.current is not None:
            continue
        wanted = [
            module.acceleration(FORCE, row["nu"], row["psi"], row["wind"] or NOTHING, None, row["payload"])
            for row in state.rows
        ]
        np.testing.assert_allclose(accelerations(adrift, model, state), wanted, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_a_vessel_whose_force_is_measured_at_half_moves_alike(adrift) -> None:
    fit = fitted("modulus", "decoupled")
    bare = replace(fit, theta=0.0 * fit.theta, intercept=np.zeros(3))
    found = []
    for zeta in (1.0, 2.0):
        sailing = sailed_by(parse_scenario(TRIAL, "t"), replace(bare, scale={"delta": 1.0, "sigma": 1.0, "zeta": zeta}))
        run = adrift(
            sailing.vessel,
            seconds=4.0,
            terms=sailing.terms,
            wind=Wind(6.0, -4.0),
            waves=Waves(significant_height_m=0.3),
            payload=(Payload(400.0, 1.0, 2.0),),
        )
        _, rows = run.push((0.0, 0.0, 0.3, 0.8, -0.2, 0.1), tuple(np.divide(FORCE, zeta)), 4.0)
        found.append(rows[:, :9])
    np.testing.assert_allclose(*found, rtol=1e-9, atol=1e-12)
