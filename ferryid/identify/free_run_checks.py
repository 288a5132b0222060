"""Whether free runs of a model are worse than those of another one from the same starts: divergence, and paired errors."""

from __future__ import annotations

import numpy as np

from ferryid.counts import counted
from ferryid.effects.wording import listed
from ferryid.identify.acceptance import Check
from ferryid.identify.thresholds import IDENTIFY
from ferryid.models.prediction import FreeRun, SingleRuns
from ferryid.types import Flags, Floats, Ints

JUDGED_S = (10.0, 30.0, 60.0)
"""Horizons of the comparison [s]."""
_DEGREES = 180.0 / np.pi
_QUANTITIES = (("position", 0, "m", 1.0), ("heading", 1, "deg", _DEGREES), ("yaw rate", 3, "deg/s", _DEGREES))
"""Name, column of the errors, unit, and factor on SI."""


def free_run_checks(old: FreeRun, new: FreeRun, reference: str = "base model") -> tuple[Check, ...]:
    """Return whether a model runs free no worse than another one, on the same rows.

    At each of `JUDGED_S` the absolute errors of position, heading and yaw rate are compared run by run. The interval of
    their mean difference is Student's, from the scatter between clusters of runs: the unbroken held-out stretches, cut
    into blocks of `IDENTIFY.block_s`, or of the horizon where that is longer. Only an interval wholly above zero is worse.

    Parameters
    ----------
    old, new
        Free runs of both models.
    reference
        What the old model is called in the reasons.
    """
    if old.single is None:
        return (_not_compared("free_run", f"Free runs are not compared: {old.note}."), *_turns(new))
    if new.single is None:
        reason = f"The new model cannot be run free, the {reference} can: {new.note}."
        return (Check("free_run", False, 0.0, float(old.starts), "runs", reason),)
    checks = [_divergence(old.single, new.single, reference), *_turns(new)]
    missing = []
    for horizon_s in JUDGED_S:
        columns = np.flatnonzero(np.isclose(old.horizons_s, horizon_s))
        both = old.single.reached[:, columns] & new.single.reached[:, columns]
        if both.any():
            checks += _at_horizon(old.single, new.single, int(columns[0]), horizon_s, both[:, 0], reference)
        else:
            missing.append(f"{horizon_s:g} s")
    if missing:
        reason = (
            f"No unbroken held-out stretch is long enough for free runs of {' or '.join(missing)}: not compared there."
        )
        checks.append(_not_compared("free_run_horizons", reason))
    return tuple(checks)


def _not_compared(name: str, reason: str) -> Check:
    return Check(name, None, float("nan"), float("nan"), "runs", reason)


def _divergence(old: SingleRuns, new: SingleRuns, reference: str) -> Check:
    """Return whether no run of the new model diverges where the old one's does not."""
    lost = np.any(new.reached & np.isnan(new.errors[:, :, 2]) & ~np.isnan(old.errors[:, :, 2]), axis=1)
    count = int(lost.sum())
    reason = (
        f"In {count} of {counted(len(lost), 'free run')} the new model had diverged at a horizon at which the "
        f"{reference} had not" + (", and none may: do not simulate with it." if count else ".")
    )
    return Check("divergence", count == 0, float(count), 0.0, "runs", reason)


def _turns(new: FreeRun) -> tuple[Check, ...]:
    """Return whether the heading stays near in the shortest runs, however bad those of the other model are.

    Empty where no held-out stretch is long enough for a run.
    """
    short = np.flatnonzero((new.horizons_s <= IDENTIFY.useless_s) & np.isfinite(new.heading_rad))
    if not short.size:
        return ()
    first = short[0]
    off, most = (float(np.degrees(one)) for one in (new.heading_rad[first], IDENTIFY.useless_rad))
    useless = ": it does not describe how this vessel turns. Was anything else moving it, or an actuator not engaged?"
    reason = (
        f"Run free for {new.horizons_s[first]:g} s the new model's heading is off by {off:.3g}° (rms), and {most:.0f}° is "
        f"allowed{'.' if off <= most else useless}"
    )
    return (Check("free_run_heading", off <= most, off, most, "deg", reason),)


