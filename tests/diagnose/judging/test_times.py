"""Onset and offset of a finding against quantiles that can be worked out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging import findings
from ferryid.effects import effects
from ferryid.vessel import load_profile


@pytest.mark.slow
@pytest.mark.parametrize(
    ("evidence", "most"),
    [
        (lambda t: -4.0 * abs(t - 300.3), 60),
        (lambda t: -0.5 * ((t - 260.0) / 40.0) ** 2, 1100),
        (lambda t: float(np.logaddexp(-0.3 * abs(t - 300.3), 1.0 - 0.5 * ((t - 180.0) / 9.0) ** 2)), 1100),
        (lambda t: 0.0 if 290.1 < t < 310.5 else -12.0, 1100),
    ],
    ids=["sharp", "broad", "two tops", "steps"],
)
def test_a_time_has_the_quantiles_of_its_posterior_by_few_fits(
    evidence: Callable[[float], float], most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = list[float]()

    def fitted(problem: object, candidates: Sequence[Candidate], *_: object, **__: object) -> SimpleNamespace:
        tried.append(candidates[0].onset_s)
        return SimpleNamespace(evidence=evidence(candidates[0].onset_s))

    monkeypatch.setattr(findings, "fit", fitted)
    monkeypatch.setattr(findings, "starting_point", lambda *_: None)
    measurements = SimpleNamespace(step_s=0.2)
    problem: Any = SimpleNamespace(
        windows=SimpleNamespace(middle_s=np.arange(4.0, 716.0, 2.0), weight=np.ones(40), measurements=measurements)
    )
    gain = Candidate.of(effects()["thruster_gain"], "thruster1", load_profile("milliampere"))
    kept: Any = SimpleNamespace(candidates=(replace(gain, onset_s=300.3),), values=(np.array([0.7]),))
    found = findings._time(problem, kept, 0, "onset_s")
    every = np.arange(4.0, 714.0, 0.02)
    density = np.exp(np.array([evidence(t) for t in every.tolist()]) / INFERENCE.posterior_factor**2)
    low, middle, high = np.interp([0.025, 0.5, 0.975], np.cumsum(density) / density.sum(), every)
    np.testing.assert_allclose(
        [found.low + 0.2, found.value, found.high - 0.2], [low, middle, high], atol=0.1 + 0.02 * (high - low)
    )
    assert len(set(tried)) == len(tried) <= most
