"""Load of a wind that nobody measured, averaged over the windows of a log, as a function of the wind."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ferryid.effects.wind_loads import shape_of
from ferryid.identify.weak_rows import WeakRows
from ferryid.identify.wind_samples import mean_loads, mean_slopes
from ferryid.regression import window_rows, window_weights
from ferryid.signals.track import Motion
from ferryid.types import Floats, Ints
from ferryid.vessel.profile import Profile, WindAreas
from ferryid.vessel.wind import relative_wind_force, relative_wind_slope

_SAMPLES = 16
"""Points of a window at which the wind load is evaluated: it changes with heading and speed, not faster."""


@dataclass(frozen=True, eq=False)
class LoadSamples:
    """Points of the J windows of a log at which the wind load is evaluated, S a window.

    Attributes
    ----------
    psi
        Heading [rad], shape (J, S).
    nu
        Velocity [m/s, m/s, rad/s], shape (J, S, 3).
    weight
        Weight of each point, shape (S,).
    """

    psi: Floats
    nu: Floats
    weight: Floats


def sample_load(
    profile: Profile, motion: Motion, velocity: Floats, windows: WeakRows, length_s: float
) -> LoadSamples | None:
    """Return where the wind load of a log's windows is evaluated; None where there is none to estimate.

    Parameters
    ----------
    profile
        The vessel; without wind areas there is nothing to estimate.
    motion, velocity
        The log, and the velocity that enters products, shape (n, 3).
    windows
        Its windows.
    length_s
        Their length [s].
    """
    if profile.wind is None or motion.wind is not None or not np.any(windows.heading):
        return None
    offsets, weight = sample_weights(length_s, motion.rate_hz)
    places = windows.start[:, None] + offsets
    return LoadSamples(motion.eta[places, 2], velocity[places], weight)


def sample_weights(length_s: float, rate_hz: float) -> tuple[Ints, Floats]:
    """Return the rows of a window at which the wind load is evaluated and their weights, shape (S,) each."""
    rows = window_rows(length_s, rate_hz)
    offsets = np.unique(np.linspace(0, rows - 1, _SAMPLES + 2).round().astype(np.int64)[1:-1])
    weight = window_weights(rows, 1.0)[0][offsets]
    return offsets, weight / weight.sum()


class Load:
    """Wind load of one log, averaged over its windows, as a function of the wind."""

    def __init__(self, areas: WindAreas, samples: LoadSamples, zeta: float, *, many: bool = False) -> None:
        self.areas, self.weight, self.zeta, self.many = areas, samples.weight, zeta, many
        self.cos, self.sin = np.cos(samples.psi), np.sin(samples.psi)
        self.surge, self.sway = (np.ascontiguousarray(samples.nu[..., axis]) for axis in (0, 1))
        self.still = self._mean(np.zeros(2))

    def _mean(self, wind: Floats, every: int = 1) -> Floats:
        if self.many:
            return self._compiled_mean(wind, every)
        load = relative_wind_force(self.areas, *self._relative(wind, every))
        return np.asarray(np.einsum("jsa,s->ja", load, self.weight)) / self.zeta

    def _relative(self, wind: Floats, every: int = 1) -> tuple[Floats, Floats]:
        """Return the velocity relative to the air, ahead and aside, shape (J, S) each, or in one of so many windows."""
        north, east = (np.broadcast_to(part, (len(self.cos),))[::every, None] for part in np.asarray(wind).T)
        cos, sin = self.cos[::every], self.sin[::every]
        return self.surge[::every] - (cos * north + sin * east), self.sway[::every] - (cos * east - sin * north)

    def _compiled_mean(self, wind: Floats, every: int) -> Floats:
        cos, sin, surge, sway = (
            np.ascontiguousarray(one[::every]) for one in (self.cos, self.sin, self.surge, self.sway)
        )
        each = np.ascontiguousarray(np.broadcast_to(wind, (len(self.cos), 2))[::every])
        return np.asarray(mean_loads(each, cos, sin, surge, sway, self.weight, shape_of(self.areas))) / self.zeta

    def of(self, wind: Floats, every: int = 1) -> Floats:
        """Return the load beyond that of still air, shape (J, 3), or of one in so many windows.

        The wind is one for all, (2,), or one a window, (J, 2). The load of still air is in the hull's damping.
        """
        return self._mean(wind, every) - self.still[::every]

    def with_slope(self, wind: Floats) -> tuple[Floats, Floats]:
        """Return the load beyond that of still air, shape (J, 3), and its derivative by the wind, (J, 3, 2)."""
        if self.many:
            each = np.ascontiguousarray(np.broadcast_to(wind, (len(self.cos), 2)))
            load, slope = mean_slopes(
                each, self.cos, self.sin, self.surge, self.sway, self.weight, shape_of(self.areas)
            )
            return load / self.zeta - self.still, slope / self.zeta
        load, by_u, by_v = (
            np.einsum("jsa,s->jas", one, self.weight) for one in relative_wind_slope(self.areas, *self._relative(wind))
        )
        # The wind to north takes cos from the velocity ahead and gives sin to that aside, the one to east takes sin and cos.
        north = np.einsum("jas,js->ja", by_v, self.sin) - np.einsum("jas,js->ja", by_u, self.cos)
        east = -np.einsum("jas,js->ja", by_u, self.sin) - np.einsum("jas,js->ja", by_v, self.cos)
        return load.sum(axis=2) / self.zeta - self.still, np.stack([north, east], axis=2) / self.zeta


@dataclass(frozen=True, eq=False)
class BlownLoad:
    """Wind load of one log as a function of its mean wind, with the gusts that were found."""

    load: Load
    gusts: Floats

    def of(self, wind: Floats) -> Floats:
        """Return the load beyond that of still air under a mean wind (2,), shape (J, 3)."""
        return np.asarray(self.load.of(wind + self.gusts))
