"""What an oracle gains on clean logs by chance, and what it must therefore gain to name an effect.

A chi-squared distribution is what Wilks's theorem promises of a log without an effect. Choosing among places or coefficients, a
hull that is a little off, and a plant that is not the model all make gains larger. Whatever the reason, the tail of a
likelihood ratio's logarithm falls like an exponential, so that a dozen clean logs say roughly where one in a hundred lies,
and a few dozen say it well.

References
----------
Pickands (1975), Statistical inference using extreme order statistics, Annals of Statistics 3, 119-131: of what exceeds a high
level, here with the exponential tail.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import log
from typing import Any

import numpy as np

FALSE_SHARE = 0.01
"""Share of logs without an effect in which an oracle that is told it names it all the same."""
TAIL = 1.0 / 3.0
"""Share of the gains that are the tail."""
FEWEST = 8
"""Gains below which a tail is not looked at."""


def calibrated(clean: Iterable[Mapping[str, Any]]) -> dict[str, float]:
    """Return the gain that each effect must exceed to be named [nats]: never less than its floor.

    Parameters
    ----------
    clean
        What an oracle recovered of effects that it was told one at a time of clean logs, as
        `ferryid.prove.oracle.oracle_of_each` gives it in plain data: ``effect``, ``gain``, ``floor``. All thrusters of an
        effect count as one effect.
    """
    gains: dict[str, list[float]] = {}
    floors: dict[str, float] = {}
    for one in clean:
        gains.setdefault(one["effect"], []).append(float(one["gain"]))
        floors[one["effect"]] = max(floors.get(one["effect"], 0.0), float(one["floor"]))
    return {effect: max(floors[effect], exceeded(gains[effect])) for effect in gains}


def exceeded(gains: Iterable[float], share: float = FALSE_SHARE) -> float:
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
