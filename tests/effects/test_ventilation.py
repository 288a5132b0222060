"""A ventilating propeller, against values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.effects import effects
from ferryid.effects.actuator_force import along
from ferryid.effects.ventilation import WIDTH, constants, drawn, loading
from ferryid.errors import FerryIdError
from ferryid.simulate import parse_scenario
from ferryid.simulate.scenario import check_against
from ferryid.types import Floats
from ferryid.vessel import load_profile
from tests.effects.test_actuator_force import AHEAD, ASTERN, SWINGING, turning, vessel
from tests.effects.test_new_effect import STEPS

VENTILATION = effects()["ventilation"]


def at(loads: list[float]) -> Floats:
    """Return speeds at which the first propeller gives these shares of its largest force [%], negative astern [rpm]."""
    return np.sign(loads) * 1050.0 * np.sqrt(np.abs(loads) / 100.0)


def test_loading_is_the_force_over_the_largest_of_its_direction() -> None:
    np.testing.assert_allclose(loading(turning(at([25.0, 100.0, -25.0, 0.0])), 0), [25.0, 100.0, 25.0, 0.0], atol=1e-9)


def test_air_is_drawn_above_the_threshold_and_none_below() -> None:
    np.testing.assert_allclose(drawn(np.array([0.0, 50.0, 55.0, 60.0, 100.0]), 50.0), [0, 0, 0.5, 1, 1])


def test_force_drops_below_that_of_the_threshold_where_a_saturated_one_would_stay() -> None:
    before = turning(at([50.0, 60.0, 75.0, -50.0, -75.0]))
    after = along(VENTILATION.apply(before, np.array([0.4, 50.0, 0.0]), "port"), 0)
    ahead, astern = AHEAD * 1050.0**2, ASTERN * 1050.0**2
    np.testing.assert_allclose(after, [0.5 * ahead, 0.24 * ahead, 0.3 * ahead, -0.5 * astern, -0.3 * astern])
    assert after[1] < after[0] > after[2]


def test_neutral_changes_nothing_whatever_the_threshold() -> None:
    before = turning(np.linspace(-1050.0, 1050.0, 211))
    for threshold in (30.0, 60.0, 90.0):
        after = VENTILATION.apply(before, np.array([1.0, threshold, 2.0]), "port")
        np.testing.assert_allclose(after.parts, before.parts)


def test_air_gathers_in_a_disc_that_is_loaded_and_leaves_one_that_is_eased_off() -> None:
    loads = [20.0] * 10 + [80.0] * 60 + [20.0] * 60
    before = turning(at(loads))
    step_s, T = before.measurements.step_s, 4.0
    after = along(VENTILATION.apply(before, np.array([0.4, 50.0, T]), "port"), 0)
    left = after / (AHEAD * 1050.0**2 * np.array(loads) / 100.0)
    # Full force at first, then less by what has gathered since; and the force comes back as slowly.
    assert left[9] == pytest.approx(1.0)
    gathered = 1.0 - np.exp(-np.arange(10) * step_s / T)
    np.testing.assert_allclose(left[10:20], 1.0 - 0.6 * gathered, atol=0.6 * step_s / T)
    assert left[69] == pytest.approx(1.0 - 0.6 * (1.0 - np.exp(-60.0 * step_s / T)), abs=0.6 * step_s / T)
    assert left[70] < 1.0
    assert np.all(np.diff(left[71:]) > 0.0)
    assert not VENTILATION.by_row


def test_a_scenario_has_no_memory_and_says_so_of_one_that_asks_for_it() -> None:
    values = {"factor": 0.4, "from": 50.0, "time_constant": 1.2}
    (entry,) = VENTILATION.scenario(values, "port")["effects"]
    assert entry == {"effect": "ventilation", "thruster": "port", "factor": 0.4, "from": 50.0}
    asked = '[[effects]]\neffect = "ventilation"\nthruster = "thruster1"\ntime_constant = 1.2\n'
    with pytest.raises(FerryIdError, match=r'no parameter "time_constant".*use factor \[-\], from \[%\]$'):
        check_against(parse_scenario(f"{STEPS}{asked}", "t"), load_profile("milliampere"))


def test_only_its_own_propeller_ventilates() -> None:
    before = turning(at([80.0, -80.0]))
    after = VENTILATION.apply(before, np.array([0.4, 50.0, 0.0]), "bow")
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
    p = np.array([0.4, 45.0, 0.0, *constants(vessel(), "port")])
    assert p[3:] == pytest.approx((AHEAD * 1050.0**2, ASTERN * 1050.0**2))
    model = turning(np.linspace(-1050.0, 1050.0, 85))
    after = along(VENTILATION.apply(model, p[:3], "port"), 0)
    np.testing.assert_allclose([hook.thrust(p, 0.0, force) for force in along(model, 0).tolist()], after, atol=1e-9)


def test_limits_and_units() -> None:
    factor, threshold, memory = VENTILATION.parameters_of(vessel())
    assert (factor.low, factor.high, factor.neutral) == (0.0, 1.0, 1.0)
    assert threshold.high + WIDTH <= 100.0
    assert len({one.unit for one in (factor, threshold, memory)}) == 3
    assert memory.low == memory.neutral == 0.0
    assert VENTILATION.says({"factor": 0.4, "from": 55.0, "time_constant": 1.23}, "port").endswith(
        "draws air, which gathers, and leaves, with a time constant of 1.2 s."
    )
    assert VENTILATION.says({"factor": 0.4, "from": 55.0, "time_constant": 0.01}, "port") == (
        "Above 55 % of its largest force port keeps 40 % of the force of its thrust curve, as a propeller that draws air."
    )
