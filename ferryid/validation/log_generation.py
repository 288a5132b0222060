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
from ferryid.validation.sea import realised_at_sea, write_campaign

TRANSFER_SEED = 0x5EED
"""Turns a seed into that of the transfer log."""


@dataclass(frozen=True)
class LogFiles:
    """The log and the profile of a case, the further logs of a campaign, and logs that these are compared with."""

    log: Path
    profile: Path
    more: tuple[Path, ...] = ()
    before: tuple[Path, ...] = ()


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
    folder.mkdir(parents=True, exist_ok=True)
    profile = folder / "vessel.toml"
    with replacing(profile, new=False) as temporary:
        temporary.write_text(_profile(case, vessel, hull=case.logs == 1), encoding="utf-8")
    if case.logs > 1:
        log, *more = write_campaign(replace(case, seed=seed), folder)
        return LogFiles(log, profile, tuple(more))
    trial = simulate_trial(vessel, case.conditions, case.path, seed)
    log = write_log(streams(trial, seed), folder, case.name, case.format)
    return LogFiles(log, profile)


def realised_parameters(case: Case) -> dict[str, dict[str, float]]:
    """Return parameters by effect that no setting gives: they are measured in the trial, which is simulated for it.

    In a campaign they are by effect, or by effect and number of the log: see `ferryid.validation.sea.realised_at_sea`.
    """
    if case.logs > 1:
        return realised_at_sea(case)
    conditions = complete_conditions(case.conditions)
    measured = [one for one in plant_effects().values() if one.realised is not None]
    if not any(conditions[name] != value for one in measured for name, value in one.settings.items()):
        return {}
    trial = simulate_trial(VESSELS[case.vessel], conditions, case.path, case.seed)
    found = {one.id: dict(one.realised(trial, conditions)) for one in measured if one.realised is not None}
    return {name: values for name, values in found.items() if values}


def _profile(case: Case, vessel: Vessel, *, hull: bool = True) -> str:
    """Return the profile of a case; a campaign's has no hull model."""
    first, *rest = vessel.thrusters
    shifted = replace(first, x=first.x + case.thruster_shift * vessel.length)
    return profile_text(vessel, case.hull_factors if hull else None, (shifted, *rest), case.omitted_terms)


def profile_with_hull(case: Case) -> str:
    """Return the profile of a case with its hull model also where a diagnosis is given none, for the oracle."""
    return _profile(case, VESSELS[case.vessel])
