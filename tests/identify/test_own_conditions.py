"""Conditions that logs have of their own beside wind: physics by measured ones, and made campaigns of a known hull."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.identify.condition_choice import KindTest
from ferryid.identify.condition_kinds import ChangedWindows, ConditionKind, ConditionParameter, MotionSamples
from ferryid.identify.condition_problem import hull_and_conditions
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.log_condition import KindOutcome, LogCondition, conditions_json
from ferryid.identify.outcome import LogWind
from ferryid.identify.own_conditions import KINDS, with_own_conditions
from ferryid.identify.weak_data import WeakData
from ferryid.identify.weak_rows import average_over_windows
from ferryid.models.forces import effective_mass
from ferryid.signals.smooth import Measured
from ferryid.signals.track import Motion
from ferryid.types import no_progress
from ferryid.vessel.hull import current_in_body, inverse_dynamics, payload_force
from tests.identify.rounds import PROFILE
from tests.identify.test_log_conditions import blown, damping_error
from tests.identify.test_weak_form import BASIS, SCALE, data_of, placed
from tests.identify.trials import measured

Floats = NDArray[np.float64]
LOGS, SECONDS, NOISE = 5, 200.0, 20.0
SPREADS: Mapping[str, Floats] = {
    "current": np.array([0.1, 0.1]),
    "payload": np.array([0.08 * PROFILE.hull.mass_kg, 0.0]),
    "heading_bias": np.array([2.0]),
    "velocity_offset": np.array([0.03, 0.03]),
    "yaw_rate_offset": np.array([0.005]),
}
"""Standard deviations of what the made logs have of their own."""


def log_of(kind: str, value: Floats, seed: int) -> Measured:
    """Return a log of the profile's hull with one condition."""

    def force(made: Motion) -> Floats:
        if kind == "current":
            flow = current_in_body(np.broadcast_to(value, (len(made.t), 2)), made.eta[:, 2])
            return inverse_dynamics(PROFILE.hull, made.nu_dot, made.nu, flow) - made.tau
        if kind == "payload":
            return payload_force(np.broadcast_to([value[0], 0.0], (len(made.t), 2)), made.nu_dot, made.nu)
        return np.zeros_like(made.tau)

    one = measured(seed, seconds=SECONDS, noise=NOISE, jitter=0.01, force=force)
    nu, eta = one.nu.copy(), one.eta
    if kind == "velocity_offset":
        nu[:, :2] += value
    elif kind == "yaw_rate_offset":
        nu[:, 2] += value
    elif kind == "heading_bias":
        angle = np.radians(value[0])
        c, s = np.cos(angle), np.sin(angle)
        nu[:, 0], nu[:, 1] = c * one.nu[:, 0] + s * one.nu[:, 1], c * one.nu[:, 1] - s * one.nu[:, 0]
        eta = eta + np.array([0.0, 0.0, angle])
    return replace(one, nu=nu, eta=eta)


def campaign(kind: str, seed: int = 2) -> tuple[WeakData, list[Floats]]:
    """Return logs that have a condition each, and what they have; their mean is none, as a hull cannot be told from it."""
    rng = np.random.default_rng(seed)
    values = SPREADS[kind] * rng.standard_normal((LOGS, len(SPREADS[kind])))
    values -= values.mean(axis=0)
    logs = [log_of(kind, value, 100 * seed + k) for k, value in enumerate(values)]
    return data_of(logs, delta=0.8, sigma=0.8), list(values)


@pytest.mark.parametrize("kind", KINDS)
def test_what_logs_have_of_their_own_is_found_and_kept_out_of_the_hull(kind: str) -> None:
    data, truth = campaign(kind)
    after = with_own_conditions(data)
    assert list(after.own_spreads) == [kind]
    assert [one.included for one in after.condition_kinds] == [one == kind for one in KINDS]
    found = after.log_conditions
    assert [one.log for one in found] == list(data.log_names)
    for one, value in zip(found, truth, strict=True):
        error = (one.values - value)[: len(one.values) if kind != "payload" else 1]
        assert np.all(np.abs(error) < 3.0 * one.standard_error[: len(error)])
        assert np.all(one.standard_error < 0.5 * SPREADS[kind].max())
    assert damping_error(after) < 0.8 * damping_error(data)


