"""Short logs one after another: gaps and slopes are those of each log by itself, and what cannot be joined is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference import campaign_logs
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import INDUCED, Campaign, HullPrior
from ferryid.diagnose.inference.candidate import Candidate
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.campaign_evidence import placebos
from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel, Measurements, hull_of
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force

FERRY = load_profile("milliampere")
CONDITIONS = tuple(Candidate.of(effects()[name], None, FERRY) for name in ("current", "wind"))
GAIN = Candidate.of(effects()["thruster_gain"], "thruster1", FERRY)
LAG = Candidate.of(effects()["thruster_lag"], None, FERRY)
PUSH = replace(Candidate.of(effects()["thruster_gain"], "thruster1", FERRY), onset_s=20.0)


def member(seed: int, seconds: float, conditions: tuple[Candidate, ...] = CONDITIONS) -> Member:
    """Return a log of smooth chance motion."""
    rng, n = np.random.default_rng(seed), round(seconds / 0.2)
    t = 0.2 * np.arange(n)
    waves = np.stack(
        [np.sin(t[:, None] * rng.uniform(0.05, 0.5, 4) + rng.uniform(0, 6, 4)).sum(1) for _ in range(6)], 1
    )
    nu = waves[:, :3] * [0.3, 0.1, 0.05]
    eta = np.column_stack([*np.cumsum(0.2 * nu[:, :2], axis=0).T, waves[:, 3]])
    parts = np.stack([waves[:, 4:5] * [60.0, 20.0, 30.0], waves[:, 5:6] * [50.0, -10.0, 40.0]], axis=1)
    angles = np.arctan2(parts[:, :, 1], parts[:, :, 0])
    measurements = Measurements(FERRY, t, eta, nu, nu, parts, angles, np.ones(n, dtype=bool))
    seen = windows(measurements, *window_lengths(FERRY))
    thin = seen.measurements
    still = wind_force(FERRY.wind, np.zeros((len(thin.t), 2)), thin.psi, thin.nu)  # type: ignore[arg-type]
    return Member(seen, ForceModel(thin, hull_of(FERRY), thin.parts, thin.angles, still), conditions)


def campaign(members: tuple[Member, ...], *properties: Candidate, known: bool = True) -> Campaign:
    mean = np.append(hull_of(FERRY), np.zeros(len(INDUCED)))
    drag = np.zeros(len(INDUCED)) if known else np.array([30.0, 60.0])
    return Campaign(members, HullPrior(mean, np.append(0.3 * np.abs(hull_of(FERRY)), drag), known), properties)


SHORT = tuple(member(seed, 30.0 + 7.0 * seed) for seed in range(4))


def estimate(made: Campaign) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    return 0.3 * rng.normal(size=made.g), 0.3 * rng.normal(size=(len(made.members), made.l))


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("placebo", [None, "current", "wind"])
def test_joined_logs_have_the_gaps_and_slopes_of_each(
    known: bool, placebo: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = campaign(SHORT, GAIN, known=known)
    if placebo is not None:
        made = placebos(made, placebo)["the heading mirrored"]
    common, own = estimate(made)
    gaps, lines = made.gaps(common, own), made.linearised(common, own)
    assert [stack.logs for stack in made.stacks] == [(0, 1, 2, 3)]
    monkeypatch.setattr(campaign_logs, "MOST_ROWS", 0)
    alone = replace(made)
    assert [stack.logs for stack in alone.stacks] == [(0,), (1,), (2,), (3,)]
    for i, (there, slopes) in enumerate(alone.linearised(common, own)):
        np.testing.assert_allclose(gaps[i], made.gap(i, common, own[i]), rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(lines[i][0], there, rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(lines[i][1], slopes, rtol=0.0, atol=1e-12)


def test_what_looks_along_a_log_acts_in_each_by_itself() -> None:
    for acting in (LAG, PUSH):
        made = campaign(SHORT, acting)
        assert [stack.logs for stack in made.stacks] == [(0,), (1,), (2,), (3,)]


def test_logs_are_joined_with_those_like_them_and_no_more_than_fit() -> None:
    other = tuple(replace(one, conditions=CONDITIONS[:1]) for one in SHORT[:2])
    theirs = tuple(replace(one, group="B") for one in SHORT[2:])
    long = member(9, 900.0)
    made = campaign((SHORT[0], other[0], long, SHORT[1], other[1], *theirs))
    assert [stack.logs for stack in made.stacks] == [(0,), (1, 4), (2,), (3,), (5, 6)]
    made = campaign((SHORT[0], other[0], SHORT[1], other[1], *theirs))
    assert [stack.logs for stack in made.stacks] == [(0, 2), (1, 3), (4, 5)]
    common, own = estimate(made)
    for i, gaps in enumerate(made.gaps(common, own)):
        np.testing.assert_allclose(gaps, made.gap(i, common, own[i]), rtol=0.0, atol=1e-14)


def test_measured_axes_of_another_log_keep_it_alone() -> None:
    turned = replace(SHORT[1], plain=replace(SHORT[1].plain, turned=0.1))
    made = campaign((SHORT[0], turned, *SHORT[2:]))
    assert [stack.logs for stack in made.stacks] == [(0, 2, 3), (1,)]
