"""What to do next, as commands to copy: where a page ends, its reader goes on."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from shlex import join

Step = tuple[str, str]
"""What it is for, and the command."""
LOG = "LOG"
"""In the place of a log that only the reader knows."""


def vessel_option(command: Sequence[str]) -> str:
    """Return how a command was told its vessel, to be told so again; empty where it found it by itself."""
    for word, following in pairwise(command):
        if word == "--vessel":
            return f" {join([word, following])}"
    return ""


def after_fit(label: str, accepted: bool, logs: Sequence[str], command: Sequence[str]) -> list[Step]:
    """Return what follows a fit: use and judge an accepted model, else look for why it is none.

    Parameters
    ----------
    label, accepted
        Name with version of the model, and verdict.
    logs
        Files that it was fitted to.
    command
        The words of the fit.
    """
    vessel = vessel_option(command)
    trained = join(logs) if len(logs) == 1 else LOG
    lacks = ("See which physics the model lacks", f"ferryid diagnose {trained}{vessel}")
    if not accepted:
        return [
            lacks,
            ("Plan a trial that shows more", f"ferryid plan{vessel} --after {trained}"),
            ("Choose its settings by cross-validation", f"ferryid sweep both {trained}{vessel}"),
        ]
    return [
        ("Judge it on the log of another day", f"ferryid evaluate {label} {LOG}"),
        lacks,
        ("See its coefficients with intervals", f"ferryid models {label}"),
        ("Use it in another program", f"ferryid export {label} --to python"),
    ]


def after_sweep(options: Sequence[str], beats_base: bool, command: Sequence[str]) -> list[Step]:
    """Return what follows a sweep: a fit with its choice, or the search for what the base model lacks."""
    vessel = vessel_option(command)
    fit = ("Fit with the choice", f"ferryid fit {LOG}{vessel} {join(options)}")
    lacks = ("See which physics the base model lacks", f"ferryid diagnose {LOG}{vessel}")
    return [fit, lacks] if beats_base else [lacks]
