"""Conditions of acceptance besides the held-out error: inertia, damping, free runs, and how much was held out."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.identify import inputs
from ferryid.identify.acceptance import Check
from ferryid.identify.free_run_checks import free_run_checks, paired_interval
from ferryid.identify.held_out_checks import held_out_checks, skill_checks
from ferryid.identify.inertia import inertia_checks, undetermined
from ferryid.identify.inertia.shares import rigid_body
from ferryid.identify.physical_checks import damping_checks
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.models import ForceScores
from ferryid.models.prediction import FreeRun, SingleRuns
from ferryid.signals.prepare import open_track
from ferryid.types import RunContext
from tests.identify.rounds import PROFILE

Floats = NDArray[np.float64]
RIGID = rigid_body(PROFILE.hull)
FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
HORIZONS = np.array([10.0, 30.0, 60.0])


def failed(checks: tuple[Check, ...]) -> set[str]:
    return {check.name for check in checks if check.passed is False}


def test_an_inertia_is_possible_between_its_bounds() -> None:
    assert not failed(inertia_checks(PROFILE, 1.5 * RIGID))
    assert failed(inertia_checks(PROFILE, RIGID @ np.diag([0.5, 1.5, 1.5]))) >= {"inertia_surge"}
    assert failed(inertia_checks(PROFILE, np.diag([1.5, 6.0, 1.5]) @ np.diag(np.diag(RIGID)))) == {"inertia_sway"}
    at_bound = inertia_checks(PROFILE, np.diag([0.8, 1.5, 1.5]) @ np.diag(np.diag(RIGID)))
    assert not failed(at_bound)
    assert "held at that bound" in next(check.reason for check in at_bound if check.name == "inertia_surge")


def test_an_inertia_held_at_its_upper_bound_is_none_that_a_hull_has() -> None:
    at_bound = inertia_checks(PROFILE, np.diag([5.0, 1.5, 1.5]) @ np.diag(np.diag(RIGID)))
    assert failed(at_bound) == {"inertia_surge"}
    reason = next(check.reason for check in at_bound if check.name == "inertia_surge")
    assert "held at that bound" in reason
    assert "the applied force may be too large or of the wrong sign, or the actuators were not engaged. Fix:" in reason


def test_an_inertia_in_yaw_at_its_upper_bound_may_be_a_guess_of_the_profile() -> None:
    checks = {one.name: one for one in inertia_checks(PROFILE, np.diag([5.0, 1.5, 5.0]) @ np.diag(np.diag(RIGID)))}
    assert "inertia_z or k_zz_m" in checks["inertia_yaw"].reason
    assert "mass_kg" in checks["inertia_surge"].reason
    assert "k_zz_m" not in checks["inertia_surge"].reason


def at_upper_bound_in_yaw(*shares: float) -> Check:
    """Return the check of an inertia in yaw at its bound, where the data have it between these shares of the rigid body's."""
    spans = np.full((3, 2), np.nan)
    spans[2] = RIGID[2, 2] * np.array(shares)
    checks = inertia_checks(PROFILE, np.diag([1.5, 1.5, 5.0]) @ np.diag(np.diag(RIGID)), spans)
    return next(one for one in checks if one.name == "inertia_yaw")


def test_an_inertia_that_the_data_leave_open_below_its_bound_does_not_reject() -> None:
    check = at_upper_bound_in_yaw(3.0, 12.0)
    assert check.passed is None
    assert undetermined([check]) == ("yaw",)
    assert undetermined([at_upper_bound_in_yaw(3.0, 40.0)]) == ()
    assert "the data do not determine it" in check.reason
    assert f"acceleration the moment with {3.0 * RIGID[2, 2]:.3g} kg·m², and the truth lies between" in check.reason
    # A force that hardly shows in the motion at all leaves everything open, and so does a mirrored one.
    assert at_upper_bound_in_yaw(3.0, 40.0).passed is False
    assert at_upper_bound_in_yaw(0.5, 4.0).passed is False


