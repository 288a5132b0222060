"""What is concealed in a trial: drawn at random, and the same for the same seed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import cos, pi, sin
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter
from ferryid.errors import FerryIdError
from tests.reach.places import Place, stretch

USUAL = (0.7, 1.5)
"""How far a parameter is from neutral, in its `size`, where nothing else is said: of either sign, where both are possible."""
MODERATE: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "wind": {"north": (0.5, 1.2)},
    "current": {"north": (0.4, 1.0)},
    "payload": {"mass": (0.6, 1.6), "x": (0.6, 1.6)},
    "fouling": {"surge": (0.7, 1.8)},
    "thruster_gain": {"factor": (0.75, 1.5)},
    "thruster_lag": {"time_constant": (0.7, 1.6)},
    "thruster_interaction": {"fraction": (0.75, 2.0)},
    "time_delay": {"seconds": (0.6, 1.6)},
    "lever_arm": {"x": (0.5, 1.5)},
    "mooring": {"stiffness_north": (0.6, 1.6), "stiffness_east": (0.6, 1.6), "north": (0.0, 0.75)},
}
"""Otherwise: by effect and parameter. A vector stands under the name of its first component."""
VECTORS = (("north", "east"), ("x", "y"), ("surge", "sway", "yaw"), ("stiffness_north", "stiffness_east"))
"""Parameters of one effect that belong together, if they have one unit: sizes and errors are those of the vector."""
GROWN = ("fouling",)
"""Effects whose parameters all lie above neutral: damping grows."""
FEW = {"hull_parameters": 2}
"""Effects of so many parameters that only some of them, drawn at random, are off."""
MIDDLE = (0.3, 0.7)
"""When an effect begins or ends that does not act all along, as a share of the trial."""
PART = (0.2, 0.4)
"""For how long one acts that does both, as a share of the trial."""
TRIES = 40


@dataclass(frozen=True)
class Truth:
    """An effect that is in the log: its parameters by name, and its onset and offset [s], None where it has none."""

    effect: str
    instance: str | None
    values: Mapping[str, float]
    onset_s: float | None = None
    offset_s: float | None = None


@dataclass(frozen=True)
class Draw:
    """One trial.

    Attributes
    ----------
    cell, kind, place, number
        Which cell of the study it is a run of, and which run.
    seed
        Of the simulation.
    tables
        What its scenario holds besides the place's own.
    truths
        What ought to be named.
    allowed
        Names that are not wrong, though they are not what is in the log either: effect ids.
    profile, size
        What is done to the profile that the diagnosis is given, and how much; see `tests.reach.outside.PROFILES`.
    series
        Text of the CSV file of the wind, which the tables call ``wind.csv``.
    """

    cell: str
    kind: str
    place: str
    number: int
    seed: int
    tables: Mapping[str, Any]
    truths: tuple[Truth, ...] = ()
    allowed: tuple[str, ...] = ()
    profile: str = ""
    size: tuple[float, ...] = ()
    series: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)


def groups(parameters: Sequence[Parameter]) -> list[tuple[str, ...]]:
    """Return the names of parameters, those of one vector together."""
    unit = {one.name: one.unit for one in parameters}
    left = list(unit)
    found = []
    while left:
        vector = next((v for v in VECTORS if left[0] in v), (left[0],))
        together = tuple(name for name in vector if name in left and unit[name] == unit[left[0]])
        found.append(together)
        left = [name for name in left if name not in together]
    return found


def drawn(
    effect: Effect, place: Place, rng: np.random.Generator, *, span: str = ""
) -> tuple[Truth, dict[str, Any]] | None:
    """Return an effect of moderate size and the tables that conceal it; None where the place cannot have it.

    Parameters
    ----------
    effect
        What is concealed.
    place
        Where.
    rng
        Draws size, sign, direction and instance.
    span
        ``later``: it begins in the middle of the trial; ``until``: it ends there; ``while``: it acts for a part of it.
    """
    profile = place.profile
    if effect.id in place.without:
        return None
    instances = effect.instances(profile)
    if not instances:
        return None
    parameters = effect.parameters_of(profile)
    for _ in range(TRIES):
        instance = instances[int(rng.integers(len(instances)))]
        values = _values(effect, parameters, place, rng)
        times = _times(place, rng, span)
        if any(not one.low <= values[one.name] <= one.high for one in parameters):
            continue
        tables = effect.scenario({**values, **times}, instance)
        try:
            place.scenario(tables)
        except FerryIdError:
            continue
        return Truth(effect.id, instance, values, times.get("onset"), times.get("offset")), tables
    return None


def _times(place: Place, rng: np.random.Generator, span: str) -> dict[str, float]:
    if span == "while":
        first, last = stretch(place, rng, *PART)
        return {"onset": first, "offset": last}
    end = {"later": "onset", "until": "offset"}
    return {end[span]: round(float(rng.uniform(*MIDDLE)) * place.duration_s, 1)} if span else {}


def _values(
    effect: Effect, parameters: Sequence[Parameter], place: Place, rng: np.random.Generator
) -> dict[str, float]:
    by_name = {one.name: one for one in parameters}
    moderate = MODERATE.get(effect.id, {})
    values = {one.name: one.neutral for one in parameters}
    vectors = groups(parameters)
    if effect.id in FEW:
        vectors = [vectors[k] for k in rng.choice(len(vectors), FEW[effect.id], replace=False)]
    for names in vectors:
        low, high = np.array(moderate.get(names[0], USUAL)) * place.share.get(f"{effect.id}.{names[0]}", 1.0)
        if len(names) == 2 and names[0] not in ("stiffness_north",):
            angle, length = rng.uniform(0.0, 2.0 * pi), rng.uniform(low, high)
            away = [length * cos(angle), length * sin(angle)]
        else:
            sign = 1.0 if effect.id in GROWN else float(rng.choice([-1.0, 1.0]))
            away = [sign * float(rng.uniform(low, high)) for _ in names]
        for name, distance in zip(names, away, strict=True):
            one = by_name[name]
            values[name] = float(f"{one.neutral + distance * one.size:.4g}")
    return values
