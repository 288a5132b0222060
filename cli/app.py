"""The application: its commands are found by their files, and read when they are asked for."""

from __future__ import annotations

import importlib
import os
from types import ModuleType
from typing import Any

import typer

import ferryid
from ferryid.cli.defaults import DefaultsCommand
from ferryid.cli.plain_values import PlainGroup

HELP = {"help_option_names": ["-h", "--help"]}


class _Commands(PlainGroup):
    """Every module ``cmd_<name>`` of this package: its function ``command``, or its group ``app``.

    Building a command takes longer than reading its module, so only the one that runs is built.
    """

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        # Read by the suggestion for a misspelt name alone.
        self.commands = dict.fromkeys(command_names())

    def list_commands(self, ctx: typer.Context) -> list[str]:
        return list(self.commands)

    def get_command(self, ctx: typer.Context, cmd_name: str) -> Any:
        return built(cmd_name) if cmd_name in self.commands else None

    def format_commands(self, ctx: typer.Context, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, _summary(_module(name))) for name in self.commands])


def command_names() -> list[str]:
    """Return the names of all commands, in alphabetical order."""
    files = (file.removesuffix(".py") for file in os.listdir(os.path.dirname(__file__)))
    return sorted(file.removeprefix("cmd_") for file in files if file.startswith("cmd_"))


def built(name: str) -> Any:
    """Return the command of a name."""
    module = _module(name)
    if hasattr(module, "app"):
        return typer.main.get_command(module.app)
    alone = typer.Typer(add_completion=False, rich_markup_mode=None, context_settings=HELP)
    alone.command(name, cls=getattr(module, "Command", DefaultsCommand))(module.command)
    return typer.main.get_command(alone)


def _module(name: str) -> ModuleType:
    return importlib.import_module(f"ferryid.cli.cmd_{name}")


def _summary(module: ModuleType) -> str:
    """Return what a command does, in its first sentence."""
    text: str = module.app.info.help if hasattr(module, "app") else module.command.__doc__
    return " ".join(text.split("\n\n")[0].split())


app = typer.Typer(
    name="ferryid",
    cls=_Commands,
    help="Turn a recorded sea trial into a better vessel model, and say honestly whether to trust it.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings=HELP,
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ferryid {ferryid.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Print the version."),
) -> None:
    pass
