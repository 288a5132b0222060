"""The equations of Gazebo and of its plugins in six degrees of freedom, written apart from the package, and paths by them.

Bodies are x ahead, y to port, z up in a world of east, north, up.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable

import numpy as np

PLANE = [0, 1, 5]
Acceleration = Callable[[np.ndarray, np.ndarray], np.ndarray]


def text(element: ET.Element, path: str, default: str = "0") -> str:
    return element.findtext(path) or default


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def spatial_inertia(model: ET.Element) -> np.ndarray:
    """Return the 6 x 6 matrix of the rigid bodies about the origin of base_link; all are as one."""
    places = {"base_link": np.zeros(3)}
    total = np.zeros((6, 6))
    for link in model.iter("link"):
        pose = link.find("pose")
        origin = np.zeros(3)
        if pose is not None:
            origin = places[pose.get("relative_to")] + np.array(pose.text.split(), dtype=float)[:3]
        places[link.get("name")] = origin
        mass = float(text(link, "inertial/mass"))
        centre = origin + np.array(text(link, "inertial/pose", "0 0 0 0 0 0").split(), dtype=float)[:3]
        moments = np.diag([float(text(link, f"inertial/inertia/i{axis}")) for axis in ("xx", "yy", "zz")])
        assert moments.trace() - 2.0 * moments.max() >= 0.0, "no body has such moments"
        s = skew(centre)
        total += np.block([[mass * np.eye(3), -mass * s], [mass * s, moments - mass * s @ s]])
    return total


def added_mass(model: ET.Element) -> np.ndarray:
    """Return fluid_added_mass, 6 x 6."""
    names = "xyzpqr"
    table = model.find("link/inertial/fluid_added_mass")
    total = np.zeros((6, 6))
    for i in range(6):
        for j in range(i, 6):
            total[i, j] = total[j, i] = 0.0 if table is None else float(text(table, names[i] + names[j]))
    return total


def momentum_turned(mass: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Return C(v) v of a body: its momentum, turned with it (Kirchhoff)."""
    p = mass @ state
    linear, angular = state[:3], state[3:]
    return np.concatenate([np.cross(angular, p[:3]), np.cross(angular, p[3:]) + np.cross(linear, p[:3])])


def gazebo(sdf: str) -> Acceleration:
    """Return the acceleration in the plane under a force in the plane: DART with added mass, and the Hydrodynamics plugin."""
    model = ET.fromstring(sdf).find("model")
    plugin = model.find("plugin[@filename='gz-sim-hydrodynamics-system']")
    velocities, axes = "UVWPQR", "xyzkmn"
    linear, absolute, product = np.zeros((6, 6)), np.zeros((6, 6, 6)), np.zeros((6, 6, 6))
    for i, axis in enumerate(axes):
        for j, velocity in enumerate(velocities):
            linear[i, j] = float(text(plugin, axis + velocity))
            for k, other in enumerate(velocities):
                absolute[i, j, k] = float(text(plugin, f"{axis}{velocity}abs{other}"))
                product[i, j, k] = float(text(plugin, axis + velocity + other))
    mass = spatial_inertia(model) + added_mass(model)
    inverse = np.linalg.inv(mass[np.ix_(PLANE, PLANE)])

    def acceleration(nu: np.ndarray, tau: np.ndarray) -> np.ndarray:
        state = np.zeros(6)
        state[PLANE] = nu
        damping = -linear - absolute @ np.abs(state) - product @ state
        wrench = -(damping @ state) - momentum_turned(mass, state)
        return inverse @ (tau + wrench[PLANE])

    return acceleration


def px4(sdf: str) -> Acceleration:
    """Return the acceleration in the plane by the plugin of PX4 in the limit of short steps."""
    model = ET.fromstring(sdf).find("model")
    plugin = model.find("plugin")
    rigid = spatial_inertia(model)
    value = {
        key: float(text(plugin, key)) for key in ("xDotU", "yDotV", "nDotR", "xU", "xUU", "yV", "yVV", "nR", "nRR")
    }
    inverse = np.linalg.inv(rigid[np.ix_(PLANE, PLANE)] + np.diag([value["xDotU"], value["yDotV"], value["nDotR"]]))

    def acceleration(nu: np.ndarray, tau: np.ndarray) -> np.ndarray:
        state = np.zeros(6)
        state[PLANE] = nu
        drag = np.array(
            [
                (value["xU"] + value["xUU"] * abs(nu[0])) * nu[0],
                (value["yV"] + value["yVV"] * abs(nu[1])) * nu[1],
                (value["nR"] + value["nRR"] * abs(nu[2])) * nu[2],
            ]
        )
        return inverse @ (tau - drag - momentum_turned(rigid, state)[PLANE])

    return acceleration


def path(acceleration: Acceleration, forces: np.ndarray, dt: float) -> np.ndarray:
    """Return x, y and heading of the world by the classical Runge-Kutta method, a force for each step, shape (n, 3)."""

    def rate(state: np.ndarray, tau: np.ndarray) -> np.ndarray:
        c, s = np.cos(state[5]), np.sin(state[5])
        u, v, r = state[:3]
        return np.concatenate([acceleration(state[:3], tau), [c * u - s * v, s * u + c * v, r]])

    state, rows = np.zeros(6), []
    for tau in forces:
        k1 = rate(state, tau)
        k2 = rate(state + 0.5 * dt * k1, tau)
        k3 = rate(state + 0.5 * dt * k2, tau)
        k4 = rate(state + dt * k3, tau)
        state = state + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        rows.append(state[3:])
    return np.array(rows)
