"""Trials that something is concealed in: a vessel on a path, whose hull is not quite the one that the profile knows."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.simulate.check_scenario import check_against
from ferryid.simulate.scenario import Scenario, parse_scenario
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile

HULL = ("m11", "m22", "m33", "X_u", "X_|u|u", "Y_v", "Y_|v|v", "Y_|r|v", "Y_|v|r", "N_r", "N_|r|r", "N_|r|v")
"""Coefficients that the true vessel has `HULL_ERROR` off the profile's, either way."""
HULL_ERROR = 0.1
QUIET = {"sensors": {"imu_rate_hz": 0.0, "camera_rate_hz": 0.0}}
"""Topics that no profile maps and no diagnosis reads."""
FERRY = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
controller = { delta = 0.7, sigma = 0.7 }
"""


@dataclass(frozen=True)
class Place:
    """A trial without anything concealed.

    Attributes
    ----------
    name, title
        In results, and for people.
    vessel
        Its profile.
    text
        TOML of the scenario; further tables are added to it.
    share
        Factors on the usual sizes of what is concealed, by effect and parameter.
    without
        Effects that this vessel cannot have.
    """

    name: str
    title: str
    vessel: str
    text: str
    share: Mapping[str, float] = field(default_factory=dict)
    without: tuple[str, ...] = ()

    @cached_property
    def profile(self) -> Profile:
        """Return the vessel's profile."""
        return load_profile(self.vessel)

    @cached_property
    def duration_s(self) -> float:
        """Return how long the trial takes [s]."""
        return parse_scenario(self.text, self.name).duration_s

    def scenario(self, tables: Mapping[str, Any], folder: Path | None = None) -> Scenario:
        """Return the trial with further tables in its scenario.

        Parameters
        ----------
        tables
            Nested as in TOML.
        folder
            Where the files lie that they name.

        Raises
        ------
        FerryIdError
            For tables that a scenario of this vessel cannot have.
        """
        text = tomllib.loads(self.text)
        every = merged(merged(text, QUIET), tables)
        scenario = parse_scenario(
            "".join(f'"{key}" = {inline(value)}\n' for key, value in every.items()), self.name, folder
        )
        check_against(scenario, self.profile)
        return scenario


def _bundled(name: str) -> str:
    return (resources.files("ferryid.simulate.scenarios") / f"{name}.toml").read_text("utf-8")


PLACES: Mapping[str, Place] = {
    place.name: place
    for place in (
        Place(
            "twelve-corner",
            "milliAmpère on the 12-corner path, 12 min",
            "milliampere",
            FERRY + 'path = { kind = "twelve-corner" }\n',
        ),
        Place(
            "four-corner",
            "milliAmpère on the 4-corner path, twice round, 10 min",
            "milliampere",
            FERRY + 'path = { kind = "four-corner", rounds = 2 }\n',
        ),
        Place(
            "revolt",
            "ReVolt, 3 m, positioning, 20 min",
            "revolt",
            _bundled("revolt-positioning"),
            # Its thrusters push 64 N together, and its path is 3 m long.
            {"current.north": 0.3, "mooring.north": 0.25, "mooring.stiffness_north": 2.0},
            ("fouling",),
        ),
    )
}
USUAL = "twelve-corner"


def hull_errors(rng: np.random.Generator) -> dict[str, float]:
    """Return factors on the true hull's coefficients, each `HULL_ERROR` more or less."""
    signs = rng.choice([-1.0, 1.0], len(HULL)).tolist()
    return {name: round(1.0 + HULL_ERROR * sign, 6) for name, sign in zip(HULL, signs, strict=True)}


def stretch(place: Place, rng: np.random.Generator, low: float, high: float) -> tuple[float, float]:
    """Return the first and last second of a stretch whose share of the trial lies between two limits."""
    seconds = rng.uniform(low, high) * place.duration_s
    first = rng.uniform(0.15 * place.duration_s, 0.85 * place.duration_s - seconds)
    return round(float(first), 1), round(float(first + seconds), 1)


def merged(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """Return two nested tables as one: lists are joined, factors on the true hull multiplied."""
    result = dict(one)
    for key, value in other.items():
        if key == "true_hull":
            factors = result.get(key, {})
            result[key] = {**factors, **{name: factors.get(name, 1.0) * factor for name, factor in value.items()}}
        elif isinstance(value, Mapping):
            result[key] = merged(result.get(key, {}), value)
        elif isinstance(value, list) and isinstance(result.get(key), list) and value and isinstance(value[0], Mapping):
            result[key] = [*result[key], *value]
        else:
            result[key] = value
    return result


def inline(value: Any) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f'"{key}" = {inline(entry)}' for key, entry in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(inline(entry) for entry in value) + "]"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, datetime):
        return value.isoformat()
    return repr(value) if isinstance(value, int) else repr(float(value))
