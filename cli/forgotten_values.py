"""A value that was forgotten: the parser would take the next option for it, and that one's value for a log.

An empty one, as of a shell variable that is not set, was forgotten as well: commands would take it for none.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

from ferryid.errors import FerryIdError


def refuse_forgotten_values(params: Sequence[Any], words: Sequence[str]) -> None:
    """Refuse an option that another one follows in the place of its value, and an empty value.

    A value that begins with two dashes can be given with a sign of equality.

    Parameters
    ----------
    params
        The command's options and arguments, that for the help included.
    words
        Of the command line, behind the command.

    Raises
    ------
    FerryIdError
        With both options, or the one whose value is empty.
    """
    options = [param for param in params if param.param_type_name == "option"]
    every = {name for param in options for name in (*param.opts, *param.secondary_opts)}
    taking = {name: param for param in options if not param.is_flag and not param.count for name in param.opts}
    for word, following in zip_longest(words, words[1:]):
        if word == "--":
            return
        if word in taking and following is not None and (following in every or _is_option(following)):
            raise FerryIdError(
                f"{word}: a value must follow it, and {following.partition('=')[0]} is another option. "
                f"Fix: give {word} {_wanted(taking[word])}"
            )
        name = word.removesuffix("=")
        if name in taking and (name != word or following == ""):
            raise FerryIdError(
                f"{name}: its value is empty, as that of a shell variable that is not set. "
                f"Fix: give {name} {_wanted(taking[name])}, or leave it out"
            )


def _is_option(word: str) -> bool:
    return word.startswith("--") and word != "--"


def _wanted(option: Any) -> str:
    return "a file, or - for standard output" if option.name == "json" else "its value"
