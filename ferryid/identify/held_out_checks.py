"""Whether enough data were held out for a verdict, and whether the model predicts them at all."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ferryid.counts import counted
from ferryid.identify.acceptance import Check
from ferryid.identify.thresholds import IDENTIFY
from ferryid.models import ForceScores
from ferryid.types import AXES


def skill_checks(scores: ForceScores, undetermined: Collection[str] = ()) -> tuple[Check, ...]:
    """Return whether the model predicts held-out acceleration better than a velocity that does not change.

    The base model may be a rigid body without damping, which any correction betters. A skill score that is not positive says
    that the model is of no use to predict motion (Murphy 1988). The mean of the axes is geometric, so that twice the error on
    one weighs as much as half of it on another. Empty where errors are not those of an acceleration, as of logs that are too
    short for windows, and of archives.

    An axis whose inertia the data leave open has to have skill of its own. The bound at which it is held goes with the
    profile's inertia: one that is stated too large makes room for it, and the model answers the moment less and less.

    Parameters
    ----------
    scores
        Of the held-out rows.
    undetermined
        Axes whose inertia is held at its upper bound while the data do not determine it.
    """
    still = scores.mse_constant_velocity
    known = np.isfinite(still) & np.isfinite(scores.mse_model) & (still > 0.0)
    if not known.any():
        return ()
    ratio = scores.mse_model[known] / still[known]
    with np.errstate(divide="ignore"):
        mean = float(np.exp(np.mean(np.log(ratio))))
    axes = ", ".join(f"{AXES[axis]} {one:.2g}" for axis, one in zip(np.flatnonzero(known), ratio.tolist(), strict=True))
    # "1 times, and less than 1 is needed" would not say which side of it a ratio lies on.
    times = next(said for digits in range(2, 18) if (said := f"{mean:.{digits}g}") != "1" or mean == 1.0)
    told = (
        f"The squared prediction error is {times} times that of a velocity that does not change "
        f"(geometric mean of {axes})"
    )
    if mean < 1.0:
        told += "."
    else:
        told += (
            ", and less than 1 is needed: a prediction of no acceleration at all errs less. Fix: record larger motions of "
            "the axes that err most, or check what drives them"
        )
    unit = "of the MSE of a constant velocity"
    checks = [Check("constant_velocity", mean < 1.0, mean, 1.0, unit, told)]
    for axis in np.flatnonzero(known).tolist():
        if AXES[axis] not in undetermined:
            continue
        own = float(scores.mse_model[axis] / still[axis])
        told = (
            f"In {AXES[axis]}, where the data do not determine the inertia, the squared prediction error is {own:.3g} times "
            "that of a velocity that does not change"
        )
        if own >= 1.0:
            cause = "inertia_z or k_zz_m" if AXES[axis] == "yaw" else "mass_kg"
            told += (
                ", and less than 1 is needed: nothing confirms the inertia at which the model is held. Fix: in the profile, "
                f"check {cause}, which sets that bound, and the force of the actuators"
            )
        checks.append(Check(f"constant_velocity_{AXES[axis]}", own < 1.0, own, 1.0, unit, f"{told}."))
    return tuple(checks)


def held_out_checks(seconds: float, blocks: int, split: str) -> tuple[Check, ...]:
    """Return whether validation data are long enough, and come in enough blocks.

    Parameters
    ----------
    seconds, blocks
        Length of the validation data [s], and number of blocks that they come in, over all logs.
    split
        How they were set apart.
    """
    least_s, least = IDENTIFY.validation_s, IDENTIFY.held_out_blocks
    more = "Fix: give longer logs, or more of them."
    time = f"Held-out data are {seconds:.0f} s long, and {least_s:g} s or more are needed"
    if split == "every-kth":
        found = (
            "Validation rows share smoothing windows with their neighbours that train, so that no block is held out, and "
            f"{least} are needed. Fix: --split blocks"
        )
    else:
        found = f"Held-out data come in {counted(blocks, 'block')}, and {least} or more are needed"
        found += "." if blocks >= least else f": fewer do not show how the error scatters. {more}"
    return (
        Check(
            "held_out_time",
            seconds >= least_s,
            seconds,
            least_s,
            "s",
            f"{time}." if seconds >= least_s else f"{time}. {more}",
        ),
        Check("held_out_blocks", blocks >= least, float(blocks), float(least), "blocks", found),
    )
