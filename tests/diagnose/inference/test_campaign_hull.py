"""One hull for several logs: it is the true one, a log has no part in its own belief, and winds are told from placebos."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference.campaign import Campaign, fit_campaign
from ferryid.diagnose.inference.campaign_hull import INDUCED, CampaignHull, Member, fit_campaign_hull
from ferryid.diagnose.inference.estimation import Candidate, estimation_problem, fit
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel, hull_of
from ferryid.errors import FerryIdError
from ferryid.types import IN_MEMORY
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force
from tests.diagnose.judging.test_held_out import sailed
from tests.real.campaign_evidence import EXCHANGED, MIRRORED, held_out_gains, placebos

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
WIND = effects()["wind"]
# Without factors on its load, so that logs add up in straight lines.
SUSPECT = Candidate(WIND, None, WIND.parameters_of(FERRY)[:2])
WINDS = ((-2.0, 1.5), (1.5, 2.5), (2.5, -1.0))
SPREAD = 0.3 * np.abs(hull_of(FERRY))
NONE_INDUCED = np.zeros(len(INDUCED))


@cache
def members(factor: float = 1.0) -> tuple[Member, ...]:
    """Return three logs in three winds; the last was of a vessel whose forces are a factor larger than thought."""
    made = []
    for number, wind in enumerate(WINDS):
        # Each log begins elsewhere in the same forces, so that they are three.
        measurements = sailed(300.0 + 60.0 * number, np.array(wind))
        rows = slice(300 * number, None)
        measurements = replace(
            measurements,
            t=measurements.t[rows],
            eta=measurements.eta[rows],
            nu_raw=measurements.nu_raw[rows],
            nu=measurements.nu[rows],
            parts=measurements.parts[rows] * (factor if number == 2 else 1.0),
            angles=measurements.angles[rows],
            usable=measurements.usable[rows],
        )
        seen = windows(measurements, *window_lengths(FERRY))
        thin = seen.measurements
        still = wind_force(FERRY.wind, np.zeros((len(thin.t), 2)), thin.psi, thin.nu)  # type: ignore[arg-type]
        wrong = hull_of(FERRY) * np.where(np.arange(len(SPREAD)) % 2, 1.15, 0.85)
        made.append(Member(seen, ForceModel(thin, wrong, thin.parts, thin.angles, still), (SUSPECT,)))
    return tuple(made)


@cache
def fitted() -> CampaignHull:
    return fit_campaign_hull(members(), SPREAD, NONE_INDUCED)


def test_every_log_keeps_its_own_wind_beside_the_common_hull() -> None:
    hull = fitted()
    for wind, values, errors in zip(WINDS, hull.values, hull.errors, strict=True):
        assert np.abs(values[0] - wind).max() < 0.35
        assert (np.abs(values[0] - wind) < 5.0 * errors[0]).all()


def test_the_common_hull_is_nearer_the_true_one_than_it_was_thought() -> None:
    mean, covariance = fitted().belief()
    known = np.sqrt(np.diag(covariance))[: len(SPREAD)] < 0.3 * SPREAD
    assert known[:5].sum() >= 3
    before = np.abs(fitted().before[: len(SPREAD)] - hull_of(FERRY))
    after = np.abs(mean[: len(SPREAD)] - hull_of(FERRY))
    assert after[known].sum() < 0.35 * before[known].sum()


def test_a_log_has_no_part_in_what_the_others_say() -> None:
    alone = fit_campaign_hull(members()[:2], SPREAD, NONE_INDUCED)
    mean, covariance = fitted().belief(without=2)
    expected, own = alone.belief()
    error = np.sqrt(np.diag(own))[: len(SPREAD)]
    assert (np.abs(mean - expected)[: len(SPREAD)] <= 0.8 * error).all()
    told = error > 0.0
    assert np.sqrt(np.diag(covariance))[: len(SPREAD)][told] == pytest.approx(error[told], rel=0.5)
    # The log itself would have told more.
    assert np.linalg.norm(mean - fitted().belief()[0]) > np.linalg.norm(mean - expected)


def test_logs_of_one_hull_agree_and_of_another_do_not() -> None:
    assert fitted().disagreement < 1.6
    assert fit_campaign_hull(members(1.4), SPREAD, NONE_INDUCED).disagreement > 2.0 * fitted().disagreement


@pytest.mark.slow
def test_a_belief_from_others_brings_the_wind_out_of_one_log() -> None:
    hull = fitted()
    first = members()[0]
    plain, spread = hull.force_model(first.plain, without=0)
    made = fit(estimation_problem(first.windows, plain, spread), [SUSPECT])
    assert made.values[0] == pytest.approx(WINDS[0], abs=0.35)


def test_winds_hold_on_held_out_stretches_and_placebos_do_not() -> None:
    bare = [replace(member, candidates=()) for member in members()]
    gains = held_out_gains({"found": members(), **placebos(members())}, bare, SPREAD, NONE_INDUCED)
    found = gains["found"]
    assert found.interval()[0] > 0.0
    for control in (MIRRORED, EXCHANGED):
        assert found.interval(gains[control])[0] > 0.0


def test_a_common_hull_needs_two_logs() -> None:
    with pytest.raises(FerryIdError, match="needs two logs"):
        fit_campaign([], FERRY, lambda stage: None)


def test_a_common_hull_and_another_model_exclude_each_other() -> None:
    with pytest.raises(FerryIdError, match="--together"):
        diagnose(["a", "b"], FERRY, DiagnosisSettings(against="c", together=True), IN_MEMORY)


@pytest.mark.parametrize(
    ("variances", "told"), [(9.0, "3.0 times as much as the noise"), (0.8, "by no more than the noise")]
)
def test_how_far_logs_disagree_is_told_as_people_think_of_it(variances: float, told: str) -> None:
    hull = cast(CampaignHull, SimpleNamespace(disagreement=variances))
    says = Campaign(members(), hull, {"a": 0}).says("a")
    assert says.startswith("The hull is that of 2 other logs of the vessel")
    assert told in says
    assert "variance" not in says
