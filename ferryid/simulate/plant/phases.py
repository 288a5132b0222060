"""What changes at once during a trial: payload, faults and other effects. Between two changes lies a phase.

Changes are put on the nearest step of the integrator, so that no Runge-Kutta step runs across one.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, pi
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.simulate.plant.hull import Hydrodynamics
from ferryid.simulate.plant.payload import boarding, inverse, loaded, together
from ferryid.simulate.sections import Fault, Payload
from ferryid.types import Floats
from ferryid.vessel.profile import Profile


class Phases(NamedTuple):
    """S phases; `of_step` (steps + 1) says which one each step belongs to.

    `mass` (S, 3) holds m11, m22 and the mean of m23 and m32, `inverse` (S, 5) the inverse of M, `boarding` (S, 5) what turns
    the velocities before the phase into those at its start, `payload` (S, 2) mass [kg] and place [m], `acts` (S, Q) 1 where an
    added effect acts and else 0, `factor` and `offset` (S, k) every thruster's factor on its force and how far its true angle
    is ahead [rad].
    """

    of_step: NDArray[np.int64]
    mass: Floats
    inverse: Floats
    boarding: Floats
    payload: Floats
    acts: Floats
    factor: Floats
    offset: Floats


class Lasting(Protocol):
    """Something that lasts from one time to another [s]."""

    @property
    def from_s(self) -> float: ...
    @property
    def until_s(self) -> float: ...


def phases_of(
    p: Hydrodynamics,
    profile: Profile,
    payload: Sequence[Payload],
    added: Sequence[Lasting],
    faults: Sequence[Fault],
    h: float,
    steps: int,
    zeta: float = 1.0,
) -> Phases:
    """Return the phases of a trial of `steps` steps of `h` seconds; `zeta` divides the force that moves the payload.

    Raises
    ------
    FerryIdError
        When a fault names a thruster that the vessel has not.
    """
    names = [actuator.name for actuator in profile.actuators]
    for fault in faults:
        if fault.thruster not in names:
            raise FerryIdError(
                f"{profile.name}: a fault is asked for in a thruster that the vessel has not, found "
                f'"{fault.thruster}".{did_you_mean(fault.thruster, names)} Fix: use one of {", ".join(names)}'
            )
    lasting: tuple[Lasting, ...] = (*payload, *added, *faults)
    ends = {step_at(time_s, h) for one in lasting for time_s in (one.from_s, one.until_s)}
    starts = [0, *sorted(start for start in ends if 0 < start <= steps)]
    of_step = np.zeros(steps + 1, dtype=np.int64)
    for start in starts[1:]:
        of_step[start:] += 1
    S = len(starts)
    phases = Phases(
        of_step=of_step,
        mass=np.zeros((S, 3)),
        inverse=np.zeros((S, 5)),
        boarding=np.zeros((S, 5)),
        payload=np.zeros((S, 2)),
        acts=np.zeros((S, len(added))),
        factor=np.ones((S, len(names))),
        offset=np.zeros((S, len(names))),
    )
    for s, start in enumerate(starts):
        aboard = [one for one in payload if _on(one, start, h)]
        M = loaded(p, aboard, zeta)
        kept = loaded(p, [one for one in aboard if _on(one, start - 1, h)], zeta) if s else M
        phases.mass[s] = M[0], M[1], 0.5 * (M[2] + M[3])
        phases.inverse[s] = inverse(M)
        phases.boarding[s] = boarding(kept, M) if kept != M else (1.0, 1.0, 0.0, 0.0, 1.0)
        phases.payload[s] = together(aboard)
        phases.acts[s] = [1.0 if _on(one, start, h) else 0.0 for one in added]
        for fault in faults:
            if _on(fault, start, h):
                phases.factor[s, names.index(fault.thruster)] *= fault.factor
                phases.offset[s, names.index(fault.thruster)] += fault.offset_deg * pi / 180.0
    return phases


def step_at(time_s: float, h: float) -> int:
    """Return the step nearest to a time."""
    return floor(time_s / h + 0.5)


def _on(one: Lasting, step: int, h: float) -> bool:
    return step_at(one.from_s, h) <= step < step_at(one.until_s, h)
