"""Logs that were refused: the error of the work on them names a page that shows what they hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from ferryid.errors import FerryIdError, UnwritableError
from ferryid.signals.time_ranges import RangeError
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile

Made = TypeVar("Made")


def shown_where_refused(
    work: Callable[[], Made],
    what: str,
    logs: Sequence[str],
    profile: Profile,
    run: RunContext,
    command: Sequence[str] = (),
) -> Made:
    """Return what `work` makes; where it refuses a log, write a page on that log, and name it in the error.

    Parameters
    ----------
    work
        A fit or a diagnosis.
    what
        The participle on the page: ``fitted`` or ``diagnosed``.
    logs, profile, run
        What it works on.
    command
        The words that it was asked for with.

    Raises
    ------
    FerryIdError
        That of `work`. Where it is about the logs or the signal map, it names the page; a page that cannot be written, a log
        that cannot be opened, and a range that it does not have leave the error as it was.
    """
    try:
        return work()
    except (UnwritableError, RangeError):
        raise
    except FerryIdError as error:
        # What draws takes half a second to import, and hardly any log is refused.
        from ferryid.report.refusal_page import write_refusal

        try:
            page = write_refusal(error, what, logs, profile, run, command)
        except Exception:  # noqa: BLE001 - the reason of the refusal must arrive, whatever the log does to its page
            page = None
        if page is None:
            raise
        raise FerryIdError(f"{str(error).rstrip('.')}. What the log holds is drawn in {page}") from error
