"""Reading a profile's tables key by key, noting a fault with its line for whatever does not fit."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from ferryid.counts import counted
from ferryid.errors import did_you_mean, one_line
from ferryid.vessel.toml_lines import KeyPath, line_of

LARGEST = 1e15
"""No quantity of a vessel in SI units is larger; products of a few such numbers stay within a float."""
_SMALLEST = 1e-12
"""A quantity that must be above zero and is smaller is a mistake."""


@dataclass(frozen=True)
class Fault:
    """One fault of a profile: the line it stands on, what is wrong and how to put it right.

    A `warning` does not keep the profile from being used.
    """

    line: int
    message: str
    warning: bool = False


class TableReader:
    """Take the keys of one TOML table by type, and report the keys that nobody took.

    Parameters
    ----------
    data
        The table.
    path
        Where it stands in the file.
    lines
        Lines of every key, from `key_lines`.
    faults
        Shared list to which faults are added.
    """

    def __init__(self, data: Mapping[str, Any], path: KeyPath, lines: dict[KeyPath, int], faults: list[Fault]) -> None:
        self.data = data
        self.path = path
        self._lines = lines
        self._faults = faults
        self._known: set[str] = set()

    @property
    def title(self) -> str:
        """The table's name as a header of the file shows it."""
        names = [str(part) for part in self.path if isinstance(part, str)]
        return "[" + ".".join(f'"{name}"' if "." in name else name for name in names) + "]"

    def line(self, key: str | None = None) -> int:
        """Return the line of a key, or of the table itself."""
        return line_of(self._lines, self.path if key is None else (*self.path, key))

    def fault(self, message: str, key: str | None = None, *, warning: bool = False) -> None:
        """Note a fault at `key`, or at the table's own line."""
        self._faults.append(Fault(self.line(key), one_line(message), warning))

    def has(self, key: str) -> bool:
        """Tell whether the file gives `key`."""
        self._known.add(key)
        return key in self.data

    def tables(self, key: str) -> list[TableReader]:
        """Return the readers of an array of tables."""
        value = self._take(key, required=False)
        if value is None:
            return []
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            self.fault(f'"{key}" must be an array of tables. Fix: head each entry with [[{key}]]', key)
            return []
        return [
            TableReader(entry, (*self.path, key, index), self._lines, self._faults) for index, entry in enumerate(value)
        ]

    def table(self, key: str, *, required: bool = False, needs: str = "") -> TableReader | None:
        """Return the reader of a table inside this one, or None."""
        value = self._take(key, required=required, needs=needs)
        if value is None:
            return None
        if not isinstance(value, dict):
            self.fault(f'"{key}" must be a table, found {_kind(value)}. Fix: {key} = {{ ... }}', key)
            return None
        return TableReader(value, (*self.path, key), self._lines, self._faults)

    def text(self, key: str, default: str = "", *, required: bool = False, options: Collection[str] = ()) -> str:
        """Return a string, one of `options` where there are any."""
        value = self._take(key, required=required)
        if value is None:
            return default
        if not isinstance(value, str):
            self.fault(f'"{key}" must be a string, found {_kind(value)}. Fix: put it in quotes', key)
            return default
        if options and value not in options:
            hint = did_you_mean(value, options)
            self.fault(f'"{key}" cannot be "{value}".{hint} Fix: use one of {", ".join(sorted(options))}', key)
            return default
        return value

    def texts(self, key: str, count: int | None = None, *, required: bool = False) -> tuple[str, ...]:
        """Return an array of strings, of `count` entries where that is given."""
        value = self._take(key, required=required)
        if value is None:
            return ()
        if not isinstance(value, list) or not all(isinstance(entry, str) for entry in value):
            self.fault(f'"{key}" must be an array of strings, found {_kind(value)}. Fix: {key} = ["a", "b"]', key)
            return ()
        if count is not None and len(value) != count:
            self.fault(f'"{key}" must name {counted(count, "field")}, found {len(value)}. Fix: name {count}', key)
            return ()
        return tuple(value)

    def number(
        self,
        key: str,
        default: float = math.nan,
        *,
        required: bool = False,
        above: float = -math.inf,
        at_least: float = -math.inf,
        at_most: float = math.inf,
        within: float = LARGEST,
        needs: str = "",
    ) -> float:
        """Return a finite number within its limits; the default where it is missing or does not fit.

        `within` is the largest size that is plausible on any vessel.
        """
        value = self._take(key, required=required, needs=needs)
        if value is None:
            return default
        if not _is_number(value):
            self.fault(f'"{key}" must be a number, found {_kind(value)}. Fix: write a number without quotes', key)
            return default
        if not math.isfinite(value) or value <= above or value < at_least or value > at_most:
            limits = [f"above {above:g}"] if math.isfinite(above) else []
            limits += [f"at least {at_least:g}"] if math.isfinite(at_least) and not limits else []
            limits += [f"at most {at_most:g}"] if math.isfinite(at_most) else []
            limit = " and ".join(limits) or "finite"
            self.fault(f'"{key}" must be {limit}, found {value:g}. Fix: give a number that is {limit}', key)
            return default
        return float(value) if self._is_plausible(key, value, within, positive=above >= 0.0) else default

    def numbers(
        self, key: str, count: int | None = None, *, required: bool = False, within: float = LARGEST
    ) -> tuple[float, ...]:
        """Return an array of finite numbers, of `count` entries where that is given."""
        value = self._take(key, required=required)
        if value is None:
            return ()
        if not isinstance(value, list) or not all(_is_number(entry) and math.isfinite(entry) for entry in value):
            self.fault(
                f'"{key}" must be an array of finite numbers, found {_kind(value)}. Fix: {key} = [1.0, 2.0]', key
            )
            return ()
        if count is None and not value:
            self.fault(f'"{key}" is an empty array. Fix: {key} = [1.0, 2.0]', key)
            return ()
        if count is not None and len(value) != count:
            self.fault(f'"{key}" must hold {counted(count, "number")}, found {len(value)}. Fix: give {count}', key)
            return ()
        if not all(self._is_plausible(key, entry, within) for entry in value):
            return ()
        return tuple(float(entry) for entry in value)

    def _is_plausible(self, key: str, value: float, within: float, *, positive: bool = False) -> bool:
        """Tell whether a number can be a vessel's, and note a fault where it cannot."""
        if abs(value) <= within and not (positive and value < _SMALLEST):
            return True
        limit = f"at most {within:g} in size" if abs(value) > within else f"at least {_SMALLEST:g}"
        self.fault(
            f'"{key}" = {value:g} is not plausible for any vessel, it must be {limit}. '
            "Fix: correct the number or convert its unit",
            key,
        )
        return False

    def whole(self, key: str, default: int, *, at_least: int = 0, at_most: int = 2**63 - 1) -> int:
        """Return a whole number."""
        value = self._take(key, required=False)
        if value is None:
            return default
        if not isinstance(value, int) or isinstance(value, bool) or not at_least <= value <= at_most:
            limit = f" and at most {at_most}" if at_most < 2**63 - 1 else ""
            self.fault(
                f'"{key}" must be a whole number of at least {at_least}{limit}, found {value!r:.40}. Fix: give one', key
            )
            return default
        return value

    def flag(self, key: str, default: bool) -> bool:
        """Return true or false."""
        value = self._take(key, required=False)
        if value is None:
            return default
        if not isinstance(value, bool):
            self.fault(f'"{key}" must be true or false, found {_kind(value)}. Fix: {key} = true', key)
            return default
        return value

    def close(self, elsewhere: Mapping[str, str] | None = None) -> None:
        """Note every key that nothing asked for; `elsewhere` are keys that belong in another table, with its title."""
        for key in self.data:
            if key not in self._known:
                where = f"in {self.title}" if self.path else "at the top of the file"
                if elsewhere and key in elsewhere:
                    self.fault(f'"{key}" cannot be {where}. Fix: move it to {elsewhere[key]}', key)
                    continue
                hint = did_you_mean(key, self._known - set(self.data))
                names = ", ".join(sorted(self._known))
                self.fault(f'unknown key "{key}" {where}.{hint} Fix: use one of {names}', key)

    def _take(self, key: str, *, required: bool, needs: str = "") -> Any:
        self._known.add(key)
        value = self.data.get(key)
        if value is None and required:
            where = f"{self.title} lacks" if self.path else "the file lacks"
            self.fault(f'{where} "{key}"' + (f", {needs}" if needs else "") + f". Fix: add {key} = ...")
        return value


def _is_number(value: object) -> bool:
    """Tell whether a value is a number that a float can hold; TOML's whole numbers have no end."""
    return isinstance(value, float) or (type(value) is int and abs(value) < 2**63)


def _kind(value: object) -> str:
    names = {bool: "true/false", str: "a string", int: "a number", float: "a number", dict: "a table"}
    if type(value) is int and not _is_number(value):
        return "one of more than 63 bits"
    if isinstance(value, list):
        return "an array of " + (", ".join(sorted({_kind(entry) for entry in value})) or "nothing")
    return names.get(type(value), f"a {type(value).__name__}")
