"""The oracle of a campaign: what its logs show together of effects whose identity is known, on a hull that is known too."""

from __future__ import annotations

import time
from collections.abc import Sequence
from math import sqrt

from ferryid.errors import FerryIdError
from ferryid.validation.case import Truth
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
        The vessel, with its hull model.
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
            found.append(oracle(log, profile, given))
        except FerryIdError as error:  # a log of a minute with gaps may hold nothing that can be fitted
            why = why or str(error)
    if not found:
        raise FerryIdError(why)
    every = [one for result in found for one in result.recovered]
    together = tuple(_together([one for one in every if one.key == truth.key]) for truth in truths)
    return OracleResult(sum(one.gain for one in found), together, time.perf_counter() - start)


def deviation(estimate: OracleEstimate) -> float:
    """Return by how many standard deviations an effect changes the logs, without bias in its square.

    Twice the gain of an effect that changes the whitened data by ``d`` is ``d² + k`` on average, with ``k`` parameters.
    """
    return sqrt(max(2.0 * estimate.gain - estimate.free, 0.0))


def _together(some: Sequence[OracleEstimate]) -> OracleEstimate:
    """Return the estimates of one effect in several logs as one, without its parameters."""
    able = [one for one in some if not one.cannot]
    if not able:
        return some[0]
    free = sum(one.free for one in able)
    idle = 2 * sum(one.idle for one in able) > len(able)
    effect, instance = able[0].key
    return OracleEstimate(effect, instance, sum(one.gain for one in able), free, floor_of(free), idle=idle)
