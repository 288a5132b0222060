"""The sentence that judges a model on a log, which says on which axes it is worse."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ferryid.compare import evaluate
from ferryid.files import dump_json
from ferryid.models import Model, blank_model
from ferryid.models.scores import force_scores
from ferryid.report.evaluation_text import render_evaluation
from ferryid.types import RunContext
from ferryid.vessel import load_profile

LOG = Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap"

N = 400
HEAD = {"model": {"name": "ferry", "version": 1}, "window_s": 2.0}


@pytest.mark.parametrize(
    ("ratios", "told"),
    [
        ((0.5, 0.6, 0.7), "40% better than its base model here (mean square force error)"),
        ((0.4, 0.5, 1.2), "30% better than its base model here (mean square force error), but worse in yaw"),
        ((0.2, 1.2, 1.3), "10% better than its base model here (mean square force error), but worse in sway and yaw"),
        ((0.8, 0.9, 1.6), "10% worse than its base model here (mean square force error), namely in yaw"),
        ((1.4, 0.7, 1.5), "20% worse than its base model here (mean square force error), namely in surge and yaw"),
        ((1.2, 1.3, 1.4), "30% worse than its base model here (mean square force error), on every axis"),
        # Within 5 % no axis is called worse.
        ((1.04, 1.04, 1.04), "4% worse than its base model here (mean square force error)"),
        # An axis on which the base model is right cannot be judged.
        ((np.nan, 1.2, 1.4), "30% worse than its base model here (mean square force error), namely in sway and yaw"),
        ((np.nan, np.nan, np.nan), "cannot be judged: the base model makes no error here"),
    ],
)
def test_the_verdict_says_where_a_model_is_worse(ratios: tuple[float, float, float], told: str) -> None:
    tau = np.random.default_rng(1).normal(size=(N, 3))
    known = np.isfinite(ratios)
    base = tau + np.where(known, 1.0, 0.0)
    model = tau + np.sqrt(np.where(known, ratios, 1.0))
    scores = force_scores(tau, base, model, np.ones(N, dtype=bool))
    text = render_evaluation({**HEAD, "logs": [{"name": "log", **scores.to_json()}]})
    assert f"  {told}" in text.splitlines()


@pytest.mark.slow
def test_a_model_that_adds_nothing_needs_no_second_free_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Evaluated as its base model alone, and as other models are: the same to the last digit."""
    profile = load_profile("milliampere")
    context = RunContext(tmp_path, ranges=((0.0, 20.0),))

    def told() -> str:
        return dump_json(evaluate(blank_model(profile, "bare"), [str(LOG)], context, profile=profile))

    once = told()
    monkeypatch.setattr(Model, "blank", False)
    assert told() == once
