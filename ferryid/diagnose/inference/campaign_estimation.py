"""Logs of one vessel, estimated together: one hull, properties that all share, and conditions that each log has of its own.

Where a profile has no hull model, one log has to tell the hull's forces and the environment's apart by itself, and often
cannot: a steady wind on a log with few headings looks like lift and drag. The hull is the same in every log of a vessel, while
wind and current are not. So everything is estimated at once, by Gauss-Newton steps with each log's own part eliminated:

- the hull's coefficients, with the drag of drift and turning (surge forces with v r and v v) that a hull which lifts pays;
- what is the vessel's beside them, such as factors on its wind load;
- conditions of every log, as random effects about a mean of all: logs of one campaign blow in one weather;
- how those of each session depart from that mean: logs that are near in time are more alike;
- a steady acceleration of every log along the vessel's axes, another random effect: what trim, thrust curves and formulas are
  off in the manoeuvres of one log is in none of the others, and must not become its wind.

The spread of each kind of random effect between logs is estimated too (Laird and Ware 1982), so that conditions that all logs
agree on are believed, and one that the logs hardly determine takes after the others. Gaps are weighed along the vessel's axes,
on which forces act, by coloured noise that is of one colour in all logs and louder in some.

References
----------
Fossen (2021), section 6.5, for cross-flow drag and lift; Laird and Ware (1982), Random-effects models for longitudinal data;
Gelman et al. (2013), Bayesian Data Analysis, chapter 5, for parameters that groups of data share, and groups of groups.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ferryid.cached import cached_property
from ferryid.diagnose.inference.campaign_model import Campaign, Spreads
from ferryid.diagnose.inference.coloured_noise import ColouredNoise, Runs, fit_coloured_noise
from ferryid.diagnose.inference.force_errors import mass_of
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects.force_model import ForceModel
from ferryid.side_by_side import over
from ferryid.types import Floats

ROUNDS = 20
"""Most rounds: a Gauss-Newton step each, with the noise and the spreads that the one before left."""
SETTLED, CONVERGED_GAIN = 0.05, 0.05
"""Change of every spread, as a share of it, and gain of a step below which the rounds end."""
RELAXATION = 1.8
"""Factor on the logarithm of a spread's change: expectation and maximisation approach their end slowly, and from one side."""
KEPT_SLOPES = 0.02
"""Longest step of a hull's coefficient, in spreads, after which the slopes of the step before still serve."""
STARTS, BEARINGS = (0.25, 0.6, 1.25), 8
"""Conditions from which a search begins besides none: lengths in sizes, and directions; a wind has no slope at rest."""
STEADY_SHARE = 0.1
"""Of the gaps, in the root mean square: spread of the steady accelerations to begin with."""
SEARCHES, CLEARLY_BETTER = 2, 1.0
"""Most searches for better conditions once an estimate has settled, and what they must gain for a log [nat]."""
HALVINGS = (1.0, 0.5, 0.25, 0.1)
SCALE_ROUNDS, SCALE_GAPS = 3, 30.0
"""Rounds in which colour and loudness of the noise are found, and how many gaps the belief counts for that all are as loud."""


@dataclass(frozen=True)
class CampaignNoise:
    """What is left over: its colour in all logs, and how loud it is in each, shape (L,), about one."""

    colour: ColouredNoise
    scale: Floats

    def white(self, i: int, gaps: Floats, runs: Runs) -> Floats:
        """Return whitened gaps of a log, (J, 3) or (J, 3, q)."""
        return self.colour.white(gaps, runs) / float(self.scale[i])


@dataclass(frozen=True)
class LogPart:
    """One log at the estimate, whitened: its gaps, shape (J, 3), and their derivatives, shape (J, 3, g + l)."""

    gaps: Floats
    slopes: Floats


