"""Doses by the oracle's size: how often an effect is named at half of it, at it, at twice, four and eight times."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ferryid.json_record import Record
from ferryid.validation.detection_curves import Curve, curve
from ferryid.validation.name_scores import Share
from ferryid.validation.recorded.case_sampling import MULTIPLES, TWICE

RELATIVE_STEP = 2.0
"""From one of the multiples to the next, as a factor."""


@dataclass(frozen=True)
class Doses(Record):
    """Doses of one effect, or of several, in all recordings together.

    Attributes
    ----------
    effect
        Effect id, or a family.
    multiples, named, noticed
        Of every case: its size over the oracle's, whether it was named, and whether it was named or a new hint.
    """

    effect: str
    multiples: tuple[float, ...]
    named: tuple[bool, ...]
    noticed: tuple[bool, ...]

    @property
    def curve(self) -> Curve:
        """Detection curve over the multiples."""
        return curve(self.multiples, self.named)

    @property
    def noticed_curve(self) -> Curve:
        """The same of names and new hints."""
        return curve(self.multiples, self.noticed)

    def at(self, level: int, *, noticed: bool = False) -> Share:
        """Return the share that was named from one of `MULTIPLES` to the next."""
        least = MULTIPLES[level] * (1.0 - 1e-9)
        flags = [
            flag
            for multiple, flag in zip(self.multiples, self.noticed if noticed else self.named, strict=True)
            if least <= multiple < RELATIVE_STEP * least
        ]
        return Share(sum(flags), len(flags))

    @property
    def at_twice(self) -> Share:
        """Share that was named at twice the oracle's size."""
        return self.at(TWICE)


def joined(effect: str, some: Iterable[Doses]) -> Doses:
    """Return several as one."""
    every = list(some)
    return Doses(
        effect,
        tuple(one for each in every for one in each.multiples),
        tuple(one for each in every for one in each.named),
        tuple(one for each in every for one in each.noticed),
    )


def pooled(every: Sequence[Doses]) -> tuple[Doses, ...]:
    """Return doses effect by effect, in the order of their first; effects without a dose are left out."""
    names = dict.fromkeys(one.effect for one in every if one.multiples)
    return tuple(joined(name, [one for one in every if one.effect == name]) for name in names)
