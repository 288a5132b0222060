"""What folds of the training rows and windows of several lengths have in common: rows of the logs, and averages over them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ferryid.identify.weak_rows import WeakRows, average_over_windows, row_columns
from ferryid.regression.bases import Basis
from ferryid.signals.complementary_filter import complementary_filter
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats
from ferryid.vessel.profile import Profile

MOST_ROWS = 250_000
"""So many rows of all logs are kept, twice some thirty numbers each; of more, rows are made again each time."""


class SharedRows:
    """Rows of logs, made when they are first asked for and kept for as long as this is."""

    def __init__(self) -> None:
        # With what they were made of, so that the ids of that stay its own.
        self._steadied: dict[int, tuple[Motion, Floats]] = {}
        self._columns: dict[tuple[Any, ...], tuple[tuple[Any, ...], Mapping[str, Floats]]] = {}
        self._rows: dict[int, int] = {}
        self._windows: dict[tuple[Any, ...], WeakRows] = {}

    def velocity(self, motion: Motion, *, steadied: bool) -> Floats:
        """Return the velocity of a log, shape (n, 3): as measured, or with slow errors replaced by the position's."""
        if not steadied:
            return motion.nu
        if id(motion) not in self._steadied:
            found = complementary_filter(motion.nu, motion.nu, motion.eta, motion.rate_hz)
            self._steadied[id(motion)] = motion, found
        return self._steadied[id(motion)][1]

    def columns(
        self, motion: Motion, profile: Profile, scale: Mapping[str, float], functions: Basis, *, steadied: bool
    ) -> Mapping[str, Floats]:
        """Return `row_columns` of a log."""
        made_of = motion, profile, functions
        key = self._key(motion, profile, scale, functions, steadied)
        if key in self._columns:
            return self._columns[key][1]
        velocity = self.velocity(motion, steadied=steadied)
        if steadied and motion.tau_steadied is not None:
            motion = replace(motion, tau=motion.tau_steadied)
        found = row_columns(motion, profile, scale, functions, velocity)
        rows = {**self._rows, id(made_of[0]): len(motion.t)}
        if sum(rows.values()) <= MOST_ROWS:
            self._rows = rows
            self._columns[key] = made_of, found
        return found

    def windows(
        self,
        motion: Motion,
        rows: Flags,
        profile: Profile,
        scale: Mapping[str, float],
        functions: Basis,
        length_s: float,
        *,
        steadied: bool,
    ) -> WeakRows:
        """Return `average_over_windows` of marked rows of a log, which both estimators of a fold ask for."""
        columns = self.columns(motion, profile, scale, functions, steadied=steadied)
        key = self._key(motion, profile, scale, functions, steadied)
        place = *key, length_s, rows.tobytes()
        if place in self._windows:
            return self._windows[place]
        velocity = self.velocity(motion, steadied=steadied)
        found = average_over_windows(motion, rows, profile, scale, functions, length_s, velocity, columns)
        if key in self._columns:
            self._windows[place] = found
        return found

    @staticmethod
    def _key(
        motion: Motion, profile: Profile, scale: Mapping[str, float], functions: Basis, steadied: bool
    ) -> tuple[Any, ...]:
        return id(motion), id(profile), id(functions), steadied, *sorted(scale.items())