@dataclass(frozen=True)
class CampaignFit:
    """What several logs say together.

    Attributes
    ----------
    campaign
        What was estimated.
    common, own
        The estimate: the vector of all logs, shape (g,), and of each, shape (L, l).
    spreads
        Between logs.
    noise
        What is left over along the vessel's axes.
    parts
        The logs at the estimate.
    """

    campaign: Campaign
    common: Floats
    own: Floats
    spreads: Spreads
    noise: CampaignNoise
    parts: tuple[LogPart, ...]

    @cached_property
    def normal(self) -> _Eliminated:
        """Normal equations with the logs' own parts eliminated."""
        return _Eliminated.of(self)

    def covariance(self, i: int) -> Floats:
        """Return the posterior covariance of both vectors of a log, shape (g + l, g + l)."""
        return self.normal.covariance(i)

    @cached_property
    def disagreement(self) -> float:
        """Variance with which the logs differ about what they share, over what their noise explains; 1 where the model holds.

        A log's gradient at the common estimate has its normal matrix as covariance if nothing but noise sets it apart.
        """
        apart, expected, logs = 0.0, 0.0, len(self.parts)
        # A session's departures are not what all logs share.
        shared = self.campaign.means.stop
        matrices, slopes = self.normal.matrices[:, :shared, :shared], self.normal.slopes[:, :shared]
        inverses = np.linalg.inv(matrices + np.eye(shared))
        for H, slope, inverse in zip(matrices, slopes, inverses, strict=True):
            apart += float(slope @ inverse @ slope)
            expected += float(np.sum(H * inverse.T))
        return apart / max(expected * (1.0 - 1.0 / logs), 1e-12) if logs > 1 else 1.0

    def belief(self, without: int | None = None) -> tuple[Floats, Floats]:
        """Return mean, shape (h,), and covariance, shape (h, h), of the hull in the units of its coefficients.

        Parameters
        ----------
        without
            The log that has no part in it; None for what all logs say.
        """
        prior, h = np.diag(self.normal.prior), len(self.campaign.hull.mean)
        A, z = prior + np.sum(self.normal.matrices, axis=0), self.common
        if without is not None:
            # At the optimum all gradients and the prior's cancel, so that without one log its own is what is missing.
            A = A - self.normal.matrices[without]
            z = z + np.linalg.solve(A, self.normal.slopes[without])
        # Logs that differ by more than noise know less of the hull than their noise says, but never less than before.
        known = prior + (A - prior) / max(1.0, self.disagreement)
        root = self.campaign.hull.root
        return self.campaign.hull.mean + root @ z[:h], root @ np.linalg.inv(known)[:h, :h] @ root.T

    def condition(self, i: int, k: int) -> tuple[Floats, Floats]:
        """Return what a log has of a condition, in its unit, and the covariance that is reported of it, shapes (q,) and (q, q).

        The covariance is as much wider as logs differ by more than their noise, and as estimates are elsewhere.
        """
        campaign = self.campaign
        rows = _rows(campaign, k)
        parameters = [campaign.own[j][1] for j in rows]
        mean, size = self.common[campaign.means][rows], np.array([one.size for one in parameters])
        neutral = np.array([one.neutral for one in parameters])
        pick = np.zeros((len(rows), campaign.g + campaign.l))
        for row, j in enumerate(rows):
            pick[row, campaign.means.start + j] = pick[row, campaign.g + j] = size[row]
        factor = INFERENCE.posterior_factor**2 * max(1.0, self.disagreement)
        return neutral + size * (mean + self.own[i, rows]), factor * pick @ self.covariance(i) @ pick.T

    def own_belief(self, i: int) -> Floats:
        """Return what is believed of the vector of a log as equations, shape (l, g + l)."""
        return self.campaign.own_belief(i, self.spreads)

    def own_gradient(self, i: int) -> Floats:
        """Return the slope of half their squared errors by both vectors, shape (g + l,)."""
        equations = self.own_belief(i)
        return np.asarray(equations.T @ (equations @ np.concatenate([self.common, self.own[i]])))

    def force_model(self, i: int) -> ForceModel:
        """Return a log's force model at the estimate."""
        return self.campaign.force_model(i, self.common, self.own[i])

    def whole_force_model(self, i: int) -> ForceModel:
        """Return a log's force model at the estimate, with its steady acceleration as a force."""
        force_model = self.force_model(i)
        steady = mass_of(force_model.hull) @ self.own[i, -3:]
        return replace(force_model, external=force_model.external + steady)

    @property
    def cost(self) -> float:
        """Squares of the whitened gaps and of what is estimated in units of its belief: twice the negative log posterior."""
        squares = [float(np.sum(part.gaps**2)) for part in self.parts]
        return believed_squares(self.campaign, self.spreads, self.common, self.own) + sum(squares)

    @property
    def evidence(self) -> float:
        """Logarithm of the evidence (Laplace), but for what only the noise decides."""
        precision = self.campaign.own_precision(self.spreads)
        logarithm = float(np.sum(np.linalg.slogdet(self.normal.own)[1] - np.sum(np.log(precision))))
        prior = self.normal.prior
        logarithm += float(np.linalg.slogdet(np.diag(prior) + np.sum(self.normal.matrices, axis=0))[1])
        logarithm -= float(np.sum(np.log(prior)))
        rarity = sum(one.log_alternatives for one in (*self.campaign.conditions, *self.campaign.properties))
        return -0.5 * self.cost - 0.5 * logarithm - rarity


