"""A velocity of another scale is in proportion to the slope of the positions; one that is something else is not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from ferryid.diagnose.checks import velocity_scale
from ferryid.diagnose.data.estimate import Estimate


@pytest.mark.parametrize(
    ("low", "high", "doubt"),
    [
        (1.10, 1.20, ""),
        (0.77, 1.23, ""),
        # States of a filter in five bags of a boat had factors of 0.12 to 0.77, as surely unlike 1.
        (0.048, 0.209, "the factor is known to 63 % of itself only"),
        (-0.081, 0.318, "the factor is known to 168 % of itself only"),
    ],
)
def test_a_factor_that_is_hardly_known_is_none_of_an_instrument(
    monkeypatch: pytest.MonkeyPatch, low: float, high: float, doubt: str
) -> None:
    factor = Estimate(0.5 * (low + high), low, high, "-")
    found = SimpleNamespace(
        found=lambda index, least: True,
        evidence=lambda index: {},
        solution=SimpleNamespace(estimate=lambda index, unit: factor),
    )
    monkeypatch.setattr(velocity_scale, "kinematics", lambda measurements: found)
    measurements: Any = SimpleNamespace(step_s=0.1)
    finding = velocity_scale.find(measurements)
    assert finding is not None
    assert finding.doubt.startswith(doubt)
    assert bool(finding.doubt) == bool(doubt)
