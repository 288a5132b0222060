"""Whose log it is: the profile that is given, stated beside the log or in the environment, or else the one that fits."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from shlex import quote

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Reader
from ferryid.vessel.folder_settings import log_folder, stated_vessel
from ferryid.vessel.load import known, load_profile, user_folder, user_profiles
from ferryid.vessel.profile import Profile
from ferryid.vessel.signal_map import lacking_signals, survey

VARIABLE = "FERRYID_VESSEL"
"""Environment variable with the profile of logs beside which nothing states one."""
_SHOWN = 3
"""Profiles of a list that are shown with what they lack, and signals that are named of each."""


@dataclass(frozen=True)
class VesselChoice:
    """A profile, and why it is this one.

    Attributes
    ----------
    profile
        The profile.
    reference
        Its name or path, as `load_profile` takes it; empty for a profile that was passed itself.
    reason
        One line for the user; empty where it was asked for by name.
    """

    profile: Profile
    reference: str = ""
    reason: str = ""


@dataclass(frozen=True)
class Match:
    """What one profile finds in a log: signals that a fit needs and the log lacks, and those it can do without."""

    name: str
    lacking: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    found: int = 0
    problem: str = ""

    @property
    def fits(self) -> bool:
        """True where a fit would find what it needs."""
        return not self.problem and not self.lacking

    def __str__(self) -> str:
        if self.problem:
            return f"{self.name} ({self.problem})"
        absent = self.lacking or self.missing
        if not absent:
            return f"{self.name} (all of {counted(self.found, 'signal')} there)"
        names = f"{', '.join(absent[:_SHOWN])}{', ...' if len(absent) > _SHOWN else ''}"
        needed = "" if self.lacking else ", all optional"
        return (
            f"{self.name} (lacks {names}; {len(absent)} of {counted(self.found + len(self.missing), 'signal')}{needed})"
        )


def choose_vessel(
    logs: Sequence[str | Path], vessel: str | Path | Profile | None = None, *, own: Profile | None = None
) -> VesselChoice:
    """Return the vessel of logs that are used together.

    It is, in this order: `vessel`; the profile of the model that is used; a ``vessel.toml``, or what a ``ferryid.toml`` states,
    beside a log or in the nearest folder above it; ``$FERRYID_VESSEL``; the one profile, the user's own or bundled, whose
    topics and fields the logs have. Where the log lacks signals of the model's profile, what is stated counts before it.

    Parameters
    ----------
    logs
        Paths; parts of one recording joined by ``+``.
    vessel
        Name or path of a profile, or a profile, where one was asked for.
    own
        The profile inside the model that is used, if any.

    Raises
    ------
    FerryIdError
        For a profile with a fault, unless that of the model serves, logs of two vessels, and logs that several profiles fit, or
        none.
    """
    if isinstance(vessel, Profile):
        return VesselChoice(vessel)
    if vessel is not None and str(vessel):
        return VesselChoice(load_profile(vessel), str(vessel))
    paths = [str(log) for log in logs]
    if own is None:
        return stated_choice(paths) or _fitting(paths)
    fault: FerryIdError | None = None
    stated: VesselChoice | None = None
    try:
        stated = stated_choice(paths)
    except FerryIdError as error:
        # It is not needed where the model's own profile serves.
        fault = error
    if stated is not None and stated.profile.sha256 == own.sha256:
        return VesselChoice(own)
    if (stated is None and fault is None) or all(_match(own, log).fits for log in paths):
        return VesselChoice(own)
    if stated is None:
        assert fault is not None
        raise fault
    return stated


def stated_choice(logs: Sequence[str], *, environment: bool = True) -> VesselChoice | None:
    """Return the profile that a file beside the logs or the environment states, None where nothing does.

    Parameters
    ----------
    logs
        Paths; parts of one recording joined by ``+``.
    environment
        False: files alone count.

    Raises
    ------
    FerryIdError
        For a profile with a fault, and logs of two vessels.
    """
    found: dict[str, tuple[VesselChoice, str]] = {}
    for log in logs:
        named = stated_vessel(log_folder(log))
        if named is not None and named[0] not in [choice.reference for choice, _ in found.values()]:
            reference, file = named
            profile = load_profile(reference)
            how = f"from {file}" if reference == file else f"stated in {file}"
            found.setdefault(profile.sha256, (VesselChoice(profile, reference, _line(profile, how)), log))
    if len(found) > 1:
        (first, a), (second, b), *_ = found.values()
        raise FerryIdError(
            f"{b}: is of another vessel than {a}, {second.reference} is beside it and {first.reference} beside the other. "
            "Fix: give logs of one vessel, give --vessel, or use ferryid batch, which takes several vessels"
        )
    if found:
        return next(iter(found.values()))[0]
    named_by_environment = os.environ.get(VARIABLE, "").strip()
    if not (environment and named_by_environment):
        return None
    try:
        profile = load_profile(named_by_environment)
    except FerryIdError as error:
        raise FerryIdError(f"${VARIABLE}: {error}") from error
    return VesselChoice(profile, named_by_environment, _line(profile, f"stated in ${VARIABLE}"))


def _line(profile: Profile, why: str) -> str:
    return f"vessel {profile.name}: {why}"


def _fitting(logs: Sequence[str]) -> VesselChoice:
    """Return the one profile whose signals all logs have, or most of them where no profile fits the others.

    What becomes of the others is for the command to say: most leave them out with what they lack.

    Raises
    ------
    FerryIdError
        Where several fit, or none.
    """
    if not logs:
        raise FerryIdError(
            f"no vessel is given, and there is no log to choose it by. Fix: give --vessel, one of {', '.join(known())} "
            "or a TOML file"
        )
    profiles, faulty = named_profiles()
    every = [(log, [*_matches(profiles, log), *faulty]) for log in logs]
    fitting = [[one.name for one in matches if one.fits] for _, matches in every]
    able = [names for names in fitting if names]
    most = able if 2 * len(able) > len(logs) else fitting
    shared = [name for name in profiles if all(name in names for names in most)]
    if len(shared) == 1:
        profile = profiles[shared[0]]
        kind = "your own" if shared[0] in user_profiles() else "bundled"
        what = "this log has" if len(logs) == 1 else "these logs have"
        if len(most) < len(logs):
            what = f"{len(most)} of {counted(len(logs), 'log')} have"
        why = f"{kind}, the only profile whose signals {what}"
        if profile.table is not None and profile.table.columns:
            # Any table of as many columns has them.
            why += f", by the places of {counted(len(profile.table.columns), 'column')}: make sure that it is this vessel's"
        return VesselChoice(profile, shared[0], _line(profile, why))
    if len(most) == len(logs):
        for (log, matches), names in zip(every, fitting, strict=True):
            if not names:
                raise FerryIdError(_none_fits(log, matches))
    if not shared:
        several = [(log, names) for (log, _), names in zip(every, fitting, strict=True) if names]
        told = "; ".join(f"{log} {', '.join(names)}" for log, names in several[:_SHOWN])
        raise FerryIdError(
            f"{logs[0]}: no vessel profile fits this log and the others, they fit different ones: {told}. "
            "Fix: give logs of one vessel, or use ferryid batch, which takes several vessels"
        )
    log, matches = every[0]
    told = "; ".join(str(one) for one in matches if one.name in shared)
    raise FerryIdError(
        f"{log}: {counted(len(shared), 'vessel profile')} fit this log, so that it does not decide which vessel it is of: "
        f"{told}. Fix: give --vessel with one of them, or put its profile beside the log as vessel.toml"
    )


def _none_fits(log: str, matches: Sequence[Match]) -> str:
    near = sorted((one for one in matches if one.found or one.problem), key=lambda one: (bool(one.problem), -one.found))
    rest = len(matches) - len(near[:_SHOWN])
    told = "; ".join(map(str, near[:_SHOWN]))
    others = f"{counted(rest, 'other')} {'have' if rest > 1 else 'has'} fewer" if near else "none has a signal of it"
    listed = f"nearest are {told}; {others}" if near and rest else told or others
    return (
        f"{log}: no vessel profile fits this log, {listed}. Fix: draft one with ferryid vessel new {quote(log)}, which writes "
        "vessel.toml beside the log, or give --vessel a profile (TOML)"
    )


def named_profiles() -> tuple[dict[str, Profile], list[Match]]:
    """Return all profiles that have a name, and those of the user's own that cannot be used, with what is wrong."""
    profiles: dict[str, Profile] = {}
    faulty = []
    for name in known():
        try:
            profiles[name] = load_profile(name)
        except FerryIdError:
            file = quote(f"{user_folder() / name}.toml")
            faulty.append(Match(name, problem=f"has a fault: see ferryid vessel check {file}"))
    return profiles, faulty


