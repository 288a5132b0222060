"""The logs of a campaign before anything is judged: which can be used, which belong together, and which bring the hull."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.checks.screening import screen_sensors, screen_together
from ferryid.diagnose.data.measurements import measure_log
from ferryid.diagnose.data.simulated import simulated
from ferryid.diagnose.inference.campaign import assemble, repeated
from ferryid.diagnose.inference.sessions import in_time, start_ns
from ferryid.diagnose.inference.stages import AveragedLog, average
from ferryid.diagnose.judging.campaign_split import Split, find_split
from ferryid.diagnose.judging.diagnosis import distinct
from ferryid.effects.wording import MEANS_LITTLE, listed
from ferryid.errors import FerryIdError
from ferryid.files import name_of_log, resolved
from ferryid.identify.engagement import odd_forces, pooled, unanswered_force
from ferryid.log_warnings import ALIKE_LOGS
from ferryid.models import Model
from ferryid.side_by_side import over
from ferryid.signals.artificial import NO_RECORDING
from ferryid.signals.contiguous import Contiguous, LogPart, contiguous
from ferryid.signals.order_of_time import dated
from ferryid.signals.usable import left_out_of, tried
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile

OWN_HULLS = "The campaign is split: each side has a hull of its own, and a model is stored of the latest one."
STAY = "They stay together here: what changed between them is in neither group's differences, and widens what is not known."
CAMPAIGN, REFERENCES = "campaign", "references"
"""What logs are left out of."""
_VERSUS = "see what differs with ferryid diagnose OTHERS... --versus LOG..., or "
"""What to do where a thruster or a load may be all that changed."""
SHOWN_OVERLAPS = 3
"""Pairs of overlapping logs that are listed; the others are counted."""


@dataclass(frozen=True)
class Gathered:
    """Logs that can be used, measured, screened and averaged, and sentences on the others and on all.

    `copies` are logs that are left out since they hold the motion of another: their paths and that of the other. `parts` are
    those of every log that is made of several, by its path.
    """

    logs: tuple[AveragedLog, ...]
    notes: tuple[str, ...] = ()
    copies: tuple[tuple[str, str], ...] = ()
    parts: Mapping[str, tuple[LogPart, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Group:
    """Logs with one hull, the references that bring it too, what a reader must know of them; `copies`, `parts` as gathered.

    `changed` are the paths of logs that share the hull beside a load or a loss of force in them alone, or in the others.
    """

    logs: tuple[AveragedLog, ...]
    references: tuple[AveragedLog, ...] = ()
    notes: tuple[str, ...] = ()
    copies: tuple[tuple[str, str], ...] = ()
    parts: Mapping[str, tuple[LogPart, ...]] = field(default_factory=dict)
    changed: frozenset[str] = frozenset()


def gather(
    paths: Sequence[str],
    profile: Profile,
    run: RunContext,
    *,
    withhold: Sequence[str] = (),
    references: bool = False,
    join: bool = False,
) -> Gathered:
    """Return the logs of a campaign that can be used, and why each of the others cannot.

    Parameters
    ----------
    paths
        Logs; parts of one recording joined by ``+``.
    profile, run
        The vessel; folder of the ingested tables and progress.
    withhold
        Signals to hide.
    references
        True where they only bring the hull; the sentences then name them so.
    join
        Put short logs together that follow each other without a break (`ferryid.signals.contiguous`).

    Raises
    ------
    FerryIdError
        Where none can be used, and for a path that leads nowhere.
    """

    def screened(path: str) -> AveragedLog:
        measured = measure_log(path, profile, run, withhold=withhold)
        return average(screen_sensors(measured, run.progress))

    given, paths = list(paths), list({_resolved(path): path for path in reversed(paths)}.values())[::-1]
    # Seconds count from the start of each log as it was given.
    joined = contiguous(paths, profile) if join and not run.ranges else Contiguous(tuple(paths), {})
    made = dict(zip(joined.paths, over(lambda path: tried(screened, path), joined.paths), strict=True))
    broken = [path for path in joined.parts if isinstance(made[path], FerryIdError)]
    if broken:
        # A part that cannot be used takes no other with it.
        joined = joined.without(broken)
        again = [path for path in joined.paths if path not in made]
        made |= zip(again, over(lambda path: tried(screened, path), again), strict=True)
    found = [one for one in (made[path] for path in joined.paths) if isinstance(one, AveragedLog)]
    errors = {path: one for path in joined.paths if isinstance(one := made[path], FerryIdError)}
    if not found:
        raise next(iter(errors.values()))
    whose = REFERENCES if references else CAMPAIGN
    notes = [*joined.notes, *left_out_of(whose, errors)]
    notes += [
        f"Given twice: {path}: it counts once"
        for path in dict.fromkeys(given)
        if sum(_resolved(path) == _resolved(one) for one in given) > 1 and path in paths
    ]
    kept, why = sort_out(found, whose)
    copies = tuple(repeated(kept))
    copied = {path for path, _ in copies}
    kept = [one for one in kept if one.path not in copied]
    why += [_copied(path, other, whose) for path, other in copies]
    return Gathered(tuple(kept), (*notes, *why, *_clocks(kept)), copies, joined.parts)


def unused(paths: Sequence[str], groups: Sequence[Group]) -> tuple[tuple[str, str], ...]:
    """Return which of the given logs take part in no group, but for copies, and the sentence that says why."""
    known = {one.path for group in groups for one in group.logs}
    known |= {path for group in groups for path, _ in group.copies}
    known |= {part.path for group in groups for parts in group.parts.values() for part in parts}
    start = f"Left out of the {CAMPAIGN}: "
    notes = [note.removeprefix(start) for group in groups for note in group.notes if note.startswith(start)]
    found = dict[str, str]()
    for path in paths:
        names = tuple(f"{name}:" for name in (path, Path(path).name, Path(path).stem))
        # An error that names something else first, such as a file of the log, has the log's name behind it.
        said = [note for note in notes if note.startswith(names)] or [note for note in notes if Path(path).stem in note]
        if path not in known and said:
            found[path] = start + said[0]
    return tuple(found.items())


def _no_recordings(artificial: Mapping[str, str]) -> list[str]:
    """Return that no log is a recording of a vessel, as sentences: one where several have one reason, by their paths."""
    reasons = set(artificial.values())
    if len(reasons) == 1 and len(artificial) >= ALIKE_LOGS:
        told = [(f"Each of the {counted(len(artificial), 'log')}", "them", reasons.pop())]
    else:
        told = [(path, "it", why) for path, why in artificial.items()]
    return [
        f"{which} {NO_RECORDING}: {why}. What is found in {of} belongs to whatever made {of}, and not to a vessel."
        for which, of, why in told
    ]


def _unanswered(logs: Sequence[AveragedLog], profile: Profile) -> tuple[str, ...]:
    """Return a sentence on logs that are used though the vessel hardly follows the applied force in them.

    Each of several may be too short to show it, where together they do: they have one profile.
    """
    responses = [one.screened.measured.response for one in logs]
    told = {one.path: unanswered_force(response, profile) for one, response in zip(logs, responses, strict=True)}
    several = [(path, why) for path, why in told.items() if why]
    together = ""
    if len(logs) > 1 and not any(one.answered for one in responses if one is not None):
        together = unanswered_force(pooled(responses), profile)
    if not several and not together:
        return ()
    path, why = several[0] if several else ("", together)
    what, _, remedy = (together or why).partition(". Fix: ")
    more = len(several) - 1
    also = f" So it is in {counted(more, 'more log')}." if more > 0 and not together else ""
    whose = f"In these {counted(len(logs), 'log')} together" if together else f"{name_of_log(path)}:"
    return (f"{whose} {what}. {MEANS_LITTLE}{also} Fix: see whether the actuators were engaged, or {remedy}",)


def _against(logs: Sequence[AveragedLog], reasons: Mapping[str, str]) -> tuple[str, ...]:
    """Return a sentence on each log that is used, as there is no other, though its forces act otherwise than elsewhere."""
    told = {one.path: one.screened.measured.response for one in logs if one.path in reasons}
    return tuple(
        f"{name_of_log(path)}: {what}. {MEANS_LITTLE} Fix: {remedy}"
        for path, response in told.items()
        if response is not None and not response.unanswered
        for what, _, remedy in [reasons[path].partition(". Fix: ")]
    )


def engaged(groups: Sequence[tuple[str, Gathered]], profile: Profile) -> tuple[Gathered, ...]:
    """Return groups of logs of one vessel without those in which the actuators act otherwise than in the others of any group.

    So it is where they were not engaged, or a sign changed. A group of which none would be left keeps its logs, but for
    references. A sentence is on each log that is left out, and on those that stay though the vessel does not follow the applied
    force in them.

    Parameters
    ----------
    groups
        What each is called that logs are left out of, such as ``"campaign"``, and its logs.
    profile
        The vessel.
    """
    responses = {one.path: one.screened.measured.response for _, group in groups for one in group.logs}
    reasons, found = odd_forces(responses, profile), list[Gathered]()
    for whose, group in groups:
        here = {one.path: FerryIdError(f"{one.path}: {reasons[one.path]}") for one in group.logs if one.path in reasons}
        kept = tuple(one for one in group.logs if one.path not in here)
        # References are no more than help; what is diagnosed or compared is not empty.
        without = bool(kept) or whose == REFERENCES
        left_out, logs = (left_out_of(whose, here), kept) if without else (_against(group.logs, reasons), group.logs)
        found.append(replace(group, logs=logs, notes=(*group.notes, *left_out, *_unanswered(logs, profile))))
    return tuple(found)


def _resolved(path: str) -> tuple[str, ...]:
    """Return what a path leads to, part by part."""
    return tuple(str(resolved(part)) for part in path.split("+"))


def _copied(path: str, other: str, whose: str) -> str:
    """Return that a log is another's copy and no evidence of its own, as a sentence."""
    return (
        f"Left out of the {whose}: {path}: it holds the motion of {name_of_log(other)}, as the same recording does under "
        "another name or in another format: it is no further evidence, and no estimate has it twice"
    )


