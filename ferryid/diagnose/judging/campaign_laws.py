"""Laws of a vessel: forces without a name that hold in every log of it that can show them.

A law that a regression finds in one log may be that log's alone, its held-out stretches included: the few manoeuvres of a log
leave many terms alike. What belongs to the vessel acts in all of its logs. So a law is fitted to all logs but one and judged on
this one, each in its turn. What a log says of the terms' coefficients is a normal matrix and a slope, its own hull and effects
partialled out, so that trying a law costs little more than a sum over the logs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.inference.candidate_terms import Term, terms_of
from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fit
from ferryid.diagnose.inference.folds import Folds
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.held_out import compare_held_out, held_out
from ferryid.diagnose.judging.sparse_regression import Law, law_candidate, linearise_terms
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.effect import HELD
from ferryid.types import Floats


@dataclass(frozen=True)
class LogInformation:
    """What one log says of the coefficients of terms, its hull and effects partialled out.

    Attributes
    ----------
    terms
        Those that its measurements offer, k in all.
    normal, slope
        Second derivatives of the negative log-likelihood by the coefficients, shape (k, k), and first ones of the
        log-likelihood where there is no law, shape (k,).
    moves
        What a coefficient of 1 adds to the acceleration, as a share of the measured one, by root mean squares on the channel
        where that is most, shape (k,).
    """

    terms: tuple[Term, ...]
    normal: Floats
    slope: Floats
    moves: Floats

    def of(self, terms: Sequence[Term]) -> tuple[Floats, Floats]:
        """Return normal matrix and slope of some terms; zero for those that the log cannot have."""
        place = {term.key: k for k, term in enumerate(self.terms)}
        rows = np.array([place.get(term.key, -1) for term in terms])
        known = rows >= 0
        return self.normal[np.ix_(rows, rows)] * np.outer(known, known), self.slope[rows] * known

    def gains(self, terms: Sequence[Term], values: Floats) -> tuple[float, float]:
        """Return what a law gains in log-likelihood, and what it would gain on average if it were true."""
        normal, slope = self.of(terms)
        expected = 0.5 * float(values @ normal @ values)
        return float(slope @ values) - expected, expected

    def move(self, term: Term) -> float:
        """Return one of `moves`; zero where the log cannot have the term."""
        return next((float(move) for one, move in zip(self.terms, self.moves, strict=True) if one.key == term.key), 0.0)

    def beside(self, terms: Sequence[Term], values: Floats) -> LogInformation:
        """Return what the log says beside a law that acts."""
        place = {term.key: value for term, value in zip(terms, values.tolist(), strict=True)}
        active_intervals = np.array([place.get(term.key, 0.0) for term in self.terms])
        return replace(self, slope=self.slope - self.normal @ active_intervals)


@dataclass(frozen=True)
class VesselLaw:
    """A law of all logs.

    Attributes
    ----------
    terms
        In the order of their selection, q in all.
    values, errors
        Coefficients fitted to all logs and their standard deviations as they are told, shape (q,). Logs that differ by more
        than their noise know less than it says.
    elsewhere
        Coefficients fitted to all logs but one, for each of these, shape (logs, q).
    gains, expected
        Log-likelihood that the law gains in each log with the coefficients of the others, and would if it were true.
    moves
        What each term adds to the acceleration in the log where it adds most, as in `LogInformation`, shape (q,).
    """

    terms: tuple[Term, ...]
    values: Floats
    errors: Floats
    elsewhere: Floats
    gains: Floats
    expected: Floats
    moves: Floats

    @property
    def total(self) -> float:
        """Gain of all logs."""
        return float(self.gains.sum())

    @property
    def able(self) -> NDArray[np.bool_]:
        """Which logs can show it, shape (logs,)."""
        return self.expected >= JUDGING.law_expected_gain

    @property
    def holds(self) -> bool:
        """True where two logs or more can show it, all that can do, and every term is surely there and moves the vessel enough.

        A term whose 95 % interval holds none stands in for another of the law, or is one of its errors. What is wrong in the
        same way in all logs, such as the arithmetic, holds in all of them but moves it by next to nothing.
        """
        return bool(
            self.able.sum() >= 2
            and (self.gains[self.able] > 0.0).all()
            and (np.abs(self.values) > 1.96 * self.errors).all()
            and (self.moves >= INFERENCE.void_share).all()
        )


@dataclass(frozen=True)
class CampaignLaws:
    """What the logs of a vessel, of which one is at `place`, say of its laws."""

    information: tuple[LogInformation, ...]
    place: int
    law: VesselLaw | None

    @property
    def able(self) -> int:
        """How many logs can show the vessel's law."""
        return 0 if self.law is None else int(self.law.able.sum())

    @property
    def moves(self) -> tuple[float, ...]:
        """What each term of the vessel's law adds to the acceleration, as a share of it, in the log where that is most."""
        return () if self.law is None else tuple(self.law.moves.tolist())

    def common(self, problem: EstimationProblem, kept: Fit, folds: Folds) -> Law | None:
        """Return the vessel's law as it acts in the log, with the coefficients of the others; None where it does not show."""
        if self.law is None or not self.law.able[self.place]:
            return None
        made = _with(problem, kept, self.law.terms, self.law.elsewhere[self.place])
        refitted = problem.with_noise_of(made)
        before = held_out(refitted, folds, kept.candidates, kept.values)
        after = held_out(refitted, folds, made.candidates, made.values)
        better = compare_held_out(refitted, folds, before, after)
        return Law(self.law.terms, made, refitted, better, self.law.total, 0.0, self.law.values, self.law.errors)

    def of_others(self, law: Law) -> tuple[int, int, int]:
        """Return how many other logs there are, how many can show a law of this log, and in how many of these it holds."""
        others = [one for k, one in enumerate(self.information) if k != self.place]
        if self.law is not None:
            others = [one.beside(self.law.terms, self.law.values) for one in others]
        gains = [
            gain
            for gain, expected in (one.gains(law.terms, law.values) for one in others)
            if expected >= JUDGING.law_expected_gain
        ]
        return len(others), len(gains), sum(gain > 0.0 for gain in gains)


