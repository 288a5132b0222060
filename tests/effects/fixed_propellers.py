"""A vessel whose propellers run astern: milliAmpère's hull with two fixed propellers aft and a tunnel thruster at the bow."""

from __future__ import annotations

from pathlib import Path

from ferryid.vessel import load_profile

PLACES = {"port": ("propeller", -1.8, -1.0), "starboard": ("propeller", -1.8, 1.0), "bow": ("tunnel", 2.0, 0.0)}
CURVE = 'thrust = { kind = "quadratic", input = "rpm", ahead = 4.5e-4, astern = 3.0e-4, valid = [-1050.0, 1050.0] }'


def text() -> str:
    """Return the profile."""
    bare = load_profile("milliampere").text
    begin, end = bare.index("[[actuator]]"), bare.index("[signals.position]")
    first, last = bare.index('[signals."thruster1.speed"]'), bare.index("[signals.wind]")
    actuators = "".join(
        f'[[actuator]]\nname = "{name}"\nkind = "{kind}"\nposition_m = [{x}, {y}]\n{CURVE}\n\n'
        for name, (kind, x, y) in PLACES.items()
    )
    signals = "".join(
        f'[signals."{name}.speed{order}"]\ntopic = "/{name}/{topic}"\nfield = "speed"\nunit = "rpm"\n\n'
        for name in PLACES
        for order, topic in (("", "state"), (".command", "command"))
    )
    named = bare[:begin].replace('name = "milliampere"', 'name = "fixed-propellers"')
    return named + actuators + bare[end:first] + signals + bare[last:]


def write(folder: Path) -> Path:
    """Write the profile into a folder."""
    path = folder / "fixed-propellers.toml"
    path.write_text(text(), encoding="utf-8")
    return path
