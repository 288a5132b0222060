"""What to do next, as commands to copy: where a page ends, its reader goes on."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import PurePath
from shlex import join, quote

Step = tuple[str, str]
"""What it is for, and the command."""
LOG = "LOG"
"""In the place of a log that only the reader knows."""


def _option(command: Sequence[str], option: str) -> str:
    """Return an option of a command with its value, written as its own word or after an equals sign; empty without it."""
    for word, following in pairwise([*command, ""]):
        if word == option:
            return f" {join([word, following])}"
        if word.startswith(f"{option}="):
            return f" {quote(word)}"
    return ""


def _given_log(names: Sequence[str], command: Sequence[str]) -> str:
    """Return the one file of a command, by its path there; `LOG` for several, and for what lies in other files."""
    paths = [word for word in command if PurePath(word).name in names]
    return join(paths) if len(names) == len(paths) == 1 else LOG


def after_fit(label: str, accepted: bool, logs: Sequence[str], command: Sequence[str]) -> list[Step]:
    """Return what follows a fit: use and judge an accepted model, else look for why it is none.

    Parameters
    ----------
    label, accepted
        Name with version of the model, and verdict.
    logs
        Names of the files that it was fitted to.
    command
        The words of the fit.
    """
    vessel = _option(command, "--vessel")
    # A model is looked for where it was stored.
    stored = _option(command, "--out")
    trained = _given_log(logs, command)
    lacks = ("See which physics the model lacks", f"ferryid diagnose {trained}{vessel}")
    if not accepted:
        return [
            lacks,
            ("Plan a trial that shows more", f"ferryid plan{vessel} --after {trained}"),
            ("Choose its settings by cross-validation", f"ferryid sweep both {trained}{vessel}"),
        ]
    return [
        ("Judge it on the log of another day", f"ferryid evaluate {label} {LOG}{stored}"),
        lacks,
        ("See its coefficients with intervals", f"ferryid models {label}{stored}"),
        ("Use it in another program", f"ferryid export {label} --to python{stored}"),
    ]


def after_sweep(options: Sequence[str], beats_base: bool, command: Sequence[str]) -> list[Step]:
    """Return what follows a sweep: a fit with its choice, or the search for what the base model lacks."""
    vessel = _option(command, "--vessel")
    fit = ("Fit with the choice", f"ferryid fit {LOG}{vessel} {join(options)}")
    lacks = ("See which physics the base model lacks", f"ferryid diagnose {LOG}{vessel}")
    return [fit, lacks] if beats_base else [lacks]
