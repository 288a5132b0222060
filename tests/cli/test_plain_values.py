"""Values that the command line makes itself are those that typer makes, and its errors are typer's."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import pytest
import typer
from typer.core import TyperArgument, TyperCommand, TyperOption

from ferryid.cli import plain_values
from ferryid.cli.plain_values import PlainCommand

WORDS = (
    [],
    ["a", "b", "--number", "12", "--share", "0.25", "--path", "x/y", "--flag", "--name", "ü"],
    ["--number", "-3", "--share", "1e-3", "--path", ".", "--no-flag"],
    ["--number", " 7 ", "--share", "inf"],
    ["--number", "1_000", "--share", ".5"],
    ["--number", "99999999999999999999", "--share", "nan"],
    ["--number", "seven"],
    ["--share", "half"],
    ["--number", "1.0"],
    ["--within", "11"],
    ["--within", "3"],
    ["--folder", "nowhere"],
    # No shell passes a NUL, but a ferryid.toml may hold one.
    ["--path", "a\0b"],
    ["--kind", "both"],
)


def parsed(cls: type[TyperCommand], words: list[str]) -> Any:
    """Return the values that a command gets, or the error."""
    got: dict[str, Any] = {}

    def command(
        logs: Annotated[list[str] | None, typer.Argument()] = None,
        number: Annotated[int | None, typer.Option()] = None,
        share: Annotated[float, typer.Option()] = 1.0,
        path: Annotated[Path | None, typer.Option()] = None,
        folder: Annotated[Path | None, typer.Option(exists=True)] = None,
        flag: Annotated[bool, typer.Option("--flag/--no-flag")] = False,
        name: Annotated[str, typer.Option()] = "none",
        kind: Annotated[str, typer.Option()] = "one",
        within: Annotated[int, typer.Option(min=1, max=9)] = 5,
    ) -> None:
        got.update(locals())

    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    app.command("x", cls=cls)(command)
    try:
        typer.main.get_command(app).main(words, prog_name="x", standalone_mode=False)
    except Exception as error:  # noqa: BLE001 - both must fail alike
        return type(error), getattr(error, "format_message", error.__str__)()
    got.pop("got", None)
    return {name: (type(value), repr(value)) for name, value in got.items()}


@pytest.mark.parametrize("words", WORDS, ids=" ".join)
def test_values_and_errors_are_those_of_typer(words: list[str]) -> None:
    assert parsed(PlainCommand, words) == parsed(TyperCommand, words)


def _renamed_method(monkeypatch: pytest.MonkeyPatch) -> None:
    mixin = next(one for one in TyperOption.__mro__ if "get_runtime_param" in vars(one))
    own = mixin.get_runtime_param
    monkeypatch.setattr(mixin, "checked", own, raising=False)
    monkeypatch.delattr(mixin, "get_runtime_param")
    monkeypatch.setattr(
        mixin, "process_value", lambda self, ctx, value: self.checked().coerce(value, param=self, ctx=ctx)
    )


def _renamed_coercion(monkeypatch: pytest.MonkeyPatch) -> None:
    mixin = next(one for one in TyperOption.__mro__ if "get_runtime_param" in vars(one))
    kind = typer.core.RuntimeParam
    monkeypatch.setattr(kind, "convert", kind.coerce, raising=False)
    monkeypatch.setattr(
        mixin, "process_value", lambda self, ctx, value: self.get_runtime_param().convert(value, param=self, ctx=ctx)
    )


def _renamed_description(monkeypatch: pytest.MonkeyPatch) -> None:
    own = plain_values._maker
    monkeypatch.setattr(plain_values, "_maker", lambda param: own(SimpleNamespace(multiple=param.multiple)))


@pytest.mark.parametrize("change", [_renamed_method, _renamed_coercion, _renamed_description])
@pytest.mark.parametrize("words", [WORDS[1], WORDS[6], WORDS[7]], ids=" ".join)
def test_where_typer_is_another_one_it_makes_the_values(
    monkeypatch: pytest.MonkeyPatch, change: Callable[[pytest.MonkeyPatch], None], words: list[str]
) -> None:
    change(monkeypatch)
    assert "get_runtime_param" not in dir(TyperArgument) or change is not _renamed_method
    assert parsed(PlainCommand, words) == parsed(TyperCommand, words)