def test_intervals_of_the_hull_hold_the_truth_where_logs_have_loads() -> None:
    data, _ = campaign("payload", seed=4)
    after = with_own_conditions(data)
    assert "payload" in after.own_spreads
    found = estimate_correction(after, len(BASIS.terms), 200, no_progress).coefficients
    base, true = data.windows.base_mass, PROFILE.hull.M
    for axis, name in enumerate(("u_dot", "v_dot", "r_dot")):
        row = data.functions.terms.index(name)
        assert found.low[row, axis] <= true[axis, axis] - base[axis, axis] <= found.high[row, axis]
    mass = effective_mass(PROFILE, data.settings.scale, data.functions.terms, found.theta)
    np.testing.assert_allclose(np.diag(mass), np.diag(true), rtol=0.03)


def test_a_wind_and_a_current_of_each_log_are_told_apart() -> None:
    rng = np.random.default_rng(7)
    logs, winds, currents = [], rng.normal(0.0, 2.0, (LOGS, 2)), rng.normal(0.0, 0.12, (LOGS, 2))
    for k in range(LOGS):
        one = log_of("current", currents[k], 700 + k)
        logs.append(replace(one, tau=one.tau + _blown(one, winds[k])))
    data = data_of(logs)
    after = with_own_conditions(data)
    assert list(after.own_spreads) == ["current"]
    np.testing.assert_allclose([one.values for one in after.log_conditions], currents, atol=0.04)
    np.testing.assert_allclose([one.wind for one in after.winds], winds, atol=0.5)
    before = np.abs(np.array([one.wind for one in data.winds]) - winds).max()
    assert np.abs(np.array([one.wind for one in after.winds]) - winds).max() < before


def _blown(log: Measured, wind: Floats) -> Floats:
    return blown(SimpleNamespace(t=log.t, eta=log.eta, nu=log.nu), wind)  # type: ignore[arg-type]


def test_logs_without_anything_of_their_own_have_none_and_two_logs_are_not_asked() -> None:
    logs = [measured(k, seconds=SECONDS, noise=NOISE, jitter=0.01) for k in range(LOGS)]
    data = data_of(logs, delta=0.8, sigma=0.8)
    after = with_own_conditions(data)
    assert not after.own_spreads
    assert after.own is None
    assert [one.kind for one in after.condition_kinds] == list(KINDS)
    assert not any(one.included for one in after.condition_kinds)
    assert [one.wind for one in after.winds] == [one.wind for one in data.winds]
    np.testing.assert_array_equal(
        estimate_correction(after, len(BASIS.terms), 0, no_progress).coefficients.theta,
        estimate_correction(data, len(BASIS.terms), 0, no_progress).coefficients.theta,
    )
    two = data_of(logs[:2])
    assert with_own_conditions(two) is two


def test_kinds_that_logs_cannot_show_are_left_out_with_the_reason() -> None:
    logs = [measured(k, seconds=SECONDS) for k in range(3)]
    in_tank = replace(PROFILE, setting="tank", hull=replace(PROFILE.hull, D=type(PROFILE.hull.D)()))
    assert not in_tank.hull.is_known
    told = {one.kind: one for one in with_own_conditions(data_of(logs, in_tank)).condition_kinds}
    assert told["current"].reason == "the profile's setting is a tank"
    assert "no hull model" in told["payload"].reason
    known = [replace(one, current=np.zeros((len(one.t), 2))) for one in logs]
    reasons = {one.kind: one.reason for one in with_own_conditions(data_of(known)).condition_kinds}
    assert reasons["current"] == "it was measured"


