"""Sensors as a profile maps them, and the same signals in a simulated log."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from ferryid.effects import effects
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Actuator, Profile, Signal
from ferryid.vessel.thrusters import needed_roles

FEEDBACK = "feedback"
SENSORS: Mapping[str, str] = {
    "position": "a receiver of the position",
    "heading": "a compass",
    "velocity": "a measurement of the velocity",
    "yaw_rate": "a gyro",
    "wind": "an anemometer",
    "current": "a current meter",
    "payload": "a measurement of the load",
    FEEDBACK: "feedback of the actuators' speeds and angles",
}
"""Sensors that distinguish effects, by the quantity of a profile's signals; of actuators all feedback is one."""
MEASURES: Mapping[str, tuple[str, ...]] = {"wind": ("wind",), "current": ("current",), "payload": ("payload",)}
"""Effects that a sensor measures, so that none of them is left to be found."""
ODOMETRY = "milliampere"
"""A profile whose signals are those of the simulator."""


def mapped(profile: Profile) -> frozenset[str]:
    """Return the sensors that a profile maps."""
    quantities = {signal.quantity for signal in profile.signals}
    found = {name for name in SENSORS if name in quantities}
    if all(_fed_back(actuator, quantities) for actuator in profile.actuators):
        found.add(FEEDBACK)
    return frozenset(found)


def further(profile: Profile) -> tuple[str, ...]:
    """Return the sensors that it does not map and may, without those of what cannot act on the vessel or where it is."""
    there = mapped(profile)
    idle = {"wind"} if profile.wind is None else set()
    idle |= {
        name for name, what in MEASURES.items() if all(profile.setting in effects()[one].absent_in for one in what)
    }
    return tuple(name for name in SENSORS if name not in there | idle)


def reading(vessel: Profile, sensors: Collection[str]) -> Profile:
    """Return a profile that reads a simulated log of its vessel with some sensors alone.

    Of actuators without feedback it has the orders.
    """
    signals = [_signal(name) for name in SENSORS if name in sensors and name != FEEDBACK]
    for actuator in vessel.actuators:
        topic = f"/{actuator.name}/{'state' if FEEDBACK in sensors else 'command'}"
        order = "" if FEEDBACK in sensors else ".command"
        strength = "force" if actuator.kind == "force" else "speed"
        unit = "N" if actuator.kind == "force" else "rpm"
        signals.append(Signal(f"{actuator.name}.{strength}{order}", topic, ("speed",), unit))
        turn = {"azimuth": "angle", "propeller_rudder": "rudder"}.get(actuator.kind)
        if turn is not None:
            signals.append(Signal(f"{actuator.name}.{turn}{order}", topic, ("azimuth",), "rad"))
    return replace(vessel, signals=tuple(signals), table=None)


def _signal(quantity: str) -> Signal:
    if quantity == "payload":
        return Signal(quantity, "/payload/waterline", ("mass", "x"), "kg", options={"x_unit": "m"})
    return next(one for one in load_profile(ODOMETRY).signals if one.quantity == quantity)


def _fed_back(actuator: Actuator, quantities: Collection[str]) -> bool:
    return all(any(f"{actuator.name}.{role}" in quantities for role in roles) for roles in needed_roles(actuator))
