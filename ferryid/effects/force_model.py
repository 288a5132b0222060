"""What was measured of a vessel, and a model of the forces that move it.

An effect takes a force model and returns another, in which its own physics acts. Effects so combine in any number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import cos, inf, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.cached import cached_property
from ferryid.counts import counted
from ferryid.effects.equations_of_motion import accelerations, along_vessel, from_antenna, required, slopes
from ferryid.effects.wind_loads import shape_of, steady_wind_force, weighed_loads
from ferryid.types import Flags, Floats, Ints
from ferryid.vessel.hull import payload_mass
from ferryid.vessel.profile import Profile

MASS = ("m11", "m22", "m23", "m32", "m33")
SURGE = ("X_u", "X_|u|u", "X_uuu")
SWAY = ("Y_v", "Y_|v|v", "Y_|r|v", "Y_vvv", "Y_r", "Y_|v|r", "Y_|r|r")
YAW = ("N_v", "N_|v|v", "N_|r|v", "N_r", "N_|v|r", "N_|r|r", "N_rrr")
LIFT = ("Y_uv", "Y_ur", "N_uv", "N_ur")
"""Circulatory lift of a hull that moves ahead, on sway and yaw."""
COEFFICIENTS = (*MASS, *SURGE, *SWAY, *YAW, *LIFT)
"""Order of the hull's coefficients in `ForceModel.hull`."""
UNITS = (
    *("kg", "kg", "kg·m", "kg·m", "kg·m²"),
    *("kg/s", "kg/m", "kg·s/m²"),
    *("kg/s", "kg/m", "kg", "kg·s/m²", "kg·m/s", "kg", "kg·m"),
    *("kg·m/s", "kg", "kg·m", "kg·m²/s", "kg·m", "kg·m²", "kg·m²·s"),
    *("kg/m", "kg", "kg", "kg·m"),
)
"""Units of `COEFFICIENTS`, radians left out."""
_NO_FLOW, _NO_LOAD, _NO_FACTOR = np.empty((0, 2)), np.empty((0, 5)), np.empty(0)
_ONE_WIND = np.ones(1)


