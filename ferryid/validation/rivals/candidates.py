"""The library of terms that sparse regression chooses from: what an analyst would write down who knows what may go wrong.

Each candidate is a unit of one piece of physics in a force model, so that its column holds all three axes and it has one
coefficient. What comes and goes by chance, as gusts and waves do, has no column and cannot be chosen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ferryid.effects import Effect, effects
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, between
from ferryid.types import Floats
from ferryid.validation.rivals.base import Base
from ferryid.vessel.frames import to_body

ONSETS = 11
"""Times at which a term may set in, evenly over the log, besides its start."""
MODERATE = 0.1
"""Share of a coefficient of the hull that is a unit of it: accelerations are not quite in proportion to masses."""
CELLS = 3
"""Cells of the grid over the visited waters along north and east each, in which damping may differ."""
WIND_MPS = 6.0
"""Speed of the wind whose load is a unit."""
LINEAR = (
    "azimuth_offset",
    "current",
    "heading_bias",
    "lever_arm",
    "thrust_inflow_loss",
    "thruster_gain",
    "thruster_interaction",
    "thruster_lag",
    "time_delay",
)
"""Effects that are nearly in proportion to their parameters, so that a moderate one is a unit of force."""
CONSTANT = "constant force"
"""How labels begin of what a wind or a mooring may be the cause of: a force that is constant over ground."""
ALIKE = 0.999
"""Correlation from which on a column is another's, and left out."""

Change = Callable[[ForceModel], ForceModel]


@dataclass(frozen=True)
class Candidate:
    """One term.

    Attributes
    ----------
    label
        Its name.
    effect, instance
        What it would speak for, an effect id and a thruster; an empty id where no physics has its form.
    unit
        The force model with a unit of it: another hull, load, damping, external force or, to be linearised, any change.
    onset_s
        When it sets in [s since the log's start].
    """

    label: str
    effect: str
    instance: str | None
    unit: Change
    onset_s: float = 0.0

    def added(self, base: Base) -> ForceModel:
        """Return the base model's force model with a unit of the term in it, thrusters and measurements as they were."""
        plain = base.force_model
        after = self.unit(plain)
        if (
            after.parts is not plain.parts
            or after.measurements is not plain.measurements
            or after.flow is not plain.flow
        ):
            after = replace(plain, external=plain.external + base.force_between(after))
        return between(plain, after, self.onset_s) if self.onset_s > 0.0 else after

    def column(self, base: Base) -> Floats:
        """Return the residual that a unit of the term leaves if it is left out [N, N, N·m], shape (n, 3)."""
        return -base.force_between(self.added(base))


def candidates(base: Base) -> tuple[Candidate, ...]:
    """Return the terms for a log; those that it cannot have are left out."""
    measurements = base.force_model.measurements
    times = measurements.t[base.rows]
    later = np.linspace(times[0], times[-1], ONSETS + 2)[1:-1].tolist()
    steady = [*_hull(base), *_effects(base), *_wind(base), *_places(base), *_constants()]
    stepping = [*_load(base), *_world(base), *(one for one in steady if one.effect == "thruster_gain")]
    return (
        *_load(base),
        *_world(base),
        *steady,
        *(
            replace(one, label=f"{one.label} from {onset_s:.0f} s", onset_s=onset_s)
            for one in stepping
            for onset_s in later
        ),
    )


def distinct_columns(columns: Floats) -> list[int]:
    """Return which columns, shape (m, k), are neither zero nor an earlier one again."""
    kept: list[int] = []
    size = np.sqrt((columns**2).sum(axis=0))
    unit = columns / np.where(size > 0.0, size, 1.0)
    for k in np.flatnonzero(size > 1e-9 * size.max(initial=0.0)).tolist():
        if not kept or np.abs(unit[:, kept].T @ unit[:, k]).max() < ALIKE:
            kept.append(k)
    return kept


def _hull(base: Base) -> Iterator[Candidate]:
    """Yield the damping of second order by axis, which fouling multiplies, and the hull's coefficients one by one."""
    fouling = effects()["fouling"]
    if not fouling.cannot(base.force_model.measurements):
        for j, axis in enumerate(("surge", "sway", "yaw")):
            factors = np.where(np.arange(3) == j, 2.0, 1.0)
            yield Candidate(f"damping of second order in {axis}", fouling.id, None, _applied(fouling, factors, None))
    known = base.force_model.hull
    for k, name in enumerate(COEFFICIENTS):
        unit = MODERATE * abs(known[k]) if known[k] else 1.0
        yield Candidate(name, "hull_parameters", None, partial(_with_coefficient, k, unit))


def _with_coefficient(k: int, unit: float, force_model: ForceModel) -> ForceModel:
    return replace(force_model, hull=force_model.hull + np.where(np.arange(len(COEFFICIENTS)) == k, unit, 0.0))


def _load(base: Base) -> Iterator[Candidate]:
    """Yield mass and its moment; the second moment is the hull's own inertia in yaw."""
    if effects()["payload"].cannot(base.force_model.measurements):
        return
    mass, place, *_ = (one.size for one in effects()["payload"].parameters_of(base.force_model.measurements.profile))
    for label, unit in (
        ("mass aboard", mass * np.array([1.0, 1.0, 0.0, 0.0, 0.0])),
        ("mass aboard times its place", mass * place * np.array([0.0, 0.0, 1.0, 1.0, 0.0])),
    ):
        yield Candidate(label, "payload", None, partial(_with_load, unit))