def _matches(profiles: Mapping[str, Profile], log: str) -> list[Match]:
    """Return what each profile finds in a log.

    Raises
    ------
    FerryIdError
        For a log that no profile can open, as none has signals that could be looked for.
    """
    first: Reader | None = None
    unread: FerryIdError | None = None
    try:
        first = open_log(log)
    except FerryIdError as error:
        unread = error
    # The layout of a table, its column names included, is the profile's.
    is_table = first is None or any(topic.encoding == "table" for topic in first.topics)
    found = []
    opened = first is not None
    for name, profile in profiles.items():
        reader = first
        if is_table and profile.table is not None:
            try:
                reader = open_log(log, profile.table)
                opened = True
            except FerryIdError:
                reader = None
        if reader is None:
            every = tuple(signal.quantity for signal in profile.signals)
            found.append(Match(name, every, every))
        else:
            found.append(_found(name, profile, reader))
    if not opened and unread is not None:
        raise unread
    return found


def _match(profile: Profile, log: str) -> Match:
    return _found(profile.name, profile, open_log(log, profile.table))


def _found(name: str, profile: Profile, reader: Reader) -> Match:
    selection = survey(profile, reader.topics, reader.losses)
    lacking = [signal.quantity for signal in lacking_signals(profile, selection)]
    if not lacking and not {"x", "u", "vel_N"} & set(selection.found):
        # Nothing of it is required: it fits whatever has one of its topics.
        lacking = [one for one in ("position", "velocity") if one in selection.missing]
    return Match(name, tuple(lacking), tuple(selection.missing), len(profile.signals) - len(selection.missing))
