"""What a form of export is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ferryid.export.exported import Exported


@dataclass(frozen=True)
class Format:
    """A form that a model can be exported in.

    Attributes
    ----------
    name
        What ``--to`` takes.
    suffix
        Of its files, point included.
    title
        What it is, for help and messages.
    render
        Returns the text of the file, or the bytes of an archive.
    hint
        How to use or check the file: a line in which ``{file}`` and ``{name}`` are filled in.
    names_file
        True where the file has to be called as what it defines.
    check
        Evaluates the equations of the program that the file is for, with the numbers that stand in it, and returns what they
        express and the error that remains; for forms that are parameters and no code.
    """

    name: str
    suffix: str
    title: str
    render: Callable[[Exported], str] | Callable[[Exported], bytes]
    hint: str
    names_file: bool = False
    check: Callable[[Exported, str], dict[str, Any]] | None = None
