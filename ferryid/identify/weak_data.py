"""Data of a fit in the weak form: windows of the training rows, whitened, with the base model as a prior."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from math import isfinite
from typing import Any, Self

import numpy as np

from ferryid.cached import cached_property
from ferryid.counts import counted
from ferryid.effects.force_model import COEFFICIENTS, hull_of
from ferryid.effects.hull_spread import default_hull_spread
from ferryid.errors import FerryIdError
from ferryid.identify.condition_estimation import OwnConditions, estimate_own
from ferryid.identify.condition_problem import hull_and_conditions
from ferryid.identify.contradictions import response_of, signs_of, wrong_size, wrong_way
from ferryid.identify.feasible import Feasible, LiftTie, feasible_gains
from ferryid.identify.fit_data import Estimate
from ferryid.identify.inertia.shares import relative_inertia, without_inertia
from ferryid.identify.inertia.span import inertia_spans
from ferryid.identify.log_condition import KindOutcome, LogCondition, conditions_json
from ferryid.identify.log_conditions import Conditions, Start, estimate_conditions
from ferryid.identify.motion_data import LogData
from ferryid.identify.outcome import Excitation, LogWind
from ferryid.identify.prediction_windows import PredictionWindows
from ferryid.identify.settings import FOLDS
from ferryid.identify.split import Split
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_rows import WeakRows, to_force
from ferryid.identify.window_loads import LoadSamples, sample_load
from ferryid.models.forces import ACCELERATIONS, MAPPED, without_sway_coupling
from ferryid.regression import STRIDES, CrossProducts, QrFactor, Rows, Simpls, fit_simpls
from ferryid.regression.cross_validation import Folds
from ferryid.regression.resampling import Blocks, block_seconds
from ferryid.types import Flags, Floats, Ints
from ferryid.vessel.order_response import orders_alone


@dataclass(frozen=True, eq=False)
class Whitening:
    """What makes the windows of all logs alike and independent.

    Attributes
    ----------
    posed
        Axes on which the acceleration comes from position and heading, shape (3,).
    autocorrelation
        Of one window's residual with the next one's.
    condition
        Standard deviation of a log's own steady force over that of the residual.
    sigma
        Standard deviation of the residual [N, N, N·m], shape (3,).
    """

    posed: Flags
    autocorrelation: float
    condition: float
    sigma: Floats


@dataclass(frozen=True, eq=False)
class Whitened:
    """Whitened windows of every log.

    Attributes
    ----------
    rows
        Functions and target, without what the intercept explains, one a log.
    mean
        Functions and target that the intercept explains, shape (K + 3,).
    unit
        Mean of the column of ones, whitened.
    weight
        Sum of squares of that column: what determines the intercept, in units of the residual's variance.
    """

    rows: tuple[Rows, ...]
    mean: Floats
    unit: float
    weight: float


@dataclass(frozen=True, eq=False)
class WeakData(LogData):
    """Motions of logs as windows of the weak form, of which some train and others validate.

    Attributes
    ----------
    training_s
        Length of the training windows [s]; None: that of the windows in which models are judged.
    own_spreads
        Of the kinds of conditions, besides wind, that logs have of their own, the spread between logs in sizes.
    own_kinds
        What spoke for each kind that was considered.
    start
        What was found in other windows of the same logs, with which the estimate of winds begins.
    """

    training_s: float | None = field(default=None, kw_only=True)
    own_spreads: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    own_kinds: tuple[KindOutcome, ...] = field(default=(), kw_only=True)
    start: Start | None = field(default=None, kw_only=True)

    @cached_property
    def windows(self) -> PredictionWindows:
        """Windows in which models are fitted and judged."""
        return PredictionWindows(
            self.profile,
            self.settings,
            self.functions,
            self.motions,
            self.split,
            training_s=self.training_s,
            shared=self.shared,
        )

    def model_settings(self, estimate: Estimate) -> dict[str, Any]:
        """Return grid rates, window lengths, and the estimator."""
        return {
            **super().model_settings(estimate),
            "estimator": "weak",
            "weak_window_s": self.windows.training_length_s,
        }

    @cached_property
    def training_windows(self) -> tuple[WeakRows, ...]:
        """Windows within training rows, one a log.

        Raises
        ------
        FerryIdError
            For fewer windows than a fit needs.
        """
        if why := self.impossible:
            raise FerryIdError(f"{self.where}: {why}. Fix: give more or longer logs, or use --estimator derivative")
        return self._blown if self.own is None else self.own.windows

    @cached_property
    def _blown(self) -> tuple[WeakRows, ...]:
        """Training windows as if the wind had been measured."""
        return self.conditions.applied(self.windows.training)

    @cached_property
    def own(self) -> OwnConditions | None:
        """Conditions that logs have of their own besides wind; None where there are none."""
        if not self.own_spreads:
            return None
        return estimate_own(hull_and_conditions(self.having({}), self.own_spreads), self.own_spreads)

    def having(self, spreads: Mapping[str, float], kinds: tuple[KindOutcome, ...] = ()) -> Self:
        """Return the same data with these kinds of conditions, spreads to begin with, and what spoke for each kind."""
        other = replace(self, own_spreads=spreads, own_kinds=kinds)
        # What depends on the windows as measured stays as it is, and all else where the conditions do.
        kept = ("windows", "conditions", "_posed", "_blown") if spreads != self.own_spreads else tuple(self.__dict__)
        for name in kept:
            if name in self.__dict__ and name not in other.__dataclass_fields__:
                other.__dict__[name] = self.__dict__[name]
        return other

    @property
    def winds(self) -> tuple[LogWind, ...]:
        """Steady winds of the logs in which nobody measured them."""
        return self.conditions.listed(self.log_names) if self.own is None else self.own.winds(self.log_names)

    @property
    def condition_notes(self) -> tuple[str, ...]:
        """Why no wind is estimated where the profile has its load, as sentences."""
        if not self.conditions.indistinct:
            return ()
        return (
            "No steady wind of single logs is estimated: hull, wind and other steady forces cannot be distinguished. "
            "Measure the wind, or check the wind areas in the profile.",
        )

    @property
    def condition_kinds(self) -> tuple[KindOutcome, ...]:
        """What spoke for each kind of condition that was considered besides wind."""
        return self.own_kinds

    @property
    def log_conditions(self) -> tuple[LogCondition, ...]:
        """Conditions besides wind that the logs have of their own."""
        return () if self.own is None else self.own.listed(self.log_names)

    def training_logs(self) -> tuple[Mapping[str, Any], ...]:
        """Return the training logs as a model file lists them, with the conditions that were estimated."""
        return self.with_conditions(zip(self.log_names, super().training_logs(), strict=True))

    def with_conditions(self, logs: Iterable[tuple[str, Mapping[str, Any]]]) -> tuple[Mapping[str, Any], ...]:
        """Return entries of logs, by the log's name, with the conditions that were estimated."""
        found = {one.pop("log"): {"conditions": one} for one in conditions_json(self.winds, self.log_conditions)}
        return tuple({**one, **found.get(name, {})} for name, one in logs)

    @property
    def condition_covariance(self) -> Floats:
        """What conditions of single logs add to the covariance of gains and intercept, by axis, shape (3, K + 1, K + 1)."""
        return self.conditions.added if self.own is None else self.conditions.added + self.own.added

    @cached_property
    def conditions(self) -> Conditions:
        """Steady wind of every log in which it was not measured; none without sway, which tells most of it."""
        if self.settings.reduced:
            return Conditions.none(self.windows.training, len(self.functions.terms))
        return estimate_conditions(
            self.profile,
            self.load_samples,
            self.windows.training,
            self.windows.training_length_s,
            float(self.settings.scale.get("zeta", 1.0)),
            self.functions.terms,
            self.functions.mask,
            self.prior_spread,
            self._posed,
            self.start,
        )

    def fold(self, split: Split) -> Self:
        """Return the same logs of whose training rows some validate; spreads and noise are those of all of them."""
        start = None if self.impossible else self.conditions.start
        return replace(self, split=split, start=start and replace(start, settled=True))

    @property
    def load_samples(self) -> tuple[LoadSamples | None, ...]:
        """Motion at which the wind load of the training windows is evaluated, one a log; None where wind was measured."""
        windows = self.windows
        return tuple(
            sample_load(self.profile, motion, velocity, one, windows.training_length_s)
            for motion, velocity, one in zip(self.motions, windows.velocities, windows.training, strict=True)
        )

    @property
    def training_velocities(self) -> Floats:
        """Velocities of the training rows, one row a second, shape (n, 3): they say how fast the vessel goes."""
        return np.concatenate(
            [m.nu[every_second(rows, m.rate_hz)] for m, rows in zip(self.motions, self.split.training, strict=True)]
        )

    @property
    def log_names(self) -> tuple[str, ...]:
        """Names of the logs."""
        return tuple(motion.log for motion in self.motions)

    @property
    def impossible(self) -> str:
        """Why the weak form cannot be used; empty where it can."""
        if self.settings.residual != "measured":
            return f"the weak form explains the measured force, found --residual {self.settings.residual}"
        found, length_s = sum(len(one) for one in self.windows.training), self.windows.training_length_s
        if found < IDENTIFY.fewest_windows:
            needed = counted(IDENTIFY.fewest_windows, "overlapping window")
            return f"the weak form needs {needed} of {length_s:.3g} s to train on, found {found}"
        return ""

    @cached_property
    def whitening(self) -> Whitening:
        """How the windows are made alike and independent, from what a first fit leaves."""
        left = self._first_residuals(self.training_windows, self._posed)
        sigma = np.maximum(np.sqrt(np.mean(np.concatenate(left) ** 2, axis=0)), IDENTIFY.no_force)
        autocorrelation = self._autocorrelation([one / sigma for one in left])
        condition = self._condition_spread([one / sigma for one in left], autocorrelation)
        return Whitening(self._posed, autocorrelation, condition, sigma)

    @cached_property
    def _posed(self) -> Flags:
        """Axes on which the acceleration comes from poses, shape (3,)."""
        candidates = [np.zeros(3, dtype=bool)]
        if self._poses_agree():
            candidates.append(np.ones(3, dtype=bool))
        left = [np.concatenate(self._first_residuals(self.windows.training, posed)) for posed in candidates]
        spread = np.array([np.sqrt(np.mean(one**2, axis=0)) for one in left])
        # Surge and sway share a sensor; the one that leaves less is the one with less noise.
        best = int(np.argmin(spread[:, :2].prod(axis=1))), int(np.argmin(spread[:, 2]))
        return np.array([best[0], best[0], best[1]], dtype=bool)

    def _poses_agree(self) -> bool:
        """Return whether acceleration from poses is known and goes with that from velocities; of a stuck pose it does not.

        Without sway velocity there is nothing for it to go with.
        """
        if self.settings.reduced:
            return False
        pose, velocity = (
            np.concatenate([getattr(one, name) for one in self.windows.training]) for name in ("by_pose", "by_velocity")
        )
        if not np.isfinite(pose).all() or np.any(np.std(pose, axis=0) == 0.0):
            return False
        agreement = [np.corrcoef(pose[:, axis], velocity[:, axis])[0, 1] for axis in range(3)]
        return bool(min(agreement) >= IDENTIFY.pose_agreement)

    def _first_residuals(self, windows: Sequence[WeakRows], posed: Flags) -> list[Floats]:
        """Return what a fit without whitening leaves of every log, shape (J, 3) each."""
        rows = [self._rows_of(one, posed) for one in windows]
        plain = CrossProducts.of(*rows, names=self.functions.terms, where=self.where)
        spread = np.maximum(np.sqrt(plain.moments()[1][plain.K :] / max(plain.n, 1)), IDENTIFY.no_force)
        fit = fit_simpls(plain + self._prior(spread), len(self.functions.terms), allowed=self.functions.mask)
        return [one.Y - one.chunk(0, len(one.Y))[0] @ fit.coefficients[-1] - fit.intercepts[-1] for one in rows]

    def _rows_of(self, windows: WeakRows, posed: Flags) -> Rows:
        target = windows.force - windows.base(windows.acceleration(posed))
        if self.settings.reduced:
            target[:, 1] = 0.0
        return Rows.of(windows.regressors(self.functions.terms), target)

    def _autocorrelation(self, left: Sequence[Floats]) -> float:
        squares = sum(float(np.sum(one**2)) for one in left)
        products = 0.0
        for one, windows in zip(left, self.training_windows, strict=True):
            follows = np.diff(windows.run) == 0
            products += float(np.sum((one[1:] * one[:-1])[follows]))
        return float(np.clip(products / squares, 0.0, IDENTIFY.most_autocorrelation)) if squares > 0.0 else 0.0

    def _condition_spread(self, left: Sequence[Floats], autocorrelation: float) -> float:
        """Return the spread of the logs' own steady forces over the residual's, by expectation and maximisation."""
        noise = (1.0 + autocorrelation) / (1.0 - autocorrelation)
        variance = 0.1
        some = [
            (one, steady_forces(windows)) for one, windows in zip(left, self.training_windows, strict=True) if len(one)
        ]
        for _ in range(IDENTIFY.expectation_steps):
            sizes = []
            for one, Z in some:
                inverse = np.linalg.inv(Z.T @ Z / noise + np.eye(3) / variance)
                mean = inverse @ (Z.T @ one / noise)
                sizes.append(np.mean(mean**2) + np.trace(inverse) / 3.0)
            variance = max(float(np.mean(sizes)), 1e-8)
        return float(np.sqrt(variance))

    @cached_property
    def whitened(self) -> Whitened:
        """Whitened training windows."""
        return self._whiten(self.training_windows)

    def _whiten(self, windows: Sequence[WeakRows]) -> Whitened:
        parts, ones = [], []
        for one in windows:
            rows = self._rows_of(one, self.whitening.posed)
            table = np.column_stack([rows.chunk(0, len(one))[0], rows.Y, np.ones(len(one))])
            table = _decorrelate(
                table, steady_forces(one) * self.whitening.condition, one.run, self.whitening.autocorrelation
            )
            parts.append(table[:, :-1])
            ones.append(table[:, -1])
        weight = sum(float(one @ one) for one in ones)
        explained = sum(part.T @ one for part, one in zip(parts, ones, strict=True)) / max(weight, 1e-12)
        K = len(self.functions.terms)
        cleared = [part - np.outer(one, explained) for part, one in zip(parts, ones, strict=True)]
        unit = float(np.mean(np.concatenate(ones)))
        return Whitened(
            tuple(Rows.of(one[:, :K], one[:, K:]) for one in cleared), np.asarray(explained), max(unit, 1e-3), weight
        )

    @cached_property
    def training(self) -> QrFactor | CrossProducts:
        """Whitened functions and target of the training windows, and the prior."""
        rows = CrossProducts.of(*self.whitened.rows, names=self.functions.terms, where=self.where)
        return rows + self._prior(self.whitening.sigma, factor=self.prior_factor)

    @cached_property
    def validation(self) -> QrFactor | CrossProducts:
        """Functions and target of the validation windows."""
        return CrossProducts.of(*(self._rows_of(one, self.whitening.posed) for one in self.windows.validation))

    @property
    def _coriolis(self) -> tuple[LiftTie, ...]:
        """Coefficients that are the Coriolis force of the mass, but for a lift that is not bounded yet."""
        masses: dict[tuple[str, int], tuple[tuple[int, int, float], ...]] = {
            ("uv", 2): ((1, 1, 1.0), (0, 0, -1.0)),
            ("ur", 1): ((0, 0, 1.0),),
            ("ur", 2): ((1, 2, 0.5), (2, 1, 0.5)),
        }
        terms = self.functions.terms
        return tuple(
            LiftTie(terms.index(term), axis, own, np.inf) for (term, axis), own in masses.items() if term in terms
        )

    @property
    def ties(self) -> tuple[LiftTie, ...]:
        """What ties the Coriolis force to the mass: without sway there is nothing to tie, and without a hull model no bound.

        What a hull model leaves out is small. Where there is none, lift may be as large as the Coriolis force itself.
        """
        if self.settings.reduced or not self.profile.hull.is_known:
            return ()
        spread = self.prior_factor * self._damping_spread
        return tuple(replace(one, spread=float(spread[one.term, one.axis])) for one in self._coriolis)

    @cached_property
    def _damping_spread(self) -> Floats:
        """Standard deviations of the prior of the water's force, lift among it, shape (K, 3); infinite elsewhere."""
        spread = np.full((len(self.functions.terms), 3), np.inf)
        known = default_hull_spread(self.profile, self.training_velocities)
        if self.profile.hull.is_known:
            known = (
                self._stated_spread(IDENTIFY.hull_spread) * np.abs(hull_of(self.profile))
                + IDENTIFY.unmodelled_share * known
            )
        for name, places in MAPPED.items():
            for term, axis in places:
                if term in self.functions.terms and not name.startswith("m"):
                    spread[self.functions.terms.index(term), axis] = known[COEFFICIENTS.index(name)]
        return spread

    def _stated_spread(self, usual: float) -> float:
        """Return how far off the profile says that its hull model is, or the usual spread where it says nothing."""
        return self.profile.hull.spread if isfinite(self.profile.hull.spread) else usual

    @cached_property
    def prior_spread(self) -> Floats:
        """Standard deviations of the prior of each gain, shape (K, 3); infinite where nothing is known."""
        spread = self._damping_spread.copy()
        share = (
            self._stated_spread(IDENTIFY.mass_spread) if self.profile.hull.is_known else IDENTIFY.unknown_mass_spread
        )
        mass = self.windows.base_mass
        for column, name in enumerate(ACCELERATIONS):
            if name in self.functions.terms:
                ratio = np.sqrt(np.diag(mass) / mass[column, column])
                spread[self.functions.terms.index(name)] = share * np.where(np.arange(3) == column, 1.0, 0.3) * ratio
        # A mass that differs from the base model's has another Coriolis force: m22 - m11 turns the hull, m11 deflects it.
        for one in self._coriolis:
            own = [share * factor * float(np.sqrt(mass[i, i] * mass[j, j])) for i, j, factor in one.masses]
            apart = all(i == j for i, j, _ in one.masses)
            size = float(np.linalg.norm(own)) if apart else 0.3 * float(np.sum(own))
            spread[one.term, one.axis] = np.hypot(spread[one.term, one.axis], size)
        return spread

    @cached_property
    def prior_factor(self) -> float:
        """How much wider the prior has to be than stated for what the data say, one at least: empirical Bayes."""
        sums, sigma = CrossProducts.of(*self.whitened.rows), self.whitening.sigma
        Sxx, Sxy = sums.centred()[:2]
        axes = []
        for axis in range(3):
            some = np.flatnonzero(self.functions.mask[:, axis] & np.isfinite(self.prior_spread[:, axis]))
            normal, right = Sxx[np.ix_(some, some)] / sigma[axis] ** 2, Sxy[some, axis] / sigma[axis] ** 2
            axes.append((self.prior_spread[some, axis], normal, right, np.eye(len(some))))
        factor = 1.0
        for _ in range(IDENTIFY.expectation_steps):
            sizes = []
            for stated, normal, right, one in axes:
                spread = factor * stated
                inverse = np.linalg.inv(normal * np.outer(spread, spread) + one)
                found = inverse @ (right * spread)
                sizes.append(found**2 + np.diag(inverse))
            factor *= float(np.sqrt(np.mean(np.concatenate(sizes))))
        return float(np.clip(factor, 1.0, IDENTIFY.widest_prior))

    def _prior(self, sigma: Floats, share: float = 1.0, factor: float = 1.0) -> CrossProducts:
        """Return the prior as observations of zero: a pair a function, whose mean is none, and of which no intercept comes.

        Axes of the same functions share them, so that a function has one weight: the mean of the axes', and of an acceleration
        that of its own axis. Coupling is known to be small, and a mean with it would pull the inertia towards the base model's.
        """
        terms, mask = self.functions.terms, self.functions.mask
        with np.errstate(divide="ignore"):
            weights = np.where(mask & np.isfinite(self.prior_spread), sigma / (factor * self.prior_spread), np.nan)
        for axis, name in enumerate(ACCELERATIONS):
            if name in terms and np.isfinite(weights[place := terms.index(name), axis]):
                weights[place] = weights[place, axis]
        some = np.isfinite(weights).any(axis=1)
        logs = np.where(np.isfinite(weights), np.log(np.where(weights > 0.0, weights, 1.0)), 0.0).sum(axis=1)
        weight = np.where(some, np.exp(logs / np.maximum(np.isfinite(weights).sum(axis=1), 1)), 0.0)
        X = np.diag(weight * np.sqrt(share / 2.0))
        X = np.vstack([X[some], -X[some]])
        if not len(X):
            X = np.zeros((0, len(terms)))
        return CrossProducts.of(Rows.of(X, np.zeros((len(X), 3))))

    def components(self) -> int:
        """Return the number of SIMPLS components of the settings, or the one that cross-validation supports."""
        if self.settings.components != "auto":
            return int(self.settings.components)
        curves = self.folds().curves(self.functions.mask, len(self.functions.terms), self.where)
        return curves.most_supported()

    def folds(self) -> Folds:
        """Return contiguous parts of the training windows for cross-validation, whitened as the whole is."""
        parts: list[list[Rows]] = [[] for _ in range(FOLDS)]
        whole = [one for one in self.whitened.rows if len(one.Y)]
        if len(whole) >= FOLDS:
            for number, one in enumerate(whole):
                parts[number % FOLDS].append(one)
        else:
            for one in whole:
                X = one.chunk(0, len(one.Y))[0]
                for number, place in enumerate(np.array_split(np.arange(len(one.Y)), FOLDS)):
                    # A window shares half its rows with the last of the part before.
                    place = place[1:] if number else place
                    parts[number].append(Rows.of(X[place], one.Y[place]))
        sums = [CrossProducts.of(*part) for part in parts if part]
        prior = self._prior(self.whitening.sigma, 1.0 / max(len(sums) - 1, 1), self.prior_factor)
        return Folds((tuple(one + prior for one in sums),), tuple(sums))

    def resampling_blocks(
        self, theta: Floats, intercept: Floats
    ) -> tuple[Sequence[CrossProducts], float, tuple[str, ...]]:
        """Return blocks of training windows as long as the whitened residual is correlated, each with its part of the prior."""
        stride_s = self.windows.training_length_s / STRIDES
        rows = [one for one in self.whitened.rows if len(one.Y)]
        rates = [1.0 / stride_s] * len(rows)
        block_s, notes = block_seconds(rows, rates, theta, intercept)
        stacked = Blocks.of(rows, rates, block_s)
        prior = self._prior(self.whitening.sigma, 1.0 / len(stacked.n), self.prior_factor)
        blocks = [
            CrossProducts(int(n), stacked.K, stacked.m, stacked.shift, products) + prior
            for n, products in zip(stacked.n, stacked.products, strict=True)
        ]
        return blocks, block_s, notes

    def scattered(self, gains: Floats, mask: Flags) -> Floats:
        """Return drawn gains, (draws, K, 3), with the scatter of the prior: the truth is as far from its mean as it states.

        Drawing windows again leaves the prior where it is, so that what only the prior determines would have no interval, and
        it leaves the winds of the logs where they are. Errors in variables that remain shift every draw alike. An inertia that
        is held is none of those that `mask` has, and scatters in nothing.
        """
        rng = np.random.default_rng(self.settings.seed)
        information, out = self.information, gains.copy()
        for axis in range(3):
            own = np.flatnonzero(mask[:, axis] & np.isfinite(self.prior_spread[:, axis]))
            every = np.flatnonzero(mask[:, axis])
            spread = self.prior_factor * self.prior_spread[own, axis]
            covariance = np.linalg.pinv(information[axis][np.ix_(every, every)], hermitian=True)
            pulls = rng.standard_normal((len(gains), len(own))) / spread
            out[:, every, axis] += pulls @ covariance[np.searchsorted(every, own)]
            added = self.condition_covariance[axis]
            held = np.flatnonzero(self.functions.mask[:, axis] & ~mask[:, axis])
            # Conditions were estimated with all of them free: what they share with those that are held is not left.
            shared = added[np.ix_(held, every)]
            left = shared.T @ np.linalg.pinv(added[np.ix_(held, held)], hermitian=True) @ shared
            out[:, every, axis] += rng.standard_normal((len(gains), len(every))) @ _root(
                added[np.ix_(every, every)] - left
            )
            own_inertia = ACCELERATIONS[axis]
            if own_inertia in self.functions.terms and mask[row := self.functions.terms.index(own_inertia), axis]:
                out[:, row, axis] += IDENTIFY.inertia_error * rng.standard_normal(len(gains))
        return out

    def refuse_contradictions(self) -> None:
        """Refuse logs in which the vessel accelerates against the applied force, or not nearly as much as that would.

        Raises
        ------
        FerryIdError
            With what explains it and the line of the profile to change.
        """
        terms = self.functions.terms
        if not all(name in terms for name in ACCELERATIONS):
            return
        mask = without_inertia(self.functions.mask, terms, self.without_force)
        gains = fit_simpls(self.training, len(terms), allowed=mask).coefficients[-1]
        places = (terms.index("u_dot"), terms.index("v_dot"), terms.index("r_dot"))
        response, spread = response_of(gains, self.information, mask, places)
        where = f"the profile {self.profile.name}"
        share = relative_inertia(self.profile, self.windows.base_mass)
        against = wrong_way(response, spread, where, *signs_of(self.profile))
        orders = orders_alone(self.profile)
        if told := against or wrong_size(response, spread, share, where, orders=orders):
            raise FerryIdError(f"{self.where}: {told}")

    def feasible(self, gains: Floats, mask: Flags) -> Feasible:
        """Return the gains nearest to given ones that physics allows, (K, 3), nearest as the training windows measure it."""
        return feasible_gains(
            self.profile,
            self.settings.scale,
            self.functions,
            mask,
            gains,
            self.information,
            self.training_velocities,
            ties=self.ties,
            reduced=self.settings.reduced,
        )

    @cached_property
    def inertia_spans(self) -> Floats:
        """Between which inertias the truth lies on each axis, shape (3, 2), by the training windows without the prior."""
        sums = CrossProducts.of(*self.whitened.rows)
        return inertia_spans(sums, self.functions.terms, self.functions.mask, self.windows.base_mass)

    @cached_property
    def information(self) -> Floats:
        """Return the second derivative of half the squared error over the gains, shape (3, K, K)."""
        Sxx = CrossProducts.of(*self.whitened.rows).centred()[0]
        with np.errstate(divide="ignore"):
            prior = np.where(np.isfinite(self.prior_spread), (self.prior_factor * self.prior_spread) ** -2.0, 0.0)
        return np.array([Sxx / self.whitening.sigma[a] ** 2 + np.diag(prior[:, a]) for a in range(3)])

    def intercepts(self, gains: Floats, offsets: Floats) -> Floats:
        """Return intercepts, (..., 3), from gains (..., K, 3) and what whitened rows leave on average (..., 3).

        A hull at rest that port and starboard make alike feels no force. An intercept is therefore drawn towards none as far as
        its standard error, with the steady forces of single logs in it, explains its size (James and Stein 1961).
        """
        K = len(self.functions.terms)
        found = self.whitened.mean[K:] - np.einsum("k,...ka->...a", self.whitened.mean[:K], gains)
        found = found + offsets / self.whitened.unit
        chance = self.whitening.sigma**2 / max(self.whitened.weight, 1e-12) + self.condition_covariance[:, K, K]
        return np.asarray(found * np.maximum(0.0, 1.0 - chance / np.maximum(found**2, np.finfo(np.float64).tiny)))

    def fitted(self, regression: Simpls) -> tuple[Floats, Floats]:
        """Return gains and intercepts for every number of components, shape (A, K, 3) and (A, 3)."""
        return regression.coefficients, self.intercepts(regression.coefficients, regression.intercepts)

    def force_form(self, gains: Floats, offsets: Floats) -> tuple[Floats, Floats]:
        """Return coefficients and intercepts of the applied force; see `to_force`."""
        mass = self.windows.base_mass
        if self.settings.reduced:
            mass = without_sway_coupling(mass)
        return to_force(gains, self.intercepts(gains, offsets), self.functions.terms, mass)

    def excitation(self, estimate: Estimate) -> Excitation:
        """Return what the training windows determine by themselves, without the prior."""
        from ferryid.identify.excitation import assess_excitation

        return assess_excitation(
            CrossProducts.of(*self.whitened.rows),
            self.functions.terms,
            estimate.regression.vip(estimate.components),
            self.motions,
            self.split.training,
            estimate.functions.mask,
        )


