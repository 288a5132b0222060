"""A value that was forgotten: the parser would take the next option for it, and that one's value for a log."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from ferryid.errors import FerryIdError


def refuse_forgotten_values(params: Sequence[Any], words: Sequence[str]) -> None:
    """Refuse an option that another one follows in the place of its value.

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
        With both options.
    """
    options = [param for param in params if param.param_type_name == "option"]
    every = {name for param in options for name in (*param.opts, *param.secondary_opts)}
    taking = {name: param for param in options if not param.is_flag and not param.count for name in param.opts}
    for word, following in pairwise(words):
        if word == "--":
            return
        if word in taking and (following in every or (following.startswith("--") and following != "--")):
            value = "a file, or - for standard output" if taking[word].name == "json" else "its value"
            raise FerryIdError(
                f"{word}: a value must follow it, and {following.partition('=')[0]} is another option. Fix: give {word} {value}"
            )
