"""Logs of several in which the actuators were not engaged, as the response of the vessel to the applied force shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.identify.contradictions import wrong_size
from ferryid.identify.force_signs import ForceResponse, force_response
from ferryid.identify.motion_data import prepared_data
from ferryid.identify.settings import FitSettings
from ferryid.signals.prepare import Opened
from ferryid.vessel.order_response import orders_alone
from ferryid.vessel.profile import Profile


def force_response_of(one: Opened, profile: Profile) -> ForceResponse | None:
    """Return how the vessel of a log accelerates under the applied force, as a fit with the usual settings would ask.

    None where the log cannot say, as one that is shorter than the smoothing window, or than the windows of a fit.
    """
    try:
        return force_response(prepared_data(profile, FitSettings().on(profile), [one]))
    except FerryIdError:
        return None


def unengaged(responses: Mapping[str, ForceResponse | None], profile: Profile) -> dict[str, str]:
    """Return, of several logs, those in which the actuators were not engaged, and a sentence on each, with its remedy.

    None where more logs show that the vessel does not follow the applied force than show that it does: the profile is wrong
    then, and what a fit to all of them is refused for says where.

    Parameters
    ----------
    responses
        How the vessel accelerates in each log, by the log's path; None where that is not known.
    profile
        The vessel.
    """
    known = {path: one for path, one in responses.items() if one is not None}
    without = {path: one for path, one in known.items() if one.unanswered}
    if len(without) > sum(one.answered for one in known.values()):
        return {}
    return {
        path: f"{unanswered_force(one, profile).partition('. Fix: ')[0]}. In other logs the vessel follows them. Fix: see "
        "whether the actuators were engaged in this log, or give it a profile of its own"
        for path, one in without.items()
    }


def pooled(responses: Sequence[ForceResponse | None]) -> ForceResponse | None:
    """Return how the vessel accelerates in several logs together: means by their inverse variances, None where none is known.

    Where logs scatter more than their own spreads explain, the spread of the mean is that of the scatter.
    """
    known = [one for one in responses if one is not None]
    if not known:
        return None
    values, spreads, sigmas = (
        np.array([getattr(one, name) for one in known]) for name in ("response", "spread", "sigmas")
    )
    there = np.isfinite(values) & (spreads > 0.0)
    weights = np.where(there, 1.0 / np.where(there, spreads, 1.0) ** 2, 0.0)
    total, count = weights.sum(axis=0), there.sum(axis=0)
    able = count > 0
    mean = np.where(
        able, np.nansum(weights * np.where(there, values, 0.0), axis=0) / np.where(able, total, 1.0), np.nan
    )
    away = np.where(there, values - mean, 0.0)
    scatter = np.sqrt(np.sum(weights * away**2, axis=0) / np.maximum(count - 1, 1))
    return ForceResponse(
        mean,
        np.where(able, np.maximum(scatter, 1.0) / np.sqrt(np.where(able, total, 1.0)), np.nan),
        # All logs have more freedom than any of them.
        np.min(np.where(there, sigmas, np.inf), axis=0),
        np.any([one.possible for one in known], axis=0),
        known[0].share,
    )


def unanswered_force(response: ForceResponse | None, profile: Profile) -> str:
    """Return that the vessel of a log hardly follows the applied force, with what explains it; empty where it does.

    Parameters
    ----------
    response
        How the vessel accelerates in the log; None where that is not known.
    profile
        The vessel.
    """
    if response is None or not response.unanswered:
        return ""
    one, orders = response, orders_alone(profile)
    return wrong_size(one.response, one.spread, one.share, profile.name, one.sigmas, orders=orders)