def with_common_sensors(logs: Sequence[AveragedLog]) -> tuple[AveragedLog, ...]:
    """Return the logs of one vessel with what several of them show of its sensors corrected in all of them."""
    again = {path for path, _ in repeated(logs)}
    copies = [one.path in again or one.path in {each.path for each in logs[:k]} for k, one in enumerate(logs)]
    screened = screen_together([one.screened for one in logs], copies)
    pairs = zip(logs, screened, strict=True)
    return tuple(over(lambda pair: pair[0] if pair[1] is pair[0].screened else average(pair[1]), pairs))


def with_own_sensors(group: Group, unpooled: Mapping[str, AveragedLog]) -> Group:
    """Return a group with what its own logs show of its sensors, where others took part in what was common to all.

    Parameters
    ----------
    group
        Logs of one hull, of all that were given or of a part of them.
    unpooled
        All that were given, as each is by itself, by their paths.
    """
    mine = [*group.logs, *group.references]
    if len(mine) == len(unpooled):
        return group
    again = with_common_sensors([unpooled[one.path] for one in mine])
    count = len(group.logs)
    return replace(group, logs=tuple(again[:count]), references=tuple(again[count:]))


def sort_out(logs: Sequence[AveragedLog], whose: str) -> tuple[list[AveragedLog], list[str]]:
    """Return logs without simulated ones and ones that contradict themselves, where others do not, and a sentence on each.

    `whose` are they: what they are left out of.
    """
    artificial = {one.path: why for one in logs if (why := _simulated(one))}
    if artificial and len(artificial) == len(logs):
        return list(logs), _no_recordings(artificial)
    notes = [
        f"Left out of the {whose}: {path}: it is simulated among recorded logs, {why}. Fix: diagnose simulated logs by "
        "themselves"
        for path, why in artificial.items()
    ]
    kept = [one for one in logs if one.path not in artificial]
    doubts = {one.path: one.screened.measured.survey.contradictions for one in kept}
    wrong = {path: " ".join(found) for path, found in doubts.items() if found}
    able = [one.path for one in kept if one.path in wrong or one.screened.measured.survey.comparable]
    # What half of the logs show that can show it is the profile's fault, and not theirs.
    if 2 * len(wrong) >= len(able):
        return kept, notes
    notes += [
        f"Left out of the {whose}: {path}: its signals contradict each other, and those of the other logs do not. {why} "
        "Fix: correct what changed in this log, or give it a profile of its own"
        for path, why in wrong.items()
    ]
    return [one for one in kept if one.path not in wrong], notes


