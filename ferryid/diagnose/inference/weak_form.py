"""The weak form: equations of motion averaged over windows, so that no noisy signal is ever differentiated.

A window's weight w and its first derivatives vanish at both ends, so that integration by parts moves every derivative
onto w: ``∫ w p'' = ∫ w'' p`` for a position, ``∫ w nu' = -∫ w' nu`` for a velocity. Either is compared with the
acceleration that a force model gives, averaged with the same weight. Where positions were measured they alone
are used: what they leave is steadier over the seconds in which forces act. Long windows show and judge what is left over;
hypotheses are fitted in short steps, by the filter of `ferryid.diagnose.inference.noise_model`.

References
----------
Shinbrot (1957); Messenger and Bortz (2021), Weak SINDy, for the choice of test functions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ferryid.cached import cached_property
from ferryid.compiled import compiled
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects.equations_of_motion import MASSES, damping_changes, over_ground, pushes, to_ground
from ferryid.effects.force_model import ForceModel, Measurements, as_measured, hull_changes, plainly_damped
from ferryid.regression import window_weights
from ferryid.types import Floats, Ints
from ferryid.vessel.dimensions import window_seconds

CHANNELS = ("north", "east", "heading", "surge", "sway", "yaw rate")
"""Where the measured acceleration comes from: second derivative of the first three, first of the others."""


@dataclass(frozen=True)
class Windows:
    """Windows of measurements.

    Attributes
    ----------
    measurements
        What was measured, at the rate of the forces.
    starts
        First row of every window, shape (J,); every window lies in measured data.
    runs
        Windows of an unbroken series, as (first, end) of `starts`.
    weight
        w [1/s] on the rows of a window, shape (m,).
    measured
        Measured accelerations in the order of `CHANNELS`, shape (J, 6).
    channels
        Which of them are used: those of position and heading, or the others where there is no position, shape (6,).
    """

    measurements: Measurements
    starts: NDArray[np.int64]
    runs: tuple[tuple[int, int], ...]
    weight: Floats
    measured: Floats
    channels: NDArray[np.bool_]

    @property
    def middle_s(self) -> Floats:
        """Time of the middle of every window [s], shape (J,)."""
        return self.measurements.t[self.starts] + 0.5 * (len(self.weight) - 1) * self.measurements.step_s

    def mean(self, values: Floats) -> Floats:
        """Return ``∫ w f dt`` in every window, shape (J,) or (J, c), of values with n rows."""
        return _means(values, self.share, self.starts)

    @cached_property
    def share(self) -> Floats:
        """Share of each row of a window in its mean, shape (m,)."""
        return self.weight * self.measurements.step_s

    def gap(self, force_model: ForceModel) -> Floats:
        """Return the force model's acceleration less the measured one in every window, shape (J, channels)."""
        rates = as_measured(force_model)
        if self.channels[0]:
            over_ground(rates, self.measurements.nu, *self.measurements.pointing)
        gaps = weighed(rates, self.share, self.starts)
        gaps -= self.measured_channels
        return gaps

    @cached_property
    def ends(self) -> Ints:
        """The runs as an array, shape (runs, 2)."""
        return np.array(self.runs, dtype=np.int64).reshape(-1, 2)

    @cached_property
    def measured_channels(self) -> Floats:
        """Measured accelerations of the channels that are used, shape (J, channels)."""
        return self.measured[:, self.channels]

    def along(self, rates: Floats) -> Floats:
        """Return accelerations along the vessel's axes as those along the channels, shape (n, 3) each."""
        if not self.channels[0]:
            return rates
        turned = rates[:, :, None].copy()
        to_ground(turned, *self.measurements.pointing)
        return turned[:, :, 0]

    @cached_property
    def turn(self) -> Floats | None:
        """Matrices from the channels to the vessel's axes in every window, shape (J, 3, 3); None where they are the same."""
        if not self.channels[0]:
            return None
        cos, sin = self.mean(np.column_stack(self.measurements.pointing)).T
        length = np.maximum(np.hypot(cos, sin), 1e-12)
        turn = np.zeros((len(cos), 3, 3))
        turn[:, 0, 0] = turn[:, 1, 1] = cos / length
        turn[:, 0, 1] = sin / length
        turn[:, 1, 0] = -turn[:, 0, 1]
        turn[:, 2, 2] = 1.0
        return turn

    def along_vessel(self, gaps: Floats) -> Floats:
        """Return gaps on the channels, (J, 3) or (J, 3, q), along the vessel's axes."""
        return gaps if self.turn is None else np.asarray(np.einsum("jab,jb...->ja...", self.turn, gaps))

    def hull_changes(self, force_model: ForceModel, places: Ints, moves: Floats) -> Floats:
        """Return by how much `gap` changes if coefficients of the hull move one by one, shape (J, channels, q).

        `places` and `moves` as in `ferryid.effects.force_model.hull_changes`.
        """
        if force_model.measurements is self.measurements and plainly_damped(force_model):
            return self._changes_in_still_water(force_model, places, moves)
        changes = hull_changes(force_model, places, moves)
        if self.channels[0]:
            to_ground(changes, *self.measurements.pointing)
        return self.mean(changes)

    def _changes_in_still_water(self, force_model: ForceModel, places: Ints, moves: Floats) -> Floats:
        """Return `hull_changes` where damping is linear in the coefficients and known but for the masses."""
        out = np.empty((len(self.starts), 3, len(places)))
        heavy = places < MASSES
        if heavy.any():
            changes = hull_changes(force_model, places[heavy], moves[heavy])
            if self.channels[0]:
                to_ground(changes, *self.measurements.pointing)
            out[:, :, heavy] = self.mean(changes)
        damping_changes(self.damping_responses, force_model.hull, places, moves, out)
        return out

    @cached_property
    def damping_responses(self) -> Floats:
        """Mean of `ferryid.effects.equations_of_motion.pushes` in every window along the channels, shape (J, 3, 23)."""
        every = pushes(np.ascontiguousarray(self.measurements.nu))
        if self.channels[0]:
            to_ground(every, *self.measurements.pointing)
        return self.mean(every)

    @cached_property
    def drift_responses(self) -> Floats:
        """Mean in every window of an acceleration ahead of v r, and of one of v v, along the channels, shape (J, 3, 2)."""
        _, v, r = self.measurements.nu.T
        every = np.zeros((len(v), 3, 2))
        every[:, 0, 0], every[:, 0, 1] = v * r, v * v
        if self.channels[0]:
            to_ground(every, *self.measurements.pointing)
        return self.mean(every)

    @cached_property
    def steps(self) -> Windows:
        """`steps_of` these windows."""
        return steps_of(self)


