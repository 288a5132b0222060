"""How alike effects look: angles worked out by hand, what they depend on, and rivals on logs of one heading and of many."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import cos, radians, sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fit
from ferryid.diagnose.judging.likeness import Likeness, likeness, likeness_as_json, separation
from ferryid.diagnose.judging.responses import Key, Responses, has_response, responses, together
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.force_model import ForceModel, Measurements, hull_of
from ferryid.types import Floats
from tests.diagnose.trials import FERRY, sailed, trial_on

ROWS, H = 40, 26
RANDOM = np.random.default_rng(8)
NO_HULL: Floats = np.zeros((ROWS, H))
WIND, CURRENT, GAIN = ("wind", None), ("current", None), ("thruster_gain", "bow")
UNIT = np.linalg.qr(RANDOM.normal(size=(ROWS, 6)))[0]
"""Six orthonormal columns."""


def made(columns: dict[Key, Floats], hull: Floats = NO_HULL, error: float = 0.05) -> Responses:
    parameters = tuple((key, f"p{k}") for key, block in columns.items() for k in range(block.shape[1]))
    every = np.column_stack([hull, *columns.values()])
    spread = np.where(hull.any(axis=0), 1.0, 0.0)
    titles = {key: key[0].capitalize() for key in columns}
    return Responses(titles, dict.fromkeys(columns, error), parameters, spread, every.T @ every)


def alike(found: Likeness, first: Key, second: Key) -> float:
    return next(one.likeness for one in found.pairs if {one.first, one.second} == {first, second})


def two(first: Floats, second: Floats, hull: Floats = NO_HULL) -> float:
    return alike(likeness(made({WIND: first, CURRENT: second}, hull)), WIND, CURRENT)


def test_proportional_responses_are_wholly_alike_and_orthogonal_ones_not_at_all() -> None:
    assert two(30.0 * UNIT[:, :1], -70.0 * UNIT[:, :1]) == pytest.approx(1.0)
    assert two(30.0 * UNIT[:, :1], 70.0 * UNIT[:, 1:2]) == pytest.approx(0.0, abs=1e-9)


def test_likeness_is_the_cosine_of_the_smallest_angle_between_two_planes() -> None:
    # Two planes at 25 and 70 degrees in two orthogonal planes of their own.
    turned = [np.cos(radians(a)) * UNIT[:, k] + np.sin(radians(a)) * UNIT[:, k + 2] for k, a in enumerate((25.0, 70.0))]
    assert two(50.0 * UNIT[:, :2], 50.0 * np.column_stack(turned)) == pytest.approx(cos(radians(25.0)))


def test_neither_scale_nor_the_choice_of_parameters_matters() -> None:
    first, second = 100.0 * RANDOM.normal(size=(ROWS, 2)), 100.0 * RANDOM.normal(size=(ROWS, 3))
    before = two(first, second)
    assert 0.1 < before < 0.9
    mixed = first @ np.array([[2.0, -1.0], [0.5, 3.0]])
    assert two(mixed, 7.0 * second[:, ::-1]) == pytest.approx(before)


def test_what_the_hull_imitates_within_its_prior_is_taken_out() -> None:
    # The two have nothing but their share of a hull's slope in common.
    slope = 20.0 * UNIT[:, 2:3]
    first, second = 40.0 * UNIT[:, :1] + slope, 40.0 * UNIT[:, 1:2] + slope
    assert two(first, second) == pytest.approx(0.2)
    hull = NO_HULL.copy()
    hull[:, 4] = 3.0 * UNIT[:, 2]
    # A slope of three standard deviations of the noise takes 1 - 1/(1 + 3²) of the squared share.
    left = 400.0 / 10.0
    found = likeness(made({WIND: first, CURRENT: second}, hull))
    assert alike(found, WIND, CURRENT) == pytest.approx(left / (1600.0 + left))
    for one in found.effects:
        assert one.signal_to_noise == pytest.approx(sqrt(1600.0 + left))
        assert one.share_of_hull == pytest.approx(360.0 / 2000.0)


def test_a_direction_that_noise_hides_makes_nothing_alike() -> None:
    hidden = 0.9 * JUDGING.visible_response * UNIT[:, 1]
    first = np.column_stack([50.0 * UNIT[:, 0], hidden])
    assert two(first, 50.0 * UNIT[:, 1:2]) == pytest.approx(0.0, abs=1e-9)
    first[:, 1] *= 1.2
    assert two(first, 50.0 * UNIT[:, 1:2]) == pytest.approx(1.0)


def test_from_which_size_on_two_are_resolved() -> None:
    angle = radians(30.0)
    first, second = 10.0 * UNIT[:, :1], 40.0 * (np.cos(angle) * UNIT[:, :1] + np.sin(angle) * UNIT[:, 1:2])
    (pair,) = likeness(made({WIND: first, CURRENT: second})).pairs
    # Of s times ten standard deviations, the sine of the angle is left: half its square is the log evidence.
    assert pair.resolved_from == pytest.approx(sqrt(2.0 * JUDGING.unresolved_evidence) / 5.0)
    assert pair.alike
    assert pair.resolved
    (pair,) = likeness(made({WIND: first, CURRENT: second}, error=0.51)).pairs
    assert pair.resolved_from is None
    assert not pair.resolved
    (pair,) = likeness(made({WIND: 0.3 * first, CURRENT: second})).pairs
    assert not pair.alike, "an effect that is too small to be named looks like everything"


def test_the_limit_is_where_an_effect_that_is_just_visible_is_just_resolved() -> None:
    apart = sqrt(1.0 - JUDGING.alike**2)
    first = JUDGING.visible_response * UNIT[:, :1]
    second = 100.0 * (JUDGING.alike * UNIT[:, :1] + apart * UNIT[:, 1:2])
    (pair,) = likeness(made({WIND: first, CURRENT: second})).pairs
    assert pair.resolved_from == pytest.approx(1.0, abs=0.01)


def test_logs_together_separate_what_each_alone_does_not() -> None:
    first = made({WIND: 20.0 * UNIT[:, :1], CURRENT: 20.0 * UNIT[:, :1], GAIN: 20.0 * UNIT[:, 2:3]})
    second = made({WIND: 20.0 * UNIT[:, :1], CURRENT: -20.0 * UNIT[:, :1]})
    found = likeness(together([first, second]))
    assert alike(likeness(first), WIND, CURRENT) == alike(likeness(second), WIND, CURRENT) == pytest.approx(1.0)
    assert alike(found, WIND, CURRENT) == pytest.approx(0.0, abs=1e-9)
    assert {one.key: round(one.signal_to_noise, 6) for one in found.effects}[WIND] == round(20.0 * sqrt(2.0), 6)
    assert {one.key for one in found.effects} == {WIND, CURRENT, GAIN}


def test_logs_together_have_one_prior_of_the_hull() -> None:
    hull = NO_HULL.copy()
    hull[:, 4] = 3.0 * UNIT[:, 2]
    one = made({WIND: 40.0 * UNIT[:, :1] + 20.0 * UNIT[:, 2:3]}, hull)
    # Half the prior's width makes half the slope in its units.
    narrow = replace(
        one, hull_spread=0.5 * one.hull_spread, products=one.with_hull_spread(0.5 * one.hull_spread).products
    )
    both = likeness(together([one, narrow])).effects[0]
    assert both.signal_to_noise**2 == pytest.approx(2.0 * 1600.0 + 2.0 * 400.0 / (1.0 + 2.0 * 9.0))


def test_json_names_what_separates_a_pair_that_looks_alike() -> None:
    plain = likeness_as_json(
        likeness(made({WIND: 30.0 * UNIT[:, :1], CURRENT: 30.0 * UNIT[:, :1], GAIN: 30.0 * UNIT[:, 1:2]}))
    )
    pair = plain["pairs"][0]
    assert pair["alike"]
    assert pair["resolved_from"] is None
    assert {one["effect"] for one in pair["effects"]} == {"wind", "current"}
    assert pair["separating_manoeuvre"].startswith("a slow turn on the spot")
    assert "anemometer" in pair["separating_sensor"]
    assert [one["alike"] for one in plain["pairs"][1:]] == [False, False]
    assert all(one["separating_manoeuvre"] is None for one in plain["pairs"][1:])
    assert separation(GAIN, GAIN).manoeuvre


def spring(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """A pull along the first axis by stiffness, place, and a square of its own; the last parameter does nothing."""
    x = np.arange(ROWS) / ROWS
    pull = -p[0] * (x - p[1]) + p[2] * abs(p[2])
    return replace(force_model, external=force_model.external + np.outer(pull, [1.0, 0.0, 0.0]))


def of_one(
    apply: Callable[[ForceModel, Floats, str | None], ForceModel], parameters: tuple[Parameter, ...]
) -> Responses:
    """Return the responses of one effect in a log whose prediction errors are the external force on the first axis."""
    candidate = Candidate(
        Effect("effect", "Effect", lambda profile: (), apply, lambda v, i: "", lambda v, i: {}), None, parameters
    )
    zero = np.zeros((ROWS, 3))
    seen = Measurements(
        FERRY, np.arange(ROWS) * 0.2, zero, zero, zero, np.zeros((ROWS, 2, 3)), zero, np.ones(ROWS, dtype=bool)
    )
    plain = ForceModel(seen, hull_of(FERRY), seen.parts, seen.angles, zero)
    problem = cast(
        EstimationProblem,
        SimpleNamespace(
            plain=plain,
            hull_spread=np.zeros(H),
            hull_slopes=lambda force_model: NO_HULL,
            steps=SimpleNamespace(
                measured=np.zeros((ROWS, 1)),
                channels=np.array([True]),
                gap=lambda force_model: force_model.external[:, :1],
            ),
            whitening_filter=SimpleNamespace(white=lambda gaps: gaps[:, 0]),
        ),
    )
    return responses(problem, Fit((), (), np.empty((0, 0)), plain.hull, 0.0), [candidate])


def share_left(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Keep a share of a growing force where it exceeds a limit."""
    x = np.arange(ROWS) / ROWS
    left = x * np.where(x > p[1], p[0], 1.0)
    return replace(force_model, external=force_model.external + np.outer(left, [1.0, 0.0, 0.0]))


