"""What a log would not have shown: sizes of effects that were tested and not found, for the page and the terminal."""

from __future__ import annotations

from math import inf
from shlex import quote

from ferryid.counts import counted
from ferryid.diagnose.judging import Diagnosis, LeastSize
from ferryid.effects import effects
from ferryid.effects.wording import uncapitalised

PROFILE = "PROFILE.toml"
"""In the place of a profile whose file only the reader knows."""
SHOWN = 5
"""Effects on a terminal: the page and the JSON have all."""


def rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Return a row for each effect and thruster that was tested and not found."""
    return [{"says": one.says, "size": one.text} for one in diagnosis.least_sizes]


def never_seen(diagnosis: Diagnosis) -> list[str]:
    """Return the effects that a log would not have shown at any size, whatever the thruster."""
    return list(dict.fromkeys(_name(one) for one in diagnosis.least_sizes if one.value is None))


def line(diagnosis: Diagnosis) -> str:
    """Return the sizes of some effects in one line; of several thrusters the largest counts."""
    worst: dict[str, LeastSize] = {}
    for one in diagnosis.least_sizes:
        known = worst.get(one.effect)
        if known is None or _size(one) > _size(known):
            worst[one.effect] = one
    if not worst:
        return ""
    shown = [_short(one) for one in list(worst.values())[:SHOWN]]
    more = len(worst) - len(shown)
    rest = f" (and {counted(more, 'effect')} more in the report)" if more else ""
    return f"would not have been seen here: {', '.join(shown)}{rest}"


def proof(diagnosis: Diagnosis) -> str:
    """Return the command that measures such sizes in the log itself; empty where nothing would be seen at any size.

    `PROFILE` stands in it where nothing that is known leads to the vessel's profile. Errors of sensors
    can be concealed in any record, loads only where the actuators push freely on every axis.
    """
    seen = list(dict.fromkeys(one.effect for one in diagnosis.least_sizes if one.value is not None))
    known = effects()
    of_sensors = [name for name in seen if name in known and known[name].of_sensor]
    wanted = of_sensors[:2] or [name for name in ("wind", "payload") if name in seen] or seen[:2]
    if not wanted:
        return ""
    recording, vessel = quote(diagnosis.path or diagnosis.log), quote(diagnosis.profile or PROFILE)
    return f"ferryid prove --real {recording} --vessel {vessel} --only {','.join(wanted)}"


def proof_note(diagnosis: Diagnosis) -> str:
    """Return what the reader puts into that command; empty where it runs as it stands."""
    return "" if diagnosis.profile else f", with the file of the profile {diagnosis.vessel} in the place of {PROFILE}"


def _name(one: LeastSize) -> str:
    """Return the title of an effect as it stands within a sentence."""
    known = effects().get(one.effect)
    return uncapitalised(known.title if known else one.effect.replace("_", " "))


def _short(one: LeastSize) -> str:
    name = _name(one)
    return f"{name} at any size" if one.value is None else f"{name} below {one.text}"


def _size(one: LeastSize) -> float:
    return inf if one.value is None else one.value
