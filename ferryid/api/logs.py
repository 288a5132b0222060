"""Recordings: what is in them, and their tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ferryid.api.arguments import (
    OUT,
    Logs,
    Progress,
    Ranges,
    announced,
    chosen_vessel,
    outcome_of,
    path_of,
    paths_of,
    quiet,
)

if TYPE_CHECKING:
    from ferryid.report.outcome import Outcome
    from ferryid.vessel.profile import Profile


def inspect(
    log: str | Path,
    vessel: str | Path | Profile | None = None,
    *,
    verify: bool = False,
    width: int = 160,
    ranges: Ranges = (),
    announce: Progress = quiet,
) -> Outcome:
    """Return topics, types, counts, rates, gaps and clocks of a log, and the signals that a vessel's profile finds in it.

    Parameters
    ----------
    log
        Path; parts of one recording joined by ``+``.
    vessel
        Name of a profile, the path of a TOML file, or a profile; what is stated beside the log or in ``$FERRYID_VESSEL`` where
        None, and where nothing is, or its profile has a fault, every profile that has a name is tried.
    verify
        Read the whole file and check every checksum.
    width
        Of the text, in characters.
    announce
        Called with the vessel that is stated.
    """
    from ferryid.errors import FerryIdError
    from ferryid.signals.inspect import inspect as inspect_log
    from ferryid.signals.inspect import render_inspect
    from ferryid.vessel import stated_choice

    path = path_of(log)
    if vessel is not None or ranges:
        profile: Profile | None = chosen_vessel([path], vessel, announce)
    else:
        try:
            profile = announced(stated_choice([path]), announce)
        except FerryIdError as error:
            # A draft that is not filled in yet: what the log holds is what fills it in.
            announce(f"no profile is used: {error}")
            profile = None
    result = inspect_log(path, profile, verify=verify, ranges=tuple(ranges))
    return outcome_of(result, render_inspect(result, width))


def ingest(
    logs: Logs,
    vessel: str | Path | Profile | None = None,
    out: str | Path = OUT,
    *,
    verify: bool = False,
    progress: Progress = quiet,
    ranges: Ranges = (),
    announce: Progress = quiet,
) -> Outcome:
    """Read logs into Parquet tables with SNAME column names, SI units and provenance."""
    from ferryid.signals.ingest import ingest as ingest_logs
    from ferryid.signals.ingest import render_ingest

    paths = paths_of(logs)
    result = ingest_logs(
        paths, chosen_vessel(paths, vessel, announce), Path(out), verify=verify, ranges=tuple(ranges), progress=progress
    )
    return outcome_of(result, render_ingest(result))
