"""Which manoeuvres are chosen: what is worth most, in the time there is."""

from __future__ import annotations

from math import log

import numpy as np
import pytest

from ferryid.diagnose.judging import Responses
from ferryid.effects.force_model import COEFFICIENTS
from ferryid.errors import FerryIdError
from ferryid.planning.information import deviations
from ferryid.planning.selection import MOST_SIZE, choose, separated_from, worth_of
from ferryid.types import Floats

H = len(COEFFICIENTS)
WIND, CURRENT = ("wind", None), ("current", None)


def told(*information: float, effects: Floats | None = None) -> Responses:
    """Return responses with these diagonal entries for the first coefficients, and the products of two effects."""
    spread = np.zeros(H)
    spread[: len(information)] = 1.0
    q = 0 if effects is None else len(effects)
    products = np.zeros((H + q, H + q))
    products[range(len(information)), range(len(information))] = information
    names: tuple = ()
    if effects is not None:
        products[H:, H:] = effects
        names = ((WIND, "north"), (CURRENT, "north"))
    keys = {key: key[0] for key, _ in names}
    return Responses(keys, dict.fromkeys(keys, 0.0), names, spread, products)


def test_deviations_are_those_of_the_posterior() -> None:
    found = told(3.0, 99.0)
    # Prior information is 1 in these units.
    assert deviations(found)[:2] == pytest.approx([0.5, 0.1])
    assert worth_of(found, ()) == pytest.approx(-log(0.5 * (0.5 + 0.1)))


def test_the_manoeuvre_that_tells_most_of_what_is_not_known_yet() -> None:
    ahead, aside = told(1e4, 0.0), told(0.0, 1e4)
    assert [k for k, _ in choose([60.0, 60.0], [ahead, aside], [], [], 130.0)] == [0, 1]
    # What is known already is not asked for again.
    assert [k for k, _ in choose([60.0, 60.0], [ahead, aside], [told(1e8, 0.0)], [], 70.0)] == [1]


def test_half_of_what_is_not_known_is_worth_more_than_a_tenth_of_what_is() -> None:
    # The first coefficient is known to a tenth already; the mean logarithm would ask for ten times more of it.
    known = told(99.0, 0.0)
    much_of_the_first, some_of_the_second = told(1e4, 0.0), told(0.0, 3.0)
    choice = choose([60.0, 60.0], [much_of_the_first, some_of_the_second], [known], [], 60.0)
    assert [k for k, _ in choice] == [1]


def test_gains_add_up_to_what_all_are_worth_together() -> None:
    parts = [told(10.0, 1.0), told(1.0, 20.0)]
    chosen = choose([50.0, 70.0], parts, [], [], 300.0)
    assert sum(50.0 if k == 0 else 70.0 for k, _ in chosen) <= 300.0
    total = sum(parts[k].products for k, _ in chosen)
    all_of_it = told(*total[range(2), range(2)])
    assert sum(gain for _, gain in chosen) == pytest.approx(worth_of(all_of_it, ()))


def test_one_long_manoeuvre_takes_the_place_of_short_ones_that_tell_less() -> None:
    # By what it adds for its time the short one comes first, and leaves no room for the long one.
    short, long = told(3.0), told(1e6)
    assert [k for k, _ in choose([10.0, 100.0], [short, long], [], [], 100.0)] == [1]


def test_effects_that_are_alike_are_pulled_apart() -> None:
    alike, apart = np.array([[100.0, 100.0], [100.0, 100.0]]), np.array([[100.0, 0.0], [0.0, 100.0]])
    parts = [told(50.0, effects=alike), told(40.0, effects=apart)]
    assert [k for k, _ in choose([60.0, 60.0], parts, [], [], 60.0)] == [0]
    assert [k for k, _ in choose([60.0, 60.0], parts, [], [(WIND, CURRENT)], 60.0)] == [1]
    assert separated_from(parts[0], [(WIND, CURRENT)]) == [None]
    (size,) = separated_from(parts[1], [(CURRENT, WIND)])
    assert size is not None
    assert size < 1.0
    assert worth_of(parts[0], [(WIND, CURRENT)]) == pytest.approx(worth_of(told(50.0), ()) - log(MOST_SIZE))


def test_a_time_that_is_too_short() -> None:
    with pytest.raises(FerryIdError, match="the shortest manoeuvre takes 60 s, and there are 30 s"):
        choose([60.0, 90.0], [told(1.0), told(1.0)], [], [], 30.0)
