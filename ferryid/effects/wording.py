"""How results are worded: directions, parameters and lists."""

from __future__ import annotations

from collections.abc import Sequence

WINDS = (
    *("north", "north-north-east", "north-east", "east-north-east"),
    *("east", "east-south-east", "south-east", "south-south-east"),
    *("south", "south-south-west", "south-west", "west-south-west"),
    *("west", "west-north-west", "north-west", "north-north-west"),
)
"""The sixteen points of the compass, clockwise."""

PARAMETER_WORDS = {
    "seconds": "delay",
    "per_mps": "loss by the speed of the inflow",
    "std": "standard deviation",
    "force_std": "standard deviation of the force",
    "moment_std": "standard deviation of the moment",
    "otherwise": "factor on its thrust curve at other times",
    "onset": "it began at",
    "offset": "it ended at",
    "growth": "strength at the end of the log over that at its start",
}
"""Parameters whose own names are no words."""


def parameter_word(name: str) -> str:
    """Return the name of an effect's parameter for people."""
    return PARAMETER_WORDS.get(name, name.replace("_", " "))


def compass_point(degrees: float) -> str:
    """Return the nearest of the sixteen points to a direction, clockwise from north."""
    return WINDS[round(degrees / (360.0 / len(WINDS))) % len(WINDS)]


def bearing(degrees: float) -> str:
    """Return a direction in whole degrees of a circle and in words: ``148 deg (south-south-east)``."""
    return f"{round(degrees) % 360} deg ({compass_point(degrees)})"


def amount(value: float) -> str:
    """Return a force, mass or stiffness in whole units from 10 on, else to two digits: on a small boat, 0.29 N·m are not 0."""
    return f"{value:.0f}" if abs(value) >= 9.95 else f"{value:#.2g}".rstrip(".")


def weak_evidence(evidence: float, least: float) -> str:
    """Return that logs hardly speak for something, as the end of a sentence; evidence over none, and what is needed [nat]."""
    if evidence < 0.05:
        return "the logs are explained as well without it"
    return f"the logs hardly show it: log evidence {evidence:.1f} nat over none, {least:g} are needed"


ALL_THRUSTERS = "all"
"""Instance of a change of force that all actuators have in common, as by a weak battery."""


IS_A_HINT = " is a hint: "
"""What stands in a note between a finding and the reason that makes a hint of it."""


MEANS_LITTLE = "What is found of forces in such logs means little."
"""What stands in a note on logs in which the vessel hardly follows the applied force."""


def uncapitalised(text: str) -> str:
    """Return a title or sentence as it goes on within another."""
    return text[:1].lower() + text[1:]


def titled(title: str, instance: str | None) -> str:
    """Return a title with the thruster it is one of, if it is, or that it is of all of them."""
    if instance == ALL_THRUSTERS:
        return f"{title} (all actuators alike)"
    return f"{title} ({instance})" if instance else title


def timed(onset_s: float | None, offset_s: float | None) -> str:
    """Return "began at 259 s and ended at 400 s", as far as it did; empty where it acted all along."""
    ends = (("began", onset_s), ("ended", offset_s))
    return listed([f"{did} at {time:.0f} s" for did, time in ends if time is not None])


def listed(parts: Sequence[str], word: str = "and") -> str:
    """Return "a, b and c"."""
    return f" {word} ".join([", ".join(parts[:-1]), parts[-1]]) if len(parts) > 1 else "".join(parts)
