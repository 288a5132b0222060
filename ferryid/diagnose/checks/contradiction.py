"""Actuators that push against what follows, angles that count the other way round, and clocks that are far apart.

Over windows of some seconds, the change of the velocity over ground is regressed on the force of all actuators together, as
complex numbers (north + i east), beside drag and a steady push. The coefficient of the force is one over the mass, and real:
noise and a controller change its size, but not its sign. Where the force explains next to nothing as declared, and nearly all
with a sign, an angle or a clock changed, the profile or the recorder is wrong, and no effect has to stand in for it.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.effects.picture import Scene

SPAN_S = 4.0
FEWEST = 60
LEAST, MOST = 0.2, 5.0
"""Parts of one over the mass between which the coefficient of a force lies."""
TURNED_DEG = 30.0
"""How far the coefficient is from being real at most."""
LEFT, BETTER = 0.3, 3.0
"""A change is believed that leaves at most this share of the accelerations unexplained, and so many times less than without."""
MOST_ACTUATORS = 6
LATE_S = np.concatenate([np.arange(-60.0, -3.0), np.arange(4.0, 61.0)])
"""Clock offsets [s] beyond what the effect of a delay is for."""


def opposed(scene: Scene) -> str:
    """Return a sentence on what is certainly the wrong way round between force and motion, empty where nothing is.

    Parameters
    ----------
    scene
        Sensors corrected.
    """
    force = np.nan_to_num(scene.parts[:, :, 0] + 1j * scene.parts[:, :, 1]) / scene.profile.hull.mass_kg
    declared = _left(scene, force.sum(axis=1)) if force.any() else 0.0
    if declared < LEFT or len(scene.names) > MOST_ACTUATORS:
        return ""
    azimuths = np.array([actuator.kind == "azimuth" for actuator in scene.profile.actuators])
    mirrored = np.where(azimuths, np.conj(force), force)
    tried = []
    for signs in product((1.0, -1.0), repeat=len(scene.names)):
        sign = np.array(signs)
        against = f"against the force of {_listed(scene, sign < 0.0)}" if min(signs) < 0.0 else ""
        tried.append((_left(scene, force @ sign), against))
        if azimuths.any():
            other = f"as if the angle of {_listed(scene, azimuths)} counted the other way round"
            tried.append((_left(scene, mirrored @ sign), " and ".join(filter(None, (other, against)))))
    for late_s in LATE_S:
        rows = round(late_s / scene.step_s)
        moved = replace(scene, usable=scene.usable & np.roll(scene.usable, rows) & _inside(len(scene.t), rows))
        when = f"{abs(late_s):.0f} s {'later' if late_s > 0.0 else 'earlier'} than the force that is recorded for it"
        tried.append((_left(moved, np.roll(force.sum(axis=1), rows)), when))
    best, says = min(tried)
    if not says or best > LEFT or BETTER * best > declared:
        return ""
    so, not_so = (f"{100.0 * (1.0 - left):.0f} %" for left in (best, declared))
    return f"The vessel moves {says} (that explains {so} of its accelerations, as declared {not_so})."


def _inside(count: int, rows: int) -> NDArray[np.bool_]:
    """Return the rows that a shift fills from within."""
    place = np.arange(count) - rows
    return np.asarray((place >= 0) & (place < count))


def _listed(scene: Scene, chosen: NDArray[np.bool_]) -> str:
    return " and ".join(name for name, one in zip(scene.names, chosen.tolist(), strict=True) if one)


def _left(scene: Scene, push: NDArray[np.complexfloating[Any, Any]]) -> float:
    """Return the share of the accelerations that a push along the body leaves unexplained; 1 if it does not push that way."""
    span = max(2, round(SPAN_S / scene.step_s))
    starts = np.arange(0, len(scene.t) - span, span)
    gone = np.concatenate([[0], np.cumsum(~scene.usable)])
    starts = starts[gone[starts + span + 1] == gone[starts]]
    if len(starts) < FEWEST:
        return 1.0
    turn = np.exp(1j * scene.psi)
    velocity = (scene.nu_raw[:, 0] + 1j * scene.nu_raw[:, 1]) * turn
    change = (velocity[starts + span] - velocity[starts]) / (span * scene.step_s)
    columns = np.column_stack([push * turn, velocity, np.abs(velocity) * velocity, np.ones_like(velocity)])
    summed = np.concatenate([np.zeros((1, 4)), np.cumsum(columns, axis=0)])
    means = (summed[starts + span] - summed[starts]) / span
    solution, _, rank, _ = np.linalg.lstsq(means, change, rcond=None)
    gain, spread = complex(solution[0]), float(np.linalg.norm(change - change.mean()) ** 2)
    pushes = LEAST < abs(gain) < MOST and abs(np.angle(gain)) < np.radians(TURNED_DEG)
    if rank < means.shape[1] or spread == 0.0 or not pushes:
        return 1.0
    return float(np.linalg.norm(change - means @ solution) ** 2) / spread
