"""What is done with every log of a batch: a TOML file, every fault with its line before any log is read."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identify import FitSettings
from ferryid.vessel.toml_lines import KeyPath, key_lines, line_of, too_deep

STEPS = ("fit", "evaluate", "diagnose")
LARGEST_BYTES = 1 << 20
KINDS: Mapping[str, tuple[str, tuple[type, ...]]] = {
    "str": ("text", (str,)),
    "int": ("a whole number", (int,)),
    "float": ("a number", (int, float)),
    "tuple[float, ...]": ("a list of numbers", (list,)),
}
"""Types of settings by their names, in words and as TOML has them."""


@dataclass(frozen=True)
class Recipe:
    """What is done with a log.

    Attributes
    ----------
    steps
        Of `STEPS`, in that order.
    model
        What a log is evaluated against and diagnosed from: path, ``name`` or ``name@version``; the profile's hull where
        empty.
    fit
        Settings of the fit.
    fit_report
        Whether a fit writes its page, or stores the model alone.
    withhold
        Signals to hide from the diagnosis, and to compare afterwards.
    versus
        Whether the first and the last logs of a vessel are compared as groups, see `ferryid.batch.changes`.
    """

    steps: tuple[str, ...] = STEPS
    model: str = ""
    fit: FitSettings = field(default_factory=FitSettings)
    fit_report: bool = True
    withhold: tuple[str, ...] = ()
    versus: bool = True

    def plain(self) -> dict[str, Any]:
        """Return what of it the results of a log depend on, but for the model, whose content counts."""
        told: dict[str, Any] = {"steps": list(self.steps)}
        if "fit" in self.steps:
            told["fit"] = {one.name: getattr(self.fit, one.name) for one in self.fit.options()}
            # Named where it is not the default, so that what was done before the key was there stands.
            if not self.fit_report:
                told["fit"]["report"] = False
        if "diagnose" in self.steps:
            told["diagnose"] = {"withhold": list(self.withhold)}
        return told


def load_recipe(path: Path) -> Recipe:
    """Read a recipe.

    Raises
    ------
    FerryIdError
        For the first fault, with its line.
    """
    try:
        with path.open("rb") as file:
            text = file.read(LARGEST_BYTES).decode("utf-8")
        data = tomllib.loads(text)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise FerryIdError(f"{path}: cannot be read as a recipe, {reason}. Fix: give a TOML file") from error
    if deep := too_deep(data):
        raise FerryIdError(f"{path}: {deep}")
    return _Reader(path, text).recipe(data)


class _Reader:
    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._lines = key_lines(text)

    def recipe(self, data: Mapping[str, Any]) -> Recipe:
        self._known(data, (), ("steps", "model", "fit", "diagnose"))
        steps = self._texts(data, ("steps",), STEPS)
        for step in steps:
            if step not in STEPS:
                raise self._fault(
                    ("steps",),
                    f'there is no step "{step}".{did_you_mean(step, STEPS)} Fix: choose of {", ".join(STEPS)}',
                )
        if not steps:
            raise self._fault(("steps",), f"names no step. Fix: choose of {', '.join(STEPS)}")
        model = data.get("model", "")
        if not isinstance(model, str):
            raise self._fault(("model",), f'"model" is text, found {model!r}. Fix: write it in quotes')
        diagnose = self._section(data, "diagnose")
        self._known(diagnose, ("diagnose",), ("withhold", "versus"))
        withhold = self._texts(diagnose, ("diagnose", "withhold"), ())
        try:
            _check_withheld(withhold)
        except FerryIdError as error:
            raise self._fault(("diagnose", "withhold"), str(error)) from error
        versus = self._yes_or_no(diagnose, ("diagnose", "versus"))
        fit = dict(self._section(data, "fit"))
        fit_report = self._yes_or_no(fit, ("fit", "report"))
        fit.pop("report", None)
        chosen = tuple(step for step in STEPS if step in steps)
        return Recipe(chosen, model, self._fit(fit), fit_report, tuple(withhold), versus)

    def _fit(self, section: Mapping[str, Any]) -> FitSettings:
        kinds = {one.name: str(one.type).split(" | ") for one in FitSettings.options()}
        self._known(section, ("fit",), (*kinds, "report"))
        for name, value in section.items():
            allowed = [KINDS[kind] for kind in kinds[name] if kind in KINDS]
            types = tuple(one for _, types in allowed for one in types)
            if isinstance(value, bool) or not isinstance(value, types) or (types == (list,) and not _numbers(value)):
                wanted = " or ".join(words for words, _ in allowed)
                raise self._fault(("fit", name), f'"{name}" is {wanted}, found {value!r}. Fix: correct it')
        settings: dict[str, Any] = {name: tuple(one) if isinstance(one, list) else one for name, one in section.items()}
        try:
            return FitSettings(**settings)
        except FerryIdError as error:
            # Those that are of the wrong value are told by the names of their options.
            raise self._fault(("fit",), f"in [fit], {error}") from error

    def _section(self, data: Mapping[str, Any], name: str) -> Mapping[str, Any]:
        section = data.get(name, {})
        if not isinstance(section, dict):
            raise self._fault((name,), f'"{name}" is a section, found {section!r}. Fix: write [{name}] on a line')
        return section

    def _yes_or_no(self, section: Mapping[str, Any], place: KeyPath) -> bool:
        value = section.get(str(place[-1]), True)
        if not isinstance(value, bool):
            raise self._fault(place, f'"{place[-1]}" is true or false, found {value!r}. Fix: correct it')
        return value

    def _texts(self, data: Mapping[str, Any], place: KeyPath, default: tuple[str, ...]) -> tuple[str, ...]:
        value = data.get(str(place[-1]), default)
        if not isinstance(value, list | tuple) or not all(isinstance(one, str) for one in value):
            raise self._fault(place, f'"{place[-1]}" is a list of names, found {value!r}. Fix: write ["a", "b"]')
        return tuple(value)

    def _known(self, data: Mapping[str, Any], place: KeyPath, names: tuple[str, ...]) -> None:
        for name in data:
            if name not in names:
                where = f" in [{place[0]}]" if place else ""
                raise self._fault(
                    (*place, name),
                    f'a recipe has no "{name}"{where}.{did_you_mean(name, names)} Fix: choose of {", ".join(names)}',
                )

    def _fault(self, place: KeyPath, says: str) -> FerryIdError:
        return FerryIdError(f"{self._path}:{line_of(self._lines, place)}: {says}")


def _check_withheld(withhold: Sequence[str]) -> None:
    """Refuse what cannot be withheld.

    The diagnosis is loaded where there is something to look up: every process of a batch loads recipes.
    """
    if withhold:
        from ferryid.diagnose import check_withheld

        check_withheld(withhold)


def _numbers(values: Any) -> bool:
    return all(isinstance(one, int | float) and not isinstance(one, bool) for one in values)
