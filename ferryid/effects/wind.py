"""Wind: Blendermann's load of an air flow that is steady over ground."""

from __future__ import annotations

from dataclasses import replace
from math import atan2, degrees, hypot
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.picture import Picture, Scene
from ferryid.vessel.profile import Floats, Profile
from ferryid.vessel.wind import wind_force


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the wind's components, where the air goes to."""
    return (Parameter("north", "m/s", 4.0, -30.0, 30.0), Parameter("east", "m/s", 4.0, -30.0, 30.0))


def apply(picture: Picture, p: Floats, instance: str | None) -> Picture:
    """Add the wind's load, less that of still air, which is there already."""
    scene, areas = picture.scene, picture.scene.profile.wind
    if areas is None:
        return picture
    air = np.broadcast_to(p, (len(scene.t), 2))
    more = wind_force(areas, air, scene.psi, scene.nu) - scene.still_air
    return replace(picture, external=picture.external + more, air=np.asarray(p, dtype=np.float64))


def cannot(scene: Scene) -> str:
    """Say why the scene cannot show a wind."""
    if scene.wind is not None:
        return "the wind was measured and is part of the model"
    return "the profile has no wind areas" if scene.profile.wind is None else ""


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    north, east = values["north"], values["east"]
    towards = degrees(atan2(east, north)) % 360.0
    return f"A steady wind of {hypot(north, east):.1f} m/s towards {towards:.0f} deg was left out."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's wind."""
    return {"environment": {"wind": {"north_mps": values["north"], "east_mps": values["east"]}}}


def regressor(picture: Picture, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the heading: what is constant over ground turns with it."""
    return "heading [deg]", np.asarray(np.degrees(picture.scene.psi) % 360.0)


EFFECT = Effect("wind", "Steady wind", parameters_of, apply, says, scenario, cannot=cannot, regressor=regressor)