@dataclass(frozen=True, eq=False)
class Measurements:
    """What was measured, n rows on a uniform grid, and the vessel that it was measured on.

    Attributes
    ----------
    profile
        The vessel.
    t
        Time [s], shape (n,).
    eta
        North, east [m] and heading [rad, unwrapped] as measured, shape (n, 3).
    nu_raw, nu
        Velocities over ground as measured and lightly smoothed [m/s, m/s, rad/s], shape (n, 3).
    parts
        Force of each actuator on the hull [N, N, N·m], shape (n, k, 3).
    angles
        Measured angle of each azimuth thruster [rad], NaN for other actuators, shape (n, k).
    wind, current
        Where air and water go to, north and east [m/s], shape (n, 2), or None where not measured.
    payload
        Mass [kg] and place [m] aboard, shape (n, 2), or None.
    usable
        Rows on which everything was measured, shape (n,).
    rudders
        Thrust of one propeller before deduction [N] and angle of the rudder behind it [rad], NaN for actuators without a
        rudder, shape (n, k, 2), or None for a vessel without one.
    slopes
        Which of `u, v, r` nothing measured: they are slopes of the position or heading, and have its errors.
    repeats
        Where old values were repeated and taken out before: places of the channels among the columns of `eta` and `nu_raw`,
        and times of the last right sample before and of the first one after [s].
    actuation
        Aligned signals of the actuators, by column, where their force depends on the velocity; empty where none does.
    """

    profile: Profile
    t: Floats
    eta: Floats
    nu_raw: Floats
    nu: Floats
    parts: Floats
    angles: Floats
    usable: NDArray[np.bool_]
    wind: Floats | None = None
    current: Floats | None = None
    payload: Floats | None = None
    rudders: Floats | None = None
    slopes: frozenset[str] = frozenset()
    repeats: tuple[tuple[tuple[int, ...], float, float], ...] = ()
    actuation: Mapping[str, Floats] = field(default_factory=dict)

    @property
    def step_s(self) -> float:
        """Distance of two rows [s]."""
        return float(self.t[1] - self.t[0])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the actuators, in the order of `parts`."""
        return tuple(actuator.name for actuator in self.profile.actuators)

    def seen_twice(self, axis: int) -> bool:
        """Return whether a motion in surge (0), sway (1) or yaw (2) shows in two sensors: in the pose, and in a velocity."""
        placed = bool(np.isfinite(self.eta[self.usable, :2]).all())
        return placed and "uvr"[axis] not in self.slopes

    @property
    def psi(self) -> Floats:
        """Heading [rad], shape (n,)."""
        return self.eta[:, 2]

    @cached_property
    def modelled(self) -> Flags:
        """Which of `COEFFICIENTS` the profile's hull has, shape (26,)."""
        return np.asarray(hull_of(self.profile) != 0.0)

    @cached_property
    def pointing(self) -> tuple[Floats, Floats]:
        """Cosine and sine of the heading, shape (n,) each."""
        return np.cos(self.psi), np.sin(self.psi)

    @cached_property
    def directions(self) -> tuple[Floats, Floats]:
        """Cosine and sine of the measured angles of azimuth thrusters, shape (n, k) each."""
        return np.cos(self.angles), np.sin(self.angles)

    @cached_property
    def wind_loads(self) -> dict[tuple[bytes, float], Floats]:
        """Loads that were worked out already, by what tells them apart; see `ferryid.effects.wind.mean_load`."""
        return {}

    @cached_property
    def air_load(self) -> Floats:
        """Load of the wind that was measured, of still air where none was [N, N, N·m], shape (n, 3)."""
        if self.profile.wind is None:
            return np.zeros((len(self.t), 3))
        if self.wind is None:
            return wind_load(self, np.zeros(2))
        return wind_load_by_row(self, self.wind, np.zeros((1, 2)), _ONE_WIND)


@dataclass(frozen=True)
class ForceModel:
    """Measurements with a model of the forces that act.

    Attributes
    ----------
    measurements
        What was measured.
    hull
        Coefficients in the order of `COEFFICIENTS`, shape (26,).
    parts, angles
        As in the measurements, with what the effects make of them.
    external
        All other forces on the hull [N, N, N·m], shape (n, 3).
    flow
        Where the water goes to, north and east [m/s], shape (n, 2), or None for still water.
    load
        What is added to the mass matrix: m11, m22 [kg], m23, m32 [kg·m], m33 [kg·m²], shape (n, 5), or None.
    damping_factor
        Factor on all damping, shape (n,), or None.
    air
        Where an air flow goes to that is imagined and not measured, north and east [m/s], shape (2,), or (n, 2) where every
        row has its own, or None; its load is among the external forces.
    air_factors
        Those on the load that the profile tells of it, surge, sway and yaw, shape (3,), or None for one each.
    gust_std
        Standard deviation of gusts about that flow, of north and east each [m/s].
    ambient
        Those of the external forces that follow from what was measured: ``ambient(measurements)``, shape (n, 3), or None.
    turned
        Angle from the axes that the navigation measures along to the vessel's, counterclockwise [rad].
    antenna
        What the navigation measures the motion of, ahead and to starboard of the body origin [m].
    """

    measurements: Measurements
    hull: Floats
    parts: Floats
    angles: Floats
    external: Floats
    flow: Floats | None = None
    load: Floats | None = None
    damping_factor: Floats | None = None
    air: Floats | None = None
    air_factors: Floats | None = None
    gust_std: float = 0.0
    ambient: Callable[[Measurements], Floats] | None = None
    turned: float = 0.0
    antenna: tuple[float, float] = (0.0, 0.0)

    def replaced(self, **changes: Any) -> ForceModel:
        """Return it with other attributes: `dataclasses.replace` in a tenth of the time, as fits ask some 100,000 times."""
        assert changes.keys() <= self.__dict__.keys(), changes.keys()
        made = object.__new__(ForceModel)
        made.__dict__.update(self.__dict__, **changes)
        return made

    def with_load(self, load: Floats) -> ForceModel:
        """Return it with more added to the mass matrix, shape (n, 5)."""
        return self.replaced(load=load if self.load is None else self.load + load)

    def damped(self, factor: Floats) -> ForceModel:
        """Return it with all damping multiplied by a factor, shape (n,)."""
        return self.replaced(damping_factor=factor if self.damping_factor is None else self.damping_factor * factor)


