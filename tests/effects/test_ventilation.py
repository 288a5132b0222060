"""A ventilating propeller, against values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.effects import effects
from ferryid.effects.actuator_force import along
from ferryid.effects.ventilation import WIDTH, constants, left, loading
from ferryid.types import Floats
from tests.effects.test_actuator_force import AHEAD, ASTERN, SWINGING, turning, vessel

VENTILATION = effects()["ventilation"]


def at(loads: list[float]) -> Floats:
    """Return speeds at which the first propeller gives these shares of its largest force [%], negative astern [rpm]."""
    return np.sign(loads) * 1050.0 * np.sqrt(np.abs(loads) / 100.0)


def test_loading_is_the_force_over_the_largest_of_its_direction() -> None:
    np.testing.assert_allclose(loading(turning(at([25.0, 100.0, -25.0, 0.0])), 0), [25.0, 100.0, 25.0, 0.0], atol=1e-9)


def test_the_force_falls_above_the_threshold_and_is_untouched_below() -> None:
    np.testing.assert_allclose(
        left(np.array([0.0, 50.0, 55.0, 60.0, 100.0]), np.array([0.4, 50.0])), [1, 1, 0.7, 0.4, 0.4]
    )


def test_force_drops_below_that_of_the_threshold_where_a_saturated_one_would_stay() -> None:
    before = turning(at([50.0, 60.0, 75.0, -50.0, -75.0]))
    after = along(VENTILATION.apply(before, np.array([0.4, 50.0]), "port"), 0)
    ahead, astern = AHEAD * 1050.0**2, ASTERN * 1050.0**2
    np.testing.assert_allclose(after, [0.5 * ahead, 0.24 * ahead, 0.3 * ahead, -0.5 * astern, -0.3 * astern])
    assert after[1] < after[0] > after[2]


def test_neutral_changes_nothing_whatever_the_threshold() -> None:
    before = turning(np.linspace(-1050.0, 1050.0, 211))
    for threshold in (30.0, 60.0, 90.0):
        after = VENTILATION.apply(before, np.array([1.0, threshold]), "port")
        np.testing.assert_allclose(after.parts, before.parts)


def test_only_its_own_propeller_ventilates() -> None:
    before = turning(at([80.0, -80.0]))
    after = VENTILATION.apply(before, np.array([0.4, 50.0]), "bow")
    np.testing.assert_array_equal(after.parts, before.parts)


@pytest.mark.parametrize(
    ("speeds", "reason"),
    [
        (0.5 * SWINGING, "both less and more than 40 %"),
        (0.0 * SWINGING + 900.0, "both less and more than 40 %"),
        (0.0 * SWINGING, "both less and more than 40 %"),
    ],
)
def test_a_log_without_loads_on_both_sides_cannot_show_it(speeds: Floats, reason: str) -> None:
    assert reason in VENTILATION.untestable(turning(speeds).measurements)


def test_a_log_with_them_shows_it_of_that_propeller_only() -> None:
    measurements = turning(1.4 * SWINGING).measurements
    assert VENTILATION.testable_instances(measurements) == ("port",)


def test_the_simulated_propeller_does_what_the_estimate_assumes() -> None:
    hook = VENTILATION.simulated
    assert hook is not None
    assert hook.thrust is not None
    assert hook.constants is not None
    p = np.array([0.4, 45.0, *constants(vessel(), "port")])
    assert p[2:] == pytest.approx((AHEAD * 1050.0**2, ASTERN * 1050.0**2))
    model = turning(np.linspace(-1050.0, 1050.0, 85))
    after = along(VENTILATION.apply(model, p[:2], "port"), 0)
    np.testing.assert_allclose([hook.thrust(p, 0.0, force) for force in along(model, 0).tolist()], after, atol=1e-9)


def test_limits_and_units() -> None:
    factor, threshold = VENTILATION.parameters_of(vessel())
    assert (factor.low, factor.high, factor.neutral) == (0.0, 1.0, 1.0)
    assert threshold.high + WIDTH <= 100.0
    assert factor.unit != threshold.unit
    assert VENTILATION.says({"factor": 0.4, "from": 55.0}, "port") == (
        "Above 55 % of its largest force port keeps 40 % of the force of its thrust curve, as a propeller that draws air."
    )
