"""Shallow water: all damping is multiplied in a place, and the added mass grows there, too.

Where that is, nobody says: a rectangle is chosen from a grid over the visited waters, and its sides are fitted. How much the
added mass grows is fitted as well and not told: without it, water that moves along would seem to be a load.
"""

from __future__ import annotations

from math import log
from typing import Any

import numpy as np

from ferryid.compiled import borrowing, compiled
from ferryid.effects.effect import Choice, Effect, Parameter, Residual, Values
from ferryid.effects.force_model import ForceModel, Measurements, added_mass, touches
from ferryid.effects.hull_spread import hull_model_spread
from ferryid.effects.linear_evidence import hull_jacobian, log_evidence_gains
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats, Ints
from ferryid.vessel.profile import Profile

EDGE_M = 2.0
"""Width over which the factor comes in at a side, outside of it."""
CELLS = 8
"""Cells of the grid along north and east each."""
FACTOR = Parameter("factor", "-", 0.4, 1.0, 6.0, neutral=1.0)
SIDES = ("south", "north", "west", "east")
HEAVIER = Parameter("added_mass", "-", 0.3, 0.0, 2.0, start=0.2)
"""Growth of the added mass over that of the damping."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the factor and the sides of the rectangle, that of a place a few lengths wide."""
    length = profile.hull.length_m if np.isfinite(profile.hull.length_m) else 5.0
    return (
        FACTOR,
        *(_side(name, sign * 2.0 * length, length, 100.0) for name, sign in zip(SIDES, (-1, 1, -1, 1), strict=True)),
        HEAVIER,
    )


def _side(name: str, at: float, size: float, reach: float = 1.0) -> Parameter:
    return Parameter(name, "m", size, at - reach * size, at + reach * size, neutral=at)