def find_campaign_laws(logs: Mapping[str, tuple[EstimationProblem, Fit]]) -> dict[str, CampaignLaws]:
    """Return what each log is told by all.

    Parameters
    ----------
    logs
        Of one vessel, by path: each with what was found of it, hull and effects, and the noise that these leave.
    """
    best: VesselLaw | None = None
    information = tuple(log_information(problem, kept) for problem, kept in logs.values())
    while best is None or len(best.terms) < JUDGING.law_terms:
        law = select_campaign_law(information, best)
        if law is None:
            break
        for _ in range(JUDGING.law_refits):
            again = tuple(log_information(problem, kept, law) for problem, kept in logs.values())
            law = _fitted(again, law.terms)
        if not law.holds:
            break
        best, information = law, again
    return {path: CampaignLaws(information, place, best) for place, path in enumerate(logs)}


def log_information(problem: EstimationProblem, kept: Fit, law: VesselLaw | None = None) -> LogInformation:
    """Return what a log says of all terms that its measurements offer, beside a fit.

    The slopes are those where there is no law. If one is known, all derivatives are taken where it acts, and the hull does not
    have to stand in for it.
    """
    if law is not None:
        kept = _with(problem, kept, law.terms, law.values)
        problem = problem.with_noise_of(kept)
    terms = terms_of(problem.plain.measurements)
    lines = linearise_terms(problem, kept, terms)
    pushes, windows = lines.terms * lines.sizes, problem.windows
    left, known, columns = (problem.noise.white(one, windows.runs) for one in (lines.gaps, lines.known, pushes))
    measured = np.sqrt(np.mean(windows.measured[:, windows.channels] ** 2, axis=0))
    moves = np.max(np.sqrt(np.mean(pushes**2, axis=0)) / np.maximum(measured, 1e-12)[:, None], axis=0)
    # Hull and effects are believed to lie about their usual values, the terms may have any.
    p = len(lines.centre)
    A = np.vstack([known, np.eye(p)])
    B = np.column_stack([np.concatenate([left, lines.centre]), np.vstack([columns, np.zeros((p, len(terms)))])])
    rest = B - A @ np.linalg.lstsq(A, B, rcond=None)[0]
    information = LogInformation(terms, rest[:, 1:].T @ rest[:, 1:], -rest[:, 1:].T @ rest[:, 0], moves)
    return information if law is None else information.beside(law.terms, -law.values)


def select_campaign_law(information: Sequence[LogInformation], known: VesselLaw | None = None) -> VesselLaw | None:
    """Return the law with the one more term that gains most in the logs that it is not fitted to; None where none holds."""
    if len(information) < 2:
        return None
    chosen = () if known is None else known.terms
    taken = {term.key for term in chosen}
    tried = [
        _fitted(information, (*chosen, term))
        for term in information[0].terms
        if term.of_vessel and term.key not in taken
    ]
    best = max((one for one in tried if one.holds), key=lambda one: one.total, default=None)
    least = JUDGING.law_gain + (_fitted(information, chosen).total if chosen else 0.0)
    return best if best is not None and best.total >= least else None


def _with(problem: EstimationProblem, kept: Fit, terms: Sequence[Term], values: Floats) -> Fit:
    """Return a fit beside a law whose coefficients are held."""
    law = law_candidate(problem, kept, terms)
    held = tuple(
        replace(one, size=HELD, neutral=value, low=-np.inf, high=np.inf)
        for one, value in zip(law.parameters, values.tolist(), strict=True)
    )
    return fit(problem, [*kept.candidates, replace(law, parameters=held)], [*kept.values, values])


def _fitted(information: Sequence[LogInformation], terms: tuple[Term, ...]) -> VesselLaw:
    """Return a law with the coefficients that all logs speak for."""
    parts = [one.of(terms) for one in information]
    normal, slope = (np.stack(one) for one in zip(*parts, strict=True))
    A, b = normal.sum(axis=0), slope.sum(axis=0)
    inverse = np.linalg.pinv(A, hermitian=True)
    values = inverse @ b
    elsewhere = np.stack([np.linalg.pinv(A - N, hermitian=True) @ (b - g) for N, g in zip(normal, slope, strict=True)])
    gains, expected = np.array(
        [one.gains(terms, without) for one, without in zip(information, elsewhere, strict=True)]
    ).T
    # What each log would gain by coefficients of its own, over the common ones, is chi-squared if only noise parts them.
    own = np.array([0.5 * g @ np.linalg.pinv(N, hermitian=True) @ g for N, g in zip(normal, slope, strict=True)])
    apart = 2.0 * float(own.sum() - 0.5 * b @ values) / (len(terms) * (len(information) - 1))
    errors = INFERENCE.posterior_factor * np.sqrt(np.diag(inverse) * max(1.0, apart))
    most = np.array([max(one.move(term) for one in information) for term in terms])
    return VesselLaw(terms, values, errors, elsewhere, gains, expected, np.abs(values) * most)
