"""From logs to diagnoses: measure, screen the sensors, estimate, select, judge, conclude."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ferryid.diagnose.checks.screening import screen_sensors
from ferryid.diagnose.data.measurements import measure_log
from ferryid.diagnose.inference.baselines import CampaignBaseline, HullBaseline, SimulationBaseline
from ferryid.diagnose.inference.campaign import fit_campaign
from ferryid.diagnose.inference.simulation_baseline import learn_simulation
from ferryid.diagnose.inference.stages import Baseline, average, estimate, select
from ferryid.diagnose.judging.conclude import conclude
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.judge import judge
from ferryid.diagnose.judging.model_update import store_updated_model
from ferryid.errors import FerryIdError
from ferryid.models import Model
from ferryid.models.store import check_name
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class DiagnosisSettings:
    """What logs are compared with, and how they are read.

    Attributes
    ----------
    model
        A fitted model to examine; the profile's hull where None.
    against
        Path of a simulated log of the trial: what is found is the difference to that simulation.
    together
        Fit one hull to all logs first, and diagnose each with what the others say of it.
    withhold
        Signals to hide from the diagnosis.
    verify
        Check every checksum.
    """

    model: Model | None = None
    against: str | None = None
    together: bool = False
    withhold: tuple[str, ...] = ()
    verify: bool = False

    def check(self) -> None:
        """Refuse two things to compare with at once."""
        if self.against is not None and self.model is not None:
            raise FerryIdError(
                "diagnose: a recording is held against one thing at a time, found both --model and --against. "
                "Fix: leave out one of the two"
            )
        if self.together and (self.against is not None or self.model is not None):
            raise FerryIdError(
                "diagnose: --together finds the hull in the logs, found --model or --against as well, which bring their own. "
                "Fix: leave out one of the two"
            )


def diagnose_campaign(
    logs: Sequence[str],
    profile: Profile,
    tables: Path | None,
    baseline: Baseline | None,
    settings: DiagnosisSettings,
    *,
    progress: Callable[[str], None],
) -> tuple[Diagnosis, ...]:
    """Diagnose the logs of a campaign; one log is a campaign of one.

    Parameters
    ----------
    logs
        Paths; parts of one recording joined by ``+``.
    profile
        The vessel.
    tables
        Output folder, whose ``logs`` keep the ingested tables; None keeps none.
    baseline
        What the logs are compared with; None for one hull that is fitted to all of them.
    settings
        Which signals are hidden, and whether checksums are checked.
    progress
        Called with the name of each stage.

    Raises
    ------
    FerryIdError
        For logs that cannot be used, and for fewer than two where a hull is to be fitted to all.
    """
    hidden, verify = settings.withhold, settings.verify
    measured = [measure_log(log, profile, tables, withhold=hidden, verify=verify, progress=progress) for log in logs]
    screened = [screen_sensors(log, progress) for log in measured]
    averaged = [average(log) for log in screened]
    if baseline is None:
        baseline = CampaignBaseline(profile, fit_campaign(averaged, profile, progress))
    estimated = [estimate(log, baseline) for log in averaged if log.long_enough]
    selected = [select(log, progress) for log in estimated]
    judged = judge(selected, progress)
    return conclude(averaged, judged, baseline)


def diagnose(
    logs: Sequence[str],
    profile: Profile,
    tables: Path | None,
    settings: DiagnosisSettings | None = None,
    *,
    progress: Callable[[str], None],
) -> tuple[Diagnosis, ...]:
    """Diagnose logs of one vessel, each as a campaign of its own, or all together.

    Parameters
    ----------
    logs, profile, tables, progress
        As of `diagnose_campaign`.
    settings
        What the logs are compared with; the profile's hull where None.

    Raises
    ------
    FerryIdError
        For input that cannot be used.
    """
    chosen = settings or DiagnosisSettings()
    chosen.check()
    baseline: Baseline | None = None if chosen.together else HullBaseline(profile, chosen.model)
    if chosen.against is not None:
        baseline = SimulationBaseline(
            learn_simulation(chosen.against, profile, tables, verify=chosen.verify, progress=progress)
        )
    return tuple(
        diagnosis
        for campaign in ([logs] if chosen.together else [[log] for log in logs])
        for diagnosis in diagnose_campaign(campaign, profile, tables, baseline, chosen, progress=progress)
    )


def diagnose_and_store(
    logs: Sequence[str],
    profile: Profile,
    out: Path,
    settings: DiagnosisSettings | None = None,
    *,
    tables: Path | None,
    name: str = "",
    progress: Callable[[str], None],
) -> tuple[Diagnosis, ...]:
    """Diagnose logs and store the model that the findings lead to.

    Parameters
    ----------
    logs, profile, settings, tables, progress
        As of `diagnose`.
    out
        Output folder, whose ``models`` keep the model.
    name
        Name of the model; that of the examined model, else the vessel's, where empty.

    Raises
    ------
    FerryIdError
        For input that cannot be used, a name that a model cannot have, and a folder that cannot be written.
    """
    chosen = settings or DiagnosisSettings()
    if name:
        check_name(name)
    found = diagnose(logs, profile, tables, chosen, progress=progress)
    return store_updated_model(found, profile, chosen.model, out, name=name)
