"""The course of a wind over a campaign: one concealed in simulated logs is found, a steady one stays steady."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.data.course import MeasuredCourse
from ferryid.diagnose.inference.campaign_course import _Knots, estimate_courses
from ferryid.diagnose.inference.campaign_estimation import estimate_campaign
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.effects import effects
from ferryid.effects.effect import Turbulence
from ferryid.types import Floats
from ferryid.vessel.wind import wind_force
from tests.diagnose.inference.test_campaign_estimation import FERRY, WINDS, campaign, fitted

pytestmark = pytest.mark.slow

TURBULENCE = effects()["wind"].turbulence
assert TURBULENCE is not None


def departure(t: Floats) -> Floats:
    """A wind that veers and rises over a minute [m/s], shape (n, 2)."""
    return np.column_stack([1.2 * np.sin(t / 10.0), 1.0 * np.sin(t / 13.0 + 1.0)])


def unsteady() -> Campaign:
    """Return the logs with another applied force, so that only their wind and the departure explain the motion."""
    assert FERRY.wind is not None
    members = []
    for member, wind in zip(campaign().members, WINDS, strict=True):
        m = member.windows.measurements
        steady = np.broadcast_to(np.array(wind), (len(m.t), 2))
        blown, was = (wind_force(FERRY.wind, one, m.psi, m.nu) for one in (steady + departure(m.t), steady))
        plain = replace(member.plain, external=member.plain.external - (blown - was))
        members.append(replace(member, plain=plain))
    return replace(campaign(), members=tuple(members))


def test_a_wind_that_changes_is_followed_in_its_band() -> None:
    logs = unsteady()
    courses = estimate_courses(estimate_campaign(logs), 0, TURBULENCE)
    for course, member, wind in zip(courses, logs.members, WINDS, strict=True):
        m = member.windows.measurements
        truth = np.array(wind) + departure(m.t)
        beside = MeasuredCourse.beside(course, m.t[m.usable], truth[m.usable])
        assert beside.correlation > 0.9
        assert beside.inside > 0.9
        error = np.sqrt(np.diag(course.covariance))
        assert (np.abs(course.mean - truth[m.usable].mean(axis=0)) < 3.0 * error).all()


def test_a_steady_wind_stays_steady() -> None:
    for course, wind in zip(estimate_courses(fitted(), 0, TURBULENCE), WINDS, strict=True):
        for name, value in zip(("north", "east"), wind, strict=True):
            assert np.std(course.value[name]) < 0.25
            assert np.mean(np.abs(course.value[name] - value) < course.half(name)) > 0.9


def test_a_wind_that_cannot_change_is_that_of_the_campaign() -> None:
    fit = fitted()
    for i, course in enumerate(estimate_courses(fit, 0, Turbulence(0.0, 1e-6, 30.0))):
        value, covariance = fit.condition(i, 0)
        assert course.mean == pytest.approx(value, abs=0.02)
        assert course.covariance == pytest.approx(covariance, rel=0.05, abs=1e-6)


def test_the_process_has_the_covariance_of_first_order() -> None:
    knots = _Knots.of(campaign().members[0].windows, 20.0)
    apart = np.abs(knots.t[:, None] - knots.t[None, :])
    assert np.linalg.inv(knots.precision(20.0)) == pytest.approx(np.exp(-apart / 20.0), abs=1e-9)
    t = campaign().members[0].windows.measurements.t
    inside = (t >= knots.t[0]) & (t <= knots.t[-1])
    assert (knots.parts @ knots.t)[inside] == pytest.approx(t[inside])
