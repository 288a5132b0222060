"""What the calls have in common: logs, vessels, models and settings as they are given."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ferryid.models import Model
    from ferryid.report.outcome import Outcome
    from ferryid.types import Given, RunContext
    from ferryid.vessel.choice import VesselChoice
    from ferryid.vessel.profile import Profile

OUT = Path("ferryid-out")
"""The output folder of every call: its ``logs`` keep ingested tables, ``models`` the model store, ``reports`` the pages."""

Logs = str | Path | Sequence[str | Path]
"""Bags, MCAP files, tables or folders; parts of one recording joined by ``+``."""
Ranges = Sequence[tuple[str | float | None, str | float | None]]
"""First and last time of what is used of every log: seconds from its start, negative ones from its end, or clock times in UTC
(``"14:30:05"``, ``"2024-05-17T14:30:05"``), None for the start or the end; all of a log where there is none."""
Progress = Callable[[str], None]
"""Called with the name of each stage, and with an empty one at the end."""


def quiet(_line: str) -> None:
    """Show nothing."""


def paths_of(logs: Logs) -> list[str]:
    """Return logs as paths; those of a URL where their copies are."""
    named = [str(logs)] if isinstance(logs, str | Path) else [str(log) for log in logs]
    if not any("://" in log for log in named):
        return named
    from ferryid.ingest.remote import local_logs

    return [path for log in named for path in local_logs(log)]


def refuse_no_logs(logs: Sequence[str]) -> None:
    """Refuse a call that reads logs and was given none."""
    if not logs:
        from ferryid.errors import FerryIdError

        raise FerryIdError("no log was given. Fix: name one or more, as a path or a list of paths")


def path_of(log: str | Path) -> str:
    """Return a single log as a path."""
    paths = paths_of(log)
    if len(paths) > 1:
        from ferryid.counts import counted
        from ferryid.errors import FerryIdError

        raise FerryIdError(
            f"{log}: matches {counted(len(paths), 'log')}, one was to be read. Fix: name one, the first is {paths[0]}"
        )
    return paths[0]


def profile_of(vessel: str | Path | Profile) -> Profile:
    from ferryid.vessel import load_profile
    from ferryid.vessel.profile import Profile

    return vessel if isinstance(vessel, Profile) else load_profile(str(vessel))


def announced(choice: VesselChoice | None, announce: Progress) -> Profile | None:
    """Return the profile of a choice, and announce it where it was not asked for."""
    if choice is not None and choice.reason:
        announce(choice.reason)
    return None if choice is None else choice.profile


def chosen_vessel(logs: Sequence[str], vessel: str | Path | Profile | None, announce: Progress) -> Profile:
    """Return the vessel of logs, and announce which one was found where it was not asked for."""
    from ferryid.vessel import choose_vessel

    refuse_no_logs(logs)
    choice = choose_vessel(logs, vessel)
    announced(choice, announce)
    return choice.profile


def vessel_of_archive(out: Path, vessel: str | Path | Profile | None, announce: Progress) -> Profile:
    """Return the vessel whose ingested logs are used, and announce which one was found where it was not asked for."""
    from ferryid.signals.ingested_vessel import ingested_vessel

    if vessel is not None:
        return profile_of(vessel)
    choice = ingested_vessel(out)
    announced(choice, announce)
    return choice.profile


def vessel_beside_model(
    model: Model, logs: Sequence[str], vessel: str | Path | Profile | None, announce: Progress
) -> Profile | None:
    """Return the profile to read logs with beside a model; None where the model's own serves."""
    from ferryid.vessel import choose_vessel, parse_profile

    own = parse_profile(model.profile_text, model.name)
    choice = choose_vessel(logs, vessel, own=own)
    announced(choice, announce)
    return None if choice.profile is own else choice.profile


def model_of(model: str | Path | Model, out: Path) -> Model:
    from ferryid.models import Model
    from ferryid.models.store import load

    return model if isinstance(model, Model) else load(str(model), out)


def run_context(
    out: str | Path,
    progress: Progress,
    verify: bool = False,
    ranges: Ranges = (),
    command: Sequence[str] = (),
    given: Given | None = None,
) -> RunContext:
    from ferryid.types import NOTHING, RunContext

    return RunContext(Path(out), progress, verify, ranges=tuple(ranges), command=tuple(command), given=given or NOTHING)


def given_of(logs: Logs, vessel: str | Path | Profile | None, out: str | Path, ranges: Ranges) -> Given:
    """Return logs and options as they were given, for the commands that a page names."""
    from ferryid.types import Given

    return Given(
        (str(logs),) if isinstance(logs, str | Path) else tuple(str(log) for log in logs),
        str(vessel) if isinstance(vessel, str | Path) else "",
        "" if Path(out) == OUT else str(out),
        tuple(ranges),
    )


def refuse_ranges_of_archive(ranges: Ranges) -> None:
    """Refuse ranges of what is kept as sums."""
    from ferryid.errors import FerryIdError

    if ranges:
        raise FerryIdError(
            "--archive: what is kept of ingested logs is of all of each, so that no range of it can be used. Fix: leave out "
            "--from and --to, give them to ferryid ingest, or name the logs without --archive"
        )


def outcome_of(result: Mapping[str, Any], text: str) -> Outcome:
    from ferryid.report.outcome import Outcome

    return Outcome(dict(result), text)