@dataclass(frozen=True)
class _Eliminated:
    """Normal equations of all logs: of the common vector with each log's own eliminated, and what gives the own back.

    Attributes
    ----------
    matrices, slopes
        By log: what it says of the common vector, shapes (L, g, g) and (L, g).
    own, back
        By log: its own normal matrix, shape (L, l, l), and how its own vector follows the common one, shape (L, l, g).
    own_slopes
        By log, shape (L, l).
    prior
        What is believed of the common vector: inverse variances about zero, shape (g,).
    """

    matrices: Floats
    slopes: Floats
    own: Floats
    back: Floats
    own_slopes: Floats
    prior: Floats

    @classmethod
    def of(cls, made: CampaignFit) -> _Eliminated:
        g = made.campaign.g
        # Logs are of many lengths, their normal equations of one size.
        flat = [part.slopes.reshape(-1, part.slopes.shape[2]) for part in made.parts]
        believed = np.stack([made.own_belief(i) for i in range(len(flat))])
        N = np.stack([J.T @ J for J in flat]) + np.swapaxes(believed, 1, 2) @ believed
        b = np.stack([J.T @ part.gaps.ravel() for J, part in zip(flat, made.parts, strict=True)])
        b += np.stack([made.own_gradient(i) for i in range(len(flat))])
        Q, gradient = N[:, g:, g:], b[:, g:]
        back = np.asarray(np.linalg.solve(Q, N[:, g:, :g]), dtype=np.float64)
        matrices = N[:, :g, :g] - N[:, :g, g:] @ back
        slopes = b[:, :g] - np.einsum("ilg,il->ig", back, gradient)
        return cls(matrices, slopes, Q, back, gradient, made.campaign.common_precision(made.spreads))

    @cached_property
    def common_covariance(self) -> Floats:
        """Posterior covariance of the common vector, shape (g, g)."""
        A = np.diag(self.prior) + np.sum(self.matrices, axis=0)
        return np.asarray(np.linalg.inv(A), dtype=np.float64)

    @cached_property
    def own_covariances(self) -> Floats:
        """Posterior covariances of the logs' own vectors, shape (L, l, l)."""
        back = self.back
        return np.asarray(np.linalg.inv(self.own) + back @ self.common_covariance @ np.swapaxes(back, 1, 2))

    def covariance(self, i: int) -> Floats:
        """Return the posterior covariance of the common vector and that of a log, shape (g + l, g + l)."""
        C = self.common_covariance
        across = -C @ self.back[i].T
        return np.block([[C, across], [across.T, self.own_covariances[i]]])

    def step(self, common: Floats) -> tuple[Floats, Floats]:
        """Return the Gauss-Newton step of the common vector and of each log's own, shapes (g,) and (L, l)."""
        A = np.diag(self.prior) + np.sum(self.matrices, axis=0)
        step = -np.linalg.solve(A, self.prior * common + np.sum(self.slopes, axis=0))
        return step, -np.linalg.solve(self.own, self.own_slopes[:, :, None])[:, :, 0] - self.back @ step


