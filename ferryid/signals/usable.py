"""Several logs of which some cannot be used: these are left out, each with its reason, and the others go on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from ferryid.errors import ContradictionError, FerryIdError, UnwritableError
from ferryid.files import exists, parts_of
from ferryid.signals.copies import GivenTwiceError

Made = TypeVar("Made")


def leads_somewhere(path: str) -> bool:
    """Return whether the path of a log, or those of all of its parts joined by ``+``, exist."""
    return all(exists(part) for part in parts_of(path))


def tried(work: Callable[[str], Made], path: str) -> Made | FerryIdError:
    """Return what `work` makes of a log, or why the log cannot be used.

    Raises
    ------
    FerryIdError
        For a path that leads nowhere, a log that is given twice, and a folder that cannot be written.
    """
    try:
        return work(path)
    except (GivenTwiceError, UnwritableError):
        raise
    except FerryIdError as error:
        # A path that leads nowhere is a slip of the pen, no log that cannot be used.
        if not leads_somewhere(path):
            raise
        return error


def usable(
    paths: Sequence[str],
    work: Callable[[str], Made],
    errors: dict[str, FerryIdError],
    comparable: Callable[[Made], bool] = lambda made: True,
) -> Iterator[Made]:
    """Yield what `work` makes of every log that can be used, one at a time, and put the errors of the others into `errors`.

    Parameters
    ----------
    paths, work
        Logs, and what is made of each.
    errors
        Filled with the error of each log that cannot be used, by its path.
    comparable
        Whether a log is long enough to show whether its signals contradict each other.

    Raises
    ------
    FerryIdError
        Where none can be used, that of the first, and where the signals contradict each other in half of the logs that can show
        it: that is the profile's fault, and not theirs. See also `tried`.
    """
    without = 0
    for path in paths:
        made = tried(work, path)
        if isinstance(made, FerryIdError):
            errors[path] = made
        else:
            without += comparable(made)
            yield made
    wrong = [error for error in errors.values() if isinstance(error, ContradictionError)]
    if wrong and len(wrong) >= without:
        raise wrong[0]
    if errors and errors.keys() >= set(paths):
        raise next(iter(errors.values()))


def left_out_of(whole: str, errors: Mapping[str, FerryIdError]) -> tuple[str, ...]:
    """Return sentences on logs that are left out of a whole, such as ``"campaign"``, with the error of each by its path."""
    return tuple(
        f"Left out of the {whole}: {error if Path(path).stem in str(error) else f'{path}: {error}'}"
        for path, error in errors.items()
    )
