"""Ways in which the weak form could treat errors in its regressors and unmeasured winds, measured beside what it does.

Orders are no instruments here: the controller forms them from the same noisy navigation. The reference that it follows is one,
where it was recorded: guidance makes it from the path alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.fit_data import Coefficients
from ferryid.identify.log_conditions import Conditions
from ferryid.identify.weak_data import WeakData, weak_data
from ferryid.identify.weak_rows import WeakRows, average_over_windows, to_force
from ferryid.identify.window_length import with_best_length
from ferryid.signals.track import Motion
from ferryid.types import Floats, no_progress
from tests.rivals.task import Task, coefficients


def as_it_is(task: Task, draws: int) -> Coefficients:
    """Return what the weak form finds."""
    return _estimate(with_best_length(weak_data(task.data)), draws)


def measured_velocity(task: Task, draws: int) -> Coefficients:
    """Return what it finds with the velocities as measured in every product."""
    return _estimate(_with_velocities(task, steadied=False), draws)


def steadied_velocity(task: Task, draws: int) -> Coefficients:
    """Return what it finds with velocities steadied by positions in every log."""
    return _estimate(_with_velocities(task, steadied=True), draws)


def without_winds(task: Task, draws: int) -> Coefficients:
    """Return what it finds without winds of single logs: steady forces along the hull, north and east stay."""
    data = _anew(task)
    data.__dict__["conditions"] = Conditions.none(data.windows.training, len(data.functions.terms))
    return _estimate(data, draws)


def noise_corrected(task: Task, draws: int) -> Coefficients:
    """Return what corrected normal equations find: half the difference of two velocities takes the place of the noise.

    The products of regressors from measured and from steadied velocities, whose noises are nearly independent, replace the
    squares of either (the symmetrised instrument of repeated measurements; Fuller 1987, section 2.4).
    """
    data = with_best_length(weak_data(task.data))
    return _instrumented(data, *(_regressors(_with_velocities(task, steadied=one)) for one in (False, True)))


def references_as_instruments(task: Task, draws: int) -> Coefficients:
    """Return what two-stage least squares find, with the motion that the vessel was to make as instruments.

    In the first stage every regressor is explained by the same functions of the reference's velocities and accelerations, into
    which no noise of the sensors enters; what they explain takes its place in the weak form, with its whitening, prior, bounds
    and winds (Söderström and Stoica 1989, section 8.2).
    """
    data = _anew(task)
    windows, terms = data.windows, data.functions.terms
    asked = []
    for motion, rows in zip(windows.motions, windows.split.training, strict=True):
        one = average_over_windows(
            _reference(motion), rows, data.profile, data.settings.scale, data.functions, windows.training_length_s
        )
        asked.append(one.basis(terms, one.by_velocity))
    Z, X = np.concatenate(asked), np.concatenate([one.regressors(terms) for one in windows.training])
    Z = np.column_stack([Z / np.maximum(np.linalg.norm(Z, axis=0), 1e-12), np.ones(len(Z)) / np.sqrt(len(Z))])
    explained = Z @ np.linalg.lstsq(Z, X, rcond=1e-9)[0]
    ends = np.cumsum([len(one) for one in windows.training])[:-1]
    windows.__dict__["training"] = tuple(
        _Explained(**vars(one), explained=part)
        for one, part in zip(windows.training, np.split(explained, ends), strict=True)
    )
    return _estimate(data, draws)


@dataclass(frozen=True, eq=False)
class _Explained(WeakRows):
    """Windows with what instruments explain of the regressors, shape (J, K), in their place."""

    explained: Floats

    def regressors(self, terms: tuple[str, ...]) -> Floats:
        """Return them."""
        return self.explained


def _reference(motion: Motion) -> Motion:
    """Return the motion that a log's vessel was to make."""
    if motion.eta_d is None:
        raise FerryIdError(f"{motion.log}: no reference was recorded. Fix: leave this variant out")
    known = np.isfinite(motion.eta_d).all(axis=1)
    if not known.any():
        raise FerryIdError(f"{motion.log}: no reference was recorded. Fix: leave this variant out")
    # The first sample comes after the first row of the grid.
    whole = motion.eta_d[known].copy()
    whole[:, 2] = np.unwrap(whole[:, 2])
    x, y, psi = (np.interp(motion.t, motion.t[known], column) for column in whole.T)
    north, east = np.gradient(x, motion.t), np.gradient(y, motion.t)
    cosine, sine = np.cos(psi), np.sin(psi)
    nu = np.column_stack([cosine * north + sine * east, cosine * east - sine * north, np.gradient(psi, motion.t)])
    return replace(motion, nu=nu, eta=np.column_stack([x, y, psi]))


def _anew(task: Task) -> WeakData:
    """Return the data with the windows' length chosen and nothing estimated: what is set takes part in all that follows."""
    return replace(with_best_length(weak_data(task.data)))


def _with_velocities(task: Task, *, steadied: bool) -> WeakData:
    data = _anew(task)
    windows = data.windows
    rows = windows._averaged(windows.split.training, windows.training_length_s, steadied=steadied)
    windows.__dict__["_chosen"] = steadied, rows
    return data


def _estimate(data: WeakData, draws: int) -> Coefficients:
    return estimate_correction(data, data.components(), draws, no_progress).coefficients


def _regressors(data: WeakData) -> Floats:
    return np.concatenate([one.regressors(data.functions.terms) for one in data.training_windows])


def _instrumented(data: WeakData, X: Floats, Z: Floats) -> Coefficients:
    """Return the estimate of instruments Z (J, K) for regressors X (J, K), with the prior of the weak form."""
    whitening, windows = data.whitening, data.training_windows
    Y = np.concatenate([one.force - one.base(one.acceleration(whitening.posed)) for one in windows])
    gains, intercept = np.zeros((X.shape[1], 3)), np.zeros(3)
    X0, Z0, Y0 = X - X.mean(axis=0), Z - Z.mean(axis=0), Y - Y.mean(axis=0)
    for axis, own in enumerate(data.functions.mask.T):
        spread = data.prior_factor * data.prior_spread[own, axis]
        prior = whitening.sigma[axis] ** 2 * np.where(np.isfinite(spread), spread**-2.0, 0.0)
        normal = (Z0[:, own].T @ X0[:, own] + X0[:, own].T @ Z0[:, own]) / 2.0 + np.diag(prior)
        gains[own, axis] = np.linalg.lstsq(normal, Z0[:, own].T @ Y0[:, axis], rcond=1e-12)[0]
        intercept[axis] = Y[:, axis].mean() - X.mean(axis=0) @ gains[:, axis]
    return coefficients(*to_force(gains, intercept, data.functions.terms, data.windows.base_mass))


VARIANTS: Mapping[str, Callable[[Task, int], Coefficients]] = {
    "as it is": as_it_is,
    "velocities as measured": measured_velocity,
    "velocities steadied by positions": steadied_velocity,
    "noise-corrected products": noise_corrected,
    "references as instruments": references_as_instruments,
    "no winds of single logs": without_winds,
}
"""Every variant by the name that the page gives it."""
