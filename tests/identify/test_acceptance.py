"""Acceptance: the rule at its edges, and the sentences that explain it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ferryid.identify.acceptance import accept


def judge(*ratios: float) -> tuple[bool, tuple[str, ...]]:
    base = np.array([100.0, 400.0, 2500.0])
    verdict = accept(base, base * ratios)
    return verdict.accepted, verdict.reasons


@pytest.mark.parametrize(
    ("ratios", "accepted"),
    [
        ((0.5, 0.5, 0.5), True),
        ((0.949, 0.949, 0.949), True),
        ((0.951, 0.951, 0.951), False),
        ((1.0, 1.0, 1.0), False),
        # The mean is what counts ...
        ((0.70, 1.04, 1.04), True),
        ((0.90, 1.04, 1.04), False),
        # ... unless one axis gets worse by more than 5 %.
        ((0.1, 0.1, 1.06), False),
    ],
)
def test_the_rule(ratios: tuple[float, float, float], accepted: bool) -> None:
    assert judge(*ratios)[0] is accepted


@pytest.mark.slow
@given(st.tuples(*[st.floats(0.01, 3.0)] * 3), st.tuples(*[st.floats(1e-3, 1e6)] * 3))
def test_the_scale_of_the_forces_does_not_matter(ratios: tuple[float, ...], sizes: tuple[float, ...]) -> None:
    base = np.array(sizes)
    verdict = accept(base, base * ratios)
    assert verdict.normalised_mse == pytest.approx(np.mean(ratios))
    np.testing.assert_allclose(list(verdict.per_axis.values()), ratios)
    clear = abs(np.mean(ratios) - 0.95) > 1e-9 and all(abs(ratio - 1.05) > 1e-9 for ratio in ratios)
    if clear:
        assert verdict.accepted == (np.mean(ratios) < 0.95 and max(ratios) < 1.05)


def test_reasons_carry_the_numbers() -> None:
    accepted, reasons = judge(0.2, 0.3, 0.4)
    assert accepted
    assert reasons == (
        "On held-out data the force error (MSE relative to the base model, mean of three axes) changes by -70.0 %: "
        "surge -80.0 %, sway -70.0 %, yaw -60.0 %.",
    )
    accepted, reasons = judge(0.2, 0.3, 1.44)
    assert not accepted
    assert reasons[0] == "Rejected: yaw gets worse, +44.0 % in MSE (50 to 60 N·m RMS); 5 % is allowed."
    accepted, reasons = judge(0.98, 0.98, 0.98)
    assert reasons[0].startswith("Rejected: a fall of 5 % or more is needed.")


def test_an_axis_without_error_decides_nothing_or_everything() -> None:
    spotless = accept(np.array([100.0, 0.0, 100.0]), np.array([10.0, 0.0, 10.0]))
    assert spotless.accepted
    assert spotless.per_axis["sway"] == 1.0
    assert any("In sway both models are without error" in reason for reason in spotless.reasons)
    spoilt = accept(np.array([100.0, 0.0, 100.0]), np.array([10.0, 4.0, 10.0]))
    assert not spoilt.accepted
    assert spoilt.per_axis["sway"] == np.inf
    assert any("in sway the base model makes no error and the new one 2 N RMS" in reason for reason in spoilt.reasons)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_an_error_that_is_no_number_rejects(wrong: float) -> None:
    for base, model in (([1.0, wrong, 1.0], [0.1, 0.1, 0.1]), ([1.0, 1.0, 1.0], [0.1, 0.1, wrong])):
        verdict = accept(np.array(base), np.array(model))
        assert not verdict.accepted
        assert any("is not a finite number" in reason for reason in verdict.reasons)
