"""The cells of the study: what is concealed in each, and how often it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from zlib import crc32

import numpy as np

from ferryid.effects import effects
from ferryid.errors import FerryIdError
from tests.reach.draw import Draw, Truth, drawn
from tests.reach.outside import OUTSIDE, Outside
from tests.reach.places import PLACES, USUAL, Place, hull_errors, merged
from tests.reach.sensors import SENSORS

KINDS = ("clean", "single", "onset", "sensor", "pair", "triple", "concealed", "outside")
"""In the order of the report."""
TIMES = {"clean": 5.0, "pair": 5.0, "triple": 2.5, "concealed": 1.0, "outside": 0.5, "sensor": 0.5}
"""Runs of a cell for every run of a single effect's."""
ELSEWHERE = 0.35
"""The same, in another place than the usual one; singles, onsets and clean runs only."""
UNSTEADY = ("gusts", "waves")
"""Effects that pairs leave out: they are what is laid over a concealed effect."""
NEEDS = {"gusts": ("wind",)}
"""What has to be there for an effect to act on: gusts about a calm push with the square of their speed only."""
SPANS = {"later": "from the middle", "until": "until the middle", "while": "for a part of the trial"}
"""When an effect acts that can begin and end, and the same for people."""
NOT_BOTH = (frozenset({"time_delay", "thruster_lag"}),)
"""Pairs that no log of these paths can tell apart."""


@dataclass(frozen=True)
class Cell:
    """One cell: a kind of trial in one place; `draw` gives its runs by number and random generator."""

    name: str
    kind: str
    place: str
    title: str
    draw: Callable[[int, np.random.Generator], Draw | None]

    @property
    def key(self) -> str:
        """Name and place."""
        return f"{self.name} @ {self.place}"


def cells() -> list[Cell]:
    """Return every cell."""
    made = []
    for place in PLACES.values():
        made += _of_place(place)
    return made


def draws(cell: Cell, runs: int, seed: int) -> list[Draw]:
    """Return the runs of a cell; fewer, or none, where the place cannot have what is concealed.

    Parameters
    ----------
    cell
        From `cells`.
    runs
        Runs of a single effect's cell.
    seed
        Of the study.
    """
    share = TIMES.get(cell.kind, 1.0) * (1.0 if cell.place == USUAL else ELSEWHERE)
    made = []
    for number in range(max(1, round(runs * share))):
        rng = np.random.default_rng([seed, crc32(cell.key.encode()), number])
        one = cell.draw(number, rng)
        if one is not None:
            made.append(one)
    return made


def _of_place(place: Place) -> list[Cell]:
    usual = place.name == USUAL
    clean = [Cell("clean", "clean", place.name, "nothing", partial(_clean, place))]
    if usual:
        clean.append(Cell("noisy", "clean", place.name, "nothing; twice the noise", partial(_noisy, place)))
        clean.append(Cell("gaps", "clean", place.name, "nothing; navigation with gaps", partial(_gaps, place)))
    singles = [
        Cell(
            name,
            "single",
            place.name,
            effect.title,
            partial(_effects, place, name, "single", [*NEEDS.get(name, ()), name], ""),
        )
        for name, effect in effects().items()
    ]
    onsets = [
        Cell(
            f"{name} {span}",
            "onset",
            place.name,
            f"{effect.title}, {words}",
            partial(_effects, place, f"{name} {span}", "onset", [name], span),
        )
        for name, effect in effects().items()
        for span, words in SPANS.items()
        if effect.onset and (usual or span == "later")
    ]
    if not usual:
        return [*clean, *singles, *onsets]
    several = [
        Cell("pair", "pair", place.name, "two effects", partial(_several, place, "pair", 2)),
        Cell("triple", "triple", place.name, "three effects", partial(_several, place, "triple", 3)),
        Cell("in gusts", "concealed", place.name, "an effect in gusts", partial(_weather, place, "in gusts", False)),
        Cell("in waves", "concealed", place.name, "an effect in waves", partial(_weather, place, "in waves", True)),
    ]
    known = effects()
    outside = [
        Cell(one.name, "outside", place.name, one.title, partial(_outside, place, one))
        for one in OUTSIDE
        if one.names not in known
    ]
    sensors = [
        Cell(name, "sensor", place.name, title, partial(_sensor, place, name)) for name, (title, _) in SENSORS.items()
    ]
    return [*clean, *singles, *onsets, *sensors, *several, *outside]


