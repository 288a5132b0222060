"""Whether the library's own effect explains what was concealed, and whether the vessel follows what its actuators claim."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ferryid.diagnose.data import measure_log, read_measurements
from ferryid.effects import effects
from ferryid.effects.force_model import hull_of
from ferryid.effects.measurements import hull_force_model
from ferryid.identify.engagement import unanswered_force
from ferryid.types import RunContext
from ferryid.validation.case import Truth
from ferryid.validation.recorded.effects.effect import length_of
from ferryid.validation.recorded.log import RecordedLog
from ferryid.validation.recorded.writing import write_log
from ferryid.vessel import load_profile

LITTLE = 0.01
"""Share of the largest change of a force below which what an axis has of it is not looked at."""


def left_over(log: RecordedLog, made: RecordedLog, truth: Truth) -> float:
    """Return the share of the squared change of the actuators' force that the library's effect leaves, on the worst axis.

    Parameters
    ----------
    log, made
        The recording as it was, and with its record changed.
    truth
        An effect of an actuator that acts all along.
    """
    effect, measured = effects()[truth.effect], log.measurements
    with TemporaryDirectory() as folder:
        again = read_measurements(str(write_log(made, Path(folder), "altered")), log.profile)[0]
    p = np.array([truth.values.get(one.name, one.neutral) for one in effect.parameters_of(log.profile)])
    back = effect.apply(hull_force_model(again, hull_of(log.profile)), p, truth.instance)
    acted = measured.parts.sum(axis=1)
    claimed, given = (
        np.column_stack([np.interp(measured.t, again.t, one) for one in parts.sum(axis=1).T])
        for parts in (again.parts, back.parts)
    )
    rows = measured.usable & np.isfinite(claimed + given + acted).all(axis=1)
    changed, left = (np.sum((one - acted)[rows] ** 2, axis=0) for one in (claimed, given))
    scale = np.array([1.0, 1.0, length_of(log)]) ** -2
    seen = changed * scale > LITTLE**2 * float((changed * scale).max())
    return float(np.max(left[seen] / changed[seen], initial=0.0))


@cache
def unfollowed(path: str, profile_path: str) -> str:
    """Return how little the vessel of a log follows what its actuators claim, as a clause; empty where it does."""
    profile = load_profile(profile_path)
    with TemporaryDirectory() as folder:
        response = measure_log(path, profile, RunContext(Path(folder), keep_tables=False)).response
    return unanswered_force(response, profile).partition(": ")[0]
