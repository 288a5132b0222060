"""What a simulator of vessels can take of a model, the rest fitted to the terms that it has, and the error that remains.

A simulator has some of the terms of `ferryid.export.planar_terms`, and forces of its own from the masses that it is given. What
is no such term is fitted over the range of validity by least squares to terms that are odd in the velocities, so that the force
at rest stays zero; a diagonal coefficient never becomes one that feeds energy into the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ferryid.export.cases import USUAL
from ferryid.export.exported import Exported
from ferryid.export.planar_terms import VELOCITIES, Beyond, PlanarTerms, coriolis, planar_terms
from ferryid.types import AXES, Flags, Floats

STEPS = 7
"""Speeds of each kind at which forces are compared: the middles of equal parts of the range of validity."""
AXIS_LETTERS = "XYN"
_SMALL = 1e-9
"""Shares of a force that are rounding."""

Slot = tuple[int, int, int | None]
"""Axis, velocity, and the one whose size it is multiplied by, if any."""


@dataclass(frozen=True)
class Slots:
    """Terms that a simulator has, shaped as `PlanarTerms`, and those that may take up what it has not."""

    linear: Flags
    absolute: Flags
    product: Flags
    fitted: tuple[Slot, ...]

    def kept(self, terms: PlanarTerms) -> PlanarTerms:
        """Return what of terms the simulator has."""
        return PlanarTerms(
            np.where(self.linear, terms.linear, 0.0),
            np.where(self.absolute, terms.absolute, 0.0),
            np.where(self.product, terms.product, 0.0),
        )


@dataclass(frozen=True)
class Missing:
    """A part that the simulator has no term for, and its share of the force by axis, before terms were fitted to it."""

    what: str
    share: Floats

    def json(self) -> dict[str, Any]:
        """Return it in plain types."""
        return {"what": self.what, "share": dict(zip(AXES, self.share.tolist(), strict=True))}


@dataclass(frozen=True)
class SimulatorFit:
    """Terms for a simulator.

    Attributes
    ----------
    terms
        Of the force that a motion requires, in FRD, beside what the simulator makes of the masses.
    missing
        What it has no term for.
    """

    terms: PlanarTerms
    missing: tuple[Missing, ...]


def velocities(one: Exported) -> Floats:
    """Return velocities over the range of validity, shape (s, 3) [m/s, m/s, rad/s]."""
    known = {name: (low, high) for name, low, high, _ in one.ranges}
    axes = []
    for name in VELOCITIES:
        low, high = known.get(name, (-USUAL[name], USUAL[name]))
        if not high > low:
            low, high = -USUAL[name], USUAL[name]
        axes.append(low + (high - low) * (np.arange(STEPS) + 0.5) / STEPS)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def simulator_fit(one: Exported, slots: Slots, given: PlanarTerms) -> SimulatorFit:
    """Return the terms of a simulator, and what it cannot take.

    Parameters
    ----------
    one
        The model.
    slots
        Terms that the simulator has.
    given
        What it makes of the masses by itself.
    """
    nu = velocities(one)
    whole = one.force.at_constant_velocity(nu)
    terms, beyond = planar_terms(one)
    turning = coriolis(one.hull.M).times(1.0 / one.zeta)
    damping = terms + turning.times(-1.0)
    carried = turning + given.times(-1.0)
    wanted = carried + damping
    kept = slots.kept(wanted)
    parts = [*beyond]
    for what, part in (("Coriolis and centripetal force of the added mass", carried), ("", damping)):
        left = part + slots.kept(part).times(-1.0)
        names = what or f"damping that couples axes or is not odd: {', '.join(_names(left))}"
        parts.append(Beyond(names, left.force))
    shares = [Missing(part.what, share(part.force(nu), whole)) for part in parts]
    # A force at rest is none that odd terms could stand for.
    at_rest = 0.0 if one.force.intercept is None else one.force.intercept
    rest = whole - at_rest - given.force(nu) - kept.force(nu)
    return SimulatorFit(_fitted(kept, slots, nu, rest), tuple(s for s in shares if s.share.max() > _SMALL))


def share(part: Floats, whole: Floats) -> Floats:
    """Return the root mean square of a part of a force over that of the whole, by axis, shape (3,)."""
    size = np.sqrt(np.mean(whole**2, axis=0))
    return np.asarray(np.sqrt(np.mean(part**2, axis=0)) / np.where(size > 0.0, size, 1.0))


def remaining(one: Exported, simulated: Callable[[Floats], Floats]) -> dict[str, float]:
    """Return the share of the force that a simulator's equations get wrong, over the range of validity, by axis.

    Parameters
    ----------
    one
        The model.
    simulated
        The force that a motion at constant velocity, shape (s, 3), requires in the simulator, in FRD, shape (s, 3).
    """
    nu = velocities(one)
    whole = one.force.at_constant_velocity(nu)
    return dict(zip(AXES, share(simulated(nu) - whole, whole).tolist(), strict=True))


def mass_share(one: Exported, mass: Floats) -> dict[str, float]:
    """Return the share of the inertial force that a simulator's mass matrix gets wrong, by axis, over usual accelerations."""
    known = {name: max(abs(low), abs(high)) for name, low, high, _ in one.ranges}
    size = np.diag([known.get(name) or USUAL[name] for name in ("u_dot", "v_dot", "r_dot")])
    # Independent accelerations: the squares of a row's entries add up.
    off, whole = ((matrix @ size).T for matrix in (mass - one.mass, one.mass))
    return dict(zip(AXES, share(off, whole).tolist(), strict=True))