def believed_squares(campaign: Campaign, spreads: Spreads, common: Floats, own: Floats) -> float:
    """Return the squares of both vectors in units of what is believed of them, those of all logs, shape (L, l)."""
    away = own.copy()
    for i, session in enumerate(campaign.sessions if campaign.session_count else ()):
        away[i, : len(campaign.own)] -= common[campaign.session_rows(session)]
    shared = campaign.common_precision(spreads) @ common**2
    return float(shared + np.sum(away**2 @ campaign.own_precision(spreads)))


def estimate_campaign(
    campaign: Campaign,
    *,
    noise: CampaignNoise | None = None,
    begin: CampaignFit | None = None,
    bare: CampaignFit | None = None,
) -> CampaignFit:
    """Estimate what several logs say together.

    Parameters
    ----------
    campaign
        The logs, and what they are believed to have.
    noise
        What is left over; estimated where None. Two hypotheses are compared under one noise.
    begin
        An estimate of the same conditions and properties, to begin with and to take the spreads from.
    bare
        The estimate of `bare_campaign`, from which a search for conditions begins; made where None.
    """
    if begin is not None:
        at = _point(campaign, begin.common, begin.own)
        return _settled(campaign, at, begin.spreads, noise, known_spreads=True)
    spreads, at = _first(campaign, bare)
    made = _settled(campaign, at, spreads, noise)
    for _ in range(SEARCHES):
        own = _elsewhere(made) if campaign.own else None
        if own is None:
            break
        # Two estimates are compared under one noise.
        again = _settled(campaign, _point(campaign, made.common, own), made.spreads, made.noise)
        if again.evidence <= made.evidence:
            break
        made = again
        if noise is None:
            made = _settled(campaign, _point(campaign, made.common, made.own), made.spreads, None)
    return made


def _settled(
    campaign: Campaign, at: _Point, spreads: Spreads, noise: CampaignNoise | None, *, known_spreads: bool = False
) -> CampaignFit:
    """Return the estimate to which Gauss-Newton steps lead, with the spreads and the noise that follow from them."""
    made = _fit(campaign, at, noise or _noise(campaign, at.gaps), spreads)
    for _ in range(ROUNDS):
        at, gained = _step(made, at)
        change = 0.0
        if not known_spreads:
            spreads, change = _spreads(made, at)
        made = _fit(campaign, at, noise or _noise(campaign, at.gaps), spreads)
        if change < SETTLED and gained < CONVERGED_GAIN:
            break
    return made


def _elsewhere(made: CampaignFit) -> Floats | None:
    """Return the logs' own vectors, shape (L, l), with conditions that explain clearly more than where the steps have led.

    The load of a wind has one slope on either side of none, so that steps may settle on the wrong one. Every log tries other
    directions and lengths of each of its conditions, while what is common may move as far as the other logs let it. None where
    no log finds better.
    """
    campaign, tried = made.campaign, list[_Tried]()
    for k in range(len(campaign.conditions)):
        rows = _rows(campaign, k)
        mean = made.common[campaign.means][rows]
        tried.append(_Tried.of(campaign, rows, made.common, made.own, [start - mean for start in _starts()]))
    found = over(lambda i: _better(made, i, tried), range(len(made.own)))
    return (
        None
        if all(one is None for one in found)
        else np.stack([mine if one is None else one for mine, one in zip(made.own, found, strict=True)])
    )


