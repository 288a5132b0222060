"""The one error that ferryid raises on purpose."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class FerryIdError(Exception):
    """Input that cannot be used, said in one line that names file, cause and remedy.

    The only argument is the finished message, so that the error survives pickling to a worker process.

    Parameters
    ----------
    message
        ``"<file>: <what is wrong and who needs it>, <what was found instead>. Fix: <remedy>"``.
    """

    def __init__(self, message: str) -> None:
        super().__init__(message)


def did_you_mean(name: str, options: Iterable[str]) -> str:
    """Return ``' Did you mean "x"?'`` for the option nearest to a misspelt name, or an empty string."""
    near = difflib.get_close_matches(name, sorted(set(options)), n=1, cutoff=0.5)
    return f' Did you mean "{near[0]}"?' if near else ""
