"""Detection curves: against hand-worked cases, an independent regression, and a known truth, again and again."""

from __future__ import annotations

from math import exp, inf, log

import numpy as np
import pytest
from scipy.special import expit
from scipy.stats import norm
from sklearn.linear_model import LogisticRegression

from ferryid.errors import FerryIdError
from ferryid.validation.detection_curves import curve, ratio

SIZES = (0.25, 0.5, 1.0, 2.0, 4.0)
RELIABLE = 1.4


def runs(named: tuple[int, ...], each: int = 6) -> tuple[list[float], list[bool]]:
    """Return sizes and answers: so many of `each` runs named at every one of `SIZES`."""
    sizes = [size for size in SIZES for _ in range(each)]
    return sizes, [k < count for count in named for k in range(each)]


def test_two_sizes_without_a_prior_worked_by_hand() -> None:
    # With as many parameters as sizes the curve goes through the shares: logit 1/4 = -log 3 at 1, logit 3/4 = log 3 at e.
    sizes, named = [1.0] * 4 + [exp(1.0)] * 4, [True, False, False, False, True, True, True, False]
    made = curve(sizes, named, prior=False)
    slope = 2.0 * log(3.0)
    assert made.slope == pytest.approx(slope, rel=0.01)
    # The profile's top lies where logit 19/20 = log 19 is reached, beyond the sizes tried here.
    assert made.bound == "never"
    place = 0.5 + log(19.0) / slope
    assert made.low < exp(place) < made.high


@pytest.mark.slow
def test_without_a_prior_it_is_logistic_regression() -> None:
    rng = np.random.default_rng(1)
    x = rng.normal(size=200)
    named = rng.random(200) < expit(1.0 + 2.5 * x)
    other = LogisticRegression(C=1e9, tol=1e-10).fit(x[:, None], named)
    made = curve(np.exp(x).tolist(), named.tolist(), prior=False)
    assert made.size == pytest.approx(exp((log(19.0) - other.intercept_[0]) / other.coef_[0, 0]), rel=2e-3)
    assert made.slope == pytest.approx(other.coef_[0, 0], rel=5e-3)

    # Its interval: where fits that are held to a reliable size lose 1.92 of the logarithm of the likelihood.
    def lost(size: float) -> float:
        # Held to it, the logit is log 19 + slope (x - log size): a regression through a known point.
        slopes = np.linspace(0.1, 6.0, 2000)
        logit = log(19.0) + slopes[:, None] * (x - log(size))
        held = -np.logaddexp(0.0, np.where(named, -logit, logit)).sum(axis=1).min()
        free = other.decision_function(x[:, None])
        return float(-np.logaddexp(0.0, np.where(named, -free, free)).sum() - held)

    assert lost(made.low) == pytest.approx(1.9207, abs=0.02)
    assert lost(made.high) == pytest.approx(1.9207, abs=0.02)


@pytest.mark.slow
def test_perfect_separation_has_an_answer_between_the_sizes() -> None:
    made = curve(*runs((0, 0, 6, 6, 6)))
    assert made.size is not None
    assert 0.5 < made.low < made.size < made.high < 2.0
    assert made.slope < 20.0
    assert curve(*runs((0, 0, 6, 6, 6), each=6)).text.startswith("1")
    # More runs narrow it.
    many = curve(*runs((0, 0, 40, 40, 40), each=40))
    assert many.high / many.low < made.high / made.low


@pytest.mark.slow
def test_what_is_always_or_never_named_is_a_bound() -> None:
    always, never = curve(*runs((6, 6, 6, 6, 6))), curve(*runs((0, 0, 0, 0, 0)))
    assert (always.size, always.bound, always.low) == (None, "always", 0.0)
    assert always.high < 1.0
    assert (never.size, never.bound, never.high) == (None, "never", inf)
    assert never.low > 4.0
    assert never.text == "beyond the sizes tried (more than 4)"
    assert always.text == "below the sizes tried (less than 0.25)"
    # One in six is nowhere near 19 in 20.
    rare = curve(*runs((0, 0, 0, 0, 1)))
    assert rare.bound == "never"
    assert rare.low > 3.0


@pytest.mark.slow
@pytest.mark.parametrize("slope", [2.5, 5.0, 10.0])
def test_intervals_hold_a_known_size_as_often_as_they_say(slope: float) -> None:
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(80):
        size = np.repeat(SIZES, 6) * rng.uniform(0.9, 1.1, 30)
        named = rng.random(30) < expit(log(19.0) + slope * np.log(size / RELIABLE))
        made = curve(size.tolist(), named.tolist())
        held += made.low <= RELIABLE <= made.high
    assert held >= 0.9 * 80


@pytest.mark.slow
def test_the_ratio_of_two_known_sizes_is_held_as_often_as_it_says() -> None:
    rng = np.random.default_rng(3)
    held, values = 0, []
    for _ in range(30):
        size = np.repeat(SIZES, 8) * rng.uniform(0.9, 1.1, 40)
        hard = rng.standard_normal(40)
        also = 0.7 * hard + np.sqrt(1.0 - 0.49) * rng.standard_normal(40)
        answers = [
            (chance < norm.ppf(expit(log(19.0) + 6.0 * np.log(size / reliable)))).tolist()
            for chance, reliable in ((hard, 1.5), (also, 1.0))
        ]
        made = ratio(size.tolist(), *answers)
        held += made.low <= 1.5 <= made.high
        values += [] if made.value is None else [made.value]
    assert held >= 26
    assert float(np.median(values)) == pytest.approx(1.5, rel=0.15)


@pytest.mark.slow
def test_ratios_of_what_is_alike_and_of_bounds() -> None:
    sizes, half = runs((0, 0, 6, 6, 6))
    same = ratio(sizes, half, half)
    assert same.value == pytest.approx(1.0)
    assert same.low < 1.0 < same.high
    # The same logs, the same answers: nearer to each other than two tools that each saw logs of their own.
    mixed = ratio(sizes, half, [half[k - 1] if k % 6 else half[k] for k in range(30)])
    assert mixed.value == pytest.approx(1.0)
    behind = ratio(sizes, runs((0, 0, 0, 6, 6))[1], half)
    assert behind.value == pytest.approx(2.0, rel=0.05)
    never = ratio(sizes, [False] * 30, half)
    assert never.value is None
    assert never.high == inf
    assert never.low > 2.0
    assert ratio(sizes, half, [True] * 30).high == inf
    # One that is hardly ever named may need any size: what lies beyond those tried is extrapolated by nobody.
    many, often = runs((0, 0, 12, 12, 12), each=12)
    rare = ratio(many, runs((0, 0, 0, 2, 9), each=12)[1], often)
    assert (rare.value, rare.high) == (None, inf)


def test_sizes_of_nothing_have_no_curve() -> None:
    with pytest.raises(FerryIdError, match=r"positive sizes.*the smallest 0.*Fix:"):
        curve([0.0, 1.0], [False, True])
    with pytest.raises(FerryIdError, match=r"found 0 sizes"):
        curve([], [])
