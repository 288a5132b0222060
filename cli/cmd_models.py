"""ferryid models."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from ferryid.cli.completion import model_or_log
from ferryid.cli.options import OUT, From, Json, ModelVessel, Out, ranges
from ferryid.cli.output import emit, progress, tell
from ferryid.counts import counted
from ferryid.errors import FerryIdError

if TYPE_CHECKING:
    from ferryid.report.outcome import Outcome


_NAME_FOLLOWS = {"promote": "NAME@VERSION", "rollback": "NAME"}
"""What follows the words that change which version is current; a model may be named like one of them."""


def command(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            autocompletion=model_or_log,
            metavar="[MODEL | promote NAME@V [LOG...] | rollback NAME]",
            help="A name, name@version or path to show, and none to list all; or which version is to become current: "
            "one that is replayed on logs against the present one, or the one before.",
            show_default=False,
        ),
    ] = None,
    vessel: ModelVessel = None,
    from_: From = None,
    force: Annotated[bool, typer.Option("--force", help="Promote although the replay found it worse.")] = False,
    to: Annotated[
        str | None,
        typer.Option(
            help="Of rollback: the version to return to, the one before if left out. Of promote: the end of the range."
        ),
    ] = None,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """List the stored models and which is current, show the one whose name follows, or change which is current."""
    from ferryid import api

    first, *others = words or [""]
    if first == "promote" and others:
        promoted = api.promote(
            others[0],
            others[1:],
            out,
            vessel=vessel or None,
            ranges=ranges(from_, to),
            force=force,
            progress=progress,
            announce=tell,
        )
        emit(promoted, json)
        if not promoted.json["promoted"]:
            raise typer.Exit(3)
    elif first == "rollback" and others:
        emit(_rolled_back(others, out, to), json)
    elif others:
        raise FerryIdError(_too_many(first, others))
    else:
        if first in _NAME_FOLLOWS and not (out / "models" / first).is_dir():
            raise FerryIdError(
                f"models {first}: the name of a model is missing. Fix: write ferryid models {first} {_NAME_FOLLOWS[first]}"
            )
        emit(api.show_model(first, out) if first else api.models(out), json)


def _too_many(first: str, others: list[str]) -> str:
    """Return why more words than a model's name cannot be used, and what to write."""
    what = f"models: takes the name of one model to show it, found {counted(1 + len(others), 'word')}, {first!r} first."
    if len(others) == 1 and first in ("show", "list"):
        return f"{what} Fix: write ferryid models {quote(others[0])}"
    return f"{what} Fix: name one model, or write promote or rollback before it"


def _rolled_back(names: list[str], out: Path, to: str | None) -> Outcome:
    from ferryid import api

    if len(names) > 1:
        raise FerryIdError(f"models rollback: {len(names)} names were given. Fix: name one, and its version with --to")
    name, _, version = names[0].partition("@")
    if version and not version.isdigit():
        raise FerryIdError(f"models rollback: {names[0]} has no version. Fix: write {name}@NUMBER, or {name} alone")
    if to is not None and not to.isdigit():
        raise FerryIdError(f"models rollback: --to {to} is no version. Fix: give its number")
    wanted = version or to
    return api.roll_back(name, out, to=int(wanted) if wanted else None)
