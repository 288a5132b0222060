"""Terms that a force that nobody named may be made of: what the vessel does, where it is and heads, and its thrusters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ferryid.effects.force_model import ForceModel, Measurements, flow_along_vessel
from ferryid.types import AXES, Floats
from ferryid.vessel.frames import to_body

Quantity = Callable[[ForceModel], Floats]
FORCE = ("N", "N", "N·m")


@dataclass(frozen=True)
class Term:
    """One term of an empirical law: a force in proportion to a quantity.

    Attributes
    ----------
    on
        What it acts on: a body axis, ``"north"``, ``"east"``, or an actuator's force.
    name, unit
        The quantity, such as ``"r|r|"`` in ``"(rad/s)²"``; ``"1"`` for a constant.
    force_unit
        Unit of the force; empty where it is a share of an actuator's.
    value
        ``value(force_model)`` is the quantity, shape (n,).
    force
        ``force(force_model)`` is what a coefficient of 1 gives [N, N, N·m], shape (n, 3).
    """

    on: str
    name: str
    unit: str
    force_unit: str
    value: Quantity
    force: Callable[[ForceModel], Floats]

    @property
    def key(self) -> tuple[str, str]:
        """What it acts on and its quantity, the same in all logs."""
        return self.on, self.name

    @property
    def of_vessel(self) -> bool:
        """True where motion and thrust alone decide it; heading and place belong to the water that a log was recorded in."""
        return self.on not in ("north", "east") and not self.name.startswith(("cos", "sin"))

    @property
    def coefficient_unit(self) -> str:
        """Unit of the coefficient."""
        return (
            (self.force_unit or "1") + (f"/({self.unit})" if self.unit else "") if self.unit else self.force_unit or "-"
        )


def terms_of(measurements: Measurements) -> tuple[Term, ...]:
    """Return all terms that measurements offer.

    On every axis: a constant, polynomials and moduli of the velocity through the water up to the third order, and harmonics of
    the heading. Tied over the axes: forces that are constant along north or east or grow with the place as a spring's do, and
    for every actuator a share of its force, that share growing with its force, the speed and the inflow, and a force across it.
    """
    made = []
    for axis in range(3):
        for name, unit, quantity in _motions():
            made.append(_on_axis(axis, name, unit, quantity))
    for name, along in (("north", 0), ("east", 1)):
        made.append(_of_world(name, "", along, _one))
    if np.isfinite(measurements.eta[measurements.usable, :2]).all():
        for name, along in (("north", 0), ("east", 1)):
            made.append(_of_world(name, "m", along, _place(along)))
    for k, name in enumerate(measurements.names):
        made += _of_thruster(k, name)
    return tuple(made)


def through_water(force_model: ForceModel) -> tuple[Floats, Floats, Floats]:
    """Return the velocity through the water [m/s, m/s, rad/s], shape (n,) each."""
    flow = flow_along_vessel(force_model)
    u, v, r = force_model.measurements.nu.T
    return (u - flow[:, 0], v - flow[:, 1], r) if len(flow) else (u, v, r)


def _motions() -> list[tuple[str, str, Quantity]]:
    """Return name, unit and values of every function of velocity and heading."""
    made: list[tuple[str, str, Quantity]] = [("1", "", _one)]
    for i, (name, unit) in enumerate((("u", "m/s"), ("v", "m/s"), ("r", "rad/s"))):
        made += [
            (name, unit, _velocity(i, lambda x: x)),
            (f"{name}²", f"({unit})²", _velocity(i, np.square)),
            (f"{name}|{name}|", f"({unit})²", _velocity(i, lambda x: np.abs(x) * x)),
            (f"{name}³", f"({unit})³", _velocity(i, lambda x: x**3)),
        ]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        unit = "(m/s)²" if j == 1 else "m·rad/s²"
        first, second = "uvr"[i], "uvr"[j]
        made += [
            (f"{first}{second}", unit, _product(i, j, None)),
            (f"|{first}|{second}", unit, _product(i, j, i)),
            (f"{first}|{second}|", unit, _product(i, j, j)),
        ]
    for times, name in ((1, "heading"), (2, "2·heading")):
        made += [(f"cos({name})", "", _harmonic(times, np.cos)), (f"sin({name})", "", _harmonic(times, np.sin))]
    return made


def _one(force_model: ForceModel) -> Floats:
    return np.ones(len(force_model.measurements.t))


def _velocity(i: int, function: Callable[[Floats], Floats]) -> Quantity:
    return lambda force_model: np.asarray(function(through_water(force_model)[i]))


def _product(i: int, j: int, modulus: int | None) -> Quantity:
    def quantity(force_model: ForceModel) -> Floats:
        nu = through_water(force_model)
        first, second = (np.abs(nu[k]) if k == modulus else nu[k] for k in (i, j))
        return np.asarray(first * second)

    return quantity


def _harmonic(times: int, function: Callable[[Floats], Floats]) -> Quantity:
    return lambda force_model: np.asarray(function(times * force_model.measurements.psi))


def _place(along: int) -> Quantity:
    def quantity(force_model: ForceModel) -> Floats:
        place = force_model.measurements.eta[:, along]
        return np.asarray(place - place[force_model.measurements.usable].mean())

    return quantity


def _on_axis(axis: int, name: str, unit: str, quantity: Quantity) -> Term:
    def force(force_model: ForceModel) -> Floats:
        values = np.zeros((len(force_model.measurements.t), 3))
        values[:, axis] = quantity(force_model)
        return values

    return Term(AXES[axis], name, unit, FORCE[axis], quantity, force)


def _of_world(name: str, unit: str, along: int, quantity: Quantity) -> Term:
    def force(force_model: ForceModel) -> Floats:
        push = [np.zeros(len(force_model.measurements.t)), np.zeros(len(force_model.measurements.t))]
        push[along] = quantity(force_model)
        X, Y = to_body(push[0], push[1], force_model.measurements.psi)
        return np.column_stack([X, Y, np.zeros_like(X)])

    return Term(name, name if unit else "1", unit, "N", quantity, force)


def _of_thruster(k: int, name: str) -> list[Term]:
    def size(force_model: ForceModel) -> Floats:
        return np.asarray(np.hypot(force_model.parts[:, k, 0], force_model.parts[:, k, 1]))

    def speed(force_model: ForceModel) -> Floats:
        u, v, _ = through_water(force_model)
        return np.asarray(np.hypot(u, v))

    def inflow(force_model: ForceModel) -> Floats:
        u, v, r = through_water(force_model)
        x, y = force_model.measurements.profile.actuators[k].position_m
        X, Y = force_model.parts[:, k, 0], force_model.parts[:, k, 1]
        return np.asarray((X * (u - r * y) + Y * (v + r * x)) / np.maximum(size(force_model), 1e-9))

    def along(quantity: Quantity) -> Callable[[ForceModel], Floats]:
        return lambda force_model: force_model.parts[:, k] * quantity(force_model)[:, None]

    def across(force_model: ForceModel) -> Floats:
        x, y = force_model.measurements.profile.actuators[k].position_m
        X, Y = force_model.parts[:, k, 0], force_model.parts[:, k, 1]
        return np.column_stack([-Y, X, x * X + y * Y])

    quantities: list[tuple[str, str, Quantity]] = [
        ("1", "", _one),
        ("its size", "N", size),
        ("speed", "m/s", speed),
        ("speed²", "(m/s)²", lambda force_model: speed(force_model) ** 2),
        ("inflow", "m/s", inflow),
    ]
    made = [Term(f"force of {name}", what, unit, "", value, along(value)) for what, unit, value in quantities]
    return [*made, Term(f"force across {name}", "1", "", "", _one, across)]
