"""ferryid ingest."""

from __future__ import annotations

from ferryid.cli.options import OUT, From, Json, Logs, Out, To, Verify, Vessel, ranges
from ferryid.cli.output import emit, progress, tell


def command(
    logs: Logs,
    vessel: Vessel = None,
    from_: From = None,
    to: To = None,
    out: Out = OUT,
    verify: Verify = False,
    json: Json = None,
) -> None:
    """Read logs into Parquet tables with SNAME column names, SI units and provenance."""
    from ferryid import api

    emit(
        api.ingest(
            logs, vessel or None, out, verify=verify, ranges=ranges(from_, to), progress=progress, announce=tell
        ),
        json,
    )
