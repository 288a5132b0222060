"""The verdict of a fit in one sentence, for its page, its JSON and a terminal."""

from __future__ import annotations

import numpy as np

from ferryid.counts import counted, verb
from ferryid.effects.wording import listed
from ferryid.identify import FitOutcome
from ferryid.types import AXES
from ferryid.vessel import parse_profile


def below_zero(result: FitOutcome) -> str:
    """Return what an R² below zero of the new model means, in a sentence; empty where there is none."""
    scores = result.scores.force
    axes = [k for k in range(3) if np.isfinite(scores.r2_model[k]) and scores.r2_model[k] < 0.0]
    if not axes:
        return ""
    better = [AXES[k] for k in axes if scores.ratio[k] < 1.0]
    worse = [AXES[k] for k in axes if scores.ratio[k] >= 1.0]
    beside = [f"less than the base model in {listed(better)}"] if better else []
    beside += [f"no less than the base model in {listed(worse)}"] if worse else []
    verdict = (
        " The verdict compares with the base model, so that a model can be accepted all the same." if better else ""
    )
    return (
        f"R² below 0 in {listed([AXES[k] for k in axes])}: on the held-out data the new model errs more there than the mean of "
        f"what was measured would, {' and '.join(beside)}. Do not rely on it there: there is little motion on that axis, or "
        f"noise outweighs it.{verdict}"
    )


def headline_of(result: FitOutcome) -> str:
    """Return the verdict in one sentence."""
    change = result.acceptance.normalised_mse - 1.0
    hull = parse_profile(result.model.profile_text, result.model.name).hull
    base = "the base model's" if hull.has_model else "that of the base model, which is rigid-body mass alone,"
    if not np.isfinite(change):
        told = f"its {result.scores.measure} error could not be compared with the base model's"
    else:
        word = "below" if change < 0 else "above"
        told = f"mean square {result.scores.measure} error {abs(change):.1%} {word} {base} on data it did not see"
    count = len(result.warnings)
    trust = (
        f" Read the {counted(count, 'warning')} first." if count > 1 else " Read the warning first." if count else ""
    )
    if result.acceptance.accepted:
        return f"Accepted: {told}.{trust}"
    failed = [check for check in result.acceptance.checks if check.passed is False]
    why = f", but {counted(len(failed), 'condition')} {verb(len(failed), 'fails')}" if failed and change < 0 else ""
    return f"Not accepted: {told}{why}."
