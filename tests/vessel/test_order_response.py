"""Orders that are followed late: what an actuator does by its profile, across gaps and angles, and what a profile may state."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.vessel import describe, follow_orders, parse_profile
from ferryid.vessel.order_response import OrderResponse, followed_orders
from ferryid.vessel.profile import Profile
from ferryid.vessel.thrusters import actuator_columns
from tests.vessel.conftest import STERN_BOAT

STEP_S = 0.1
T = np.arange(0.0, 12.0, STEP_S)
THRUST = 'thrust = { kind = "quadratic", ahead = 0.01 }'
ANGLE = '[signals."stern.angle.command"]\ntopic = "/order"\nfield = "angle"\nunit = "rad"\n'
ORDER = '[signals."stern.speed.command"]\ntopic = "/order"\nfield = "n"\nunit = "rpm"\n'
MEASURED = '[signals."stern.speed"]\ntopic = "/state"\nfield = "n"\nunit = "rpm"\n'


def boat(speed: str, angle: str = "") -> Profile:
    return parse_profile(STERN_BOAT.format(kind="azimuth", more=THRUST) + ANGLE + angle + speed, "boat.toml")


@pytest.mark.parametrize(("time_constant_s", "delay_s"), [(0.7, 0.0), (0.0, 0.4), (0.7, 0.4), (0.5, 0.25)])
def test_a_ramp_is_followed_late_by_time_constant_and_delay(time_constant_s: float, delay_s: float) -> None:
    """Of a ramp, a first-order lag is its time constant late once it has begun to follow, and a delay at once."""
    state = OrderResponse(time_constant_s, delay_s).state(3.0 * T, STEP_S)
    late = T - delay_s
    known = late >= -1e-9
    assert np.isnan(state[~known]).all()
    begun = time_constant_s * np.exp(-(late - late[known][0]) / time_constant_s) if time_constant_s else 0.0
    expected = 3.0 * (late - time_constant_s + begun)
    np.testing.assert_allclose(state[known], expected[known], atol=1e-9)


def test_orders_that_are_followed_at_once_are_the_state() -> None:
    orders = np.where(T > 3.0, 400.0, np.nan)
    np.testing.assert_array_equal(OrderResponse().state(orders, STEP_S), orders)


def test_nothing_runs_through_a_gap() -> None:
    """After a gap the actuator stands where the first order has it; what was ordered within the delay before is not known."""
    orders = np.where(T < 5.0, 100.0, 900.0)
    orders[(T >= 4.0) & (T < 6.0)] = np.nan
    state = OrderResponse(1.0, 0.5).state(orders, STEP_S)
    np.testing.assert_array_equal(np.isnan(state), (T < 0.5 - 1e-9) | ((T > 4.0 - 1e-9) & (T < 6.5 - 1e-9)))
    np.testing.assert_allclose(state[T > 6.5 - 1e-9], 900.0)
    np.testing.assert_allclose(state[(T >= 0.5) & (T < 4.0 - 1e-9)], 100.0)
    short = np.full(10, np.nan)
    short[2:5] = 1.0
    assert np.isnan(OrderResponse(0.0, 1.0).state(short, STEP_S)).all(), "a stretch that is shorter than the delay"


def test_an_angle_goes_the_short_way_round() -> None:
    orders = np.where(T < 1.0, np.radians(170.0), np.radians(-170.0))
    state = OrderResponse(0.5).state(orders, STEP_S, turns=True)
    assert np.min(np.abs(state)) > np.radians(169.0)
    assert np.min(np.abs(OrderResponse(0.5).state(orders, STEP_S))) < np.radians(20.0)


def test_orders_that_stand_in_for_feedback_alone_are_followed_as_stated() -> None:
    columns = {"n_cmd_stern": 100.0 * (T > 1.0), "n_stern": 90.0 * (T > 1.0), "alpha_cmd_stern": 0.0 * T}
    stated = boat(ORDER + "time_constant_s = 0.5\ndelay_s = 0.2\n")
    found = follow_orders(stated, columns, 1.0 / STEP_S)
    np.testing.assert_array_equal(found["n_cmd_stern"], OrderResponse(0.5, 0.2).state(columns["n_cmd_stern"], STEP_S))
    assert found["alpha_cmd_stern"] is columns["alpha_cmd_stern"], "nothing is stated of the angle"
    assert follow_orders(boat(ORDER), columns, 1.0 / STEP_S)["n_cmd_stern"] is columns["n_cmd_stern"]
    both = boat(ORDER + "time_constant_s = 0.5\n" + MEASURED)
    assert follow_orders(both, columns, 1.0 / STEP_S)["n_cmd_stern"] is columns["n_cmd_stern"]
    assert set(followed_orders(both, columns)) == {"alpha_cmd_stern"}


def test_an_order_that_is_stated_to_be_followed_at_once_is_stated() -> None:
    at_once = boat(ORDER + "time_constant_s = 0\n").signals[-1]
    assert at_once.states_response
    assert OrderResponse.of(at_once) == OrderResponse()
    assert not boat(ORDER).signals[-1].states_response


def test_notes_and_page_say_how_an_order_is_followed() -> None:
    columns = {"n_cmd_stern": T, "alpha_cmd_stern": T}
    stated = boat(ORDER + "time_constant_s = 0.5\ndelay_s = 0.2\n", "delay_s = 0\n")
    assert actuator_columns(stated, columns)[1] == (
        "The speed of stern is the order, as there is no feedback, followed with a time constant of 0.5 s and a delay of "
        "0.2 s, as the profile states.",
        "The angle of stern is the order, as there is no feedback, followed at once, as the profile states.",
    )
    assert "rpm, followed with a time constant of 0.5 s and a delay of 0.2 s" in describe(stated)
    assert "followed" not in describe(boat(ORDER))


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        (ORDER + "time_constant_s = -0.1\n", '"time_constant_s" must be at least 0 and at most 60, found -0.1'),
        (ORDER + "delay_s = nan\n", '"delay_s" must be at least 0 and at most 60, found nan'),
        (ORDER + "delay_s = 61\n", "at most 60, found 61"),
        (ORDER + 'delay_s = "1"\n', '"delay_s" must be a number, found a string'),
        (MEASURED + "delay_s = 0.2\n", '"delay_s" is of an order, and stern.speed is what was measured'),
        (ORDER + "time_constant = 0.2\n", 'Did you mean "time_constant_s"'),
    ],
)
def test_what_cannot_be_stated_of_an_order(lines: str, told: str) -> None:
    with pytest.raises(FerryIdError) as caught:
        boat(lines)
    assert told in str(caught.value)
    assert "Fix:" in str(caught.value)
