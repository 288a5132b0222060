"""Whether forces act the right way round, judged on all rows of the logs before any are held out.

A fit trains on some of the rows, in windows that are long for the sake of noise. What turns a vessel to and fro within such
a window is averaged away, and with it what shows that its thrusters are exchanged. Here windows are shorter, and of all rows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ferryid.errors import ReversedForcesError
from ferryid.identify.contradictions import signs_of, unanswered, wrong_way
from ferryid.identify.inertia.shares import relative_inertia, without_inertia
from ferryid.identify.motion_data import LogData
from ferryid.identify.propulsive_work import PropulsiveWork, propulsive_work
from ferryid.identify.split import Split
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_data import WeakData, weak_data
from ferryid.log_warnings import log_warnings
from ferryid.models.forces import ACCELERATIONS
from ferryid.regression import CrossProducts
from ferryid.types import AXES, Flags, Floats, Ints
from ferryid.vessel.profile import Profile


@dataclass(frozen=True, eq=False)
class ForceResponse:
    """How the vessel accelerates under the applied force, by axis.

    Attributes
    ----------
    response
        Acceleration over what the base model's mass gives, shape (3,); NaN where it is not estimated.
    spread
        Its standard deviation, shape (3,).
    sigmas
        Standard deviations beyond which a response is no chance, more for fewer windows, shape (3,).
    possible
        Whether an inertia that a hull can have explains the response but for its sign, by the windows alone, shape (3,). It
        does not where a controller's answer to the motion is taken for its cause, or the unit of the force is wrong.
    share
        The base model's inertia over the rigid body's, shape (3,).
    work
        What the actuators do while the vessel keeps its way; None where that is not known, or of several logs.
    """

    response: Floats
    spread: Floats
    sigmas: Floats
    possible: Flags
    share: Floats
    work: PropulsiveWork | None = None

    @property
    def reversed(self) -> Floats:
        """The response on axes on which it goes against the force by as much as a reversed sign gives, NaN elsewhere, (3,)."""
        against = (self.response < -IDENTIFY.opposite) & (self.response < -self.sigmas * self.spread)
        return np.where(against & self.possible, self.response, np.nan)

    @property
    def unanswered(self) -> bool:
        """Whether the vessel hardly follows the applied force on any axis, nor goes against it: no actuator was engaged."""
        against = np.isfinite(self.reversed).any()
        return not against and unanswered(self.response, self.sigmas * self.spread, self.share)

    @property
    def answered(self) -> bool:
        """Whether the vessel follows the applied force on an axis by more than chance, as far as an inertia lets it."""
        least = self.share / IDENTIFY.most_inertia
        return bool(np.any(self.response - self.sigmas * self.spread > least))


def force_response(data: LogData) -> ForceResponse | None:
    """Return how the vessel accelerates under the applied force; None where the logs are too short to say.

    Parameters
    ----------
    data
        Logs with their residuals; which rows train and validate does not matter.
    """
    everything = Split(
        "none",
        tuple(motion.valid for motion in data.motions),
        tuple(np.zeros_like(motion.valid) for motion in data.motions),
        0.0,
    )
    weak = weak_data(replace(data, split=everything))
    weak = replace(weak, training_s=IDENTIFY.response_window * weak.windows.length_s)
    if weak.impossible or not all(name in data.functions.terms for name in ACCELERATIONS):
        return None
    found = _estimated(weak)
    return replace(found, work=propulsive_work(data.motions[0], data.profile)) if len(data.motions) == 1 else found


def _estimated(weak: WeakData) -> ForceResponse:
    from scipy.special import ndtr, stdtrit

    level = float(ndtr(IDENTIFY.wrong_way_sigmas))
    terms = weak.functions.terms
    mask = without_inertia(weak.functions.mask, terms, weak.without_force)
    windows = sum(len(one) for one in weak.windows.training)
    response, spread, sigmas = np.full(3, np.nan), np.full(3, np.nan), np.full(3, np.nan)
    possible = np.zeros(3, dtype=bool)
    share = relative_inertia(weak.profile, weak.windows.base_mass)
    largest = share / IDENTIFY.least_inertia
    for axis, name in enumerate(ACCELERATIONS):
        own, place = np.flatnonzero(mask[:, axis]), terms.index(name)
        if place not in own:
            continue
        at = int(np.searchsorted(own, place))
        prior = np.nan_to_num((weak.prior_factor * weak.prior_spread[own, axis]) ** -2.0)
        response[axis], spread[axis], free = _response(weak, axis, own, at, prior, windows)
        sigmas[axis] = float(stdtrit(free, level))
        prior[at] = 0.0
        alone, error, free = _response(weak, axis, own, at, prior, windows)
        possible[axis] = bool(alone + float(stdtrit(free, level)) * error > -largest[axis])
    return ForceResponse(response, spread, sigmas, possible, share)


def _response(weak: WeakData, axis: int, own: Ints, at: int, prior: Floats, windows: int) -> tuple[float, float, float]:
    """Return the response of an axis, its standard deviation, and the freedom that the noise is of; NaN without any.

    The noise is what the estimate leaves: the one by which windows are whitened is of a fit that the prior holds back, and
    larger than the noise where the prior is far off, as with a reversed force.

    Parameters
    ----------
    weak, axis
        The windows, and the axis.
    own, at
        Its k functions, and the place of its acceleration among them.
    prior
        Inverse variances of the gains, shape (k,).
    windows
        Number of windows.
    """
    squares, products, outputs = CrossProducts.of(*weak.whitened.rows).centred()[:3]
    X, Xy, yy = squares[np.ix_(own, own)], products[own, axis], outputs[axis, axis]
    variance = float(weak.whitening.sigma[axis] ** 2)
    for _ in range(IDENTIFY.expectation_steps):
        covariance = np.linalg.pinv(X / variance + np.diag(prior), hermitian=True)
        gains = covariance @ Xy / variance
        # Of the functions, as many as the prior leaves to the windows take their freedom.
        free = windows - float(np.sum(covariance * X)) / variance
        if free < 1.0:
            return np.nan, np.nan, np.nan
        variance = max(float(yy - 2.0 * gains @ Xy + gains @ X @ gains) / free, IDENTIFY.no_force**2)
    return float(1.0 - gains[at]), float(np.sqrt(max(covariance[at, at], 0.0))), free


def refuse_reversed_forces(data: LogData) -> str:
    """Refuse logs in which forces act the wrong way round, and return what of that cannot be told; empty where all can.

    Raises
    ------
    ReversedForcesError
        With what explains it and the line of the profile to change.
    """
    if data.settings.residual != "measured":
        return ""
    found = force_response(data)
    if found is None:
        return ""
    profile = data.profile
    told = wrong_way(found.reversed, found.spread, f"the profile {profile.name}", *signs_of(profile))
    if told:
        doubts = log_warnings([(one.recording.name, one.doubts) for one in data.prepared])
        # What contradicts itself in the log may be why.
        beside = f". Mind first: {' '.join(doubts).removesuffix('.')}" if doubts else ""
        raise ReversedForcesError(f"{data.where}: {told}{beside}")
    return _undecided(found, profile)


def _undecided(found: ForceResponse, profile: Profile) -> str:
    """Return that the way in which the yaw moment acts is not known, where it is not; nothing else shows that."""
    yaw = AXES.index("yaw")
    value, spread = found.response[yaw], found.spread[yaw]
    angles, actuators, _ = signs_of(profile)
    if not np.isfinite(value) or value > found.sigmas[yaw] * spread or (actuators < 2 and not angles):
        return ""
    causes = ["exchanged actuators"] if actuators > 1 else []
    causes += ["an angle of the wrong sign"] if angles else []
    if value < -found.sigmas[yaw] * spread:
        return (
            f"The vessel turns against the yaw moment, by {value:.2g} ± {spread:.2g} of what the base model expects: more than "
            f"chance, but less than any inertia lets it. {' or '.join(causes).capitalize()} would do that where the moment is "
            "several times too large, or the inertia of the profile too small. Compare the yaw rate in turns to both sides "
            "with the actuators."
        )
    return (
        f"These logs do not show whether the yaw moment acts the right way round: the vessel follows it by {value:.2g} ± "
        f"{spread:.2g} of what the base model expects, and {' or '.join(causes)} would look alike. Record turns to both sides."
    )
