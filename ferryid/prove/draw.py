"""Drawing the cases of a proof: everything that the issue of a trial depends on comes from one seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from zlib import crc32

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.prove.case import FORMATS, Case, Truth
from ferryid.prove.conceal import HIDINGS, Concealed, Span
from ferryid.prove.known import MASSES, damping
from ferryid.prove.outside import OUTSIDE
from ferryid.prove.plant.paths import duration_s
from ferryid.prove.plant.vessels import VESSELS, Vessel

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
)
"""Kinds of cells, in the order of the report."""
LEVELS = 5
"""Sizes of a detection curve, from invisible to gross."""
TURNS = (2, 4, 1, 3, 0)
"""Levels in the order of the runs: a few runs are not all of the smallest."""
TIMES: Mapping[str, float] = {"clean": 12.0, "pair": 4.0, "triple": 2.0}
"""Runs of a cell for one run of each size, where it is not one."""
HULL_ERROR = 0.1
"""By how much each coefficient of the profile's hull is off, either way."""
NOISE = (0.6, 1.6)
"""Factors on the errors of the instruments."""
WRONG_BASE = 0.4
"""Factor on masses and damping of a wrong base model, as in the thesis's experiments."""
CLEAN = ("ferry", "ferry", "workboat", "ferry", "ferry", "surveyor")
"""Vessels of clean logs, which take turns: an oracle learns on them what chance does on the vessel of the detection curves."""
UNSTEADY = ("gusts", "waves")
NOT_BOTH = (frozenset({"time_delay", "thruster_lag"}), frozenset({"wind", "gusts"}))
"""Pairs that no log tells apart, or that are one."""
SPANS = ("later", "until", "while")


@dataclass(frozen=True)
class Cell:
    """One cell: `draw` makes a run of it by its number and a random generator."""

    name: str
    kind: str
    title: str
    draw: Callable[[int, np.random.Generator], Case]