def test_every_parameter_goes_to_its_usual_size_and_an_idle_one_where_the_others_have_theirs() -> None:
    parameters = (
        Parameter("stiffness", "N/m", 2.0, 0.0, 100.0, start=0.5),
        Parameter("place", "m", 10.0, -1e3, 1e3),
        Parameter("square", "N", 3.0, -1e3, 1e3),
        Parameter("nothing", "N", 1.0, -1e3, 1e3),
    )
    found = of_one(spring, parameters)
    x = np.arange(ROWS) / ROWS
    # From nothing to 2 N/m; half of what lies between -10 and 10 m with 2 N/m; half of what lies between -9 and 9 N.
    expected = np.column_stack([-2.0 * x, np.full(ROWS, 20.0), np.full(ROWS, 9.0)])
    assert [name for _, name in found.parameters] == ["stiffness", "place", "square"]
    np.testing.assert_allclose(found.products[H:, H:], expected.T @ expected)


def test_where_a_share_is_lost_matters_though_no_share_can_exceed_all() -> None:
    parameters = (
        Parameter("share", "-", 0.4, 0.0, 1.0, neutral=1.0),
        Parameter("limit", "-", 0.2, 0.1, 0.9, neutral=0.5),
    )
    found = of_one(share_left, parameters)
    x = np.arange(ROWS) / ROWS
    # From 0.6 to all of it; half of what lies between limits of 0.3 and 0.7 with 0.6 left.
    expected = np.column_stack([0.4 * x * (x > 0.5), 0.2 * x * ((x > 0.3) & (x <= 0.7))])
    assert [name for _, name in found.parameters] == ["share", "limit"]
    np.testing.assert_allclose(found.products[H:, H:], expected.T @ expected)


