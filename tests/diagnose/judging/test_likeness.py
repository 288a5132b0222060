"""How alike effects look: angles worked by hand, what a hull takes away, and rivals that a manoeuvre separates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fit
from ferryid.diagnose.inference.search import list_candidates
from ferryid.diagnose.judging.likeness import (
    Likeness,
    imitated_by,
    likeness_matrix,
    likeness_of,
    side_by_side,
)
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, Measurements, hull_of
from ferryid.types import Floats
from tests.diagnose.trials import FERRY, sailed, trial_on

NONE = imitated_by(np.zeros((4, 1)))
A, B, C = np.eye(4)[:, [0]], np.eye(4)[:, [1]], np.eye(4)[:, [2]]


def alike(one: Floats, other: Floats) -> float:
    return float(likeness_matrix([one, other], NONE)[0, 1])


def test_what_is_proportional_cannot_be_separated() -> None:
    assert alike(3.0 * A, -0.5 * A) == pytest.approx(1.0)
    # A line within a plane, too.
    assert alike(A + B, np.hstack([A, B])) == pytest.approx(1.0)


def test_what_is_orthogonal_cannot_be_mistaken() -> None:
    assert alike(A, B) == pytest.approx(0.0)
    assert alike(np.hstack([A, B]), C) == pytest.approx(0.0)


def test_likeness_is_the_cosine_of_the_smallest_angle() -> None:
    # 60 degrees apart, as lines; and as planes that share no line.
    lean = 0.5 * A + np.sqrt(0.75) * C
    assert alike(A, lean) == pytest.approx(0.5)
    assert alike(np.hstack([A, B]), lean) == pytest.approx(0.5)


def test_the_scale_of_an_effect_does_not_matter() -> None:
    rng = np.random.default_rng(3)
    one, other = rng.standard_normal((4, 2)), rng.standard_normal((4, 1))
    assert alike(1e4 * one, 1e-3 * other) == pytest.approx(alike(one, other), rel=1e-9)


def test_a_faint_combination_is_not_what_an_effect_looks_like() -> None:
    share = JUDGING.faint_direction
    assert alike(np.hstack([A, 0.5 * share * B]), B) == pytest.approx(0.0)
    assert alike(np.hstack([A, 2.0 * share * B]), B) == pytest.approx(1.0)


def test_what_a_nuisance_can_imitate_does_not_make_effects_alike() -> None:
    # Both have much of the same nuisance in them, and little of their own.
    one, other = 10.0 * A + B, 10.0 * A + C
    assert alike(one, other) > 0.98
    taken = likeness_matrix([one, other], imitated_by(1e4 * A))
    assert taken[0, 1] == pytest.approx(0.0, abs=1e-5)


def test_alike_ones_lie_side_by_side() -> None:
    matrix = np.eye(4)
    for i, j, value in ((0, 2, 0.9), (0, 1, 0.8), (2, 3, 0.3)):
        matrix[i, j] = matrix[j, i] = value
    assert side_by_side(matrix) == [1, 0, 2, 3]


def pushing(name: str, axis: int, size: float = 10.0) -> Candidate:
    def act(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        push = np.zeros(3)
        push[axis] = p[0]
        return replace(force_model, external=force_model.external + push)

    effect = Effect(name, name.capitalize(), lambda profile: (), act, lambda v, i: "", lambda v, i: {})
    return Candidate(effect, None, (Parameter("force", "N", size, -1e4, 1e4),))


def pushed(library: list[Candidate], hull: float = 0.0) -> Likeness:
    """Return what is seen where the prediction errors are the pushes themselves, and the hull can push ahead."""
    zero = np.zeros((50, 3))
    measurements = Measurements(
        FERRY, np.arange(50) * 0.2, zero, zero, zero, np.zeros((50, 2, 3)), zero, np.ones(50, dtype=bool)
    )
    plain = ForceModel(measurements, hull_of(FERRY), measurements.parts, measurements.angles, zero)
    by_hull = np.zeros((150, len(COEFFICIENTS)))
    by_hull[::3, 0] = hull
    problem = SimpleNamespace(plain=plain, by_hull=by_hull, white=lambda force_model: force_model.external.ravel())
    base = Fit((), (), np.empty((0, 0)), hull_of(FERRY), 0.0)
    return likeness_of(cast(EstimationProblem, problem), base, library)


def test_visibility_is_the_signal_to_noise_ratio_at_usual_size() -> None:
    # Fifty rows of 10 N where the noise is one: the norm is 10 sqrt(50).
    (one,) = pushed([pushing("ahead", 0)]).effects
    assert one.visibility == pytest.approx(10.0 * np.sqrt(50.0))
    assert one.hull_share == pytest.approx(0.0)
    # A coefficient that gives 1 N at its usual size leaves 1 / (1 + 50) of the squared response.
    (one,) = pushed([pushing("ahead", 0)], hull=1.0).effects
    assert one.visibility == pytest.approx(10.0 * np.sqrt(50.0 / 51.0))
    assert one.hull_share == pytest.approx(50.0 / 51.0)


def test_what_does_nothing_is_no_effect_and_what_noise_hides_is_not_compared() -> None:
    still = replace(pushing("still", 0).effect, apply=lambda force_model, p, instance: force_model)
    seen = pushed([pushing("ahead", 0), pushing("aside", 1, size=0.1), replace(pushing("still", 0), effect=still)])
    assert [one.effect for one in seen.effects] == ["ahead"]
    assert [one.effect for one in seen.faint] == ["aside"]
    assert seen.pairs == ()


def test_a_pair_is_named_with_what_separates_it() -> None:
    seen = pushed([pushing("wind", 0), pushing("payload", 1), pushing("current", 0)])
    (pair,) = seen.pairs
    assert {seen.effects[pair.first].effect, seen.effects[pair.second].effect} == {"wind", "current"}
    assert pair.likeness == pytest.approx(1.0)
    assert pair.apart == pytest.approx(0.0, abs=1e-3)
    assert "turn on the spot" in pair.manoeuvre
    assert pair.sensor is not None
    assert "anemometer" in pair.sensor
    plain = seen.to_json()
    assert {plain["pairs"][0][end]["effect"] for end in ("first", "second")} == {"wind", "current"}
    assert plain["matrix"][0][0] == 1.0


SCENARIO = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
[path]
{path}
dwell_s = 30
"""
PATHS = {
    "one heading": 'kind = "points"\npoints = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 0], [1, 0, 0]]',
    "twelve corners": 'kind = "twelve-corner"',
}


@pytest.mark.slow
def test_a_turn_separates_what_one_heading_does_not(tmp_path: Path) -> None:
    found: dict[str, float] = {}
    for name, path in PATHS.items():
        problem = trial_on(sailed(tmp_path, name, SCENARIO.format(path=path), 1))
        library, _ = list_candidates(problem.plain.measurements)
        seen = likeness_of(problem, fit(problem, ()), [one for one in library if one.effect.unsteady is None])
        names = [one.effect for one in seen.effects]
        found[name] = float(seen.matrix[names.index("wind"), names.index("current")])
    assert found["one heading"] > 0.98
    assert found["twelve corners"] < JUDGING.alike
