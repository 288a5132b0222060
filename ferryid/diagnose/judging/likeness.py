"""How alike effects look in logs before anything is fitted, how visible each is, and what separates those that look alike.

What the hull's coefficients imitate within their prior is projected out of every response. Two effects whose responses then
span the same space cannot be told apart, whatever is fitted; the cosine of the smallest angle between the two spaces is their
likeness.

References
----------
Björck and Golub (1973), Numerical methods for computing angles between linear subspaces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from ferryid.diagnose.judging.campaign import JudgedCampaign
from ferryid.diagnose.judging.experiment_design import manoeuvre, sensor_of
from ferryid.diagnose.judging.judge import JudgedLog
from ferryid.diagnose.judging.responses import ROUNDING, Key, Responses, has_response, responses, together
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.force_model import COEFFICIENTS
from ferryid.types import Floats


@dataclass(frozen=True)
class EffectVisibility:
    """An effect of usual size in a log.

    Attributes
    ----------
    effect, instance, title
        Which one.
    signal_to_noise
        Norm of its response, in standard deviations of the noise; the root mean square over the signs of its parameters.
    share_of_hull
        Share of the squared response that the hull's coefficients imitate within their prior, and that is not in it.
    """

    effect: str
    instance: str | None
    title: str
    signal_to_noise: float
    share_of_hull: float

    @property
    def key(self) -> Key:
        """Effect and instance."""
        return self.effect, self.instance

    @property
    def visible(self) -> bool:
        """True where it could be named at its usual size."""
        return self.signal_to_noise >= JUDGING.visible_response


@dataclass(frozen=True)
class Pair:
    """Two effects in a log.

    Attributes
    ----------
    first, second
        Effect and instance of each.
    likeness
        Cosine of the smallest angle between their responses: 1 where they cannot be told apart, 0 where nothing is common.
    resolved_from
        How many times its usual size the less visible one needs for the log evidence between the two to exceed
        `JUDGING.unresolved_evidence`; None where no size is enough, as formulas are as far off as the two differ.
    alike
        True where both are visible and their likeness is `JUDGING.alike` or more.
    """

    first: Key
    second: Key
    likeness: float
    resolved_from: float | None
    alike: bool

    @property
    def resolved(self) -> bool:
        """True where usual sizes are enough to tell the two apart."""
        return self.resolved_from is not None and self.resolved_from <= 1.0


@dataclass(frozen=True)
class Likeness:
    """How alike effects look in a log, or in several together.

    Attributes
    ----------
    effects
        Those that do anything there, alike ones beside each other.
    matrix
        Likeness of every two, in the same order, shape (n, n), ones on the diagonal.
    pairs
        Every two of them, the most alike first.
    setting
        Where the logs were recorded; empty where that is not known.
    """

    effects: tuple[EffectVisibility, ...]
    matrix: Floats
    pairs: tuple[Pair, ...]
    setting: str = ""

    @property
    def alike(self) -> tuple[Pair, ...]:
        """Pairs of visible effects that look alike, the most alike first."""
        return tuple(one for one in self.pairs if one.alike)

    @property
    def hidden(self) -> tuple[EffectVisibility, ...]:
        """Effects that could not be named at their usual size."""
        return tuple(one for one in self.effects if not one.visible)

    def title(self, key: Key) -> str:
        """Return the title of an effect."""
        return next(one.title for one in self.effects if one.key == key)


def likeness(found: Responses) -> Likeness:
    """Return how alike effects look, and how visible each is, once the hull is projected out with its prior."""
    h = len(found.hull_spread)
    across = found.products[:h, h:]
    left = found.products[h:, h:] - across.T @ np.linalg.solve(found.products[:h, :h] + np.eye(h), across)
    keys = list(found.titles)
    own = [[k for k, (key, _) in enumerate(found.parameters) if key == one] for one in keys]
    whole = [float(np.trace(found.products[h:, h:][np.ix_(places, places)])) for places in own]
    rest = [max(float(np.trace(left[np.ix_(places, places)])), 0.0) for places in own]
    there = [k for k in range(len(keys)) if rest[k] > ROUNDING * whole[k]]
    effects = [
        EffectVisibility(*keys[k], found.titles[keys[k]], sqrt(rest[k]), 1.0 - rest[k] / whole[k]) for k in there
    ]
    bases = [_visible_directions(left[np.ix_(own[k], own[k])]) for k in there]
    matrix = np.eye(len(there))
    for i, a in enumerate(there):
        for j, b in enumerate(there[:i]):
            matrix[i, j] = matrix[j, i] = cosine(bases[i].T @ left[np.ix_(own[a], own[b])] @ bases[j])
    order = _order(matrix)
    effects, matrix = [effects[k] for k in order], matrix[np.ix_(order, order)]
    pairs = [
        _pair(found, one, other, float(matrix[i, j]))
        for i, one in enumerate(effects)
        for j, other in enumerate(effects)
        if i < j
    ]
    pairs.sort(key=lambda pair: -pair.likeness)
    return Likeness(tuple(effects), matrix, tuple(pairs), found.setting)


def cosine(across: Floats) -> float:
    """Return the cosine of the smallest angle between two spaces, from the products of their orthonormal bases."""
    return min(float(np.linalg.norm(across, 2)), 1.0)


def _visible_directions(products: Floats) -> Floats:
    """Return an orthonormal basis of an effect's response, in its parameters, shape (q, k).

    Directions that are not visible at usual size would make any two effects alike, and nobody asks for them: they are left out,
    but for the most visible one.
    """
    values, vectors = np.linalg.eigh(products)
    seen = values >= max(JUDGING.visible_response**2, ROUNDING * values[-1])
    seen[-1] = True
    return np.asarray(vectors[:, seen] / np.sqrt(values[seen]))


def _pair(found: Responses, one: EffectVisibility, other: EffectVisibility, alike: float) -> Pair:
    apart = sqrt(max(1.0 - alike**2, 0.0))
    size = None
    if apart > max(found.errors[one.key], found.errors[other.key]):
        size = sqrt(2.0 * JUDGING.unresolved_evidence) / (apart * min(one.signal_to_noise, other.signal_to_noise))
    return Pair(one.key, other.key, alike, size, one.visible and other.visible and alike >= JUDGING.alike)


def _order(matrix: Floats) -> list[int]:
    """Return the places of effects so that alike ones stand beside each other: average linkage, leaves in optimal order."""
    if len(matrix) < 3:
        return list(range(len(matrix)))
    # A tenth of a second to import: only where there is something to order.
    from scipy.cluster.hierarchy import leaves_list, linkage
    from scipy.spatial.distance import squareform

    distance = np.sqrt(np.clip(1.0 - matrix**2, 0.0, 1.0))
    np.fill_diagonal(distance, 0.0)
    return [int(k) for k in leaves_list(linkage(squareform(distance, checks=False), "average", optimal_ordering=True))]


@dataclass(frozen=True)
class Separation:
    """What separates two effects: a manoeuvre to record, and a sensor, empty where none measures either."""

    manoeuvre: str
    sensor: str


def separation(first: Key, second: Key, setting: str = "") -> Separation:
    """Return what separates two effects in a setting."""
    sensors = dict.fromkeys(sensor for effect, _ in (first, second) if (sensor := sensor_of(effect, setting)))
    return Separation(manoeuvre(first[0], [second[0]], setting) or "", " or ".join(sensors))


def likeness_of_logs(
    judged: Sequence[JudgedLog], campaign: JudgedCampaign | None
) -> tuple[dict[str, Likeness], Likeness | None]:
    """Return how alike effects look in each of several logs, by path, and in all of them together.

    Parameters
    ----------
    judged
        Logs that are long enough.
    campaign
        What they say together: its hull's prior is that of all; None of logs that are no campaign, which have no such sum.
    """
    every = {one.selected.path: _responses(one) for one in judged}
    single = {path: likeness(one) for path, one in every.items()}
    if campaign is None or not every:
        return single, None
    spread = campaign.hull.fit.campaign.hull.spread[: len(COEFFICIENTS)]
    return single, likeness(together(list(every.values()), spread))


def _responses(log: JudgedLog) -> Responses:
    """Return the responses as they are before anything is fitted but hull and noise."""
    estimated = log.selected.estimated
    if estimated.baseline.updates_model:
        return responses(estimated.problem, log.base)
    # The neutral values are those of the simulation that the recording is compared with.
    return responses(estimated.problem, log.base, [one for one in log.selected.steady if has_response(one)])


def likeness_as_json(found: Likeness) -> dict[str, Any]:
    """Return effects with their visibility, and every two with their likeness, as in ``ferryid.diagnosis/1``."""
    return {
        "effects": [
            {
                "effect": one.effect,
                "instance": one.instance,
                "signal_to_noise": one.signal_to_noise,
                "visible": one.visible,
                "share_of_hull": one.share_of_hull,
            }
            for one in found.effects
        ],
        "pairs": [_pair_as_json(one, found.setting) for one in found.pairs],
    }


def _pair_as_json(pair: Pair, setting: str) -> dict[str, Any]:
    between = separation(pair.first, pair.second, setting) if pair.alike else None
    return {
        "effects": [{"effect": effect, "instance": instance} for effect, instance in (pair.first, pair.second)],
        "likeness": pair.likeness,
        "resolved_from": pair.resolved_from,
        "alike": pair.alike,
        "separating_manoeuvre": None if between is None else between.manoeuvre or None,
        "separating_sensor": None if between is None else between.sensor or None,
    }
