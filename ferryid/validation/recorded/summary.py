"""What a run on one recording says of its effects on the console: from what size on each was named."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import takewhile
from typing import Any

from ferryid.counts import counted
from ferryid.validation.recorded.effects import concealments


def size_lines(responses: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return from what size on each effect was named, a line each, where all was concealed in one recording."""
    if len({one["recording"] for one in responses}) != 1:
        return []
    known = concealments()
    lines = list[str]()
    for one in responses:
        tried = sorted(zip(one["sizes"], one["named"], strict=True))
        unit = known[one["effect"]].unit
        if not tried:
            lines.append(f"  {one['effect']}: the recording as it was has this name")
            continue
        # The largest sizes without a miss among them.
        named = list(takewhile(lambda each: each[1], reversed(tried)))
        found = f"named from {named[-1][0]:.3g} {unit} on" if named else "not named at the largest size"
        lines.append(
            f"  {one['effect']}: {found}; {sum(one['named'])} of {counted(len(tried), 'size')} from {tried[0][0]:.3g} to "
            f"{tried[-1][0]:.3g} {unit} named"
        )
    return lines
