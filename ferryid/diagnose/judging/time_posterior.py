"""The posterior of a time, such as an onset, by as few fits as its form needs.

An idle thruster hides its fault, so that the posterior may be wide, and have several tops. The log evidence is followed to both
sides in steps that grow, and then halved between neighbours wherever that changes the share of the posterior that lies between
them: far down a bend has to be large to change any quantile.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from math import exp, inf

import numpy as np

from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.side_by_side import over
from ferryid.types import Floats

TIME_STEP, LONGEST_STEP = 0.125, 1.0
"""First and longest step between times that are weighed, in lengths of a window."""
TIME_FINE_S = 0.2
"""Fine step between times that are compared [s]: that of the forces."""
TIMES_AT_ONCE = 4
"""Times to either side that are weighed before it is seen whether to go on, and the step is doubled."""
BENT_SHARE, LARGEST_SHARE = 1e-3, 0.02
"""Shares of the posterior: by how much a time may change what lies between its neighbours before times on either side of it are
weighed, and the most that lies between two times in any case."""


@dataclass
class TimePosterior:
    """What is known of a time.

    Attributes
    ----------
    evidence_at
        Log evidence of a time [s].
    first, last
        Between which it lies [s].
    tried
        Log evidence of times that were weighed.
    """

    evidence_at: Callable[[float], float]
    first: float
    last: float
    tried: dict[float, float] = field(default_factory=dict)

    @classmethod
    def about(
        cls, evidence_at: Callable[[float], float], here: float, first: float, last: float, window_s: float
    ) -> TimePosterior:
        """Return the posterior about a time that is likely.

        Parameters
        ----------
        evidence_at, first, last
            As of the class; several times are weighed at once, on threads.
        here
            Where to begin [s].
        window_s
            Length of a window [s], within which evidence changes little.
        """
        made = cls(evidence_at, first, last, {here: evidence_at(here)})
        made._follow(here, window_s)
        # About the likeliest it changes within a step.
        fine = round(TIME_STEP * window_s / TIME_FINE_S)
        likeliest = max(made.tried, key=made.tried.__getitem__)
        made._try((likeliest + TIME_FINE_S * np.arange(-fine, fine + 1)).tolist())
        made._refine()
        return made

    def quantiles(self, shares: Floats) -> Floats:
        """Return times before which the posterior has these shares [s]; it is as wide as that of other parameters."""
        moments = np.array(sorted(self.tried))
        every = np.union1d(moments, np.arange(moments[0], moments[-1], TIME_FINE_S))
        known = np.array([self.tried[time] for time in moments.tolist()])
        log_weights = np.interp(every, moments, known) / INFERENCE.posterior_factor**2
        # Each moment stands for the time about it.
        edges = np.concatenate([every[:1], 0.5 * (every[1:] + every[:-1]), every[-1:]])
        edges[[0, -1]] += np.array([-0.5, 0.5]) * TIME_FINE_S
        weights = np.exp(log_weights - log_weights.max()) * np.diff(edges)
        return np.asarray(np.interp(shares, np.concatenate([[0.0], np.cumsum(weights) / weights.sum()]), edges))

    def _try(self, moments: Iterable[float]) -> None:
        new = list[float]()
        for one in moments:
            known = min(abs(one - other) for other in (*self.tried, *new)) <= 0.5 * TIME_FINE_S
            if self.first < one < self.last and not known:
                new.append(one)
        self.tried.update(zip(new, over(self.evidence_at, new), strict=True))

    def _follow(self, here: float, window_s: float) -> None:
        """Weigh times to both sides until they are too unlikely for another top beyond them."""
        counts, step = np.arange(1, TIMES_AT_ONCE + 1), TIME_STEP * window_s
        within = self.first + 0.5 * TIME_FINE_S, self.last - 0.5 * TIME_FINE_S
        ends = {-1.0: here, 1.0: here}
        while ends:
            new = {side: (end + side * step * counts).tolist() for side, end in ends.items()}
            # A long step must not leave out what lies before the end of what is possible.
            self._try(np.clip([time for times in new.values() for time in times], *within).tolist())
            lowest = max(self.tried.values()) - JUDGING.time_drop
            ends = {
                side: times[-1]
                for side, times in new.items()
                if min(self.tried.get(one, -inf) for one in times) >= lowest
            }
            step = min(2.0 * step, LONGEST_STEP * window_s)

    def _refine(self) -> None:
        """Weigh times between neighbours until those in between change no share of the posterior by what counts."""
        lowest = max(self.tried.values()) - JUDGING.fine_time_drop
        gaps = [pair for pair in pairwise(sorted(self.tried)) if max(self.tried[one] for one in pair) > lowest]
        while gaps := [(a, b) for a, b in gaps if b - a > 1.5 * TIME_FINE_S]:
            self._try([0.5 * (a + b) for a, b in gaps])
            top = max(self.tried.values())
            whole = sum(self._mass(a, b, top) for a, b in pairwise(sorted(self.tried)))
            halved = [((a, 0.5 * (a + b)), (0.5 * (a + b), b), self._mass(a, b, top) / whole) for a, b in gaps]
            gaps = []
            for first, second, before in halved:
                shares = [self._mass(*one, top) / whole for one in (first, second)]
                bent = abs(sum(shares) - before) > BENT_SHARE
                gaps += [
                    one for one, share in zip((first, second), shares, strict=True) if bent or share > LARGEST_SHARE
                ]

    def _mass(self, before: float, after: float, top: float) -> float:
        """Return the posterior between two times, over its density at a top, if its logarithm lies on a line between them."""
        a, b = ((self.tried[one] - top) / INFERENCE.posterior_factor**2 for one in (before, after))
        # The mean of an exponential between two ends.
        mean = exp(0.5 * (a + b)) if abs(b - a) < 1e-3 else (exp(b) - exp(a)) / (b - a)
        return (after - before) * mean
