"""Logs that are near in time: which are of one session, and what that says of their weather."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.inference.campaign_estimation import CampaignFit, estimate_campaign
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import Campaign, Spreads
from ferryid.diagnose.inference.sessions import sessions
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.campaign_evidence import Gain, held_out_loss, without_conditions
from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats
from tests.diagnose.inference.test_campaign_estimation import WINDS, campaign

HOUR_NS = 3_600_000_000_000
FIRST, SECOND = (-2.0, 1.5), (2.5, -1.0)


def log(start_h: float, minutes: float = 12.0, first_ns: int = SIGNALS.epoch_ns) -> Any:
    measured = SimpleNamespace(survey=SimpleNamespace(t0_ns=first_ns + round(start_h * HOUR_NS)))
    windows = SimpleNamespace(measurements=SimpleNamespace(t=np.linspace(0.0, 60.0 * minutes, 10)))
    return SimpleNamespace(screened=SimpleNamespace(measured=measured), windows=windows)


def test_a_session_ends_where_nothing_follows_for_hours() -> None:
    gap = INFERENCE.session_gap_h
    assert sessions([log(0.0), log(0.5), log(24.0), log(24.5), log(72.0)]) == (0, 0, 1, 1, 2)
    # From the end of a log, and in whatever order they are given.
    assert sessions([log(0.0, minutes=60.0), log(gap + 0.9)]) == (0, 0)
    assert sessions([log(gap + 0.9), log(0.0)]) == (1, 0)
    # A short log within a long one does not end it.
    assert sessions([log(0.0, minutes=600.0), log(0.5), log(gap + 9.0)]) == (0, 0, 0)


def test_times_that_are_no_dates_make_no_sessions() -> None:
    assert sessions([log(0.0, first_ns=0), log(24.0, first_ns=0)]) == ()
    assert sessions([]) == ()


def test_a_log_without_a_date_is_near_no_other() -> None:
    assert sessions([log(0.0), log(24.0, first_ns=0), log(0.5), log(0.5, first_ns=0), log(48.0)]) == (0, 2, 0, 3, 1)


@pytest.mark.parametrize(("given", "count"), [((), 0), ((0, 0, 0), 0), ((0, 1, 2), 0), ((0, 0, 1), 2)])
def test_sessions_count_where_they_say_something(given: tuple[int, ...], count: int) -> None:
    one = replace(campaign(), sessions=given)
    assert one.session_count == count
    assert one.g == campaign().g + 2 * count


@cache
def fitted() -> CampaignFit:
    """Three logs, the first two of one session; the spreads are set by hand."""
    made = replace(campaign(), sessions=(0, 0, 1))
    steady = np.array([0.002, 0.003, 0.001])
    start = estimate_campaign(campaign())
    common = np.append(start.common, np.zeros(4))
    begun = replace(start, campaign=made, common=common, spreads=Spreads((0.2,), steady, (0.5,)))
    return estimate_campaign(made, noise=start.noise, begin=begun)


def prior_covariance(made: CampaignFit) -> Floats:
    """Return the covariance of the vector of all logs and those of each, written down by hand, (g + L own, g + L own)."""
    one, spreads = made.campaign, made.spreads
    g, own, m = one.g, one.l, len(one.own)
    variance, between = spreads.conditions[0] ** 2, spreads.sessions[0] ** 2
    first = one.means.stop
    C = np.zeros((g + 3 * own, g + 3 * own))
    C[:first, :first] = np.eye(first)
    C[first:g, first:g] = between * np.eye(g - first)
    for i in range(3):
        for j in range(3):
            together = one.sessions[i] == one.sessions[j]
            for k in range(m):
                C[g + i * own + k, g + j * own + k] = together * between + (i == j) * variance
        for k in range(m):
            column = first + one.sessions[i] * m + k
            C[g + i * own + k, column] = C[column, g + i * own + k] = between
        C[g + i * own + m : g + (i + 1) * own, g + i * own + m : g + (i + 1) * own] = np.diag(spreads.steady**2)
    return C


def stacked(made: CampaignFit) -> tuple[Floats, Floats]:
    """Return the whitened gaps of all logs and their slopes by all vectors one after another."""
    g, own = made.campaign.g, made.campaign.l
    rows = []
    for i, part in enumerate(made.parts):
        J = part.slopes.reshape(-1, g + own)
        wide = np.zeros((len(J), g + 3 * own))
        wide[:, :g], wide[:, g + i * own : g + (i + 1) * own] = J[:, :g], J[:, g:]
        rows.append(wide)
    return np.concatenate([part.gaps.ravel() for part in made.parts]), np.concatenate(rows)


@pytest.mark.slow
def test_the_posterior_is_that_of_all_vectors_at_once() -> None:
    """An independent way to it: one Gaussian prior over everything, and its regression on all gaps."""
    made = fitted()
    g, own = made.campaign.g, made.campaign.l
    (w, J), C = stacked(made), prior_covariance(made)
    information = J.T @ J
    posterior = np.linalg.inv(np.linalg.inv(C) + information)
    for i in range(3):
        rows = np.r_[:g, g + i * own : g + (i + 1) * own]
        assert made.covariance(i) == pytest.approx(posterior[np.ix_(rows, rows)], rel=1e-5, abs=1e-7)
    # A step leads to the regression's mean.
    at = np.concatenate([made.common, made.own.ravel()])
    move = -posterior @ (J.T @ w + np.linalg.solve(C, at))
    step, each = made.normal.step(made.common)
    assert np.concatenate([step, each.ravel()]) == pytest.approx(move, rel=1e-4, abs=1e-7)
    # The evidence is Laplace's, with the determinants of everything at once.
    marginal = np.eye(len(C)) + C @ information
    squares = float(w @ w + at @ np.linalg.solve(C, at))
    rarity = sum(one.log_alternatives for one in made.campaign.conditions)
    expected = -0.5 * squares - 0.5 * float(np.linalg.slogdet(marginal)[1]) - rarity
    assert made.evidence == pytest.approx(expected, abs=1e-3)


@pytest.mark.slow
def test_logs_of_one_session_have_one_weather() -> None:
    """Of a log of seconds the wind is that of its session, and not the mean of all logs."""
    every = campaign((FIRST, FIRST, SECOND)).members
    turned = campaign((SECOND, SECOND, SECOND)).members
    few = replace(
        every[0].windows, starts=every[0].windows.starts[:3], runs=((0, 3),), measured=every[0].windows.measured[:3]
    )
    members = (every[0], every[1], turned[0], every[2], replace(every[0], windows=few))
    whole = replace(campaign(), members=members)
    apart, one = (estimate_campaign(replace(whole, sessions=given)) for given in ((0, 0, 1, 1, 0), ()))
    (near, narrow), (far, wide) = apart.condition(4, 0), one.condition(4, 0)
    assert np.abs(near - FIRST).max() < 0.7
    assert np.linalg.norm(near - FIRST) < np.linalg.norm(far - FIRST)
    assert np.trace(narrow) < 0.5 * np.trace(wide)
    assert apart.evidence > one.evidence
    (between,), (within,) = apart.spreads.sessions, apart.spreads.conditions
    assert between > 2.0 * within
    for i, wind in enumerate((FIRST, FIRST, SECOND, SECOND)):
        value, covariance = apart.condition(i, 0)
        assert (np.abs(value - wind) < 3.0 * np.sqrt(np.diag(covariance))).all()


@pytest.mark.slow
def test_sessions_that_differ_no_more_than_logs_change_little() -> None:
    made, plain = estimate_campaign(replace(campaign(), sessions=(0, 1, 1))), estimate_campaign(campaign())
    for i in range(len(WINDS)):
        assert made.condition(i, 0)[0] == pytest.approx(plain.condition(i, 0)[0], abs=0.15)


def test_a_campaign_without_dates_is_as_it_was() -> None:
    plain: Campaign = campaign()
    assert plain.sessions == ()
    believed = plain.own_belief(0, Spreads((0.5,), np.ones(3)))
    assert not believed[:, : plain.g].any()
    assert (plain.common_precision(Spreads((0.5,), np.ones(3))) == 1.0).all()


@pytest.mark.slow
def test_a_log_that_is_held_out_whole_is_not_charged_with_what_nobody_knows() -> None:
    """A log of seconds on a day of its own: what its wind may be widens its prediction, and is no error of it."""
    rng = np.random.default_rng(3)
    of_day, other = campaign((FIRST, FIRST, FIRST)).members, campaign((SECOND, SECOND, SECOND)).members[1]
    seconds = replace(
        other.windows, starts=other.windows.starts[:3], runs=((0, 3),), measured=other.windows.measured[:3]
    )

    def noisy(member: Member) -> Member:
        measured = member.windows.measured
        noise = 0.3 * measured.std(axis=0) * rng.standard_normal(measured.shape)
        return replace(member, windows=replace(member.windows, measured=measured + noise))

    members = tuple(noisy(one) for one in (*of_day, replace(other, windows=seconds)))
    made = estimate_campaign(replace(campaign(), members=members, sessions=(0, 0, 0, 1)))
    none = estimate_campaign(without_conditions(made.campaign), noise=made.noise)
    with_it, without = held_out_loss(made), held_out_loss(none)
    gains = with_it.gain(without)
    # Its squared errors alone would take eleven.
    assert gains[with_it.log == 3].sum() > -4.0
    assert Gain.of(gains).low > 0.0
