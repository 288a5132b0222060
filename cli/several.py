"""Options that take several words, up to the next option."""

from __future__ import annotations

from typing import Any

from ferryid.cli.defaults import DefaultsCommand
from ferryid.errors import FerryIdError


def several_after(*options: str) -> type[DefaultsCommand]:
    """Return a command that takes several words after some options, as ``--on a.bag b.bag``."""

    class Command(DefaultsCommand):
        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
            """Repeat such an option before every word that follows it, up to the next option."""
            written: list[str] = []
            follows = ""
            for place, word in enumerate(args):
                if word in options and (args[place + 1 : place + 2] or ["-"])[0].startswith("-"):
                    raise FerryIdError(f"{word}: no log follows it. Fix: name one or more after it")
                if word.startswith("-"):
                    option = word.partition("=")[0]
                    follows = option if option in options else ""
                elif follows and written[-1] != follows:
                    written.append(follows)
                written.append(word)
            return super().parse_args(ctx, written)

    return Command
