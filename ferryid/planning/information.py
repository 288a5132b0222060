"""How much a trial tells of the hull, and how well it separates effects: cross-products of responses, of each of its parts.

The information of parts adds up: the Fisher information of the hull's coefficients about a hull that is believed, beside the
prior, under the noise that the estimation itself finds.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from ferryid.diagnose.data import read_measurements, window_lengths
from ferryid.diagnose.inference import estimation_problem, fit, prior_force_model, windows
from ferryid.diagnose.judging import Key, Responses, candidates_of, response_columns
from ferryid.models import Model
from ferryid.types import IN_MEMORY, Floats, RunContext
from ferryid.vessel.profile import Profile


def information(
    log: str,
    profile: Profile,
    keys: Collection[Key] | None = (),
    ends_s: Sequence[float] = (),
    *,
    model: Model | None = None,
    run: RunContext = IN_MEMORY,
) -> list[Responses]:
    """Return what a log tells, in parts.

    Parameters
    ----------
    log
        Its path.
    profile
        The vessel, whose hull and prior it is.
    keys
        Effects whose responses are kept beside the hull's; all where None.
    ends_s
        Where parts end [s] after the log's start; what is behind the last one is left out. One part where empty.
    model
        That brings the hull; the profile's where None.
    run
        Folder of ingested tables, and progress.

    Returns
    -------
    list
        Of every part.
    """
    measurements, survey = read_measurements(log, profile, run)
    seen = windows(measurements, *window_lengths(profile))
    plain, spread = prior_force_model(seen.measurements, profile, model, survey.recording.sha256)
    problem = estimation_problem(seen, plain, spread)
    every = candidates_of(problem)
    wanted = every if keys is None else [one for one in every if one.key in keys]
    found, columns = response_columns(problem, fit(problem, ()), wanted)
    if not ends_s:
        return [replace(found, products=columns.T @ columns)]
    steps = problem.steps
    middle = 0.5 * (len(steps.weight) - 1) * steps.measurements.step_s
    at = np.repeat(steps.measurements.t[steps.starts] - steps.measurements.t[0] + middle, int(steps.channels.sum()))
    parts = []
    for first, end in zip((0.0, *ends_s[:-1]), ends_s, strict=True):
        own = columns[(at >= first) & (at < end)]
        parts.append(replace(found, products=own.T @ own))
    return parts


def deviations(found: Responses) -> Floats:
    """Return the standard deviations of the hull's coefficients beside the prior, in those of the prior, shape (26,).

    Effects whose responses are there are estimated too, each with its usual size as its prior.
    """
    return np.asarray(
        np.sqrt(np.diag(np.linalg.inv(found.products + np.eye(len(found.products))))[: len(found.hull_spread)])
    )
