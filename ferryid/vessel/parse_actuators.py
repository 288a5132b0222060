"""The actuators of a profile: kinds, positions, thrust curves and rudders."""

from __future__ import annotations

import math
import re

import numpy as np

from ferryid.counts import counted
from ferryid.vessel.faults import TableReader
from ferryid.vessel.parse_hull import MOST_AREA_M2, MOST_LENGTH_M, MOST_RATIO
from ferryid.vessel.profile import Actuator, Hull, ThrustCurve
from ferryid.vessel.thrusters import thrust

KINDS = ("azimuth", "propeller", "propeller_rudder", "tunnel", "force")

MOST_SPEED, MOST_FORCE_N, MOST_POWERS = 1e6, 1e9, 20
"""Beyond any propeller: rpm or rps, force, and coefficients of a polynomial."""

CURVES = ("polynomial", "table", "quadratic", "open_water")

_REACH = 0.6
"""Share of length and beam within which an actuator lies when the body origin is near midship."""


def parse_actuators(top: TableReader, hull: Hull | None) -> tuple[Actuator, ...]:
    """Read every ``[[actuator]]``, noting faults; `hull` tells which positions are off the vessel."""
    readers = top.tables("actuator")
    if not readers:
        top.fault("the file lists no actuator, so the applied force is not known. Fix: add at least one [[actuator]]")
    actuators = []
    seen: dict[str, int] = {}
    for reader in readers:
        actuator = _actuator(reader)
        if hull is not None:
            _check_place(reader, actuator, hull)
        if actuator.name in seen:
            reader.fault(
                f'the actuator name "{actuator.name}" is taken by the one on line {seen[actuator.name]}. '
                "Fix: give each its own name",
                "name",
            )
        seen.setdefault(actuator.name, reader.line())
        actuators.append(actuator)
    return tuple(actuators)


def with_curve(top: TableReader) -> frozenset[str]:
    """Return the names of the actuators for which the file gives a thrust curve, right or wrong."""
    given = top.data.get("actuator")
    entries = given if isinstance(given, list) else []
    return frozenset(str(one.get("name")) for one in entries if isinstance(one, dict) and "thrust" in one)


def _actuator(reader: TableReader) -> Actuator:
    name = reader.text("name", required=True)
    if reader.data.get("name") == name and not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        reader.fault(
            f'an actuator cannot be named "{name}": its name becomes part of column names. Fix: use letters, '
            "digits and underscores",
            "name",
        )
    kind = reader.text("kind", required=True, options=KINDS)
    position = reader.numbers("position_m", 2, required=True, within=MOST_LENGTH_M) or (math.nan, math.nan)
    count = reader.whole("count", 1, at_least=1, at_most=1000)
    angle_rad = 0.0
    if kind == "tunnel":
        angle_rad = 0.5 * math.pi
    elif kind in ("propeller", "force"):
        angle_rad = math.radians(reader.number("angle_deg", 0.0, at_least=-360.0, at_most=360.0))
    curve = _curve(reader.table("thrust"))
    inflow = _inflow(reader, kind)
    rudder: dict[str, float] = {}
    table = reader.table("rudder", required=kind == "propeller_rudder", needs="whose force it must give")
    if table is not None:
        if kind and kind != "propeller_rudder":
            table.fault(f'an actuator of kind "{kind}" has no rudder. Fix: use kind = "propeller_rudder"')
        rudder = _rudder(table)
        if kind == "propeller_rudder" and "diameter_m" not in inflow:
            reader.fault(
                'a "propeller_rudder" needs "diameter_m", for the slipstream on the rudder. Fix: add diameter_m = ...'
            )
    order = f'the table of its order, such as [signals."{name or "NAME"}.speed.command"]'
    reader.close(dict.fromkeys(("time_constant_s", "delay_s"), order))
    return Actuator(name, kind, (position[0], position[1]), curve, angle_rad, count, rudder, inflow)


def _check_place(reader: TableReader, actuator: Actuator, hull: Hull) -> None:
    """Warn of an actuator or a rudder that lies off the hull; comparisons with a size not given (NaN) are false."""
    x, y = actuator.position_m
    why = "Fix: check sign and unit [m], and that the body origin is near midship"
    for place, value, size, what in ((0, x, hull.length_m, "length"), (1, y, hull.beam_m, "beam")):
        if abs(value) > _REACH * size:
            reader.fault(
                f'"position_m"[{place}] = {value:g} lies off a hull of {what} {size:g} m. {why}',
                "position_m",
                warning=True,
            )
    rudder = reader.table("rudder") if actuator.rudder else None
    x_m = actuator.rudder.get("x_m", math.nan)
    if rudder is not None and abs(x_m) > _REACH * hull.length_m:
        rudder.fault(f'"x_m" = {x_m:g} lies off a hull of length {hull.length_m:g} m. {why}', "x_m", warning=True)


