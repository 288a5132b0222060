"""A load of the recording against one of the simulation: only the difference comes aboard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.simulation_baseline import (
    Condition,
    Simulation,
    differing_candidates,
    simulated_force_model,
)
from ferryid.effects import effects
from ferryid.effects.force_model import Measurements, hull_of
from ferryid.vessel import load_profile


def test_only_the_difference_to_the_simulations_load_comes_aboard() -> None:
    ferry = load_profile("milliampere")
    n, k = 1000, len(ferry.actuators)
    nu = np.tile([1.0, 0.0, 0.0], (n, 1))
    measurements = Measurements(
        profile=ferry, t=0.2 * np.arange(n), eta=np.zeros((n, 3)), nu_raw=nu, nu=nu, parts=np.zeros((n, k, 3)),
        angles=np.zeros((n, k)), usable=np.ones(n, dtype=bool),
    )  # fmt: skip
    payload = effects()["payload"]
    own = Candidate(payload, None, payload.parameters_of(ferry))
    hull = hull_of(ferry)
    simulated = Simulation(
        "s", measurements, hull, 0.1 * np.abs(hull), (Condition(own, np.array([300.0, 0.0]), np.zeros(2)),), ()
    )
    base, _ = simulated_force_model(simulated, measurements)
    late = replace(
        next(one for one in differing_candidates(simulated, measurements) if one.effect.id == "payload"), onset_s=100.0
    )
    for mass, taken in ((300.0, 0.0), (400.0, -100.0)):
        more = late.act(base, np.array([mass, 0.0])).external - base.external
        assert more.sum(axis=0)[0] * measurements.step_s == pytest.approx(taken)
