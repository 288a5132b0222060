"""Forces that accelerate a vessel the wrong way, or many times too little or too much: which line of a profile explains it."""

from __future__ import annotations

import numpy as np

from ferryid.identify.thresholds import IDENTIFY
from ferryid.types import AXES, Flags, Floats

_FORCES = ("surge force", "sway force", "yaw moment")


def wrong_way(response: Floats, spread: Floats, profile: str) -> str:
    """Return what is wrong and how to mend it where the vessel accelerates against the applied force; empty where it does not.

    Parameters
    ----------
    response
        Acceleration that the applied force gives over what it gives the base model's mass, on each axis, shape (3,); one where
        the base model is right, NaN where it is not estimated.
    spread
        Its standard deviation, shape (3,).
    profile
        Where the profile stands.
    """
    wrong = [axis for axis in range(3) if response[axis] < -IDENTIFY.wrong_way_sigmas * spread[axis]]
    if not wrong:
        return ""
    told = ", ".join(
        f"the {_FORCES[axis]} accelerates the vessel in {AXES[axis]} by {response[axis]:.2g} ± {spread[axis]:.1g} of what the "
        "base model expects"
        for axis in wrong
    )
    if 0 in wrong:
        cause = "the thrust or the surge velocity has the wrong sign"
        remedy = "change the sign of the thrust curve or of the actuators' signals, or the frame of the velocity"
    elif 1 in wrong:
        cause = "the actuators and the motion have y axes that point to opposite sides"
        remedy = 'set frame = "FLU" for velocity and yaw rate, or change the sign of y in position_m of the actuators'
    else:
        cause = (
            "actuators are exchanged (port and starboard, bow and stern), or heading and yaw rate count anticlockwise"
        )
        remedy = "exchange the signals of the actuators, or set the frames of heading and yaw rate"
    return f"{told}: {cause}. Fix: in {profile}, {remedy}"


def wrong_size(response: Floats, spread: Floats, share: Floats, profile: str) -> str:
    """Return what is wrong and how to mend it where the applied force is many times too large or too small; empty where not.

    It is where the inertia that it means is impossible on every axis on which it is estimated, two of them at least, and by
    more than chance: one wrong coefficient does not do that, a wrong unit does.

    Parameters
    ----------
    response, spread, profile
        As of `wrong_way`.
    share
        The base model's inertia over the rigid body's on each axis, shape (3,).
    """
    known = np.isfinite(response)
    reach = IDENTIFY.wrong_way_sigmas * spread[known]
    large = response[known] + reach < share[known] / IDENTIFY.most_inertia
    small = response[known] - reach > share[known] / IDENTIFY.least_inertia
    if np.count_nonzero(known) < 2 or not (large.all() or small.all()):
        return ""
    measured = ", ".join(f"{AXES[axis]} {response[axis]:.2g} ± {spread[axis]:.1g}" for axis in np.flatnonzero(known))
    told = f"the applied forces accelerate the vessel by {measured} of what the base model expects: "
    if small.all():
        cause = "they are several times too small, or the profile's mass is too large"
    else:
        cause = "they are several times too large, the actuators were not engaged, or the profile's mass is too small"
    remedy = (
        "correct the unit of the actuators' signals (1 rad/s is 9.55 rpm, 1 kgf 9.81 N), the thrust curve or mass_kg"
    )
    return f"{told}{cause}. Fix: in {profile}, {remedy}"


def response_of(gains: Floats, information: Floats, mask: Flags, places: tuple[int, int, int]) -> tuple[Floats, Floats]:
    """Return acceleration over expectation on each axis and its standard deviation, shape (3,) each; see `wrong_way`.

    Parameters
    ----------
    gains
        Of the weak form, shape (K, 3).
    information
        Second derivatives of half the squared error over the gains, shape (3, K, K).
    mask
        Which gains were estimated, shape (K, 3).
    places
        Rows of u_dot, v_dot and r_dot.
    """
    response, spread = np.full(3, np.nan), np.full(3, np.nan)
    for axis, place in enumerate(places):
        own = np.flatnonzero(mask[:, axis])
        if place not in own:
            continue
        covariance = np.linalg.pinv(information[axis][np.ix_(own, own)], hermitian=True)
        at = int(np.flatnonzero(own == place)[0])
        response[axis], spread[axis] = 1.0 - gains[place, axis], np.sqrt(max(covariance[at, at], 0.0))
    return response, spread
