"""Fits and evidence against cases that can be worked out: linear ones against the formula, noise against its own law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import multivariate_normal

from ferryid.diagnose.hypothesis import Suspect, Trial, fit
from ferryid.diagnose.noise import ORDER, Noise, noise_of
from ferryid.diagnose.weak import windows
from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.picture import Picture, Scene, hull_of
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Floats

FERRY = load_profile("milliampere")


def push(picture: Picture, p: Floats, instance: str | None) -> Picture:
    """A constant force ahead: exactly linear."""
    return replace(picture, external=picture.external + np.array([p[0], 0.0, 0.0]))


PUSH = Suspect(
    Effect("push", "Push", lambda profile: (), push, lambda v, i: "", lambda v, i: {}),
    None,
    (Parameter("force", "N", 50.0, -1e4, 1e4),),
)


def trial(true_force: float, noise: float, seed: int = 0) -> Trial:
    """A vessel held at rest, pushed by a force that its noisy acceleration is said to show; noise white by definition."""
    t = np.arange(0.0, 300.0, 0.2)
    zero = np.zeros((len(t), 3))
    scene = Scene(
        FERRY, t, zero, zero, zero, np.zeros((len(t), 2, 3)), np.zeros((len(t), 2)), np.ones(len(t), dtype=bool)
    )
    seen = windows(scene, 8.0, 2.0)
    measured = seen.measured + noise * np.random.default_rng(seed).standard_normal(seen.measured.shape)
    measured[:, 0] += true_force / FERRY.hull.M[0, 0]
    seen = replace(seen, measured=measured)
    plain = Picture(seen.scene, hull_of(FERRY), seen.scene.parts, seen.scene.angles, np.zeros((len(seen.scene.t), 3)))
    white = Noise(np.zeros((3, ORDER)), np.eye(3) / noise)
    # Next to no freedom of the hull, so that the case stays the linear one of the formula.
    return Trial(seen, plain, white, np.full(22, 1e-9))


def test_a_linear_hypothesis_has_the_mean_spread_and_evidence_of_the_formula() -> None:
    noise, size = 0.01, 50.0
    case = trial(60.0, noise)
    found, nothing = fit(case, [PUSH]), fit(case, [])
    y = case.windows.measured[ORDER:, 0] * FERRY.hull.M[0, 0]
    sigma = noise * FERRY.hull.M[0, 0]
    precision = len(y) / sigma**2 + 1.0 / size**2
    mean, spread = y.sum() / sigma**2 / precision, precision**-0.5
    np.testing.assert_allclose(found.values[0], mean, rtol=1e-3)
    np.testing.assert_allclose(found.errors(0), spread, rtol=1e-3)
    shared = multivariate_normal(np.zeros(len(y)), sigma**2 * np.eye(len(y)) + size**2 * np.ones((len(y), len(y))))
    alone = multivariate_normal(np.zeros(len(y)), sigma**2 * np.eye(len(y)))
    np.testing.assert_allclose(
        found.evidence - nothing.evidence, shared.logpdf(y) - alone.logpdf(y), rtol=1e-3, atol=1e-2
    )


def test_limits_are_kept() -> None:
    narrow = replace(PUSH, parameters=(Parameter("force", "N", 50.0, -5.0, 5.0),))
    assert fit(trial(60.0, 0.01), [narrow]).values[0] == 5.0


def test_an_onset_leaves_what_was_before_it_alone() -> None:
    late = replace(PUSH, onset_s=150.0)
    case = trial(0.0, 0.01)
    after = late.act(case.plain, np.array([30.0]))
    rows = case.plain.scene.t >= 150.0
    assert (after.external[~rows, 0] == 0.0).all()
    assert (after.external[rows, 0] == 30.0).all()


def test_noise_is_white_once_its_own_autoregression_is_taken_off() -> None:
    random = np.random.default_rng(1)
    n, mix = 4000, np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 2.0]])
    kicks = random.standard_normal((n, 3)) @ mix.T
    series = np.zeros((n, 3))
    for k in range(2, n):
        series[k] = 0.9 * series[k - 1] - 0.3 * series[k - 2] + kicks[k]
    runs = ((0, n // 2), (n // 2, n))
    learnt = noise_of(series, runs)
    np.testing.assert_allclose(learnt.coefficients[:, :2], [[0.9, -0.3]] * 3, atol=0.06)
    white = learnt.white(series, runs).reshape(-1, 3)
    np.testing.assert_allclose(white.T @ white / len(white), np.eye(3), atol=0.02)
    assert abs(np.corrcoef(white[1:, 0], white[:-1, 0])[0, 1]) < 0.05
    columns = np.stack([series, 2.0 * series], axis=-1)
    both = learnt.white(columns, runs)
    np.testing.assert_allclose(both[:, 1], 2.0 * both[:, 0])
    np.testing.assert_allclose(both[:, 0], learnt.white(series, runs))
