"""What to do next, as commands to copy: where a page ends, its reader goes on."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import join

from ferryid.types import Given

Step = tuple[str, str]
"""What it is for, and the command."""
LOG = "LOG"
"""In the place of a log that only the reader knows."""


def _option(name: str, value: str) -> str:
    """Return an option with its value, with a space before it; nothing for an empty value."""
    return f" {join([name, value])}" if value else ""


def _ranges(given: Given) -> str:
    """Return the options of what is used of a log."""
    starts, ends = ([each[k] for each in given.ranges] for k in (0, 1))
    return _option("--from", _times(starts)) + _option("--to", _times(ends))


def _times(times: Sequence[str | float | None]) -> str:
    return ",".join("" if time is None else str(time) for time in times)


def _log(given: Given) -> str:
    """Return the one log of a command, by its path there; `LOG` for several, and for what is in no log."""
    return join(given.logs) if len(given.logs) == 1 else LOG


def after_fit(label: str, accepted: bool, given: Given) -> list[Step]:
    """Return what follows a fit: use and judge an accepted model, else look for why it is none.

    Parameters
    ----------
    label, accepted
        Name with version of the model, and verdict.
    given
        Logs and options of the fit.
    """
    # A model is looked for where it was stored.
    vessel, stored = _option("--vessel", given.vessel), _option("--out", given.out)
    trained, used = _log(given), _ranges(given)
    lacks = ("See which physics the model lacks", f"ferryid diagnose {trained}{vessel}{used}")
    if not accepted:
        return [
            lacks,
            ("Plan a trial that shows more", f"ferryid plan{vessel} --after {trained}{used}"),
            ("Choose its settings by cross-validation", f"ferryid sweep both {trained}{vessel}{used}"),
        ]
    return [
        ("Judge it on the log of another day", f"ferryid evaluate {label} {LOG}{stored}"),
        lacks,
        ("See its coefficients with intervals", f"ferryid models {label}{stored}"),
        ("Use it in another program", f"ferryid export {label} --to python{stored}"),
    ]


def after_sweep(options: Sequence[str], beats_base: bool, given: Given) -> list[Step]:
    """Return what follows a sweep: a fit with its choice, or the search for what the base model lacks."""
    vessel, log, used = _option("--vessel", given.vessel), _log(given), _ranges(given)
    fit = ("Fit with the choice", f"ferryid fit {log}{vessel}{used} {join(options)}")
    lacks = ("See which physics the base model lacks", f"ferryid diagnose {log}{vessel}{used}")
    return [fit, lacks] if beats_base else [lacks]
