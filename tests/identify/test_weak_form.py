"""The weak form as an estimator: its identities by hand, what noise does to it, and the physics that bounds it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from ferryid.effects.force_model import COEFFICIENTS
from ferryid.effects.hull_spread import default_hull_spread
from ferryid.errors import FerryIdError
from ferryid.identify import estimators, inputs
from ferryid.identify import feasible as feasible_module
from ferryid.identify.contradictions import signs_of, wrong_size, wrong_way
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.feasible import Feasible, _nearest, feasible_gains
from ferryid.identify.inertia import checks as inertia_checks_module
from ferryid.identify.inertia.shares import relative_inertia, without_inertia
from ferryid.identify.motion_data import compute_residuals
from ferryid.identify.physical_checks import physical_checks
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import Split
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_data import WeakData, _decorrelate, weak_data
from ferryid.identify.weak_rows import average_over_windows, to_force
from ferryid.models.forces import ACCELERATIONS, effective_mass, motion_force
from ferryid.regression import window_weights
from ferryid.regression.bases import make_basis
from ferryid.regression.cross_validation.folds import Curves
from ferryid.signals.prepare import Opened, open_track
from ferryid.signals.smooth import smooth_measured
from ferryid.signals.track import Motion
from ferryid.types import RunContext, no_progress
from ferryid.vessel import load_profile
from ferryid.vessel.order_response import orders_alone
from ferryid.vessel.profile import Profile
from tests.identify.rounds import PROFILE, RATE_HZ, motion
from tests.identify.trials import measured

Floats = NDArray[np.float64]

BASIS = make_basis("modulus", structure="decoupled")
K = len(BASIS.terms)
SCALE = {"delta": 1.0, "sigma": 1.0, "zeta": 1.0}
FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"


def placed(seed: int, seconds: float = 120.0) -> Motion:
    """Return a motion with the position that its velocities lead to."""
    made = motion(seed, seconds=seconds)
    c, s = np.cos(made.eta[:, 2]), np.sin(made.eta[:, 2])
    rate = np.column_stack([c * made.nu[:, 0] - s * made.nu[:, 1], s * made.nu[:, 0] + c * made.nu[:, 1]])
    # Simpson's rule would be better; the steps are short against the motion.
    path = np.concatenate([np.zeros((1, 2)), np.cumsum((rate[1:] + rate[:-1]) / 2.0 / RATE_HZ, axis=0)])
    return replace(made, eta=np.column_stack([np.add(path, [500.0, -300.0]), made.eta[:, 2]]))


def windows(made: Motion, length_s: float = 8.0) -> Any:
    return average_over_windows(made, np.ones(len(made.t), dtype=bool), PROFILE, SCALE, BASIS, length_s)


def test_weights_move_derivatives_of_polynomials_by_hand() -> None:
    weight, slope, bend = window_weights(400, 0.02)
    t = (np.arange(400) + 0.5) * 0.02 - 4.0
    assert weight.sum() * 0.02 == pytest.approx(1.0)
    # The means of the derivatives of 1, 3 t and t^2, and the second of t^2 and t^3.
    assert -(slope @ np.ones(400)) * 0.02 == pytest.approx(0.0, abs=1e-12)
    assert -(slope @ (3.0 * t)) * 0.02 == pytest.approx(3.0, rel=1e-6)
    assert (bend @ t**2) * 0.02 == pytest.approx(2.0, rel=1e-5)
    assert (bend @ t**3) * 0.02 == pytest.approx(0.0, abs=1e-9)


def test_velocities_and_poses_give_the_mean_of_the_true_acceleration() -> None:
    made = placed(3)
    rows = windows(made)
    m = round(8.0 * RATE_HZ)
    weight = window_weights(m, 1.0 / RATE_HZ)[0] / RATE_HZ
    true = np.array([weight @ made.nu_dot[start : start + m] for start in rows.start])
    size = true.std(axis=0)
    np.testing.assert_allclose(rows.by_velocity / size, true / size, atol=2e-3)
    np.testing.assert_allclose(rows.by_pose / size, true / size, atol=2e-2)
    # A made position is far from the origin, and turning it about the origin must not matter.
    moved = windows(replace(made, eta=np.add(made.eta, [1e5, -2e5, 0.0])))
    np.testing.assert_allclose(moved.by_pose, rows.by_pose, atol=1e-6)


def test_windows_stay_within_the_rows_that_are_asked_for() -> None:
    made = placed(4)
    wanted = np.ones(len(made.t), dtype=bool)
    wanted[300:305] = wanted[700:] = False
    rows = average_over_windows(made, wanted, PROFILE, SCALE, BASIS, 8.0)
    covered = [wanted[start : start + 80].all() for start in rows.start]
    assert len(rows)
    assert all(covered)
    assert sorted(set(rows.run.tolist())) == [0, 1]
    none = average_over_windows(made, np.zeros_like(wanted), PROFILE, SCALE, BASIS, 8.0)
    assert len(none) == 0


def test_an_exact_law_comes_back_from_the_weak_form() -> None:
    rng = np.random.default_rng(0)
    mass0 = np.array([[1000.0, 0.0, 0.0], [0.0, 1200.0, 30.0], [0.0, 30.0, 2000.0]])
    mass = mass0 + np.array([[150.0, 0.0, 0.0], [0.0, 700.0, 80.0], [0.0, 60.0, 900.0]])
    theta = np.where(BASIS.mask, 50.0 * rng.standard_normal((K, 3)), 0.0)
    for column, name in enumerate(ACCELERATIONS):
        theta[BASIS.terms.index(name)] = (mass - mass0)[:, column]
    intercept = np.array([3.0, -4.0, 2.0])
    acceleration, functions = rng.standard_normal((200, 3)), rng.standard_normal((200, K))
    for column, name in enumerate(ACCELERATIONS):
        functions[:, BASIS.terms.index(name)] = acceleration[:, column]
    effective = acceleration @ mass0.T + functions @ theta + intercept
    regressors = functions.copy()
    for column, name in enumerate(ACCELERATIONS):
        regressors[:, BASIS.terms.index(name)] = effective[:, column]
    target = effective - acceleration @ mass0.T
    solved, *_ = np.linalg.lstsq(np.column_stack([regressors, np.ones(200)]), target, rcond=None)
    found, constant = to_force(solved[:-1], solved[-1], BASIS.terms, mass0)
    np.testing.assert_allclose(found, theta, atol=1e-6)
    np.testing.assert_allclose(constant, intercept, atol=1e-6)
    # Several at once, as the draws of a bootstrap are.
    both, constants = to_force(np.stack([solved[:-1]] * 2), np.stack([solved[-1]] * 2), BASIS.terms, mass0)
    np.testing.assert_allclose(both[1], found)
    np.testing.assert_allclose(constants[1], constant)


def data_of(logs: list[Any], profile: Profile = PROFILE, **settings: Any) -> WeakData:
    """Return logs of which every row trains."""
    chosen = FitSettings(**settings)
    motions = [replace(smooth_measured(one, 1.0), log=f"{one.log} {number}") for number, one in enumerate(logs)]
    plain = compute_residuals(profile, chosen, [SimpleNamespace(motion=each, quality={}) for each in motions])  # type: ignore[misc]
    masks = tuple(each.valid for each in plain.motions)
    return weak_data(replace(plain, split=Split("none", masks, tuple(np.zeros_like(mask) for mask in masks), 0.0)))


def inertia_errors(data: Any) -> Floats:
    estimate = estimate_correction(data, K, 0, no_progress)
    mass = effective_mass(PROFILE, data.settings.scale, BASIS.terms, estimate.coefficients.theta)
    return np.asarray(np.diag(mass) / np.diag(PROFILE.hull.M) - 1.0)


def test_noise_in_the_velocity_biases_the_derivative_and_not_the_weak_form() -> None:
    logs = [measured(seed, seconds=400.0, jitter=0.15) for seed in range(3)]
    weak = data_of(logs, delta=0.8, sigma=0.8, inertia="fitted")
    derivative = compute_residuals(PROFILE, weak.settings, weak.prepared)
    derivative = replace(derivative, split=weak.split)
    assert np.abs(inertia_errors(derivative)).max() > 0.3
    assert np.abs(inertia_errors(weak)).max() < 0.06


def test_without_noise_the_hull_comes_back() -> None:
    weak = data_of([measured(seed, seconds=400.0) for seed in range(3)], delta=0.6, sigma=0.6)
    estimate = estimate_correction(weak, K, 60, no_progress)
    theta = estimate.coefficients.theta
    mass = effective_mass(PROFILE, weak.settings.scale, BASIS.terms, theta)
    # The truth of this hull is not symmetric, the estimate is: the cross terms are small beside the others.
    np.testing.assert_allclose(np.diag(mass), np.diag(PROFILE.hull.M), rtol=0.02)
    assert mass[1, 2] == pytest.approx(mass[2, 1], rel=1e-6)
    width = estimate.coefficients.high - estimate.coefficients.low
    assert np.all(width[BASIS.mask] >= 0.0)


def test_an_inertia_at_its_bound_comes_with_what_the_windows_say_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    data = data_of([measured(seed, seconds=400.0) for seed in range(3)])
    truth = PROFILE.hull.M[2, 2]
    np.testing.assert_allclose(data.inertia_spans[2], truth, rtol=0.05)
    # A bound below the truth, which the windows without noise know well.
    lower = replace(IDENTIFY, most_inertia=0.8 * float(relative_inertia(PROFILE, PROFILE.hull.M)[2]))
    monkeypatch.setattr(feasible_module, "IDENTIFY", lower)
    monkeypatch.setattr(inertia_checks_module, "IDENTIFY", lower)
    estimate = estimate_correction(data, K, 0, no_progress)
    checks = physical_checks(data, data.combined(estimate.coefficients))
    (check,) = (one for one in checks if one.name == "inertia_yaw")
    assert check.passed is False
    assert "the truth lies between" in check.reason


def test_a_steady_force_in_one_log_does_not_end_up_in_the_hull() -> None:
    def breeze(made: Motion) -> Floats:
        psi = made.eta[:, 2]
        return np.column_stack([-200.0 * np.cos(psi), 200.0 * np.sin(psi), np.zeros(len(psi))])

    logs = [measured(seed, seconds=400.0, jitter=0.02, force=breeze if seed == 0 else None) for seed in range(3)]
    data = data_of(logs, delta=0.8, sigma=0.8)
    assert data.whitening.condition > 0.5
    unaware = replace(data)
    unaware.__dict__["whitening"] = replace(data.whitening, condition=0.0)
    assert np.abs(inertia_errors(data)).max() < 0.05
    truth = np.abs(inertia_errors(unaware))
    assert np.linalg.norm(inertia_errors(data)) < np.linalg.norm(truth)


def test_whitened_rows_are_independent_by_hand() -> None:
    rng = np.random.default_rng(1)
    run = np.repeat([0, 1], [6, 4])
    conditions, phi = rng.standard_normal((10, 3)), 0.6
    lag = np.abs(np.subtract.outer(np.arange(10), np.arange(10)))
    covariance = np.where(np.equal.outer(run, run), phi**lag, 0.0) + conditions @ conditions.T
    transform = _decorrelate(np.eye(10), conditions, run, phi)
    np.testing.assert_allclose(transform @ covariance @ transform.T, np.eye(10), atol=1e-9)


def feasible(gains: Floats, nu: Floats | None = None) -> Feasible:
    visited = np.random.default_rng(2).standard_normal((500, 3)) * [0.5, 0.2, 0.1] if nu is None else nu
    return feasible_gains(PROFILE, SCALE, BASIS, BASIS.mask, gains, np.array([1e4 * np.eye(K)] * 3), visited)


def law(gains: Floats) -> tuple[Floats, Floats]:
    """Return mass matrix, and coefficients of the force."""
    theta, _ = to_force(gains, np.zeros(3), BASIS.terms, PROFILE.hull.M)
    return effective_mass(PROFILE, SCALE, BASIS.terms, theta), theta


def test_possible_gains_stay_as_they_are_but_for_symmetry() -> None:
    found = feasible(np.zeros((K, 3)))
    mass, _ = law(found.gains)
    np.testing.assert_allclose(mass, mass.T, rtol=1e-6)
    np.testing.assert_allclose(np.diag(mass), np.diag(PROFILE.hull.M), rtol=0.05)
    assert found.notes == ()


@pytest.mark.parametrize(("axis", "column"), [(0, "u_dot"), (1, "v_dot"), (2, "r_dot")])
@pytest.mark.parametrize("gain", [-9.0, 0.95, 1.5])
def test_inertia_is_brought_to_where_a_hull_can_be(axis: int, column: str, gain: float) -> None:
    gains = np.zeros((K, 3))
    gains[BASIS.terms.index(column), axis] = gain  # 1 - M0 / M: no inertia, a twentieth, a negative one
    found = feasible(gains)
    mass, _ = law(found.gains)
    np.testing.assert_allclose(mass, mass.T, rtol=1e-5)
    assert np.all(np.linalg.eigvalsh(mass) > 0.0)
    assert any("inertia" in note for note in found.notes)


def test_damping_that_feeds_the_motion_is_brought_to_none() -> None:
    gains = np.zeros((K, 3))
    base = PROFILE.hull.D
    gains[BASIS.terms.index("u"), 0] = 4.0 * base["X_u"]
    gains[BASIS.terms.index("r"), 2] = 6.0 * base["N_r"]
    found = feasible(gains)
    _, theta = law(found.gains)
    for nu in (
        [0.4, 0.0, 0.0],
        [0.05, 0.0, 0.0],
        [0.0, 0.0, 0.1],
        [0.0, 0.2, -0.1],
        [0.0, 0.1, 0.1],
        [5.0, 0.0, 0.0],
        [0.0, 0.0, 2.0],
    ):
        point, still = np.array([nu]), np.zeros((1, 3))
        force = motion_force(PROFILE, SCALE, still, point, np.zeros(1))[0] + (BASIS.evaluate(point, still) @ theta)[0]
        assert float(force @ point[0]) >= -1e-6
    assert any("damping" in note for note in found.notes)
    # Draws scatter about the estimate, and the bound that it meets does not take their scatter.
    drawn = np.stack([gains, gains, gains])
    place = BASIS.terms.index("u"), 0
    drawn[1:, *place] += [3.0, -3.0]
    moved = found.moved(drawn)
    np.testing.assert_allclose(moved[0], found.gains, atol=1e-6)
    np.testing.assert_allclose(moved[1:, *place] - moved[0, *place], [3.0, -3.0], rtol=1e-6)
    for one in moved:
        np.testing.assert_allclose(law(one)[0], law(one)[0].T, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_damping_dissipates_far_beyond_the_velocities_visited(sign: float) -> None:
    """A cube of the wrong sign does no harm at the velocities of a log, and a free run that leaves them diverges."""
    gains = np.zeros((K, 3))
    gains[BASIS.terms.index("r^3"), 2] = sign * PROFILE.hull.D["N_|r|r"]
    _, theta = law(feasible(gains).gains)
    for yaw_rate in (0.1, 0.3, 1.0, 3.0):
        point, still = np.array([[0.0, 0.0, yaw_rate]]), np.zeros((1, 3))
        force = motion_force(PROFILE, SCALE, still, point, np.zeros(1))[0] + (BASIS.evaluate(point, still) @ theta)[0]
        assert float(force @ point[0]) >= 0.0


def test_the_nearest_point_is_that_of_another_solver() -> None:
    rng = np.random.default_rng(5)
    root = rng.standard_normal((6, 6))
    cost, wanted = root @ root.T + np.eye(6), rng.standard_normal(6)
    normal, level = rng.standard_normal((4, 6)), rng.uniform(0.0, 1.0, 4)
    found, active = _nearest(cost, wanted, normal, level)
    other = minimize(
        lambda b: 0.5 * (b - wanted) @ cost @ (b - wanted),
        np.zeros(6),
        jac=lambda b: cost @ (b - wanted),
        constraints=[{"type": "ineq", "fun": lambda b: normal @ b - level, "jac": lambda b: normal}],
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    np.testing.assert_allclose(found, other.x, atol=1e-5)
    assert len(active)
    np.testing.assert_allclose((normal @ found - level)[active], 0.0, atol=1e-7)


def test_most_components_that_are_not_worse_than_the_best_by_hand() -> None:
    def curves(by_fold: list[list[float]]) -> Curves:
        errors = np.repeat(np.array(by_fold)[None, :, :, None], 3, axis=3)
        return Curves(errors.mean(axis=1), errors.std(axis=1), np.ones(3), len(by_fold), 100, errors)

    # The fourth is worse by 0.1 in each fold, beyond chance however the folds differ from each other.
    assert curves([[5.0, 1.0, 1.0, 1.1], [9.0, 3.0, 3.0, 3.1], [7.0, 2.0, 2.0, 2.1]]).most_supported() == 3
    # Here its differences are +0.3, -0.1 and -0.1: by chance.
    assert curves([[5.0, 1.0, 1.0, 1.3], [9.0, 3.0, 3.0, 2.9], [7.0, 2.0, 2.0, 1.9]]).most_supported() == 4


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Opened:
    return open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path_factory.mktemp("out"))


@pytest.mark.slow
def test_a_log_too_short_for_windows_falls_back_and_is_told(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> None:
    monkeypatch.setattr(inputs, "open_track", lambda *_, **__: opened)
    settings = FitSettings(delta=0.4, sigma=0.4, draws=20, weak_window_s=30.0)
    result = fit_logs(["short.mcap"], PROFILE, settings, RunContext(Path("nowhere")))
    assert result.model.settings["estimator"] == "derivative"
    assert not result.estimators
    assert any("weak form needs" in warning for warning in result.warnings)
    with pytest.raises(FerryIdError, match=r"weak form needs .* found \d+\. Fix: .*--estimator derivative"):
        fit_logs(["short.mcap"], PROFILE, replace(settings, estimator="weak"), RunContext(Path("nowhere")))


@pytest.mark.slow
def test_the_better_estimator_is_chosen_and_both_are_shown(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> None:
    monkeypatch.setattr(inputs, "open_track", lambda *_, **__: opened)
    settings = FitSettings(delta=0.4, sigma=0.4, draws=20, weak_window_s=4.0)
    result = fit_logs(["short.mcap"], PROFILE, settings, RunContext(Path("nowhere")))
    by_name = {one.name: one for one in result.estimators}
    assert set(by_name) == {"weak", "derivative"}
    chosen = min(by_name.values(), key=lambda one: one.folds)
    assert chosen.chosen
    assert result.model.settings["estimator"] == chosen.name
    assert sum(one.chosen for one in by_name.values()) == 1
    # Its held-out stretches are shorter than a window of the usual length, in which models are judged.
    assert result.scores.measure == "force"


def test_models_are_judged_in_windows_of_the_usual_length_whatever_they_are_trained_with() -> None:
    logs = [measured(1, seconds=300.0)]
    usual, longer = data_of(logs).windows, data_of(logs, weak_window_s=16.0).windows
    assert usual.length_s == longer.length_s == pytest.approx(8.0, abs=0.5)
    assert (usual.training_length_s, longer.training_length_s) == (usual.length_s, 16.0)
    assert len(longer.training[0]) < len(usual.training[0])
    assert len(longer.judged[0]) == len(usual.judged[0]) > 50
    np.testing.assert_array_equal(longer.judged[0].force, usual.judged[0].force)


@pytest.mark.parametrize(
    ("errors", "possible", "chosen"),
    [
        ((0.30, 0.25), (True, True), "derivative"),
        # What no hull has gives way to what errs a little more, and not to what errs far more or explains nothing.
        ((0.30, 0.25), (True, False), "weak"),
        ((0.40, 0.25), (True, False), "derivative"),
        ((0.08, 0.49), (False, True), "weak"),
        ((1.02, 0.95), (True, False), "derivative"),
        ((0.30, 0.25), (False, False), "derivative"),
        ((0.25, float("inf")), (False, True), "weak"),
    ],
)
def test_an_estimator_that_physics_rejects_gives_way_to_one_that_errs_little_more(
    errors: tuple[float, float], possible: tuple[bool, bool], chosen: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = dict(zip(("weak", "derivative"), zip(errors, possible, strict=True), strict=True))

    def of(name: str) -> Any:
        judged = SimpleNamespace(mse_base=np.ones(3), mse_model=np.ones(3))
        windows = SimpleNamespace(errors=lambda found: judged)
        return SimpleNamespace(name=name, windows=windows, combined=lambda found: found)

    checks = {True: (), False: (SimpleNamespace(passed=None), SimpleNamespace(passed=False))}
    monkeypatch.setattr(estimators, "fold_error", lambda data, components: told[data.name][0])
    monkeypatch.setattr(estimators, "estimate_correction", lambda *given: SimpleNamespace(coefficients=None))
    monkeypatch.setattr(estimators, "physical_checks", lambda data, found: checks[told[data.name][1]])
    data, scores = estimators.choose_estimator(of("derivative"), of("weak"), {"weak": 3, "derivative": 4})
    assert data.name == chosen
    assert {one.name: (one.folds, one.possible) for one in scores} == told
    assert [one.name for one in scores if one.chosen] == [chosen]


def test_the_prior_of_an_inertia_is_that_of_its_own_axis() -> None:
    """Sway and yaw share their functions, and coupling is held far more tightly than the inertia: it was its prior as well."""
    data = data_of([measured(1, jitter=0.02)], delta=0.4, sigma=0.4)
    sigma = np.array([5.0, 6.0, 7.0])
    Sxx = data._prior(sigma).centred()[0]
    for axis, name in enumerate(ACCELERATIONS):
        place = data.functions.terms.index(name)
        assert Sxx[place, place] == pytest.approx((sigma[axis] / data.prior_spread[place, axis]) ** 2)


@pytest.mark.slow
@pytest.mark.parametrize("delta", [0.4, 1.4])
def test_a_base_model_that_is_far_off_does_not_pull_the_inertia(delta: float) -> None:
    ratios = []
    for seed in range(6):
        data = data_of([measured(seed, seconds=600.0, jitter=0.02, noise=60.0)], delta=delta, sigma=delta)
        found = data.combined(estimate_correction(data, data.components(), 1, no_progress).coefficients)
        mass = effective_mass(PROFILE, data.settings.scale, data.functions.terms, found.theta)
        ratios.append(np.diag(mass) / np.diag(PROFILE.hull.M))
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=0.02)


def test_one_actuator_is_not_exchanged_for_another() -> None:
    spread = np.full(3, 0.01)
    said = wrong_way(np.array([0.9, 0.8, -0.7]), spread, "the profile boat", ["stern.rudder"], 1)
    assert "exchange" not in said
    assert "an angle has the wrong sign, or heading and yaw rate count anticlockwise. Fix: in the profile boat" in said
    assert 'turn the sign in [signals."stern.rudder"], or set the frames of heading and yaw rate' in said
    several = wrong_way(np.array([0.9, 0.8, -0.7]), spread, "the profile boat", ["a.angle", "b.angle"], 2)
    assert "actuators are exchanged (port and starboard, bow and stern), or an angle has the wrong sign" in several
    assert 'turn the sign in [signals."a.angle"] or [signals."b.angle"]' in several


def test_the_weak_form_explains_the_measured_force_alone() -> None:
    weak = data_of([measured(1)], residual="commanded")
    assert "commanded" in weak.impossible
    with pytest.raises(FerryIdError, match="--residual commanded"):
        _ = weak.training_windows


@pytest.mark.parametrize(
    ("signs", "cause"),
    [
        ((1.0, 1.0, -1.0), r"actuators are exchanged \(port and starboard"),
        ((1.0, -1.0, -1.0), "y axes that point to opposite sides"),
        ((-1.0, 1.0, 1.0), "the thrust or the surge velocity has the wrong sign"),
    ],
)
def test_forces_that_act_the_wrong_way_are_refused_with_their_cause(
    signs: tuple[float, float, float], cause: str
) -> None:
    logs = [measured(seed, seconds=300.0, jitter=0.03) for seed in range(2)]
    data_of(logs).refuse_contradictions()
    turned = [replace(one, tau=one.tau * signs) for one in logs]
    with pytest.raises(
        FerryIdError,
        match=rf"accelerates the vessel in .* times what the base model expects.*{cause}.* Fix: in the profile",
    ):
        data_of(turned).refuse_contradictions()


def test_an_angle_of_the_wrong_sign_is_named_where_sway_and_yaw_are_reversed() -> None:
    spread = np.array([0.02, 0.1, 0.04])
    both, sway = np.array([0.9, -0.48, -0.8]), np.array([0.9, -0.48, 0.8])
    said = wrong_way(both, spread, "the profile boat", ["propeller.rudder"], 1)
    assert (
        "an angle has the wrong sign, or the actuators and the motion have y axes that point to opposite sides" in said
    )
    assert 'Fix: in the profile boat, turn the sign in [signals."propeller.rudder"], or set frame = "FLU"' in said
    for told in (wrong_way(both, spread, "the profile boat"), wrong_way(sway, spread, "boat", ["propeller.rudder"], 1)):
        assert "turn the sign" not in told
        assert "opposite sides" in told


def test_an_ordered_angle_counts_where_none_was_measured() -> None:
    def angles(*quantities: str) -> list[str]:
        signals = tuple(SimpleNamespace(quantity=one) for one in quantities)
        return signs_of(cast(Profile, SimpleNamespace(signals=signals, actuators=(SimpleNamespace(name="stern"),))))[0]

    assert angles("stern.speed", "stern.rudder.command") == ["stern.rudder.command"]
    assert angles("stern.angle.command", "stern.angle") == ["stern.angle"]


def test_forces_that_are_hardly_followed_are_not_taken_for_reversed_ones() -> None:
    spread = np.array([0.007, 0.02, 0.009])
    said = wrong_way(np.array([0.008, -0.047, -0.016]), spread, "the profile boat")
    assert "the motion hardly follows the applied force at all" in said
    assert "which signal drives which actuator, position_m and angle_deg" in said
    assert "opposite sides" not in said
    assert "exchanged" not in said
    alone = wrong_way(np.array([np.nan, np.nan, -0.05]), spread, "the profile boat")
    assert "or exchanged actuators or a heading that counts anticlockwise, with a moment that is several times" in alone
    assert "and the unit of their signals, and the frames of heading and yaw rate" in alone
    assert "opposite sides" in wrong_way(np.array([0.9, -0.3, 0.8]), spread, "the profile boat")
    assert wrong_way(np.array([0.008, -0.03, 0.5]), spread, "the profile boat") == ""


def test_orders_that_are_followed_late_may_be_why_forces_are_hardly_followed() -> None:
    """A boat that answers its orders within a second was refused for a wrong unit of its thrust."""
    response, spread, share = np.array([0.09, np.nan, 0.16]), np.full(3, 0.01), np.ones(3)
    said = wrong_size(response, spread, share, "boat", orders=True)
    assert "the actuators were not engaged or follow their orders late, or the profile's mass is too small" in said
    assert "map the actuators' feedback in place of their orders" in said
    assert "late" not in wrong_size(response, spread, share, "boat")
    assert "late" not in wrong_size(3.0 / IDENTIFY.least_inertia * share, spread, share, "boat", orders=True)
    assert [orders_alone(load_profile(name)) for name in ("gunnerus", "milliampere", "vtec-usv")] == [True, False, True]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("factor", "cause"), [(9.55**2, "several times too large"), (1.0 / 9.81, "several times too small")]
)
def test_forces_in_a_wrong_unit_are_refused(factor: float, cause: str) -> None:
    logs = [measured(seed, seconds=300.0, jitter=0.03) for seed in range(2)]
    with pytest.raises(FerryIdError, match=rf"{cause}.* Fix: in the profile .*rpm"):
        data_of([replace(one, tau=one.tau * factor) for one in logs]).refuse_contradictions()
    # One axis alone has a wrong coefficient, not a wrong unit.
    data_of([replace(one, tau=one.tau * (1.0, 1.0, factor)) for one in logs]).refuse_contradictions()


def test_what_only_the_prior_determines_has_its_spread() -> None:
    # The vessel goes straight ahead, so that nothing is learnt of damping in yaw.
    def straight(one: Any) -> Any:
        keep = np.array([1.0, 0.0, 0.0])
        return replace(one, nu=one.nu * keep, tau=one.tau * keep)

    data = data_of([straight(measured(seed, seconds=300.0, jitter=0.02)) for seed in range(2)])
    drawn = data.scattered(np.zeros((4000, K, 3)), data.functions.mask)
    r = BASIS.terms.index("r")
    assert drawn[:, r, 2].std() == pytest.approx(data.prior_factor * data.prior_spread[r, 2], rel=0.1)
    # In surge the data leave less of it.
    u = BASIS.terms.index("u_dot")
    assert drawn[:, u, 0].std() < 0.2 * data.prior_spread[u, 0]
    # An inertia that is held has none, nor has what goes with it on its axis.
    held = without_inertia(data.functions.mask, BASIS.terms, np.array([False, True, False]))
    drawn = data.scattered(np.zeros((4, K, 3)), held)
    assert not drawn[:, [BASIS.terms.index(name) for name in ("v_dot", "r_dot")], 1].any()
    assert drawn[:, BASIS.terms.index("v"), 1].all()


@pytest.mark.parametrize("spread", [0.05, 0.8])
def test_the_prior_has_the_spread_that_the_profile_states(spread: float) -> None:
    logs = [measured(seed, seconds=300.0, jitter=0.02) for seed in range(2)]
    stated = replace(PROFILE, hull=replace(PROFILE.hull, spread=spread))
    usual, data = data_of(logs), data_of(logs, profile=stated)
    u, uu = BASIS.terms.index("u_dot"), BASIS.terms.index("|u|u")
    assert data.prior_spread[u, 0] == pytest.approx(spread)
    less = data.prior_spread[uu, 0] - usual.prior_spread[uu, 0]
    assert less == pytest.approx((spread - IDENTIFY.hull_spread) * abs(PROFILE.hull.D["X_|u|u"]))


def test_a_hull_of_unknown_spread_may_be_any_that_a_vessel_of_its_size_has() -> None:
    logs = [measured(seed, seconds=300.0, jitter=0.02) for seed in range(2)]
    data = data_of(logs, profile=replace(PROFILE, hull=replace(PROFILE.hull, spread=np.inf)))
    u, uu = BASIS.terms.index("u_dot"), BASIS.terms.index("|u|u")
    assert data.prior_spread[u, 0] == pytest.approx(IDENTIFY.unknown_mass_spread)
    most = default_hull_spread(PROFILE, data.training_velocities)[COEFFICIENTS.index("X_|u|u")]
    assert data.prior_spread[uu, 0] == pytest.approx(most)
    assert data.ties == ()
    assert data_of(logs).ties
