"""Signals in arrays of a message whose entries have names, such as ``name[]`` and ``position[]`` of a joint state."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from ferryid.errors import did_you_mean
from ferryid.ingest.log import Series, Topic
from ferryid.vessel.profile import Element, Signal

TEXT_TYPES = frozenset({"string", "wstring", "str", "object", "large_string", "utf8", "datetime"})
MOST_ELEMENTS = 32
"""Entries of such an array that are looked at."""


def indexed(path: str, index: int) -> str:
    """Return the path of one entry of an array that is written ``position[]``."""
    return path.replace("[]", f"[{index}]", 1)


def entries_of(path: str, topic: Topic) -> int:
    """Return how many entries of an array can be asked for: all of a fixed one, `MOST_ELEMENTS` of a sequence, 0 of none."""
    if path in topic.fields:
        return MOST_ELEMENTS
    if topic.lists_elements:
        listed = (indexed(path, index) in topic.fields for index in range(MOST_ELEMENTS))
        return next((index for index, there in enumerate(listed) if not there), MOST_ELEMENTS)
    for known in topic.fields:
        if re.sub(r"\[[0-9]+\]", "[]", known, count=1) == path:
            fixed = re.search(r"\[([0-9]+)\]", known)
            return min(int(fixed[1]), MOST_ELEMENTS) if fixed else 0
    return 0


def element_fields(signal: Signal, topic: Topic) -> tuple[str, ...]:
    """Return the paths of a signal in an array of a topic: names and values of every entry."""
    if signal.element is None:
        return ()
    paths = (signal.element[0], *signal.fields)
    count = min(entries_of(path, topic) for path in paths)
    return tuple(indexed(path, index) for index in range(count) for path in paths)


def array_fault(signal: Signal, topic: Topic) -> str:
    """Return why a signal in an array cannot be read of a topic, or an empty string."""
    if signal.element is None:
        return ""
    arrays = [known for known in topic.fields if "[" in known]
    for path in (signal.element[0], *signal.fields):
        if not entries_of(path, topic):
            shown = ", ".join(arrays[:6]) or "no array"
            return f'found no array "{path}" in {topic.name} (it has {shown}).{did_you_mean(path, arrays)}'
    for path in signal.fields:
        bare = path.partition("[")[0]
        kind = next((kind for known, kind in topic.fields.items() if known.partition("[")[0] == bare), "")
        if kind in TEXT_TYPES and "." not in path:
            return f'found text ("{kind}") in {path} of {topic.name}, where a number is needed'
    return ""


def has_element(signal: Signal, columns: Mapping[str, object]) -> bool:
    """Tell whether the columns of a topic are those of a signal in an array."""
    if signal.element is None:
        return False
    return all(indexed(path, 0) in columns for path in (signal.element[0], *signal.fields))


def picked(signal: Signal, element: Element, series: Series) -> Series:
    """Return a series whose columns are the signal's fields, each taken from the entry of its name.

    Parameters
    ----------
    signal
        Signal in an array.
    element
        Its `element`: the array of names, and the name.
    series
        With the columns of `element_fields`, n messages; one without such an entry has NaN, shape (n,).
    """
    names, wanted = element
    columns = {path: np.full(len(series.receive_ns), np.nan) for path in signal.fields}
    for index in range(MOST_ELEMENTS):
        known = series.columns.get(indexed(names, index))
        if known is None:
            break
        here = np.asarray(known == wanted, bool)
        for path, values in columns.items():
            entry = series.columns[indexed(path, index)]
            if here.any() and entry.dtype.kind in "fiub":
                values[here] = entry[here]
    return Series(series.topic, series.receive_ns, series.stamp_ns, columns)