Action = Callable[[ForceModel, Floats, str | None], ForceModel]
"""What an effect does to a force model, with parameters and instance."""


def touches(*names: str) -> Callable[[Action], Action]:
    """Tell of what an effect does which attributes of a force model it reads or changes, beside the measurements that it reads.

    A fit that moves the parameters of another effect then need not have it done again where none of these has moved. It is told
    with the function, so that an effect in which another stands in its place does not say what is no longer so.
    """

    def told(action: Action) -> Action:
        vars(action)["touches"] = frozenset({"measurements", *names})
        return action

    return told


def hull_of(profile: Profile) -> Floats:
    """Return the coefficients of a profile's hull in the order of `COEFFICIENTS`, zero where unknown."""
    M, D = profile.hull.M, profile.hull.D
    mass = (M[0, 0], M[1, 1], M[1, 2], M[2, 1], M[2, 2])
    return np.array([*mass, *(D.get(name, 0.0) for name in COEFFICIENTS[5:])], dtype=np.float64)


def flow_along_vessel(force_model: ForceModel) -> Floats:
    """Return the water's velocity over ground along the vessel's x and y axes [m/s], shape (n, 2); no rows for still water."""
    if force_model.flow is None:
        return _NO_FLOW
    check_rows(force_model)
    return along_vessel(np.ascontiguousarray(force_model.flow, dtype=np.float64), *force_model.measurements.pointing)


def check_rows(force_model: ForceModel) -> None:
    """Refuse a force model whose parts have other rows than its motion: compiled code does not look where an array ends.

    Raises
    ------
    ValueError
        With the lengths that differ.
    """
    measurements = force_model.measurements
    n, nu, parts = len(measurements.t), measurements.nu, force_model.parts
    flow, load, factor = force_model.flow, force_model.load, force_model.damping_factor
    if (
        len(measurements.eta) == n
        and nu.shape == (n, 3)
        and len(parts) == n
        and parts.shape[2:] == (3,)
        and len(force_model.external) == n
        and (flow is None or len(flow) == n)
        and (load is None or len(load) == n)
        and (factor is None or len(factor) == n)
    ):
        return
    rows = {len(one) for one in (measurements.eta, nu, parts, force_model.external)}
    rows |= {len(one) for one in (flow, load, factor) if one is not None}
    raise ValueError(f"a force model of {counted(n, 'row')} has parts of other lengths: {sorted(rows - {n})}")


def check_actuators(force_model: ForceModel) -> None:
    """Refuse a force model that has not the force of every actuator, and as `check_rows`.

    Raises
    ------
    ValueError
        With how many it has, or the lengths that differ.
    """
    check_rows(force_model)
    found, known = force_model.parts.shape[1], len(force_model.measurements.profile.actuators)
    if found < known:
        raise ValueError(f"a force model has forces of {found} of {counted(known, 'actuator')}")


