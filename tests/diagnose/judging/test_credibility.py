"""What cannot be true of a vessel: never sure, never in a model that becomes the current one, and the reason is given."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.estimation import Candidate, Fit
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging import campaign_properties, conclude
from ferryid.diagnose.judging.campaign_conditions import ConditionTest
from ferryid.diagnose.judging.campaign_evidence import Gain, HeldOutLoss
from ferryid.diagnose.judging.campaign_properties import OutOfStep, PropertyTest
from ferryid.diagnose.judging.claims import Claim, Figures, Kind, LogFigures
from ferryid.diagnose.judging.confidence_rules import apply_rules
from ferryid.diagnose.judging.credibility import (
    RefittedHull,
    campaign_hull,
    harm_alone,
    idle_actuators,
    idle_in_campaign,
    impossible_masses,
    interval_doubt,
    refitted_hull,
    scaled_as_masses,
    size_deviations,
    unfelt,
    value_doubt,
)
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.group_differences import Difference, _doubt
from ferryid.diagnose.judging.learning import Learned, Learner
from ferryid.diagnose.judging.model_update import store_updated_model, update_model
from ferryid.diagnose.judging.posterior import HullPosterior, Posterior
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.effect import Parameter
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, Measurements, hull_of
from ferryid.effects.thresholds import EFFECTS
from ferryid.effects.wording import ALL_THRUSTERS
from ferryid.models import Quantity, Source, StoredEffect
from ferryid.signals.feedback import Feedback
from ferryid.types import AXES
from ferryid.vessel import load_profile
from ferryid.vessel.dimensions import off_hull
from tests.diagnose.judging.findings import found

FERRY = load_profile("milliampere")
HULL = hull_of(FERRY)
LENGTH, BEAM, MASS = FERRY.hull.length_m, FERRY.hull.beam_m, FERRY.hull.mass_kg
SPREAD = EFFECTS.hull_spread * np.abs(HULL)


def doubt(effect: str, **values: float) -> str:
    known = effects()[effect]
    return value_doubt(known, known.parameters_of(FERRY), values, FERRY)


@pytest.mark.parametrize(
    ("effect", "values", "why"),
    [
        ("lever_arm", {"x": 0.49 * LENGTH, "y": -0.49 * BEAM}, ""),
        ("lever_arm", {"x": 0.51 * LENGTH, "y": 0.0}, "2.55 m ahead of the body origin is off a hull of 5 m"),
        ("lever_arm", {"x": 0.0, "y": -0.51 * BEAM}, "to port is off a hull that is 2.8 m wide"),
        ("payload", {"mass": 0.55 * MASS, "x": 0.0}, ""),
        ("payload", {"mass": 0.94 * MASS, "x": 0.0}, "the load would be 94 % of the vessel's own mass"),
        ("payload", {"mass": -20.0, "x": 0.0}, "20 kg lighter than it is empty"),
        ("payload", {"mass": 100.0, "x": 0.5 * LENGTH}, "its x of 2.5 m stands at the bound of its search"),
        ("payload", {"mass": 100.0, "x": 0.6 * LENGTH}, "ahead of the body origin is off a hull"),
        ("fouling", {"surge": 1.5, "sway": 5.99}, "its sway of 5.99 - stands at the bound of its search"),
        ("hull_parameters", {"m11": 0.06}, "its m11 of 0.06 - stands at the bound of its search"),
        # Of a time constant from 0.1 to 300 s, one of seconds lies in the middle: the search is over orders of magnitude.
        ("gusts", {"std": 1.0, "time_constant": 2.8}, ""),
        ("waves", {"peak_frequency": 0.45, "time_constant": 2.3}, ""),
        (
            "waves",
            {"peak_frequency": 0.45, "time_constant": 2.1},
            "its time constant is 0.94 of its period: a sea is coherent",
        ),
        ("waves", {"peak_frequency": 2.99, "time_constant": 2.3}, "its peak frequency of 2.99 Hz stands at the bound"),
        (
            "gusts",
            {"std": 1.0, "time_constant": 0.105},
            "its time constant of 0.105 s stands at the bound of its search",
        ),
        ("gusts", {"std": 1.0, "time_constant": 290.0}, "its time constant of 290 s stands at the bound of its search"),
        ("thruster_gain", {"factor": 2.99}, "its factor of 2.99 - stands at the bound"),
        # A thruster may give nothing at all, and a line may hold along one direction alone.
        ("thruster_gain", {"factor": 0.0}, ""),
        ("mooring", {"stiffness_north": 0.0, "stiffness_east": 8.0, "north": 3.0, "east": 4.0}, ""),
        ("time_delay", {"seconds": 0.4}, ""),
        ("time_delay", {"seconds": -0.4}, "the motion precedes its force"),
    ],
)
def test_a_value_that_no_vessel_has_is_doubted_with_the_reason(effect: str, values: dict[str, float], why: str) -> None:
    said = doubt(effect, **values)
    assert why in said
    assert bool(said) == bool(why)


def test_a_hull_about_an_origin_at_the_stern_reaches_farther_ahead() -> None:
    astern = replace(FERRY, hull=replace(FERRY.hull, x_g_m=0.5 * LENGTH))
    assert off_hull(astern, 0.9 * LENGTH, 0.0) == ""
    assert off_hull(FERRY, 0.9 * LENGTH, 0.0) != ""
    assert off_hull(astern, 1.01 * LENGTH, 0.0) != ""


def fitted(hull: Any, *candidates: Any, known: bool = True) -> RefittedHull:
    problem = SimpleNamespace(
        plain=SimpleNamespace(hull=HULL, measurements=SimpleNamespace(profile=FERRY)), hull_spread=SPREAD
    )
    kept = SimpleNamespace(hull=hull, candidates=[one for one, _ in candidates], values=[p for _, p in candidates])
    return refitted_hull(cast(Any, problem), cast(Any, kept), known=known)


def test_what_leaves_all_actuators_without_force_is_doubted() -> None:
    """A fit to forces that the motion does not follow has none of them; one of two may well have failed."""
    parts = np.random.default_rng(6).normal(size=(30, 2, 3))
    still = np.zeros((30, 3))
    usable = np.arange(30) < 25
    parts[25:] = np.nan
    measurements = Measurements(FERRY, 0.1 * np.arange(30), still, still, still, parts, np.zeros((30, 2)), usable)
    plain = ForceModel(measurements, HULL, parts, measurements.angles, still)
    gains = tuple(Candidate.of(effects()["thruster_gain"], name, FERRY) for name in ("thruster1", "thruster2"))

    def doubt(*factors: float) -> str:
        values = tuple(np.array([one]) for one in factors)
        return idle_actuators(cast(Any, SimpleNamespace(plain=plain)), Fit(gains, values, np.eye(2), HULL, 0.0))

    assert doubt(0.0, 1.0) == doubt(0.12, 0.12) == ""
    said = doubt(0.03, 0.03)
    assert said.startswith(
        "beside it, the actuators are left with 3 % of their recorded force: the motion does not follow"
    )

    def in_campaign(*factors: float) -> str:
        left = [replace(plain, parts=one * parts) for one in factors]
        campaign = SimpleNamespace(members=[SimpleNamespace(plain=plain) for _ in factors])
        return idle_in_campaign(cast(Any, SimpleNamespace(campaign=campaign, whole_force_model=left.__getitem__)))

    assert in_campaign(0.0, 1.0) == in_campaign(0.0, 0.0, 0.2) == ""
    assert in_campaign(0.03, 0.03) == said


def moved(coefficient: str, deviations: float) -> Any:
    return HULL + np.where(np.array(COEFFICIENTS) == coefficient, deviations * SPREAD, 0.0)


def test_a_hull_that_moves_ten_deviations_or_is_lighter_than_the_vessel_is_doubted() -> None:
    assert fitted(moved("Y_v", 9.9)).doubt == ""
    said = fitted(moved("Y_v", -10.1)).doubt
    assert said == "beside it, Y_v of the hull moves by 10 prior standard deviations, which is another vessel's hull"
    least = 0.5 * MASS / HULL[0]
    factors = Candidate.of(effects()["hull_parameters"], None, FERRY)
    values = np.array([least if one.name == "m11" else 1.0 for one in factors.parameters])
    said = fitted(HULL, (factors, values)).doubt
    assert "the effective inertia in surge is 0.50 times the rigid body's" in said
    # The factor alone is that much below the model's, which has added mass.
    values[[one.name for one in factors.parameters].index("m11")] = MASS / HULL[0]
    assert fitted(HULL, (factors, values)).doubt == ""


def test_a_hull_that_nobody_modelled_is_doubted_where_no_axis_has_a_possible_inertia() -> None:
    def heavy(*names: str) -> Any:
        return HULL * np.where(np.isin(COEFFICIENTS, names), 9.0, 1.0)

    assert fitted(heavy("m11", "m22"), known=False).impossible == ()
    (why,) = fitted(heavy("m11", "m22", "m33"), known=False).impossible
    assert "which no hull has: places, directions or thrust curves" in why
    # One that was modelled is doubted for any axis.
    assert len(fitted(heavy("m11", "m22")).impossible) == 2


@pytest.mark.parametrize(
    ("heavy", "known", "sure"),
    [(("m11", "m22", "m33"), False, False), (("m11", "m22"), False, True), (("m11", "m22", "m33"), True, True)],
)
def test_what_sets_in_is_a_hint_where_the_hull_beside_the_sure_findings_cannot_be(
    monkeypatch: pytest.MonkeyPatch, heavy: tuple[str, ...], known: bool, sure: bool
) -> None:
    hull = HULL * np.where(np.isin(COEFFICIENTS, heavy), 9.0, 1.0)

    def posterior(*given: Any, **_: Any) -> Any:
        return SimpleNamespace(hull=SimpleNamespace(mean=hull)) if any(one.sure for one in given[3]) else None

    monkeypatch.setattr(conclude, "posterior_of", posterior)
    screened = SimpleNamespace(measurements=SimpleNamespace(profile=FERRY), measured=SimpleNamespace(survey=None))
    estimated = SimpleNamespace(
        averaged=SimpleNamespace(screened=screened), baseline=SimpleNamespace(updates_model=True)
    )
    selected = SimpleNamespace(search=SimpleNamespace(problem=None, states=()), estimated=estimated)
    log = SimpleNamespace(selected=selected, stands=SimpleNamespace(fit=None))
    claim = Claim(found("thruster_gain"), Figures("force", sets_in=True))
    (one,), notes, made, _ = conclude._confident([claim], LogFigures(hull_known=known), cast(Any, log))
    assert (one.sure, made is not None) == (sure, sure)
    assert any("which no hull has" in note for note in notes) != sure


def test_the_hull_of_a_campaign_is_doubted_as_that_of_a_log_is() -> None:
    def doubted(deviations: float, *names: str, known: bool) -> str:
        moved = np.isin([*COEFFICIENTS, "X_vr", "X_vv"], names or ("m11",))
        common = np.where(moved, deviations, 0.0)
        prior = SimpleNamespace(mean=np.append(HULL, [0.0, 0.0]), spread=np.append(SPREAD, [1.0, 1.0]), known=known)
        member = SimpleNamespace(plain=SimpleNamespace(measurements=SimpleNamespace(profile=FERRY)))
        campaign = SimpleNamespace(hull=prior, members=(member,))
        return campaign_hull(cast(Any, SimpleNamespace(campaign=campaign, common=common))).doubt

    assert doubted(-1.0, known=True) == ""
    assert "inertia in surge" in doubted(-6.0, known=True)
    # Of a hull that nobody has modelled, the logs may say little of the mass.
    assert doubted(-6.0, known=False) == ""
    assert "moves by 11 prior" in doubted(11.0, known=False)
    # Thrusters that push a vessel without a mass are not the vessel's.
    assert "which no hull has" in doubted(-9.0, "m11", "m22", "m33", known=False)


@pytest.mark.parametrize(
    ("scaled", "known", "told"),
    [
        (("thruster1", "thruster2"), False, "on all actuators, and each of them has one"),
        (("thruster1",), False, ""),
        (("thruster1", "thruster2"), True, ""),
    ],
)
def test_a_factor_on_every_actuator_is_one_on_masses_that_nobody_knows(
    monkeypatch: pytest.MonkeyPatch, scaled: tuple[str, ...], known: bool, told: str
) -> None:
    gains = tuple(Candidate.of(effects()["thruster_gain"], name, FERRY) for name in scaled)
    member = SimpleNamespace(plain=SimpleNamespace(measurements=SimpleNamespace(profile=FERRY)))
    campaign = SimpleNamespace(properties=gains, hull=SimpleNamespace(known=known), members=(member,))
    made = SimpleNamespace(campaign=campaign, common=np.zeros(40), own=())
    for name, value in (
        ("_covariance", np.eye(1)),
        ("property_rows", slice(0, 1)),
        ("felt", np.ones((1, 3))),
        ("unfelt", ""),
        ("idle_in_campaign", ""),
    ):
        monkeypatch.setattr(campaign_properties, name, lambda *_, value=value: value)
    said = campaign_properties._credibility(cast(Any, made), gains[0], {"factor": Estimate(0.04, -0.07, 0.15, "-")})
    assert said.endswith(told)
    assert bool(said) == bool(told)


@pytest.mark.parametrize("kind", ["force", "disturbance", "condition", "property", "sensor"])
def test_what_is_not_credible_is_a_hint_whatever_shows_it(kind: Kind) -> None:
    why = "it is off the hull"
    (one,), notes = apply_rules([Claim(found("thruster_gain"), Figures(kind, doubt=why))], LogFigures())
    assert one.probability == JUDGING.hint_probability
    assert notes[0] == "Thruster force (thruster1) is a hint: it is off the hull."
    (one,), notes = apply_rules([Claim(found("thruster_gain"), Figures(kind))], LogFigures())
    assert (one.sure, notes) == (True, ())


@pytest.mark.parametrize(
    ("kind", "own", "common"),
    [("force", False, True), ("law", False, True), ("condition", True, False), ("sensor", True, True)],
)
def test_beside_a_hull_that_cannot_be_nothing_is_sure_but_what_kinematics_shows(
    kind: Kind, own: bool, common: bool
) -> None:
    claim = Claim(found("wind"), Figures(kind))
    assert apply_rules([claim], LogFigures(hull_doubt="no such hull"))[0][0].sure == own
    findings, notes = apply_rules([claim], LogFigures(common_hull_doubt="no such hull"))
    assert findings[0].sure == common
    assert bool(notes) != common


def intervals(**ends: tuple[float, float]) -> dict[str, Estimate]:
    return {name: Estimate(0.5 * (low + high), low, high, "-") for name, (low, high) in ends.items()}


NONE = "its 95 % interval includes no effect at all"


@pytest.mark.parametrize(
    ("effect", "ends", "why"),
    [
        ("thruster_gain", {"factor": (-2.1, 2.1)}, NONE),
        ("thruster_gain", {"factor": (0.4, 0.9)}, ""),
        # An end of what is possible at which nothing acts is within the interval.
        ("thruster_lag", {"time_constant": (0.0, 0.8)}, NONE),
        ("wind", {"north": (-2.0, 1.0), "east": (0.1, 3.0)}, ""),
        ("wind", {"north": (-2.0, 1.0), "east": (-0.1, 3.0)}, NONE),
        # Where a line leads to is no size of it.
        (
            "mooring",
            {
                "stiffness_north": (0.0, 0.18),
                "stiffness_east": (0.0, 0.19),
                "north": (-31.0, 29.0),
                "east": (-83.0, -16.0),
            },
            NONE,
        ),
        ("payload", {"mass": (0.0, 80.0), "x": (0.5, 1.0)}, NONE),
        # What is not reported has no say, nor have times.
        ("hull_parameters", {}, ""),
    ],
)
def test_what_may_as_well_be_none_is_doubted(effect: str, ends: dict[str, tuple[float, float]], why: str) -> None:
    assert interval_doubt(effects()[effect].parameters_of(FERRY), intervals(**ends)) == why


@pytest.mark.parametrize(
    ("surge", "sway", "yaw", "why"),
    [
        ((1.2, 1.6), (0.8, 1.5), (1.1, 1.4), ""),
        ((0.4, 0.8), (0.6, 1.1), (0.5, 0.9), ""),
        ((1.0, 1.7), (1.1, 1.8), (1.1, 1.7), "damping in surge, which"),
        ((0.7, 1.5), (0.9, 1.6), (1.1, 1.7), "damping in surge, which"),
        ((0.7, 1.1), (0.5, 0.9), (0.6, 1.1), "damping in surge, which"),
        ((0.5, 1.3), (0.8, 1.5), (1.2, 1.8), "damping in yaw has grown and in surge fallen,"),
        ((0.9, 1.3), (0.8, 1.1), (0.5, 0.9), "damping in surge has grown and in yaw fallen,"),
        ((1.2, 1.6), (0.8, 1.5), (0.4, 0.8), "damping in surge has grown and in yaw fallen,"),
        ((0.4, 0.8), (1.2, 1.5), (0.5, 0.9), "damping in sway has grown and in surge and yaw fallen,"),
    ],
)
def test_fouling_is_felt_ahead_and_grows_all_damping(
    surge: tuple[float, float], sway: tuple[float, float], yaw: tuple[float, float], why: str
) -> None:
    doubt = effects()["fouling"].doubt_of_ends({"surge": surge, "sway": sway, "yaw": yaw})
    assert doubt.startswith(why)
    assert bool(doubt) == bool(why)
    # Of an effect that has no such rule, intervals are judged by `interval_doubt` alone.
    assert effects()["wind"].doubt_of_ends({"north": (-1.0, 1.0)}) == ""


def test_a_wind_that_is_known_along_one_direction_alone_is_not_none() -> None:
    ends = intervals(north=(-1.0, 3.0), east=(-1.0, 3.0))
    wind = effects()["wind"].parameters_of(FERRY)
    covariance = np.eye(len(wind))
    assert interval_doubt(wind, ends, covariance) == NONE
    # Across the bearing nothing is known; along it, it blows.
    covariance[0, 1] = covariance[1, 0] = -0.9
    assert interval_doubt(wind, ends, covariance) == ""
    covariance[0, 1] = covariance[1, 0] = 0.9
    assert interval_doubt(wind, ends, covariance) == NONE
    # A common region is wider than the interval of each: 2.2 standard deviations to the north and nothing to the east.
    ends = intervals(north=(0.1, 1.9), east=(-1.0, 1.0))
    assert interval_doubt(wind, ends) == ""
    # The interval to the north excludes none, and the sentence must not contradict it.
    common = "the common 95 % region of north and east includes no effect at all"
    assert interval_doubt(wind, ends, np.eye(len(wind))) == common
    assert interval_doubt(wind, intervals(north=(0.4, 1.6), east=(-1.0, 1.0)), np.eye(len(wind))) == ""


def test_a_load_whose_place_is_confined_to_the_hull_is_not_none_where_its_moment_is_known() -> None:
    """The yaw moment of a load is its mass times its place: what is known is their product, which none has without mass."""
    load = effects()["payload"].parameters_of(FERRY)
    ends = intervals(mass=(-130.0, 850.0), x=(-0.2, 1.6))
    names = [one.name for one in load]
    covariance = np.diag([250.0**2, 0.46**2, *[0.0] * (len(load) - 2)])
    assert names[:2] == ["mass", "x"]
    assert interval_doubt(load, ends, covariance) == NONE
    covariance[0, 1] = covariance[1, 0] = -0.95 * 250.0 * 0.46
    assert interval_doubt(load, ends, covariance) == ""
    # The interval that is shown excludes no load; its wider side, which tells the error, does not.
    uneven = {"mass": Estimate(24.0, 19.0, 851.0, "kg"), "x": Estimate(0.8, 0.0, 1.1, "m")}
    assert interval_doubt(load, uneven, np.diag([400.0**2, 0.3**2, *[0.0] * (len(load) - 2)])) == (
        "its 95 % interval is so uneven that, by its wider side, it includes no effect at all"
    )
    # A line may lead to anywhere: what pulls alike everywhere is no line.
    line = effects()["mooring"].parameters_of(FERRY)
    ends = intervals(stiffness_north=(-0.1, 0.3), stiffness_east=(-0.1, 0.3), north=(-90.0, 30.0), east=(-90.0, 30.0))
    covariance = np.diag([0.1**2, 0.1**2, 30.0**2, 30.0**2])
    covariance[0, 2] = covariance[2, 0] = covariance[1, 3] = covariance[3, 1] = -0.95 * 3.0
    assert interval_doubt(line, ends, covariance) == NONE


def condition(axes: tuple[float, float, float], share: float) -> ConditionTest:
    """Return a wind that the evidence favours, with the errors that it leaves by axis, of one, and how much it is felt."""
    plain = SimpleNamespace(hull=np.array([1.0, 1.0, 0.0, 0.0, 1.0]), measurements=SimpleNamespace(profile=FERRY))
    own = [(0, Parameter(name, "m/s", 4.0, -30.0, 30.0)) for name in ("north", "east")]
    wind = SimpleNamespace(effect=SimpleNamespace(id="wind"))
    members = (SimpleNamespace(plain=plain, windows=None),) * 2
    campaign = SimpleNamespace(members=members, own=own, conditions=(wind,))
    fit = SimpleNamespace(campaign=campaign, condition=lambda i, k: (np.array([3.0, 29.9 * i]), np.eye(2)))
    loss = tuple(
        HeldOutLoss(np.ones(1), np.zeros(1, dtype=int), (np.ones((4, 3)) * np.sqrt(each),) * 2)
        for each in ((1.0, 1.0, 1.0), axes)
    )
    beaten = SimpleNamespace(beaten=True, own=True)
    test = ConditionTest(
        "wind", cast(Any, fit), cast(Any, fit), cast(Any, loss), 50.0, Gain(40.0, 10.0, 70.0), {"m": cast(Any, beaten)}
    )
    test.__dict__.update(felt=np.array([[0.0, share, 0.0], [0.0, 0.5 * share, 0.0]]), courses=())
    return test


def test_a_condition_that_makes_an_axis_worse_or_is_not_felt_is_not_confirmed() -> None:
    least = INFERENCE.void_share
    assert condition((0.9, 0.8, 1.1), least).confirmed
    worse = condition((0.9, 0.8, 1.3), least)
    assert worse.doubt == "it makes the held-out squared force error in yaw 30 % larger"
    assert condition((0.9, 0.8, 1.1), 0.9 * least).doubt == (
        "it moves the vessel by less than 2 % of its measured acceleration"
    )
    # What one log has of it is judged by itself: the second has half of it, at the bound of the search.
    steady = condition((0.9, 0.8, 1.1), 1.5 * least)
    assert steady.confirmed
    assert steady.value_doubt(0) == ""
    assert steady.value_doubt(1) == "its east of 29.9 m/s stands at the bound of its search"
    steady.__dict__["fit"].condition = lambda i, k: (3.0 * np.ones(2), np.eye(2))
    assert "less than 2 %" in steady.value_doubt(1)
    # A log that may as well have none of it.
    steady.__dict__["fit"].condition = lambda i, k: (np.ones(2), np.eye(2))
    assert steady.value_doubt(0) == "its 95 % interval includes no effect at all"


def test_one_axis_is_enough_to_be_felt() -> None:
    assert unfelt(np.array([0.0, INFERENCE.void_share, 0.0])) == ""
    assert unfelt(np.array([0.0, 0.0199, 0.0])) != ""


def test_a_property_and_a_difference_that_are_not_credible_are_not_confirmed() -> None:
    weak = Candidate.of(effects()["thruster_gain"], "thruster1", FERRY)
    estimates = found("thruster_gain").parameters
    test = PropertyTest(weak, estimates, 50.0, Gain(40.0, 10.0, 70.0), (3, 3), np.array([0.5, 0.5, 0.5]), ())
    assert test.confirmed
    # A weak propeller in one of two logs is no property of both.
    assert replace(test, holding=(1, 2)).doubt == "only 1 of 2 logs is predicted better with it on held-out stretches"
    assert not replace(test, holding=(2, 4)).confirmed
    assert replace(test, holding=(2, 3)).confirmed
    assert replace(test, credibility="nobody has such a thruster").doubt == "nobody has such a thruster"
    # What one log alone can show is confirmed by no other, beside a hull that may be off in it.
    assert replace(test, holding=(1, 1), logs=3).confirmed
    assert replace(test, holding=(1, 1), logs=3, hull_known=False).doubt.startswith("one log alone can show it")
    assert replace(test, holding=(2, 2), logs=3, hull_known=False).confirmed
    bound = {"factor": replace(estimates["value"], value=2.99, low=2.9, high=3.0)}
    gain = Gain(40.0, 10.0, 70.0)
    apart = replace(Difference.of(weak, bound, 50.0, 0.0, {}), gain=gain, by_group={"A": gain, "B": gain})
    assert _doubt(apart, weak.effect, True, FERRY) == "its factor of 2.99 - stands at the bound of its search"
    # One thruster may give nothing; where none does, none was engaged.
    idle = replace(apart, estimates={"factor": Estimate(0.13, 0.0, 0.26, "-")})
    assert _doubt(idle, weak.effect, True, FERRY) == ""
    every = _doubt(replace(idle, instance=ALL_THRUSTERS), weak.effect, True, FERRY)
    assert every.startswith(f"the motion of group {idle.group} may not follow its recorded force at all")


def test_a_property_against_which_held_out_stretches_speak_is_no_hint() -> None:
    weak = Candidate.of(effects()["thruster_gain"], "thruster1", FERRY)
    likely, unlikely = Gain(40.0, 10.0, 70.0), Gain(4.0, -10.0, 20.0)
    none, harm = np.array([0.0, 0.004, -0.1]), np.array([-0.01, 0.0, -0.3])

    def test(gain: Gain, improvement: np.ndarray) -> PropertyTest:
        return PropertyTest(weak, found("thruster_gain").parameters, 50.0, gain, (2, 3), improvement, ())

    assert test(likely, np.array([0.5, 0.5, 0.5])).undefended == ""
    # It removes little, but held-out stretches are surely predicted better.
    assert test(likely, none).undefended == ""
    assert not test(likely, none).confirmed
    # What is not confirmed is reported with its numbers.
    assert test(unlikely, none).undefended == ""
    assert test(unlikely, np.array([0.0, 0.02, -0.3])).undefended == ""
    assert "in yaw 30 % larger, and on none smaller" in test(likely, harm).undefended
    # A delay that no controller can have caused averages out over windows.
    beyond = OutOfStep(50.0, Feedback(0.0, 5.0))
    assert replace(test(likely, harm), out_of_step=beyond).undefended == ""


def test_harm_counts_alone_where_no_axis_gains() -> None:
    assert harm_alone({"surge": -0.38, "sway": -0.07, "yaw": -0.22}) == (
        "it makes the held-out squared force error in surge 38 % larger, and on none smaller"
    )
    assert harm_alone({"surge": -0.38, "sway": 0.02, "yaw": -0.22}) == ""
    assert harm_alone({"surge": -0.1, "sway": float("nan"), "yaw": -0.1}) == ""
    assert harm_alone({}) == ""


def test_factors_on_all_actuators_are_one_on_the_masses() -> None:
    assert scaled_as_masses({"thruster1"}, FERRY) == ""
    assert "all actuators, and each of them has one" in scaled_as_masses({"thruster1", "thruster2"}, FERRY)
    assert scaled_as_masses({"propeller"}, load_profile("kvlcc2-model")).endswith("as one on the only actuator")
    # Other logs have the same hull, and no such factor.
    assert scaled_as_masses({"propeller"}, load_profile("kvlcc2-model"), shared=True).startswith(
        "the only actuator has a"
    )
    assert scaled_as_masses(set(), FERRY, shared=True) == ""


def test_an_interval_over_all_logs_ends_where_the_parameter_does() -> None:
    assert Estimate.normal(0.7, 1.0, "s", 0.0, 10.0) == Estimate(0.7, 0.0, 0.7 + 1.96, "s")
    assert Estimate.normal(9.5, 1.0, "s", 0.0, 10.0) == Estimate(9.5, 9.5 - 1.96, 10.0, "s")
    assert Estimate.normal(5.0, 1.0, "s", 0.0, 10.0) == Estimate.normal(5.0, 1.0, "s")
    # A value beyond what is possible stays in its interval, and is judged for it.
    assert Estimate.normal(-0.2, 0.05, "s", 0.0, 10.0).low == -0.2


def taught(hull: Any = None, doubt: str = "") -> Diagnosis:
    weak = StoredEffect(
        "thruster_gain", "thruster1", {"factor": Quantity(0.8, 0.7, 0.9, "-")}, (Source("log", "ab", 0.99),)
    )
    log = {"name": "log", "files": ["log.mcap"], "sha256": "ab", "seconds": 600.0, "rows": 1200}
    refitted = None if hull is None else HullPosterior(HULL, SPREAD, hull, np.diag(SPREAD**2))
    posterior = Posterior(log, {"u": (0.0, 1.0)}, (weak,), (), refitted, doubt)
    before, after = (dict.fromkeys(AXES, one) for one in (100.0, 40.0))
    return Diagnosis(
        "log", FERRY.name, "explained", (), {"mse": before, "rows": 60}, {"mse": after}, posterior=posterior
    )


def test_a_model_of_what_cannot_be_does_not_become_the_current_one() -> None:
    made, notes = update_model([taught(HULL)], FERRY, None, "boat")
    assert made is not None
    assert (made.accepted, notes) == (True, ())
    light = HULL * np.where(np.array(COEFFICIENTS) == "m11", 0.05, 1.0)
    assert impossible_masses(FERRY, light)
    for diagnosis, why in (
        (taught(light), "The effective inertia in surge is"),
        (
            taught(doubt="beside it, Y_v of the hull moves by 14 prior standard deviations"),
            "Beside it, Y_v of the hull moves",
        ),
    ):
        made, notes = update_model([diagnosis], FERRY, None, "boat")
        assert made is not None
        assert not made.accepted
        assert notes[-1].startswith(f"The model does not become the current one. {why}")


@pytest.mark.parametrize(
    ("light", "doubt", "fit_alone", "current"),
    [
        (False, "", False, True),
        (False, "beside it, Y_v moves far", False, False),
        # The fit's model knows nothing of a hull that is doubtful.
        (False, "beside it, Y_v moves far", True, True),
        (True, "", True, True),
        # The masses of what is stored count, with what was learned on top.
        (True, "", False, True),
    ],
)
def test_what_is_learned_becomes_the_current_model_unless_a_doubt_holds_for_it(
    tmp_path: Path, light: bool, doubt: str, fit_alone: bool, current: bool
) -> None:
    hull = HULL * np.where(np.array(COEFFICIENTS) == "m11", 0.05 if light else 1.0, 1.0)
    (possible, _), (asked, _) = (update_model([taught(one)], FERRY, None, "boat") for one in (HULL, hull))
    assert possible is not None
    assert asked is not None
    assert asked.accepted != light
    learned = replace(possible, accepted=True)
    told = Learned(True, "Learned.", fit_alone=fit_alone)
    learner = cast(Learner, SimpleNamespace(learn=lambda *_: (learned, told)))
    (done,) = store_updated_model([taught(hull, doubt)], FERRY, None, tmp_path, learner=learner)
    assert done.model is not None
    assert json.loads(Path(done.model).read_text("utf-8"))["accepted"] == current
    assert any("does not become the current one" in one for one in done.notes) != current


def test_a_size_is_so_many_standard_errors_away_from_nothing() -> None:
    """Of the parameter that is most of it, by the end of its interval that is towards nothing; a place is no size."""
    band, cut = Estimate(80.0, 80.0 - 5.0 * 1.96, 200.0, "rpm"), Estimate(0.8, 0.0, 0.8 + 0.05 * 1.96, "-")
    dead_band, gain, load = (effects()[name].parameters_of(FERRY) for name in ("dead_band", "thruster_gain", "payload"))
    assert size_deviations(dead_band, {"ahead": band}) == pytest.approx(16.0, rel=1e-3)
    assert size_deviations(dead_band, {"ahead": band, "astern": replace(band, value=0.0)}) == pytest.approx(
        16.0, rel=1e-3
    )
    assert size_deviations(gain, {"factor": cut}) == pytest.approx(4.0, rel=1e-3)
    assert size_deviations(load, intervals(mass=(0.0, 300.0), x=(1.9, 2.1))) == pytest.approx(1.96, rel=1e-3)
    assert size_deviations(load, {}) == 0.0
