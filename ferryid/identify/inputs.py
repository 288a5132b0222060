"""The logs that a fit or a sweep starts from: read, aligned, and each given once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ferryid.identify.settings import FitSettings
from ferryid.signals.copies import GivenLogs
from ferryid.signals.order_of_time import in_order
from ferryid.signals.prepare import Opened, open_track
from ferryid.signals.stream import compact
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile


def read_logs(
    paths: Sequence[str], profile: Profile, settings: FitSettings, run: RunContext, *, whole: bool = True
) -> list[Opened]:
    """Read several logs and align their signals, before smoothing; they are returned in order of time.

    What is held out of short logs depends on their order, and should not on that in which they were given. That order stays
    where a log's times are no dates, and of logs that begin at once.

    With `whole` False, their recordings are `compact`, which leaves a third of the memory where nobody asks for the quality of
    their signals.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, and one that is given twice.
    """
    opened, given = [], GivenLogs()
    for path in paths:
        run.progress(f"reading {Path(path).name}")
        one = open_track(path, profile, run.tables, rate_hz=settings.rate_hz, verify=run.verify, ranges=run.ranges)
        given.add(one.recording)
        opened.append(one if whole else replace(one, recording=compact(one.recording)))
    return [opened[i] for i in in_order([one.recording.start_ns for one in opened])]
