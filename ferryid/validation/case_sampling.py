"""Sampling of the cases of a validation run: everything that a trial depends on is drawn from one seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from zlib import crc32

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.validation.case import FORMATS, Case, Truth
from ferryid.validation.out_of_library import OUT_OF_LIBRARY
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.plant.effects.effect import Injection, PlantEffect, Span, random_vector
from ferryid.validation.plant.paths import duration_s
from ferryid.validation.plant.vessels import VESSELS, Vessel
from ferryid.validation.prior_profile import MASSES, damping

KINDS = (
    "clean",
    "single",
    "span",
    "vessel",
    "pair",
    "triple",
    "weather",
    "crossings",
    "short",
    "wrong base",
    "outside",
    "sea",
)
"""Kinds of cells, in the order of the report."""
LEVELS = 5
"""Sizes of a detection curve, from invisible to gross."""
TURNS = (2, 4, 1, 3, 0)
"""Levels in the order of the runs: a few runs are not all of the smallest."""
CLEAN_SEA = "sea: nothing"
"""Cell of the campaigns at sea in which nothing but the weather is concealed."""
TIMES: Mapping[str, float] = {"clean": 50.0, "pair": 4.0, "triple": 2.0, CLEAN_SEA: 6.0}
"""Runs of a cell, or of each of a kind, for one run of each size, where it is not one."""
HULL_ERROR = 0.1
"""By how much each coefficient of the profile's hull is off, either way."""
NOISE = (0.6, 1.6)
"""Factors on the errors of the instruments."""
WRONG_BASE = 0.4
"""Factor on masses and damping of a wrong base model, as in the thesis's experiments."""
CLEAN = ("ferry", "ferry", "workboat", "ferry", "ferry", "surveyor")
"""Vessels of clean logs, which take turns; mostly that of the detection curves, as they calibrate the oracle."""
SPANS = ("later", "until", "while")
SEA_LOGS, SEA_PATH = 10, "short"
"""Logs of a campaign at sea, each a part of such a path."""
SEA_WIND = (1.0, 3.0)
"""Mean of the wind there [m/s], where it is not what is concealed."""
UNSTEADY, UNSTEADY_S = 0.25, 20.0
"""Standard deviation of that wind as a share of its mean, and for how long it is correlated [s]."""
NOT_AT_SEA = ("fouling", "hull_parameters", "external_push")
"""What is not concealed there: without a hull model there is none that could be wrong or fouled all along, and a push is no
matter of a campaign."""
ABOARD_FROM = 4
"""The log from which on a load is aboard: one that is in all logs is the hull's own mass."""
SEEN_WITH_WIND = ("gusts", "time_delay", "clock_offset", "held_samples")
"""What is in every log at sea: an unsteady wind, a receiver that lags, and repeated samples."""


@dataclass(frozen=True)
class Cell:
    """One cell: `draw` makes a run of it by its number and a random generator."""

    name: str
    kind: str
    title: str
    draw: Callable[[int, np.random.Generator], Case]


def cells() -> list[Cell]:
    """Return every cell."""
    effects = plant_effects()
    every = [Cell("clean", "clean", "nothing", _clean)]
    every += [Cell(name, "single", f"{name}, five sizes", _single(one)) for name, one in effects.items()]
    every += [
        Cell(f"{name} {span}", "span", f"{name}, {span}", _span(one, span))
        for name, one in effects.items()
        if one.time_limited
        for span in SPANS
    ]
    every += [
        Cell(f"{vessel.name}: {name}", "vessel", f"{name} on the {vessel.title}", _on(effects[name], vessel.name))
        for vessel in list(VESSELS.values())[1:]
        for name in ("wind", "current", "payload", "thruster_gain")
    ]
    every += [
        Cell("pair", "pair", "two effects", _several("pair", 2)),
        Cell("triple", "triple", "three effects", _several("triple", 3)),
    ]
    for kind, names in (
        ("weather", ("payload", "thruster_gain", "current")),
        ("crossings", ("wind", "thruster_gain", "payload", "fouling")),
        ("short", ("wind", "thruster_gain")),
        ("wrong base", ("wind", "thruster_gain", "payload")),
    ):
        every += [
            Cell(f"{kind}: {name}", kind, f"{name}, {_TITLES[kind]}", _under(kind, effects[name])) for name in names
        ]
    every += [Cell(name, "outside", one.title, _outside(name)) for name, one in OUT_OF_LIBRARY.items()]
    every.append(Cell(CLEAN_SEA, "sea", "nothing but the wind", _at_sea(None)))
    every += [
        Cell(f"sea: {name}", "sea", name, _at_sea(one)) for name, one in effects.items() if name not in NOT_AT_SEA
    ]
    return every