def _inflow(reader: TableReader, kind: str) -> dict[str, float]:
    """Take what couples a propeller to the flow along the hull; absent keys are left out."""
    inflow = {}
    for key, low, high in (("wake_fraction", -0.5, 0.95), ("thrust_deduction", -0.5, 0.95)):
        if reader.has(key):
            inflow[key] = reader.number(key, 0.0, at_least=low, at_most=high)
    for key in ("diameter_m", "water_density"):
        if reader.has(key):
            inflow[key] = reader.number(key, 1.0, above=0.0, within=1e4)
    if kind == "force" and inflow:
        reader.fault(f'a force given directly takes no "{next(iter(inflow))}"', next(iter(inflow)))
    return inflow


def _rudder(reader: TableReader) -> dict[str, float]:
    rudder = {
        "area_m2": reader.number("area_m2", required=True, above=0.0, within=MOST_AREA_M2),
        "x_m": reader.number("x_m", required=True, within=MOST_LENGTH_M),
        "a_H": reader.number("a_H", 0.0, at_least=0.0, within=MOST_RATIO),
        "x_H_m": reader.number("x_H_m", 0.0, within=MOST_LENGTH_M),
        "t_R": reader.number("t_R", 0.0, at_least=0.0, at_most=1.0),
        "epsilon": reader.number("epsilon", 1.0, above=0.0, within=MOST_RATIO),
        "kappa": reader.number("kappa", 0.5, at_least=0.0, within=MOST_RATIO),
        "eta": reader.number("eta", 1.0, at_least=0.0, at_most=1.0),
        "gamma_R": reader.number("gamma_R", 1.0, at_least=0.0, within=MOST_RATIO),
    }
    rudder["gamma_R_minus"] = reader.number("gamma_R_minus", rudder["gamma_R"], at_least=0.0)
    rudder["l_R_m"] = reader.number("l_R_m", rudder["x_m"])
    slope, aspect = reader.has("f_alpha"), reader.has("aspect_ratio")
    f_alpha = reader.number("f_alpha", above=0.0, within=MOST_RATIO)
    ratio = reader.number("aspect_ratio", above=0.0, within=MOST_RATIO)
    if slope == aspect:
        reader.fault(
            "the rudder needs its lift slope once. Fix: give either f_alpha or aspect_ratio (then f_alpha = "
            "6.13 aspect_ratio / (aspect_ratio + 2.25), Fujii)"
        )
    rudder["f_alpha"] = f_alpha if slope else 6.13 * ratio / (ratio + 2.25)
    reader.close()
    return rudder


def _curve(reader: TableReader | None) -> ThrustCurve | None:
    if reader is None:
        return None
    kind = reader.text("kind", required=True, options=CURVES)
    if not kind:
        return None
    unit = "rps" if kind == "open_water" else reader.text("input", "rpm", options=("rpm", "rps"))
    if kind == "open_water":
        return _open_water(reader)
    valid = _valid(reader, required=kind == "polynomial")
    curve: ThrustCurve | None = None
    if kind == "polynomial":
        coefficients = reader.numbers("coefficients", required=True)
        if coefficients:
            curve = ThrustCurve(kind, unit, valid or (-math.inf, math.inf), coefficients=coefficients)
    elif kind == "quadratic":
        ahead = reader.number("ahead", required=True, above=0.0, within=MOST_FORCE_N)
        astern = reader.number("astern", ahead, at_least=0.0, within=MOST_FORCE_N)
        curve = ThrustCurve(kind, unit, valid or (-math.inf, math.inf), ahead=ahead, astern=astern)
    else:
        curve = _table_curve(reader, unit, valid)
    reader.close()
    if curve is not None and kind != "quadratic" and not any(curve.coefficients) and not any(curve.table[1]):
        key = "coefficients" if kind == "polynomial" else "force"
        reader.fault("the thrust curve is zero everywhere. Fix: give its coefficients or forces [N]", key)
    elif curve is not None and kind == "polynomial" and valid:
        if len(curve.coefficients) > MOST_POWERS:
            reader.fault(f"a thrust curve of {len(curve.coefficients)} powers. Fix: give a few", "coefficients")
            return None
        _check_monotone(reader, curve)
    return curve


