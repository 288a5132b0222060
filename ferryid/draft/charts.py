"""In which frame a position in metres is, where the log has a latitude and a longitude, too."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

from ferryid.draft.agreement import explained
from ferryid.draft.fields import FieldGroup
from ferryid.draft.samples import Samples, metres
from ferryid.draft.thresholds import DRAFT


def with_geodetic(
    groups: Sequence[FieldGroup], samples: Samples, without: Set[FieldGroup]
) -> tuple[list[FieldGroup], dict[str, tuple[str, ...]]]:
    """Return groups, positions in metres with the frame that a latitude and a longitude show, and evidence by their labels.

    `without` has positions that no sensor measured. A chart whose axes are turned against north agrees in neither frame.
    """
    known = [one for one in groups if one.kind == "position" and one.form == "geodetic" and one not in without]
    seen: dict[str, tuple[str, ...]] = {}
    framed = []
    for one in groups:
        if one.kind == "position" and not one.form and not one.frame:
            for other in known:
                if frame := _frame_on_chart(one, other, samples):
                    name, share = frame
                    one = replace(one, frame=name)
                    seen[one.label] = (
                        f"in {name}, as north and east of {other.label} explain {100 * share:.0f} % of its slope",
                    )
                    break
        framed.append(one)
    return framed, seen


def _frame_on_chart(position: FieldGroup, geodetic: FieldGroup, samples: Samples) -> tuple[str, float] | None:
    """Return the frame in which a position agrees with a latitude and a longitude, and the share; None where not one does."""
    first, second = (
        samples.slope(samples.on_grid(position.topic, samples.raw(position.topic, path)), position.topic)
        for path in position.fields
    )
    north, east = (
        samples.slope(samples.on_grid(geodetic.topic, one), geodetic.topic)
        for one in metres(samples, geodetic.topic, geodetic.fields)
    )
    shares = {"NED": explained(first, second, north, east)[0], "ENU": explained(first, second, east, north)[0]}
    best, other = sorted(shares, key=lambda name: -shares[name])
    if shares[best] < DRAFT.agrees or shares[best] <= shares[other] + DRAFT.even:
        return None
    return best, shares[best]