def test_a_condition_acts_on_windows_as_one_that_was_measured() -> None:
    made, rows = placed(3), np.ones(1200, dtype=bool)
    plain = average_over_windows(made, rows, PROFILE, SCALE, BASIS, 8.0)
    samples = MotionSamples.of(PROFILE, made, made.nu, plain, 8.0)
    log = ChangedWindows(PROFILE, SCALE, BASIS, plain, samples, np.zeros(3, dtype=bool))
    flow = np.array([0.2, -0.1])
    known = average_over_windows(
        replace(made, current=np.broadcast_to(flow, (len(made.t), 2))), rows, PROFILE, SCALE, BASIS, 8.0
    )
    found, size = log.under({"current": flow}, np.eye(3)), np.abs(known.steady - plain.steady).max(axis=0)
    np.testing.assert_allclose(found.steady / size, known.steady / size, atol=0.05)
    load = np.array([100.0, 50.0])
    aboard = average_over_windows(
        replace(made, payload=np.broadcast_to([100.0, 0.5], (len(made.t), 2))), rows, PROFILE, SCALE, BASIS, 8.0
    )
    found, size = log.under({"payload": load}, np.eye(3)), np.abs(aboard.steady - plain.steady).max(axis=0)
    np.testing.assert_allclose(found.steady / size, aboard.steady / size, atol=0.05)
    second = np.zeros((3, 3))
    second[2, 2] = 100.0 * 0.5**2
    np.testing.assert_allclose(found.inertia + second, aboard.inertia)
    known = replace(
        made, eta=made.eta - [0.0, 0.0, np.pi / 2.0], nu=made.nu @ [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    )
    right = average_over_windows(known, rows, PROFILE, SCALE, BASIS, 8.0)
    of_known = ChangedWindows(
        PROFILE, SCALE, BASIS, right, MotionSamples.of(PROFILE, known, known.nu, right, 8.0), np.zeros(3, dtype=bool)
    )
    turned, straight = (
        log.under({"heading_bias": np.array([90.0]), "current": flow}, np.eye(3)),
        of_known.under({"current": flow}, np.eye(3)),
    )
    np.testing.assert_allclose(turned.heading, straight.heading, atol=1e-9)
    size = np.abs(straight.steady - right.steady).max(axis=0)
    np.testing.assert_allclose(turned.steady / size, straight.steady / size, atol=0.2)
    np.testing.assert_allclose(
        turned.by_velocity[:, :2], np.column_stack([-plain.by_velocity[:, 1], plain.by_velocity[:, 0]])
    )


def test_the_estimate_of_folds_is_made_anew_and_windows_are_kept() -> None:
    data, _ = campaign("current")
    after = with_own_conditions(data)
    assert after.windows is data.windows
    masks = after.split.training
    part = replace(after, split=replace(after.split, training=(*masks[:3], *map(np.zeros_like, masks[3:]))))
    assert part.own_spreads == after.own_spreads
    assert part.own is not after.own
    values = [at.get("current") for at in part.own.values]  # type: ignore[union-attr]
    assert not np.any(values[3:])


def test_a_kind_needs_evidence_and_held_out_data() -> None:
    kind = ConditionKind("current", "current", (ConditionParameter("north", "m/s", 0.2),))
    good = KindTest(kind, 0.5, 20.0, 10.0, 3.0, 5.0)
    assert good.supported
    assert replace(good, across=-4.0).supported
    assert not replace(good, across=-6.0).supported
    assert not replace(good, within=-1.0).supported
    assert not replace(good, evidence=4.0).supported


def test_intervals_of_the_hull_are_wider_by_what_conditions_leave_open() -> None:
    data, _ = campaign("payload")
    problem = hull_and_conditions(data, ["payload"])
    assert [kind.id for kind in problem.kinds] == ["wind", "payload"]
    after = with_own_conditions(data)
    assert after.own is not None
    for axis in range(3):
        own = [*np.flatnonzero(data.functions.mask[:, axis]), len(data.functions.terms)]
        values = np.linalg.eigvalsh(after.own.added[axis][np.ix_(own, own)])
        assert values.max() > 0.0
        assert values.min() > -1e-6 * values.max()


def test_conditions_are_worded_and_kept_by_log() -> None:
    one = LogCondition(
        "a", "current", "current", ("north", "east"), ("m/s", "m/s"), np.array([0.2, -0.1]), 1e-4 * np.eye(2)
    )
    assert str(one) == "a: north 0.2 (0.18 to 0.22) m/s, east -0.1 (-0.12 to -0.0804) m/s"
    none = replace(one, values=np.array([0.01, 0.0]))
    assert str(none) == "a: not distinguishable from zero"
    wind: Any = LogWind("a", (1.0, 0.0), (0.1, 0.1))
    (entry,) = conditions_json([wind], [one])
    assert list(entry) == ["log", "wind", "current"]
    assert entry["current"]["east"] == {"value": -0.1, "standard_error": 0.01, "unit": "m/s"}
    told = KindOutcome("current", "current", False, "no heading was measured")
    assert str(told) == "current: not estimated, as no heading was measured"
    assert told.to_json()["evidence"] is None


def test_the_list_of_training_logs_has_what_was_estimated_of_each() -> None:
    data, _ = campaign("current")
    after = with_own_conditions(data)
    names = after.log_names
    entries = after.with_conditions([(name, {"name": name, "rows": 7}) for name in names])
    assert [one["name"] for one in entries] == list(names)
    for one, found in zip(entries, after.log_conditions, strict=True):
        assert list(one["conditions"]) == ["wind", "current"]
        assert one["conditions"]["current"] == found.to_json()
    assert after.with_conditions([("another", {"rows": 7})]) == ({"rows": 7},)
