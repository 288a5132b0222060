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
from ferryid.diagnose.judging.time_posterior import TimePosterior
from ferryid.effects import effects
from ferryid.vessel import load_profile


@pytest.mark.slow
@pytest.mark.parametrize(
    ("evidence", "most"),
    [
        (lambda t: -4.0 * abs(t - 300.3), 60),
        (lambda t: -0.5 * ((t - 260.0) / 40.0) ** 2, 250),
        (lambda t: float(np.logaddexp(-0.3 * abs(t - 300.3), 1.0 - 0.5 * ((t - 180.0) / 9.0) ** 2)), 200),
        (lambda t: 0.0 if 290.1 < t < 310.5 else -12.0, 320),
        (lambda t: -0.02 * abs(t - 300.3), 250),
        (lambda t: -0.02 * abs(t - 300.3) + 1.5 * np.sin(t / 4.0), 450),
    ],
    ids=["sharp", "broad", "two tops", "steps", "the whole log", "ragged"],
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


def _flat_from_the_start(t: float) -> float:
    return -0.1 * max(t - 39.0, 0.0)


def _saw(t: float) -> float:
    return -0.05 * abs(t - 300.3) + 4.0 * ((t / 7.3) % 1.0)


def _uneven_tail(t: float) -> float:
    tail = -11.0 - 0.5 * ((t - 420.0) / 20.0) ** 2 + 5.0 * np.sin(2.0 * np.pi * t / 6.5)
    return float(np.logaddexp(-2.0 * abs(t - 300.3), tail))


@pytest.mark.parametrize(
    ("evidence", "here", "near"),
    [
        (_flat_from_the_start, 39.0, (0.1, 0.1, 0.1)),
        (_saw, 300.3, (4.0, 0.5, 4.0)),
        (_uneven_tail, 300.3, (0.1, 0.3, 2.5)),
    ],
    ids=["begins with the log", "many tops", "a tail of many tops"],
)
def test_an_uneven_posterior_is_followed_where_it_counts(
    evidence: Callable[[float], float], here: float, near: tuple[float, float, float]
) -> None:
    shares = np.array([0.025, 0.5, 0.975])
    found = TimePosterior.about(evidence, here, 4.0, 714.0, 8.0)
    every = np.arange(4.0, 714.0, 0.02)
    density = np.exp(np.array([evidence(t) for t in every.tolist()]) / INFERENCE.posterior_factor**2)
    expected = np.interp(shares, np.cumsum(density) / density.sum(), every)
    assert (np.abs(found.quantiles(shares) - expected) < near).all()
    # As dense as forces are it would take thousands.
    assert len(found.tried) < 450