STEPS_A_WINDOW = 20
FORCES_HZ, LEAST_ROWS = 5.0, 16.0
"""Rate at which forces are averaged over windows, as they change slowly against it and hypotheses cost a quarter; and fewest
rows of forces in a vessel's window, for which the rate is higher where that is short."""


def windows(measurements: Measurements, length_s: float, stride_s: float) -> Windows:
    """Return windows of `length_s` every `stride_s` seconds, as many as lie wholly in measured data.

    The weight is ``sin^4``: it and its first three derivatives vanish at the ends. Measured motion is averaged at the full
    rate, and the measurements for the forces are thinned to `FORCES_HZ`, or
    to `LEAST_ROWS` in a window of the vessel where that is more.
    """
    hz = max(FORCES_HZ, LEAST_ROWS / window_seconds(measurements.profile))
    every = max(1, round(1.0 / (hz * measurements.step_s)))
    thin = _thinned(measurements, every)
    m = max(8, round(length_s / thin.step_s))
    stride = max(1, round(stride_s / thin.step_s))
    starts: list[int] = []
    runs: list[tuple[int, int]] = []
    for first, end in _stretches(thin.usable):
        before = len(starts)
        starts += range(first, end - m + 1, stride)
        if len(starts) > before:
            runs.append((before, len(starts)))
    rows = np.array(starts, dtype=np.int64)
    known = bool(np.isfinite(measurements.eta[measurements.usable, :2]).all())
    # A controller answers the errors of the velocity with thrust within a window, so that they and the force belong
    # together and a delay is seen where none is; those of the position are shorter and hardly felt.
    channels = np.repeat([known, not known], 3)
    eta = np.where(np.isfinite(measurements.eta), measurements.eta, 0.0)
    nu = np.where(np.isfinite(measurements.nu_raw), measurements.nu_raw, 0.0)
    _, slope, bend = window_weights(m * every, measurements.step_s)
    measured = np.hstack(
        [
            _means(eta, bend * measurements.step_s, rows * every),
            -_means(nu, slope * measurements.step_s, rows * every),
        ]
    )
    return Windows(thin, rows, tuple(runs), window_weights(m, thin.step_s)[0], measured, channels)