def _with_load(unit: Floats, force_model: ForceModel) -> ForceModel:
    return force_model.with_load(np.tile(unit, (len(force_model.measurements.t), 1)))


def _world(base: Base) -> Iterator[Candidate]:
    """Yield forces that are constant over ground, or in proportion to the place."""
    measurements = base.force_model.measurements
    cause = "wind" if measurements.wind is None else "mooring"
    for axis, label in enumerate(("north", "east")):
        yield Candidate(f"{CONSTANT} {label}", cause, None, partial(_pulled, axis, None))
    if effects()["mooring"].cannot(measurements):
        return
    start = measurements.eta[np.flatnonzero(base.rows)[0], :2]
    for axis, label in enumerate(("north", "east")):
        yield Candidate(f"spring {label}", "mooring", None, partial(_pulled, axis, float(start[axis])))


def _pulled(axis: int, start: float | None, force_model: ForceModel) -> ForceModel:
    """Add a force of 1 N along north or east, or one against the way from `start` of 1 N/m."""
    measurements = force_model.measurements
    pull = np.zeros((len(measurements.t), 2))
    pull[:, axis] = 1.0 if start is None else start - measurements.eta[:, axis]
    X, Y = to_body(pull[:, 0], pull[:, 1], measurements.psi)
    return replace(force_model, external=force_model.external + np.column_stack([X, Y, np.zeros_like(X)]))


def _wind(base: Base) -> Iterator[Candidate]:
    """Yield the parts of the wind's load that change sign with the wind, and those that do not, by direction.

    A moment by the heading takes their place where the profile does not know the areas.
    """
    measurements = base.force_model.measurements
    wind = effects()["wind"]
    if measurements.wind is not None:
        return
    if wind.cannot(measurements):
        for label, of in (("cos", np.cos), ("sin", np.sin)):
            for times in (1, 2):
                turned = partial(_turned, of, times)
                yield Candidate(f"moment times {label}({times} heading)", wind.id, None, turned)
        return
    for label, towards, sign in (
        ("odd in a wind north", (1.0, 0.0), -1.0),
        ("odd in a wind east", (0.0, 1.0), -1.0),
        ("even in a wind north", (1.0, 0.0), 1.0),
        ("even in a wind east", (0.0, 1.0), 1.0),
        ("even in a wind north-east", (np.sqrt(0.5), np.sqrt(0.5)), 1.0),
    ):
        yield Candidate(f"load {label}", wind.id, None, partial(_blown, WIND_MPS * np.array(towards), sign))


def _turned(of: Callable[[Floats], Floats], times: int, force_model: ForceModel) -> ForceModel:
    moment = of(times * force_model.measurements.psi)
    nothing = np.zeros_like(moment)
    return replace(force_model, external=force_model.external + np.column_stack([nothing, nothing, moment]))


def _blown(towards: Floats, sign: float, force_model: ForceModel) -> ForceModel:
    wind = effects()["wind"]
    with_it, against_it = (
        wind.act(force_model, one, None).external - force_model.external for one in (towards, -towards)
    )
    return replace(force_model, external=force_model.external + 0.5 * (with_it + sign * against_it))


def _effects(base: Base) -> Iterator[Candidate]:
    """Yield a moderate size of each parameter of the effects that are nearly linear."""
    measurements = base.force_model.measurements
    for effect in (effects()[name] for name in LINEAR):
        if effect.cannot(measurements):
            continue
        parameters = effect.parameters_of(measurements.profile)
        neutral = np.array([one.neutral for one in parameters])
        for instance in effect.instances(measurements.profile):
            for j, one in enumerate(parameters):
                values = neutral + np.where(np.arange(len(parameters)) == j, one.size, 0.0)
                label = " ".join(filter(None, (effect.id, instance, one.name)))
                yield Candidate(label, effect.id, instance, _applied(effect, values, instance))


def _applied(effect: Effect, values: Floats, instance: str | None) -> Change:
    def change(force_model: ForceModel) -> ForceModel:
        return effect.act(force_model, values, instance)

    return change


def _places(base: Base) -> Iterator[Candidate]:
    """Yield the damping in each cell of the visited waters."""
    measurements = base.force_model.measurements
    if effects()["shallow_water"].cannot(measurements):
        return
    place = measurements.eta[base.rows, :2]
    lines = np.linspace(place.min(axis=0), place.max(axis=0), CELLS + 1)
    for i in range(CELLS):
        for j in range(CELLS):
            low, high = (lines[i, 0], lines[j, 1]), (lines[i + 1, 0], lines[j + 1, 1])
            label = f"damping between {low[0]:.0f} and {high[0]:.0f} m north, {low[1]:.0f} and {high[1]:.0f} m east"
            yield Candidate(label, "shallow_water", None, partial(_damped, np.array(low), np.array(high)))


def _damped(low: Floats, high: Floats, force_model: ForceModel) -> ForceModel:
    place = force_model.measurements.eta[:, :2]
    inside = ((place >= low) & (place < high)).all(axis=1)
    return replace(force_model, damping_factor=np.where(inside, 2.0, 1.0))


def _constants() -> Iterator[Candidate]:
    """Yield a constant force along each axis of the vessel, for which no effect stands."""
    for j, axis in enumerate(("surge", "sway", "yaw")):
        yield Candidate(f"constant in {axis}", "", None, partial(_pushed, j))


def _pushed(j: int, force_model: ForceModel) -> ForceModel:
    return replace(force_model, external=force_model.external + np.eye(3)[j])
