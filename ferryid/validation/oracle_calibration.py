"""What an oracle gains on clean logs by chance, and what it must therefore gain to name an effect.

A chi-squared distribution is what Wilks's theorem promises of a log without an effect. Choosing among places or coefficients, a
hull that is a little off, and a plant that is not the model all make gains larger. Whatever the reason, the tail of a
likelihood ratio's logarithm falls like an exponential, so that a dozen clean logs give roughly where one in a hundred
lies, and a few dozen give it well.

References
----------
Pickands (1975), Statistical inference using extreme order statistics, Annals of Statistics 3, 119-131: of what exceeds a high
level, here with the exponential tail.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import log

import numpy as np

from ferryid.validation.records import OracleEstimate

FALSE_SHARE = 0.01
"""Share of logs without an effect in which an oracle names it all the same."""
TAIL = 1.0 / 3.0
"""Share of the gains that are the tail."""
FEWEST = 8
"""Gains below which a tail is not looked at."""


def calibrated_thresholds(clean: Iterable[OracleEstimate]) -> dict[str, float]:
    """Return the gain that each effect must exceed to be named [nats]: never less than its floor.

    Parameters
    ----------
    clean
        Estimates of effects one at a time in clean logs, from `ferryid.validation.oracle.oracle_of_each`. All thrusters of an
        effect count as one effect.
    """
    gains: dict[str, list[float]] = {}
    floors: dict[str, float] = {}
    for one in clean:
        gains.setdefault(one.effect, []).append(one.gain)
        floors[one.effect] = max(floors.get(one.effect, 0.0), one.floor)
    return {effect: max(floors[effect], tail_quantile(gains[effect])) for effect in gains}


def tail_quantile(gains: Iterable[float], share: float = FALSE_SHARE) -> float:
    """Return the value that a share of gains exceeds, by the exponential tail of the largest; 0 for fewer than `FEWEST`.

    Parameters
    ----------
    gains
        Of chance [nats].
    share
        Less than `TAIL`.
    """
    every = np.sort(np.asarray(list(gains), dtype=np.float64))
    if len(every) < FEWEST:
        return 0.0
    first = len(every) - round(TAIL * len(every))
    level = float(every[first - 1])
    fall = float(np.mean(every[first:] - level))
    return level + fall * log((len(every) - first) / (share * len(every)))