def test_an_inertia_that_lies_above_its_bound_says_what_the_profile_would_need() -> None:
    check = at_upper_bound_in_yaw(7.0, 30.0)
    assert check.passed is False
    assert "the truth lies between" in check.reason
    assert check.reason.endswith(
        f"inertia_z or k_zz_m, more than {7.0 * RIGID[2, 2] / 5.0:.2g} kg·m² to admit that much."
    )
    assert "to admit that much" not in at_upper_bound_in_yaw(np.nan, np.nan).reason


def test_a_bound_is_met_in_whatever_direction_the_inertia_is_that_large() -> None:
    """Sway and yaw coupled: the diagonal is within its bounds, another direction is at them, as the estimate holds it."""
    root = np.linalg.cholesky(RIGID)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, 0.6], [0.0, -0.6, 0.8]])
    mass = root @ turn @ np.diag([1.5, 5.0, 2.0]) @ turn.T @ root.T
    share = np.diag(mass) / np.diag(RIGID)
    assert share.max() < 4.5
    checks = inertia_checks(PROFILE, mass)
    name = ("inertia_surge", "inertia_sway", "inertia_yaw")[1 if turn[1, 1] > turn[2, 1] else 2]
    assert failed(checks) == {name}
    assert "5.00 with its coupling to the other axes" in next(one.reason for one in checks if one.name == name)
    assert not failed(inertia_checks(PROFILE, 0.95 * mass))
    beyond = next(one.reason for one in inertia_checks(PROFILE, 1.1 * mass) if one.name == name)
    assert "5.50 with its coupling" in beyond
    assert beyond.endswith("no hull carries that much added mass.")


def test_a_mass_matrix_has_to_be_positive_definite_however_large_its_diagonal() -> None:
    mass = np.diag(np.diag(RIGID)) * 1.5
    mass[1, 2] = mass[2, 1] = 1.01 * np.sqrt(mass[1, 1] * mass[2, 2])
    assert failed(inertia_checks(PROFILE, mass)) == {"mass_matrix"}
    mass[1, 2] = mass[2, 1] = 0.99 * np.sqrt(mass[1, 1] * mass[2, 2])
    assert not failed(inertia_checks(PROFILE, mass))


def test_damping_dissipates_where_the_vessel_went_and_a_quarter_beyond() -> None:
    visited = np.random.default_rng(1).uniform(-1.0, 1.0, (2000, 3))
    assert not failed(damping_checks(lambda nu: 50.0 * nu, visited))
    assert failed(damping_checks(lambda nu: nu * [50.0, -1.0, 50.0], visited)) >= {"damping_sway"}
    # Damped below a speed of 1.1 and driven above it: only the margin shows it.
    assert failed(damping_checks(lambda nu: nu * (1.21 - nu**2), visited)) >= {"damping_surge", "damping_yaw"}
    assert not failed(damping_checks(lambda nu: nu * (1.6 - nu**2), visited))
    # A Coriolis force does no work, and a steady force is no damping.
    assert not failed(damping_checks(lambda nu: np.add(nu, (300.0, 0.0, 0.0)), visited))
    assert not failed(
        damping_checks(lambda nu: nu + np.column_stack([-nu[:, 1], nu[:, 0], np.zeros(len(nu))]) * 99.0, visited)
    )


def test_a_paired_interval_is_students_over_clusters() -> None:
    # Two clusters of two: sums of deviations -2 and 2, standard error sqrt(2/1 (4 + 4))/4 = 1, and t(1, 97.5 %) = 12.7062.
    mean, low, high = paired_interval(np.array([1.0, 1.0, 3.0, 3.0]), np.array([0, 0, 7, 7]))
    assert (mean, low, high) == pytest.approx((2.0, 2.0 - 12.7062, 2.0 + 12.7062), rel=1e-5)