def _simulated(log: AveragedLog) -> str:
    return simulated(log.screened.measured.survey.recording, log.screened.measured.measurements)


def _clocks(logs: Sequence[AveragedLog]) -> tuple[str, ...]:
    """Return sentences on clocks that some logs did not set, and on times that overlap: no vessel makes two logs at once."""
    unset = [one.path for one in logs if not dated(start_ns(one))]
    return (*(_unset(unset) if len(unset) < len(logs) else ()), *_overlapping(logs))


def _unset(paths: Sequence[str]) -> tuple[str, ...]:
    """Return a sentence on logs whose clocks were not set, those of others being dates."""
    if not paths:
        return ()
    return (
        f"The clock was not set in {listed([name_of_log(one) for one in paths])}, whose times are before the year 2000: when "
        "they were recorded is not known, all logs are taken in the order in which they were given, and these are taken to be "
        "near no other in time.",
    )


def _overlapping(logs: Sequence[AveragedLog]) -> tuple[str, ...]:
    """Return a sentence on logs whose times overlap."""
    spans = sorted(
        (start_ns(one), start_ns(one) + round(_seconds(one) * 1e9), one.path) for one in logs if dated(start_ns(one))
    )
    overlapping = []
    for k, (_, end, path) in enumerate(spans):
        for start, other_end, other in spans[k + 1 :]:
            if start < end and path != other:
                seconds = (min(end, other_end) - start) * 1e-9
                overlapping.append(f"{name_of_log(path)} and {name_of_log(other)} by {seconds:.0f} s")
    if not overlapping:
        return ()
    more = len(overlapping) - SHOWN_OVERLAPS
    shown = [*overlapping[:SHOWN_OVERLAPS], *([f"{counted(more, 'more pair')}"] if more > 0 else [])]
    return (
        f"The times of logs overlap, as if a clock was set back between them: {listed(shown)}. Each log is used with its own "
        "times; which is the earlier one is not known.",
    )