@dataclass(frozen=True)
class _Tried:
    """A condition of every log at several values: the rows of a log's own vector, the vectors, and the gaps with them.

    Vectors have the shape (starts, L, l), the gaps of each log (J, 3, starts).
    """

    rows: list[int]
    own: Floats
    gaps: list[Floats]

    @classmethod
    def of(cls, campaign: Campaign, rows: list[int], common: Floats, own: Floats, starts: Sequence[Floats]) -> _Tried:
        every = np.repeat(own[None], len(starts), axis=0)
        every[:, :, rows] = np.stack(starts)[:, None]
        gaps = zip(*(campaign.gaps(common, one) for one in every), strict=True)
        return cls(rows, every, [np.stack(one, axis=2) for one in gaps])

    def white(self, noise: CampaignNoise, i: int, runs: Runs) -> Floats:
        """Return the whitened gaps of a log, shape (3 J, starts)."""
        gaps = self.gaps[i]
        return noise.white(i, gaps, runs).reshape(-1, gaps.shape[2])


def _rows(campaign: Campaign, k: int) -> list[int]:
    """Return which rows of a log's own vector a condition has."""
    return [j for j, (of, _) in enumerate(campaign.own) if of == k]


def _better(made: CampaignFit, i: int, tried: Sequence[_Tried]) -> Floats | None:
    """Return the own vector of a log with conditions that explain clearly more than its present ones; None without such."""
    campaign, part, g = made.campaign, made.parts[i], made.campaign.g
    runs = campaign.members[i].windows.runs
    believed = made.own_belief(i)
    J, w = part.slopes.reshape(-1, part.slopes.shape[2]), part.gaps.ravel()
    # The other logs' say in what is common; at the optimum their slopes are those of this log with the other sign.
    others = np.diag(made.normal.prior) + np.sum(made.normal.matrices, axis=0) - made.normal.matrices[i]
    H = J.T @ J + believed.T @ believed
    H[:g, :g] += others
    here = np.concatenate([made.common, made.own[i]])
    now = float(w @ w + np.sum((believed @ here) ** 2))
    best, least = None, now - 2.0 * CLEARLY_BETTER
    for one in tried:
        kept = np.ones(len(H), dtype=bool)
        kept[[campaign.means.start + j for j in one.rows]] = kept[[g + j for j in one.rows]] = False
        # A session stays where it is while one of its logs is moved.
        kept[campaign.means.stop : g] = False
        factor = cho_factor(H[np.ix_(kept, kept)])
        left = one.white(made.noise, i, runs)
        slope = J[:, kept].T @ (left - w[:, None])
        away = np.hstack([np.tile(made.common, (len(one.own), 1)), one.own[:, i]]) @ believed.T
        cost = np.sum(left**2, axis=0) + np.sum(away**2, axis=1)
        cost -= np.sum(slope * cho_solve(factor, slope), axis=0)
        nearest = int(np.argmin(cost))
        if cost[nearest] < least:
            best, least = one.own[nearest, i], float(cost[nearest])
    return best


def _starts() -> list[Floats]:
    """Return conditions from which a search begins, in sizes: none, and some lengths in every direction."""
    angles = np.arange(BEARINGS) * 2.0 * np.pi / BEARINGS
    return [np.zeros(2), *(length * np.array([np.cos(one), np.sin(one)]) for length in STARTS for one in angles)]


@dataclass(frozen=True)
class _Point:
    """Where the logs are linearised: both vectors, and of each log gaps, shape (J, 3), and slopes, shape (J, 3, g + l).

    The hull's slopes are kept for steps that are short: the gaps are all but linear in it.
    """

    common: Floats
    own: Floats
    gaps: list[Floats]
    slopes: list[Floats]
    hull: list[Floats]


def _point(campaign: Campaign, common: Floats, own: Floats, hull: list[Floats] | None = None) -> _Point:
    kept = campaign.hull_slopes(common, own) if hull is None else hull
    gaps, slopes = zip(*campaign.linearised(common, own, kept), strict=True)
    return _Point(common, own, list(gaps), list(slopes), kept)


