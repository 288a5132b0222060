"""Several models as one: the force of the mean is the mean of the forces, and nothing unlike is averaged."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ferryid.errors import FerryIdError
from ferryid.files import dump_json
from ferryid.identify.adaptive.averaging import (
    geometric_weights,
    mean_of_last,
    merge_training_logs,
    model_reference,
    weighted_mean,
)
from ferryid.identify.adaptive.rounds import fit_motions
from ferryid.identify.settings import FitSettings
from ferryid.models.forces.estimator import model_estimator
from ferryid.models.model import Model, model_to_json
from ferryid.models.store.versions import load, save
from ferryid.models.validity import span_ranges
from ferryid.report.model_text import render_model
from tests.identify.rounds import PROFILE, motion, with_flow

SCHEMAS = Path(__file__).resolve().parents[2] / "ferryid" / "schemas"


@cache
def model(
    seed: int, scale: tuple[float, float, float] = (0.4, 0.4, 1.0), basis: str = "modulus", draws: int = 0
) -> Model:
    how = FitSettings(basis=basis, components=6, delta=scale[0], sigma=scale[1], zeta=scale[2])
    return fit_motions(PROFILE, [with_flow(motion(seed, noise=40.0), seed)], how, name=f"m{seed}", draws=draws).model


MODELS = (model(1), model(2, (1.0, 0.5, 1.25)), model(3, (0.8, 1.3, 0.9)))
UNSEEN = with_flow(motion(7), 7)


@pytest.mark.slow
@given(st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3).filter(lambda weights: sum(weights) > 0.1))
@settings(max_examples=15, deadline=None)
def test_the_force_is_the_weighted_mean_of_the_forces(parts: list[float]) -> None:
    weights = np.array(parts) / np.sum(parts)
    want = sum(w * model_estimator(one).of(UNSEEN) for w, one in zip(weights, MODELS, strict=True))
    np.testing.assert_allclose(model_estimator(weighted_mean(MODELS, weights)).of(UNSEEN), want, rtol=1e-9, atol=1e-7)


@pytest.mark.parametrize("basis", ["modulus", "cross-flow-5m+wind-paper"])
def test_every_term_is_told_apart_from_its_axis(basis: str) -> None:
    lines = render_model(model(1, basis=basis)).splitlines()
    head = next(line for line in lines if line.startswith("term "))
    rows = [line for line in lines[lines.index(head) + 1 :] if line]
    assert len(rows) > 10
    for line in rows:
        assert line[head.index("axis") - 1] == " "
        assert line[head.index("axis") :].split()[0] in ("surge", "sway", "yaw")


def test_the_mean_of_the_last_takes_the_last() -> None:
    want = (model_estimator(MODELS[1]).of(UNSEEN) + model_estimator(MODELS[2]).of(UNSEEN)) / 2.0
    mean = mean_of_last(MODELS, 2, name="mean")
    np.testing.assert_allclose(model_estimator(mean).of(UNSEEN), want, rtol=1e-9, atol=1e-7)
    assert mean.name == "mean"
    assert mean.settings["made_of"] == [model_reference(MODELS[1]), model_reference(MODELS[2])]
    assert mean.settings["weights"] == [0.5, 0.5]
    assert {log["name"] for log in mean.training} == {"round 2", "round 3"}
    assert not mean.accepted
    np.testing.assert_array_equal(mean_of_last(MODELS[:1], 5).theta, MODELS[0].theta)


def test_equal_scales_stay_as_they_are() -> None:
    assert weighted_mean([model(1), model(2), model(3)], geometric_weights(3, 0.3)).scale == model(1).scale


@pytest.mark.parametrize(
    ("factor", "want"), [(0.5, [1 / 7, 2 / 7, 4 / 7]), (1.0, [1 / 3, 1 / 3, 1 / 3]), (0.0, [0.0, 0.0, 1.0])]
)
def test_geometric_weights_by_hand(factor: float, want: list[float]) -> None:
    np.testing.assert_allclose(geometric_weights(3, factor), want, rtol=1e-15)


@given(st.integers(1, 40), st.floats(0.0, 1.0))
def test_geometric_weights_sum_to_one_and_fade(count: int, factor: float) -> None:
    weights = geometric_weights(count, factor)
    assert weights.sum() == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(weights[:-1], factor * weights[1:], rtol=1e-12, atol=1e-300)


def test_a_model_of_weight_nothing_leaves_no_trace_but_its_name() -> None:
    alone = weighted_mean(MODELS, [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(alone.theta, MODELS[2].theta)
    assert alone.training == MODELS[2].training
    assert alone.ranges == MODELS[2].ranges
    assert len(alone.settings["made_of"]) == 3


@pytest.mark.slow
def test_covariance_of_models_without_a_common_log_is_that_of_independent_ones() -> None:
    a, b = model(1, draws=60), model(2, draws=60)
    rng = np.random.default_rng(0)
    got = weighted_mean([a, b], [0.3, 0.7]).covariance
    nothing = np.zeros(len(a.terms) + 1)
    for axis in range(3):
        of_a = rng.multivariate_normal(nothing, a.covariance[axis], 40000, method="eigh")
        of_b = rng.multivariate_normal(nothing, b.covariance[axis], 40000, method="eigh")
        want = np.std(0.3 * of_a + 0.7 * of_b, axis=0)
        np.testing.assert_allclose(np.sqrt(np.diag(got[axis])), want, rtol=0.02, atol=1e-5)


@pytest.mark.slow
@given(st.floats(-1.0, 1.0), st.floats(0.05, 0.95))
@settings(max_examples=20, deadline=None)
def test_covariance_of_models_with_a_common_log_is_never_too_small(correlation: float, w: float) -> None:
    a = model(1, draws=60)
    b = replace(a, covariance=4.0 * a.covariance)
    got = weighted_mean([a, b], [w, 1.0 - w]).covariance
    # Errors of b are twice those of a in size, and correlated with them as the case may be.
    true = (w**2 + 4.0 * (1.0 - w) ** 2 + 4.0 * w * (1.0 - w) * correlation) * a.covariance
    for axis in range(3):
        assert np.linalg.eigvalsh(got[axis] - true[axis]).min() > -1e-9 * np.trace(got[axis])


def test_logs_shared_over_a_third_model_tie_all_three() -> None:
    a, b, c = model(1, draws=60), model(2, draws=60), model(3)
    bridge = replace(c, training=(*a.training, *b.training), covariance=a.covariance)
    got = weighted_mean([a, b, bridge], [0.25, 0.25, 0.5]).covariance
    np.testing.assert_allclose(got, 0.75 * a.covariance + 0.25 * b.covariance, rtol=1e-12)
    # Also where the third is tied to the first by a log that the second does not have.
    more = replace(a, training=(*a.training, *c.training))
    chain = replace(a, training=(*a.training, *b.training))
    got = weighted_mean([more, chain, replace(c, covariance=b.covariance)], [0.25, 0.25, 0.5]).covariance
    np.testing.assert_allclose(got, 0.5 * a.covariance + 0.5 * b.covariance, rtol=1e-12)


def test_intervals_are_normal_ones() -> None:
    a, b = model(1, draws=60), model(2, draws=60)
    mean = mean_of_last([a, b], 2)
    half = 1.959964 * np.sqrt(mean.covariance[1, 4, 4])
    assert mean.high[4, 1] - mean.theta[4, 1] == pytest.approx(half, rel=1e-6)
    assert mean.intercept[0] - mean.intercept_low[0] == pytest.approx(1.959964 * mean.covariance[0, -1, -1] ** 0.5)


@pytest.mark.slow
def test_a_mean_is_stored_and_read_like_any_model(tmp_path: Path) -> None:
    mean = mean_of_last(MODELS, 3, name="mean")
    plain = json.loads(dump_json(model_to_json(mean)))
    jsonschema.validate(plain, json.loads((SCHEMAS / "model.json").read_text()))
    save(mean, tmp_path)
    back = load("mean@1", tmp_path)
    np.testing.assert_array_equal(back.theta, mean.theta)
    assert back.settings["weights"] == mean.settings["weights"]
    np.testing.assert_allclose(model_estimator(back).of(UNSEEN), model_estimator(mean).of(UNSEEN), rtol=1e-12)


def test_reference_tells_models_apart_but_not_dates() -> None:
    assert model_reference(MODELS[0]) == model_reference(replace(MODELS[0], created="2001-01-01T00:00:00Z"))
    assert model_reference(MODELS[0]) != model_reference(replace(MODELS[0], theta=MODELS[0].theta + 1e-9))


def test_ranges_span_and_logs_are_counted_once() -> None:
    parts = [{"u": (0.0, 1.0)}, {"u": (-1.0, 0.5), "v": (2.0, 3.0)}]
    assert span_ranges(parts) == span_ranges(parts[::-1]) == {"u": (-1.0, 1.0), "v": (2.0, 3.0)}
    small, large = {"sha256": "a", "rows": 3}, {"sha256": "a", "rows": 5}
    assert merge_training_logs([[small], [large, {"sha256": "b", "rows": 1}], [small]]) == (
        large,
        {"sha256": "b", "rows": 1},
    )


@pytest.mark.parametrize(
    ("other", "says"),
    [
        (lambda: model(1, basis="thesis"), "its basis is thesis"),
        (lambda: replace(MODELS[0], profile_text=PROFILE.text.replace('"milliampere"', '"ferry"', 1)), "of the vessel"),
        (
            lambda: replace(MODELS[0], profile_text=PROFILE.text.replace("2389.657", "2389.658")),
            "the hull of milliampere",
        ),
    ],
)
def test_unlike_models_are_refused_in_one_line(other, says: str) -> None:
    with pytest.raises(FerryIdError) as caught:
        weighted_mean([MODELS[0], other()], [0.5, 0.5])
    assert says in str(caught.value)
    assert "Fix:" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("weights", [[0.5, 0.5], [0.5, 0.4, 0.2], [1.5, -0.5, 0.0], [np.nan, 0.5, 0.5]])
def test_impossible_weights_are_refused(weights: list[float]) -> None:
    with pytest.raises(FerryIdError, match="Fix:"):
        weighted_mean(MODELS, weights)


def test_nothing_to_average_is_refused() -> None:
    for call in (
        lambda: mean_of_last([], 2),
        lambda: mean_of_last(MODELS, 0),
        lambda: geometric_weights(0, 0.5),
        lambda: geometric_weights(2, 1.1),
    ):
        with pytest.raises(FerryIdError, match="Fix:"):
            call()
