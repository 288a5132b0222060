"""Forces that accelerate a vessel the wrong way, or many times too little or too much: which line of a profile explains it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ferryid.identify.thresholds import IDENTIFY
from ferryid.types import AXES, Flags, Floats
from ferryid.vessel.profile import Profile

_FORCES = ("surge force", "sway force", "yaw moment")


def wrong_way(
    response: Floats,
    spread: Floats,
    profile: str,
    angles: Sequence[str] = (),
    actuators: int = 2,
    pairs: Sequence[tuple[str, str]] = (),
) -> str:
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
    angles
        Signals that say where actuators push, such as ``stern.rudder``.
    actuators
        How many there are: one cannot be taken for another.
    pairs
        Signals of one actuator with those of another that may have been exchanged.
    """
    wrong = [axis for axis in range(3) if response[axis] < -IDENTIFY.wrong_way_sigmas * spread[axis]]
    if not wrong:
        return ""
    told = ", ".join(
        f"the {_FORCES[axis]} accelerates the vessel in {AXES[axis]} by {response[axis]:.2g} ± {spread[axis]:.1g} times what "
        "the base model expects"
        for axis in wrong
    )
    if max(-response[axis] for axis in wrong) < IDENTIFY.opposite:
        cause = "the motion hardly follows the applied force at all, rather than going against it"
        remedy = (
            "check which signal drives which actuator, position_m and angle_deg of each, and the unit of their signals"
        )
        if wrong == [2] and (actuators > 1 or angles):
            one = "exchanged actuators" if actuators > 1 else "an angle of the wrong sign"
            cause += f", or {one} or a heading that counts anticlockwise, with a moment that is several times too large"
            remedy += ", and the frames of heading and yaw rate"
    elif 0 in wrong:
        cause = "the thrust or the surge velocity has the wrong sign"
        remedy = "change the sign of the thrust curve or of the actuators' signals, or the frame of the velocity"
    elif 1 in wrong:
        cause = "the actuators and the motion have y axes that point to opposite sides"
        remedy = 'set frame = "FLU" for velocity and yaw rate, or change the sign of y in position_m of the actuators'
        if angles and 2 in wrong:
            # What an angle pushes aside turns the vessel, too.
            cause = f"an angle has the wrong sign, or {cause}"
            remedy = f"turn the sign in {_tables(angles)}, or {remedy}"
    else:
        causes = ["actuators are exchanged (port and starboard, bow and stern)"] if actuators > 1 else []
        causes += ["an angle has the wrong sign"] if angles else []
        lines = ", ".join(f'[signals."{one}"] with [signals."{other}"]' for one, other in pairs)
        exchange = f"exchange the signals of the actuators{f' ({lines})' if lines else ''}"
        remedies = [exchange] if actuators > 1 else []
        remedies += [f"turn the sign in {_tables(angles)}"] if angles else []
        cause = ", or ".join([*causes, "heading and yaw rate count anticlockwise"])
        remedy = ", or ".join([*remedies, "set the frames of heading and yaw rate"])
    return f"{told}: {cause}. Fix: in {profile}, {remedy}"


def _tables(signals: Sequence[str]) -> str:
    return " or ".join(f'[signals."{one}"]' for one in signals)


def signs_of(profile: Profile) -> tuple[list[str], int, list[tuple[str, str]]]:
    """Return signals that say where actuators push, the number of actuators, and signals of two that may be exchanged."""
    quantities = [one.quantity for one in profile.signals]
    # An order counts where the angle was not measured.
    angles = [
        one
        for one in quantities
        if one.removesuffix(".command").endswith((".rudder", ".angle"))
        and (one.removesuffix(".command") == one or one.removesuffix(".command") not in quantities)
    ]
    pairs = list[tuple[str, str]]()
    if len(profile.actuators) == 2:
        first, second = (one.name for one in profile.actuators)
        kinds = [one.removeprefix(f"{first}.") for one in quantities if one.startswith(f"{first}.")]
        shared = [kind for kind in kinds if f"{second}.{kind}" in quantities]
        measured = [kind for kind in shared if not kind.endswith(".command")]
        pairs = [(f"{first}.{kind}", f"{second}.{kind}") for kind in measured or shared]
    return angles, len(profile.actuators), pairs


