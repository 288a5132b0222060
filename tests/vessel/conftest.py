"""Small profiles for tests, made of text as a user would write it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Profile

STERN_BOAT = """schema = "ferryid.vessel/1"
name = "boat"
source = "made up for a test"
[hull]
mass_kg = 100.0
inertia_z = 200.0
[signals.velocity]
topic = "/nav"
fields = ["u", "v"]
unit = "m/s"
frame = "FRD"
[signals.yaw_rate]
topic = "/nav"
field = "r"
unit = "rad/s"
frame = "FRD"
[[actuator]]
name = "stern"
kind = "{kind}"
position_m = [-1.0, 0.0]
{more}
"""
"""A boat with one actuator, stern, of some `kind`, with `more` lines of it; other signals are to follow."""

ROLE = {"speed": "rpm", "force": "N", "thrust": "N"}


def boat_text(kind: str, *, strength: str = "speed", angle_deg: float | None = None, extra: str = "") -> str:
    """Return a boat with actuators a and b at x = ±1.8 m; its propellers give 1 N per 100 rpm² n|n|."""
    text = """schema = "ferryid.vessel/1"
name = "boat"
source = "made up for a test"

[hull]
length_m = 5.0
mass_kg = 100.0
inertia_z = 200.0

[signals.velocity]
topic = "/nav"
fields = ["u", "v"]
unit = "m/s"
frame = "FRD"

[signals.yaw_rate]
topic = "/nav"
field = "r"
unit = "rad/s"
frame = "FRD"
"""
    for name, x_m in (("a", 1.8), ("b", -1.8)):
        text += f'\n[[actuator]]\nname = "{name}"\nkind = "{kind}"\nposition_m = [{x_m}, 0.0]\n'
        if angle_deg is not None:
            text += f"angle_deg = {angle_deg}\n"
        text += extra + "\n"
        if strength == "speed":
            text += 'thrust = { kind = "quadratic", input = "rpm", ahead = 0.01 }\n'
        text += f'\n[signals."{name}.{strength}"]\ntopic = "/{name}"\nfield = "value"\nunit = "{ROLE[strength]}"\n'
        if kind == "azimuth":
            text += f'\n[signals."{name}.angle"]\ntopic = "/{name}"\nfield = "angle"\nunit = "rad"\n'
    return text


@pytest.fixture(scope="session")
def boat() -> Callable[..., Profile]:
    """Give a function that parses `boat_text`."""

    def parse(kind: str, **choices: object) -> Profile:
        return parse_profile(boat_text(kind, **choices), "boat.toml")  # type: ignore[arg-type]

    return parse
