"""What a log of a campaign teaches: its own conditions of all logs' estimate, the hull of all, and nothing twice."""

from __future__ import annotations

from dataclasses import replace
from math import isnan
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.data.measurements import Survey, UsedRows
from ferryid.diagnose.inference.campaign import CommonHull
from ferryid.diagnose.inference.campaign_estimation import estimate_campaign
from ferryid.diagnose.inference.campaign_properties import with_property
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.group_differences import differences_of, in_groups
from ferryid.diagnose.judging.campaign import JudgedCampaign
from ferryid.diagnose.judging.campaign_conditions import JudgedConditions
from ferryid.diagnose.judging.campaign_posterior import campaign_posterior
from ferryid.diagnose.judging.posterior import Posterior
from ferryid.effects import effects
from ferryid.effects.wording import ALL_THRUSTERS
from ferryid.models import Quantity, Source, StoredEffect
from tests.diagnose.inference.test_campaign_estimation import FERRY, WINDS, fitted
from tests.diagnose.judging.findings import found

pytestmark = pytest.mark.slow


def campaign() -> JudgedCampaign:
    place = {f"log{i}": i for i in range(len(WINDS))}
    return JudgedCampaign(JudgedConditions(CommonHull(fitted(), place), ()), ())


def survey() -> Survey:
    used = UsedRows("log", 4, 2.0, {"u": (0.0, 1.0), "v": (0.0, 1.0), "r": (0.0, 1.0)}, (), ())
    recording = SimpleNamespace(sha256="ab", files=("log.mcap",), streams={})
    return cast(Survey, SimpleNamespace(used=used, repairs=(), recording=recording))


def wind(probability: float = 0.99, at: tuple[float, float] = (1.0, 1.0)) -> Any:
    told = {name: Estimate(one, one - 0.5, one + 0.5, "m/s") for name, one in zip(("north", "east"), at, strict=True)}
    return replace(found("wind", probability), parameters=told)


def test_a_log_has_its_own_wind_and_the_hull_of_all() -> None:
    together = campaign()
    for i, true in enumerate(WINDS):
        reported = (true[0] + 0.1, true[1])
        made = campaign_posterior(together, f"log{i}", None, [wind(at=reported)], survey())
        assert made is not None
        (stored,) = made.conditions
        assert [stored.parameters[name].value for name in ("north", "east")] == pytest.approx(reported)
        # Factors on the load are not reported, come from the estimate and have no interval.
        assert stored.parameters["C_X"].value == pytest.approx(1.0, abs=0.35)
        assert isnan(stored.parameters["C_X"].low)
        assert made.vessel == ()
        assert made.hull is together.hull_posterior
        assert made.training["seconds"] == 2.0
    assert together.hull_posterior is not None
    mean, covariance = fitted().belief()
    np.testing.assert_array_equal(together.hull_posterior.mean, mean[:26])
    np.testing.assert_array_equal(together.hull_posterior.covariance, covariance[:26, :26])


def test_a_hint_and_a_log_without_a_say_teach_nothing() -> None:
    assert campaign_posterior(campaign(), "log0", None, [wind(0.4)], survey()) is None
    assert campaign_posterior(campaign(), "too short", None, [wind()], survey()) is None


def test_what_one_log_alone_shows_is_kept_beside_it() -> None:
    gain = StoredEffect(
        "thruster_gain", "thruster1", {"factor": Quantity(0.8, 0.7, 0.9, "-")}, (Source("log", "ab", 0.9),)
    )
    own = Posterior({}, {}, (gain,), (), notes=("A doubt.",))
    made = campaign_posterior(campaign(), "log1", own, [wind()], survey())
    assert made is not None
    assert made.vessel == (gain,)
    assert [one.effect for one in made.conditions] == ["wind"]
    assert made.notes == ("A doubt.",)


def test_a_guessed_hull_is_not_kept() -> None:
    guessed = replace(fitted(), campaign=replace(fitted().campaign, hull=replace(fitted().campaign.hull, known=False)))
    together = JudgedCampaign(JudgedConditions(CommonHull(guessed, {"log0": 0}), ()), ())
    made = campaign_posterior(together, "log0", None, [wind()], survey())
    assert made is not None
    assert made.hull is None


def test_a_load_of_all_logs_is_a_condition_of_each_and_no_property_of_the_vessel() -> None:
    made = fitted()
    for name, instance in (("payload", None), ("thruster_gain", "thruster1")):
        begun = with_property(made, Candidate.of(effects()[name], instance, FERRY))
        made = estimate_campaign(begun.campaign, begin=begun)
    place = {f"log{i}": i for i in range(len(WINDS))}
    together = JudgedCampaign(JudgedConditions(CommonHull(made, place), ()), ())
    aboard = replace(found("payload"), parameters={"mass": Estimate(500.0, 400.0, 600.0, "kg")})
    learned = campaign_posterior(together, "log1", None, [aboard, found("thruster_gain")], survey())
    assert learned is not None
    assert [one.effect for one in learned.conditions] == ["payload"]
    assert [one.effect for one in learned.vessel] == ["thruster_gain"]
    assert learned.conditions[0].parameters["mass"].value == 500.0


@pytest.mark.parametrize(
    ("group", "instance", "stored"),
    [
        ("", "thruster1", ["thruster1"]),
        ("B", "thruster1", ["thruster1"]),
        ("B", ALL_THRUSTERS, ["thruster1", "thruster2"]),
        ("A", "thruster1", []),
    ],
    ids=["all along", "weakened", "all weakened", "came back"],
)
def test_a_loss_of_force_is_the_vessels_as_long_as_it_lasts(group: str, instance: str, stored: list[str]) -> None:
    made = fitted()
    whole = in_groups(made.campaign, ["A", "B", "B"])
    (lost,) = (
        one for one in differences_of(whole) if one.key == ("thruster_gain", instance) and one.group == (group or "B")
    )
    begun = with_property(replace(made, campaign=whole), replace(lost, group=group))
    fit = estimate_campaign(begun.campaign, noise=made.noise, begin=begun)
    together = JudgedCampaign(JudgedConditions(CommonHull(fit, {f"log{i}": i for i in range(len(WINDS))}), ()), ())
    told = replace(found("thruster_gain", 0.99), instance=instance, parameters={"factor": Estimate(0.9, 0.8, 1.0, "-")})
    taught = campaign_posterior(together, "log0" if group == "A" else "log1", None, [wind(), told], survey())
    assert taught is not None
    assert [one.instance for one in taught.vessel] == stored
    # A model file has no lasting property among the conditions of a log.
    assert [one.effect for one in taught.conditions] == ["wind"]