def _valid(reader: TableReader, *, required: bool) -> tuple[float, float] | None:
    valid = reader.numbers("valid", 2, required=required, within=MOST_SPEED)
    if not valid:
        return None
    if valid[0] >= valid[1]:
        reader.fault(f'"valid" is reversed: [{valid[0]:g}, {valid[1]:g}]. Fix: write [lowest, highest]', "valid")
        return None
    if not valid[0] <= 0.0 <= valid[1]:
        reader.fault(f'"valid" = [{valid[0]:g}, {valid[1]:g}] leaves out a stopped propeller', "valid")
        return None
    return valid[0], valid[1]


def _table_curve(reader: TableReader, unit: str, valid: tuple[float, float] | None) -> ThrustCurve | None:
    speeds = reader.numbers("speed", required=True, within=MOST_SPEED)
    forces = reader.numbers("force", required=True, within=MOST_FORCE_N)
    per = reader.whole("measured_on", 1, at_least=1, at_most=1000)
    if not speeds or not forces:
        return None
    if len(speeds) != len(forces) or len(speeds) < 2:
        reader.fault(
            f'"speed" has {counted(len(speeds), "entry")} and "force" {len(forces)}. Fix: give as many, at least two',
            "force",
        )
        return None
    steps = np.diff(speeds)
    if np.any(steps <= 0.0):
        row = int(np.argmax(steps <= 0.0))
        reader.fault(
            f'"speed" must rise from entry to entry, found {speeds[row]:g} before {speeds[row + 1]:g}. '
            "Fix: sort the table",
            "speed",
        )
        return None
    force_at_zero = float(np.interp(0.0, speeds, forces))
    if not speeds[0] <= 0.0 <= speeds[-1] or abs(force_at_zero) > 1e-9 * max(map(abs, forces)):
        reader.fault(
            f"the table does not pass through zero (it gives {force_at_zero:g} N at rest). Fix: add the entry 0 : 0",
            "speed",
        )
        return None
    if np.any(np.diff(forces) < 0.0):
        row = int(np.argmax(np.diff(forces) < 0.0))
        reader.fault(
            f'"force" falls from {forces[row]:g} to {forces[row + 1]:g} N while the speed rises from '
            f"{speeds[row]:g} to {speeds[row + 1]:g}. Fix: check the sign of the astern side",
            "force",
        )
    limits = valid or (speeds[0], speeds[-1])
    if limits[0] < speeds[0] or limits[1] > speeds[-1]:
        reader.fault(f'"valid" reaches beyond the table, which covers {speeds[0]:g} to {speeds[-1]:g}', "valid")
    return ThrustCurve("table", unit, limits, table=(speeds, tuple(force / per for force in forces)))


def _open_water(reader: TableReader) -> ThrustCurve | None:
    """Read K_T over J for ahead, and one coefficient for astern."""
    valid = _valid(reader, required=False) or (-math.inf, math.inf)
    advance = reader.numbers("J", required=True, within=MOST_RATIO)
    k_t = reader.numbers("K_T", required=True, within=MOST_RATIO)
    astern = reader.number("K_T_astern", 0.0, at_least=0.0, within=MOST_RATIO)
    reader.close()
    if not advance or not k_t:
        return None
    if len(advance) != len(k_t) or len(advance) < 2 or np.any(np.diff(advance) <= 0.0):
        reader.fault('"J" and "K_T" need as many entries, at least two, with J rising', "J")
        return None
    return ThrustCurve("open_water", "rps", valid, table=(advance, k_t), astern=astern)


def _check_monotone(reader: TableReader, curve: ThrustCurve) -> None:
    speeds = np.linspace(curve.valid[0], curve.valid[1], 401) * (1.0 if curve.input_unit == "rpm" else 60.0)
    force = thrust(curve, speeds)[0]
    if np.abs(force).max() > MOST_FORCE_N:
        at = speeds[np.argmax(np.abs(force))]
        reader.fault(
            f"the thrust curve gives {np.abs(force).max():.3g} N at {at:.0f} rpm, more than any propeller. "
            "Fix: check the coefficients, lowest power first, and the unit of input",
            "coefficients",
        )
        return
    wrong = np.sign(force) * np.sign(speeds) < 0
    if np.any(wrong):
        at = speeds[np.argmax(np.abs(np.where(wrong, force, 0.0)))]
        reader.fault(
            f"the thrust curve has the wrong sign at {at:.0f} rpm ({thrust(curve, np.array([at]))[0][0]:.1f} N). "
            "Fix: check the signs of the coefficients, lowest power first, starting with the one of n",
            "coefficients",
        )
    elif np.any(np.diff(force) < -1e-9 * np.ptp(force)):
        at = speeds[np.argmax(np.diff(force) < 0.0)]
        reader.fault(
            f"the thrust curve is not monotone: it falls from {at:.0f} rpm on. Fix: check the coefficients or narrow "
            "valid",
            "coefficients",
            warning=True,
        )