@borrowing
def _share(outside: float) -> float:
    s = 1.0 - min(max(outside / EDGE_M, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


@compiled
def _inside(eta: Floats, south: float, north: float, west: float, east: float) -> Floats:
    out = np.empty(eta.shape[0])
    for i in range(eta.shape[0]):
        x, y = eta[i, 0], eta[i, 1]
        out[i] = _share(south - x) * _share(x - north) * _share(west - y) * _share(y - east)
    return out


def inside(measurements: Measurements, sides: Floats) -> Floats:
    """Return how much of the factor acts in every row, 0 to 1, shape (n,)."""
    return _inside(np.ascontiguousarray(measurements.eta), *sides.tolist())


@touches("hull", "load", "damping_factor")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Multiply the damping in the place, and let the added mass grow."""
    growth = (float(p[0]) - 1.0) * inside(force_model.measurements, p[1:5])
    load = np.multiply.outer(growth, float(p[5]) * added_mass(force_model))
    return force_model.damped(1.0 + growth).with_load(load)


def choose(force_model: ForceModel, prior_hull: Floats, residual: Residual) -> Choice:
    """Return the place whose damping explains most of what is left, with its neighbours on the grid as the usual error."""
    measurements = force_model.measurements
    place = measurements.eta[:, :2]
    low, high = place[measurements.usable].min(axis=0), place[measurements.usable].max(axis=0)
    lines = np.linspace(low, high, CELLS + 1)
    cell = np.clip(((place - low) / np.maximum(high - low, 1e-9) * CELLS).astype(np.int64), 0, CELLS - 1)
    e = residual(force_model)
    # Columns of rectangles are sums of those of their cells.
    changes, cells, share = list[Floats](), list[tuple[int, int]](), np.zeros((CELLS, CELLS))
    for i in range(CELLS):
        for j in range(CELLS):
            rows = (cell[:, 0] == i) & (cell[:, 1] == j)
            share[i, j] = float(np.mean(rows[measurements.usable]))
            if share[i, j] > 0.0:
                changes.append((residual(force_model.damped(1.0 + 0.5 * rows)) - e) / 0.5)
                cells.append((i, j))
    shares = np.zeros((CELLS + 1, CELLS + 1))
    shares[1:, 1:] = share.cumsum(axis=0).cumsum(axis=1)
    a, b = np.triu_indices(CELLS + 1, 1)
    south, west = np.repeat(a, len(a)), np.tile(a, len(a))
    north, east = np.repeat(b, len(b)), np.tile(b, len(b))

    def covered(south: Ints, north: Ints, west: Ints, east: Ints) -> Floats:
        return np.asarray(shares[north, east] - shares[south, east] - shares[north, west] + shares[south, west])

    lower, upper = (
        (np.maximum(one - 1, 0) for one in (south, west)),
        (np.minimum(one + 1, CELLS) for one in (north, east)),
    )
    widest = [corner for pair in zip(lower, upper, strict=True) for corner in pair]
    fits = (covered(south, north, west, east) >= EFFECTS.least_place) & (covered(*widest) <= EFFECTS.most_place)
    if not fits.any():
        return Choice(parameters_of(measurements.profile), 0.0)
    south, north, west, east = south[fits], north[fits], west[fits], east[fits]
    J, linear = hull_jacobian(force_model, prior_hull, residual, np.flatnonzero(prior_hull).tolist())
    x, y = np.array(cells).T[:, :, None]
    inside_of = (south <= x) & (x < north) & (west <= y) & (y < east)
    spread = hull_model_spread(measurements.profile)
    gains = log_evidence_gains(J, linear, np.column_stack(changes), inside_of.astype(np.float64), FACTOR.size, spread)
    k = int(np.argmax(gains))
    sides = (lines[south[k], 0], lines[north[k], 0], lines[west[k], 1], lines[east[k], 1])
    sizes = np.repeat((high - low) / CELLS, 2)
    parameters = (_side(name, float(at), float(size)) for name, at, size in zip(SIDES, sides, sizes, strict=True))
    return Choice((FACTOR, *parameters, HEAVIER), log(len(gains)))


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show shallow water."""
    if unknown := measurements.profile.hull.why_unknown:
        return unknown
    return "" if np.isfinite(measurements.eta[measurements.usable, :2]).all() else "the log has no position"


def unreported(measurements: Measurements, p: Floats) -> frozenset[str]:
    """Return the sides beyond which the vessel hardly went, as the place may reach any farther there, and the added mass."""
    x, y = measurements.eta[measurements.usable, 0], measurements.eta[measurements.usable, 1]
    south, north, west, east = p[1:5].tolist()
    outside = (x < south, x > north, y < west, y > east)
    far = (name for name, rows in zip(SIDES, outside, strict=True) if float(np.mean(rows)) < EFFECTS.beyond_side)
    return frozenset({HEAVIER.name, *far})


def single_visit(measurements: Measurements, p: Floats) -> bool:
    """Tell whether the vessel was in the place a single time, or hardly: then it is a time as well as a place.

    Over a narrow strip it is hardly at all, but often: what else comes and goes does not do so at every visit.
    """
    there = inside(measurements, p[1:5])[measurements.usable] > 0.5
    entered = int(there[0]) + int(np.count_nonzero(there[1:] & ~there[:-1]))
    hardly = float(np.mean(there)) < EFFECTS.least_place and entered < EFFECTS.many_visits
    return entered < 2 or hardly


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence; sides that the log does not tell are left out."""
    where = [
        text
        for low, high, axis in (("south", "north", "north"), ("west", "east", "east"))
        if (text := _between(values.get(low), values.get(high), axis))
    ]
    place = f" {' and '.join(where)}," if where else " in some of these waters,"
    return f"Damping is {values['factor']:.2f} times as large{place} as over shallow ground."


def _between(low: float | None, high: float | None, axis: str) -> str:
    if low is not None and high is not None:
        return f"from {low:.0f} to {high:.0f} m {axis}"
    if low is not None:
        return f"from {low:.0f} m {axis} on"
    return "" if high is None else f"up to {high:.0f} m {axis}"


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's shallow rectangle."""
    sides = {"north_m": [values["south"], values["north"]], "east_m": [values["west"], values["east"]]}
    return {"environment": {"shallow": {**sides, "damping_factor": values["factor"], "edge_m": EDGE_M}}}


EFFECT = Effect(
    "shallow_water",
    "Shallow water",
    parameters_of,
    apply,
    says,
    scenario,
    cannot=cannot,
    choose=choose,
    unreported=unreported,
    single_visit=single_visit,
    in_part=True,
    negligible=EFFECTS.least_shallow,
    changes_hull=True,
    rare_in=("tank", "sea"),
    common_in=("pond", "harbour"),
    acts_last=True,
)
