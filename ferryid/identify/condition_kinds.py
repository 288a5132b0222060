"""Kinds of conditions that single logs may have of their own besides wind, and what they do to the windows of the weak form.

A current moves the water that damping and added mass feel; a load adds its mass to the vessel's; a heading that is off turns
the velocity and its change; velocities and yaw rate may have an offset. Each acts on the windows as if it had been measured, so
that the estimate of the hull goes on as it does with a log that measured it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.cached import cached_property
from ferryid.effects import effects
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_rows import WeakRows
from ferryid.identify.window_loads import BlownLoad
from ferryid.models import CONDITION_TITLES
from ferryid.models.forces import ACCELERATIONS, motion_force
from ferryid.regression import window_rows, window_weights
from ferryid.regression.bases import Basis
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats
from ferryid.vessel.hull import current_in_body
from ferryid.vessel.profile import Profile

_POINTS = 6
"""Points of a window at which motion is evaluated: functions of it differ little within one, and only their change counts."""
_STEP = 0.05
"""Of a size, by which slopes are taken."""


WIND = "wind"
"""The kind that always takes part where nobody measured it: `ferryid.identify.log_conditions` estimates it first."""


@dataclass(frozen=True)
class ConditionParameter:
    """A number of a condition: its name, its unit, and a moderate size of it."""

    name: str
    unit: str
    size: float


@dataclass(frozen=True)
class ConditionKind:
    """A kind of condition.

    Attributes
    ----------
    id, title
        Its name in files and in texts.
    parameters
        What a log has of it.
    """

    id: str
    title: str
    parameters: tuple[ConditionParameter, ...]

    @property
    def sizes(self) -> Floats:
        """Sizes of the parameters."""
        return np.array([one.size for one in self.parameters])


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """Motion at some points of the J windows of a log, S a window.

    Attributes
    ----------
    psi
        Heading [rad], zero where it was not measured, shape (J, S).
    nu
        Velocity that enters products [m/s, m/s, rad/s], shape (J, S, 3).
    weight
        Weight of each point, shape (S,).
    absent
        Kinds that the log cannot have or show, by the reason.
    """

    psi: Floats
    nu: Floats
    weight: Floats
    absent: Mapping[str, str]

    @classmethod
    def of(
        cls, profile: Profile, motion: Motion, velocity: Floats, windows: WeakRows, length_s: float
    ) -> MotionSamples:
        """Return the samples of a log's windows of `length_s`; `velocity` enters products, shape (n, 3)."""
        rows = window_rows(length_s, motion.rate_hz)
        offsets = np.unique(np.linspace(0, rows - 1, _POINTS + 2).round().astype(np.int64)[1:-1])
        weight = window_weights(rows, 1.0)[0][offsets]
        places = windows.start[:, None] + offsets
        psi = np.nan_to_num(motion.eta[places, 2])
        return cls(psi, velocity[places], weight / weight.sum(), _absent(profile, motion, windows))


def kinds_of(profile: Profile, samples: Sequence[MotionSamples]) -> tuple[ConditionKind, ...]:
    """Return the kinds of conditions that logs of a vessel may have, wind first, with sizes as of its effects and its speed."""
    known = {
        name: {one.name: one.size for one in effects()[name].parameters_of(profile)}
        for name in ("current", "payload", "heading_bias")
    }
    speed = np.sqrt(np.mean([np.mean(one.nu**2, axis=(0, 1)) for one in samples if len(one.nu)], axis=0))
    trim = IDENTIFY.trim_share * np.maximum(np.array([speed[0], speed[0], speed[2]]), 1e-6)
    mass, place = known["payload"]["mass"], known["payload"]["x"]
    flow = known["current"]
    usual = IDENTIFY.wind_spread_mps
    return (
        ConditionKind(
            WIND,
            CONDITION_TITLES[WIND],
            (ConditionParameter("north", "m/s", usual), ConditionParameter("east", "m/s", usual)),
        ),
        ConditionKind(
            "current",
            CONDITION_TITLES["current"],
            (ConditionParameter("north", "m/s", flow["north"]), ConditionParameter("east", "m/s", flow["east"])),
        ),
        ConditionKind(
            "payload",
            CONDITION_TITLES["payload"],
            (ConditionParameter("mass", "kg", mass), ConditionParameter("moment", "kg·m", mass * place)),
        ),
        ConditionKind(
            "heading_bias",
            CONDITION_TITLES["heading_bias"],
            (ConditionParameter("angle", "deg", known["heading_bias"]["angle"]),),
        ),
        ConditionKind(
            "velocity_offset",
            CONDITION_TITLES["velocity_offset"],
            (ConditionParameter("surge", "m/s", float(trim[0])), ConditionParameter("sway", "m/s", float(trim[1]))),
        ),
        ConditionKind(
            "yaw_rate_offset",
            CONDITION_TITLES["yaw_rate_offset"],
            (ConditionParameter("yaw", "rad/s", float(trim[2])),),
        ),
    )


