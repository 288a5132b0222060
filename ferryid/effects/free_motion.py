"""The motion that a force model gives by itself, from states that were measured, compiled."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from ferryid.compiled import borrowing, compiled
from ferryid.effects.equations_of_motion import acceleration_in
from ferryid.effects.force_model import ForceModel, check_rows
from ferryid.types import Floats, Ints


def run_freely(force_model: ForceModel, starts: Ints, stride: int, steps: int, largest: float) -> Floats:
    """Return states from some rows on, by Heun's rule: pose and velocity over ground, shape (steps + 1, s, 6).

    Parameters
    ----------
    force_model
        Its forces are those of the rows that are passed; beyond the last row, those of the last.
    starts
        Rows where the runs begin, as measured, shape (s,).
    stride, steps
        Rows in a step, and how many steps.
    largest
        What diverges stays at this size [m, rad, m/s, rad/s].
    """
    measurements = force_model.measurements
    check_rows(force_model)
    begin = np.hstack([np.nan_to_num(measurements.eta[starts]), measurements.nu[starts]])
    flow = np.empty((0, 2)) if force_model.flow is None else force_model.flow
    load = np.empty((0, 5)) if force_model.load is None else force_model.load
    factor = np.empty(0) if force_model.damping_factor is None else force_model.damping_factor
    every = (force_model.hull, force_model.parts, force_model.external, flow, load, factor)
    return _run(begin, starts, stride, steps, stride * measurements.step_s, largest, *map(np.ascontiguousarray, every))


@borrowing
def _rates(
    i: int,
    state: Floats,
    hull: Floats,
    parts: Floats,
    external: Floats,
    flow: Floats,
    load: Floats,
    factor: Floats,
    out: Floats,
) -> None:
    """Fill in the derivatives of a state under the forces of a row, shape (6,) each; `flow` is north and east."""
    cosine, sine = cos(state[2]), sin(state[2])
    u, v, r = state[3], state[4], state[5]
    along, across = 0.0, 0.0
    if flow.shape[0] > 0:
        along = cosine * flow[i, 0] + sine * flow[i, 1]
        across = cosine * flow[i, 1] - sine * flow[i, 0]
    a, b, c = acceleration_in(i, u - along, v - across, r, hull, parts, external, load, factor)
    out[0], out[1], out[2] = cosine * u - sine * v, sine * u + cosine * v, r
    # The body frame turns through the water.
    out[3], out[4], out[5] = a + r * across, b - r * along, c


@compiled
def _run(
    begin: Floats,
    starts: Ints,
    stride: int,
    steps: int,
    step_s: float,
    largest: float,
    hull: Floats,
    parts: Floats,
    external: Floats,
    flow: Floats,
    load: Floats,
    factor: Floats,
) -> Floats:
    path = np.empty((steps + 1, begin.shape[0], 6))
    last = external.shape[0] - 1
    rate, after, moved = np.empty(6), np.empty(6), np.empty(6)
    for i in range(begin.shape[0]):
        path[0, i] = begin[i]
        _rates(min(starts[i], last), begin[i], hull, parts, external, flow, load, factor, rate)
        for k in range(steps):
            row = min(starts[i] + (k + 1) * stride, last)
            for j in range(6):
                moved[j] = path[k, i, j] + step_s * rate[j]
            _rates(row, moved, hull, parts, external, flow, load, factor, after)
            for j in range(6):
                value = path[k, i, j] + 0.5 * step_s * (rate[j] + after[j])
                # Not by min and max, of which a value that is not a number would come as a bound.
                if value > largest:
                    value = largest
                elif value < -largest:
                    value = -largest
                path[k + 1, i, j] = value
            _rates(row, path[k + 1, i], hull, parts, external, flow, load, factor, rate)
    return path
