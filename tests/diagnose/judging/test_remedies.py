"""What corrects a sensor's error in the profile is said where the error is sure, and not where it is a hint."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.checks import SensorFinding
from ferryid.diagnose.checks.screening import ScreenedLog
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.judging.conclude import drift_of_waves, order_remedies, remedies
from ferryid.diagnose.judging.judge import sensor_claims
from ferryid.effects.force_model import Measurements
from ferryid.vessel import load_profile, parse_profile
from ferryid.vessel.profile import Profile
from tests.diagnose.judging.findings import found
from tests.simulate.order_boat import profile_text

PROFILE = load_profile("milliampere")


def screened(*effects: str, profile: Profile = PROFILE) -> ScreenedLog:
    rest, nothing = np.zeros((2, 3)), np.zeros((2, 0))
    seen = Measurements(profile, np.arange(2.0), rest, rest, rest, rest[:, :0], nothing, np.ones(2, dtype=np.bool_))
    whole: Any = None
    factor = {"factor": Estimate(1.25, 1.2, 1.3, "-")}
    errors = tuple(SensorFinding(one, factor, f"The {one} is 1.25.", lambda measured: measured) for one in effects)
    return ScreenedLog(whole, seen, errors)


def test_the_line_of_the_profile_follows_a_sure_error() -> None:
    sure = found("yaw_rate_scale")
    says = (
        "The yaw_rate_scale is 1.25. In the profile, scale = 0.8 in [signals.yaw_rate] corrects that for every command."
    )
    assert remedies(screened("yaw_rate_scale"), [sure]) == (says,)
    assert remedies(screened("yaw_rate_scale"), [replace(sure, probability=0.4)]) == ()
    assert remedies(screened("yaw_rate_scale"), []) == ()


@pytest.mark.parametrize(("effect", "name"), [("thruster_lag", "time_constant"), ("time_delay", "seconds")])
def test_orders_that_are_followed_late_are_stated_in_the_profile(effect: str, name: str) -> None:
    profile = parse_profile(profile_text(), "boat.toml")
    late = replace(found(effect), parameters={name: Estimate(0.614, 0.5, 0.7, "s")})
    (said,) = order_remedies(profile, [late])
    assert "known by their orders alone" in said
    assert "ferryid fit estimates time_constant_s and delay_s" in said
    assert remedies(screened(profile=profile), [late]) == (said,)
    assert remedies(screened(), [late]) == (), "the bundled profile has feedback"
    assert order_remedies(profile, [replace(late, probability=0.4)]) == ()
    early = replace(late, parameters={name: Estimate(-0.614, -0.7, -0.5, "s")})
    assert order_remedies(profile, [early]) == ()
    assert order_remedies(profile, [found("wind")]) == ()
    told = order_remedies(parse_profile(profile_text("time_constant_s = 0.3"), "boat.toml"), [early])
    assert [one.endswith("motion that precedes its force may mean that this is too long.") for one in told] == (
        [True] if effect == "time_delay" else []
    )
    for other in (profile_text(feedback=True), profile_text("time_constant_s = 0.3")):
        assert order_remedies(parse_profile(other, "boat.toml"), [late]) == ()


def test_a_steady_load_beside_waves_may_be_some_of_their_drift() -> None:
    wind, current, waves = found("wind"), found("current"), found("waves")
    (said,) = drift_of_waves([wind, waves, current])
    assert "the steady wind and current that was found beside them" in said
    for others in ([wind], [waves], [replace(wind, probability=0.4), waves], [wind, replace(waves, probability=0.4)]):
        assert drift_of_waves(others) == ()


def test_what_the_signal_map_cannot_correct_has_no_line() -> None:
    assert remedies(screened("held_samples"), [found("held_samples")]) == ()


@pytest.mark.parametrize(
    ("effect", "jumping", "doubted"),
    [
        ("yaw_rate_scale", ("heading",), "heading"),
        ("yaw_rate_scale", ("position",), ""),
        ("lever_arm", ("position", "heading"), "position and heading"),
        ("held_samples", ("position",), ""),
    ],
)
def test_an_error_beside_a_pose_that_jumps_is_doubted(effect: str, jumping: tuple[str, ...], doubted: str) -> None:
    log = screened(effect)
    survey: Any = SimpleNamespace(jumping=jumping)
    measured: Any = SimpleNamespace(survey=survey)
    place = {one: Estimate(0.5, 0.4, 0.6, "m") for one in "xy"}
    errors = tuple(replace(one, parameters=place) if effect == "lever_arm" else one for one in log.sensors)
    (claim,) = sensor_claims(replace(log, measured=measured, sensors=errors))
    wanted = (
        f"too many samples of the {doubted} that it was compared with jump to know which are wrong" if doubted else ""
    )
    assert claim.figures.doubt == wanted
