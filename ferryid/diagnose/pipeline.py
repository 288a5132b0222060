"""From logs to diagnoses: measure, screen the sensors, estimate, select, judge, conclude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ferryid.diagnose.checks.screening import screen_sensors
from ferryid.diagnose.data.measurements import measure_log
from ferryid.diagnose.inference.baselines import CampaignBaseline, HullBaseline, SimulationBaseline
from ferryid.diagnose.inference.campaign import assemble
from ferryid.diagnose.inference.simulation_baseline import learn_simulation
from ferryid.diagnose.inference.stages import AveragedLog, Baseline, average, estimate, select
from ferryid.diagnose.judging.campaign import JudgedCampaign, judge_campaign
from ferryid.diagnose.judging.conclude import conclude
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.judge import judge
from ferryid.diagnose.judging.learning import Learner, without_withheld
from ferryid.diagnose.judging.model_update import store_updated_model
from ferryid.diagnose.second_sources import compare_second_sources
from ferryid.errors import FerryIdError
from ferryid.models import Model
from ferryid.models.store import check_name
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class DiagnosisSettings:
    """What logs are compared with, and which signals are hidden.

    Attributes
    ----------
    model
        A fitted model to examine; the profile's hull where None.
    against
        Path of a simulated log of the trial: what is found is the difference to that simulation.
    each
        Diagnose every log by itself; else several logs are one campaign, with one hull, and conditions judged over all logs.
    withhold
        Signals to hide from the diagnosis.
    """

    model: Model | None = None
    against: str | None = None
    each: bool = False
    withhold: tuple[str, ...] = ()

    def check(self) -> None:
        """Refuse two things to compare with at once."""
        if self.against is not None and self.model is not None:
            raise FerryIdError(
                "diagnose: a recording is compared with one thing at a time, found both --model and --against. "
                "Fix: leave out one of the two"
            )


def diagnose_campaign(
    logs: Sequence[str],
    profile: Profile,
    settings: DiagnosisSettings,
    run: RunContext,
) -> tuple[Diagnosis, ...]:
    """Diagnose the logs of a campaign; one log is a campaign of one.

    Parameters
    ----------
    logs
        Paths; parts of one recording joined by ``+``.
    profile
        The vessel.
    settings
        What the logs are compared with, and which signals are hidden.
    run
        Folder of the ingested tables, progress, and whether to check every checksum of the logs.

    Raises
    ------
    FerryIdError
        Where no log can be used. Of several, those that cannot are left out, and the notes name them.
    """
    averaged, left_out = average_logs(logs, profile, settings, run)
    baseline, together = _baseline(averaged, profile, settings, run)
    estimated = [estimate(log, baseline) for log in averaged if log.long_enough]
    selected = [select(log, run.progress) for log in estimated]
    judged = judge(selected, run.progress)
    found = conclude(averaged, judged, baseline, together, left_out)
    sources = compare_second_sources([log.screened.measured for log in averaged], settings.withhold, run.progress)
    return tuple(replace(one, sources=sources) for one in found)


def average_logs(
    logs: Sequence[str], profile: Profile, settings: DiagnosisSettings, run: RunContext
) -> tuple[list[AveragedLog], tuple[str, ...]]:
    """Return the logs that can be used, measured, screened and averaged, and why each of the others cannot."""
    found, errors = list[AveragedLog](), list[FerryIdError]()
    for log in logs:
        try:
            measured = measure_log(log, profile, run, withhold=settings.withhold)
            found.append(average(screen_sensors(measured, run.progress)))
        except FerryIdError as error:
            # A path that leads nowhere is a slip of the pen, no log that cannot be used.
            if not (Path(log).exists() or all(Path(part).exists() for part in log.split("+"))):
                raise
            errors.append(error)
    if not found:
        raise errors[0]
    return found, tuple(f"Left out of the campaign: {error}" for error in errors)


def _baseline(
    logs: Sequence[AveragedLog], profile: Profile, settings: DiagnosisSettings, run: RunContext
) -> tuple[Baseline, JudgedCampaign | None]:
    """Return what logs are compared with, and what the logs of a campaign say together."""
    if settings.against is not None:
        return SimulationBaseline(learn_simulation(settings.against, profile, run)), None
    assembled = assemble(logs, profile, settings.model)
    if assembled is None:
        return HullBaseline(profile, settings.model), None
    together = judge_campaign(*assembled, run.progress)
    return CampaignBaseline(profile, together.hull, settings.model), together


def diagnose(
    logs: Sequence[str],
    profile: Profile,
    settings: DiagnosisSettings,
    run: RunContext,
) -> tuple[Diagnosis, ...]:
    """Diagnose logs of one vessel as a campaign, or each by itself.

    Parameters
    ----------
    logs, profile, run
        As of `diagnose_campaign`.
    settings
        What the logs are compared with, and which signals are hidden.

    Raises
    ------
    FerryIdError
        For input that cannot be used.
    """
    settings.check()
    apart = settings.each or settings.against is not None
    return tuple(
        diagnosis
        for campaign in ([[log] for log in logs] if apart else [logs])
        for diagnosis in diagnose_campaign(campaign, profile, settings, run)
    )


def diagnose_and_store(
    logs: Sequence[str],
    profile: Profile,
    settings: DiagnosisSettings,
    run: RunContext,
    *,
    name: str = "",
) -> tuple[Diagnosis, ...]:
    """Diagnose logs and store the model that the findings lead to.

    Parameters
    ----------
    logs, profile, settings
        As of `diagnose`.
    run
        Output folder, whose ``models`` keep the model; else as of `diagnose`.
    name
        Name of the model; that of the examined model, else the vessel's, where empty.

    Raises
    ------
    FerryIdError
        For input that cannot be used, a name that a model cannot have, and a folder that cannot be written.
    """
    if name:
        check_name(name)
    found = diagnose(logs, profile, settings, run)
    learner = None
    # Of a simulation no model comes.
    if settings.against is None:
        seen = without_withheld(profile, settings.withhold)
        learner = Learner(tuple(one.path for one in found if not one.copy), seen, settings.model, run)
    return store_updated_model(found, profile, settings.model, run.out, name=name, learner=learner)
