"""From logs to diagnoses: measure, screen the sensors, estimate, select, judge, conclude."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from ferryid.diagnose.gathering import (
    CAMPAIGN,
    REFERENCES,
    Gathered,
    Group,
    engaged,
    gather,
    part,
    unused,
    with_common_sensors,
    with_own_sensors,
    without_logs,
)
from ferryid.diagnose.inference.baselines import CampaignBaseline, HullBaseline, SimulationBaseline
from ferryid.diagnose.inference.campaign import assemble
from ferryid.diagnose.inference.simulation_baseline import learn_simulation
from ferryid.diagnose.inference.stages import AveragedLog, Baseline, SelectedLog, estimate, select
from ferryid.diagnose.judging.campaign import JudgedCampaign, judge_campaign
from ferryid.diagnose.judging.conclude import conclude
from ferryid.diagnose.judging.diagnosis import Diagnosis, distinguished
from ferryid.diagnose.judging.hidden_gain import hidden_gains
from ferryid.diagnose.judging.hidden_signal import with_gains
from ferryid.diagnose.judging.judge import judge
from ferryid.diagnose.judging.learning import Learner, without_withheld
from ferryid.diagnose.judging.model_update import store_updated_model
from ferryid.diagnose.second_sources import compare_second_sources
from ferryid.effects.wording import listed
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.files import name_of_log, parts_of, resolved
from ferryid.freed import give_back
from ferryid.models import Model
from ferryid.models.store import check_name
from ferryid.side_by_side import over
from ferryid.signals.usable import usable
from ferryid.types import RunContext
from ferryid.vessel.profile import SETTINGS, Profile


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
    reference
        Further recordings of the vessel, which bring its hull and have no diagnosis of their own.
    setting
        Where the logs were recorded, one of `ferryid.vessel.profile.SETTINGS`; as the profile has it where empty.
    """

    model: Model | None = None
    against: str | None = None
    each: bool = False
    withhold: tuple[str, ...] = ()
    reference: tuple[str, ...] = ()
    setting: str = ""

    def recorded(self, profile: Profile) -> Profile:
        """Return a vessel as it was where the logs were recorded."""
        return replace(profile, setting=self.setting) if self.setting else profile

    def check(self) -> None:
        """Refuse two things to compare with at once, and a setting that there is none of."""
        if self.setting and self.setting not in SETTINGS:
            raise FerryIdError(
                f'diagnose: there is no setting "{self.setting}".{did_you_mean(self.setting, SETTINGS)} '
                f"Fix: use one of {', '.join(SETTINGS)}"
            )
        if self.against is not None and self.model is not None:
            raise FerryIdError(
                "diagnose: a recording is compared with one thing at a time, found both --model and --against. "
                "Fix: leave out one of the two"
            )
        if self.against is not None and self.reference:
            raise FerryIdError(
                "diagnose: a simulation brings a hull of its own, found both --against and --reference. "
                "Fix: leave out one of the two"
            )