def without_logs(references: Gathered, logs: Sequence[AveragedLog]) -> Gathered:
    """Return references without those that hold the motion of a log that is diagnosed, and without simulated ones of a vessel.

    Raises
    ------
    FerryIdError
        Where none is left.
    """
    again = dict(repeated([*logs, *references.logs]))
    real = not all(_simulated(one) for one in logs)
    wrong = {one.path: f"it holds the motion of {again[one.path]}" for one in references.logs if one.path in again}
    for one in references.logs:
        if real and (why := _simulated(one)):
            wrong.setdefault(one.path, f"it is simulated and the logs are recorded, {why}")
    kept = tuple(one for one in references.logs if one.path not in wrong)
    if not kept:
        path = references.logs[0].path
        raise FerryIdError(f"--reference: {path}: {wrong[path]}. Fix: give other recordings of the vessel")
    notes = tuple(f"Left out of the references: {path}: {why}." for path, why in wrong.items())
    return Gathered(kept, (*references.notes, *notes), references.copies)


def part(
    gathered: Gathered, references: Gathered, profile: Profile, model: Model | None, *, beside_change: bool = True
) -> tuple[Group, ...]:
    """Return the logs in groups of one hull each, the latest last; one group where a common hull fits all.

    With `beside_change`, logs stay together that one hull fits beside a load or a loss of force in some of them.
    """
    groups = _parts(gathered, references, profile, model, beside_change)
    if len(groups) == 1:
        return groups
    return tuple(replace(one, notes=(*one.notes, OWN_HULLS)) for one in groups)


def _parts(
    gathered: Gathered, references: Gathered, profile: Profile, model: Model | None, beside_change: bool
) -> tuple[Group, ...]:
    """Return the same without a word on what is made of them."""
    notes = (*gathered.notes, *references.notes)
    every = Group(gathered.logs, references.logs, notes, gathered.copies, gathered.parts)
    open_groups, closed = [every], list[Group]()
    while open_groups:
        group = open_groups.pop()
        found = sides_of(group.logs, group.references, profile, model)
        if found is None:
            closed.append(group)
        elif beside_change and found.split.change is not None and found.split.change.confirmed:
            closed.append(replace(group, changed=found.inside))
        else:
            open_groups += _parted(group, found)
    order = [id(gathered.logs[i]) for i in in_time(gathered.logs)]
    return tuple(sorted(closed, key=lambda group: max(order.index(id(one)) for one in group.logs)))


def whole(gathered: Gathered, profile: Profile, model: Model | None) -> Gathered:
    """Return logs that are compared as one group, without one that no common hull fits; more of them stay, with a note."""
    # What changed in some logs of a group would be taken for a difference between the groups.
    groups = _parts(gathered, Gathered(()), profile, model, beside_change=False)
    if len(groups) == 1:
        return replace(gathered, logs=groups[0].logs, notes=groups[0].notes)
    left = {one.path for group in groups for one in group.logs}
    kept = tuple(one for one in gathered.logs if one.path in left)
    notes = (*dict.fromkeys(note for group in groups for note in group.notes), STAY)
    return replace(gathered, logs=kept, notes=notes)


@dataclass(frozen=True)
class Sides:
    """Logs that no common hull fits: how they are parted, and the paths of the smaller part and of the other."""

    split: Split
    inside: frozenset[str]
    outside: frozenset[str]