def test_a_paired_interval_holds_the_truth_as_often_as_it_claims() -> None:
    rng = np.random.default_rng(5)
    clusters = np.repeat(np.arange(12), 3)
    held = 0
    for _ in range(2000):
        _, low, high = paired_interval(rng.normal(size=12)[clusters] + 0.5 * rng.normal(size=36), clusters)
        held += low <= 0.0 <= high
    assert held / 2000 == pytest.approx(0.95, abs=0.015)


def runs(errors: Floats, stretch_rows: int = 1000) -> FreeRun:
    """Return free runs of one log at 10 Hz, each in a stretch of its own, with errors (N, H) of position."""
    count, wide = errors.shape
    every = np.repeat(errors[:, :, None], 4, axis=2)
    start = np.arange(count) * stretch_rows
    single = SingleRuns(
        rate_hz=np.full(count, 10.0),
        log=np.zeros(count, dtype=np.int64),
        start=start,
        end=start + stretch_rows,
        errors=every,
        reached=np.ones((count, wide), dtype=bool),
    )
    nothing = np.zeros(wide)
    return FreeRun(HORIZONS[:wide], nothing, nothing, nothing, nothing, count, {}, single=single)


def test_free_runs_are_worse_only_beyond_their_interval() -> None:
    rng = np.random.default_rng(3)
    old = 1.0 + rng.random((12, 3))
    assert not failed(free_run_checks(runs(old), runs(old)))
    assert not failed(free_run_checks(runs(old), runs(0.5 * old)))
    worse = failed(free_run_checks(runs(old), runs(1.5 * old)))
    assert {"free_run_position_10s", "free_run_heading_30s", "free_run_yaw_rate_60s"} <= worse
    by_chance = old + rng.normal(0.0, 1.0, old.shape) * 0.3
    assert not failed(free_run_checks(runs(old), runs(by_chance)))


def test_a_heading_that_is_lost_within_seconds_rejects_however_bad_the_base_model_is() -> None:
    old = runs(np.ones((12, 3)))

    def off(*degrees: float) -> FreeRun:
        return replace(old, horizons_s=np.array([5.0, 10.0, 30.0]), heading_rad=np.radians(degrees))

    assert "free_run_heading" not in failed(free_run_checks(off(90.0, 90.0, 90.0), off(28.0, 60.0, 120.0)))
    rejected = [one for one in free_run_checks(off(170.0, 90.0, 90.0), off(145.0, 20.0, 20.0)) if one.passed is False]
    assert [one.name for one in rejected] == ["free_run_heading"]
    assert rejected[0].reason.startswith(
        "Run free for 5 s the new model's heading is off by 145° (rms), and 29° is allowed: it does not describe"
    )
    assert "free_run_heading" in failed(free_run_checks(FreeRun.not_run("no inertia"), off(np.nan, 40.0, 40.0)))
    # No held-out stretch was long enough.
    assert not failed(free_run_checks(old, off(np.nan, np.nan, np.nan)))


def test_a_free_run_that_diverges_rejects_where_the_base_model_does_not() -> None:
    old = np.ones((12, 3))
    lost = old.copy()
    lost[4, 1:] = np.nan
    assert "divergence" in failed(free_run_checks(runs(old), runs(lost)))
    assert "divergence" not in failed(free_run_checks(runs(lost), runs(lost)))
    impossible = FreeRun.not_run("no inertia")
    assert failed(free_run_checks(runs(old), impossible)) == {"free_run"}
    assert not failed(free_run_checks(impossible, runs(old)))


def test_what_cannot_be_compared_is_told_and_decides_nothing() -> None:
    one = runs(np.ones((1, 3)))
    checks = free_run_checks(one, runs(np.full((1, 3), 9.0)))
    assert not failed(checks)
    assert [check.name for check in checks if check.passed is None] == [f"free_run_{h:g}s" for h in HORIZONS]
    assert checks[-1].reason.endswith(
        "not compared there, where the new model errs more (mean position 9 m against 1, heading 516 deg against 57.3 and "
        "yaw rate 516 deg/s against 57.3)."
    )
    assert free_run_checks(one, one)[-1].reason.endswith("not compared there.")
    short = runs(np.ones((12, 1)))
    (missing,) = (check for check in free_run_checks(short, short) if check.passed is None)
    assert "30 s or 60 s" in missing.reason


