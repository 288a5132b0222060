"""A coefficient of another sign than the base model's is told, where its interval says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.identify.sign_changes import sign_changes
from ferryid.models import Model
from tests.export.models import fitted


def turned(changes: dict[tuple[str, int], float], spread: float) -> Model:
    """Return a fit that adds to the coefficients of some terms, with intervals that reach `spread` from their values."""
    model = fitted("modulus", "decoupled")
    theta = np.zeros_like(model.theta)
    for (term, axis), change in changes.items():
        theta[model.terms.index(term), axis] = change
    return replace(model, theta=theta, low=theta - spread, high=theta + spread, scale={})


def test_a_fit_that_keeps_the_signs_has_nothing_to_tell() -> None:
    assert sign_changes(turned({}, 1.0)) == ()


@pytest.mark.parametrize(("spread", "told"), [(100.0, True), (2000.0, False)])
def test_a_coefficient_that_turns_beyond_its_interval_is_told(spread: float, told: bool) -> None:
    """The profile's m11 is 2390 kg."""
    said = sign_changes(turned({("u_dot", 0): -3390.0}, spread))
    assert said == (
        (
            "Of another sign than in the base model, beyond the 95 % interval: m11 -1000 kg (-1100 to -900.3; base model "
            "2390). The base model may be wrong in them, or they stand for a force that has no term.",
        )
        if told
        else ()
    )


def test_those_beyond_the_fourth_are_counted() -> None:
    """Damping of a SNAME coefficient that is negative takes a positive force."""
    terms = {("u_dot", 0): -1e5, ("v_dot", 1): -1e5, ("r_dot", 2): -1e5, ("u", 0): -1e5, ("v", 1): -1e5, ("r", 2): -1e5}
    (said,) = sign_changes(turned(terms, 1.0))
    assert said.count("; base model ") == 4
    assert said.endswith("and 2 more. The base model may be wrong in them, or they stand for a force that has no term.")
