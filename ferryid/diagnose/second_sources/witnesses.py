"""Which of several sensors of one quantity is the odd one out: two that agree with each other against a third."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import hypot

from ferryid.diagnose.second_sources.comparison import Comparison
from ferryid.diagnose.second_sources.thresholds import SECOND

WORDS = {"scale": "factor", "delay": "delay", "bias": "bias", "sign": "sign"}
QUANTITIES = {"yaw_rate": "yaw rate", "heading": "heading", "velocity": "velocity", "position": "position"}


@dataclass(frozen=True)
class Witness:
    """A sensor that disagrees with two others which agree with each other.

    Attributes
    ----------
    quantity, what
        Of what, and in what: ``"scale"``, ``"delay"``, ``"bias"`` or ``"sign"``.
    odd
        The sensor that disagrees; empty for the mapped one.
    agreeing
        The others.
    says
        One sentence.
    """

    quantity: str
    what: str
    odd: str
    agreeing: tuple[str, ...]
    says: str


def independent(compared: Sequence[Comparison], senders: Mapping[str, int]) -> list[Comparison]:
    """Return comparisons of which no two come from one sender, and none repeats the mapped signal."""
    found, seen = [], set[tuple[str, int]]()
    for one in compared:
        key = (one.kind, senders.get(one.candidate.topic, -1))
        if one.follows and not one.same and (key[1] < 0 or key not in seen):
            seen.add(key)
            found.append(one)
    return found


def witnesses(compared: Sequence[Comparison], senders: Mapping[str, int]) -> tuple[Witness, ...]:
    """Name the sensor that disagrees with two others, by quantity and by what it disagrees in.

    Parameters
    ----------
    compared
        Signals against the mapped one.
    senders
        Number of the sender of a topic, where topics have one; its signals count once.
    """
    found = []
    for kind, name in QUANTITIES.items():
        of_kind = [one for one in independent(compared, senders) if one.kind == kind]
        for what in WORDS:
            witness = _witness(name, what, [one for one in of_kind if what in one.estimates])
            if witness is not None:
                found.append(witness)
    return tuple(found)


def _witness(name: str, what: str, sources: Sequence[Comparison]) -> Witness | None:
    off = [one for one in sources if _differs(one, what)]
    for one, other in combinations(off, 2):
        if _alike(one, other, what):
            pair = (one.candidate.label, other.candidate.label)
            says = (
                f"The mapped {name} disagrees with two others that agree with each other in {WORDS[what]}: {pair[0]} "
                f"({_phrase(one, what)}) and {pair[1]} ({_phrase(other, what)})."
            )
            return Witness(name, what, "", pair, says)
    within = [one for one in sources if one not in off]
    if len(off) == 1 and within:
        odd = off[0]
        agreeing = tuple(one.candidate.label for one in within if not _alike(one, odd, what))
        if agreeing:
            says = (
                f"{odd.candidate.label} is the odd one in {WORDS[what]} of the {name} ({_phrase(odd, what)}): the mapped one "
                f"agrees with {agreeing[0]}."
            )
            return Witness(name, what, odd.candidate.label, agreeing, says)
    return None


def _names(what: str) -> tuple[str, ...]:
    return ("delay", "lag") if what == "delay" else (what,)


def _differs(one: Comparison, what: str) -> bool:
    return any(difference.what in _names(what) for difference in one.differences)


def _phrase(one: Comparison, what: str) -> str:
    return next((difference.says for difference in one.differences if difference.what in _names(what)), "")


def _alike(one: Comparison, other: Comparison, what: str) -> bool:
    """Return whether two sensors have the same difference to the mapped one, to within errors or a part of it."""
    (a, error_a), (b, error_b) = one.estimates[what], other.estimates[what]
    neutral = 1.0 if what in ("scale", "sign") else 0.0
    return abs(a - b) <= max(
        SECOND.alike_errors * hypot(error_a, error_b), SECOND.alike_share * min(abs(a - neutral), abs(b - neutral))
    )
