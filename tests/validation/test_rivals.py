"""What the rivals choose and name: known answers, and logs in which one knows what is wrong."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.effects.force_model import as_measured
from ferryid.errors import FerryIdError
from ferryid.validation.rivals import RIVALS, sindy, stepwise
from ferryid.validation.rivals.base import Base, base_of, prepared_log
from ferryid.validation.rivals.candidates import Candidate, candidates, distinct_columns
from ferryid.validation.rivals.joint_fit import combined, joint_coefficients, least_error
from ferryid.validation.rivals.regression import left_over, names_of, regression_of
from ferryid.vessel import load_profile
from ferryid.vessel.hull import payload_force
from ferryid.vessel.profile import Profile
from tests.validation.two_logs import WEAK, WIND, two_logs

Floats = NDArray[np.float64]
Choose = Callable[[Floats, Floats, NDArray[np.int64]], Floats]

CHOOSE = pytest.mark.parametrize("choose", [sindy.choose, stepwise.choose], ids=["sindy", "stepwise"])
BLOCK = np.repeat(np.arange(5), 400)


@pytest.fixture(scope="module")
def profile() -> Profile:
    return load_profile("milliampere")


@pytest.fixture(scope="module")
def windy(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    folder = tmp_path_factory.mktemp("windy")
    return two_logs(folder, WIND)[0], folder


@pytest.fixture(scope="module")
def base(windy: tuple[str, Path], profile: Profile) -> Base:
    return base_of(prepared_log(windy[0], profile, windy[1]), profile)


def _named(base: Base, label: str) -> Candidate:
    return next(one for one in candidates(base) if one.label == label)


def _columns(rng: np.random.Generator, k: int = 30) -> Floats:
    """Return columns of mean square 1 that are alike in part, as those of a vessel's motion are."""
    X = rng.normal(size=(len(BLOCK), k)) + 0.8 * rng.normal(size=(len(BLOCK), 1))
    return np.asarray(X / np.sqrt(np.mean(X**2, axis=0)))


@pytest.mark.slow
@CHOOSE
def test_a_sparse_truth_is_found_term_by_term(choose: Choose) -> None:
    rng = np.random.default_rng(3)
    X, truth = _columns(rng), np.zeros(30)
    truth[[4, 11, 20]] = 0.8, -0.5, 0.3
    found = choose(X, X @ truth + 0.2 * rng.normal(size=len(X)), BLOCK)
    assert np.flatnonzero(found).tolist() == [4, 11, 20]
    np.testing.assert_allclose(found, truth, atol=0.02)


@pytest.mark.slow
@CHOOSE
def test_of_noise_next_to_nothing_is_chosen(choose: Choose) -> None:
    rng = np.random.default_rng(4)
    found = choose(_columns(rng), rng.normal(size=len(BLOCK)), BLOCK)
    assert np.count_nonzero(found) <= 1


def test_stepwise_takes_back_what_others_made_needless() -> None:
    rng = np.random.default_rng(5)
    a, b = rng.normal(size=(2, len(BLOCK)))
    # The sum is the best single column, and of no use beside the two that it is the sum of.
    X = np.column_stack([a, b, a + b + 0.3 * rng.normal(size=len(BLOCK))])
    found = stepwise.choose(X, a + b + 0.01 * rng.normal(size=len(BLOCK)), BLOCK)
    assert np.flatnonzero(found).tolist() == [0, 1]


def test_columns_that_are_one_are_kept_once() -> None:
    a, b = np.random.default_rng(6).normal(size=(2, 50))
    assert distinct_columns(np.column_stack([a, np.zeros(50), -2.0 * a, b, a + 1e-4 * b])) == [0, 3]


@pytest.mark.slow
def test_a_mass_aboard_leaves_the_force_that_moves_it(base: Base) -> None:
    """The column is what the load takes at the acceleration that vessel and load then have, by the hull module's formula."""
    term = _named(base, "mass aboard")
    loaded = term.added(base)
    assert loaded.load is not None
    measurements = base.force_model.measurements
    mass = np.column_stack([loaded.load[:, 0], np.zeros(len(measurements.t))])
    expected = payload_force(mass, as_measured(loaded), measurements.nu)
    np.testing.assert_allclose(term.column(base)[base.rows], expected[base.rows], atol=1e-9)
    assert np.sqrt(np.mean(expected[base.rows, 0] ** 2)) > 1.0


def test_a_stronger_thruster_leaves_its_force_and_a_turned_one_that_turned(base: Base) -> None:
    own = base.force_model.parts[:, 0]
    gain = _named(base, "thruster_gain thruster1 factor").column(base)
    np.testing.assert_allclose(gain, -0.2 * own, atol=1e-6)
    turned = _named(base, "azimuth_offset thruster1 angle").column(base)
    expected = np.sin(np.radians(6.0)) * np.column_stack([own[:, 1], -own[:, 0]])
    # Besides the turned force there is what the cosine of 6 degrees takes off.
    np.testing.assert_allclose(turned[:, :2], expected, atol=0.006 * np.abs(own).max())


