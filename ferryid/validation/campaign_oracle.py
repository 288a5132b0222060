"""The oracle of a campaign: what its logs show of effects whose identity is known, with a hull model that is off by 10 %."""

from __future__ import annotations

import time
from collections.abc import Sequence
from math import sqrt

from scipy.optimize import brentq
from scipy.stats import ncx2

from ferryid.diagnose.inference import INFERENCE
from ferryid.errors import FerryIdError
from ferryid.validation.case import Truth
from ferryid.validation.detection_curves import RELIABLE
from ferryid.validation.oracle import floor_of, oracle
from ferryid.validation.records import OracleEstimate, OracleResult
from ferryid.vessel.profile import Profile


def campaign_oracle(logs: Sequence[str], profile: Profile, truths: Sequence[Truth], first_log: int = 0) -> OracleResult:
    """Return the gains of effects over all logs of a campaign; each log estimates them by itself.

    Parameters
    ----------
    logs
        Paths, in the order of the campaign.
    profile
        The vessel, with a hull model.
    truths
        What is in the logs: effects, instances and times are used, values never.
    first_log
        Number of the log from which on the first of `truths` acts.

    Raises
    ------
    FerryIdError
        Where no log can be used.
    """
    start, found, why = time.perf_counter(), list[OracleResult](), ""
    for number, log in enumerate(logs):
        given = [truth for truth in truths if truth is not truths[0] or number >= first_log]
        try:
            found.append(oracle(log, profile, given, fewest_windows=INFERENCE.campaign_windows))
        except FerryIdError as error:  # a log of a minute with gaps may hold nothing that can be fitted
            why = why or str(error)
    if not found:
        raise FerryIdError(why)
    every = [one for result in found for one in result.recovered]
    together = tuple(_together(truth, [one for one in every if one.key == truth.key]) for truth in truths)
    return OracleResult(sum(one.gain for one in found), together, time.perf_counter() - start)


def deviation(estimate: OracleEstimate) -> float:
    """Return by how many standard deviations an effect changes the logs, without bias in its square.

    Twice the gain of an effect that changes the whitened data by ``d`` is ``d² + k`` on average, with ``k`` parameters.
    """
    return sqrt(max(2.0 * estimate.gain - estimate.free, 0.0))


def _together(truth: Truth, some: Sequence[OracleEstimate]) -> OracleEstimate:
    """Return the estimates of one effect in several logs as one, without its parameters."""
    able = [one for one in some if not one.cannot]
    if not able:
        return OracleEstimate(*truth.key, 0.0, 0, floor_of(1), cannot=some[0].cannot if some else "no log can be used")
    free = sum(one.free for one in able)
    idle = 2 * sum(one.idle for one in able) > len(able)
    return OracleEstimate(*truth.key, sum(one.gain for one in able), free, floor_of(free), idle=idle)


def visible(free: int) -> float:
    """Return by how many standard deviations an effect must change the logs to be named 19 times in 20.

    That of `free` parameters has, with the floor that chance exceeds in `FALSE_SHARE` of logs, a noncentral chi-squared
    distribution.
    """
    floor = 2.0 * floor_of(free)
    return sqrt(brentq(lambda square: ncx2.sf(floor, max(free, 1), square) - RELIABLE, 0.1, 1e4))
