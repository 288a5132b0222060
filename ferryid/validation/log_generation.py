"""From a case to its log: the plant sails, and the log is written with the profile of the vessel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from ferryid.files import replacing
from ferryid.validation.case import Case
from ferryid.validation.log_writer import streams, write_log
from ferryid.validation.plant.effects import complete_conditions, plant_effects
from ferryid.validation.plant.trial import simulate_trial
from ferryid.validation.plant.vessels import VESSELS, Vessel
from ferryid.validation.prior_profile import profile_text

TRANSFER_SEED = 0x5EED
"""Turns a seed into that of the transfer log."""


@dataclass(frozen=True)
class LogFiles:
    """The log and the profile of a case, and the further logs of a campaign."""

    log: Path
    profile: Path
    more: tuple[Path, ...] = ()


def generate(case: Case, folder: Path, *, transfer: bool = False) -> LogFiles:
    """Simulate a case and write its log and ``vessel.toml``.

    Parameters
    ----------
    case
        From `ferryid.validation.case_sampling.sample_cases`.
    folder
        Where, made if it is not there.
    transfer
        Write a second log of the same truth: another path, other weather of the same kind and other noise.
    """
    vessel = VESSELS[case.vessel]
    seed = case.seed ^ TRANSFER_SEED if transfer else case.seed
    trial = simulate_trial(vessel, case.conditions, case.path, seed)
    folder.mkdir(parents=True, exist_ok=True)
    profile = folder / "vessel.toml"
    with replacing(profile, new=False) as temporary:
        temporary.write_text(_profile(case, vessel), encoding="utf-8")
    log = write_log(streams(trial, seed), folder, case.name, case.format)
    return LogFiles(log, profile)


def realised_parameters(case: Case) -> dict[str, dict[str, float]]:
    """Return parameters by effect that no setting gives: they are measured in the trial, which is simulated for it."""
    conditions = complete_conditions(case.conditions)
    measured = [one for one in plant_effects().values() if one.realised is not None]
    if not any(conditions[name] != value for one in measured for name, value in one.settings.items()):
        return {}
    trial = simulate_trial(VESSELS[case.vessel], conditions, case.path, case.seed)
    found = {one.id: dict(one.realised(trial, conditions)) for one in measured if one.realised is not None}
    return {name: values for name, values in found.items() if values}


def _profile(case: Case, vessel: Vessel) -> str:
    first, *rest = vessel.thrusters
    shifted = replace(first, x=first.x + case.thruster_shift * vessel.length)
    return profile_text(vessel, case.hull_factors, (shifted, *rest), case.omitted_terms)