def acceleration(force_model: ForceModel) -> Floats:
    """Return the acceleration over ground that a force model gives at the measured velocities, shape (n, 3).

    ``M nu_dot = tau + external - C(nu_r) nu_r - D(nu_r) nu_r``, with ``[r v_c, -r u_c, 0]`` added for the water that the body
    frame turns through; Fossen (2021), section 10.3.
    """
    measurements = force_model.measurements
    parts = np.ascontiguousarray(force_model.parts)
    return accelerations(np.ascontiguousarray(measurements.nu), force_model.hull, parts, *_forces(force_model))


def hull_changes(force_model: ForceModel, places: Ints, moves: Floats) -> Floats:
    """Return by how much `as_measured` changes if coefficients of the hull move one by one, shape (n, 3, q).

    Parameters
    ----------
    force_model
        n rows.
    places, moves
        Which of `COEFFICIENTS` move, and by how much, shape (q,) each.
    """
    parts = np.ascontiguousarray(force_model.parts)
    changes = slopes(
        places, moves, np.ascontiguousarray(force_model.measurements.nu), force_model.hull, parts, *_forces(force_model)
    )
    return _from_antenna(force_model, changes)


def moved_coefficient(before: ForceModel, after: ForceModel) -> int | None:
    """Return which coefficient of the hull is all that differs in another force model; None where more does, or nothing."""
    moved = np.flatnonzero(before.hull != after.hull)
    if len(moved) != 1:
        return None
    others = ((one, vars(after)[name]) for name, one in vars(before).items() if name != "hull")
    same = all(old is new or (isinstance(old, np.ndarray) and np.array_equal(old, new)) for old, new in others)
    return int(moved[0]) if same else None


def unloaded(force_model: ForceModel) -> bool:
    """Return whether masses are those of a force model's hull alone, and felt where its origin is."""
    return force_model.load is None and force_model.antenna == (0.0, 0.0) and force_model.turned == 0.0


def plainly_damped(force_model: ForceModel) -> bool:
    """Return whether a force model is `unloaded` and its damping that of its hull in still water."""
    return unloaded(force_model) and force_model.flow is None and force_model.damping_factor is None


def corrected(force_model: ForceModel, measurements: Measurements) -> ForceModel:
    """Return the force model with corrected measurements, and with the ambient forces that follow from these."""
    if force_model.ambient is None:
        return force_model.replaced(measurements=measurements)
    more = force_model.ambient(measurements) - force_model.ambient(force_model.measurements)
    return force_model.replaced(measurements=measurements, external=force_model.external + more)


def as_measured(force_model: ForceModel) -> Floats:
    """Return `acceleration` as the navigation would measure it: that of its antenna, along its own axes, shape (n, 3)."""
    rates = acceleration(force_model)
    return _from_antenna(force_model, rates[:, :, None])[:, :, 0]


def _from_antenna(force_model: ForceModel, rates: Floats) -> Floats:
    """Turn accelerations, shape (n, 3, q), into those that the navigation measures, in place."""
    if force_model.antenna != (0.0, 0.0) or force_model.turned != 0.0:
        from_antenna(rates, *force_model.antenna, cos(force_model.turned), sin(force_model.turned))
    return rates


def required_force(force_model: ForceModel, nu_dot: Floats) -> Floats:
    """Return the force that the actuators need for an acceleration over ground [N, N, N·m], shape (n, 3).

    The inverse of `acceleration`: what `parts` add up to plays no part.

    Parameters
    ----------
    force_model
        Hull, water, load and all other forces.
    nu_dot
        Shape (n, 3) [m/s², m/s², rad/s²].
    """
    nu = np.ascontiguousarray(force_model.measurements.nu)
    return required(np.ascontiguousarray(nu_dot), nu, force_model.hull, *_forces(force_model))


def _forces(force_model: ForceModel) -> tuple[Floats, Floats, Floats, Floats]:
    """Return external forces, flow along the vessel's axes, load, and factor on damping, for the equations of motion."""
    check_rows(force_model)
    flow = flow_along_vessel(force_model)
    load = _NO_LOAD if force_model.load is None else force_model.load
    factor = _NO_FACTOR if force_model.damping_factor is None else force_model.damping_factor
    external, flow, load, factor = map(np.ascontiguousarray, (force_model.external, flow, load, factor))
    return external, flow, load, factor