def sides_of(
    logs: Sequence[AveragedLog], references: Sequence[AveragedLog], profile: Profile, model: Model | None = None
) -> Sides | None:
    """Return how logs and references fall into two parts that no common hull fits; None where one fits all that have a say."""
    every = [*logs, *references]
    assembled = assemble([every[i] for i in in_time(every)], profile, model, {one.path for one in references})
    if assembled is None:
        return None
    campaign, place = assembled
    own = {one.path for one in logs}
    paths = sorted(place, key=lambda path: place[path])
    split = find_split(campaign, np.array([path not in own for path in paths]))
    if split is None:
        return None
    inside = frozenset(path for path, one in zip(paths, split.inside.tolist(), strict=True) if one)
    if split.change is not None:
        names = tuple(name_of_log(paths[i]) for i in split.change.change.acting)
        split = replace(split, change=replace(split.change, names=names))
    return Sides(split, inside, frozenset(paths) - inside)


def _parted(group: Group, found: Sides) -> list[Group]:
    """Return the parts of a group of which no common hull fits all logs."""
    split, inside, outside = found.split, found.inside, found.outside
    own = {one.path for one in group.logs}
    if not own & inside:
        return [_without_references(group, inside, split)]
    if not own & outside:
        return [_without_references(group, outside, split)]
    (alone, *more), others = sorted(inside), own & outside
    if not more and len(others) > 1:
        return [_left_out(group, alone, split, len(others))]
    return _halves(group, inside, outside, split)


def why_parted(split: Split) -> str:
    """Return what speaks for two hulls, for the brackets of a sentence."""
    told = (
        f"held-out squared force error with one hull {split.ratio:.1f} times that with hulls of their own, likelihood of "
        f"held-out stretches {split.gain.total:+.0f} nat with these"
    )
    if not split.apart:
        return told
    return (
        f"{told}; in what both sides show, the hulls differ by {100.0 * split.hulls.share:.0f} % of the larger one, in squares "
        f"{split.hulls.scatter:.1f} times as far as a log from the others of its side"
    )


def cause_of_split(split: Split) -> str:
    """Return what may set two parts of a campaign apart, as the end of a sentence, and in another one what would explain it."""
    if split.apart:
        return "another vessel, or its hull changed"
    cause = "its hull, its load or the force of a thruster changed, or it is another vessel"
    if split.change is None:
        return cause
    says = split.change.says.removesuffix(".")
    return f"{cause}. One hull fits all of them beside this, as where they are of one vessel: {says}"


def _names(group: Group, paths: Collection[str]) -> str:
    every = [one.path for one in (*group.logs, *group.references)]
    names = distinct([name_of_log(one) for one in every], every)
    return listed([name for name, path in zip(names, every, strict=True) if path in paths])


def _without_references(group: Group, paths: Collection[str], split: Split) -> Group:
    note = (
        f"Left out of the references: {_names(group, paths)}: no common hull fits the logs and them ({why_parted(split)}); "
        f"{cause_of_split(split)}. Fix: give recordings of the vessel as it is in the logs"
    )
    kept = tuple(one for one in group.references if one.path not in paths)
    return replace(group, references=kept, notes=(*group.notes, note))


def _left_out(group: Group, path: str, split: Split, others: int) -> Group:
    note = (
        f"Left out of the campaign: {path}: no common hull fits it and the {counted(others, 'other log')} "
        f"({why_parted(split)}); {cause_of_split(split)}. Fix: {'' if split.apart else _VERSUS}diagnose it with --each, or "
        "with the right profile, or leave it out"
    )
    kept = tuple(one for one in group.logs if one.path != path)
    return replace(group, logs=kept, notes=(*group.notes, note))


def _halves(group: Group, inside: frozenset[str], outside: frozenset[str], split: Split) -> list[Group]:
    """Return a group in two; logs that are too short to take part go with the one that is nearest among the logs."""
    judged = [k for k, one in enumerate(group.logs) if one.path in inside | outside]

    def within(k: int) -> bool:
        path = group.logs[k].path
        if path in inside | outside:
            return path in inside
        return group.logs[min(judged, key=lambda other: abs(other - k))].path in inside

    chosen = [within(k) for k in range(len(group.logs))]
    parts = [tuple(one for one, here in zip(group.logs, chosen, strict=True) if here == side) for side in (True, False)]
    first, second = (_names(group, {one.path for one in logs}) for logs in parts)
    note = (
        f"No common hull fits {first} on one side and {second} on the other ({why_parted(split)}); "
        f"{cause_of_split(split)}. Fix: {'' if split.apart else _VERSUS}diagnose each side by itself, with its own profile"
    )
    return [
        replace(
            group,
            logs=logs,
            references=tuple(one for one in group.references if one.path in side),
            notes=(*group.notes, note),
        )
        for logs, side in zip(parts, (inside, outside), strict=True)
    ]


def _seconds(log: AveragedLog) -> float:
    t = log.screened.measurements.t
    return float(t[-1] - t[0])
