"""Intervals along a ridge, against a posterior that can be written down: of two factors the log tells the product only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from ferryid.diagnose.inference.estimation import Candidate, fit
from ferryid.diagnose.inference.profile_likelihood import intervals
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats
from tests.diagnose.inference.test_estimation import PUSH, problem

pytestmark = pytest.mark.slow


def both(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """A constant force ahead, the product of two factors."""
    return replace(force_model, external=force_model.external + np.array([p[0] * p[1], 0.0, 0.0]))


FACTORS = Candidate(
    Effect("both", "Both", lambda profile: (), both, lambda v, i: "", lambda v, i: {}, profiled="a"),
    None,
    (Parameter("a", "-", 1.0, 0.0, 20.0, neutral=1.0), Parameter("b", "N", 50.0, -1e4, 1e4, start=20.0)),
)


def test_the_ridge_of_a_product_has_the_intervals_of_its_posterior() -> None:
    case = problem(90.0)
    # What the log says of the product alone, which is nearly all that a push of unknown size is.
    vague = replace(PUSH, parameters=(Parameter("force", "N", 1e4, -1e5, 1e5),))
    told = fit(case, [vague])
    product, error = float(told.values[0][0]), float(told.errors(0)[0])
    a = np.linspace(1e-3, 12.0, 40_000)
    # With b integrated out; all posteriors are widened.
    log_posterior = norm.logpdf(a, 1.0, 1.0) + norm.logpdf(product, 0.0, np.hypot(error, 50.0 * a))
    share = np.exp((log_posterior - log_posterior.max()) / INFERENCE.posterior_factor**2)
    low, high = np.interp([0.025, 0.975], np.cumsum(share) / share.sum(), a)
    kept = fit(case, [FACTORS])
    found = intervals(case, kept, 0)
    assert found["a"] == pytest.approx((low, high), rel=0.08)
    linear = kept.values[0][0] + 1.96 * kept.reported_errors(0)[0] * np.array([-1.0, 1.0])
    assert abs(linear[0] - low) > 0.3 * low, "a case in which the curvature at the top misleads"
    # Given a, b is normal; drawn at random.
    rng = np.random.default_rng(0)
    drawn = rng.choice(a, 200_000, p=share / share.sum())
    weight = drawn**2 / error**2 + 1.0 / 50.0**2
    b = drawn * product / error**2 / weight + INFERENCE.posterior_factor * rng.normal(size=len(drawn)) / np.sqrt(weight)
    assert found["b"] == pytest.approx(tuple(np.quantile(b, [0.025, 0.975])), rel=0.08)
