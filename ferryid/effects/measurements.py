"""Measurements from logs: forces of the actuators, and signals bridged where nothing was measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ferryid.effects.force_model import ForceModel, Measurements, aboard
from ferryid.signals.track import Motion, Track
from ferryid.types import Flags, Floats
from ferryid.vessel import actuator_columns, applied_force
from ferryid.vessel.hull import current_in_body
from ferryid.vessel.profile import Profile
from ferryid.vessel.thrusters import propellers_before_rudders


def hull_force_model(measurements: Measurements, hull: Floats) -> ForceModel:
    """Return the force model of a hull in measurements, in the water and with the payload that were measured, and no air."""
    load = None if measurements.payload is None else aboard(measurements.payload)
    return ForceModel(
        measurements,
        hull,
        measurements.parts,
        measurements.angles,
        np.zeros((len(measurements.t), 3)),
        measurements.current,
        load,
    )


def actuator_forces(
    profile: Profile, columns: Mapping[str, Floats], through_water: Floats, usable: Flags
) -> tuple[Floats, Floats]:
    """Return the force of every actuator and the angles of azimuth thrusters on every row, bridged over gaps.

    Parameters
    ----------
    profile, columns
        The vessel, and the aligned signals of a log.
    through_water
        Velocities through the water, shape (n, 3).
    usable
        Rows on which everything was measured, shape (n,).

    Returns
    -------
    tuple
        Forces [N, N, N·m], shape (n, k, 3), and angles [rad], NaN for other actuators, shape (n, k).
    """
    chosen, _ = actuator_columns(profile, columns)
    parts, angles = [], []
    for actuator in profile.actuators:
        alone = replace(profile, actuators=(actuator,))
        parts.append(interpolate_gaps(applied_force(alone, columns, through_water)[0], usable))
        if actuator.kind == "azimuth":
            angle = columns[chosen[actuator.name, "angle"]]
            angles.append(interpolate_gaps(angle[:, None], usable)[:, 0])
        else:
            angles.append(np.full(len(usable), np.nan))
    return np.stack(parts, axis=1), np.column_stack(angles)


def actuation_of(profile: Profile, columns: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return `Measurements.actuation` of the aligned signals of a log."""
    meets_water = any(
        one.rudder or (one.thrust is not None and one.thrust.kind == "open_water") for one in profile.actuators
    )
    if not meets_water:
        return {}
    chosen, _ = actuator_columns(profile, columns)
    return {column: columns[column] for column in chosen.values()}


def at_velocity(measurements: Measurements) -> Measurements:
    """Return measurements whose actuators push as they do at the velocity that is there now, as after a correction."""
    if not measurements.actuation:
        return measurements
    flow, profile = measurements.current, measurements.profile
    through_water = (
        measurements.nu_raw if flow is None else measurements.nu_raw - current_in_body(flow, measurements.psi)
    )
    parts, _ = actuator_forces(profile, measurements.actuation, through_water, measurements.usable)
    rudders = rudder_states(profile, measurements.actuation, through_water, measurements.usable)
    return replace(measurements, parts=parts, rudders=rudders)


def rudder_states(
    profile: Profile, columns: Mapping[str, Floats], through_water: Floats, usable: Flags
) -> Floats | None:
    """Return `Measurements.rudders`, bridged over gaps; arguments of `actuator_forces`."""
    states = propellers_before_rudders(profile, columns, through_water)
    if states is None:
        return None
    return np.stack([interpolate_gaps(one, usable) for one in np.moveaxis(states, 1, 0)], axis=1)


def interpolate_gaps(values: Floats, usable: Flags, *, held: bool = False) -> Floats:
    """Return values with NaN replaced by what lies between, or was last, on usable rows; all NaN stays so."""
    result = values.copy()
    rows = np.arange(len(values))
    for column in result.T:
        missing = ~np.isfinite(column)
        known = np.flatnonzero(usable & ~missing)
        if not missing.any() or known.size == 0:
            continue
        if held:
            column[missing] = column[known[np.maximum(np.searchsorted(known, rows[missing]) - 1, 0)]]
        else:
            column[missing] = np.interp(rows[missing], known, column[known])
    return result


def measurements_of_motion(track: Track, motion: Motion, profile: Profile) -> Measurements:
    """Return a smoothed log as measurements, bridged where nothing was measured."""
    rows = motion.valid
    over_ground = motion.raw_nu
    through_water = (
        over_ground if motion.current is None else over_ground - current_in_body(motion.current, motion.eta[:, 2])
    )
    parts, angles = actuator_forces(profile, track.columns, through_water, np.ones_like(rows))
    return Measurements(
        profile=profile,
        t=motion.t,
        eta=interpolate_gaps(motion.eta, rows),
        nu_raw=interpolate_gaps(motion.raw_nu, rows),
        nu=interpolate_gaps(motion.nu, rows),
        parts=parts,
        angles=angles,
        usable=rows,
        wind=None if motion.wind is None else interpolate_gaps(motion.wind, rows),
        current=None if motion.current is None else interpolate_gaps(motion.current, rows),
        payload=None if motion.payload is None else interpolate_gaps(motion.payload, rows, held=True),
        rudders=rudder_states(profile, track.columns, through_water, np.ones_like(rows)),
        slopes=track.slopes,
    )


def payload_and_damping(force_model: ForceModel) -> Floats | None:
    """Return load and factor on the damping on every row, shape (n, 6), where there is either."""
    if force_model.load is None and force_model.damping_factor is None:
        return None
    n = len(force_model.measurements.t)
    load = np.zeros((n, 5)) if force_model.load is None else force_model.load
    return np.column_stack([load, np.ones(n) if force_model.damping_factor is None else force_model.damping_factor])
