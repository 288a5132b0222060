"""Forces of propellers, and the force that all actuators of a vessel apply together."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted, per_cent
from ferryid.errors import FerryIdError
from ferryid.types import Floats
from ferryid.vessel.profile import Actuator, Profile, Signal, ThrustCurve
from ferryid.vessel.rudder import inflow_speed, rudder_force

FRESH_WATER = 1000.0
"""Density of water [kg/m³] where an actuator states none."""

SLOW, FAST = 0.03, 3.0
"""Parts of the highest speed of a thrust curve below which a propeller as good as rests, and which none exceeds for long."""

ROLE_PREFIX = {"speed": "n", "angle": "alpha", "rudder": "delta", "force": "F", "thrust": "F"}
"""Role of an actuator's signal to the prefix of its column."""


def thrust(
    curve: ThrustCurve,
    n_rpm: Floats,
    *,
    advance_mps: Floats | float = 0.0,
    diameter_m: float = math.nan,
    water_density: float = FRESH_WATER,
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the thrust of one propeller and where its speed lay outside the curve's range.

    Parameters
    ----------
    curve
        Thrust curve: polynomial (thesis (4.1)), table (linear between entries), quadratic ``a n|n|`` or open water
        ``T = rho n² D⁴ K_T(J)`` with ``J = u_a/(n D)``.
    n_rpm
        Propeller speed, positive ahead [rpm], shape (n,).
    advance_mps
        Speed of the water into the propeller [m/s]; only the open-water curve uses it.
    diameter_m, water_density
        Propeller diameter [m] and density [kg/m³]; only for the open-water curve.

    Returns
    -------
    force
        Thrust [N], shape (n,); NaN where the speed is NaN.
    clipped
        True where the speed was clipped to the curve's range, shape (n,).
    """
    speed = np.asarray(n_rpm, dtype=np.float64)
    if curve.input_unit == "rps":
        speed = speed / 60.0
    low, high = curve.valid
    clipped = (speed < low) | (speed > high)
    speed = np.clip(speed, low, high)
    if curve.kind == "polynomial":
        force = speed * np.polynomial.polynomial.polyval(speed, np.asarray(curve.coefficients))
    elif curve.kind == "table":
        force = np.interp(speed, curve.table[0], curve.table[1])
    elif curve.kind == "quadratic":
        force = np.where(speed >= 0.0, curve.ahead, curve.astern) * speed * np.abs(speed)
    else:
        force = _open_water(curve, speed, advance_mps, diameter_m, water_density)
    return force, clipped


def _open_water(
    curve: ThrustCurve, n_rps: Floats, advance_mps: Floats | float, diameter_m: float, water_density: float
) -> Floats:
    """Thrust from K_T(J) ahead; astern the coefficient is constant, as open-water tables end at n = 0."""
    safe = np.where(n_rps > 0.0, n_rps, np.inf)
    advance = np.clip(advance_mps / (safe * diameter_m), curve.table[0][0], curve.table[0][-1])
    k_t = np.where(n_rps >= 0.0, np.interp(advance, curve.table[0], curve.table[1]), -curve.astern)
    force: Floats = water_density * diameter_m**4 * n_rps**2 * k_t
    return force


def force_at(actuator: Actuator, force: Floats, angle_rad: Floats | float) -> Floats:
    """Return ``[F cos a, F sin a, l_x F sin a - l_y F cos a]``, shape (n, 3) [N, N, N·m]; section 2.4."""
    x_m, y_m = actuator.position_m
    surge = force * np.cos(angle_rad)
    sway = force * np.sin(angle_rad)
    return np.stack([surge, sway, x_m * sway - y_m * surge], axis=-1)


def needed_roles(actuator: Actuator) -> tuple[tuple[str, ...], ...]:
    """Return the signals an actuator needs: each entry lists alternatives, the preferred first."""
    strength = {
        "force": ("force",),
        "propeller_rudder": ("thrust", "speed"),
    }.get(actuator.kind, ("force", "thrust", "speed"))
    turn = {"azimuth": (("angle",),), "propeller_rudder": (("rudder",),)}.get(actuator.kind, ())
    return (strength, *turn)


def order_note(profile: Profile, name: str, role: str) -> str:
    """Say that an order stands in for the feedback of an actuator, and how it is followed."""
    order = next((one for one in profile.signals if one.quantity == f"{name}.{role}.command"), None)
    stated = response_words(order) if order is not None else ""
    how = f", followed {stated}, as the profile states" if stated else ": its lag stays in the residual"
    return f"The {role} of {name} is the order, as there is no feedback{how}."


def response_words(signal: Signal) -> str:
    """Return how the profile states that an order is followed, to stand after "followed"; empty where it states nothing."""
    parts = [
        f"a {what} of {value:g} s"
        for what, value in (("time constant", signal.time_constant_s), ("delay", signal.delay_s))
        if math.isfinite(value) and value > 0.0
    ]
    return f"with {' and '.join(parts)}" if parts else "at once" * signal.states_response


def actuator_columns(
    profile: Profile, available: Collection[str], *, measured: bool = True
) -> tuple[dict[tuple[str, str], str], tuple[str, ...]]:
    """Choose the column for each role of each actuator: feedback first, the order where there is no feedback.

    Parameters
    ----------
    profile
        Vessel profile.
    available
        Names of the columns at hand.
    measured
        False prefers orders to feedback.

    Returns
    -------
    columns
        ``{(actuator name, role): column name}``.
    notes
        One sentence for each order that stands in for feedback.

    Raises
    ------
    FerryIdError
        When an actuator has neither feedback nor order.
    """
    mapped = {signal.quantity for signal in profile.signals}
    chosen: dict[tuple[str, str], str] = {}
    notes: list[str] = []
    for actuator in profile.actuators:
        for roles in needed_roles(actuator):
            candidates = []
            for order in (False, True) if measured else (True, False):
                for role in roles:
                    suffix = ".command" if order else ""
                    column = f"{ROLE_PREFIX[role]}{'_cmd' if order else ''}_{actuator.name}"
                    if f"{actuator.name}.{role}{suffix}" in mapped and column in available:
                        candidates.append((role, column, order))
            if not candidates:
                raise FerryIdError(
                    f"{profile.path}: the {roles[-1]} of {actuator.name} is needed for the applied force, found "
                    f'neither feedback nor order. Fix: map [signals."{actuator.name}.{roles[-1]}"] or its ".command"'
                )
            role, column, order = candidates[0]
            chosen[actuator.name, role] = column
            if order and measured:
                notes.append(order_note(profile, actuator.name, role))
    return chosen, tuple(notes)


def speed_doubts(profile: Profile, columns: Mapping[str, Floats]) -> tuple[str, ...]:
    """Say which propellers never come near the speeds that their thrust curves cover, as with a wrong unit.

    Parameters
    ----------
    profile, columns
        As for `applied_force`.

    Raises
    ------
    FerryIdError
        For a propeller that mostly turns far faster than its curve knows.
    """
    told = []
    for (name, role), column in actuator_columns(profile, columns)[0].items():
        curve = next(one.thrust for one in profile.actuators if one.name == name)
        if role != "speed" or curve is None:
            continue
        limit = max(map(abs, curve.valid)) * (60.0 if curve.input_unit == "rps" else 1.0)
        speed = np.abs(np.asarray(columns[column], dtype=np.float64))
        turning = speed[np.isfinite(speed) & (speed > SLOW * limit)]
        fastest = float(np.max(speed, initial=0.0, where=np.isfinite(speed)))
        if not math.isfinite(limit) or fastest == 0.0:
            continue
        if turning.size == 0:
            told.append(
                f"{name} never turned faster than {fastest:.3g} rpm, {per_cent(fastest / limit)} of what its thrust curve "
                "covers: if it did not rest all the time, correct the unit of its speed."
            )
        # The highest value may be one that stands for none.
        elif (lower := turning[turning < fastest]).size > 0 and np.mean(lower > FAST * limit) > 0.5:
            line = next((one.line for one in profile.signals if one.quantity.startswith(f"{name}.speed")), 0)
            raise FerryIdError(
                f"{profile.path}:{line}: {name} cannot turn at {np.median(turning):.4g} rpm most of the time, as the unit of "
                f"its speed has it: its thrust curve ends at {limit:.4g} rpm. Fix: correct the unit, or the curve"
            )
    return tuple(told)


def applied_force(
    profile: Profile, columns: Mapping[str, Floats], nu: Floats, *, measured: bool = True
) -> tuple[Floats, tuple[str, ...]]:
    """Return the force that all actuators apply together, in the body frame.

    Parameters
    ----------
    profile
        Vessel profile.
    columns
        Aligned columns (``n_NAME`` [rpm], ``alpha_NAME``, ``delta_NAME`` [rad], ``F_NAME`` [N]), shape (n,) each.
    nu
        Surge, sway [m/s] and yaw rate [rad/s] through the water, shape (n, 3); only propellers with an open-water curve
        and rudders use it.
    measured
        True takes feedback where there is any, False the orders.

    Returns
    -------
    tau
        Surge force, sway force [N] and yaw moment [N·m] about the body origin, shape (n, 3).
    notes
        Counted clippings and orders used in place of feedback, as sentences.

    Raises
    ------
    FerryIdError
        When the columns lack a signal of an actuator.
    """
    chosen, notes = actuator_columns(profile, columns, measured=measured)
    nu = np.asarray(nu, dtype=np.float64)
    tau = np.zeros((nu.shape[0], 3))
    more: list[str] = []
    for actuator in profile.actuators:
        signals = {
            role: np.asarray(columns[column], dtype=np.float64)
            for (name, role), column in chosen.items()
            if name == actuator.name
        }
        force, note = _strength(profile, actuator, signals, nu)
        if note:
            more.append(note)
        angle = signals.get("angle", actuator.angle_rad)
        deduction = 1.0 - actuator.inflow.get("thrust_deduction", 0.0)
        # A force given directly already acts on the hull; thrust, measured or from a curve, still loses the deduction.
        delivered = force if "force" in signals else force * deduction
        part = force_at(actuator, delivered, angle)
        if "rudder" in signals:
            part = part + rudder_behind(actuator, signals["rudder"], force, nu)
        tau += actuator.count * part
    return tau, (*notes, *more)


def propellers_before_rudders(profile: Profile, columns: Mapping[str, Floats], nu: Floats) -> Floats | None:
    """Return what the force of each rudder follows from besides the flow; None for a vessel without rudders.

    Parameters
    ----------
    profile, columns, nu
        As for `applied_force`.

    Returns
    -------
    ndarray
        Thrust of one propeller before deduction [N] and angle of its rudder [rad], NaN for actuators without one, shape
        (n, k, 2).
    """
    if not any(actuator.rudder for actuator in profile.actuators):
        return None
    chosen, _ = actuator_columns(profile, columns)
    found = np.full((len(nu), len(profile.actuators), 2), np.nan)
    for k, actuator in enumerate(profile.actuators):
        signals = {
            role: np.asarray(columns[column], dtype=np.float64)
            for (name, role), column in chosen.items()
            if name == actuator.name
        }
        if "rudder" in signals:
            found[:, k, 0] = _strength(profile, actuator, signals, nu)[0]
            found[:, k, 1] = signals["rudder"]
    return found


def rudder_behind(actuator: Actuator, delta_rad: Floats, thrust_n: Floats, nu: Floats) -> Floats:
    """Return the force of an actuator's rudder on the hull, of one unit; arguments and result of `rudder_force`."""
    return rudder_force(
        actuator.rudder,
        delta_rad,
        thrust_n,
        nu,
        diameter_m=actuator.inflow["diameter_m"],
        wake_fraction=actuator.inflow.get("wake_fraction", 0.0),
        water_density=actuator.inflow.get("water_density", FRESH_WATER),
    )


def _strength(profile: Profile, actuator: Actuator, signals: Mapping[str, Floats], nu: Floats) -> tuple[Floats, str]:
    for role in ("force", "thrust"):
        if role in signals:
            return signals[role], ""
    curve = actuator.thrust
    if curve is None:
        raise FerryIdError(
            f"{profile.path}: the speed of {actuator.name} cannot be turned into a force without a thrust curve. "
            f"Fix: add thrust = {{ ... }} to {actuator.name}"
        )
    force, clipped = thrust(
        curve,
        signals["speed"],
        advance_mps=inflow_speed(nu[:, 0], actuator.inflow.get("wake_fraction", 0.0)),
        diameter_m=actuator.inflow.get("diameter_m", math.nan),
        water_density=actuator.inflow.get("water_density", FRESH_WATER),
    )
    count = int(np.count_nonzero(clipped))
    if count == 0:
        return force, ""
    low, high = curve.valid
    return force, (
        f"{actuator.name}: {count} of {counted(force.size, 'row')} lie outside the thrust curve's {low:g} to {high:g} "
        f"{curve.input_unit} and were clipped."
    )
