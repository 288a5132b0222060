"""One hull, several logs: what all of them say of it together, as the belief with which each of them is diagnosed.

Where a profile has no hull model, one log has to tell the hull's forces and the environment's apart by itself, and often
cannot: a steady wind on a log with few headings looks like lift and drag. The hull is the same in every log of a vessel while
wind, current and payload are not. So the hull is fitted to all logs at once, each with effects of its own, by Gauss-Newton
steps; the normal matrix of each log, its own effects partialled out, is what this log knows of the hull. Their sum without one
log is what the others know, which makes a belief for diagnosing that log that it had no part in.

Beside the coefficients of `ferryid.effects.force_model` the hull has the drag of drift and turning here: surge forces with
v r and v v, which a hull that lifts pays for it.

References
----------
Fossen (2021), section 6.5, for cross-flow drag and lift; Gelman et al. (2013), Bayesian Data Analysis,
chapter 5, for parameters that groups of data share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ferryid.diagnose.inference.autoregression import AutoregressiveNoise, fit_autoregression
from ferryid.diagnose.inference.estimation import Candidate, apply_candidates
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects.force_model import COEFFICIENTS, ForceModel
from ferryid.types import Floats

INDUCED = ("X_vr", "X_vv")
ROUNDS, STEPS = 3, 5
"""Rounds, each with the noise that the one before left, and Gauss-Newton steps in a round."""
LONGEST_STEP = 2.0
DIFFERENCE_STEP = 0.02
START_SIZE = 0.4
"""Where a search begins besides at the neutral values, in sizes: a load that grows with speed squared has no slope at rest."""


@dataclass(frozen=True)
class Member:
    """One log of a vessel: its windows, its force model without effects, and the effects that are its own."""

    windows: Windows
    plain: ForceModel
    candidates: tuple[Candidate, ...] = ()


@dataclass(frozen=True)
class CampaignHull:
    """What several logs say of one hull.

    Attributes
    ----------
    names
        `COEFFICIENTS` and `INDUCED`, h in all.
    before, spread
        What was believed before any log: mean and standard deviations, shape (h,).
    step
        Fitted values in spreads from `before`, shape (h,).
    normal, gradient
        Of each log, its own effects partialled out, in spreads; shapes (logs, h, h) and (logs, h).
    values, errors
        Parameters of each log's own effects, and their standard deviations, one array per effect.
    noise
        What was left over in all logs.
    gaps
        What was left over in each, shape (J, c).
    """

    names: tuple[str, ...]
    before: Floats
    spread: Floats
    step: Floats
    normal: Floats
    gradient: Floats
    values: tuple[tuple[Floats, ...], ...]
    errors: tuple[tuple[Floats, ...], ...]
    noise: AutoregressiveNoise
    gaps: tuple[Floats, ...]

    @property
    def disagreement(self) -> float:
        """Variance with which the logs differ about the hull, over what their noise explains; 1 where the model holds.

        A log's gradient at the common hull has its normal matrix as covariance if nothing but noise sets it apart.
        """
        apart, expected = 0.0, 0.0
        for H, g in zip(self.normal, self.gradient, strict=True):
            inverse = np.linalg.inv(H + np.eye(len(H)))
            apart += float(g @ inverse @ g)
            expected += float(np.trace(H @ inverse))
        logs = len(self.normal)
        return apart / max(expected * (1.0 - 1.0 / logs), 1e-12) if logs > 1 else 1.0

    def belief(self, without: int | None = None) -> tuple[Floats, Floats]:
        """Return mean, shape (h,), and covariance, shape (h, h), of the hull in the units of its coefficients.

        Parameters
        ----------
        without
            The log that has no part in it; None for what all logs say.
        """
        A = np.eye(len(self.step)) + self.normal.sum(axis=0)
        z = self.step
        if without is not None:
            # At the optimum all gradients and the prior's cancel, so that without one log its own is what is missing.
            A = A - self.normal[without]
            z = z + np.linalg.solve(A, self.gradient[without])
        # Logs that differ by more than noise know less of the hull than their noise says, but never less than before.
        known = np.eye(len(A)) + (A - np.eye(len(A))) / max(1.0, self.disagreement)
        return self.before + self.spread * z, np.linalg.inv(known) * np.outer(self.spread, self.spread)

    def force_model(self, plain: ForceModel, without: int | None = None) -> tuple[ForceModel, Floats]:
        """Return a log's force model with the hull that is believed in, and the standard deviations of `COEFFICIENTS`.

        The induced drag is an external force at the measured motion.
        """
        mean, covariance = self.belief(without)
        h = len(COEFFICIENTS)
        modelled = induced(replace(plain, hull=mean[:h]), mean[h:])
        return modelled, np.sqrt(np.diag(covariance))[:h]


def induced(force_model: ForceModel, coefficients: Floats) -> ForceModel:
    """Return the force model with induced drag in it, from coefficients in the order of `INDUCED`; in still water."""
    _, v, r = force_model.measurements.nu.T
    X_vr, X_vv = coefficients
    still = np.zeros_like(v)
    force = np.column_stack([(X_vr * r + X_vv * v) * v, still, still])
    return replace(force_model, external=force_model.external + force)


def induced_spread(length_m: float, draught_m: float, water_density: float = 1000.0) -> Floats:
    """Return how large the coefficients of `INDUCED` may be, shape (2,): a flat plate's."""
    plate = 0.5 * water_density * length_m * draught_m
    return np.array([plate * length_m / 2.0, plate / 2.0])


