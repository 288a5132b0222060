"""Wind of a log: its fields by their names, and whether it is felt on board or true, by which is steadier."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ferryid.draft.fields import ORDERS, numeric_fields
from ferryid.draft.mapped import MappedSignal, Motion
from ferryid.draft.samples import Samples
from ferryid.draft.thresholds import DRAFT
from ferryid.ingest.log import Topic
from ferryid.types import Floats
from ferryid.vessel.field_words import unit_of_name, words_of

_SPEED = {"speed", "velo", "velocity", "spd", "aws", "tws"}
_DIRECTION = {"direction", "dir", "angle", "awa", "twa", "twd", "from"}
_FELT = {"relative", "apparent", "rel", "app", "aws", "awa"}
_TRUE = {"true", "tws", "twa", "twd", "abs", "absolute"}

Pair = tuple[str, str, str]
"""Topic, field of the speed, field of the direction."""


def wind_fields(topics: Sequence[Topic]) -> list[Pair]:
    """Return pairs of speed and direction of a wind, those felt on board first."""
    found: list[tuple[bool, Pair]] = []
    for topic in topics:
        around = set(words_of(topic.name)) if topic.name != "table" else set[str]()
        fields = {path: set(words) | around for path, words in numeric_fields(topic).items()}
        about = {path: words for path, words in fields.items() if "wind" in words and not words & ORDERS}
        for felt in (True, False):
            chosen = [path for path, words in about.items() if bool(words & _TRUE) != felt]
            speed = next((path for path in chosen if set(words_of(path)) & _SPEED), None)
            direction = next((path for path in chosen if set(words_of(path)) & _DIRECTION), None)
            if topic.count > 1 and speed is not None and direction is not None:
                found.append((felt, (topic.name, speed, direction)))
    return [pair for _, pair in sorted(found, key=lambda one: not one[0])]


def wind_signal(pairs: Sequence[Pair], samples: Samples, motion: Motion) -> MappedSignal | None:
    """Return the wind as a profile maps it; None where there is none."""
    pairs = [pair for pair in pairs if samples.has(pair[0], pair[1:2])]
    if not pairs:
        return None
    topic, speed, direction = pairs[0]
    words = {*words_of(topic), *words_of(speed), *words_of(direction)}
    values = samples.raw(topic, direction)
    stated = unit_of_name(direction, "angle")
    unit = stated or ("deg" if float(np.nanquantile(np.abs(values), 0.99)) > DRAFT.most_rad else "rad")
    options = {"bow, apparent": ("bow", "apparent"), "bow, true": ("bow", "true"), "north, true": ("north", "true")}
    spread = _spreads(samples, motion, topic, speed, values, unit)
    named = "apparent" if words & _FELT else "true" if words & _TRUE else ""
    usable = {name: size for name, size in spread.items() if named in name}
    best = min(usable, key=lambda one: usable[one]) if usable else "bow, apparent" if named != "true" else "bow, true"
    # What names do not state, the steadier wind does, if by much.
    if not named and spread and usable[best] > 0.9 * spread.get("bow, apparent", math.inf):
        best = "bow, apparent"
    reference, air = options[best]
    shown = ", ".join(f"{name} {size:.2f}" for name, size in sorted(spread.items(), key=lambda one: one[1]))
    evidence = (
        f"{'by its name' if named else 'as the steadier'}; spread of the wind over ground [m/s]: {shown or 'not known'}"
    )
    return MappedSignal(
        "wind",
        topic,
        (speed, direction),
        unit_of_name(speed, "speed") or "m/s",
        evidence=(evidence,),
        doubts=("the direction is taken to be where the wind comes from, clockwise",),
        options=(("direction_unit", unit), ("reference", reference), ("air", air)),
    )


def _spreads(samples: Samples, motion: Motion, topic: str, speed: str, values: Floats, unit: str) -> dict[str, float]:
    """Return how much the wind over ground would change, by what the direction refers to and whether it is felt [m/s]."""
    turn, psi = np.pi / 180.0 if unit == "deg" else 1.0, motion.psi
    strength = samples.on_grid(topic, samples.raw(topic, speed))
    from_rad = samples.on_grid(topic, values, held=True) * turn
    found = {}
    for name, bearing, felt in (
        ("bow, apparent", from_rad + psi, True),
        ("bow, true", from_rad + psi, False),
        ("north, true", from_rad, False),
    ):
        north, east = -strength * np.cos(bearing), -strength * np.sin(bearing)
        if felt:
            north = north + motion.u * np.cos(psi) - motion.v * np.sin(psi)
            east = east + motion.u * np.sin(psi) + motion.v * np.cos(psi)
        known = np.isfinite(north + east)
        if np.count_nonzero(known) > DRAFT.fewest_rows:
            found[name] = float(np.hypot(np.std(north[known]), np.std(east[known])))
    return found
