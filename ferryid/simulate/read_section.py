"""Reading one section of a scenario file into its dataclass, by what the dataclass says of its fields."""

from __future__ import annotations

from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from ferryid.simulate.sections import Gains
from ferryid.vessel.faults import TableReader

Section = TypeVar("Section")

FLATTENED = (Gains,)
"""Sections whose keys stand in the table that holds them, without a header of their own."""
MOST_ENTRIES = 100
"""Most tables of one array; as many numbers of one array without a fixed length."""
MOST_WHOLE = 1000


def section(parent: TableReader, key: str) -> TableReader:
    """Return a table that may be left out, as an empty one then."""
    table = parent.table(key)
    return TableReader({}, (*parent.path, key), {}, []) if table is None else table


def read_section(table: TableReader, kind: type[Section], *, close: bool = True) -> Section:
    """Read one table into its dataclass; a fault is noted for whatever does not fit, and the default taken.

    Fields are numbers, whole numbers, words, numbers of a fixed or any count, another section (a table inside this one)
    or a tuple of sections (an array of tables). Metadata hold the limits (``low``,
    ``high``, and ``least`` above ``low`` itself) and a word's ``options``.

    Parameters
    ----------
    table
        The table, empty where the file leaves it out.
    kind
        A dataclass of `ferryid.simulate.sections`.
    close
        True notes the keys that no field has.
    """
    hints = get_type_hints(kind)
    values = {entry.name: _value(table, entry, hints[entry.name]) for entry in fields(kind)}  # type: ignore[arg-type]
    if close:
        table.close()
    return kind(**values)


def _value(table: TableReader, entry: Field[Any], hint: Any) -> Any:
    key, default = entry.name, entry.default
    low, high = entry.metadata.get("low", -1e6), entry.metadata.get("high", 1e6)
    parts = get_args(hint)
    if isinstance(hint, type) and is_dataclass(hint):
        if hint in FLATTENED:
            return read_section(table, hint, close=False)
        return read_section(section(table, key), hint)
    if get_origin(hint) is tuple and isinstance(parts[0], type) and is_dataclass(parts[0]):
        return _entries(table, key, parts[0])
    assert default is not MISSING, f"{entry.name} has no default"
    if get_origin(hint) is tuple:
        return _numbers(table, key, default, None if Ellipsis in parts else len(parts), (low, high))
    if hint is str:
        return table.text(key, default, options=entry.metadata.get("options", ()))
    if hint is int:
        return _whole(
            table, key, default, int(entry.metadata.get("low", 1)), int(entry.metadata.get("high", MOST_WHOLE))
        )
    assert hint is float, f"no reader for {hint}"
    value = table.number(key, default, at_least=low, at_most=high)
    least = entry.metadata.get("least", low)
    if low < value < least:
        table.fault(f'"{key}" must be {low:g}, or at least {least:g}, found {value:g}. Fix: give one of these', key)
        return default
    return value


def _whole(table: TableReader, key: str, default: int, low: int, high: int) -> int:
    value = table.whole(key, default, at_least=low)
    if value > high:
        table.fault(f'"{key}" must be at most {high}, found {value}. Fix: give a smaller one', key)
        return default
    return value


def _numbers(
    table: TableReader, key: str, default: tuple[float, ...], count: int | None, limits: tuple[float, float]
) -> tuple[float, ...]:
    """Read numbers, all between the limits, as many as asked for or at least one."""
    given = table.numbers(key, count)
    if not given:
        return default
    if not all(limits[0] <= value <= limits[1] for value in given):
        wrong = next(value for value in given if not limits[0] <= value <= limits[1])
        table.fault(
            f'"{key}" must hold numbers of at least {limits[0]:g} and at most {limits[1]:g}, found {wrong:g}. '
            "Fix: keep to these limits",
            key,
        )
        return default
    if len(given) > MOST_ENTRIES:
        table.fault(f'"{key}" must hold at most {MOST_ENTRIES} numbers, found {len(given)}. Fix: fewer', key)
        return default
    return given


def _entries(table: TableReader, key: str, kind: type[Any]) -> tuple[Any, ...]:
    """Read an array of tables."""
    header = f"[[{'.'.join((*map(str, table.path), key))}]]"
    value = table.data.get(key) if table.has(key) else []
    if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
        table.fault(f'"{key}" must be an array of tables. Fix: head each entry with {header}', key)
        return ()
    if len(value) > MOST_ENTRIES:
        table.fault(f"there must be at most {MOST_ENTRIES} entries of {header}, found {len(value)}. Fix: fewer", key)
        return ()
    return tuple(read_section(entry, kind) for entry in table.tables(key))