@pytest.mark.slow
def test_a_term_with_an_onset_is_nothing_before_it(base: Base) -> None:
    later = next(one for one in candidates(base) if one.effect == "thruster_gain" and one.onset_s > 100.0)
    column, t = later.column(base), base.force_model.measurements.t
    assert not column[t < later.onset_s].any()
    first = _named(base, "thruster_gain thruster1 factor").column(base)
    np.testing.assert_allclose(column[t >= later.onset_s], first[t >= later.onset_s], atol=1e-9)


@pytest.mark.slow
def test_the_measured_acceleration_is_in_no_column(base: Base) -> None:
    """Or thrust less mass times acceleration would add up to the residual, whatever the vessel does."""
    motion = base.prepared.motion
    shuffled = replace(motion, nu_dot=np.random.default_rng(1).permutation(motion.nu_dot))
    other = replace(base, prepared=replace(base.prepared, motion=shuffled))
    for one in candidates(base):
        np.testing.assert_array_equal(one.column(base), one.column(other))


def test_what_is_predicted_is_what_was_fitted(base: Base) -> None:
    """The share of the residual that the regression removes is removed from the force in the log as well."""
    task = regression_of(base)
    chosen = [k for k, one in enumerate(task.candidates) if one.label.startswith("load odd")]
    assert len(chosen) == 2
    coefficients = np.linalg.lstsq(task.X[:, chosen], task.y, rcond=None)[0]
    units = [task.candidates[k].added(base) for k in chosen]
    found = base.expected(combined(base, units, coefficients / task.scale[chosen]))
    after = base.prepared.motion.tau - found.tau
    rows = base.rows
    shares = np.mean(after[rows] ** 2, axis=0) / np.mean(base.residual[rows] ** 2, axis=0)
    assert shares.mean() == pytest.approx(left_over(task.X[:, chosen], task.y) / len(task.y), rel=0.02)
    assert shares.mean() < 0.5


@pytest.mark.parametrize(
    "label",
    ["Y_v", "damping of second order in yaw", "damping between", "spring east", "constant in sway", "current north"],
)
def test_of_a_term_the_force_holds_as_much_as_its_coefficient_says(base: Base, label: str) -> None:
    term = next(one for one in candidates(base) if one.label.startswith(label))
    more = base.expected(combined(base, [term.added(base)], np.array([0.4]))).tau - base.prediction.tau
    column = term.column(base)[base.rows]
    assert np.abs(column).max() > 0.1
    np.testing.assert_allclose(more[base.rows], 0.4 * column, atol=1e-6 * np.abs(column).max())


def test_of_a_mass_the_force_holds_what_the_measured_acceleration_takes(base: Base) -> None:
    term, motion = _named(base, "mass aboard"), base.prepared.motion
    added = term.added(base)
    unit = added.load
    assert unit is not None
    more = base.expected(combined(base, [added, added], np.array([0.25, 0.25]))).tau - base.prediction.tau
    expected = payload_force(
        np.column_stack([0.5 * unit[:, 0], np.zeros(len(unit))]), motion.nu_dot, base.force_model.measurements.nu
    )
    np.testing.assert_allclose(more[base.rows], expected[base.rows], atol=1e-9)


def test_a_large_mass_settles_at_its_size(base: Base) -> None:
    """A linear column takes a load of 0.6 of the hull for less: twice the mass is half the acceleration."""
    unit = _named(base, "mass aboard").added(base)
    truth = 4.0
    nu_dot = as_measured(combined(base, [unit], np.array([truth])))
    motion, expected = replace(base.prepared.motion, nu_dot=nu_dot), base.prediction
    more = base.force_between(combined(base, [unit], np.array([truth])))
    # What the base model then expects differs by the force that it would take for the other acceleration.
    loaded = replace(
        base,
        prepared=replace(base.prepared, motion=motion),
        prediction=replace(expected, tau=motion.tau + more),
    )
    rows = np.flatnonzero(base.rows)
    linear = np.linalg.lstsq(-base.force_between(unit)[rows].ravel()[:, None], -more[rows].ravel(), rcond=None)[0]
    assert linear[0] < 0.8 * truth
    found = joint_coefficients(loaded, [unit], linear, rows, np.ones(3))
    np.testing.assert_allclose(found, [truth], rtol=1e-4)