_TITLES = {
    "weather": "in gusty wind and waves",
    "crossings": "with crossings only",
    "short": "in five minutes",
    "wrong base": "on a model with delta = sigma = 0.4",
}


def sample_cases(seed: int, runs: float, only: Sequence[str] = ()) -> list[Case]:
    """Return the cases of a run, numbered in random order.

    Parameters
    ----------
    seed
        Of everything.
    runs
        Runs of each size of each effect; other cells in proportion, one at least.
    only
        Cells or kinds; every one if empty.

    Raises
    ------
    FerryIdError
        For a cell that there is not, and a number of runs that is none.
    """
    check_runs(runs)
    every = cells()
    known = {cell.name for cell in every} | set(KINDS)
    for name in only:
        if name not in known:
            raise FerryIdError(
                f"--only: there is no cell {name!r}. Fix: give one of {', '.join(KINDS)}, or an effect's id"
            )
    made = []
    for cell in every:
        if only and not {cell.name, cell.kind} & set(only):
            continue
        count = LEVELS * runs if cell.kind == "single" else TIMES.get(cell.name, TIMES.get(cell.kind, 1.0)) * runs
        for number in range(max(1, round(count))):
            made.append(cell.draw(number, np.random.default_rng([seed, crc32(cell.name.encode()), number])))
    return [replace(case, format=FORMATS[place % len(FORMATS)]) for place, case in enumerate(numbered(made, seed))]


def numbered(cases: Sequence[Case], seed: int) -> list[Case]:
    """Return cases in random order, named by their place in it."""
    order = np.random.default_rng([seed, 1]).permutation(len(cases))
    width = max(3, len(str(len(cases))))
    return [replace(cases[k], name=f"{place:0{width}d}") for place, k in enumerate(order.tolist())]


def check_runs(runs: float) -> None:
    """Refuse a number of runs that is none."""
    if not 0.0 < runs < 1e3:
        raise FerryIdError(f"--runs: {runs:g} is not a number of runs. Fix: give one above 0, such as 1")


def _case(
    cell: str,
    kind: str,
    vessel: str,
    rng: np.random.Generator,
    injected: Injection,
    *,
    base: float = 1.0,
    path: str = "calibration",
    allowed: tuple[str, ...] = (),
    **more: Any,
) -> Case:
    """Return a case with the errors of hull and instruments that all have."""
    names = (*MASSES, *damping(VESSELS[vessel]))
    signs = rng.choice([-1.0, 1.0], len(names)).tolist()
    factors = {name: base * (1.0 + HULL_ERROR * sign) for name, sign in zip(names, signs, strict=True)}
    return Case(
        "",
        cell,
        kind,
        vessel,
        path,
        FORMATS[0],
        conditions={"noise": round(float(rng.uniform(*NOISE)), 3), **injected.conditions},
        seed=int(rng.integers(2**31)),
        truths=injected.truths,
        # Every profile's hull is wrong, in its coefficients and in its form: a finding of that is not mistaken.
        allowed=(*allowed, "hull_parameters"),
        hull_factors=factors | dict(injected.hull_factors),
        **more,
    )


def _clean(number: int, rng: np.random.Generator) -> Case:
    return _case("clean", "clean", CLEAN[number % len(CLEAN)], rng, Injection({}, ()))


def _single(effect: PlantEffect) -> Callable[[int, np.random.Generator], Case]:
    least, most = effect.sizes

    def draw(number: int, rng: np.random.Generator) -> Case:
        level = TURNS[number % LEVELS]
        # Anywhere in its fifth of the way from invisible to gross, by the logarithm.
        share = (level + rng.uniform()) / LEVELS
        size = least * (most / least) ** share
        one = effect.sample(size, VESSELS[effect.vessel], rng, (None, None))
        return _case(effect.id, "single", effect.vessel, rng, one, level=level, size=size)

    return draw


def _span(effect: PlantEffect, span: str) -> Callable[[int, np.random.Generator], Case]:
    def draw(number: int, rng: np.random.Generator) -> Case:
        whole = duration_s("calibration")
        begin, end = rng.uniform(0.3, 0.6) * whole, rng.uniform(0.35, 0.7) * whole
        ends: Mapping[str, Span] = {
            "later": (float(begin), None),
            "until": (None, float(end)),
            "while": (float(begin), float(begin + rng.uniform(0.15, 0.3) * whole)),
        }
        size = effect.moderate * rng.uniform(0.7, 1.5)
        one = effect.sample(size, VESSELS["ferry"], rng, ends[span])
        return _case(f"{effect.id} {span}", "span", "ferry", rng, one, size=size)

    return draw


