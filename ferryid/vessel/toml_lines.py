"""Where each key of a TOML file stands: the line numbers that `tomllib` does not keep."""

from __future__ import annotations

import re

KeyPath = tuple[str | int, ...]

DEEPEST = 30
"""Levels of tables and arrays in a file; no section has more than five."""

_PART = re.compile(r"""\s*(?:"((?:[^"\\]|\\.)*)"|'([^']*)'|([A-Za-z0-9_-]+))\s*(\.|\]|=|$)""")


def key_lines(text: str) -> dict[KeyPath, int]:
    """Map the path of every table and key of a valid TOML text to its line, counted from 1.

    Entries of an array of tables carry their index: ``("actuator", 0, "name")``. Keys inside an inline table are not
    listed; `line_of` gives them the line of the key that holds the table.
    """
    found: dict[KeyPath, int] = {(): 1}
    table: KeyPath = ()
    counts: dict[KeyPath, int] = {}
    closing = ""
    depth = 0
    for number, line in enumerate(text.splitlines(), start=1):
        if closing:
            if closing in line:
                closing = ""
            continue
        if depth > 0:
            depth += _bracket_balance(line)
            continue
        stripped = line.strip()
        if not stripped or stripped.startswith("#"):
            continue
        if stripped.startswith("["):
            array = stripped.startswith("[[")
            names, _ = _parts(stripped[2 if array else 1 :])
            table = _place(names, counts, array)
            for end in range(1, len(table) + 1):
                found.setdefault(table[:end], number)
            continue
        keys, value = _parts(stripped)
        for end in range(1, len(keys) + 1):
            found.setdefault((*table, *keys[:end]), number)
        for quote in ('"""', "'''"):
            if value.count(quote) == 1:
                closing = quote
        if not closing:
            depth = _bracket_balance(value)
    return found


def too_deep(data: object) -> str:
    """Return what is wrong with TOML data whose tables or arrays hold each other too often to be walked through, or "".

    Thousands of levels would end in an error of Python.
    """
    level = [data]
    for _ in range(DEEPEST):
        level = [
            value
            for one in level
            if isinstance(one, dict | list)
            for value in (one.values() if isinstance(one, dict) else one)
        ]
    if not level:
        return ""
    return f"tables or arrays hold each other {DEEPEST} deep or more. Fix: write fewer brackets, or points in a key"


def line_of(lines: dict[KeyPath, int], path: KeyPath) -> int:
    """Return the line of `path`, or of the nearest table or key that holds it."""
    for end in range(len(path), -1, -1):
        if path[:end] in lines:
            return lines[path[:end]]
    return 1


def _parts(text: str) -> tuple[tuple[str, ...], str]:
    """Split a dotted key, as far as its ``=`` or ``]``, and return what follows."""
    parts: list[str] = []
    position = 0
    while match := _PART.match(text, position):
        parts.append(next(group for group in match.groups()[:3] if group is not None))
        position = match.end()
        if match.group(4) != ".":
            break
    return tuple(parts), text[position:]


def _place(names: tuple[str, ...], counts: dict[KeyPath, int], array: bool) -> KeyPath:
    """Turn a table header into a path with the index of each array of tables on its way."""
    path: KeyPath = ()
    for position, name in enumerate(names):
        path = (*path, name)
        if array and position == len(names) - 1:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = (*path, counts[path])
    return path


def _bracket_balance(text: str) -> int:
    """Count brackets opened less closed, outside strings and before a comment."""
    balance = 0
    quote = ""
    escaped = False
    for character in text:
        if quote:
            if character == quote and not escaped:
                quote = ""
            escaped = character == "\\" and quote == '"' and not escaped
        elif character in "\"'":
            quote = character
        elif character == "#":
            break
        elif character in "[{":
            balance += 1
        elif character in "]}":
            balance -= 1
    return balance
