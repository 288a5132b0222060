"""How actuators follow their orders, estimated from logs that hold no feedback of them.

An actuator of which the order alone is known acts as its profile states, at once where that states nothing. The controller of a
small motor, its spin-up and the way of the order to it take tenths of a second, in which a small vessel has answered. Here the
equations of motion in windows are fitted for one time constant and delay of all such actuators after the other, with every
coefficient free and the errors of neighbouring windows whitened. What a response gains over orders that are followed at once is
reported where it is more than chance, and more than a controller's answer to disturbances could gain, which looks like a delay
(see `ferryid.diagnose.inference.feedback`). Nothing is corrected by it: a model holds with the profile that it was fitted with.

References
----------
Ljung (1999), System Identification, 2nd edition, section 13.4, for prediction errors under feedback. Schwarz (1978), Estimating
the dimension of a model, for the choice between a lag, a delay and both. White (1982), Maximum likelihood estimation of
misspecified models, for the intervals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import log, sqrt

import numpy as np

from ferryid.cached import cached_property
from ferryid.errors import FerryIdError
from ferryid.identify.motion_data import LogData, prepared_data
from ferryid.identify.outcome import EstimatedResponse
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import Split
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_data import WeakData, steady_forces, weak_data
from ferryid.identify.weak_rows import WeakRows
from ferryid.models.forces import ACCELERATIONS
from ferryid.regression import STRIDES, window_rows, window_sums, window_weights
from ferryid.signals.feedback import directed_information
from ferryid.signals.prepare import Opened
from ferryid.signals.smooth import moving_mean, odd_rows
from ferryid.types import Floats, Ints, no_progress
from ferryid.vessel import applied_force, follow_orders
from ferryid.vessel.hull import current_in_body
from ferryid.vessel.order_response import OrderResponse, followed_orders
from ferryid.vessel.profile import Profile

Times = tuple[float, float]
"""Time constant and delay [s]."""


def estimate_order_responses(
    opened: Sequence[Opened],
    profile: Profile,
    settings: FitSettings,
    progress: Callable[[str], None] = no_progress,
) -> tuple[EstimatedResponse, ...]:
    """Return how orders are followed of which the profile does not state it; none where the logs do not show it.

    Speeds and forces of all actuators are taken to follow alike, and so are their angles.

    Parameters
    ----------
    opened
        Logs, read and aligned.
    profile, settings
        The vessel, and how to fit.
    progress
        Is told where something is estimated.
    """
    if settings.residual != "measured" or settings.by_thesis:
        return ()
    groups: dict[bool, dict[str, str]] = {False: {}, True: {}}
    for one in opened:
        for column, signal in followed_orders(profile, one.track.columns).items():
            if not signal.states_response:
                turns = signal.quantity.endswith((".angle.command", ".rudder.command"))
                groups[turns][column] = signal.quantity
    if not any(groups.values()):
        return ()
    progress("estimating how orders are followed")
    try:
        data = prepared_data(profile, settings, opened)
    except FerryIdError:
        # The fit says so itself.
        return ()
    found: list[EstimatedResponse] = []
    known: dict[str, OrderResponse] = {}
    for orders in groups.values():
        problem = _problem(data, opened, tuple(orders), known) if orders else None
        times = problem.estimate() if problem is not None else None
        if problem is None or times is None:
            continue
        low, high = problem.interval(times)
        quantities = tuple(one.quantity for one in profile.signals if one.quantity in orders.values())
        found.append(EstimatedResponse(quantities, times, low, high, problem.error(times)))
        known |= dict.fromkeys(orders, OrderResponse(*times))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _Problem:
    """Windows of logs in which accelerations are explained by what actuators do that follow orders.

    Attributes
    ----------
    data, opened
        Windows, and the logs.
    columns
        The orders that are followed by the times that are sought.
    known
        How others are followed, by their columns.
    rows
        The windows of each log in which what is done is known whatever the times are.
    runs
        Unbroken series of these windows, as (first, end).
    axes
        Axes on which actuators act.
    """

    data: WeakData
    opened: Sequence[Opened]
    columns: tuple[str, ...]
    known: Mapping[str, OrderResponse]
    rows: tuple[Ints, ...]
    runs: tuple[tuple[int, int], ...]
    axes: tuple[int, ...]

    @property
    def windows(self) -> Sequence[WeakRows]:
        return self.data.windows.training

    @cached_property
    def acceleration(self) -> Floats:
        """What is explained, shape (J, 3)."""
        posed = self.data.whitening.posed
        return np.concatenate(
            [one.acceleration(posed)[rows] for one, rows in zip(self.windows, self.rows, strict=True)]
        )

    def forces(self, times: Times) -> list[Floats]:
        """Return the mean applied force of every window of each log if orders are followed by these times, shape (J, 3)."""
        return window_forces(
            self.data, self.opened, {**self.known, **dict.fromkeys(self.columns, OrderResponse(*times))}
        )

    def table(self, times: Times) -> Floats:
        """Return functions, steady forces and the force that is left to accelerate, shape (J, K + 3)."""
        terms = self.data.functions.terms
        return np.concatenate(
            [
                np.column_stack([replace(one, force=force).regressors(terms), steady_forces(one)])[rows]
                for one, force, rows in zip(self.windows, self.forces(times), self.rows, strict=True)
            ]
        )

    def left(self, times: Times, filters: Sequence[Floats] | None = None) -> tuple[Floats, list[Floats]]:
        """Return what a fit by these times leaves, whitened, shape (rows, axes), and the filter that whitens each axis."""
        table, mask, chosen, columns = self.table(times), self.data.functions.mask, [], []
        for place, axis in enumerate(self.axes):
            X = table[:, np.concatenate([mask[:, axis], np.ones(3, dtype=bool)])]
            size = np.linalg.norm(X, axis=0)
            both = np.column_stack([X / np.where(size > 0.0, size, 1.0), self.acceleration[:, axis]])
            own = np.zeros(STRIDES) if filters is None else filters[place]
            for _ in range(IDENTIFY.response_whitening if filters is None else 1):
                white = self.whitened(both, own)
                gains = np.linalg.lstsq(white[:, :-1], white[:, -1], rcond=1e-10)[0]
                if filters is None:
                    own = self.predictor(both[:, -1] - both[:, :-1] @ gains)
            white = self.whitened(both, own)
            gains = np.linalg.lstsq(white[:, :-1], white[:, -1], rcond=1e-10)[0]
            columns.append(white[:, -1] - white[:, :-1] @ gains)
            chosen.append(own)
        return np.column_stack(columns), chosen

    def whitened(self, values: Floats, predictor: Floats) -> Floats:
        """Return what does not follow from the windows before, shape (rows, c)."""
        p, parts = STRIDES, list[Floats]()
        for first, end in self.runs:
            part = values[first:end]
            white = part[p:].copy()
            for k, share in enumerate(predictor):
                white -= share * part[p - k - 1 : len(part) - k - 1]
            parts.append(white)
        return np.concatenate(parts)

    def predictor(self, errors: Floats) -> Floats:
        """Return the coefficients that predict an error from those of the windows before, shape (STRIDES,)."""
        p = STRIDES
        past = [
            np.column_stack([errors[first + p - k - 1 : end - k - 1] for k in range(p)]) for first, end in self.runs
        ]
        own = np.concatenate([errors[first + p : end] for first, end in self.runs])
        return np.asarray(np.linalg.lstsq(np.concatenate(past), own, rcond=1e-10)[0])

    @cached_property
    def at_once(self) -> Floats:
        """What is left if orders are followed at once, whitened."""
        return self.left((0.0, 0.0))[0]

    def gain(self, times: Times) -> float:
        """Return the log-likelihood gained over orders that are followed at once [nat]."""
        return -0.5 * len(self.at_once) * float(np.sum(np.log(self._ratio(times))))

    def error(self, times: Times) -> float:
        """Return the squared error over that of orders that are followed at once, mean of the axes."""
        return float(np.mean(self._ratio(times)))

    def _ratio(self, times: Times) -> Floats:
        return _variance(self.left(times)[0]) / _variance(self.at_once)

    def estimate(self) -> Times | None:
        """Return the time constant and delay of the orders; None where the logs do not show any."""
        usual_s = self.data.windows.length_s
        longest_s = IDENTIFY.slowest_response * usual_s
        tried = np.geomspace(IDENTIFY.quickest_response * usual_s, longest_s, IDENTIFY.responses_tried)
        step = float(tried[1] / tried[0])
        lag = self._refined(max(((float(one), 0.0) for one in tried), key=self.gain), step, longest_s)
        delay = self._refined(max(((0.0, float(one)) for one in tried), key=self.gain), step, longest_s)
        apart = [(share * lag[0], (1.0 - share) * delay[1]) for share in (0.25, 0.5, 0.75)]
        both = self._refined(max(apart, key=self.gain), step, longest_s)
        # Each time is worth what chance gains by it.
        price = 0.5 * log(len(self.at_once))
        worth = {one: self.gain(one) - price * np.count_nonzero(one) for one in (lag, delay, both)}
        best = max(worth, key=lambda one: worth[one])
        if worth[best] <= 0.0 or max(best) >= longest_s or not self._is_shown(best) or self._goes_against(best):
            return None
        return best

    def _goes_against(self, times: Times) -> bool:
        """Tell whether the vessel accelerates against the applied force on an axis if orders are followed by these times.

        Where it hunts, half of its period looks like a delay, and the force then has the wrong sign.
        """
        table, mask, terms = self.table(times), self.data.functions.mask, self.data.functions.terms
        _, filters = self.left(times)
        for axis, own in zip(self.axes, filters, strict=True):
            columns = np.flatnonzero(np.concatenate([mask[:, axis], np.ones(3, dtype=bool)]))
            white = self.whitened(np.column_stack([table[:, columns], self.acceleration[:, axis]]), own)
            A, b = white[:, :-1], white[:, -1]
            gains = np.linalg.lstsq(A, b, rcond=1e-10)[0]
            variance = float(np.mean((b - A @ gains) ** 2))
            place = columns.tolist().index(terms.index(ACCELERATIONS[axis]))
            error = sqrt(variance * float(np.linalg.pinv(A.T @ A, hermitian=True)[place, place]))
            if gains[place] < -IDENTIFY.wrong_way_sigmas * error:
                return True
        return False

    def _refined(self, times: Times, step: float, longest_s: float) -> Times:
        """Return the best times near some that are right to a factor `step`."""
        best, gained = times, self.gain(times)
        for power in (0.5, 0.25, 0.125, 0.0625):
            for place in range(2):
                for factor in (step**power, step**-power):
                    changed = list(best)
                    changed[place] = min(changed[place] * factor, longest_s)
                    new: Times = (changed[0], changed[1])
                    if new != best and (gain := self.gain(new)) > gained:
                        best, gained = new, gain
        return best

    def _is_shown(self, times: Times) -> bool:
        """Tell whether times gain more than chance, and than a controller's answer to disturbances could."""
        white, _ = self.left(times)
        variance = _variance(white)
        sums = self._block_sums(0.5 * np.sum((self.at_once**2 - white**2) / variance, axis=1))
        low = float(np.sum(sums)) - 1.96 * sqrt(len(sums) * float(np.var(sums, ddof=1)))
        ordered = np.concatenate([one[rows] for one, rows in zip(self.forces((0.0, 0.0)), self.rows, strict=True)])
        runs, at = [], 0
        for first, end in self.runs:
            runs.append((at, at + end - first - STRIDES))
            at = runs[-1][1]
        forces = self.whitened(ordered, np.zeros(STRIDES))
        return low > directed_information(white, forces, runs).high

    def _block_sums(self, values: Floats) -> Floats:
        """Return sums over blocks of windows that last for two of the usual ones, shape (blocks, ...)."""
        blocks = max(2, len(values) // (2 * STRIDES))
        return np.array([part.sum(axis=0) for part in np.array_split(values, blocks)])

    def interval(self, times: Times) -> tuple[Times, Times]:
        """Return the ends of the 95 % intervals of time constant and delay [s], by the scatter of blocks of windows."""
        white, filters = self.left(times)
        variance = _variance(white)
        places = [place for place in range(2) if times[place] > 0.0]
        steps = [0.1 * times[place] for place in places]

        def likelihood(*moves: float) -> Floats:
            changed = list(times)
            for place, step, move in zip(places, steps, moves, strict=True):
                changed[place] += step * move
            return np.asarray(-0.5 * np.sum(self.left((changed[0], changed[1]), filters)[0] ** 2 / variance, axis=1))

        units = np.eye(len(places))
        here = float(np.sum(likelihood(*np.zeros(len(places)))))
        ahead, back = ([likelihood(*(sign * one)) for one in units] for sign in (1.0, -1.0))
        scores = np.column_stack([self._block_sums(0.5 * (a - b)) for a, b in zip(ahead, back, strict=True)])
        curvature = np.diag([float(np.sum(a) + np.sum(b)) - 2.0 * here for a, b in zip(ahead, back, strict=True)])
        if len(places) == 2:
            corners = sum(a * b * float(np.sum(likelihood(a, b))) for a in (1.0, -1.0) for b in (1.0, -1.0))
            curvature[0, 1] = curvature[1, 0] = 0.25 * corners
        inverse = np.linalg.pinv(curvature, hermitian=True)
        scatter = len(scores) * np.atleast_2d(np.cov(scores.T))
        spread = np.sqrt(np.diag(inverse @ scatter @ inverse)) * steps
        low, high = list(times), list(times)
        for place, one in zip(places, spread, strict=True):
            low[place], high[place] = max(0.0, times[place] - 1.96 * float(one)), times[place] + 1.96 * float(one)
        return (low[0], low[1]), (high[0], high[1])


def _variance(white: Floats) -> Floats:
    """Return the mean squares of what is left, shape (axes,), above zero."""
    return np.asarray(np.maximum(np.mean(white**2, axis=0), np.finfo(np.float64).tiny))


def _problem(
    data: LogData, opened: Sequence[Opened], columns: tuple[str, ...], known: Mapping[str, OrderResponse]
) -> _Problem | None:
    """Return the problem of some orders; None where the logs are too short for one, or nothing acts."""
    everything = Split(
        "none",
        tuple(motion.valid for motion in data.motions),
        tuple(np.zeros_like(motion.valid) for motion in data.motions),
        0.0,
    )
    weak = weak_data(replace(data, split=everything))
    if weak.impossible:
        return None
    longest = OrderResponse(0.0, IDENTIFY.slowest_response * weak.windows.length_s)
    latest = window_forces(weak, opened, {**known, **dict.fromkeys(columns, longest)})
    rows = tuple(np.flatnonzero(np.isfinite(one).all(axis=1)) for one in latest)
    runs, kept, at = [], list[Ints](), 0
    for one, own in zip(weak.windows.training, rows, strict=True):
        breaks = np.flatnonzero((np.diff(one.run[own]) != 0) | (np.diff(own) != 1)) + 1
        parts = [own[a:b] for a, b in pairwise([0, *breaks.tolist(), len(own)]) if b - a > STRIDES]
        for part in parts:
            runs.append((at, at + len(part)))
            at += len(part)
        kept.append(np.concatenate([np.zeros(0, dtype=np.int64), *parts]))
    terms, mask = weak.functions.terms, weak.functions.mask
    forces = np.concatenate(
        [one.force[own] for one, own in zip(weak.windows.training, kept, strict=True)] or [np.zeros((0, 3))]
    )
    axes = tuple(
        axis
        for axis, name in enumerate(ACCELERATIONS)
        if name in terms
        and mask[terms.index(name), axis]
        and not (weak.settings.reduced and axis == 1)
        and len(forces)
        and float(np.std(forces[:, axis])) > IDENTIFY.no_force
    )
    coefficients = len(terms) + 3 + STRIDES
    if not axes or at - len(runs) * STRIDES < IDENTIFY.windows_per_coefficient * coefficients:
        return None
    return _Problem(weak, opened, columns, known, tuple(kept), tuple(runs), axes)


def window_forces(data: WeakData, opened: Sequence[Opened], responses: Mapping[str, OrderResponse]) -> list[Floats]:
    """Return the mean applied force of every window of each log if orders are followed so, shape (J, 3); NaN where unknown."""
    found = []
    for one, motion, windows in zip(opened, data.motions, data.windows.training, strict=True):
        measured = one.measured
        columns = follow_orders(data.profile, one.track.columns, motion.rate_hz, responses)
        flow = measured.current
        through_water = measured.nu if flow is None else measured.nu - current_in_body(flow, measured.eta[:, 2])
        force, _ = applied_force(data.profile, columns, through_water)
        force = moving_mean(force, odd_rows(data.settings.window_s, motion.rate_hz))
        step_s = 1.0 / motion.rate_hz
        weight = step_s * window_weights(window_rows(data.windows.training_length_s, motion.rate_hz), step_s)[0]
        found.append(np.asarray(window_sums(force, weight, windows.start)))
    return found
