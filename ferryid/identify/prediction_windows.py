"""Windows in which models are judged: how well they predict the acceleration, averaged over seconds.

The error of a force that is estimated from a differentiated velocity is noise for the most part, and an inertia near zero,
which leaves hardly any force, is not punished by it. Here a model predicts the acceleration from force and velocity; its error
is given as the force that it means on the base model's mass, for which it is the base model's force error. The base model that
models are judged against knows no measured wind, current or payload, so that two fits compare.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ferryid.cached import cached_property
from ferryid.identify.fit_data import Coefficients
from ferryid.identify.ratio_interval import LogErrors, ratio_interval
from ferryid.identify.settings import FitSettings
from ferryid.identify.shared_rows import SharedRows
from ferryid.identify.split import Split
from ferryid.identify.weak_rows import WeakRows
from ferryid.models import ForceScores, ModelScores, force_scores
from ferryid.models.forces import effective_mass, without_sway_coupling
from ferryid.regression.bases import Basis
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile


@dataclass(frozen=True, eq=False)
class PredictionWindows:
    """Windows of logs, of which some train and others validate.

    Attributes
    ----------
    profile, settings, functions
        Vessel, how to fit, and basis.
    motions, split
        The logs, and which of their rows train and validate.
    training_s
        Length of the training windows [s]; None: that of the settings, or else of the others, in which models are judged.
    shared
        What folds and windows of other lengths have in common with these.
    """

    profile: Profile
    settings: FitSettings
    functions: Basis
    motions: tuple[Motion, ...]
    split: Split
    training_s: float | None = field(default=None, kw_only=True)
    shared: SharedRows = field(default_factory=SharedRows, kw_only=True)

    @cached_property
    def length_s(self) -> float:
        """Length of a window in which models are judged [s]: that of the vessel, whatever they are trained with."""
        return window_seconds(self.profile)

    @property
    def training_length_s(self) -> float:
        """Length of a training window [s]."""
        return self.training_s or self.settings.weak_window_s or self.length_s

    @cached_property
    def training(self) -> tuple[WeakRows, ...]:
        """Windows within training rows, one a log."""
        return self._chosen[1]

    @cached_property
    def validation(self) -> tuple[WeakRows, ...]:
        """Windows within validation rows, one a log."""
        return self._averaged(self.split.validation, self.length_s, steadied=self._chosen[0])

    @cached_property
    def judged(self) -> tuple[WeakRows, ...]:
        """Windows in which models are judged: those that validate, or those of the training rows where none do."""
        if self.split.kind != "none":
            return self.validation
        if self.training_length_s == self.length_s:
            return self.training
        return self._averaged(self.split.training, self.length_s, steadied=self._chosen[0])

    def _averaged(self, masks: Sequence[Flags], length_s: float, *, steadied: bool) -> tuple[WeakRows, ...]:
        return tuple(
            self.shared.windows(
                motion, mask, self.profile, self.settings.scale, self.functions, length_s, steadied=steadied
            )
            for motion, mask in zip(self.motions, masks, strict=True)
        )

    @property
    def velocities(self) -> tuple[Floats, ...]:
        """Velocities that enter products, shape (n, 3) each: measured, or with slow errors replaced by the position's.

        Without sway velocity they are as measured: the position's holds the sway that is taken as zero.

        Noise of a velocity that lasts for seconds, multiplied into damping and Coriolis forces, biases their coefficients
        towards zero (errors in variables). Whichever leaves less of the training windows to a regression has less of it.
        """
        return tuple(self.shared.velocity(motion, steadied=self._chosen[0]) for motion in self.motions)

    @cached_property
    def _chosen(self) -> tuple[bool, tuple[WeakRows, ...]]:
        """Whether slow errors of the velocities are replaced, and the training windows."""
        length_s = self.training_length_s
        measured = self._averaged(self.split.training, length_s, steadied=False)
        if self.settings.reduced or not any(mask.any() for mask in self.split.training):
            return False, measured
        steadied = self._averaged(self.split.training, length_s, steadied=True)
        better = self._left(steadied) < self._left(measured)
        return better, steadied if better else measured

    def _left(self, windows: Sequence[WeakRows]) -> float:
        """Return what least squares leave of the windows' force, as the sum of the logarithms over the axes."""
        X = np.concatenate([one.regressors(self.functions.terms) for one in windows])
        Y = np.concatenate([one.force - one.base(one.by_velocity) for one in windows])
        total = 0.0
        for axis, allowed in enumerate(self.functions.mask.T):
            columns = np.column_stack([X[:, allowed], np.ones(len(X))])
            size = np.linalg.norm(columns, axis=0)
            columns = columns / np.where(size > 0.0, size, 1.0)
            found = np.linalg.lstsq(columns, Y[:, axis], rcond=1e-10)[0]
            total += float(np.log(np.linalg.norm(Y[:, axis] - columns @ found) + 1e-300))
        return total

    @cached_property
    def base_mass(self) -> Floats:
        """The base model's mass matrix, shape (3, 3)."""
        return effective_mass(self.profile, self.settings.scale, (), np.zeros((0, 3)))

    def errors(self, found: Coefficients) -> ForceScores:
        """Return the errors of base model and new model on validation windows, on training windows where there are none.

        Infinite for a model whose mass matrix cannot be inverted.
        """
        nothing = (np.zeros((0, 3)),) * 3
        every, base, model = (np.concatenate(part) for part in zip(nothing, *self.predicted(found), strict=True))
        found_scores = force_scores(every, base, model, np.ones(len(every), dtype=bool))
        if len(every):
            found_scores = replace(found_scores, mse_constant_velocity=np.mean(self._accelerating() ** 2, axis=0))
        return found_scores.without_sway() if self.settings.reduced else found_scores

    def _accelerating(self) -> Floats:
        """Return the force on the base model's mass that the measured acceleration is, shape (J, 3): the error of none."""
        forces = [np.zeros((0, 3))]
        for one in self.judged:
            inertia = without_sway_coupling(one.inertia) if self.settings.reduced else one.inertia
            forces.append(np.einsum("jab,jb->ja", inertia, one.by_velocity))
        return np.concatenate(forces)

    def predicted(self, found: Coefficients) -> list[tuple[Floats, Floats, Floats]]:
        """Return the forces of the windows of every log in which models are judged, shape (J, 3) each.

        As measured, and as base model and new model have them: apart by the force that an error of the acceleration is.
        """
        terms = self.functions.terms
        added = effective_mass(self.profile, self.settings.scale, terms, found.theta) - self.base_mass
        forces = []
        for one in self.judged:
            estimate = one.base(one.by_velocity) + one.basis(terms, one.by_velocity) @ found.theta + found.intercept
            inertia, mass = one.inertia, one.inertia + added
            if self.settings.reduced:
                inertia, mass = without_sway_coupling(inertia), without_sway_coupling(mass)
            model = one.force - _on_mass(inertia, mass, one.force - estimate)
            forces.append((one.force, one.reference(self.base_mass), model))
        return forces

    def interval(self, found: Coefficients) -> tuple[float, float] | None:
        """Return the 95 % interval of the ratio of squared errors that the verdict is on; None where there is none."""
        logs = [
            LogErrors(force - base, force - model, motion.t[one.start])
            for one, motion, (force, base, model) in zip(self.judged, self.motions, self.predicted(found), strict=True)
        ]
        # Windows that overlap are no two, so that a block is twice as long as one.
        return ratio_interval(
            [one.without_sway() for one in logs] if self.settings.reduced else logs, 2.0 * self.length_s
        )

    def scores(self, found: Coefficients) -> ModelScores:
        """Return the errors of a model as a model file has them."""
        held_out = self.split.kind != "none"
        masks = self.split.validation if held_out else self.split.training
        windows = self.judged
        return ModelScores(
            self.errors(found),
            rows=sum(len(one) for one in windows),
            seconds=sum(float(mask.sum()) / m.rate_hz for m, mask in zip(self.motions, masks, strict=True)),
            split=self.split.kind,
            split_notes=self.split.notes,
            measure="prediction",
            interval=self.interval(found),
        )


def _on_mass(inertia: Floats, mass: Floats, force: Floats) -> Floats:
    """Return the force that gives `inertia` the acceleration that `force` gives `mass`, shape (J, 3)."""
    if np.any(np.linalg.det(mass) <= 0.0):
        return np.full_like(force, np.inf)
    return np.asarray(np.einsum("jab,jb->ja", inertia @ np.linalg.inv(mass), force))
