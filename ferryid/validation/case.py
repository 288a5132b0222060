"""One case: what is injected into a simulated trial, and everything else that was drawn for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ferryid.json_record import Record

FORMATS = ("mcap", "ros1", "ros2")
"""Log formats, which take turns."""
VECTORS = (("north", "east"), ("surge", "sway", "yaw"), ("stiffness_north", "stiffness_east"))
"""Parameters that are components of one vector: sizes and errors are those of the vector."""


@dataclass(frozen=True)
class Truth(Record):
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
class Case(Record):
    """All that was drawn for one trial.

    Attributes
    ----------
    name
        Number of the case, and name of its folder: all that the diagnosis sees of this.
    cell, kind
        Which cell of the test matrix it is a run of, such as ``wind``, and which kind of cell, such as ``single``.
    vessel, path, format
        Which vessel of `ferryid.validation.plant`, where it goes, and one of `FORMATS`.
    seed
        Of noise and weather.
    level
        Which of the sizes of a detection curve, from 0 (invisible) on; None in other cells.
    size
        How large the effect is; 0 where nothing is injected.
    truths
        What ought to be named.
    allowed
        Effect ids that do not count as wrong, though they are not in the log either.
    conditions
        Settings of the plant, those of its effects and of the weather.
    hull_factors
        What the coefficients of the profile's hull are multiplied by.
    omitted_terms
        Coefficients that the profile's hull lacks.
    thruster_shift
        By how many lengths the profile has the first thruster too far forward.
    oracle_size
        Size that an oracle sees, of which `size` is a multiple; 0 where that is not known before the diagnosis.
    distinct_size
        Size from which one could name it who is not told which effect it is, nor the form of a hull that nobody modelled; 0
        where that is not known.
    logs
        How many logs there are, which are a campaign where there are several.
    first_log
        Number of the log of a campaign from which on the first of `truths` acts.
    before
        How many further logs there are that these are compared with, in which nothing of `truths` acts.
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
    conditions: Mapping[str, Any] = field(default_factory=dict)
    hull_factors: Mapping[str, float] = field(default_factory=dict)
    omitted_terms: tuple[str, ...] = ()
    thruster_shift: float = 0.0
    oracle_size: float = 0.0
    distinct_size: float = 0.0
    logs: int = 1
    first_log: int = 0
    before: int = 0


def parameter_vectors(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Return the names of parameters, the components of one vector together."""
    left, found = list(names), []
    while left:
        vector = next((v for v in VECTORS if left[0] in v), (left[0],))
        together = tuple(name for name in vector if name in left)
        found.append(together)
        left = [name for name in left if name not in together]
    return found
