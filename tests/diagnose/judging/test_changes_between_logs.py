"""A load that comes aboard between logs, and a thruster that weakens, are found with size and time; alike logs have neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import INDUCED, Campaign, HullPrior
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.campaign import JudgedCampaign, judge_campaign
from ferryid.effects.force_model import ForceModel, Measurements, hull_of
from ferryid.effects.wording import ALL_THRUSTERS
from ferryid.types import no_progress
from ferryid.vessel.wind import wind_force
from tests.diagnose.inference.test_campaign_estimation import FERRY, SPREAD
from tests.diagnose.judging.test_held_out import sailed

pytestmark = pytest.mark.slow

MASS, X = 0.15 * FERRY.hull.mass_kg, 0.8
LOADED = replace(FERRY.hull, M=FERRY.hull.M + MASS * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, X], [0.0, X, X**2]]))
"""The vessel with a point mass aboard: Fossen (2021), equation 3.44, of the load alone."""


@cache
def sail(number: int, loaded: bool) -> Member:
    """Return a log of 240 s; each begins elsewhere in the same forces, and has noise of its own."""
    first = 300 * number
    whole = sailed(240.0 + 0.2 * first, np.zeros(2), hull=LOADED if loaded else FERRY.hull)
    rows = slice(first, None)
    cut = {name: getattr(whole, name)[rows] for name in ("t", "eta", "nu_raw", "nu", "parts", "angles", "usable")}
    return member_of(replace(whole, **cut))


def member_of(measurements: Measurements) -> Member:
    """Return a log with a force model whose coefficients are off by 15 %."""
    seen = windows(measurements, *window_lengths(FERRY))
    thin = seen.measurements
    still = wind_force(FERRY.wind, np.zeros((len(thin.t), 2)), thin.psi, thin.nu)  # type: ignore[arg-type]
    wrong = hull_of(FERRY) * np.where(np.arange(len(SPREAD)) % 2, 1.15, 0.85)
    return Member(seen, ForceModel(thin, wrong, thin.parts, thin.angles, still))


def campaign(loaded: Sequence[bool], order: Sequence[int] | None = None, known: bool = False) -> Campaign:
    return together([sail(number, one) for number, one in enumerate(loaded)], order, known)


def together(members: Sequence[Member], order: Sequence[int] | None = None, known: bool = False) -> Campaign:
    """Return a campaign of logs of a vessel, without a hull model unless it is known."""
    none = np.zeros(len(INDUCED))
    hull = HullPrior(np.append(members[0].plain.hull, none), np.append(SPREAD, none), known=known)
    return Campaign(tuple(members), hull, order=tuple(range(len(members)) if order is None else order))


def judged(whole: Campaign) -> JudgedCampaign:
    return judge_campaign(whole, {f"trials/{i}.bag": i for i in range(len(whole.members))}, no_progress)


def test_a_load_that_comes_aboard_is_found_in_the_logs_after_it() -> None:
    found = judged(campaign([False, False, False, True, True, True]))
    assert found.change is not None
    assert found.change.confirmed
    assert found.change.change.acting == (3, 4, 5)
    for name, true in (("mass", MASS), ("x", X)):
        estimate = found.change.difference.estimates[name]
        assert estimate.low < true < estimate.high
    assert found.change.difference.estimates["mass"].value == pytest.approx(MASS, rel=0.25)
    assert "more than in the 3 logs before" in found.change.says
    assert found.change.says.endswith("a load came aboard between 2.bag and 3.bag.")
    named = [[one.finding.effect for one in found.claims(f"trials/{i}.bag")].count("payload") for i in range(6)]
    assert named == [0, 0, 0, 1, 1, 1]
    assert found.notes[0] == found.change.says
    # What all logs say together has it aboard where it was.
    masses = [found.hull.fit.force_model(i).load is not None for i in range(6)]
    assert masses == [False, False, False, True, True, True]


def test_a_load_that_is_put_ashore_is_found_in_the_logs_before_it_whatever_their_order() -> None:
    found = judged(campaign([False, True, False, True, True], order=(1, 4, 3, 0, 2)))
    assert found.change is not None
    assert found.change.change.acting == (1, 4, 3)
    assert found.change.says.endswith("a load was put ashore between 3.bag and 0.bag.")
    assert "more than in the 2 logs after" in found.change.says


@pytest.mark.parametrize("loaded", [[False] * 6, [True] * 6], ids=["none", "aboard all along"])
def test_logs_that_are_alike_have_no_change(loaded: list[bool]) -> None:
    assert judged(campaign(loaded)).change is None


def test_one_log_that_differs_is_no_change() -> None:
    assert judged(campaign([False, False, False, False, True])).change is None


def test_a_load_that_was_measured_is_not_sought() -> None:
    whole = campaign([False, False, False, True, True, True])
    first = whole.members[0]
    known = np.zeros((len(first.windows.measurements.t), 2))
    measured = replace(first.windows, measurements=replace(first.windows.measurements, payload=known))
    plain = replace(first.plain, measurements=measured.measurements)
    told = replace(whole, members=(replace(first, windows=measured, plain=plain), *whole.members[1:]))
    assert judged(told).change is None


def test_no_load_of_all_logs_is_hinted_at_beside_one_of_some_that_it_stood_in_for() -> None:
    found = judged(campaign([False, False, False, True, True, True], known=True))
    assert found.change is not None
    assert found.change.confirmed
    named = [[one.finding.effect for one in found.claims(f"trials/{i}.bag")].count("payload") for i in range(6)]
    assert named == [0, 0, 0, 1, 1, 1]


NAMES = tuple(one.name for one in FERRY.actuators)


def weakening(factors: Sequence[float], names: Sequence[str] = NAMES[:1], known: bool = False) -> JudgedCampaign:
    """Judge logs in which actuators gave these parts of the force that their thrust curves say."""
    members = []
    for number, factor in enumerate(factors):
        first = 300 * number
        whole = sailed(240.0 + 0.2 * first, np.zeros(2))
        rows = slice(first, None)
        cut = {name: getattr(whole, name)[rows] for name in ("t", "eta", "nu_raw", "nu", "parts", "angles", "usable")}
        share = (0.5 + 0.4 * np.sin(cut["t"] / 13.0))[:, None]
        force = cut["parts"].sum(axis=1)
        parts = np.stack([share * force, (1.0 - share) * force], axis=1)
        for name in names:
            # What truly acted is a factor of what the record says.
            parts[:, NAMES.index(name)] /= factor
        members.append(member_of(replace(whole, **{**cut, "parts": parts})))
    return judged(together(members, known=known))


@pytest.mark.parametrize("known", [False, True], ids=["no hull model", "hull known"])
def test_a_thruster_that_weakens_between_logs_is_found_in_the_logs_after_it(known: bool) -> None:
    found = weakening([1.0, 1.0, 1.0, 0.7, 0.7, 0.7], known=known)
    assert found.change is not None
    assert found.change.confirmed
    assert found.change.change.candidate.key == ("thruster_gain", NAMES[0])
    assert found.change.change.acting == (3, 4, 5)
    factor = found.change.difference.estimates["factor"]
    assert factor.low < 0.7 < factor.high
    assert factor.value == pytest.approx(0.7, abs=0.03)
    assert f"{NAMES[0]} gave 70 % of the force that it had in the 3 logs before" in found.change.says
    assert found.change.says.endswith("it weakened between 2.bag and 3.bag.")
    named = [[one.finding.effect for one in found.claims(f"trials/{i}.bag") if one.finding.sure] for i in range(6)]
    assert named == [[], [], [], ["thruster_gain"], ["thruster_gain"], ["thruster_gain"]]


def test_a_thruster_that_was_mended_is_found_in_the_logs_before_it() -> None:
    found = weakening([0.7, 0.7, 1.0, 1.0, 1.0], known=True)
    assert found.change is not None
    assert found.change.confirmed
    assert found.change.change.acting == (0, 1)
    factor = found.change.difference.estimates["factor"]
    assert factor.low < 0.7 < factor.high
    assert found.change.says.endswith("it came back between 1.bag and 2.bag.")


def test_actuators_that_all_weaken_alike_are_one_change() -> None:
    found = weakening([1.0, 1.0, 1.0, 0.8, 0.8, 0.8], NAMES, known=True)
    assert found.change is not None
    assert found.change.confirmed
    assert found.change.change.candidate.key == ("thruster_gain", ALL_THRUSTERS)
    assert found.change.difference.estimates["factor"].value == pytest.approx(0.8, abs=0.03)
    assert "Every actuator gave 80 %" in found.change.says


@pytest.mark.parametrize("factor", [1.0, 0.7])
def test_a_thruster_that_is_alike_in_all_logs_is_no_change(factor: float) -> None:
    assert weakening([factor] * 4, known=True).change is None
