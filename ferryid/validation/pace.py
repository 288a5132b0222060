"""How long a validation run will still take, over all of its stages."""

from __future__ import annotations

import time
from collections.abc import Sequence

from ferryid.batch.remaining import told_time

COST = {"writing logs": 0.1, "diagnosing": 1.0, "oracle": 0.45, "transfer": 0.25, "rivals": 0.25}
"""Time that a case takes in a stage, over that of its diagnosis, as measured; what is ahead is judged by it."""
USUAL = 0.3
"""Of a stage that is not among them."""


class Pace:
    """Time left of all stages, from what was done in this one and in those before.

    Parameters
    ----------
    stages
        Their names, in order.
    cases
        Number of cases, each of which goes through every stage.
    """

    def __init__(self, stages: Sequence[str], cases: int) -> None:
        self._stages, self._cases = tuple(stages), cases
        self._seconds = self._cost = 0.0
        self._begun = time.monotonic()

    def begin(self) -> None:
        """Note that a stage begins."""
        self._begun = time.monotonic()

    def begun(self, stage: str, done: int) -> str:
        """Return what is told before any case of a stage is done now."""
        place, count = self._stages.index(stage) + 1, len(self._stages)
        return f"{stage}: {done} of {self._cases}" + (f", stage {place} of {count}" if count > 1 else "")

    def told(self, stage: str, done: int, now: int) -> str:
        """Return what is told when `done` cases are done, `now` of them since `begin`."""
        elapsed_s = time.monotonic() - self._begun
        here_s = elapsed_s / now * (self._cases - done)
        # Stages differ in what a case costs; how fast this machine is shows in all that it has done.
        pace_s = (self._seconds + elapsed_s) / (self._cost + now * self._of(stage))
        ahead = self._stages[self._stages.index(stage) + 1 :]
        ahead_s = pace_s * self._cases * sum(self._of(name) for name in ahead)
        if done == self._cases:
            self._seconds += elapsed_s
            self._cost += now * self._of(stage)
        return f"{self.begun(stage, done)}, {told_time(here_s + ahead_s)} left in all"

    def _of(self, stage: str) -> float:
        return COST.get(stage, USUAL)