def cells() -> list[Cell]:
    """Return every cell."""
    ids = list(HIDINGS)
    every = [Cell("clean", "clean", "nothing", _clean)]
    every += [Cell(name, "single", f"{name}, five sizes", _single(name)) for name in ids]
    every += [
        Cell(f"{name} {span}", "span", f"{name}, {span}", _span(name, span))
        for name in ids
        if HIDINGS[name].spans
        for span in SPANS
    ]
    every += [
        Cell(f"{vessel.name}: {name}", "vessel", f"{name} on the {vessel.title}", _on(name, vessel.name))
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
        every += [Cell(f"{kind}: {name}", kind, f"{name}, {_TITLES[kind]}", _under(kind, name)) for name in names]
    every += [Cell(name, "outside", one.title, _outside(name)) for name, one in OUTSIDE.items()]
    return every


_TITLES = {
    "weather": "in gusty wind and waves",
    "crossings": "with crossings only",
    "short": "in five minutes",
    "wrong base": "on a model with delta = sigma = 0.4",
}


def drawn(seed: int, runs: float, only: Sequence[str] = ()) -> list[Case]:
    """Return the cases of a proof, numbered in an order that tells nothing.

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
    if not 0.0 < runs < 1e3:
        raise FerryIdError(f"--runs: {runs:g} is no number of runs. Fix: give one above 0, such as 1")
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
        count = LEVELS * runs if cell.kind == "single" else TIMES.get(cell.kind, 1.0) * runs
        for number in range(max(1, round(count))):
            made.append(cell.draw(number, np.random.default_rng([seed, crc32(cell.name.encode()), number])))
    order = np.random.default_rng([seed, 1]).permutation(len(made))
    width = max(3, len(str(len(made))))
    return [
        replace(made[k], name=f"{place:0{width}d}", format=FORMATS[place % len(FORMATS)])
        for place, k in enumerate(order.tolist())
    ]


def _case(
    cell: str,
    kind: str,
    vessel: str,
    rng: np.random.Generator,
    conditions: Mapping[str, Any],
    truths: tuple[Truth, ...] = (),
    factors: Mapping[str, float] | None = None,
    path: str = "calibration",
    base: float = 1.0,
    **more: Any,
) -> Case:
    """Return a case with the errors of hull and instruments that all have."""
    names = (*MASSES, *damping(VESSELS[vessel]))
    signs = rng.choice([-1.0, 1.0], len(names)).tolist()
    off = {name: base * (1.0 + HULL_ERROR * sign) for name, sign in zip(names, signs, strict=True)}
    knobs = {
        "conditions": {"noise": round(float(rng.uniform(*NOISE)), 3), **conditions},
        "factors": off | dict(factors or {}),
        **more.pop("knobs", {}),
    }
    seed = int(rng.integers(2**31))
    # Every profile's hull is wrong, in its coefficients and in its form: who says so is not mistaken.
    allowed = (*more.pop("allowed", ()), "hull_parameters")
    return Case("", cell, kind, vessel, path, "mcap", seed, truths=truths, allowed=allowed, knobs=knobs, **more)


def _clean(number: int, rng: np.random.Generator) -> Case:
    return _case("clean", "clean", CLEAN[number % len(CLEAN)], rng, {})


def _single(name: str) -> Callable[[int, np.random.Generator], Case]:
    hiding = HIDINGS[name]

    def draw(number: int, rng: np.random.Generator) -> Case:
        level = TURNS[number % LEVELS]
        # Anywhere in its fifth of the way from invisible to gross, by the logarithm.
        share = (level + rng.uniform()) / LEVELS
        size = hiding.least * (hiding.most / hiding.least) ** share
        one = hiding.draw(size, VESSELS["ferry"], rng, (None, None))
        return _with(name, "single", "ferry", one, rng, level=level, size=size)

    return draw


def _span(name: str, span: str) -> Callable[[int, np.random.Generator], Case]:
    def draw(number: int, rng: np.random.Generator) -> Case:
        whole = duration_s("calibration")
        begin, end = rng.uniform(0.3, 0.6) * whole, rng.uniform(0.35, 0.7) * whole
        ends: Mapping[str, Span] = {
            "later": (float(begin), None),
            "until": (None, float(end)),
            "while": (float(begin), float(begin + rng.uniform(0.15, 0.3) * whole)),
        }
        size = HIDINGS[name].moderate * rng.uniform(0.7, 1.5)
        one = HIDINGS[name].draw(size, VESSELS["ferry"], rng, ends[span])
        return _with(f"{name} {span}", "span", "ferry", one, rng, size=size)

    return draw


def _on(name: str, vessel: str) -> Callable[[int, np.random.Generator], Case]:
    def draw(number: int, rng: np.random.Generator) -> Case:
        one, size = _moderate(name, VESSELS[vessel], rng)
        return _with(f"{vessel}: {name}", "vessel", vessel, one, rng, size=size)

    return draw


def _several(cell: str, count: int) -> Callable[[int, np.random.Generator], Case]:
    def draw(number: int, rng: np.random.Generator) -> Case:
        vessel = ("ferry", "workboat")[number % 2]
        able = [name for name in HIDINGS if name not in UNSTEADY]
        while True:
            chosen = [able[k] for k in rng.choice(len(able), count, replace=False)]
            if not any(both <= set(chosen) for both in NOT_BOTH):
                break
        parts = [_moderate(name, VESSELS[vessel], rng)[0] for name in chosen]
        whole = Concealed(
            {key: value for part in parts for key, value in part.conditions.items()},
            tuple(truth for part in parts for truth in part.truths),
            {key: value for part in parts for key, value in part.factors.items()},
        )
        return _with(cell, cell, vessel, whole, rng)

    return draw


def _under(kind: str, name: str) -> Callable[[int, np.random.Generator], Case]:
    def draw(number: int, rng: np.random.Generator) -> Case:
        one, size = _moderate(name, VESSELS["ferry"], rng)
        cell = f"{kind}: {name}"
        if kind == "weather":
            air = HIDINGS["gusts"].draw(0.8, VESSELS["ferry"], rng, (None, None))
            sea = HIDINGS["waves"].draw(0.03, VESSELS["ferry"], rng, (None, None))
            blown = Concealed(
                {**air.conditions, **sea.conditions, **one.conditions}, (*one.truths, air.truths[1]), one.factors
            )
            return _with(cell, kind, "ferry", blown, rng, size=size, allowed=UNSTEADY)
        if kind == "wrong base":
            return _with(cell, kind, "ferry", one, rng, size=size, base=WRONG_BASE, allowed=("fouling",))
        path = {"crossings": "crossings", "short": "short"}[kind]
        return _with(cell, kind, "ferry", one, rng, size=size, path=path)

    return draw


def _outside(name: str) -> Callable[[int, np.random.Generator], Case]:
    def draw(number: int, rng: np.random.Generator) -> Case:
        one, vessel = OUTSIDE[name], VESSELS["ferry"]
        conditions = one.draw(vessel, duration_s("calibration"), rng)
        knobs = {"lacks": list(one.lacks), "moved": one.moved}
        return _case(name, "outside", vessel.name, rng, conditions, knobs=knobs, allowed=one.allowed)

    return draw


def _moderate(name: str, vessel: Vessel, rng: np.random.Generator) -> tuple[Concealed, float]:
    size = float(HIDINGS[name].moderate * rng.uniform(0.7, 1.5))
    return HIDINGS[name].draw(size, vessel, rng, (None, None)), size


def _with(cell: str, kind: str, vessel: str, one: Concealed, rng: np.random.Generator, **more: Any) -> Case:
    return _case(cell, kind, vessel, rng, one.conditions, one.truths, one.factors, **more)