def test_runs_of_one_stretch_count_as_one() -> None:
    """Twelve runs that overlap within a minute are one cluster: their number is no evidence."""
    old, new = runs(np.ones((12, 3)), stretch_rows=30), runs(np.full((12, 3), 2.0), stretch_rows=30)
    one = [replace(each, single=replace(each.single, end=np.full(12, 400))) for each in (old, new) if each.single]
    assert not failed(free_run_checks(one[0], one[1]))


def test_a_minute_and_ten_blocks_are_held_out() -> None:
    assert not failed(held_out_checks(60.0, 10, "blocks"))
    assert failed(held_out_checks(59.0, 10, "blocks")) == {"held_out_time"}
    assert failed(held_out_checks(600.0, 9, "blocks")) == {"held_out_blocks"}
    (no_blocks,) = (check for check in held_out_checks(600.0, 0, "every-kth") if check.passed is False)
    assert "--split blocks" in no_blocks.reason


def test_a_short_log_is_accepted_by_the_thesis_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path)
    monkeypatch.setattr(inputs, "open_track", lambda *_, **__: opened)
    told = {}
    for criterion in ("thesis", "full"):
        settings = FitSettings(components=8, draws=100, delta=0.4, sigma=0.4, estimator="derivative", accept=criterion)
        told[criterion] = fit_logs(["short.mcap"], PROFILE, settings, RunContext(tmp_path)).acceptance
    assert told["thesis"].accepted
    assert not told["full"].accepted
    assert any(reason.startswith("Rejected: held-out data are") for reason in told["full"].reasons)
    names = [check.name for check in told["full"].checks]
    assert len(names) == len(set(names))
    # Every reason against comes before what else is told.
    against = [reason.startswith("Rejected:") for reason in told["full"].reasons]
    assert all(first >= second for first, second in pairwise(against))


def test_a_model_is_held_against_a_velocity_that_does_not_change() -> None:
    force = ForceScores.of(np.full(3, 100.0), np.array([0.5, 2.0, 1.0]), np.ones(3))

    def judged(*still: float) -> tuple[Check, ...]:
        return skill_checks(replace(force, mse_constant_velocity=np.array(still)))

    (good,) = judged(1.0, 4.0, 1.6)
    assert good.passed
    assert good.value == pytest.approx((0.5 * 0.5 * 0.625) ** (1 / 3))
    (bad,) = judged(1.0, 1.0, 0.5)
    assert bad.passed is False
    assert (
        "is 1.3 times that of a velocity that does not change (geometric mean of surge 0.5, sway 2, yaw 2)"
        in bad.reason
    )
    (near,) = judged(1.0, 1.0, 0.889)
    assert "is 1.04 times that of a velocity that does not change" in near.reason
    (nearly,) = judged(1.0, 1.0, 1.01)
    assert "is 0.997 times that of a velocity that does not change" in nearly.reason
    (even,) = judged(1.0, 1.0, 1.0)
    assert even.value == pytest.approx(1.0), "half of one is as much as twice of another"
    for still, passed in ((1.1, True), (1.0, False)):
        _, yaw = skill_checks(replace(force, mse_constant_velocity=np.array([1.0, 4.0, still])), ("yaw",))
        assert (yaw.name, yaw.passed) == ("constant_velocity_yaw", passed)
        assert yaw.value == pytest.approx(1.0 / still)
        assert ("check inertia_z or k_zz_m" in yaw.reason) != passed
    (without_sway,) = judged(1.0, np.nan, 2.0)
    assert without_sway.value == pytest.approx(0.5)
    assert judged(np.nan, np.nan, np.nan) == ()
