"""The verdict of a fit in one sentence, for its page, its JSON and a terminal."""

from __future__ import annotations

import numpy as np

from ferryid.counts import counted, verb
from ferryid.identify import FitOutcome
from ferryid.report.scale import scale_words
from ferryid.vessel import parse_profile


def headline_of(result: FitOutcome) -> str:
    """Return the verdict in one sentence."""
    change = result.acceptance.normalised_mse - 1.0
    hull = parse_profile(result.model.profile_text, result.model.name).hull
    base = "the base model's" if hull.has_model else "that of the base model, which is rigid-body mass alone,"
    scaled = scale_words(result.model.scale)
    if scaled and hull.has_model:
        base = f"that of the base model as fitted ({scaled})"
    if not np.isfinite(change):
        told = f"its {result.scores.measure} error could not be compared with the base model's"
    else:
        word = "below" if change < 0 else "above"
        told = (
            f"mean square {result.scores.measure} error {100.0 * abs(change):.1f} % {word} {base} on data it did not see"
            f"{_interval(result)}"
        )
    count = len(result.warnings)
    trust = (
        f" Read the {counted(count, 'warning')} first." if count > 1 else " Read the warning first." if count else ""
    )
    if result.acceptance.accepted:
        return f"Accepted: {told}.{trust}"
    failed = [check for check in result.acceptance.checks if check.passed is False]
    why = f", but {counted(len(failed), 'condition')} {verb(len(failed), 'fails')}" if failed and change < 0 else ""
    return f"Not accepted: {told}{why}.{_nothing_to_improve(result)}"


def _interval(result: FitOutcome) -> str:
    """Return the ratio of the squared errors with its 95 % interval, in brackets; nothing where there is none."""
    if result.scores.interval is None:
        return ""
    low, high = result.scores.interval
    return f" (ratio {result.acceptance.normalised_mse:.3g}, 95 % interval {low:.3g} to {high:.3g})"


def _nothing_to_improve(result: FitOutcome) -> str:
    """Return that the base model serves as it is, where that is why the new one is not better: it is no failure of the log."""
    least = result.base_fits_already
    return (
        ""
        if least is None
        else f" Nothing to improve: the base model fits already (R² {least:.2f} or more on every axis)."
    )
