"""The whole fit: what it may see, what it must recover, and when it must not believe itself."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.identify import inputs, pipeline
from ferryid.identify.inertia.shares import axes_without_force, implausible_inertia, without_inertia
from ferryid.identify.outcome import FitOutcome
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.models.forces.estimator import effective_mass, model_estimator
from ferryid.signals.artificial import NO_RECORDING
from ferryid.signals.prepare import Opened, open_track
from ferryid.signals.track import Doubt
from ferryid.types import RunContext
from ferryid.vessel import load_profile

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
PROFILE = load_profile("milliampere")
SETTINGS = FitSettings(delta=0.4, sigma=0.4, draws=60, accept="thesis")


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Opened:
    return open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path_factory.mktemp("out"))


def fitted(monkeypatch: pytest.MonkeyPatch, opened: Opened, settings: FitSettings = SETTINGS) -> FitOutcome:
    monkeypatch.setattr(inputs, "open_track", lambda *_, **__: opened)
    return fit_logs(["short.mcap"], PROFILE, settings, RunContext(Path("nowhere")))


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_a_seed_that_is_refused_is_outside_the_range_that_is_told(seed: int) -> None:
    with pytest.raises(FerryIdError, match=rf"^--seed: {seed} is no seed\. Fix: .* from 0 to {2**63 - 1}$"):
        FitSettings(seed=seed)
    assert FitSettings(seed=2**63 - 1).seed == 2**63 - 1


@pytest.mark.parametrize("factor", ["delta", "sigma", "zeta"])
@pytest.mark.parametrize("value", [1e-320, 9e-4, -1.0, 101.0, math.nan])
def test_a_factor_that_is_hardly_there_is_refused(factor: str, value: float) -> None:
    with pytest.raises(FerryIdError, match=rf"^--{factor}: .* is no usable factor\. Fix: give .*0\.001 to 100"):
        FitSettings(**{factor: value})
    assert FitSettings(sigma=0.0, delta=1e-3).scale == {"delta": 1e-3, "sigma": 0.0, "zeta": 1.0}


@pytest.mark.slow
def test_a_fit_that_force_errors_judge_says_so(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> None:
    def told(length_m: float) -> tuple[str, list[str]]:
        profile = replace(PROFILE, hull=replace(PROFILE.hull, length_m=length_m))
        monkeypatch.setattr(inputs, "open_track", lambda *_, **__: opened)
        found = fit_logs(["short.mcap"], profile, SETTINGS, RunContext(Path("nowhere")))
        return found.scores.measure, [one for one in found.warnings if "The verdict is on force errors" in one]

    measure, (said,) = told(320.0)
    assert measure == "force"
    assert said.endswith("Fix: give longer logs.")
    assert told(1.0) == ("prediction", [])


@pytest.mark.slow
def test_recovers_the_true_inertia_from_a_base_at_forty_percent(
    monkeypatch: pytest.MonkeyPatch, opened: Opened
) -> None:
    result = fitted(monkeypatch, opened)
    assert result.acceptance.accepted
    mass = effective_mass(PROFILE, result.model.scale, result.model.terms, result.model.theta)
    # Noise in the derivative pulls inertia down by some per cent; from 40 % it must come most of the way.
    np.testing.assert_allclose(np.diag(mass) / np.diag(PROFILE.hull.M), 1.0, atol=0.25)


@pytest.mark.slow
def test_validation_rows_do_not_reach_the_coefficients(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> None:
    honest = fitted(monkeypatch, opened)
    validation = honest.logs[0].validation
    assert not (validation & honest.logs[0].training).any()
    motion = opened.measured
    poison = np.where(validation[:, None], 5.0 * motion.tau + 100.0, motion.tau)
    poisoned = fitted(monkeypatch, replace(opened, measured=replace(motion, tau=poison)))
    np.testing.assert_array_equal(poisoned.judged.theta, honest.judged.theta)
    assert not poisoned.acceptance.accepted or poisoned.acceptance.normalised_mse != honest.acceptance.normalised_mse


@pytest.mark.slow
def test_warnings_of_the_model_come_before_those_of_single_logs(
    monkeypatch: pytest.MonkeyPatch, opened: Opened
) -> None:
    doubt = Doubt("The yaw rate does not match the heading.", certain=False)
    monkeypatch.setattr(pipeline, "free_run_warnings", lambda *_: ("Run free for 5 s it turns in circles.",))
    result = fitted(monkeypatch, replace(opened, track=replace(opened.track, doubts=(doubt,))))
    of_model, of_log = (
        next(k for k, one in enumerate(result.warnings) if one.endswith(says))
        for says in ("it turns in circles.", doubt.says)
    )
    assert of_model < of_log


@pytest.mark.slow
def test_that_a_log_is_no_recording_comes_before_all(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> None:
    doubt = Doubt(f"It {NO_RECORDING}: it is simulated.", certain=False)
    monkeypatch.setattr(pipeline, "free_run_warnings", lambda *_: ("Run free for 5 s it turns in circles.",))
    result = fitted(monkeypatch, replace(opened, track=replace(opened.track, doubts=(doubt,))))
    assert result.warnings[0].endswith(doubt.says)
    assert len(result.warnings) > 1


@pytest.mark.slow
def test_scores_are_those_of_the_judged_model(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> None:
    result = fitted(monkeypatch, opened)
    log = result.logs[0]
    error = (log.motion.tau - model_estimator(result.judged).of(log.motion))[log.validation]
    scores = result.scores.force
    np.testing.assert_allclose((error**2).mean(axis=0), scores.mse_model, rtol=1e-9)
    # The curve comes from cross-products and never forms an estimate: it must agree at the chosen number.
    curve = result.curve.validation[result.curve.chosen - 1]
    np.testing.assert_allclose(curve, scores.mse_model / scores.mse_base, rtol=1e-6)


@pytest.mark.slow
def test_an_axis_without_force_keeps_its_inertia_and_says_so(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> None:
    motion = opened.measured
    tau = motion.tau * np.array([1.0, 0.0, 1.0])
    result = fitted(monkeypatch, replace(opened, measured=replace(motion, tau=tau)))
    mass = effective_mass(PROFILE, result.model.scale, result.model.terms, result.model.theta)
    np.testing.assert_allclose(mass[1], 0.4 * PROFILE.hull.M[1])
    assert any("No actuator acts in sway" in warning for warning in result.warnings)
    degenerate = fitted(
        monkeypatch, replace(opened, measured=replace(motion, tau=tau)), replace(SETTINGS, inertia="fitted")
    )
    # Left free, the regression finds that no force needs no inertia: a perfect fit and no model.
    lost = effective_mass(PROFILE, SETTINGS.scale, degenerate.model.terms, degenerate.model.theta)
    assert abs(lost[1, 1]) < 0.02 * PROFILE.hull.M[1, 1]


def test_beliefs_about_inertia() -> None:
    rigid = np.diag([1670.0, 1670.0, PROFILE.hull.inertia_z])
    assert not implausible_inertia(PROFILE, rigid).any()
    assert implausible_inertia(PROFILE, rigid * np.array([0.4, 1.0, 1.0])).tolist() == [True, False, False]
    indefinite = rigid.copy()
    indefinite[1, 2] = indefinite[2, 1] = 1e5
    assert implausible_inertia(PROFILE, indefinite).all()
    tau = np.column_stack([np.sin(np.arange(50)), np.zeros(50), np.full(50, 3.0)])
    assert axes_without_force(tau.std(axis=0), np.full(3, 14.4)).tolist() == [False, True, True]


def test_held_axes_lose_their_acceleration_terms_only() -> None:
    mask = np.ones((4, 3), dtype=bool)
    kept = without_inertia(mask, ("u_dot", "v_dot", "r_dot", "u"), np.array([False, True, False]))
    assert kept.tolist() == [[True, False, True]] * 3 + [[True, True, True]]
    assert mask.all()


@pytest.mark.slow
def test_several_logs_and_whole_logs_for_validation(tmp_path: Path) -> None:
    logs = [str(FIXTURES / "short.mcap"), str(FIXTURES / "second.bag")]
    result = fit_logs(logs, PROFILE, replace(SETTINGS, split="logs"), RunContext(tmp_path))
    assert [log.training.any() for log in result.logs] == [True, False]
    assert [log.validation.any() for log in result.logs] == [False, True]
    assert [log.motion.log for log in result.logs] == ["short", "second"]


@pytest.mark.slow
@pytest.mark.parametrize("residual", ["commanded", "parallel"])
@pytest.mark.parametrize("smoother", ["savgol", "kalman"])
def test_variants_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, residual: str, smoother: str) -> None:
    result = fit_logs(
        [str(FIXTURES / "short.mcap")],
        PROFILE,
        replace(SETTINGS, residual=residual, smoother=smoother),
        RunContext(tmp_path),
    )
    assert np.isfinite(result.acceptance.normalised_mse)
    assert result.model.settings["residual"] == residual


@pytest.mark.slow
def test_wind_joins_the_basis_only_when_every_log_has_it(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> None:
    assert "wind" in fitted(monkeypatch, opened).model.settings["basis"]
    calm = replace(opened, measured=replace(opened.measured, wind=None))
    assert "wind" not in fitted(monkeypatch, calm).model.settings["basis"]


def test_nothing_measured_together_is_told(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> None:
    # The apparent wind, which the basis needs here, is unknown without a heading.
    adrift = opened.measured.eta * [1.0, 1.0, np.nan]
    with pytest.raises(FerryIdError, match=r"short: no moment .*Fix: "):
        fitted(monkeypatch, replace(opened, measured=replace(opened.measured, eta=adrift)))