def weak_data(data: LogData) -> WeakData:
    """Return the same logs as windows of the weak form."""
    return WeakData(**{one.name: getattr(data, one.name) for one in fields(data)})


def every_second(rows: Flags, rate_hz: float) -> Ints:
    """Return one in so many of the marked rows (n,) that there is one a second."""
    return np.flatnonzero(rows)[:: max(1, round(rate_hz))]


def steady_forces(windows: WeakRows) -> Floats:
    """Return the ways in which a steady force of a log's own acts: along the hull, and along north and east, shape (J, 3)."""
    return np.column_stack([np.ones(len(windows)), windows.heading])


def _root(covariance: Floats) -> Floats:
    """Return a symmetric square root of a matrix without what is negative in it, shape (k, k)."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def _decorrelate(table: Floats, conditions: Floats, run: np.ndarray, autocorrelation: float) -> Floats:
    """Return columns whose rows are alike and independent, shape (J, c), if conditions of unit variance act on them, (J, 3)."""
    if not len(table):
        return table
    whole = np.column_stack([table, conditions])
    kept = np.sqrt(1.0 - autocorrelation**2)
    out = whole * kept
    follows = np.concatenate([[False], np.diff(run) == 0])
    out[follows] = whole[follows] - autocorrelation * whole[np.flatnonzero(follows) - 1]
    table, Z = out[:, : table.shape[1]] / kept, out[:, table.shape[1] :] / kept
    left, singular, _ = np.linalg.svd(Z, full_matrices=False)
    return np.asarray(table - left @ ((1.0 - 1.0 / np.sqrt(1.0 + singular**2))[:, None] * (left.T @ table)))