def _on(effect: PlantEffect, vessel: str) -> Callable[[int, np.random.Generator], Case]:
    def draw(number: int, rng: np.random.Generator) -> Case:
        one, size = _moderate(effect, VESSELS[vessel], rng)
        return _case(f"{vessel}: {effect.id}", "vessel", vessel, rng, one, size=size)

    return draw


def _several(cell: str, count: int) -> Callable[[int, np.random.Generator], Case]:
    def draw(number: int, rng: np.random.Generator) -> Case:
        vessel = ("ferry", "workboat")[number % 2]
        effects = plant_effects()
        # Both vessels have thrusters like those of the ferry.
        able = [name for name, one in effects.items() if not one.stochastic and one.vessel == "ferry"]
        while True:
            chosen = [able[k] for k in rng.choice(len(able), count, replace=False)]
            if not any(set(effects[name].excludes) & set(chosen) for name in chosen):
                break
        parts = [_moderate(effects[name], VESSELS[vessel], rng)[0] for name in chosen]
        return _case(cell, cell, vessel, rng, _joined(parts))

    return draw


def _joined(parts: Sequence[Injection]) -> Injection:
    return Injection(
        {key: value for part in parts for key, value in part.conditions.items()},
        tuple(truth for part in parts for truth in part.truths),
        {key: value for part in parts for key, value in part.hull_factors.items()},
    )


def _under(kind: str, effect: PlantEffect) -> Callable[[int, np.random.Generator], Case]:
    def draw(number: int, rng: np.random.Generator) -> Case:
        one, size = _moderate(effect, VESSELS["ferry"], rng)
        cell = f"{kind}: {effect.id}"
        if kind == "weather":
            effects = plant_effects()
            air = effects["gusts"].sample(0.8, VESSELS["ferry"], rng, (None, None))
            sea = effects["waves"].sample(0.03, VESSELS["ferry"], rng, (None, None))
            # Of the weather, the mean wind is to be found; gusts and waves may be.
            settings = {**air.conditions, **sea.conditions, **one.conditions}
            blown = Injection(settings, (*one.truths, air.truths[1]), one.hull_factors)
            return _case(cell, kind, "ferry", rng, blown, size=size, allowed=("gusts", "waves"))
        if kind == "wrong base":
            return _case(cell, kind, "ferry", rng, one, size=size, base=WRONG_BASE, allowed=("fouling",))
        path = {"crossings": "crossings", "short": "short"}[kind]
        return _case(cell, kind, "ferry", rng, one, size=size, path=path)

    return draw


def _outside(name: str) -> Callable[[int, np.random.Generator], Case]:
    def draw(number: int, rng: np.random.Generator) -> Case:
        one, vessel = OUT_OF_LIBRARY[name], VESSELS["ferry"]
        injected = Injection(one.draw(vessel, duration_s("calibration"), rng), ())
        return _case(
            name,
            "outside",
            vessel.name,
            rng,
            injected,
            allowed=one.allowed,
            omitted_terms=one.omitted_terms,
            thruster_shift=one.thruster_shift,
        )

    return draw


def _at_sea(effect: PlantEffect | None) -> Callable[[int, np.random.Generator], Case]:
    """Return what draws campaigns of `ferryid.validation.sea`; the wind is always among what is in their logs."""

    def draw(number: int, rng: np.random.Generator) -> Case:
        vessel = VESSELS["ferry" if effect is None else effect.vessel]
        north, east = random_vector(float(rng.uniform(*SEA_WIND)), rng)
        injected, size = (Injection({}, ()), 0.0) if effect is None else _moderate(effect, vessel, rng)
        north, east = injected.conditions.get("wind", (north, east))
        weather = {
            "wind": (north, east),
            "gust_std": UNSTEADY * float(np.hypot(north, east)),
            "gust_time": UNSTEADY_S,
        }
        wind = Truth("wind", None, {"north": north, "east": east})
        truths = injected.truths if any(one.effect == "wind" for one in injected.truths) else (*injected.truths, wind)
        blown = Injection({**weather, **injected.conditions}, truths, injected.hull_factors)
        name = CLEAN_SEA if effect is None else f"sea: {effect.id}"
        later = ABOARD_FROM if effect is not None and effect.id == "payload" else 0
        return _case(
            name,
            "sea",
            vessel.name,
            rng,
            blown,
            path=SEA_PATH,
            allowed=SEEN_WITH_WIND,
            size=size,
            logs=SEA_LOGS,
            first_log=later,
        )

    return draw


def _moderate(effect: PlantEffect, vessel: Vessel, rng: np.random.Generator) -> tuple[Injection, float]:
    size = float(effect.moderate * rng.uniform(0.7, 1.5))
    return effect.sample(size, vessel, rng, (None, None)), size
