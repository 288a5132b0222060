"""What actuators do of which the orders alone are recorded: each follows its order by a first-order lag and a delay."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

import numpy as np

from ferryid.recursive_filter import lagged
from ferryid.types import Floats
from ferryid.vessel.profile import Profile, Signal
from ferryid.vessel.signal_map import canonical_columns
from ferryid.vessel.thrusters import actuator_columns


@dataclass(frozen=True)
class OrderResponse:
    """How an actuator follows its order: a first-order lag of `time_constant_s`, `delay_s` late."""

    time_constant_s: float = 0.0
    delay_s: float = 0.0

    @classmethod
    def of(cls, signal: Signal) -> OrderResponse:
        """Return what the profile states of an order; at once where it states nothing."""
        stated = (signal.time_constant_s, signal.delay_s)
        return cls(*(value if isfinite(value) else 0.0 for value in stated))

    def state(self, orders: Floats, step_s: float, *, turns: bool = False) -> Floats:
        """Return what an actuator does that follows orders, shape (n,).

        Orders are linear between rows. A gap is kept, and nothing runs through it: after it, as before the first row, the
        actuator stands where the first order has it, and what was ordered within the delay before is not known.

        Parameters
        ----------
        orders
            Shape (n,), NaN where none is known. Not changed.
        step_s
            Between two rows [s].
        turns
            True of an angle [rad], which goes the short way round.
        """
        state = np.full(len(orders), np.nan)
        known = np.isfinite(orders)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]])))
        for first, end in zip(edges[::2], edges[1::2], strict=True):
            part = np.unwrap(orders[first:end]) if turns else orders[first:end]
            rows = np.arange(end - first)
            since = rows[rows * step_s >= self.delay_s - 1e-9 * step_s]
            if not since.size:
                continue
            late = np.interp(since - self.delay_s / step_s, rows, part)
            state[first + since[0] : end] = (
                lagged(late, self.time_constant_s, step_s) if self.time_constant_s > 0.0 else late
            )
        return state


def orders_alone(profile: Profile) -> bool:
    """Return whether the forces are those of orders, as no actuator has another signal: what follows them late is unseen."""
    names = tuple(f"{one.name}." for one in profile.actuators)
    acting = [one.quantity for one in profile.signals if one.quantity.startswith(names)]
    return bool(acting) and all(one.endswith(".command") for one in acting)


def followed_orders(profile: Profile, columns: Mapping[str, Floats]) -> dict[str, Signal]:
    """Return the orders that forces follow from as there is no feedback: canonical column and signal."""
    signals = {canonical_columns(one)[0]: one for one in profile.signals if one.is_order}
    chosen, _ = actuator_columns(profile, columns)
    return {column: signals[column] for column in chosen.values() if column in signals}


def follow_orders(
    profile: Profile,
    columns: Mapping[str, Floats],
    rate_hz: float,
    responses: Mapping[str, OrderResponse] | None = None,
) -> dict[str, Floats]:
    """Return aligned columns with what actuators did in the place of the orders that stand in for feedback.

    Parameters
    ----------
    profile
        Vessel profile.
    columns
        Aligned columns, shape (n,) each.
    rate_hz
        Rows per second.
    responses
        How orders are followed, by their columns; None: as the profile states.

    Raises
    ------
    FerryIdError
        When an actuator has neither feedback nor order.
    """
    orders = followed_orders(profile, columns)
    if responses is None:
        responses = {column: OrderResponse.of(one) for column, one in orders.items() if one.states_response}
    found = dict(columns)
    for column, response in responses.items():
        if column in orders and response != OrderResponse():
            turns = orders[column].quantity.endswith(".angle.command")
            found[column] = response.state(np.asarray(columns[column], dtype=np.float64), 1.0 / rate_hz, turns=turns)
    return found
