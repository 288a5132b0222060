"""Whether forces act the right way round, judged on all rows of the logs before any are held out.

A fit trains on some of the rows, in windows that are long for the sake of noise. What turns a vessel to and fro within such
a window is averaged away, and with it what shows that its thrusters are exchanged. Here windows are shorter, and of all rows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.identify.contradictions import signs_of, wrong_way
from ferryid.identify.inertia import without_inertia
from ferryid.identify.motion_data import LogData
from ferryid.identify.split import Split
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_data import WeakData, weak_data
from ferryid.models.forces import ACCELERATIONS
from ferryid.regression import CrossProducts
from ferryid.types import AXES, Floats
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
    """

    response: Floats
    spread: Floats
    sigmas: Floats

    @property
    def reversed(self) -> Floats:
        """The response on axes on which it goes against the force by as much as a reversed sign gives, NaN elsewhere, (3,)."""
        against = (self.response < -IDENTIFY.opposite) & (self.response < -self.sigmas * self.spread)
        return np.where(against, self.response, np.nan)


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
    return _estimated(weak)


def _estimated(weak: WeakData) -> ForceResponse:
    from scipy.special import ndtr, stdtrit

    terms = weak.functions.terms
    mask = without_inertia(weak.functions.mask, terms, weak.without_force)
    squares, products = CrossProducts.of(*weak.whitened.rows).centred()[:2]
    windows = sum(len(one) for one in weak.windows.training)
    response, spread, sigmas = np.full(3, np.nan), np.full(3, np.nan), np.full(3, np.nan)
    for axis, name in enumerate(ACCELERATIONS):
        own, place = np.flatnonzero(mask[:, axis]), terms.index(name)
        if place not in own:
            continue
        variance, at = weak.whitening.sigma[axis] ** 2, int(np.searchsorted(own, place))
        covariance = np.linalg.pinv(weak.information[axis][np.ix_(own, own)], hermitian=True)
        # Of the functions, as many as the prior leaves to the windows take their freedom.
        free = windows - float(np.sum(covariance * squares[np.ix_(own, own)])) / variance
        if free < 1.0:
            continue
        response[axis] = 1.0 - covariance[at] @ products[own, axis] / variance
        spread[axis] = np.sqrt(max(covariance[at, at], 0.0) * windows / free)
        sigmas[axis] = stdtrit(free, ndtr(IDENTIFY.wrong_way_sigmas))
    return ForceResponse(response, spread, sigmas)


def refuse_reversed_forces(data: LogData) -> str:
    """Refuse logs in which forces act the wrong way round, and return what of that cannot be told; empty where all can.

    Raises
    ------
    FerryIdError
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
        raise FerryIdError(f"{data.where}: {told}")
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
    return (
        f"These logs do not show whether the yaw moment acts the right way round: the vessel follows it by {value:.2g} ± "
        f"{spread:.2g} of what the base model expects, and {' or '.join(causes)} would look alike. Record turns to both sides."
    )
