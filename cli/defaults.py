"""Defaults for options out of the ``ferryid.toml`` beside the logs or above them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from typer.core import TyperCommand

from ferryid.cli.plain_values import PlainValues
from ferryid.errors import did_you_mean

if TYPE_CHECKING:
    from ferryid.vessel.folder_settings import FolderSettings

_LOGS = ("logs", "log", "on", "versus", "reference")
"""Parameters that are logs, in every command."""
_PATHS = ("out", "recipe", "file", "mcap", "diagnosis", "json", "truth")
"""Options that are paths: those of a file begin at the file."""
_PLACES = ("model", "against")
"""Options that are a path where such a file is there, and a name otherwise."""
_NOT_BY_FILE = ("help", "version", "vessel")
"""Options that are not set here; the vessel is found for each log."""

_OTHER_MEANING = {"export": ("to",), "models": ("to",)}
"""Options that mean something else in a command than in the others: what a file has for all is not theirs."""


class DefaultsCommand(PlainValues, TyperCommand):
    """A command whose options take their defaults from the nearest ``ferryid.toml``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Keep the words of the command line."""
        ctx.meta.setdefault(_WORDS, list(args))
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Put before the words of the command line what a file has for options that they leave out, and run."""
        from ferryid.vessel.folder_settings import common_folder, settings_of

        settings = settings_of(common_folder(_logs_of(ctx.params)))
        given = [] if settings is None else list(_given(ctx, settings))
        if settings is None or not given:
            return super().invoke(ctx)
        words = [word for _, written in given for word in written]
        for key, written in given:
            try:
                self._parsed(ctx, written)
            except Exception as error:
                if not hasattr(error, "format_message"):
                    raise
                raise settings.fault(key, f"{error.format_message().rstrip('.')}. Fix: correct the value") from error
        with self._parsed(ctx, words) as filled:
            return super().invoke(filled)

    def _parsed(self, ctx: Any, words: list[str]) -> Any:
        return self.make_context(ctx.info_name, [*words, *ctx.meta[_WORDS]], parent=ctx.parent)


_WORDS = "ferryid.words"


def _logs_of(params: Mapping[str, Any]) -> list[str]:
    """Return the logs among the arguments of a command."""
    # A path of another type is a file to write, as that of simulate.
    logs = [params[name] for name in _LOGS if params.get(name) and isinstance(params[name], str | list | tuple)]
    if params.get("mcap") is not None:
        logs.append(params["what"])
    words = params.get("words") or []
    if words[:1] == ["promote"]:
        logs.append(list(words[2:]))
    return [one for given in logs for one in ([given] if isinstance(given, str) else given)]


def _given(ctx: Any, settings: FolderSettings) -> Iterator[tuple[tuple[str, ...], list[str]]]:
    """Yield where a file has an option that the command line leaves out, and the option as words of a command line."""
    options = {
        name: param for param in ctx.command.params if param.param_type_name == "option" for name in _names(param)
    }
    for key, name, value in _values(settings, ctx.info_name, options):
        if ctx.get_parameter_source(options[name].name).name.startswith("DEFAULT"):
            yield key, _written(options[name], settings, key, value)


def _names(param: Any) -> list[str]:
    """Return how an option may be written in a file: as on the command line, dashes or underscores between words."""
    long = [one.removeprefix("--") for one in param.opts if one.startswith("--")]
    return [one for one in {*long, *(name.replace("-", "_") for name in long)} if one not in _NOT_BY_FILE]


def _values(
    settings: FolderSettings, command: str, options: Mapping[str, Any]
) -> Iterator[tuple[tuple[str, ...], str, Any]]:
    """Yield path, option and value of what the file says for a command: first that for all, then that for this one.

    Raises
    ------
    FerryIdError
        For a table that is no command, and a key that is no option.
    """
    _ = settings.vessel
    tables = {key: value for key, value in settings.data.items() if isinstance(value, dict)}
    commands = _commands()
    for name in tables:
        if name not in commands:
            raise settings.fault(
                (name,), f'there is no command "{name}".{did_you_mean(name, commands)} Fix: correct the name'
            )
    for name, value in settings.data.items():
        if name in options and name not in _OTHER_MEANING.get(command, ()):
            yield (name,), name, value
        elif name not in tables and name != "vessel":
            every = {option for one in commands for option in _options_of(one)}
            if name not in every:
                raise settings.fault((name,), _unknown(name, "any command", every))
    for name, value in tables.get(command, {}).items():
        if name == "vessel":
            raise settings.fault(
                (command, name), "the vessel is of the logs, not of a command. Fix: move it above the tables"
            )
        if name not in options:
            raise settings.fault((command, name), _unknown(name, f"ferryid {command}", options))
        yield (command, name), name, value


def _unknown(name: str, where: str, options: Any) -> str:
    return f'"{name}" is no option of {where}.{did_you_mean(name, options)} Fix: correct the name, or remove the line'


def _commands() -> set[str]:
    from ferryid.cli.app import command_names

    return set(command_names())


def _options_of(command: str) -> set[str]:
    """Return the options of a command by its name; those of a group are none."""
    from ferryid.cli.app import built

    return {name for param in built(command).params if param.param_type_name == "option" for name in _names(param)}


def _written(option: Any, settings: FolderSettings, key: tuple[str, ...], value: Any) -> list[str]:
    """Return an option and its value as words of a command line; a path begins at the file.

    Raises
    ------
    FerryIdError
        For a value of another kind than the option takes.
    """
    name = next(one for one in option.opts if one.startswith("--"))
    values = value if option.multiple and isinstance(value, list) else [value]
    for one in values:
        if isinstance(one, bool) != bool(option.is_flag) or not isinstance(one, str | int | float):
            takes = "true or false" if option.is_flag else "a text or number"
            raise settings.fault(key, f"{name} takes {takes}, found {one!r}. Fix: correct the value")
        if one == "":
            raise settings.fault(key, f"{name} is empty. Fix: give it a value, or remove the line")
    if option.is_flag:
        return [name] if value else []
    return [f"{name}={_placed(option.name, settings, str(one))}" for one in values]


def _placed(name: str, settings: FolderSettings, value: str) -> str:
    if name in _PATHS and value != "-":
        return str(settings.path.parent / value)
    return settings.placed(value) if name in _PLACES else value
