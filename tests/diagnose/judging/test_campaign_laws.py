"""Laws of a vessel: what acts in all logs is fitted to the others and told, what one log shows alone is a hint."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ferryid.counts import per_cent
from ferryid.diagnose.inference.candidate_terms import Term, terms_of
from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, estimation_problem, fit
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.campaign_laws import CampaignLaws, LogInformation, find_campaign_laws, select_campaign_law
from ferryid.diagnose.judging.claims import LogFigures
from ferryid.diagnose.judging.confidence_rules import apply_rules
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.diagnose.judging.unexplained import find_unexplained
from tests.diagnose.judging.test_unexplained import FERRY, nu, pushes, sailed, trial_with

LOGS = 3
SIZE = 400.0


@cache
def terms(*keys: tuple[str, str]) -> tuple[Term, ...]:
    by_key = {term.key: term for term in terms_of(sailed(0))}
    return tuple(by_key[key] for key in keys)


def says(size: float, error: float, term: tuple[str, str] = ("surge", "u²")) -> LogInformation:
    """Return a log that speaks for a coefficient with a standard deviation; infinite where it says nothing."""
    return LogInformation(terms(term), np.array([[error**-2]]), np.array([size * error**-2]), np.ones(1))


def with_force(logs: int, size: float = SIZE) -> dict[str, tuple[EstimationProblem, Fit]]:
    """Return logs of which so many have a moment in proportion to u v."""
    made = {}
    for seed in range(LOGS):
        problem = trial_with(pushes(yaw=size * nu()[:, 0] * nu()[:, 1] if seed < logs else 0.0), seed)
        made[str(seed)] = (problem, fit(problem, ()))
    return made


def test_a_log_gains_by_what_the_others_say() -> None:
    law = select_campaign_law([says(1.0, 0.1), says(1.2, 0.1), says(0.9, 0.2)])
    assert law is not None
    assert law.elsewhere[:, 0] == pytest.approx([1.14, 0.98, 1.1])
    # Half the normal equation's square at the size itself; less what the square of the difference takes away.
    assert law.expected == pytest.approx([0.5 * 114.0**2 / 100.0, 0.5 * 98.0**2 / 100.0, 0.5 * 5.5**2])
    assert law.gains == pytest.approx([114.0 - 64.98, 117.6 - 48.02, 24.75 - 15.125])
    assert law.values == pytest.approx([242.5 / 225.0])
    # Their chi-squared, 2.69 for two degrees of freedom, makes the error larger than their noise does.
    apart = (0.7778**2 + 1.2222**2 + 0.8889**2) / 2.0
    assert law.errors == pytest.approx([1.5 * np.sqrt(apart) / 15.0], rel=1e-3)


def test_a_log_that_can_show_a_law_and_does_not_denies_it() -> None:
    assert select_campaign_law([says(1.0, 0.1), says(1.0, 0.1), says(0.4, 0.1)]) is None
    assert select_campaign_law([says(1.0, 0.1), says(1.0, 0.1), says(-1.0, 0.1)]) is None


def test_a_log_that_cannot_show_a_law_says_nothing_against_it() -> None:
    law = select_campaign_law([says(1.0, 0.1), says(1.0, 0.1), says(-1.0, 1.0)])
    assert law is not None
    assert law.able.tolist() == [True, True, False]
    assert law.expected[2] < JUDGING.law_expected_gain


def test_a_law_of_one_log_or_that_none_can_show_is_none() -> None:
    assert select_campaign_law([says(1.0, 0.1)]) is None
    assert select_campaign_law([says(1.0, 0.1), says(1.0, 1.0)]) is None
    # Of a law that is 2.8 standard deviations in every log these gain 3.9 each, of one that is 2.9 they gain 4.2.
    assert select_campaign_law([says(2.8, 1.0)] * LOGS) is None
    assert select_campaign_law([says(2.9, 1.0)] * LOGS) is not None


def test_what_hardly_moves_the_vessel_is_no_law() -> None:
    assert select_campaign_law([replace(says(1.0, 0.1), moves=np.array([0.01]))] * 3) is None


def test_a_term_that_may_as_well_be_none_is_no_law() -> None:
    law = select_campaign_law([says(1.0, 0.1)] * LOGS)
    assert law is not None
    assert law.holds
    assert not replace(law, errors=np.abs(law.values) / 1.9).holds


def test_what_belongs_to_the_water_is_no_law_of_the_vessel() -> None:
    for key in (("north", "1"), ("sway", "cos(2·heading)")):
        assert select_campaign_law([says(1.0, 0.1, key)] * 3) is None


def test_what_a_law_explains_is_not_said_twice() -> None:
    every = terms(("surge", "u"), ("surge", "u²"))
    said = LogInformation(every, np.array([[4.0, 1.0], [1.0, 2.0]]), np.array([3.0, 2.0]), np.ones(2))
    beside = said.beside(every[:1], np.array([0.5]))
    assert beside.slope == pytest.approx([1.0, 1.5])
    both, one = said.gains(every, np.array([0.5, 0.3]))[0], said.gains(every[:1], np.array([0.5]))[0]
    assert beside.gains(every[1:], np.array([0.3]))[0] == pytest.approx(both - one)
    # A log without the positions that a term needs says nothing of it.
    assert said.gains(terms(("north", "1")), np.array([1.0])) == (0.0, 0.0)


@pytest.mark.slow
def test_others_are_counted_by_what_they_can_show() -> None:
    logs = with_force(1)
    problem, kept = logs["0"]
    alone = find_unexplained(problem, kept, sailed(0)).claims[0].finding
    assert "that was fitted to this log only" in alone.says
    assert alone.sure
    told = find_campaign_laws(logs)
    assert told["0"].law is None
    (finding, *_), _ = apply_rules(find_unexplained(problem, kept, sailed(0), told["0"]).claims, LogFigures(joint=True))
    assert (finding.law[0].on, finding.law[0].quantity) == ("yaw", "uv")
    assert finding.probability == JUDGING.hint_probability
    assert finding.says.endswith("Of 2 other logs 2 could show it at this size, and none does.")
    other = told["1"].information[1]
    deaf = replace(other, normal=1e-9 * other.normal, slope=1e-9 * other.slope)
    unheard = find_unexplained(problem, kept, sailed(0), CampaignLaws((told["0"].information[0], deaf), 0, None))
    (finding, *_), _ = apply_rules(unheard.claims, LogFigures(joint=True))
    assert finding.says.endswith("Of 1 other log none could show it at this size.")


@pytest.mark.slow
def test_a_law_of_all_logs_is_told_in_each_of_them_and_fitted_to_the_others() -> None:
    logs = with_force(LOGS)
    told = find_campaign_laws(logs)
    law = told["0"].law
    assert law is not None
    assert [term.key for term in law.terms] == [("yaw", "uv")]
    assert law.values[0] == pytest.approx(SIZE, abs=3.0 * law.errors[0])
    assert law.errors[0] < 0.1 * SIZE
    assert law.total > JUDGING.law_gain
    for seed, (problem, kept) in enumerate(logs.values()):
        (claim,) = find_unexplained(problem, kept, sailed(seed), told[str(seed)]).claims
        finding = claim.finding
        assert finding.sure
        assert "that holds in all 3 logs that can show it" in finding.says
        assert finding.says.endswith(f", up to {per_cent(law.moves[0])} of the measured acceleration.")
        assert finding.improvement["yaw"] > 0.05
        assert finding.law[0].coefficient.low < SIZE < finding.law[0].coefficient.high


@pytest.mark.slow
def test_noise_and_hulls_that_are_off_have_no_law_in_common() -> None:
    logs = {}
    for seed in range(LOGS):
        cut = windows(sailed(seed), 8.0, 2.0)
        plain, spread = prior_force_model(cut.measurements, FERRY)
        # The same hull in all logs, as it is of one vessel.
        off = np.random.default_rng(5).choice([0.92, 1.08], len(plain.hull))
        problem = estimation_problem(cut, replace(plain, hull=plain.hull * off), spread)
        logs[str(seed)] = (problem, fit(problem, ()))
    assert find_campaign_laws(logs)["0"].law is None
