"""From a case to its log: the plant sails, the log is written, and what acted is told apart."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import welch

from ferryid.files import replacing
from ferryid.prove.case import Case
from ferryid.prove.known import profile_text
from ferryid.prove.plant.conditions import Conditions
from ferryid.prove.plant.navigation import RATE_HZ
from ferryid.prove.plant.sail import Voyage, sail
from ferryid.prove.plant.vessels import VESSELS, Vessel
from ferryid.prove.record import streams, write

AGAIN = 0x5EED
"""Turns a seed into that of the second log."""


@dataclass(frozen=True)
class Generated:
    """The log and the profile of a case, and what disturbances really did: parameters by effect id."""

    log: Path
    profile: Path
    acted: dict[str, dict[str, float]]


def generate(case: Case, folder: Path, *, again: bool = False) -> Generated:
    """Sail a case and write its log and ``vessel.toml``.

    Parameters
    ----------
    case
        From `ferryid.prove.draw.drawn`.
    folder
        Where, made if it is not there.
    again
        Sail the same truth a second time: another path, other weather of the same kind and other noise.
    """
    vessel, conditions = VESSELS[case.vessel], conditions_of(case)
    seed = case.seed ^ AGAIN if again else case.seed
    voyage = sail(vessel, conditions, case.path, seed)
    folder.mkdir(parents=True, exist_ok=True)
    profile = folder / "vessel.toml"
    with replacing(profile, new=False) as temporary:
        temporary.write_text(_profile(case, vessel), encoding="utf-8")
    log = write(streams(vessel, conditions, voyage, seed), folder, case.name, case.format)
    return Generated(log, profile, acted(voyage, conditions))


def conditions_of(case: Case) -> Conditions:
    """Return a case's conditions, whatever lists its plain data made of them."""
    told: dict[str, Any] = dict(case.knobs["conditions"])
    known = {one.name for one in fields(Conditions)}
    assert set(told) <= known, sorted(set(told) - known)
    return Conditions(**{name: _frozen(value) for name, value in told.items()})


def _frozen(value: Any) -> Any:
    return tuple(_frozen(one) for one in value) if isinstance(value, list | tuple) else value


def _profile(case: Case, vessel: Vessel) -> str:
    knobs = case.knobs
    first, *rest = vessel.thrusters
    believed = replace(first, x=first.x + float(knobs.get("moved", 0.0)) * vessel.length)
    return profile_text(vessel, knobs["factors"], (believed, *rest), tuple(knobs.get("lacks", ())))


def acted(voyage: Voyage, conditions: Conditions) -> dict[str, dict[str, float]]:
    """Return what a sea did to the vessel, and what share of the thrust the inflow took: no condition says so."""
    told = {}
    if conditions.wave_height > 0.0:
        X, Y, N = voyage.waves[:, [0, 1, 5]].T
        frequency, power = welch(N, RATE_HZ, nperseg=4096)
        told["waves"] = {
            "peak_frequency": float((frequency * power).sum() / power.sum()),
            "force_std": float(np.sqrt(0.5 * (X.var() + Y.var()))),
            "moment_std": float(N.std()),
        }
    if conditions.inflow != 0.0:
        _, push, flow = voyage.thrust.T
        force = np.abs(push)
        # Loss by inflow over force times inflow, by least squares: the hypothesis takes another form than the plant.
        lost = np.abs(push) - voyage.thrust[:, :, 0].T * np.sign(push)
        told["thrust_inflow_loss"] = {"per_mps": float((lost * force * flow).sum() / ((force * flow) ** 2).sum())}
    return told
