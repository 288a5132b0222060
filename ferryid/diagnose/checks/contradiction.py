"""Actuators that push against what follows, angles that count the other way round, and clocks that are far apart.

Over windows of some seconds, the change of the velocity over ground is regressed on the force of all actuators together, as
complex numbers (north + i east), beside drag, a steady push and the lift of a turning hull. The coefficient of the force is one
over the mass, and real. Where the force explains next to nothing as declared, and nearly all with a sign, an angle or a clock
changed, the profile or the recorder is wrong, and no effect has to stand in for it.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.effects.force_model import Measurements

MOST_ACTUATORS = 6
"""Actuators whose signs are tried in all combinations."""
SHIFTS_S = np.arange(-60.0, 61.0)


def opposed(measurements: Measurements) -> str:
    """Return a sentence on what is certainly the wrong way round between force and motion, empty where nothing is.

    Parameters
    ----------
    measurements
        Sensors corrected.
    """
    force = (
        np.nan_to_num(measurements.parts[:, :, 0] + 1j * measurements.parts[:, :, 1])
        / measurements.profile.hull.mass_kg
    )
    declared = _left(measurements, force.sum(axis=1)) if force.any() else 0.0
    if declared < CHECKS.opposed_left or len(measurements.names) > MOST_ACTUATORS:
        return ""
    azimuths = np.array([actuator.kind == "azimuth" for actuator in measurements.profile.actuators])
    mirrored = np.where(azimuths, np.conj(force), force)
    tried = []
    for signs in product((1.0, -1.0), repeat=len(measurements.names)):
        sign = np.array(signs)
        against = f"against the force of {_listed(measurements, sign < 0.0)}" if min(signs) < 0.0 else ""
        tried.append((_left(measurements, force @ sign), against))
        if azimuths.any():
            other = f"as if the angle of {_listed(measurements, azimuths)} counted the other way round"
            tried.append((_left(measurements, mirrored @ sign), " and ".join(filter(None, (other, against)))))
    when = _apart(measurements, force.sum(axis=1))
    if when is not None:
        left, late_s = when
        tried.append(
            (left, f"{abs(late_s):.0f} s {'later' if late_s > 0.0 else 'earlier'} than the force recorded for it")
        )
    best, says = min(tried)
    if not says or best > CHECKS.opposed_left or CHECKS.opposed_ratio * best > declared:
        return ""
    not_so = f"{100.0 * (1.0 - declared):.0f} %" if declared < 1.0 else "it does not even push that way"
    return f"The vessel moves {says} (that explains {100.0 * (1.0 - best):.0f} % of its accelerations; as declared {not_so})."


def _apart(measurements: Measurements, force: NDArray[np.complexfloating[Any, Any]]) -> tuple[float, float] | None:
    """Return what is left if force and motion are shifted in time, and by how much [s]; None where that is no offset of clocks.

    A force that answers a swell fits at many shifts, and one that lags at several; clocks are apart by one time.
    """
    left = {}
    for late_s in SHIFTS_S.tolist():
        rows = round(late_s / measurements.step_s)
        moved = replace(
            measurements,
            usable=measurements.usable & np.roll(measurements.usable, rows) & _inside(len(measurements.t), rows),
        )
        left[late_s] = _left(moved, np.roll(force, rows))
    best = min(left, key=lambda late_s: left[late_s])
    others = min(share for late_s, share in left.items() if abs(late_s - best) > CHECKS.opposed_span_s)
    alone = abs(best) >= CHECKS.apart_s and others >= CHECKS.apart_ratio * left[best]
    return (left[best], best) if alone else None


def _inside(count: int, rows: int) -> NDArray[np.bool_]:
    """Return the rows that a shift fills from within."""
    place = np.arange(count) - rows
    return np.asarray((place >= 0) & (place < count))


def _listed(measurements: Measurements, chosen: NDArray[np.bool_]) -> str:
    return " and ".join(name for name, one in zip(measurements.names, chosen.tolist(), strict=True) if one)


def _left(measurements: Measurements, push: NDArray[np.complexfloating[Any, Any]]) -> float:
    """Return the share of the accelerations that a push along the body leaves unexplained; 1 if it does not push that way.

    Shares are of what drag, a steady push and the lift of a turning hull leave: that lift is against a stern thruster's force.
    """
    span = max(2, round(CHECKS.opposed_span_s / measurements.step_s))
    starts = np.arange(0, len(measurements.t) - span, span)
    gone = np.concatenate([[0], np.cumsum(~measurements.usable)])
    starts = starts[gone[starts + span + 1] == gone[starts]]
    if len(starts) < CHECKS.opposed_windows:
        return 1.0
    turn = np.exp(1j * measurements.psi)
    u, v, r = measurements.nu_raw.T
    velocity = (u + 1j * v) * turn
    change = (velocity[starts + span] - velocity[starts]) / (span * measurements.step_s)
    lift = 1j * turn * u
    columns = np.column_stack(
        [push * turn, velocity, np.abs(velocity) * velocity, np.ones_like(velocity), lift * v, lift * r]
    )
    summed = np.concatenate([np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)])
    means = (summed[starts + span] - summed[starts]) / span
    both = np.column_stack([means[:, 0], change])
    felt, rest = (both - means[:, 1:] @ np.linalg.lstsq(means[:, 1:], both, rcond=None)[0]).T
    size, spread = float(np.linalg.norm(felt)), float(np.linalg.norm(rest))
    if size <= CHECKS.no_push * float(np.linalg.norm(means[:, 0])) or spread == 0.0:
        return 1.0
    gain = complex(np.vdot(felt, rest)) / size**2
    if not CHECKS.least_response < abs(gain) < CHECKS.most_response or abs(np.angle(gain)) > np.radians(
        CHECKS.response_angle_deg
    ):
        return 1.0
    return float(np.linalg.norm(rest - gain * felt) / spread) ** 2
