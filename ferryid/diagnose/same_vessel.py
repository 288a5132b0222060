"""Whether logs that a model is fitted to are of one vessel, by the rule by which a campaign of them would be parted."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ferryid.counts import counted
from ferryid.diagnose.checks.screening import ScreenedLog, screen_sensors
from ferryid.diagnose.data.measurements import measure_log
from ferryid.diagnose.gathering import Sides, cause_of_split, sides_of, why_parted, with_common_sensors
from ferryid.diagnose.inference.stages import AveragedLog, average
from ferryid.diagnose.judging.diagnosis import distinct
from ferryid.effects.wording import listed
from ferryid.errors import FerryIdError
from ferryid.files import name_of_log
from ferryid.side_by_side import over
from ferryid.signals.usable import tried
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile


def find_other_vessels(
    paths: Sequence[str], profile: Profile, run: RunContext
) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return the logs of another vessel among several, with what is said of each, and sentences on what may be another's.

    Logs are another vessel's where they are fewer than the others and the hulls are apart (`Split.apart`); so is a single one
    that a campaign would be parted from, unless a load or a weak thruster explains it. Where that does, or part of the logs
    may be from before a change of the hull, or half of them are on either side, all are used and a sentence says so. Logs that
    a campaign could not use are not judged.

    Parameters
    ----------
    paths
        Logs that a fit can use; parts of one recording joined by ``+``.
    profile, run
        The vessel; folder of the ingested tables and progress.
    """
    run.progress("comparing the hulls of the logs")

    def unscreened(path: str) -> AveragedLog:
        measured = measure_log(path, profile, run)
        return average(ScreenedLog(measured, measured.measurements, ()))

    made = over(lambda path: tried(unscreened, path), paths)
    logs = [one for one in made if not isinstance(one, FerryIdError)]
    # Where all is well even with the errors of the sensors, there is no need to find them.
    if sides_of(logs, (), profile) is None:
        return {}, ()
    screened = over(lambda one: tried(lambda path: _screened(one, run), one.path), logs)
    logs = list(with_common_sensors([one for one in screened if not isinstance(one, FerryIdError)]))
    foreign: dict[str, str] = {}
    while (found := sides_of(logs, (), profile)) is not None:
        if not _of_another(found):
            return foreign, (_doubt(found, logs),)
        foreign |= {path: _foreign(found) for path in sorted(found.inside)}
        logs = [one for one in logs if one.path not in found.inside]
    return foreign, ()


def _screened(log: AveragedLog, run: RunContext) -> AveragedLog:
    return average(screen_sensors(log.screened.measured, run.progress))


def _of_another(found: Sides) -> bool:
    """Return whether the smaller side is that of another vessel."""
    if len(found.inside) == len(found.outside):
        return False
    return found.split.apart or (len(found.inside) == 1 and found.split.change is None)


def _foreign(found: Sides) -> str:
    """Return what is said of a log that is left out."""
    more, others = len(found.inside) - 1, counted(len(found.outside), "other log")
    which = (
        f"it and {counted(more, 'log')} like it on one side and the {others} on the other"
        if more
        else f"it and the {others}"
    )
    return (
        f"no common hull fits {which} ({why_parted(found.split)}); {cause_of_split(found.split)}. Fix: fit it by itself, with "
        "the profile of its vessel"
    )


def _doubt(found: Sides, logs: Sequence[AveragedLog]) -> str:
    """Return that no common hull fits logs which are all used, as a sentence."""
    return (
        f"No common hull fits {_names(found.inside, logs)} on one side and {_names(found.outside, logs)} on the other "
        f"({why_parted(found.split)}); {cause_of_split(found.split)}. All of them are used, and the model is of neither. Fix: "
        "see what differs with ferryid diagnose OTHERS... --versus LOG..., or fit each side by itself"
    )


def _names(paths: Collection[str], logs: Sequence[AveragedLog]) -> str:
    every = [one.path for one in logs]
    names = distinct([name_of_log(one) for one in every], every)
    return listed([name for name, path in zip(names, every, strict=True) if path in paths])