def fit_campaign_hull(members: Sequence[Member], spread: Floats, induced_size: Floats) -> CampaignHull:
    """Fit one hull to all logs, and to each the effects of its own.

    Parameters
    ----------
    members
        The logs, all of one vessel.
    spread
        Standard deviations of what is believed of `COEFFICIENTS`, about those of the first log's force model, shape (26,).
    induced_size
        Those of `INDUCED`, about zero, shape (2,).
    """
    joint = _Joint(
        members, np.concatenate([members[0].plain.hull, np.zeros(len(INDUCED))]), np.append(spread, induced_size)
    )
    z = np.zeros(len(joint.before))
    own = [np.zeros(0) for _ in members]
    empty = [replace(member, candidates=()) for member in members]
    bare = replace(joint, members=empty)
    noise = bare.noise(z, own)
    for _ in range(ROUNDS):
        z, no_own = bare.solve(z, own, noise)
        noise = bare.noise(z, no_own)
    if any(member.candidates for member in members):
        own = [joint.start(i, z, noise) for i in range(len(members))]
        for _ in range(ROUNDS):
            z, own = joint.solve(z, own, noise)
            noise = joint.noise(z, own)
    return joint.result(z, own, noise)


@dataclass(frozen=True)
class _Joint:
    """All logs with the belief about their hull; z is the hull in spreads, own[i] the effects of log i in sizes."""

    members: Sequence[Member]
    before: Floats
    spread: Floats

    def gap(self, i: int, z: Floats, own: Floats) -> Floats:
        member, h = self.members[i], len(COEFFICIENTS)
        hull = self.before + self.spread * z
        force_model = induced(replace(member.plain, hull=hull[:h]), hull[h:])
        return member.windows.gap(apply_candidates(force_model, member.candidates, self.values(i, own)))

    def values(self, i: int, own: Floats) -> tuple[Floats, ...]:
        found, first = [], 0
        for candidate in self.members[i].candidates:
            q = len(candidate.parameters)
            limits = np.array([(p.neutral, p.size, p.low, p.high) for p in candidate.parameters])
            found.append(np.clip(limits[:, 0] + limits[:, 1] * own[first : first + q], limits[:, 2], limits[:, 3]))
            first += q
        return tuple(found)

    def noise(self, z: Floats, own: Sequence[Floats]) -> AutoregressiveNoise:
        gaps, runs, count = [], [], 0
        for i, member in enumerate(self.members):
            gaps.append(self.gap(i, z, own[i]))
            runs += [(first + count, end + count) for first, end in member.windows.runs]
            count += len(member.windows.starts)
        return fit_autoregression(np.vstack(gaps), tuple(runs))

    def start(self, i: int, z: Floats, noise: AutoregressiveNoise) -> Floats:
        """Return where to begin with a log's own effects: what explains most beside a hull that may move."""
        q = sum(len(candidate.parameters) for candidate in self.members[i].candidates)
        around = product((-1.0, 0.0, 1.0), repeat=q) if q <= 3 else [*np.eye(q).tolist(), *(-np.eye(q)).tolist()]
        tried = [START_SIZE * np.array(one) for one in around]
        J = self.by_hull(i, z, tried[0], noise)
        factor = cho_factor(J.T @ J + np.eye(len(z)))
        cost = []
        for own in tried:
            w = self.white(i, z, own, noise)
            g = J.T @ w + z
            cost.append(float(w @ w + own @ own - g @ cho_solve(factor, g)))
        return tried[int(np.argmin(cost))]

    def white(self, i: int, z: Floats, own: Floats, noise: AutoregressiveNoise) -> Floats:
        return noise.white(self.gap(i, z, own), self.members[i].windows.runs)

    def by_hull(self, i: int, z: Floats, own: Floats, noise: AutoregressiveNoise) -> Floats:
        """Return the derivatives of the whitened gaps of a log by the hull, shape (w, h)."""
        w = self.white(i, z, own, noise)
        J = np.zeros((len(w), len(z)))
        for k in np.flatnonzero(self.spread > 0.0):
            moved = z.copy()
            moved[k] += DIFFERENCE_STEP
            J[:, k] = (self.white(i, moved, own, noise) - w) / DIFFERENCE_STEP
        return J

    def by_own(self, i: int, z: Floats, own: Floats, noise: AutoregressiveNoise) -> tuple[Floats, Floats]:
        """Return the whitened gaps of a log and their derivatives by its own effects, shapes (w,) and (w, q)."""
        w = self.white(i, z, own, noise)
        J = np.empty((len(w), len(own)))
        for k in range(len(own)):
            moved = own.copy()
            moved[k] += DIFFERENCE_STEP
            J[:, k] = (self.white(i, z, moved, noise) - w) / DIFFERENCE_STEP
        return w, J

    def solve(self, z: Floats, own: Sequence[Floats], noise: AutoregressiveNoise) -> tuple[Floats, list[Floats]]:
        """Return better values by Gauss-Newton steps."""
        now = list(own)
        cost = self._cost(z, now, noise)
        # The gaps are all but linear in the hull: one derivative will do for all steps.
        by_hull = [self.by_hull(i, z, mine, noise) for i, mine in enumerate(now)]
        for _ in range(STEPS):
            parts = [self._part(i, z, now[i], noise, by_hull[i]) for i in range(len(self.members))]
            A = np.eye(len(z)) + np.sum([part.normal for part in parts], axis=0)
            step = -np.linalg.solve(A, z + np.sum([part.gradient for part in parts], axis=0))
            moves = [part.own_step(step) for part in parts]
            longest = max(float(np.abs(one).max(initial=0.0)) for one in (step, *moves))
            full = min(1.0, LONGEST_STEP / max(longest, 1e-12))
            for share in (full, 0.5 * full, 0.25 * full, 0.1 * full):
                new = [one + share * move for one, move in zip(now, moves, strict=True)]
                new_cost = self._cost(z + share * step, new, noise)
                if new_cost < cost:
                    break
            else:
                break
            gained, z, now, cost = cost - new_cost, z + share * step, new, new_cost
            if gained < 1e-2:
                break
        return z, now

    def _cost(self, z: Floats, own: Sequence[Floats], noise: AutoregressiveNoise) -> float:
        logs = (float(np.sum(self.white(i, z, mine, noise) ** 2) + mine @ mine) for i, mine in enumerate(own))
        return float(z @ z) + sum(logs)

    def _part(self, i: int, z: Floats, own: Floats, noise: AutoregressiveNoise, Jh: Floats) -> _Part:
        w, Jq = self.by_own(i, z, own, noise)
        H, g = Jh.T @ Jh, Jh.T @ w
        if len(own) == 0:
            return _Part(H, g, np.zeros((0, 0)), np.zeros((0, len(z))), np.zeros(0))
        Q, cross, gq = Jq.T @ Jq + np.eye(len(own)), Jq.T @ Jh, Jq.T @ w + own
        factor = cho_factor(Q)
        return _Part(H - cross.T @ cho_solve(factor, cross), g - cross.T @ cho_solve(factor, gq), Q, cross, gq)

    def result(self, z: Floats, own: Sequence[Floats], noise: AutoregressiveNoise) -> CampaignHull:
        parts = [self._part(i, z, mine, noise, self.by_hull(i, z, mine, noise)) for i, mine in enumerate(own)]
        normal = np.stack([part.normal for part in parts])
        A = np.eye(len(z)) + normal.sum(axis=0)
        errors = []
        for member, part in zip(self.members, parts, strict=True):
            size = np.array([p.size for candidate in member.candidates for p in candidate.parameters])
            cuts = np.cumsum([len(candidate.parameters) for candidate in member.candidates])[:-1].tolist()
            errors.append(tuple(np.split(size * part.own_errors(A), cuts)) if member.candidates else ())
        return CampaignHull(
            names=(*COEFFICIENTS, *INDUCED),
            before=self.before,
            spread=self.spread,
            step=z,
            normal=normal,
            gradient=np.stack([part.gradient for part in parts]),
            values=tuple(self.values(i, mine) for i, mine in enumerate(own)),
            errors=tuple(errors),
            noise=noise,
            gaps=tuple(self.gap(i, z, mine) for i, mine in enumerate(own)),
        )


@dataclass(frozen=True)
class _Part:
    """A log's normal equations of the hull, its own effects partialled out, and what gives these back."""

    normal: Floats
    gradient: Floats
    own: Floats
    cross: Floats
    own_gradient: Floats

    def own_step(self, step: Floats) -> Floats:
        """Return the step of the log's own effects that belongs to one of the hull."""
        return np.asarray(-np.linalg.solve(self.own, self.own_gradient + self.cross @ step), dtype=np.float64)

    def own_errors(self, A: Floats) -> Floats:
        """Return standard deviations of the log's own effects, with A the hull's normal matrix of all logs."""
        if not len(self.own):
            return np.zeros(0)
        back = np.linalg.solve(self.own, self.cross)
        return np.asarray(
            np.sqrt(np.diag(np.linalg.inv(self.own) + back @ np.linalg.solve(A, back.T))), dtype=np.float64
        )