def _made(
    place: Place,
    cell: str,
    kind: str,
    number: int,
    rng: np.random.Generator,
    tables: dict[str, object],
    truths: Sequence[Truth] = (),
    **more: object,
) -> Draw:
    every = merged({"true_hull": hull_errors(rng)}, tables)
    seed = int(rng.integers(2**31))
    return Draw(cell, kind, place.name, number, seed, every, tuple(truths), **more)  # type: ignore[arg-type]


def _clean(place: Place, number: int, rng: np.random.Generator) -> Draw:
    return _made(place, "clean", "clean", number, rng, {})


def _noisy(place: Place, number: int, rng: np.random.Generator) -> Draw:
    noise = {"position_m": 0.04, "heading_deg": 0.4, "velocity_mps": 0.1, "yaw_rate_degps": 0.4}
    return _made(place, "noisy", "clean", number, rng, {"sensors": {"noise": noise}})


def _gaps(place: Place, number: int, rng: np.random.Generator) -> Draw:
    return _made(place, "gaps", "clean", number, rng, {"sensors": {"navigation": {"dropouts_per_min": 1.0}}})


def _effects(
    place: Place, cell: str, kind: str, names: Sequence[str], span: str, number: int, rng: np.random.Generator
) -> Draw | None:
    """Return a trial with effects, all of which act in a span of `SPANS`, or all along where that is empty."""
    truths, tables = [], {}
    for name in names:
        made = drawn(effects()[name], place, rng, span=span)
        if made is None:
            return None
        truths.append(made[0])
        tables = merged(tables, made[1])
    return _made(place, cell, kind, number, rng, tables, truths)


def _several(place: Place, kind: str, count: int, number: int, rng: np.random.Generator) -> Draw | None:
    names = [name for name in effects() if name not in UNSTEADY]
    while True:
        chosen = [names[k] for k in rng.choice(len(names), count, replace=False)]
        if any(both <= set(chosen) for both in NOT_BOTH):
            continue
        made = _effects(place, kind, kind, chosen, "", number, rng)
        if made is None:
            continue
        try:
            place.scenario(made.tables)
        except FerryIdError:
            continue
        return made


def _weather(place: Place, cell: str, sea: bool, number: int, rng: np.random.Generator) -> Draw | None:
    """Return a trial with one effect under gusts, with or without waves."""
    names = [name for name in effects() if name not in UNSTEADY]
    made = None
    while made is None:
        made = _effects(place, cell, "concealed", [names[int(rng.integers(len(names)))]], "", number, rng)
    wind = {"gust_std_mps": 0.6 if sea else 1.0, "gust_time_s": 8.0}
    waves = {
        "significant_height_m": 0.1,
        "peak_period_s": 2.4,
        "direction_deg": round(float(rng.uniform(0.0, 360.0)), 1),
    }
    weather = {"wind": wind, "waves": waves} if sea else {"wind": wind}
    tables = merged({"environment": weather}, made.tables)
    return Draw(cell, "concealed", place.name, number, made.seed, tables, made.truths, UNSTEADY)


def _outside(place: Place, one: Outside, number: int, rng: np.random.Generator) -> Draw:
    tables = one.tables(place, rng)
    csv = str(tables.pop("csv", ""))
    return _made(place, one.name, "outside", number, rng, tables, allowed=one.allowed, profile=one.profile, series=csv)


def _sensor(place: Place, name: str, number: int, rng: np.random.Generator) -> Draw:
    made = SENSORS[name][1](rng)
    return _made(place, name, "sensor", number, rng, made.tables, [made.truth], profile=made.profile, size=made.size)
