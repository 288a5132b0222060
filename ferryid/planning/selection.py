"""Which manoeuvres tell most in a time: how far deviations of coefficients come down, and how far effects separate.

What counts is the mean of the deviations, each in that of the prior: the error to be expected of a coefficient. Their mean
logarithm (the determinant of the information, nearly) rewards the hundredth part of a coefficient that is known well already as
much as the first half of one that is not; the trials that it leads to are hard throughout, and leave linear damping unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ferryid.diagnose.judging import Key, Responses, likeness, together
from ferryid.errors import FerryIdError
from ferryid.planning.information import deviations
from ferryid.types import Floats

LEAST_GAIN = 1e-4
"""Logarithm of the mean deviation below which an exchange gains nothing."""
MOST_SIZE = 100.0
"""Multiple of the usual size at which two effects count as not separable at all."""


def choose(
    lasts_s: Sequence[float],
    parts: Sequence[Responses],
    known: Sequence[Responses],
    pairs: Sequence[tuple[Key, Key]],
    seconds: float,
) -> list[tuple[int, float]]:
    """Return the places of the manoeuvres that tell most in a time, with what each adds, the best first.

    One after the other by what it adds, or adds for its time, then exchanged one by one as long as that tells more (Fedorov
    1972, Theory of Optimal Experiments). Every one may be chosen again: twice as long tells more.

    Parameters
    ----------
    lasts_s
        How long each manoeuvre takes [s].
    parts
        What each tells.
    known
        What is known already; none or more.
    pairs
        Effects to separate.
    seconds
        How long all may take together [s].

    Raises
    ------
    FerryIdError
        Where not even the shortest fits.
    """
    if min(lasts_s) > seconds:
        raise FerryIdError(
            f"--minutes: the shortest manoeuvre takes {min(lasts_s):.0f} s, and there are {max(seconds, 0.0):.0f} s. "
            "Fix: give more minutes"
        )
    # All with the same rows and columns, so that they add up.
    layout = together([*known, *parts])
    nothing = replace(layout, products=np.zeros_like(layout.products))
    each = [together([nothing, part]).products for part in parts]
    start = together([nothing, *known]).products

    def worth(products: Floats) -> float:
        return worth_of(replace(layout, products=products), pairs)

    def best(products: Floats, left: float, by_time: bool) -> int | None:
        now = worth(products)
        gains = {
            k: (worth(products + each[k]) - now) / (time if by_time else 1.0)
            for k, time in enumerate(lasts_s)
            if time <= left
        }
        return max(gains, key=lambda k: gains[k], default=None)

    def exchanged(by_time: bool) -> list[int]:
        chosen, left = list[int](), seconds
        changed = True
        while changed:
            changed = False
            while (k := best(_sum(start, each, chosen), left, by_time)) is not None:
                chosen.append(k)
                left -= lasts_s[k]
            for place, old in enumerate(chosen):
                rest = _sum(start, each, [*chosen[:place], *chosen[place + 1 :]])
                new = best(rest, left + lasts_s[old], False)
                if new is not None and worth(rest + each[new]) > worth(rest + each[old]) + LEAST_GAIN:
                    chosen[place], left, changed = new, left + lasts_s[old] - lasts_s[new], True
        return chosen

    # What tells most for its time may leave no room for what tells more.
    chosen = max((exchanged(by_time) for by_time in (True, False)), key=lambda one: worth(_sum(start, each, one)))
    return _in_order(start, each, chosen, worth)


def _sum(start: Floats, each: Sequence[Floats], chosen: Sequence[int]) -> Floats:
    return np.asarray(start + sum(each[k] for k in chosen))


def _in_order(
    start: Floats, each: Sequence[Floats], chosen: Sequence[int], worth: Callable[[Floats], float]
) -> list[tuple[int, float]]:
    """Return what was chosen in the order of what each adds beside those before it."""
    left, ordered, total = list(chosen), list[tuple[int, float]](), start
    while left:
        k = max(left, key=lambda one: worth(total + each[one]))
        ordered.append((k, worth(total + each[k]) - worth(total)))
        total = total + each[k]
        left.remove(k)
    return ordered


def worth_of(found: Responses, pairs: Sequence[tuple[Key, Key]]) -> float:
    """Return how much is known: the logarithm of how far the mean deviation came down, and that of how far pairs came apart."""
    free = found.hull_spread > 0.0
    h = len(found.hull_spread)
    hull = replace(found, parameters=(), titles={}, errors={}, products=found.products[:h, :h])
    worth = -float(np.log(np.mean(deviations(hull)[free]))) if free.any() else 0.0
    if pairs:
        sizes = [MOST_SIZE if one is None else np.clip(one, 1.0, MOST_SIZE) for one in separated_from(found, pairs)]
        worth -= float(np.mean(np.log(sizes)))
    return worth


def separated_from(found: Responses, pairs: Sequence[tuple[Key, Key]]) -> list[float | None]:
    """Return the multiple of the usual size from which each pair separates; None where none is enough or known."""
    sizes = {frozenset({one.first, one.second}): one.resolved_from for one in likeness(found).pairs}
    return [sizes.get(frozenset(pair)) for pair in pairs]