def _fitted(kept: PlanarTerms, slots: Slots, nu: Floats, rest: Floats) -> PlanarTerms:
    """Return terms with those of ``slots.fitted`` changed so that they take up the rest, shape (s, 3)."""
    from scipy.optimize import lsq_linear  # a tenth of a second to import

    made = PlanarTerms(kept.linear.copy(), kept.absolute.copy(), kept.product.copy())
    for axis in range(3):
        mine = [slot for slot in slots.fitted if slot[0] == axis]
        if not mine or not np.any(rest[:, axis]):
            continue
        columns = np.column_stack([nu[:, j] if k is None else nu[:, j] * np.abs(nu[:, k]) for _, j, k in mine])
        # What the other velocities do by themselves is not to be taken for a damping of this one.
        others = [(j, k) for j in range(3) for k in range(j, 3) if axis not in (j, k)]
        beside = np.column_stack([np.ones(len(nu)), *(nu[:, j] * nu[:, k] for j, k in others)])
        columns = np.column_stack([columns, beside])
        size = np.linalg.norm(columns, axis=0)
        exact = [float(made.linear[axis, j] if k is None else made.absolute[axis, j, k]) for _, j, k in mine]
        diagonal = [j == axis and k in (None, axis) for _, j, k in mine]
        low = [-max(0.0, value) if own else -np.inf for value, own in zip(exact, diagonal, strict=True)]
        low += [-np.inf] * beside.shape[1]
        # A bound of zero width is none that the solver takes.
        found = (
            lsq_linear(columns / size, rest[:, axis], (np.minimum(low * size, -np.finfo(float).tiny), np.inf)).x / size
        )
        for (_, j, k), value in zip(mine, found.tolist()[: len(mine)], strict=True):
            if k is None:
                made.linear[axis, j] += value
            else:
                made.absolute[axis, j, k] += value
    return made


def _names(terms: PlanarTerms) -> Iterator[str]:
    for axis, letter in enumerate(AXIS_LETTERS):
        for j, velocity in enumerate(VELOCITIES):
            if terms.linear[axis, j] != 0.0:
                yield f"{letter}_{velocity}"
            for k, other in enumerate(VELOCITIES):
                if terms.absolute[axis, j, k] != 0.0:
                    yield f"{letter}_|{other}|{velocity}"
                if terms.product[axis, j, k] != 0.0:
                    yield f"{letter}_{velocity}{other}"
