"""One case of the proof: what is concealed in a trial, and everything else that was drawn for it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

FORMATS = ("mcap", "ros1", "ros2")
"""Kinds of logs, which take turns."""


@dataclass(frozen=True)
class Truth:
    """An effect that is in the log.

    Attributes
    ----------
    effect, instance
        Effect id and thruster, as a finding has them; None where it is one of the whole vessel.
    values
        Parameters by name, in the units of the effect.
    onset_s, offset_s
        When it begins and ends [s since the log's start]; None where it acts from the start, or to the end.
    """

    effect: str
    instance: str | None
    values: Mapping[str, float]
    onset_s: float | None = None
    offset_s: float | None = None

    @property
    def key(self) -> tuple[str, str | None]:
        """Effect and instance."""
        return self.effect, self.instance


@dataclass(frozen=True)
class Case:
    """All that was drawn for one trial.

    Attributes
    ----------
    name
        Number of the case, and name of its folder: all that the diagnosis sees of this.
    cell, kind
        Which cell of the proof it is a run of, such as ``wind``, and which kind of cell, such as ``single``.
    vessel, path, format
        Which vessel of `ferryid.prove.plant`, where it goes, and one of `FORMATS`.
    seed
        Of noise and weather.
    level
        Which of the sizes of a detection curve, from 0 (invisible) on; None in other cells.
    size
        How large the effect is, in its moderate size; NaN-free: 0 where nothing is concealed.
    truths
        What ought to be named.
    allowed
        Names that are not wrong, though they are not what is in the log either: effect ids.
    knobs
        What is concealed and the weather over it, as the plant takes it.
    """

    name: str
    cell: str
    kind: str
    vessel: str
    path: str
    format: str
    seed: int
    level: int | None = None
    size: float = 0.0
    truths: tuple[Truth, ...] = ()
    allowed: tuple[str, ...] = ()
    knobs: Mapping[str, Any] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return it as plain data, of which `case_of` makes it again."""
        return dict(json.loads(json.dumps(asdict(self))))


def case_of(plain: Mapping[str, Any]) -> Case:
    """Return a case from plain data."""
    truths = tuple(Truth(**one) for one in plain["truths"])
    return Case(**{**plain, "truths": truths, "allowed": tuple(plain["allowed"])})


def vectors(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Return the names of parameters, those that are one vector together."""
    left, found = list(names), []
    while left:
        vector = next((v for v in VECTORS if left[0] in v), (left[0],))
        together = tuple(name for name in vector if name in left)
        found.append(together)
        left = [name for name in left if name not in together]
    return found


VECTORS = (("north", "east"), ("surge", "sway", "yaw"), ("stiffness_north", "stiffness_east"))
"""Parameters that belong together: sizes and errors are those of the vector."""
