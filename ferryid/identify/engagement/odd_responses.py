"""Logs of several in which the vessel goes against the applied force, or does not follow it, where it does in the others."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ferryid.counts import counted
from ferryid.effects.wording import listed
from ferryid.identify.contradictions import signs_of
from ferryid.identify.engagement.responses import pooled, unengaged
from ferryid.identify.force_signs import ForceResponse
from ferryid.identify.propulsive_work import undriven
from ferryid.identify.thresholds import IDENTIFY
from ferryid.types import AXES, Flags, Floats
from ferryid.vessel.profile import Profile

_AGAINST = (
    "the surge force of the actuators accelerates the vessel the other way",
    "the sway force of the actuators accelerates the vessel the other way",
    "the yaw moment of the actuators turns the vessel the other way",
)
_WITHOUT = (
    "the vessel does not follow the surge force of the actuators",
    "the vessel does not follow the sway force of the actuators",
    "the vessel does not follow the yaw moment of the actuators",
)


def odd_forces(responses: Mapping[str, ForceResponse | None], profile: Profile) -> dict[str, str]:
    """Return, of several logs, those that are left out as their forces act otherwise or not at all, and a sentence on each.

    Parameters and result are those of `unlike_others` and `unengaged`; of the others, those are left out too in which the
    actuators do not do the work that it takes (`undriven`).
    """
    found = {**unlike_others(responses, profile), **unengaged(responses, profile)}
    works = {path: one.work for path, one in responses.items() if path not in found and one is not None}
    return {**undriven({path: one for path, one in works.items() if one is not None}), **found}


def unlike_others(responses: Mapping[str, ForceResponse | None], profile: Profile) -> dict[str, str]:
    """Return, of several logs, those whose force acts otherwise than in the others, and a sentence on each, with its remedy.

    The sign of a rudder or of a propeller that changed in a log, an actuator's signal that is another's, or a thruster recorded
    with the wrong sign look so. A weak thruster does not: where several act, a log in which the vessel follows the force on
    any axis has an answer to it. Nothing is left out on an axis on which as many logs disagree as follow the force: the profile
    is wrong then.

    Parameters are those of `unengaged`.
    """
    known = {path: one for path, one in responses.items() if one is not None}
    followed = {path: _followed(one) for path, one in known.items()}
    against = _disagreeing({path: _reversed(one) for path, one in known.items()}, followed)
    alone = len(profile.actuators) == 1
    without = _disagreeing({path: _absent(one, alone) for path, one in known.items()}, followed)
    found = dict[str, str]()
    for path, one in known.items():
        kind, words = (against, _AGAINST) if against[path].any() else (without, _WITHOUT)
        axes = np.flatnonzero(kind[path]).tolist()
        if not axes:
            continue
        told = [f"{words[axis]} ({_figures(one, axis, known, followed)})" for axis in axes]
        causes = (
            _signs(profile, axes)
            if kind is against
            else "these signals are those of the actuators there, or their sign changed"
        )
        found[path] = (
            f"{listed(told)}. Fix: see whether {causes}, and correct that in this log, or give it a profile of its own"
        )
    return found


def _reach(response: ForceResponse) -> Floats:
    """Return how far a response may be from the truth by chance, with the margin by which a log is left out, shape (3,)."""
    return response.sigmas * response.spread * (IDENTIFY.odd_sigmas / IDENTIFY.wrong_way_sigmas)


def _followed(response: ForceResponse) -> Flags:
    """Return the axes on which the vessel clearly follows the applied force, shape (3,)."""
    return np.asarray(response.response - _reach(response) > response.share / IDENTIFY.most_inertia)


def _reversed(response: ForceResponse) -> Flags:
    """Return the axes on which the vessel clearly goes against the applied force, shape (3,)."""
    return np.asarray(response.reversed < -_reach(response))


def _absent(response: ForceResponse, alone: bool) -> Flags:
    """Return the axes on which the vessel clearly has no answer to the applied force, shape (3,).

    Of several actuators one that is weak sends the vessel round where it is meant to go ahead: then any axis on which there is
    an answer excuses the others. With one, `alone`, nothing does.
    """
    known = np.isfinite(response.response)
    least = response.share / IDENTIFY.most_inertia
    if response.unanswered or not (alone or np.all(response.response[known] < least[known])):
        return np.zeros(3, dtype=bool)
    return np.asarray(response.response + _reach(response) < least)


def _disagreeing(odd: Mapping[str, Flags], followed: Mapping[str, Flags]) -> dict[str, Flags]:
    """Return the axes of each log that are odd, where more of the logs follow the force than are odd, and enough of them do."""
    if not odd:
        return {}
    answers = np.sum(list(followed.values()), axis=0)
    others = (answers >= IDENTIFY.fewest_followed) & (answers > np.sum(list(odd.values()), axis=0))
    return {path: one & others for path, one in odd.items()}


def _figures(
    response: ForceResponse, axis: int, known: Mapping[str, ForceResponse], followed: Mapping[str, Flags]
) -> str:
    there = [known[path] for path, one in followed.items() if one[axis]]
    usual = pooled(there)
    assert usual is not None
    every = "other " * (len(there) == len(known) - 1)
    clearly = "" if every else " that show it"
    return (
        f"{response.response[axis]:.2g} ± {response.spread[axis]:.1g} times what the base model expects; "
        f"{usual.response[axis]:.2g} in the {counted(len(there), f'{every}log')}{clearly}"
    )


def _signs(profile: Profile, axes: list[int]) -> str:
    """Return which signs may have changed in a log, as a part of a sentence."""
    angles, actuators, _ = signs_of(profile)
    if AXES.index("surge") in axes:
        return "the sign of the actuators' thrust or speed changed"
    causes = [f"the sign of {listed(angles)} changed"] if angles else []
    causes += ["actuators are exchanged (port and starboard, bow and stern)"] if actuators > 1 else []
    return " or ".join(causes or ["the sign of the yaw rate changed"])
