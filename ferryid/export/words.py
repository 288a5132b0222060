"""What every exported file says of itself, line by line in ASCII, for its comments."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator

from ferryid import __version__
from ferryid.export.exported import HULL, Acting, Exported
from ferryid.export.names import plain
from ferryid.vessel import parse_profile

MARK = "Written by ferryid export"
"""By which a file is known as one that may be replaced."""
WIDTH = 96

_FRAMES = (
    "World: north, east, down (NED). Body: x ahead, y to starboard, z down (FRD), at the origin of the vessel's profile.",
    "nu = u, v [m/s], r [rad/s]: surge, sway and yaw rate over ground; nu_dot their rates; psi [rad] the heading, clockwise "
    "from north.",
    "wind, current = north, east [m/s]: where air and water go TO over ground, not where they come from.",
    "payload = mass [kg] aboard beside the vessel itself, and its place [m] ahead of the body origin.",
    "tau = X, Y [N], N [N m]: ahead, to starboard, turning to starboard; what the actuators have to give for the motion.",
)


def heading(one: Exported) -> Iterator[str]:
    """Yield what the file is of: model, vessel, hash."""
    model = one.model
    title = parse_profile(model.profile_text, model.name).title
    yield from wrapped(f"{model.label}: a model of {title}.")
    yield f"{MARK}, ferryid {__version__}."
    yield f"SHA-256 of the model's file: {plain(one.sha256)}"
    basis = f"{model.settings['basis']}, {model.settings['structure']}"
    yield from wrapped(f"Basis: {basis}. Window: {float(model.settings['window_s']):g} s.")
    yield from wrapped(_factors(one))


def _factors(one: Exported) -> str:
    if one.model.hull:
        told = "Masses and damping are those that a diagnosis refitted, less what the terms hold of them"
    else:
        factors = ", ".join(f"{key} {float(one.model.scale.get(key, 1.0)):g}" for key in ("delta", "sigma", "zeta"))
        told = f"Masses and damping are the profile's with the fit's factors in them ({factors})"
    return f"{told}; zeta divides the force of hull, wind and payload."


def frames(one: Exported) -> Iterator[str]:
    """Yield axes, units and signs, and what may be left out."""
    for sentence in _FRAMES:
        yield from wrapped(sentence)
    areas = one.force.profile.wind is not None
    for what, needed, load in (("wind", one.needs_wind, areas), ("current", one.needs_current, True)):
        if needed:
            yield from wrapped(
                f"The model has terms of the {what}: without a value the result is undefined; still is 0, 0."
            )
        elif load:
            without = (
                "there is no load of the air, not even of still air: that is 0, 0" if what == "wind" else "it is still"
            )
            yield from wrapped(f"Without a {what}, {without}.")
        else:
            yield from wrapped(f"The model knows nothing of the {what}: it changes nothing.")
    if areas and one.force.basis is None:
        yield from wrapped("The hull was refitted beside the load of the air: where there is no wind, give 0, 0.")


def limits(one: Exported) -> Iterator[str]:
    """Yield the ranges of validity."""
    if one.ranges:
        yield "Ranges of validity, of the motion that the model was fitted to:"
    for name, low, high, unit in one.ranges:
        yield f"  {name} {low:.4g} to {high:.4g} {plain(unit)}".rstrip()


def beside(one: Exported) -> Iterator[str]:
    """Yield what acts beside the force, and what is left out, as sentences."""
    for acting in one.acting:
        yield from wrapped(f"{acting.title}, on the {acting.on}: {effect_sentence(acting)}")
    for sentence in (*one.warnings(), *one.left_out()):
        yield from wrapped(f"Note: {sentence}")


def effect_sentence(acting: Acting) -> str:
    """Return what a property of the vessel is, and whether the force holds it."""
    held = "It is counted in." if acting.on == HULL else "It is not in the force; its numbers follow."
    return f"{acting.stored.says()} {held}"


def effect_numbers(one: Exported) -> Iterator[tuple[str, float, str]]:
    """Yield name, value and unit of every parameter of the effects that the force does not hold."""
    for acting in one.acting:
        if acting.on != HULL:
            for name, parameter in acting.parameters.items():
                yield f"{acting.name}_{name}", parameter.value, plain(parameter.unit)


def wrapped(sentence: str) -> list[str]:
    """Return a sentence as lines that are not too long."""
    return textwrap.wrap(plain(sentence), WIDTH, subsequent_indent="  ")


def commented(lines: Iterable[str], sign: str) -> str:
    """Return lines as comments that begin with a sign."""
    return "\n".join(f"{sign} {line}".rstrip() for line in lines)
