"""A hull model that is too light for any vessel, beside a thruster that is weak: the hull is corrected first."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import read_measurements, window_lengths
from ferryid.diagnose.inference.estimation import Candidate, estimation_problem
from ferryid.diagnose.inference.needed_correction import needed, note_on_light_hull
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.search import search
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.backward_elimination import eliminate_backward
from ferryid.effects import effects
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.types import no_progress
from ferryid.validation.case import Case
from ferryid.validation.log_generation import generate
from ferryid.validation.plant.vessels import VESSELS
from ferryid.validation.prior_profile import MASSES, damping
from ferryid.vessel import load_profile
from tests.diagnose.trials import FERRY, sailed, trial_on

CALM = 'schema = "ferryid.scenario/1"\nvessel = "milliampere"\npath = { kind = "twelve-corner", dwell_s = 15 }\n'
SCALE = 0.4


@pytest.mark.slow
@pytest.mark.parametrize("thruster", ["fore", "aft"])
def test_the_weak_thruster_is_named_beside_the_hull(tmp_path: Path, thruster: str) -> None:
    """All thrusters weak by one factor and such a hull are the same motion: parsimony alone chose the thrusters."""
    factors = dict.fromkeys((*MASSES, *damping(VESSELS["ferry"])), SCALE)
    case = Case(
        "weak",
        "thruster_gain",
        "single",
        "ferry",
        "calibration",
        "mcap",
        7,
        conditions={"gain": {thruster: 0.75}},
        hull_factors=factors,
    )
    made = generate(case, tmp_path / "log")
    profile = load_profile(str(made.profile))
    seen = windows(read_measurements(str(made.log), profile)[0], *window_lengths(profile))
    problem = estimation_problem(seen, *prior_force_model(seen.measurements, profile))
    assert note_on_light_hull(profile)
    known = [Candidate.of(effects()["hull_parameters"], None, profile)]
    known += [Candidate.of(effects()["thruster_gain"], one.name, profile) for one in profile.actuators]
    found = search(problem, no_progress, known=known)
    kept = eliminate_backward(found.problem, found.fit, known, no_progress).fit
    assert kept.keys == {("hull_parameters", None), ("thruster_gain", thruster)}
    values = dict(zip([one.effect.id for one in kept.candidates], kept.values, strict=True))
    assert values["thruster_gain"][0] == pytest.approx(0.75, abs=0.03)


def test_a_guessed_inertia_that_is_too_large_hides_no_wind(tmp_path: Path) -> None:
    """The model is right and the rigid body's inertia is not: no coefficient is wanting, and what acts is found without."""
    blown = f"{CALM}[environment.wind]\nnorth_mps = -3.0\neast_mps = 2.0\n"
    log = tmp_path / "blown.mcap"
    write_log(simulate(parse_scenario(blown, "blown"), 3), log)
    guessed = replace(FERRY, hull=replace(FERRY.hull, inertia_z=1.5 * FERRY.hull.inertia_z))
    problem = trial_on(read_measurements(str(log), guessed)[0])
    known = [Candidate.of(effects()[name], None, guessed) for name in ("hull_parameters", "wind")]
    assert needed(problem, known[0])
    assert search(problem, no_progress, known=known).fit.keys == {("wind", None)}


def test_what_no_hull_has_is_less_than_its_rigid_body(tmp_path: Path) -> None:
    """Less on one axis alone; a spread that the profile calls unknown is no hull model to correct."""
    problem = trial_on(sailed(tmp_path, "calm", CALM, 1))
    coefficients = Candidate.of(effects()["hull_parameters"], None, FERRY)
    assert note_on_light_hull(FERRY) == ()
    assert not needed(problem, coefficients)
    for place, mass in enumerate((FERRY.hull.mass_kg, FERRY.hull.mass_kg, None, None, FERRY.hull.inertia_z)):
        if mass is not None:
            hull = problem.plain.hull.copy()
            hull[place] = 0.7 * mass
            light = replace(problem, plain=replace(problem.plain, hull=hull))
            assert needed(light, coefficients)
            assert not needed(light, Candidate.of(effects()["payload"], None, FERRY))
            hull[place] = 20.0 * mass
            assert not needed(replace(problem, plain=replace(problem.plain, hull=hull)), coefficients)


def test_a_campaign_says_that_the_profile_is_too_light() -> None:
    hull = FERRY.hull
    light = replace(FERRY, hull=replace(hull, M=hull.M * np.diag([0.3, 1.0, 1.0])))
    share = 0.3 * hull.M[0, 0] / hull.mass_kg
    assert f"less than its rigid body's ({share:.2g} in surge), as no hull's is" in note_on_light_hull(light)[0]
    assert note_on_light_hull(replace(light, hull=replace(light.hull, spread=np.inf))) == ()
    # The model may be right, and what it is compared with too large.
    (guessed,) = note_on_light_hull(replace(FERRY, hull=replace(hull, inertia_z=1.5 * hull.inertia_z)))
    assert "in yaw" in guessed
    assert "or mass_kg, inertia_z or k_zz_m where that is too large" in guessed
