"""What sets in within a log is known beside a hull that nobody knew; what acts all along, or hardly, is not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, estimation_problem, fit
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.onset_evidence import regime_of_span, sets_in
from ferryid.effects import effects
from ferryid.effects.actuator_force import speed_along
from ferryid.effects.force_model import COEFFICIENTS
from ferryid.effects.hull_spread import default_hull_spread
from ferryid.types import Floats
from tests.diagnose.trials import FERRY, sailed
from tests.effects.test_actuator_force import turning, vessel

SCENARIO = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
path = {{ kind = "twelve-corner" }}
controller = {{ delta = 0.7, sigma = 0.7 }}
sensors = {{ imu_rate_hz = 0.0, camera_rate_hz = 0.0 }}
{wrong}
"""
FAULT = '[thrusters]\nfaults = [{{ thruster = "thruster2", factor = {factor}, from_s = {onset} }}]\n'
BEGAN_S = 400.0
GAIN = Candidate.of(effects()["thruster_gain"], "thruster2", FERRY)


def of_unknown_hull(folder: Path, name: str, wrong: str) -> EstimationProblem:
    """Return a trial in which something is wrong, for one who knows no hull but its mass."""
    seen = windows(sailed(folder, name, SCENARIO.format(wrong=wrong), 5), *window_lengths(FERRY))
    hull, rigid = FERRY.hull, np.zeros(len(COEFFICIENTS))
    rigid[:5] = hull.mass_kg, hull.mass_kg, hull.mass_kg * hull.x_g_m, hull.mass_kg * hull.x_g_m, hull.inertia_z
    plain = replace(prior_force_model(seen.measurements, FERRY)[0], hull=rigid)
    return estimation_problem(seen, plain, default_hull_spread(FERRY, seen.measurements.nu))


def weak(folder: Path, factor: float, onset_s: float) -> EstimationProblem:
    """Return a trial with a weak thruster."""
    return of_unknown_hull(folder, f"weak-{factor}-{onset_s:g}", FAULT.format(factor=factor, onset=onset_s))


@pytest.mark.slow
def test_a_loss_that_sets_in_is_known_beside_an_unknown_hull(tmp_path: Path) -> None:
    case = weak(tmp_path, 0.6, BEGAN_S)
    made = fit(case, [replace(GAIN, onset_s=BEGAN_S)])
    assert made.values[0][0] == pytest.approx(0.6, abs=0.05)
    assert sets_in(case, made, 0)
    # At another time it is another loss, and what is left of this one asks for a span of its own.
    late = fit(case, [replace(GAIN, onset_s=BEGAN_S + 150.0)])
    assert not sets_in(case, late, 0)


@pytest.mark.slow
def test_a_loss_all_along_or_a_small_one_is_not(tmp_path: Path) -> None:
    case = weak(tmp_path, 0.6, 0.0)
    assert not sets_in(case, fit(case, [GAIN]), 0)
    assert not sets_in(case, fit(case, [replace(GAIN, onset_s=60.0)]), 0)
    # A weakness that lacks the last seconds is one all along.
    last_s = float(case.steps.middle_s[-1])
    assert not sets_in(case, fit(case, [replace(GAIN, offset_s=last_s - 20.0)]), 0)
    small = weak(tmp_path, 0.97, BEGAN_S)
    assert not sets_in(small, fit(small, [replace(GAIN, onset_s=BEGAN_S)]), 0)


@pytest.mark.slow
def test_what_was_before_must_be_seen_for_as_long_as_is_held_out(tmp_path: Path) -> None:
    began_s = 25.0
    case = weak(tmp_path, 0.6, began_s)
    made = fit(case, [replace(GAIN, onset_s=began_s)])
    assert made.values[0][0] == pytest.approx(0.6, abs=0.05)
    assert not sets_in(case, made, 0)


@pytest.mark.slow
def test_a_force_all_along_that_lacks_the_first_minute_does_not_set_in(tmp_path: Path) -> None:
    line = "[environment.mooring]\nstiffness_north_Npm = 10.0\nstiffness_east_Npm = 10.0\n"
    case = of_unknown_hull(tmp_path, "moored", line)
    mooring = Candidate.of(effects()["mooring"], None, FERRY)
    made = fit(case, [replace(mooring, onset_s=60.0)])
    assert made.values[0][:2] == pytest.approx([10.0, 10.0], abs=4.0)
    assert not sets_in(case, made, 0)


def regime(speeds: Floats, ahead_mps: Floats, onset_s: float = 50.0) -> str:
    """Return what is said of the first propeller in 100 s with these speeds [rpm] and velocities ahead [m/s]."""
    measurements = turning(speeds).measurements
    nu = np.column_stack([ahead_mps, np.zeros((len(speeds), 2))])
    gain = Candidate.of(effects()["thruster_gain"], "port", vessel())
    return regime_of_span(replace(measurements, nu=nu, nu_raw=nu), replace(gain, onset_s=onset_s))


def test_a_propeller_that_is_reversed_at_speed_in_the_span_alone_is_in_another_regime() -> None:
    late = 0.1 * np.arange(1000) >= 50.0
    ahead = np.full(1000, 2.0)
    reversed_late = np.where(late, -600.0, 600.0)
    told = "in its span port pushes astern at 2 m/s ahead through the water"
    assert regime(reversed_late, ahead) == told
    # Astern at rest before is not astern at speed; astern at speed before is.
    rows = np.arange(1000)
    assert regime(np.where(rows < 100, -600.0, reversed_late), np.where(rows < 100, 0.0, 2.0)) == told
    assert regime(np.where(rows < 100, -600.0, reversed_late), ahead) == ""
    # Most of the squared force has to be of that regime, and there has to be a span.
    assert regime(np.where(rows < 800, 600.0, -600.0), ahead) == ""
    assert regime(reversed_late, ahead, onset_s=0.0) == ""
    # No force in the span is none of another regime.
    assert regime(np.where(late, 0.0, 600.0), ahead) == ""


@pytest.mark.parametrize(("before", "after", "new"), [(1.0, 1.9, False), (0.9, 2.0, True), (2.0, 0.0, False)])
def test_a_speed_far_above_any_other_is_another_regime_and_one_that_a_weak_thruster_makes_is_none(
    before: float, after: float, new: bool
) -> None:
    speed = np.where(0.1 * np.arange(1000) >= 50.0, after, before)
    assert (regime(np.full(1000, 600.0), speed) != "") == new


def test_the_speed_of_a_regime_is_that_of_the_actuator_through_the_water() -> None:
    measurements = turning(np.full(2, 600.0)).measurements
    nu = np.array([[1.0, 0.5, 0.0], [0.0, 0.0, 0.1]])
    measurements = replace(measurements, nu=nu, current=np.array([[0.3, 0.2], [0.0, 0.0]]))
    # Port lies 1 m to port, the bow's tunnel 2 m ahead of midship and pushes to starboard.
    assert speed_along(measurements, 0) == pytest.approx([0.7, 0.1])
    assert speed_along(measurements, 2) == pytest.approx([0.3, 0.2])
