"""What is worked out with logs of sessions eliminated one by one, beside a regression on everything at once."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import exp

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from ferryid.diagnose.inference.campaign_course import _changes, _Knots, estimate_courses
from ferryid.diagnose.inference.campaign_estimation import CampaignFit, LogPart, bare_campaign
from ferryid.diagnose.inference.campaign_properties import _gaps_and_slopes, _linearised, with_property
from ferryid.diagnose.inference.candidate import Candidate
from ferryid.diagnose.inference.group_differences import SCATTERS, _averaged, _gram, _slopes, in_groups
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.campaign_evidence import _left, held_out_blocks, held_out_loss
from ferryid.diagnose.judging.campaign_split import _Logs
from ferryid.diagnose.judging.credibility import felt
from ferryid.effects import effects
from ferryid.effects.effect import Turbulence
from ferryid.types import Floats
from tests.diagnose.inference.test_campaign_estimation import FERRY
from tests.diagnose.inference.test_sessions import fitted, prior_covariance, stacked

pytestmark = pytest.mark.slow

FIRST = Candidate.of(effects()["thruster_gain"], "thruster1", FERRY)


@cache
def noisy() -> CampaignFit:
    """The logs away from where their estimate settles, with so much noise that what is believed counts."""
    made, rng, louder = fitted(), np.random.default_rng(2), 30.0
    parts = tuple(
        LogPart(one.gaps / louder + rng.standard_normal(one.gaps.shape), one.slopes / louder) for one in made.parts
    )
    return replace(made, parts=parts, noise=replace(made.noise, scale=louder * made.noise.scale))


class Regression:
    """A linear Gaussian model of gaps: w + J x with x from N(-at, C)."""

    def __init__(self, w: Floats, J: Floats, at: Floats, C: Floats) -> None:
        information = J.T @ J
        self.covariance = np.linalg.inv(np.linalg.inv(C) + information)
        self.move = -self.covariance @ (J.T @ w + np.linalg.solve(C, at))
        left, there = w + J @ self.move, at + self.move
        self.squares = float(left @ left + there @ np.linalg.solve(C, there))
        self.evidence = -0.5 * self.squares - 0.5 * float(np.linalg.slogdet(np.eye(len(C)) + C @ information)[1])


def here(made: CampaignFit) -> tuple[Floats, Floats, Floats, Floats]:
    (w, J), at = stacked(made), np.concatenate([made.common, made.own.ravel()])
    return w, J, at, prior_covariance(made)


def wider(C: Floats, more: Floats) -> Floats:
    both = np.zeros((len(C) + len(more),) * 2)
    both[: len(C), : len(C)], both[len(C) :, len(C) :] = C, more
    return both


def rows_of(made: CampaignFit, i: int) -> slice:
    sizes = [part.gaps.size for part in made.parts]
    return slice(sum(sizes[:i]), sum(sizes[: i + 1]))


def test_courses() -> None:
    made, turbulence = noisy(), Turbulence(0.0, 0.5, 60.0)
    campaign, g, own = made.campaign, made.campaign.g, made.campaign.l
    rows = [0, 1]
    w, J, at, C = here(made)
    speed = float(np.mean([np.hypot(*made.condition(i, 0)[0]) for i in range(3)]))
    time_constant_s, std = turbulence.time_constant_s(speed), turbulence.std(speed)
    size = np.array([campaign.own[j][1].size for j in rows])
    starts, knots = [], []
    for i in range(3):
        windows = campaign.members[i].windows
        one = _Knots.of(windows, time_constant_s)
        white = made.noise.white(i, windows.along_vessel(_changes(made, i, rows, one)), windows.runs)
        columns = np.zeros((len(J), white.shape[2]))
        columns[rows_of(made, i)] = white.reshape(-1, white.shape[2])
        starts.append(J.shape[1])
        knots.append(one)
        J, at = np.hstack([J, columns]), np.append(at, np.zeros(white.shape[2]))
        C = wider(C, np.kron(np.linalg.inv(one.precision(time_constant_s)), np.diag((std / size) ** 2)))
    once = Regression(w, J, at, C)
    factor = INFERENCE.posterior_factor**2 * max(1.0, made.disagreement)
    for i, course in enumerate(estimate_courses(made, 0, turbulence)):
        for q, name in enumerate(("north", "east")):
            pick = np.zeros((len(knots[i].t), len(at)))
            pick[:, campaign.means.start + q] = pick[:, g + i * own + q] = size[q]
            for k in range(len(pick)):
                pick[k, starts[i] + 2 * k + q] = size[q]
            expected = pick @ (at + once.move)
            assert course.value[name] == pytest.approx(expected, rel=1e-5, abs=1e-6)
            error = np.sqrt(factor * np.einsum("ka,ab,kb->k", pick, once.covariance, pick))
            assert course.std[name] == pytest.approx(error, rel=1e-4)
            usable = campaign.members[i].windows.measurements.usable
            mean = np.asarray(knots[i].parts[usable].mean(axis=0)).ravel() @ expected
            assert course.mean[q] == pytest.approx(mean, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_what_a_property_promises(share: float) -> None:
    made, candidate = noisy(), FIRST
    w, J, at, C = here(made)
    begun = with_property(made, candidate, share)
    place, q = made.campaign.means.start, len(candidate.parameters)
    white = [
        made.noise.white(i, one, made.campaign.members[i].windows.runs).reshape(-1, 1 + q)
        for i, one in enumerate(_gaps_and_slopes(begun, range(place, place + q)))
    ]
    both = np.concatenate(white)
    first = begun.common[place : place + q]
    with_it = Regression(both[:, 0], np.hstack([J, both[:, 1:]]), np.append(at, first), wider(C, np.eye(q)))
    gain = with_it.evidence - Regression(w, J, at, C).evidence - candidate.log_alternatives
    assert _linearised(made, candidate, share).gain == pytest.approx(gain, abs=1e-3)


def test_a_difference_between_groups_with_its_scatter() -> None:
    made = noisy()
    made = replace(made, campaign=in_groups(made.campaign, ["A", "B", "B"]))
    candidate, acts = replace(FIRST, group="B"), (False, True, True)
    slopes = _slopes(made, candidate, np.zeros(1))
    grams = [_gram(made, i, one, acts[i]) for i, one in enumerate(slopes)]
    found, without = _averaged(made, grams, 1, True), _averaged(made, grams, 1, False)
    w, J, at, C = here(made)
    each = np.zeros((len(J), 3))
    for i, one in enumerate(slopes):
        each[rows_of(made, i), i] = one.ravel()
    J_two = np.hstack([J, each @ np.array(acts, dtype=float)[:, None], each])
    plain = Regression(w, J, at, C)

    def scattered(s: float, difference: bool) -> Regression:
        kept = np.ones(J_two.shape[1], dtype=bool)
        kept[J.shape[1]] = difference
        if s == 0.0:
            kept[J.shape[1] + 1 :] = False
        whole = wider(C, np.diag([1.0, *(3 * [s**2])]))
        return Regression(w, J_two[:, kept], np.append(at, np.zeros(4))[kept], whole[np.ix_(kept, kept)])

    steady = scattered(0.0, True)
    assert found.steady - without.steady == pytest.approx(steady.evidence - plain.evidence, abs=1e-3)
    rare = exp(-INFERENCE.prior_odds)
    priors = {0.0: 1.0 - rare, **dict.fromkeys(SCATTERS, rare / len(SCATTERS))}
    for mine, difference in ((found, True), (without, False)):
        every = [scattered(s, difference) for s in priors]
        weights = np.log(list(priors.values())) + [one.evidence for one in every]
        evidence = float(np.logaddexp.reduce(weights))
        assert mine.evidence - mine.steady == pytest.approx(evidence - every[0].evidence, abs=1e-3)
        if difference:
            share = np.exp(weights - evidence)
            moves = np.array([one.move[J.shape[1]] for one in every])
            assert mine.shift[0] == pytest.approx(share @ moves, rel=1e-4, abs=1e-6)
            variances = np.array([one.covariance[J.shape[1], J.shape[1]] for one in every])
            expected = share @ (variances + (moves - share @ moves) ** 2)
            assert mine.variance[0] == pytest.approx(expected, rel=1e-4)


def test_held_out_blocks_by_a_hull_of_other_logs() -> None:
    made = noisy()
    w, J, at, C = here(made)
    logs = _Logs(made)
    for i in range(3):
        squares, _ = logs._held_out(i, np.flatnonzero(np.arange(3) != i), 1.0)
        start = rows_of(made, i).start
        for block, (shown, near) in enumerate(held_out_blocks(made.campaign.members[i].windows)):
            kept = np.ones(len(J), dtype=bool)
            kept[start + 3 * near.start : start + 3 * near.stop] = False
            move = Regression(w[kept], J[kept], at, C).move
            rows = slice(start + 3 * shown.start, start + 3 * shown.stop)
            left = w[rows] + J[rows] @ move
            assert squares[block] == pytest.approx(float(left @ left), rel=1e-4)


def test_what_an_estimate_leaves_of_other_signals() -> None:
    made = noisy()
    _, J, at, C = here(made)
    winds = slice(made.campaign.g, made.campaign.g + 2)
    signals = [part.slopes[:, :, winds] @ [1.0 + i, -2.0] for i, part in enumerate(made.parts)]
    once = Regression(np.concatenate([one.ravel() for one in signals]), J, np.zeros(len(at)), C)
    assert _left(made, signals) == pytest.approx(once.squares, rel=1e-6)


def test_a_hull_without_one_log() -> None:
    made = fitted()
    w, J, at, C = here(made)
    h = len(made.campaign.hull.mean)
    for i in range(3):
        kept = np.ones(len(J), dtype=bool)
        kept[rows_of(made, i)] = False
        move = Regression(w[kept], J[kept], at, C).move
        expected = made.campaign.hull.mean + made.campaign.hull.root @ (at + move)[:h]
        mean, _ = made.belief(i)
        assert np.abs(mean - expected) / np.maximum(made.campaign.hull.spread, 1e-9) == pytest.approx(0.0, abs=0.02)


def test_what_is_felt_of_a_condition_has_its_session_in_it() -> None:
    made = fitted()
    common, own = made.common.copy(), made.own.copy()
    common[made.campaign.means], own[:, :2] = 0.0, 0.0
    shares = felt(made, common, own)
    still, hull = bare_campaign(made.campaign), made.common[: len(made.campaign.hull.mean)]
    for i, member in enumerate(made.campaign.members):
        difference = made.campaign.gap(i, made.common, made.own[i]) - still.gap(i, hull, made.own[i, 2:])
        measured = member.windows.along_vessel(member.windows.measured[:, member.windows.channels])
        assert shares[i] == pytest.approx(np.sqrt(np.mean(difference**2, axis=0) / np.mean(measured**2, axis=0)))


def at_its_optimum(made: CampaignFit) -> CampaignFit:
    """Return an estimate after a step, its gaps being linear."""
    step, own = made.normal.step(made.common)
    parts = tuple(
        replace(part, gaps=part.gaps + part.slopes @ np.concatenate([step, mine]))
        for part, mine in zip(made.parts, own, strict=True)
    )
    return replace(made, common=made.common + step, own=made.own + own, parts=parts)


def test_the_density_that_the_rest_predicts_of_a_block() -> None:
    made = at_its_optimum(noisy())
    w, J, at, C = here(made)
    loss = held_out_loss(made)
    for i in range(3):
        start, mine = rows_of(made, i).start, loss.blocks[loss.log == i]
        for block, (shown, near) in enumerate(held_out_blocks(made.campaign.members[i].windows)):
            kept = np.ones(len(J), dtype=bool)
            kept[start + 3 * near.start : start + 3 * near.stop] = False
            rest, rows = Regression(w[kept], J[kept], at, C), slice(start + 3 * shown.start, start + 3 * shown.stop)
            predicted = multivariate_normal(
                -J[rows] @ rest.move, np.eye(rows.stop - rows.start) + J[rows] @ rest.covariance @ J[rows].T
            )
            constant = (rows.stop - rows.start) * np.log(2.0 * np.pi)
            assert mine[block] == pytest.approx(-2.0 * predicted.logpdf(w[rows]) - constant, rel=1e-4)
