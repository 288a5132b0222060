"""What changed: in which properties and loads two groups of logs of one vessel differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ferryid.counts import counted
from ferryid.diagnose.gathering import CAMPAIGN, engaged, gather, whole, with_common_sensors
from ferryid.diagnose.inference.campaign import assemble, repeated
from ferryid.diagnose.inference.group_differences import GROUPS, in_groups
from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.difference import Difference
from ferryid.diagnose.judging.group_differences import (
    JudgedGroups,
    beside_sensors,
    judge_groups,
    notes_of,
    smallest_note,
    summary,
)
from ferryid.diagnose.judging.group_loads import LoadDifference
from ferryid.diagnose.judging.sensor_differences import sensor_differences
from ferryid.diagnose.pipeline import DiagnosisSettings
from ferryid.errors import FerryIdError
from ferryid.files import parts_of, resolved
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile

SCHEMA = "ferryid.versus/1"


@dataclass(frozen=True)
class GroupLog:
    """A log of a group: its name, path and length, the windows that were used, and the sensor errors corrected in it."""

    name: str
    path: str
    duration_s: float
    windows: int
    sensors: tuple[str, ...] = ()


@dataclass(frozen=True)
class Versus:
    """What two groups of logs differ in.

    Attributes
    ----------
    vessel
        Its name.
    groups
        The logs of A and of B.
    judged
        The differences.
    notes
        What a reader must know of the comparison.
    summary, smallest
        The verdict in a line, and the smallest differences that would have been seen.
    """

    vessel: str
    groups: dict[str, tuple[GroupLog, ...]]
    judged: JudgedGroups
    notes: tuple[str, ...]
    summary: str
    smallest: str


def compare_groups(
    logs: Sequence[str], versus: Sequence[str], profile: Profile, settings: DiagnosisSettings, run: RunContext
) -> Versus:
    """Return in which properties and loads two groups of logs differ.

    Parameters
    ----------
    logs, versus
        Paths of group A and of group B; parts of one recording joined by ``+``.
    profile
        The vessel.
    settings
        The model that brings the hull, and signals to hide; neither ``against`` nor ``each``.
    run
        Folder of the ingested tables, progress, and whether to check every checksum of the logs.

    Raises
    ------
    FerryIdError
        For a log in both groups, a group without a log that can be used, and settings that compare with something else.
    """
    _check(logs, versus, settings)
    settings.check()
    profile = settings.recorded(profile)
    averaged, notes = list[AveragedLog](), list[str]()
    name_of: dict[str, str] = {}
    gathered = [
        gather(list(dict.fromkeys(paths)), profile, run, withhold=settings.withhold) for paths in (logs, versus)
    ]
    for group, found in zip(GROUPS, engaged([(CAMPAIGN, one) for one in gathered], profile), strict=True):
        run.progress(f"comparing the hulls of group {group}")
        found = whole(found, profile, settings.model)
        # What differs between the groups is not to be pooled away.
        averaged += with_common_sensors(found.logs)
        notes += [f"Group {group}: {one}" for one in found.notes]
        name_of |= {one.path: group for one in found.logs}
    for path, other in repeated(averaged):
        raise FerryIdError(
            f"{path}: holds the motion of {other}, which is in the other group. "
            "Fix: give each recording to one side of --versus"
        )
    assembled = assemble(averaged, profile, settings.model)
    if assembled is None:
        total = sum(len(one.windows.starts) for one in averaged)
        raise FerryIdError(
            f"diagnose: the groups are too short to compare, found {counted(total, 'overlapping window')} in both and need "
            f"{INFERENCE.fewest_windows}. Fix: give more or longer logs"
        )
    place = assembled[1]
    for group in GROUPS:
        if not any(name_of[path] == group for path in place):
            raise FerryIdError(
                f"diagnose: no log of group {group} is long enough to compare, each needs "
                f"{counted(INFERENCE.campaign_windows, 'overlapping window')}. Fix: give longer logs"
            )
    campaign = in_groups(assembled[0], [name_of[path] for path in place])
    compared = [one for one in averaged if one.path in place]
    sensors = sensor_differences(compared, [name_of[one.path] for one in compared])
    judged = beside_sensors(judge_groups(campaign, run.progress), sensors, hull_known=campaign.hull.known)
    groups = {
        group: tuple(_group_log(one) for one in averaged if one.path in place and name_of[one.path] == group)
        for group in GROUPS
    }
    notes += _left_out(averaged, place, name_of)
    notes += [*notes_of(judged, campaign), *_sensor_notes(groups)]
    return Versus(profile.name, groups, judged, tuple(notes), summary(judged), smallest_note(judged))


def _check(logs: Sequence[str], versus: Sequence[str], settings: DiagnosisSettings) -> None:
    for given, option in (
        (settings.against is not None, "--against"),
        (settings.each, "--each"),
        (bool(settings.reference), "--reference"),
    ):
        if given:
            raise FerryIdError(
                f"diagnose: groups are compared as one campaign, found both --versus and {option}. "
                "Fix: leave out one of the two"
            )
    for name, group in zip(GROUPS, (logs, versus), strict=True):
        if not group:
            raise FerryIdError(f"diagnose: group {name} has no log. Fix: give logs before --versus and after it")
    first = {resolved(part): part for one in logs for part in parts_of(one)}
    for one in versus:
        for part in parts_of(one):
            if resolved(part) in first:
                raise FerryIdError(f"{part}: stands on both sides of --versus. Fix: give each log to one side")


def _group_log(log: AveragedLog) -> GroupLog:
    t = log.screened.measurements.t
    sensors = tuple(one.effect for one in log.screened.sensors)
    name = log.screened.measured.survey.used.log
    return GroupLog(name, log.path, float(t[-1] - t[0]), len(log.windows.starts), sensors)


def _left_out(averaged: Sequence[AveragedLog], place: dict[str, int], name_of: dict[str, str]) -> list[str]:
    return [
        f"Group {name_of[one.path]}: {one.path} is too short and left out." for one in averaged if one.path not in place
    ]


def _sensor_notes(groups: dict[str, tuple[GroupLog, ...]]) -> list[str]:
    """Return which errors of the sensors were corrected in how many logs of each group, before the comparison."""
    effects = sorted({effect for logs in groups.values() for one in logs for effect in one.sensors})
    notes = []
    for effect in effects:
        shares = [
            f"{sum(effect in one.sensors for one in logs)} of {counted(len(logs), 'log')} of {group}"
            for group, logs in groups.items()
        ]
        notes.append(f"Sensor error corrected before the comparison, {effect.replace('_', ' ')}: {', '.join(shares)}.")
    return notes


def versus_json(found: Versus) -> dict[str, Any]:
    """Return a comparison of groups as ``ferryid.versus/1``."""
    judged = found.judged
    return {
        "schema": SCHEMA,
        "vessel": found.vessel,
        "verdict": judged.verdict,
        "summary": found.summary,
        "groups": {
            group: [
                {"log": one.name, "path": one.path, "duration_s": one.duration_s, "windows": one.windows}
                for one in logs
            ]
            for group, logs in found.groups.items()
        },
        "differences": [_difference_json(one) for one in judged.differences],
        "compared": [_difference_json(one) for one in judged.compared],
        "loads": [_load_json(one) for one in judged.loads],
        "disagreement": judged.apart,
        "notes": [*found.notes, *([found.smallest] if found.smallest else [])],
    }


def _difference_json(one: Difference) -> dict[str, Any]:
    gains = {} if one.by_group is None else one.by_group
    return {
        "effect": one.effect,
        "instance": one.instance,
        "group": one.group,
        "parameters": {
            name: {**vars(estimate), "smallest": one.smallest[name]} for name, estimate in one.estimates.items()
        },
        "probability": one.probability,
        "evidence": one.evidence,
        "scatter": one.scatter,
        "held_out": None
        if one.gain is None
        else {**vars(one.gain), "by_group": {group: vars(gain) for group, gain in gains.items()}},
        "rivals": [vars(rival) for rival in one.rivals],
        "unresolved_with": list(one.unresolved_with),
        "separating_manoeuvre": one.separating_manoeuvre,
        "confirmed": one.selected and not one.doubt,
        "shown_by": one.shown_by,
        "says": one.says,
    }


def _load_json(one: LoadDifference) -> dict[str, Any]:
    return {
        "effect": one.effect,
        "measured": one.measured,
        "mean": {group: dict(mean) for group, mean in one.mean.items()},
        "parameters": {name: vars(estimate) for name, estimate in one.estimates.items()},
        "differs": one.differs,
        "confirmed": not one.doubt,
        "says": one.says,
    }
