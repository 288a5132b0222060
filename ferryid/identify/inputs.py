"""The logs that a fit or a sweep starts from: read, aligned, and each given once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ferryid.counts import counted
from ferryid.errors import FerryIdError, with_sentence
from ferryid.identify.engagement import odd_forces
from ferryid.identify.force_signs import ForceResponse, force_response
from ferryid.identify.motion_data import prepared_data
from ferryid.identify.settings import FitSettings
from ferryid.signals.consistency import comparable
from ferryid.signals.contiguous import Contiguous, contiguous
from ferryid.signals.copies import GivenLogs
from ferryid.signals.order_of_time import in_order
from ferryid.signals.prepare import Opened, open_track, smoothed
from ferryid.signals.stream import compact
from ferryid.signals.usable import left_out_of, usable
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile

OddLogs = Callable[[Sequence[str]], tuple[Mapping[str, str], tuple[str, ...]]]
"""Returns, of the paths of logs, those of another vessel with what is said of each, and sentences on what may be another's."""


def read_logs(
    paths: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    *,
    whole: bool = True,
    usable_only: bool = False,
) -> list[Opened]:
    """Read several logs and align their signals, before smoothing; they are returned in order of time.

    What is held out of short logs depends on their order, and should not on that in which they were given. That order stays
    where a log's times are no dates, and of logs that begin at once.

    With `whole` False, their recordings are `compact`, which leaves a third of the memory where nobody asks for the quality of
    their signals. With `usable_only` those that a fit cannot use are left out.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, with `usable_only` where none can, and one that is given twice.
    """
    if usable_only:
        return _in_time([one for _, one in _usable(paths, profile, settings, run, {}, whole=whole)])
    read = _reader(profile, settings, run, whole)
    return _in_time([read(path) for path in paths])


@dataclass(frozen=True, eq=False)
class UsableLogs:
    """Logs that a fit can use, read and aligned, in order of time.

    Attributes
    ----------
    opened
        The logs.
    reasons
        Why each of the others is left out, as a sentence, by its path.
    doubts
        Which of the logs may not be of one vessel with the others, as sentences.
    notes
        Which short logs are used as one, as a sentence.
    """

    opened: list[Opened]
    reasons: Mapping[str, str] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def left_out(self) -> tuple[str, ...]:
        """The sentences on logs that are left out."""
        return tuple(self.reasons.values())

    def beside(self, error: FerryIdError) -> str:
        """Return the message of what a fit of these logs was refused for, and that it was without the others."""
        if not self.left_out:
            return str(error)
        first = self.left_out[0].partition(" Fix: ")[0]
        more = len(self.left_out) - 1
        return with_sentence(
            error, first, f"So {'is' if more == 1 else 'are'} {counted(more, 'more log')}." * bool(more)
        )


def usable_logs(
    paths: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    whole: str = "fit",
    odd: OddLogs | None = None,
) -> UsableLogs:
    """Read several logs as `read_logs` does, without those that a fit cannot use and those of odd forces.

    Short ones that follow each other without a break are read as one (`ferryid.signals.contiguous`), unless one of these cannot
    be used. `whole` is what logs are left out of, as their sentences say; `odd` finds those of another vessel.

    Raises
    ------
    FerryIdError
        Where none can be used, for a path that leads nowhere, and for a log that is given twice.
    """
    # Seconds count from the start of each log as it was given.
    joined = Contiguous(tuple(paths), {}) if run.ranges else contiguous(paths, profile)
    errors: dict[str, FerryIdError] = {}
    doubts: tuple[str, ...] = ()
    try:
        found = _usable(joined.paths, profile, settings, run, errors)
        refused = bool(joined.parts.keys() & errors.keys())
    except FerryIdError:
        if not joined.parts:
            raise
        refused = True
    if refused:
        # A part that cannot be used takes no other with it.
        joined, errors = Contiguous(tuple(paths), {}), {}
        found = _usable(paths, profile, settings, run, errors)
    if odd is not None and len(found) > 1:
        foreign, doubts = odd([path for path, _ in found])
        errors.update({path: FerryIdError(f"{path}: {why}") for path, why in foreign.items()})
    opened = _in_time([one for path, one in found if path not in errors])
    return UsableLogs(opened, dict(zip(errors, left_out_of(whole, errors), strict=True)), doubts, joined.notes)


def _usable(
    paths: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    errors: dict[str, FerryIdError],
    *,
    whole: bool = True,
) -> list[tuple[str, Opened]]:
    """Return the logs of `usable_logs` with their paths, and put the errors of the others into `errors`.

    `whole` is as of `read_logs`.
    """
    read, alone = _reader(profile, settings, run, whole), len(paths) == 1
    responses: dict[str, ForceResponse | None] = {}

    def examined(path: str) -> tuple[str, Opened]:
        one = read(path)
        if not alone:
            responses[path] = _response(one, profile, settings)
        return path, one

    found = list(usable(paths, examined, errors, lambda made: comparable(made[1].track)))
    errors.update({path: FerryIdError(f"{path}: {why}") for path, why in odd_forces(responses, profile).items()})
    return [(path, one) for path, one in found if path not in errors]


def _response(one: Opened, profile: Profile, settings: FitSettings) -> ForceResponse | None:
    """Return how the vessel of a log accelerates under the applied force; None where a fit does not ask, or the log cannot say.

    Raises
    ------
    FerryIdError
        For a log that a fit cannot use, such as one shorter than the smoothing window.
    """
    if settings.estimator == "derivative" or settings.residual != "measured":
        # Nothing is asked of it, but that it can be smoothed.
        smoothed(one, settings.window_s, settings.smoother)
        return None
    return force_response(prepared_data(profile, settings, [one]))


def _reader(profile: Profile, settings: FitSettings, run: RunContext, whole: bool = True) -> Callable[[str], Opened]:
    """Return what reads and aligns a log that was not given before."""
    given = GivenLogs()

    def read(path: str) -> Opened:
        run.progress(f"reading {Path(path).name}")
        one = open_track(path, profile, run.tables, rate_hz=settings.rate_hz, verify=run.verify, ranges=run.ranges)
        given.add(one.recording)
        return one if whole else replace(one, recording=compact(one.recording))

    return read


def _in_time(opened: Sequence[Opened]) -> list[Opened]:
    return [opened[i] for i in in_order([one.recording.start_ns for one in opened])]