def test_what_only_passes_or_comes_by_chance_has_no_response_before_it_is_found() -> None:
    without = {one.id for one in effects().values() if not has_response(Candidate(one, None, ()))}
    assert without == {"external_push", "gusts", "waves", "hull_parameters"}


SCENARIO = 'schema = "ferryid.scenario/1"\nvessel = "milliampere"\n[path]\nkind = "points"\npoints = {}\ndwell_s = 40\n'
ONE_HEADING = "[[4, 0, 0], [4, 4, 0], [0, 4, 0], [0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [0, 0, 0]]"
TWELVE_CORNER = SCENARIO.replace('"points"\npoints = {}', '"twelve-corner"')


@pytest.mark.slow
def test_rivals_look_alike_on_one_heading_and_apart_on_many(tmp_path: Path) -> None:
    found = {
        name: likeness(responses(problem := trial_on(sailed(tmp_path, name, scenario, 3)), fit(problem, ())))
        for name, scenario in (("one", SCENARIO.format(ONE_HEADING)), ("many", TWELVE_CORNER))
    }
    mooring, payload, gain = ("mooring", None), ("payload", None), ("thruster_gain", "thruster1")
    for first, second, most in ((WIND, CURRENT, 0.95), (WIND, mooring, 0.97), (gain, payload, 0.9)):
        one, many = (alike(found[name], first, second) for name in ("one", "many"))
        assert many < most, (first, second)
        # Of the less visible one of them, half as much again is left to tell it from the other.
        assert sqrt(1.0 - many**2) > 1.5 * sqrt(1.0 - one**2), (first, second)
    # What acts on different axes never looks alike.
    assert alike(found["many"], WIND, gain) < 0.2
    every = {one.effect for one in found["many"].effects}
    assert {"gusts", "waves", "external_push", "hull_parameters"}.isdisjoint(every)
    assert len(every) == 15