def _fit(campaign: Campaign, at: _Point, noise: CampaignNoise, spreads: Spreads) -> CampaignFit:
    def part(i: int) -> LogPart:
        runs = campaign.members[i].windows.runs
        return LogPart(noise.white(i, at.gaps[i], runs), noise.white(i, at.slopes[i], runs))

    parts = tuple(over(part, range(len(campaign.members))))
    return CampaignFit(campaign, at.common, at.own, spreads, noise, parts)


def _step(made: CampaignFit, at: _Point) -> tuple[_Point, float]:
    """Return where a Gauss-Newton step leads, and how much it gains."""
    campaign, noise = made.campaign, made.noise

    def cost(common: Floats, own: Floats, gaps: Sequence[Floats]) -> float:
        squares = [
            float(np.sum(noise.white(i, one, campaign.members[i].windows.runs) ** 2)) for i, one in enumerate(gaps)
        ]
        return believed_squares(campaign, made.spreads, common, own) + sum(squares)

    now = cost(made.common, made.own, at.gaps)
    step, own_step = made.normal.step(made.common)
    for share in HALVINGS:
        common, own = made.common + share * step, made.own + share * own_step
        there = cost(common, own, campaign.gaps(common, own))
        if there < now:
            # The gaps bend with the masses, and where a flow or a property changes how the hull's coefficients act.
            bends = any(one.effect.changes_hull for one in (*campaign.conditions, *campaign.properties))
            bends = bends or float(np.abs(share * step[: len(campaign.hull.mean)]).max()) > KEPT_SLOPES
            return _point(campaign, common, own, None if bends else at.hull), now - there
    return at, 0.0


def bare_campaign(campaign: Campaign) -> Campaign:
    """Return the logs with a hull alone, without conditions and properties."""
    return replace(campaign, members=tuple(replace(one, conditions=()) for one in campaign.members), properties=())


def _first(campaign: Campaign, bare: CampaignFit | None) -> tuple[Spreads, _Point]:
    """Return spreads and estimates to begin with: the hull without conditions, then what explains most beside it."""
    common, own = np.zeros(campaign.g), np.zeros((len(campaign.members), campaign.l))
    # Some properties, such as a dead band, have no slope where they do not act.
    begun = [0.0 if one.start is None else (one.start - one.neutral) / one.size for one in campaign.lasting]
    common[campaign.means.start - len(begun) : campaign.means.start] = begun
    gaps = np.vstack(campaign.gaps(common, own))
    steady = STEADY_SHARE * np.sqrt(np.mean(gaps**2, axis=0))
    every = (1.0,) * len(campaign.conditions)
    spreads = Spreads(every, np.maximum(steady, 1e-12), every if campaign.session_count else ())
    if not campaign.own:
        return spreads, _point(campaign, common, own)
    made = estimate_campaign(bare_campaign(campaign)) if bare is None else bare
    h = len(campaign.hull.mean)
    common[:h] = made.common[:h]
    own[:, -3:] = made.own
    spreads = replace(spreads, steady=made.spreads.steady)
    starts = _started(campaign, made, common, own)
    common[campaign.means] = starts.mean(axis=0)
    own[:, : len(campaign.own)] = starts - starts.mean(axis=0)
    return spreads, _point(campaign, common, own)


def _started(campaign: Campaign, bare: CampaignFit, common: Floats, own: Floats) -> Floats:
    """Return the conditions of every log to begin with, shape (L, own): those that explain most beside a hull and a steady
    force that may move.
    """
    g, at = bare.campaign.g, own.copy()
    precision = np.concatenate([np.ones(g), bare.campaign.own_precision(bare.spreads)])

    def costs(i: int, tried: _Tried) -> Floats:
        part = bare.parts[i]
        J = part.slopes.reshape(-1, part.slopes.shape[2])
        left = tried.white(bare.noise, i, campaign.members[i].windows.runs)
        slope = J.T @ left + (precision * np.concatenate([bare.common, bare.own[i]]))[:, None]
        solved = cho_solve(cho_factor(J.T @ J + np.diag(precision)), slope)
        away = tried.own[:, i, : len(campaign.own)]
        return np.asarray(np.sum(left**2, axis=0) + np.sum(away**2, axis=1) - np.sum(slope * solved, axis=0))

    least = np.full(len(own), np.inf)
    for k in range(len(campaign.conditions)):
        tried = _Tried.of(campaign, _rows(campaign, k), common, at, _starts())
        every = over(partial(costs, tried=tried), range(len(own)))
        for i, cost in enumerate(every):
            nearest = int(np.argmin(cost))
            if cost[nearest] < least[i]:
                at[i], least[i] = tried.own[nearest, i], cost[nearest]
    return at[:, : len(campaign.own)]


