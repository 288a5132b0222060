"""What a draft maps, and the motion that it shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

from ferryid.draft.thresholds import DRAFT
from ferryid.types import Floats
from ferryid.vessel.units import KINDS


@dataclass(frozen=True)
class MappedSignal:
    """One entry of a drafted signal map.

    Attributes
    ----------
    quantity, topic, fields, unit, frame, sign, where
        As of `ferryid.vessel.profile.Signal`.
    evidence
        What the log shows for unit, frame and sign, a sentence each.
    doubts
        What a person has to check, a sentence each.
    pulse_us
        Pulses of full astern, neutral and full ahead, and the dead band [us]; None where they are not stated.
    full_deg
        Angle at full travel [deg], 0 where it is not stated.
    """

    quantity: str
    topic: str
    fields: tuple[str, ...]
    unit: str
    frame: str = ""
    sign: float = 1.0
    evidence: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    options: tuple[tuple[str, str], ...] = ()
    where: tuple[tuple[str, float], ...] = ()
    pulse_us: tuple[float, float, float, float] | None = None
    full_deg: float = 0.0


@dataclass(frozen=True)
class Motion:
    """How the vessel moves, on the grid: velocity ahead and to starboard [m/s], yaw rate [rad/s], heading [rad]; or NaN."""

    u: Floats
    v: Floats
    r: Floats
    psi: Floats


def nearest_unit(gain: float, kind: str, units: Sequence[str]) -> tuple[str, float]:
    """Return the unit whose factor explains a gain of recorded over SI, the first of them where none does, and what is left."""
    left = {unit: gain * KINDS[kind][unit] for unit in units}
    best = min(units, key=lambda one: abs(log(max(left[one], 1e-12))))
    unit = best if abs(log(max(left[best], 1e-12))) <= DRAFT.gain else units[0]
    return unit, left[unit]
