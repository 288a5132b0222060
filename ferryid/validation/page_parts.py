"""What pages of a proof have in common: detection curves over the sizes tried, rows of errors, shares and numbers as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, isfinite, sqrt
from typing import Any

import numpy as np

from ferryid.counts import counted, verb
from ferryid.report.html import template
from ferryid.report.validation_figures import Answers, parameter_errors
from ferryid.types import Floats
from ferryid.validation.detection_curves import Curve
from ferryid.validation.estimate_errors import WITHIN, EstimateErrors, Outside
from ferryid.validation.name_scores import Share
from ferryid.validation.targets import Target

BEYOND = 1.3
"""How far the axis of a detection curve goes beyond the sizes tried, as a factor."""
POINTS = 120
"""Of a drawn curve."""
KNOWN = 2.0
"""A size that is known well is known to such a factor either way."""


def render(
    name: str,
    result: Mapping[str, Any],
    seconds: tuple[float, float],
    targets: Sequence[Target],
    recoveries: Sequence[EstimateErrors],
    context: Mapping[str, Any],
) -> str:
    """Return a page as Markdown.

    Parameters
    ----------
    name
        Of the template.
    result
        Seed, commitment, counts and settings of the run.
    seconds
        Of the median diagnosis, and of the slowest.
    targets
        And whether they were reached.
    recoveries
        Errors of everything first, then by effect.
    context
        What this page has besides.
    """
    every = recoveries[0]
    shared = {
        "result": result,
        "command": command(result),
        "lost": [f"{result['counts'][name]} {name}" for name in ("refused", "crashed") if result["counts"][name]],
        "seconds": tuple(f"{one:.0f}" for one in seconds),
        "targets": targets,
        "every": every,
        "median_error": percent(every.median_error),
        "errors": [error_row(one) for one in recoveries[1:]],
        "has_errors": any(one.errors for one in recoveries[1:]),
        "outside": [outside_row(one) for one in every.outside],
    }
    return template(name).render({**shared, **context})


def command(result: Mapping[str, Any]) -> str:
    """Return the command that made a run."""
    settings = result["settings"]
    real = f" --real {settings['real']}" if "real" in settings else ""
    vessel = f" --vessel {settings['vessel']}" if "vessel" in settings else ""
    runs = f" --runs {settings['runs']:g}" if settings["runs"] != 1.0 else ""
    only = f" --only {','.join(settings['only'])}" if settings["only"] else ""
    return f"ferryid prove{real}{vessel} --seed {result['seed']}{runs}{only}"


def error_figure(recoveries: Sequence[EstimateErrors]) -> dict[str, str]:
    """Return the figure of parameter errors by its file name; none where nothing was named."""
    found = {one.effect: one.errors for one in recoveries[1:] if one.errors}
    return {"errors.svg": parameter_errors(found, WITHIN)} if found else {}


def answers(sizes: Sequence[float], named: Sequence[bool], fitted: Curve) -> Answers:
    """Return runs with their fitted curve, for a figure."""
    x: Floats = np.geomspace(fitted.least, fitted.most, POINTS)
    return Answers(np.asarray(sizes), np.asarray(named, dtype=bool), x, fitted.share(x))


def how_well_known(every: Sequence[Curve]) -> str:
    """Return how well the sizes that are named 19 times in 20 are known, as a sentence; empty where none is among those tried.

    A size is known to a factor of two where the ends of its interval are no more than four apart.
    """
    inside = [one for one in every if one.size is not None]
    if not inside:
        return ""
    apart = [sqrt(one.high / one.low) if one.low > 0.0 and one.high < inf else inf for one in inside]
    middle = float(np.median(apart))
    text = f"a factor of {middle:.1f}" if isfinite(middle) else "no factor, as one end is open"
    known = sum(one <= KNOWN for one in apart)
    return (
        f"Of {counted(len(every), 'such size')} {len(inside)} {verb(len(inside), 'is')} among the sizes tried and known to "
        f"{text} either way in the median, {known} of them to a factor of two or better."
    )


def error_row(one: EstimateErrors) -> tuple[Any, ...]:
    """Return errors of the parameters of one effect as cells of a table."""
    return one.effect, one.found, percent(one.median_error), few(one.within), few(one.covered), few(one.in_time)


def outside_row(one: Outside) -> tuple[str, ...]:
    """Return an interval that does not hold the truth as cells of a table."""
    found = one.estimate
    interval = f"{found.value:.3g} ({found.low:.3g} to {found.high:.3g})"
    return one.cell, one.effect, one.parameter, f"{one.truth:.3g}", interval, ", ".join(one.beside) or "nothing"


def few(share: Share) -> str:
    """Return a share as its counts; empty where there is none."""
    return f"{share.count}/{share.of}" if share.of else ""


def percent(value: float) -> str:
    """Return a share in per cent."""
    return f"{100.0 * value:.1f} %" if isfinite(value) else "none"