def added_mass(force_model: ForceModel) -> Floats:
    """Return the part of a force model's mass matrix that is not the rigid body's, as a load, shape (5,)."""
    hull = force_model.measurements.profile.hull
    moment = hull.mass_kg * hull.x_g_m
    return np.asarray(force_model.hull[:5] - [hull.mass_kg, hull.mass_kg, moment, moment, hull.inertia_z])


def aboard(payload: Floats) -> Floats:
    """Return the load of a force model, shape (n, 5), by masses and their places as of `payload_mass`, shape (n, 2)."""
    return payload_mass(payload)[:, [0, 1, 1, 2, 2], [0, 1, 2, 1, 2]]


def wind_load(measurements: Measurements, air: Floats, weights: Floats = _ONE_WIND) -> Floats:
    """Return the load of a wind that is steady over ground, on a vessel with wind areas [N, N, N·m], shape (n, 3).

    Parameters
    ----------
    measurements
        Of the vessel.
    air
        Where it goes to, north and east [m/s], shape (2,); or several winds, shape (w, 2), whose loads are summed.
    weights
        Of the load of each, shape (w,).
    """
    areas = measurements.profile.wind
    assert areas is not None
    winds = np.ascontiguousarray(np.atleast_2d(air), dtype=np.float64)
    return steady_wind_force(areas, winds, weights, *measurements.pointing, np.ascontiguousarray(measurements.nu))


def wind_load_by_row(measurements: Measurements, air: Floats, away: Floats, weights: Floats) -> Floats:
    """Return the load of a wind that every row has of its own [N, N, N·m], shape (n, 3).

    Parameters
    ----------
    measurements
        Of a vessel with wind areas.
    air
        Where it goes to, north and east [m/s], shape (n, 2).
    away, weights
        Winds about it, shape (w, 2), whose loads are summed with these weights, shape (w,).
    """
    areas = measurements.profile.wind
    assert areas is not None
    winds, nu = np.ascontiguousarray(air, dtype=np.float64), np.ascontiguousarray(measurements.nu)
    # Compiled code does not look where an array ends.
    if len(winds) != len(nu):
        raise ValueError(f"{counted(len(nu), 'row')} with {counted(len(winds), 'wind')}")
    return weighed_loads(winds, away, weights, *measurements.pointing, nu, shape_of(areas))


def between(
    before: ForceModel, after: ForceModel, onset_s: float, offset_s: float = inf, impulse: Floats | None = None
) -> ForceModel:
    """Return the second force model from an onset until an offset [s], else the first, with the second's hull.

    `impulse` is a momentum by row, as of `ferryid.effects.effect.Effect`; that of the first row of the onset acts there.
    """
    first, end = np.searchsorted(before.measurements.t, (onset_s, offset_s)).tolist()
    if impulse is not None and 0 < first < end:
        external = after.external.copy()
        external[first] += impulse[first] / before.measurements.step_s
        after = after.replaced(external=external)

    def mixed(old: Floats, new: Floats) -> Floats:
        if old is new:
            return new
        made = old.copy()
        made[first:end] = new[first:end]
        return made

    def either(old: Floats | None, new: Floats | None, blank: float = 0.0) -> Floats | None:
        known = new if old is None else old
        if known is None or old is new:
            return new
        made = np.full(known.shape, blank) if old is None else old.copy()
        made[first:end] = blank if new is None else new[first:end]
        return made

    return after.replaced(
        parts=mixed(before.parts, after.parts),
        angles=mixed(before.angles, after.angles),
        external=mixed(before.external, after.external),
        flow=either(before.flow, after.flow),
        load=either(before.load, after.load),
        damping_factor=either(before.damping_factor, after.damping_factor, 1.0),
    )