def _noise(campaign: Campaign, gaps: Sequence[Floats]) -> CampaignNoise:
    runs, count = [], 0
    for member in campaign.members:
        runs += [(first + count, end + count) for first, end in member.windows.runs]
        count += len(member.windows.starts)
    noise = CampaignNoise(fit_coloured_noise(np.vstack(gaps), runs), np.ones(len(gaps)))
    for _ in range(SCALE_ROUNDS):
        squares = [
            float(np.mean(noise.colour.white(one, member.windows.runs) ** 2))
            for one, member in zip(gaps, campaign.members, strict=True)
        ]
        sizes = np.array([one.size for one in gaps])
        scale = np.sqrt((np.array(squares) * sizes + SCALE_GAPS) / (sizes + SCALE_GAPS))
        louder = [one / each for one, each in zip(gaps, scale, strict=True)]
        noise = CampaignNoise(fit_coloured_noise(np.vstack(louder), runs), scale)
    return noise


def _spreads(made: CampaignFit, at: _Point) -> tuple[Spreads, float]:
    """Return the spreads that both vectors speak for, and their largest change.

    It is a step of expectation and maximisation, with the covariances of an estimate near by.
    """
    campaign, before = made.campaign, made.spreads
    count, m = len(campaign.own), len(campaign.conditions)
    second, between = _second_moments(made, at)
    conditions, sessions = [], []
    for k, condition in enumerate(campaign.conditions):
        rows = _rows(campaign, k)
        have = [i for i, one in enumerate(campaign.members) if condition.key in {each.key for each in one.conditions}]
        conditions.append(float(np.sqrt(np.mean(second[np.ix_(have, rows)]))))
        if campaign.session_count:
            seen = sorted({campaign.sessions[i] for i in have})
            sessions.append(float(np.sqrt(np.mean(between[np.ix_(seen, rows)]))))
    old = np.array([*before.conditions, *before.sessions, *before.steady])
    ratio = np.array([*conditions, *sessions, *np.sqrt(np.mean(second[:, count:], axis=0))]) / old
    new = old * ratio**RELAXATION
    found = Spreads(tuple(new[:m].tolist()), new[m + len(sessions) :], tuple(new[m : m + len(sessions)].tolist()))
    return found, float(np.abs(ratio - 1.0).max())


def _second_moments(made: CampaignFit, at: _Point) -> tuple[Floats, Floats]:
    """Return expected squares of the logs' own vectors about those of their sessions, shape (L, l), and of these, (S, own)."""
    campaign, normal = made.campaign, made.normal
    variances = np.diagonal(normal.own_covariances, axis1=1, axis2=2)
    if not campaign.session_count:
        return at.own**2 + variances, np.zeros((0, len(campaign.own)))
    count, away, second = len(campaign.own), at.own.copy(), variances.copy()
    C, between = normal.common_covariance, []
    for session in range(campaign.session_count):
        rows = campaign.session_rows(session)
        variance = np.diag(C[rows, rows])
        between.append(at.common[rows] ** 2 + variance)
        for i in np.flatnonzero(np.array(campaign.sessions) == session).tolist():
            away[i, :count] -= at.common[rows]
            across = -normal.back[i, :count] @ C[:, rows]
            second[i, :count] += variance - 2.0 * np.diag(across)
    return away**2 + second, np.stack(between)