def _at_horizon(
    old: SingleRuns, new: SingleRuns, column: int, horizon_s: float, reached: Flags, reference: str
) -> list[Check]:
    """Return whether each of `_QUANTITIES` is predicted no worse after a horizon; one check where no interval is possible."""
    some = np.isfinite(old.errors[:, column] + new.errors[:, column])
    known = [quantity for quantity in _QUANTITIES if some[:, quantity[1]].any()]
    paired = reached & some[:, [which for _, which, _, _ in known]].all(axis=1)
    clusters = _clusters(old, max(IDENTIFY.block_s, horizon_s))[paired]
    stretches = np.unique(clusters).size
    if stretches < 2:
        worse = []
        for label, which, unit, factor in known if stretches else ():
            before, after = (float(one.errors[paired, column, which].mean()) * factor for one in (old, new))
            if after > before:
                worse.append(f"{label} {after:.3g} {unit} against {before:.3g}")
        reason = (
            f"Free runs of {horizon_s:g} s lie in {counted(stretches, 'held-out block')}, and their scatter is not known: "
            f"not compared there{f', where the new model errs more (mean {listed(worse)})' if worse else ''}."
        )
        return [_not_compared(f"free_run_{horizon_s:g}s", reason)]
    checks = []
    for label, which, unit, factor in known:
        before, after = (one.errors[paired, column, which] * factor for one in (old, new))
        mean, low, high = paired_interval(after - before, clusters)
        reason = (
            f"After {horizon_s:g} s of free run the mean {label} error is {after.mean():.3g} {unit}, the {reference}'s "
            f"{before.mean():.3g} {unit}: a difference of {mean:+.3g} {unit} ({100.0 * IDENTIFY.free_run_level:.0f} % interval "
            f"{low:+.3g} to {high:+.3g}, {counted(len(before), 'run')} in {stretches} held-out blocks)"
            + (". The interval must reach below zero: the model predicts motion worse there." if low > 0.0 else ".")
        )
        name = f"free_run_{label.replace(' ', '_')}_{horizon_s:g}s"
        checks.append(Check(name, not low > 0.0, low, 0.0, unit, reason))
    return checks


def _clusters(runs: SingleRuns, block_s: float) -> Ints:
    """Return the cluster of each run, shape (N,): its unbroken stretch, cut into blocks of so many seconds by its start."""
    stretch = np.unique(np.column_stack([runs.log, runs.end]), axis=0, return_inverse=True)[1].reshape(-1)
    first = np.full(stretch.max() + 1, np.iinfo(np.int64).max)
    np.minimum.at(first, stretch, runs.start)
    block = ((runs.start - first[stretch]) / runs.rate_hz / block_s + 1e-9).astype(np.int64)
    return np.unique(np.column_stack([stretch, block]), axis=0, return_inverse=True)[1].reshape(-1)


def paired_interval(difference: Floats, clusters: Ints) -> tuple[float, float, float]:
    """Return the mean of paired differences and the ends of its interval, from the scatter between two or more clusters.

    The variance is that of a mean of clusters of unequal size (Liang and Zeger 1986) with the factor G/(G - 1), the
    quantile Student's with G - 1 degrees of freedom.
    """
    # Takes a tenth of a second to load, and not every fit has clusters.
    from scipy.special import stdtrit

    mean = float(difference.mean())
    which = np.unique(clusters, return_inverse=True)[1].reshape(-1)
    sums = np.bincount(which, weights=difference - mean)
    count = len(sums)
    error = float(np.sqrt(count / (count - 1) * np.sum(sums**2)) / len(difference))
    reach = float(stdtrit(count - 1, 0.5 + IDENTIFY.free_run_level / 2)) * error
    return mean, mean - reach, mean + reach