def _absent(profile: Profile, motion: Motion, windows: WeakRows) -> dict[str, str]:
    """Return which kinds a log cannot have or show, and why."""
    absent: dict[str, str] = {}
    if motion.current is not None:
        absent["current"] = "it was measured"
    elif profile.setting in effects()["current"].absent_in:
        absent["current"] = f"the profile's setting is a {profile.setting}"
    elif not np.any(windows.heading):
        absent["current"] = "no heading was measured"
    if motion.payload is not None:
        absent["payload"] = "it was measured"
    elif not profile.hull.is_known:
        absent["payload"] = f"{profile.hull.why_unknown}, and its mass comes from the same logs"
    return absent


@dataclass(frozen=True, eq=False)
class ChangedWindows:
    """Windows of one log as functions of its conditions.

    Attributes
    ----------
    profile, scale, functions
        Base model, factors on it, and basis.
    windows, samples
        The windows without any condition, and motion at points of them.
    posed
        Axes whose acceleration comes from poses, shape (3,).
    blown
        The load of a wind that nobody measured; None where there is none to estimate.
    """

    profile: Profile
    scale: Mapping[str, float]
    functions: Basis
    windows: WeakRows
    samples: MotionSamples
    posed: Flags
    blown: BlownLoad | None = None

    def absent(self, kind: str) -> str:
        """Return why the log cannot have or show a kind of condition, as the end of a sentence; empty where it may."""
        if kind == WIND:
            return "" if self.blown is not None else "it was measured, or no load of it is known"
        return self.samples.absent.get(kind, "")

    @cached_property
    def _plain(self) -> tuple[Floats, Floats]:
        nu = self.samples.nu
        return self._functions(nu), self._steady(nu, self.samples.psi, np.zeros(2))

    @cached_property
    def _flows(self) -> tuple[Floats | None, Floats | None]:
        """Apparent wind and current that functions need: their own part of a change is left out, so that any serve."""
        still = np.zeros((self.samples.psi.size, 2))
        return (still if self.functions.needs_wind else None), (still if self.functions.needs_current else None)

    def _functions(self, nu: Floats) -> Floats:
        flat = nu.reshape(-1, 3)
        values = self.functions.evaluate(flat, np.zeros_like(flat), *self._flows)
        return np.asarray(np.einsum("jsk,s->jk", values.reshape(*nu.shape[:2], values.shape[1]), self.samples.weight))

    def _steady(self, nu: Floats, psi: Floats, current: Floats) -> Floats:
        flat = nu.reshape(-1, 3)
        flow = np.broadcast_to(current, (len(flat), 2)) if np.any(current) else None
        force = motion_force(self.profile, self.scale, np.zeros_like(flat), flat, psi.ravel(), current=flow)
        return np.asarray(np.einsum("jsa,s->ja", force.reshape(nu.shape), self.samples.weight))

    def under(self, values: Mapping[str, Floats], G: Floats) -> WeakRows:
        """Return the windows as if conditions had been measured.

        Parameters
        ----------
        values
            Of each condition its parameters, by the kind's name.
        G
            ``M0 M^-1`` of the hull that is estimated, by which the equations are multiplied, shape (3, 3).
        """
        one, psi, nu = self.windows, self.samples.psi, self.samples.nu.copy()
        accelerations = (one.by_velocity, one.by_pose)
        heading = one.heading
        if "heading_bias" in values:
            angle = float(np.radians(values["heading_bias"][0]))
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            psi, heading = psi - angle, heading @ turn
            nu[..., :2] = nu[..., :2] @ turn.T
            accelerations = (_turned(one.by_velocity, turn), _turned(one.by_pose, turn))
        if "velocity_offset" in values:
            nu[..., :2] -= values["velocity_offset"]
        if "yaw_rate_offset" in values:
            nu[..., 2] -= values["yaw_rate_offset"]
        current = values.get("current", np.zeros(2))
        through, flow = nu.copy(), current_in_body(np.broadcast_to(current, (*psi.shape, 2)), psi)
        through -= flow
        functions, steady = (
            new - old
            for new, old in zip((self._functions(through), self._steady(nu, psi, current)), self._plain, strict=True)
        )
        if WIND in values and self.blown is not None:
            steady = steady - self.blown.of(values[WIND])
        inertia = one.inertia
        if current.any():
            # Added mass, with that which the estimate adds to the base model's, feels how the water turns about the hull.
            turning = np.stack([nu[..., 2] * flow[..., 1], -nu[..., 2] * flow[..., 0], np.zeros_like(psi)], axis=2)
            more = np.linalg.solve(G, one.inertia) - one.inertia
            steady = steady - np.einsum("jab,jsb,s->ja", more, turning, self.samples.weight)
        if "payload" in values:
            zeta = float(self.scale.get("zeta", 1.0))
            moved = _centripetal(values["payload"], nu.reshape(-1, 3)).reshape(nu.shape)
            steady = steady + np.einsum("jsa,s->ja", moved, self.samples.weight) / zeta
            inertia = inertia + G @ load_of(values["payload"]) / zeta
        return replace(
            one,
            functions=one.functions + functions,
            steady=one.steady + steady,
            by_velocity=accelerations[0],
            by_pose=accelerations[1],
            heading=heading,
            inertia=inertia,
        )

    def left(self, windows: WeakRows, gains: Floats, intercept: Floats) -> Floats:
        """Return what a hull leaves of windows of the log, shape (J, 3)."""
        terms = self.functions.terms
        target = windows.force - windows.base(windows.acceleration(self.posed))
        return np.asarray(target - windows.regressors(terms) @ gains - intercept)

    def slope(self, kind: ConditionKind, values: Mapping[str, Floats], gains: Floats, intercept: Floats) -> Floats:
        """Return the derivative by a condition, in sizes, of what a hull leaves of the windows, shape (J, 3, q).

        A load acts on the acceleration that the hull predicts: the noise of the measured one would pull it towards none.
        """
        G, at = gain_matrix(gains, self.functions.terms), values.get(kind.id, np.zeros(len(kind.parameters)))
        here = self.under(values, G)
        if kind.id == "payload":
            measured = here.acceleration(self.posed)
            predicted = measured + np.linalg.solve(here.inertia, self.left(here, gains, intercept)[:, :, None])[:, :, 0]
        slopes = []
        for k, size in enumerate(kind.sizes):
            step = _STEP * size * (np.arange(len(at)) == k)
            ahead, astern = (self.under({**values, kind.id: at + sign * step}, G) for sign in (1.0, -1.0))
            if kind.id == "payload":
                # The inertia's part by the acceleration predicted, the rest by the velocities.
                inertia = np.einsum("jab,jb->ja", ahead.inertia - astern.inertia, predicted)
                ahead, astern = replace(ahead, inertia=here.inertia), replace(astern, inertia=here.inertia)
            slope = self.left(ahead, gains, intercept) - self.left(astern, gains, intercept)
            slopes.append((slope - inertia if kind.id == "payload" else slope) / (2.0 * _STEP))
        return np.stack(slopes, axis=2)


def _turned(vectors: Floats, turn: Floats) -> Floats:
    """Return surge and sway turned by a matrix (2, 2), and yaw as it is, shape (J, 3)."""
    return np.column_stack([vectors[:, :2] @ turn.T, vectors[:, 2]])


def load_of(values: Floats) -> Floats:
    """Return the mass matrix of a load of mass and first moment, shape (3, 3); its second moment is the hull's own in yaw."""
    mass, moment = values
    return np.array([[mass, 0.0, 0.0], [0.0, mass, moment], [0.0, moment, 0.0]])


def _centripetal(values: Floats, nu: Floats) -> Floats:
    """Return the force that it takes to turn a load along, shape (n, 3)."""
    mass, moment = values
    u, v, r = nu.T
    return np.column_stack([-mass * v * r - moment * r**2, mass * u * r, moment * u * r])


def gain_matrix(gains: Floats, terms: Sequence[str]) -> Floats:
    """Return ``M0 M^-1`` of gains (K, 3), shape (3, 3)."""
    G = np.eye(3)
    for column, name in enumerate(ACCELERATIONS):
        if name in terms:
            G[:, column] -= gains[list(terms).index(name)]
    return G