def wrong_size(
    response: Floats,
    spread: Floats,
    share: Floats,
    profile: str,
    sigmas: Floats | float = IDENTIFY.wrong_way_sigmas,
    *,
    orders: bool = False,
) -> str:
    """Return what is wrong and how to mend it where the applied force is many times too large or too small; empty where not.

    It is where the inertia that it means is impossible on every axis on which it is estimated, and on two of them at least by
    more than chance: one wrong coefficient does not do that, a wrong unit does.

    Parameters
    ----------
    response, spread, profile
        As of `wrong_way`.
    share
        The base model's inertia over the rigid body's on each axis, shape (3,).
    sigmas
        Standard deviations beyond which a response is no chance, shape (3,) or one for all.
    orders
        True where the forces are those of orders, which actuators may follow late.
    """
    known = np.isfinite(response)
    reach = (sigmas * spread)[known]
    high = share[known] / IDENTIFY.least_inertia
    large = unanswered(response, sigmas * spread, share)
    small = bool(np.all(response[known] > high)) and np.count_nonzero(response[known] - reach > high) >= 2
    if not (large or small):
        return ""
    measured = ", ".join(f"{AXES[axis]} {response[axis]:.2g} ± {spread[axis]:.1g}" for axis in np.flatnonzero(known))
    told = f"the applied forces accelerate the vessel by {measured} times what the base model expects: "
    if small:
        cause = "they are several times too small, or the profile's mass is too large"
    else:
        late = " or follow their orders late" if orders else ""
        cause = f"they are several times too large, the actuators were not engaged{late}, or the profile's mass is too small"
    remedy = (
        "correct the unit of the actuators' signals (1 rad/s is 9.55 rpm, 1 kgf 9.81 N), the thrust curve or mass_kg"
    )
    if orders and not small:
        remedy += (
            ", or map the actuators' feedback in place of their orders, if the log has it, or state how late these are "
            'followed (time_constant_s, delay_s in the [signals."NAME.speed.command"] and the like)'
        )
    return f"{told}{cause}. Fix: in {profile}, {remedy}"


def unanswered(response: Floats, reach: Floats, share: Floats) -> bool:
    """Return whether the vessel hardly follows the applied force on any axis, on two at least by more than chance.

    Parameters
    ----------
    response, share
        As of `wrong_size`.
    reach
        How far a response is from the truth by chance, shape (3,).
    """
    known = np.isfinite(response)
    least = share[known] / IDENTIFY.most_inertia
    surely = np.count_nonzero(response[known] + reach[known] < least)
    return bool(np.all(response[known] < least)) and bool(surely >= 2)


def faint_force(force: Floats, needed: Floats, profile: str) -> str:
    """Return a warning where the applied force is a small part of what the motion needs on every axis; empty where it is not.

    Such a force hardly determines an inertia, so that `wrong_size` does not see it. A vessel that drifts looks the same.

    Parameters
    ----------
    force, needed
        Applied force, and what the base model needs for the motion, averaged over windows, [N, N, N·m], shape (J, 3) each.
    profile
        Where the profile stands.
    """
    sizes = np.sqrt(np.mean(force**2, axis=0)), np.sqrt(np.mean(needed**2, axis=0))
    acting = sizes[0] > IDENTIFY.no_force * sizes[1]
    shares = sizes[0][acting] / sizes[1][acting]
    if np.count_nonzero(acting) < 2 or np.any(shares > IDENTIFY.faint_force):
        return ""
    parts = ", ".join(f"{AXES[axis]} {share:.2g}" for axis, share in zip(np.flatnonzero(acting), shares, strict=True))
    return (
        f"The applied force is a small part of what the base model needs for this motion ({parts}): if the vessel did not "
        f"drift, correct in {profile} the unit of the actuators' signals (1 rad/s is 9.55 rpm, 1 kgf 9.81 N) or the thrust "
        "curve."
    )


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