def steps_of(long: Windows) -> Windows:
    """Return short windows without overlap in what they measure, over the rows that windows cover: the steps of a filter.

    With a triangle as its weight, ``∫ w p''`` is the second difference of a position; with a box, ``∫ w nu'`` is the first of
    a velocity. A step is a `STEPS_A_WINDOW`-th of a window.
    """
    measurements = long.measurements
    covered = np.zeros(len(measurements.t), dtype=np.bool_)
    for start in long.starts:
        covered[start : start + len(long.weight)] = True
    m = max(1, round(len(long.weight) / STEPS_A_WINDOW))
    placed = bool(long.channels[0])
    span = 2 * m if placed else m
    starts: list[int] = []
    runs: list[tuple[int, int]] = []
    for first, end in _stretches(covered):
        rows = range(first, end - span, m)
        if len(rows) > INFERENCE.fewest_steps:
            runs.append((len(starts), len(starts) + len(rows)))
            starts += rows
    at = np.array(starts, dtype=np.int64)
    h = m * measurements.step_s
    if placed:
        weight = np.concatenate([np.arange(m + 1), np.arange(m)[::-1]]).astype(np.float64)
        differences = measurements.eta[at + 2 * m] - 2.0 * measurements.eta[at + m] + measurements.eta[at]
    else:
        weight = np.concatenate([[0.5], np.ones(m - 1), [0.5]])
        differences = measurements.nu_raw[at + m] - measurements.nu_raw[at]
    differences = np.where(np.isfinite(differences), differences, 0.0) / h ** (2 if placed else 1)
    measured = np.hstack([differences, differences])
    return Windows(
        measurements, at, tuple(runs), weight / (weight.sum() * measurements.step_s), measured, long.channels
    )


def _means(values: Floats, weight: Floats, starts: NDArray[np.int64]) -> Floats:
    flat = np.ascontiguousarray(values, dtype=np.float64).reshape(len(values), -1)
    return weighed(flat, weight, starts).reshape(len(starts), *values.shape[1:])


@compiled
def weighed(values: Floats, weight: Floats, starts: Ints) -> Floats:
    """Return the sum of m rows times a weight, shape (m,), from every start on: shape (J, c), of values with c columns."""
    out = np.zeros((starts.shape[0], values.shape[1]))
    first, end = 0, weight.shape[0]
    while first < end and weight[first] == 0.0:
        first += 1
    while end > first and weight[end - 1] == 0.0:
        end -= 1
    if values.shape[1] == 3:
        # Most are of three channels: sums that stay in registers.
        for j in range(starts.shape[0]):
            a, b, c = 0.0, 0.0, 0.0
            for i in range(first, end):
                part, row = weight[i], starts[j] + i
                a, b, c = a + part * values[row, 0], b + part * values[row, 1], c + part * values[row, 2]
            out[j, 0], out[j, 1], out[j, 2] = a, b, c
        return out
    for j in range(starts.shape[0]):
        for i in range(first, end):
            for q in range(values.shape[1]):
                out[j, q] += weight[i] * values[starts[j] + i, q]
    return out


def _thinned(measurements: Measurements, every: int) -> Measurements:
    """Return the measurements with every so many rows replaced by their mean; a row is usable where all of them are."""
    if every == 1:
        return measurements
    n = len(measurements.t) // every

    def mean(values: Floats) -> Floats:
        return np.asarray(values[: n * every].reshape(n, every, *values.shape[1:]).mean(axis=1))

    def some(values: Floats | None) -> Floats | None:
        return None if values is None else mean(values)

    return replace(
        measurements,
        t=mean(measurements.t),
        eta=mean(measurements.eta),
        nu_raw=mean(measurements.nu_raw),
        nu=mean(measurements.nu),
        parts=mean(measurements.parts),
        angles=mean(measurements.angles),
        usable=np.asarray(measurements.usable[: n * every].reshape(n, every).all(axis=1)),
        wind=some(measurements.wind),
        current=some(measurements.current),
        actuation={},
        payload=some(measurements.payload),
        rudders=some(measurements.rudders),
    )


def _stretches(usable: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], usable, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
