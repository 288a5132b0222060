"""On a vessel without a hull model a thruster that changes does so from a level that nobody knows."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, estimation_problem, fit, rest_of, without
from ferryid.diagnose.inference.onset_estimation import turned
from ferryid.diagnose.inference.search import search
from ferryid.diagnose.judging.posterior import _level, _level_otherwise
from ferryid.diagnose.judging.rivals import with_both
from ferryid.effects import effects
from ferryid.models import Source
from tests.diagnose.judging.test_onset_evidence import BEGAN_S, FAULT, GAIN, of_unknown_hull
from tests.diagnose.trials import FERRY

LOSS, LEVEL = 0.6, 1.5
"""What a thruster gives from an onset on, of what it gave before, and that of the thrust curve that is believed."""
STEP = replace(GAIN.as_step(FERRY), onset_s=BEGAN_S)
SOURCE = Source("log", "0", 1.0, BEGAN_S, {}, (), None)


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> EstimationProblem:
    """Return a trial of a vessel whose profile has no hull model, and the thrust curve of a weaker propeller."""
    seen = of_unknown_hull(tmp_path_factory.mktemp("step"), "step", FAULT.format(factor=LOSS, onset=BEGAN_S))
    parts = seen.plain.parts.copy()
    parts[:, seen.plain.measurements.names.index("thruster2")] /= LEVEL
    profile = replace(FERRY, hull=replace(FERRY.hull, spread=inf))
    measurements = replace(seen.plain.measurements, profile=profile)
    plain = replace(seen.plain, parts=parts, measurements=measurements)
    return estimation_problem(seen.windows, plain, seen.hull_spread)


@pytest.fixture(scope="module")
def made(case: EstimationProblem) -> Fit:
    return fit(case, [STEP])


def test_a_step_has_the_share_that_is_lost_and_the_level_before(case: EstimationProblem, made: Fit) -> None:
    assert made.values[0][0] == pytest.approx(LOSS, rel=0.02)
    # What little is believed of the masses pulls at the level.
    assert made.values[0][1] == pytest.approx(LEVEL, rel=0.1)
    # What the vessel has from then on, and what it would have again if the fault had passed.
    after, before = _level(made, 0, SOURCE), _level_otherwise(made, 0, SOURCE)
    assert after.values == pytest.approx({"factor": float(np.prod(made.values[0]))})
    assert after.parameters["factor"].low < LOSS * LEVEL < after.parameters["factor"].high
    assert after.sources[0].onset_s == BEGAN_S
    assert before.values == pytest.approx({"factor": made.values[0][1]})
    assert before.sources[0].onset_s is None


def test_without_a_step_there_is_one_level_all_along(case: EstimationProblem, made: Fit) -> None:
    (level,), (value,) = rest_of(made, 0)
    assert level.key == STEP.key
    assert not level.is_step
    assert not level.times
    assert value == pytest.approx(made.values[0][1:])
    bare = without(case, made, 0)
    assert bare.candidates == (level,)
    assert bare.evidence < made.evidence - 20.0
    # A rival of the step stands beside that level, which the step brings along itself.
    assert with_both(case, made, 0, bare).keys == {STEP.key}
    assert with_both(case, made, 0, bare).candidates == (STEP,)


def test_what_ends_at_a_time_is_said_to_begin_then(case: EstimationProblem, made: Fit) -> None:
    ends = fit(case, [replace(STEP, onset_s=0.0, offset_s=BEGAN_S)])
    assert ends.values[0][0] == pytest.approx(1.0 / LOSS, rel=0.1)
    begins = turned(case, ends, 0)
    assert begins.candidates == (STEP,)
    assert begins.values[0] == pytest.approx(made.values[0], rel=0.02)
    assert turned(case, made, 0) is made
    # What is no step, and what comes and goes, stay as they are.
    for other in (replace(GAIN, offset_s=BEGAN_S), replace(STEP, offset_s=BEGAN_S + 100.0)):
        same = fit(case, [other], steps=1)
        assert turned(case, same, 0) is same


def test_a_search_finds_the_step_and_its_time(case: EstimationProblem) -> None:
    known = [GAIN, replace(GAIN, instance="thruster1")]
    (found,) = search(case, lambda stage: None, known=known).fit.candidates
    assert found.key == STEP.key
    assert found.is_step
    assert found.onset_s == pytest.approx(BEGAN_S, abs=5.0)
    assert found.offset_s == inf


def test_where_the_hull_is_known_there_is_no_level(case: EstimationProblem) -> None:
    known = replace(case, plain=replace(case.plain, measurements=replace(case.plain.measurements, profile=FERRY)))
    found = search(known, lambda stage: None, known=[GAIN]).fit.candidates
    assert found
    assert not any(one.is_step for one in found)


def test_only_a_thrusters_gain_has_that_form() -> None:
    assert [one.id for one in effects().values() if one.step is not None] == ["thruster_gain"]
    wind = replace(GAIN, effect=effects()["wind"], instance=None)
    assert wind.as_step(FERRY) is wind