def diagnose_campaign(
    logs: Sequence[str],
    profile: Profile,
    settings: DiagnosisSettings,
    run: RunContext,
    *,
    join: bool = False,
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
    join
        Diagnose short logs that follow each other without a break as one, whose `parts` they are.

    Raises
    ------
    FerryIdError
        Where no log can be used. Of several, those that cannot are left out, and the notes name them.
    """
    profile = settings.recorded(profile)
    references = _references(logs, profile, settings, run, join=join)
    groups = _groups(logs, references, profile, settings, run, join=join)
    left_out = unused(logs, [one.group for one in groups])
    found = [replace(one, unused=left_out) for one in _diagnosed(groups, settings, run)]
    place = {path: k for k, path in reversed(list(enumerate(logs)))}
    return tuple(sorted(found, key=lambda one: min(place[path] for path in one.paths)))


def _references(
    logs: Sequence[str], profile: Profile, settings: DiagnosisSettings, run: RunContext, *, join: bool = False
) -> Gathered:
    """Return the recordings that bring the hull; read once, for all logs."""
    if not settings.reference:
        return Gathered(())
    own = {resolved(part) for log in logs for part in (log, *log.split("+"))}
    for one in settings.reference:
        if any(resolved(part) in own for part in parts_of(one)):
            raise FerryIdError(
                f"--reference: {one}: it is one of the logs to be diagnosed. Fix: give it as a log or as a reference"
            )
    return gather(settings.reference, profile, run, references=True, join=join)


def _groups(
    logs: Sequence[str],
    references: Gathered,
    profile: Profile,
    settings: DiagnosisSettings,
    run: RunContext,
    *,
    join: bool = False,
) -> tuple[JudgedGroup, ...]:
    """Return the logs that can be used, in groups of one hull each, and what these say together."""
    gathered = gather(logs, profile, run, withhold=settings.withhold, join=join)
    if references.logs:
        references = without_logs(references, gathered.logs)
    gathered, references = engaged(((CAMPAIGN, gathered), (REFERENCES, references)), profile)
    if settings.against is not None:
        simulated = Group(gathered.logs, notes=gathered.notes, copies=gathered.copies)
        return (_judged_group(simulated, profile, settings, run),)
    run.progress("comparing the sensors of the logs")
    unpooled = {one.path: one for one in (*gathered.logs, *references.logs)}
    screened = with_common_sensors([*gathered.logs, *references.logs])
    gathered, references = (
        replace(one, logs=some)
        for one, some in ((gathered, screened[: len(gathered.logs)]), (references, screened[len(gathered.logs) :]))
    )
    run.progress("comparing the hulls of the logs")
    found = _judged_groups(part(gathered, references, profile, settings.model), unpooled, profile, settings, run)
    if any(one.unconfirmed for one in found):
        # Without what changed in it, a log has no hull in common with the others.
        groups = part(gathered, references, profile, settings.model, beside_change=False)
        found = _judged_groups(groups, unpooled, profile, settings, run)
    return found


def _judged_groups(
    groups: Sequence[Group],
    unpooled: Mapping[str, AveragedLog],
    profile: Profile,
    settings: DiagnosisSettings,
    run: RunContext,
) -> tuple[JudgedGroup, ...]:
    # Another vessel's sensors are not these.
    return tuple(_judged_group(with_own_sensors(one, unpooled), profile, settings, run) for one in groups)


@dataclass(frozen=True)
class JudgedGroup:
    """Logs with one hull, what they are compared with, and what they say together."""

    group: Group
    baseline: Baseline
    together: JudgedCampaign | None

    @property
    def unconfirmed(self) -> bool:
        """Whether logs are together only for a load or a loss of force in some of them that is not confirmed."""
        change = None if self.together is None else self.together.change
        return bool(self.group.changed) and (change is None or not change.confirmed)


def _diagnosed(groups: Sequence[JudgedGroup], settings: DiagnosisSettings, run: RunContext) -> tuple[Diagnosis, ...]:
    """Return the diagnoses of all groups; that of the latest, which a model is stored of, last."""
    found = list[Diagnosis]()
    for k, judged_group in enumerate(groups):
        group, baseline, together = judged_group.group, judged_group.baseline, judged_group.together
        selected = over(partial(_selected, baseline, run), [log for log in group.logs if log.long_enough])
        judged = judge(selected, run.progress)
        made = conclude(group.logs, judged, baseline, together, (*group.notes, *_brought(group, together)))
        sources = compare_second_sources([log.screened.measured for log in group.logs], settings.withhold, run.progress)
        gains = {}
        if settings.withhold and together is not None:
            gains = hidden_gains(together.conditions.tests, together.hull.place, group.logs, settings.model)
        found += [
            replace(
                one,
                latest=k == len(groups) - 1,
                copies=group.copies,
                parts=group.parts.get(one.path, ()),
                sources=sources,
                withheld=with_gains(one.withheld, gains, told=len(made) == 1),
            )
            for one in made
        ]
    return tuple(found)


def _selected(baseline: Baseline, run: RunContext, log: AveragedLog) -> SelectedLog:
    return select(estimate(log, baseline), run.progress)


def _brought(group: Group, together: JudgedCampaign | None) -> tuple[str, ...]:
    """Return what the references of a group are for, as a sentence."""
    if not group.references:
        return ()
    names = listed([name_of_log(one.path) for one in group.references])
    if together is None:
        return (f"The references {names} do not bring the hull: they are too short. Fix: give longer ones, or more",)
    return (
        f"References: {names}. They take part in the estimate of the hull, of properties and of the spread of conditions, and "
        "have no diagnosis of their own.",
    )


def _judged_group(group: Group, profile: Profile, settings: DiagnosisSettings, run: RunContext) -> JudgedGroup:
    """Return what logs are compared with, and what the logs of a campaign say together."""
    if settings.against is not None:
        return JudgedGroup(group, SimulationBaseline(learn_simulation(settings.against, profile, run)), None)
    brought = {one.path for one in group.references}
    assembled = assemble([*group.logs, *group.references], profile, settings.model, brought)
    if assembled is None:
        return JudgedGroup(group, HullBaseline(profile, settings.model), None)
    together = judge_campaign(*assembled, run.progress, group.changed)
    return JudgedGroup(group, CampaignBaseline(profile, together.hull, settings.model), together)


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
        Where no log can be used. Those that cannot beside others are left out, and the notes name them.
    """
    settings.check()
    if not settings.each and settings.against is None:
        return distinguished(diagnose_campaign(logs, profile, settings, run, join=True))
    profile = settings.recorded(profile)
    references = _references(logs, profile, settings, run)

    def by_itself(log: str) -> tuple[Diagnosis, ...]:
        return _diagnosed(_groups([log], references, profile, settings, run), settings, run)

    errors: dict[str, FerryIdError] = {}
    found = [one for several in usable(logs, by_itself, errors) for one in several]
    notes = tuple(f"Not diagnosed: {error}" for error in errors.values())
    return distinguished(
        [replace(one, latest=True, notes=(*notes, *one.notes), gathered=(*notes, *one.gathered)) for one in found]
    )


def diagnose_and_store(
    logs: Sequence[str],
    profile: Profile,
    settings: DiagnosisSettings,
    run: RunContext,
    *,
    name: str = "",
    diagnosed: Callable[[Sequence[Diagnosis]], None] | None = None,
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
    diagnosed
        Called with the diagnoses before anything is learned beside their findings, which stay as they are.

    Raises
    ------
    FerryIdError
        For input that cannot be used, a name that a model cannot have, and a folder that cannot be written.
    """
    if name:
        check_name(name)
    found = diagnose(logs, profile, settings, run)
    if diagnosed is not None:
        diagnosed(found)
    # The rows of all logs are read anew to learn from them.
    give_back()
    learner = None
    # Of a simulation no model comes.
    if settings.against is None:
        seen = without_withheld(profile, settings.withhold)
        paths = tuple(one.path for one in found if one.latest)
        learner = Learner(paths, seen, settings.model, run)
    # Two hulls make no model.
    latest = [one for one in found if one.latest]
    stored = iter(store_updated_model(latest, profile, settings.model, run.out, name=name, learner=learner))
    return tuple(next(stored) if one.latest else one for one in found)