def test_of_two_fits_the_one_with_the_truer_force_is_taken(base: Base) -> None:
    units = [_named(base, "load odd in a wind north").added(base), _named(base, "mass aboard").added(base)]
    # The wind blows south. A vessel four times as heavy errs more, and one without mass is none.
    several = [np.array([-0.7, 20.0]), np.array([-0.7, 0.0]), np.array([-0.7, -50.0]), np.array([0.7, 0.0])]
    assert least_error(base, units, several, np.flatnonzero(base.rows), np.ones(3)) is several[1]


def test_a_start_without_mass_is_gone_only_so_far(base: Base) -> None:
    unit = _named(base, "mass aboard").added(base)
    found = joint_coefficients(base, [unit], np.array([-50.0]), np.flatnonzero(base.rows), np.ones(3))
    hull, load = base.force_model.hull, unit.load
    assert load is not None
    assert hull[0] + found[0] * load[0, 0] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("rival", ["sindy", "stepwise"])
def test_in_a_strong_wind_the_first_name_is_wind(
    windy: tuple[str, Path], profile: Profile, base: Base, rival: str
) -> None:
    learnt = RIVALS[rival](windy[0], profile, windy[1])
    assert learnt.names[0].effect == "wind"
    assert learnt.names[0].removed > 0.1
    assert [one.removed for one in learnt.names] == sorted((one.removed for one in learnt.names), reverse=True)
    assert sum(len(one.terms) for one in learnt.names) == len(learnt.coefficients)
    after = base.prepared.motion.tau - learnt.predict(base.prepared).tau
    assert np.mean(after[base.rows, 1:] ** 2) < 0.2 * np.mean(base.residual[base.rows, 1:] ** 2)


@pytest.mark.slow
def test_of_a_weak_thruster_the_first_name_is_that_thruster(tmp_path: Path, profile: Profile) -> None:
    learnt = stepwise.learn(two_logs(tmp_path, WEAK)[0], profile, tmp_path)
    assert (learnt.names[0].effect, learnt.names[0].instance) == ("thruster_gain", "thruster1")


@pytest.mark.slow
def test_the_thesis_names_nothing_and_fits(windy: tuple[str, Path], profile: Profile, base: Base) -> None:
    learnt = RIVALS["thesis"](windy[0], profile, windy[1])
    assert learnt.names == ()
    assert len(learnt.coefficients) == 3 * 21
    after = base.prepared.motion.tau - learnt.predict(base.prepared).tau
    shares = np.mean(after[base.rows] ** 2, axis=0) / np.mean(base.residual[base.rows] ** 2, axis=0)
    assert shares.mean() < 0.8


def _term(label: str, effect: str) -> Candidate:
    return Candidate(label, effect, None, lambda force_model: force_model)


@pytest.mark.parametrize(("stronger", "named"), [("wind", "wind"), ("mooring", "mooring")])
def test_a_constant_force_goes_to_the_stronger_of_wind_and_mooring(stronger: str, named: str) -> None:
    X = np.random.default_rng(7).normal(size=(500, 4))
    terms = [
        _term("constant force north", "wind"),
        _term("load odd", "wind"),
        _term("spring north", "mooring"),
        _term("X", ""),
    ]
    strength = {"wind": (1.0, 0.8, 0.2, 0.1), "mooring": (1.0, 0.2, 0.8, 0.1)}[stronger]
    names = names_of(X, X @ np.array(strength), terms)
    assert names[0].effect == named
    assert "constant force north" in names[0].terms
    # A term without a meaning goes by its label.
    assert names[-1].effect == "X"


def test_a_constant_force_is_no_wind_that_was_measured() -> None:
    X = np.random.default_rng(8).normal(size=(500, 2))
    terms = [_term("constant force north", "mooring"), _term("load odd", "wind")]
    names = names_of(X, X @ np.array([0.5, 1.0]), terms)
    assert [(one.effect, one.terms) for one in names] == [
        ("wind", ("load odd",)),
        ("mooring", ("constant force north",)),
    ]


def test_a_log_in_which_nothing_is_chosen_leaves_the_base_model(base: Base) -> None:
    found = joint_coefficients(base, [], np.zeros(0), np.flatnonzero(base.rows), np.ones(3))
    assert found.shape == (0,)
    np.testing.assert_allclose(base.expected(combined(base, [], found)).tau, base.prediction.tau, atol=1e-9)


def test_without_pysindy_the_remedy_is_told(
    windy: tuple[str, Path], profile: Profile, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pysindy", None)
    with pytest.raises(FerryIdError, match=r"needs the package pysindy.*Fix: pip install pysindy"):
        sindy.learn(windy[0], profile, windy[1])


def test_a_log_of_a_minute_is_too_short(base: Base) -> None:
    motion = base.prepared.motion
    short = replace(motion, valid=motion.valid & (motion.t < 50.0))
    with pytest.raises(FerryIdError, match=r"too few to choose terms by.*Fix: give a longer log"):
        regression_of(replace(base, prepared=replace(base.prepared, motion=short)))
