"""The closed loop, compiled: measure, guide, control, allocate, and let the vessel move on."""

from __future__ import annotations

from typing import NamedTuple

from ferryid.compiled import compiled
from ferryid.simulate.control.allocation import Allocation, allocate
from ferryid.simulate.control.feedforward import Feedforward
from ferryid.simulate.control.guidance import Guidance, guide
from ferryid.simulate.control.manoeuvres import Helm, helm
from ferryid.simulate.control.pid import Pid, desired_force
from ferryid.simulate.control.reference import Tuning, advance_reference, body_reference
from ferryid.simulate.noise import NavErrors, measure
from ferryid.simulate.plant.hull import State
from ferryid.simulate.plant.motion import Plant, advance
from ferryid.types import Flags, Floats, Ints

OBSERVED = 9
ROW = 7 + OBSERVED
"""Columns of the truth before those of the thrusters: time, state, and what `advance` writes."""
RECORD = 25
"""Columns of the control's record before those of the thrusters."""


class Loop(NamedTuple):
    """All that stays as it is during a run; `open_loop` is True where a manoeuvre takes the controller's place."""

    plant: Plant
    guidance: Guidance
    tuning: Tuning
    pid: Pid
    feedforward: Feedforward
    allocation: Allocation
    helm: Helm
    open_loop: bool
    errors: NavErrors


class Memory(NamedTuple):
    """What changes from cycle to cycle, besides the state of the hull; written to in place."""

    thrusters: Floats
    orders: Floats
    guidance: Floats
    reference: Floats
    integral: Floats
    helm: Floats


class Measured(NamedTuple):
    """What the sensors add, one row a control cycle: errors of the navigation (m, 6), whether it sent anything (m,), and
    wind, current [m/s, north and east] and payload [kg, m] as the feedforward gets them, (m, 2) each."""

    noise: Floats
    sent: Flags
    wind: Floats
    current: Floats
    payload: Floats


@compiled
def run(loop: Loop, memory: Memory, measured: Measured, h: float, steps: int, rows: Floats, records: Floats) -> None:
    """Run the loop to the end of `records`.

    An order takes effect one step after the measurement that it answers, which stands for the way from the sensors
    through the controller.

    Parameters
    ----------
    loop, memory, measured
        See there.
    h
        Integration step [s].
    steps
        Steps per control cycle.
    rows
        Truth, one row a step, shape (m * steps, ROW + 2 k), overwritten.
    records
        What the controller did, one row a cycle, shape (m, RECORD + 2 k), overwritten.
    """
    plant = loop.plant
    k = len(memory.orders)
    acting = memory.orders.copy()
    before = memory.orders.copy()
    orders = memory.orders
    cycle = h * steps
    state: State = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    eta, nu = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    saturated = False
    for m in range(len(records)):
        t = m * cycle
        first = m * steps
        _write_state(rows[first], t, state)
        if measured.sent[m] or m == 0:
            eta, nu = measure(loop.errors, measured.noise[m], _past(rows, first, loop.errors.delay_s / h))
        _copy(orders, before)
        tau_d, ahead, goal = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (eta[0], eta[1], eta[2])
        if loop.open_loop:
            helm(loop.helm, memory.helm, t, eta, nu, orders)
        else:
            goal = guide(loop.guidance, memory.guidance, t, eta)
            advance_reference(loop.tuning, memory.reference, goal, cycle)
            tau_d, ahead = desired_force(
                loop.pid,
                loop.feedforward,
                memory.reference,
                memory.integral,
                eta,
                nu,
                (measured.wind[m, 0], measured.wind[m, 1]),
                (measured.current[m, 0], measured.current[m, 1]),
                (measured.payload[m, 0], measured.payload[m, 1]),
                cycle,
                saturated,
            )
            saturated = allocate(loop.allocation, tau_d, before, orders)
        nu_d = body_reference(memory.reference)[0]
        record = records[m]
        record[0], record[1] = t, t + h
        for i in range(3):
            record[2 + i], record[5 + i] = eta[i], nu[i]
            record[8 + i] = goal[i]
            record[11 + i] = memory.reference[0, i]
            record[14 + i] = nu_d[i]
            record[17 + i], record[20 + i] = tau_d[i], ahead[i]
        record[23] = 1.0 if saturated else 0.0
        record[24] = 1.0 if measured.sent[m] or m == 0 else 0.0
        for i in range(k):
            record[RECORD + i], record[RECORD + k + i] = orders[i, 0], orders[i, 1]
        for j in range(steps):
            row = rows[first + j]
            _write_state(row, t + j * h, state)
            index = 2 * (first + j)
            for i in range(k):
                row[ROW + i], row[ROW + k + i] = memory.thrusters[i, 0], memory.thrusters[i, 1]
            _delay(plant.gear.delay, records, first + j, steps, acting)
            state = advance(plant, index, h, state, memory.thrusters, acting, row[7:ROW])
            _copy(orders, acting)


@compiled
def _copy(orders: Floats, into: Floats) -> None:
    # An assignment of slices would bring in, and compile, all that makes the text of its errors.
    for i in range(len(orders)):
        into[i, 0], into[i, 1] = orders[i, 0], orders[i, 1]


@compiled
def _delay(delay: Ints, records: Floats, step: int, steps: int, acting: Floats) -> None:
    """Put earlier orders in the place of those that act in a step, where actuators follow them later than one step.

    `delay` is in steps, shape (k, 2); `steps` of them are a cycle, whose orders stand in its row of `records`.
    """
    k = len(acting)
    for i in range(k):
        for j in range(2):
            if delay[i, j] > 0:
                given = step - 1 - delay[i, j]
                acting[i, j] = records[given // steps, RECORD + j * k + i] if given >= 0 else 0.0


@compiled
def _write_state(row: Floats, t: float, state: State) -> None:
    row[0] = t
    for i in range(6):
        row[1 + i] = state[i]


@compiled
def _past(rows: Floats, now: int, back: float) -> State:
    """Return the state `back` steps before row `now`, the first one before the start; linear between rows."""
    place = max(now - back, 0.0)
    low = min(int(place), now)
    high = min(low + 1, now)
    share = place - low
    a, b = rows[low], rows[high]
    return (
        a[1] + share * (b[1] - a[1]),
        a[2] + share * (b[2] - a[2]),
        a[3] + share * (b[3] - a[3]),
        a[4] + share * (b[4] - a[4]),
        a[5] + share * (b[5] - a[5]),
        a[6] + share * (b[6] - a[6]),
    )
