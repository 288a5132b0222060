"""The one error that ferryid raises on purpose."""

from __future__ import annotations

import difflib
import unicodedata
from collections.abc import Iterable

_LONGEST = 2000
"""Most characters of a message; what is longer loses its middle, where a value stands that no one would read."""
_LIKE = 0.6
"""Names less alike than this are different words rather than one misspelt."""


class FerryIdError(Exception):
    """Input that cannot be used, said in one line that names file, cause and remedy.

    The only argument is the finished message, so that the error survives pickling to a worker process.

    Parameters
    ----------
    message
        ``"<file>: <what is wrong and who needs it>, <what was found instead>. Fix: <remedy>"``. It may quote any input:
        see `one_line`.
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


class UnwritableError(FerryIdError):
    """A place that cannot be written, or a full disk: no fault of the input, which may be usable another time."""


class ContradictionError(FerryIdError):
    """A log whose signals contradict each other: something changed in it, or the profile is wrong for all logs."""


class ReversedForcesError(FerryIdError):
    """A log in which the vessel accelerates against the applied force: the profile says the opposite of what acts."""


def one_line(message: str) -> str:
    """Return a message fit for a terminal and a single line: control characters written out, an endless one shortened."""
    if len(message) > _LONGEST:
        message = f"{message[: _LONGEST // 2]} ... {message[-_LONGEST // 2 :]}"
    return printable(message)


def with_sentence(error: FerryIdError, *sentences: str) -> str:
    """Return the message of an error with more sentences between its cause and its remedy; empty ones are left out."""
    cause, fix, remedy = str(error).partition(" Fix: ")
    return " ".join(filter(None, [cause, *sentences])) + fix + remedy


def printable(text: str, keep: str = "") -> str:
    """Return a text with control and formatting characters escaped, which would command a terminal or reorder a page.

    Parameters
    ----------
    text
        Anything, such as a topic's name out of a log.
    keep
        Control characters that stay, such as ``"\\n"`` for a text of several lines. Spaces of every width stay in any case.
    """
    if text.isprintable():
        return text
    return "".join(
        c
        if c.isprintable() or c in keep or unicodedata.category(c) == "Zs"
        else c.encode("unicode_escape").decode("ascii")
        for c in text
    )


def ended(sentence: str) -> str:
    """Return a sentence with its full stop, unless it ends in a mark of its own."""
    return sentence if sentence.endswith((".", "?", "!")) else f"{sentence}."


_MOST_OPTIONS = 5000
"""More names are not searched for the nearest: no vessel has so many topics, and it would take minutes."""


def did_you_mean(name: str, options: Iterable[str]) -> str:
    """Return ``' Did you mean "x"?'`` for the option nearest to a misspelt name, or an empty string.

    Of topics (``/a/b``) the last parts must be alike as well, and one that only lacks its first parts is found too.
    """
    others = set(options)
    if len(others) > _MOST_OPTIONS:
        return ""
    likeness, near = max(((_likeness(name, option), option) for option in others), default=(0.0, ""))
    # One letter of two or three is much of a short name.
    enough = 0.5 if max(len(name), len(near)) <= 3 else _LIKE
    return f' Did you mean "{near}"?' if likeness >= enough else ""


def _likeness(name: str, option: str) -> float:
    """Likeness of two names, 0 to 1."""
    whole = difflib.SequenceMatcher(None, name, option).ratio()
    if not option.startswith("/"):
        return whole
    short, long = sorted((f"/{name.strip('/')}", option), key=len)
    if long.endswith(short):
        return max(whole, _LIKE)
    last = difflib.SequenceMatcher(None, name.rpartition("/")[2], option.rpartition("/")[2]).ratio()
    return whole if last >= _LIKE else 0.0
