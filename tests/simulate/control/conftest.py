"""Scenarios and models for the tests of this folder, without files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.identify.adaptive.averaging import unknown_scores
from ferryid.models.model import Model
from ferryid.regression.bases.basis import make_basis
from ferryid.simulate.paths import set_points
from ferryid.simulate.scenario import Scenario
from ferryid.vessel import load_profile

CORNERS = ((0.0, 0.0, 0.0), (30.0, 0.0, 0.0), (30.0, 20.0, 90.0))


@pytest.fixture
def scenario():
    """Return a function that makes a scenario of poses [m, m, deg], 60 s each, and of sections by name."""

    def made(poses=CORNERS, **sections):
        return replace(Scenario("test", "test", "milliampere", set_points(tuple(poses), 60.0), 60.0, 0, 1), **sections)

    return made


@pytest.fixture
def model():
    """Return a function that makes a model of a named basis with random coefficients."""

    def made(name, seed=0, **changes):
        functions = make_basis(name)
        K = len(functions.terms)
        rng = np.random.default_rng(seed)
        theta, intercept = 100.0 * rng.normal(size=(K, 3)), 10.0 * rng.normal(size=3)
        plain = Model(
            name="boat",
            version=3,
            created="2026-01-01T00:00:00Z",
            ferryid_version="0.1.0",
            profile_text=load_profile("milliampere").text,
            scale={"delta": 0.4, "sigma": 0.6, "zeta": 1.1},
            settings={"basis": name, "structure": "coupled", "components": 7, "window_s": 1.0},
            terms=functions.terms,
            units=functions.units,
            theta=theta,
            intercept=intercept,
            low=theta,
            high=theta,
            intercept_low=intercept,
            intercept_high=intercept,
            covariance=np.zeros((3, K + 1, K + 1)),
            ranges={},
            training=(),
            scores=unknown_scores(),
            accepted=True,
        )
        return replace(plain, **changes)

    return made
