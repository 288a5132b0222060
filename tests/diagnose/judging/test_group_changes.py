"""What may change between two groups of logs: a load, a wind, all thrusters; and the page and JSON of it."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from importlib.resources import files

import jsonschema
import numpy as np
import pytest

from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference.campaign_estimation import estimate_campaign
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import INDUCED, Campaign, HullPrior
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.group_differences import (
    compare_near,
    differences_of,
    in_groups,
)
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.group_differences import JudgedGroups, judge_groups, notes_of, smallest_note, summary
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.diagnose.versus import GroupLog, Versus, versus_json
from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel, hull_of
from ferryid.effects.fouling import SECOND_ORDER
from ferryid.effects.wording import ALL_THRUSTERS, listed
from ferryid.report.versus_report import as_text, render
from ferryid.types import no_progress
from ferryid.vessel.hull import payload_mass
from ferryid.vessel.wind import wind_force
from tests.diagnose.judging.test_held_out import FERRY, sailed

pytestmark = [pytest.mark.slow, pytest.mark.draws]

SPREAD = 0.3 * np.abs(hull_of(FERRY))
NONE = np.zeros(len(INDUCED))
WIND = Candidate.of(effects()["wind"], None, FERRY)
CALM = (0.0, 0.0)


@cache
def member(
    number: int,
    factors: tuple[float, float] = (1.0, 1.0),
    load: float = 0.0,
    wind: tuple[float, float] = CALM,
    fouled: float = 1.0,
) -> Member:
    """Return a log of two thrusters that give a share of what is believed of them, with a load 0.4 m forward."""
    second = {name for axis in SECOND_ORDER for name in axis}
    D = {name: value * (fouled if name in second else 1.0) for name, value in FERRY.hull.D.items()}
    hull = replace(FERRY.hull, M=FERRY.hull.M + payload_mass(np.array([load, 0.4])), D=D)
    whole = sailed(150.0 + 40.0 * number, np.array(wind), 0.02, hull)
    rows = slice(200 * number, None)
    names = ("t", "eta", "nu_raw", "nu", "parts", "angles", "usable")
    measured = replace(whole, **{name: getattr(whole, name)[rows] for name in names})
    force = measured.parts.sum(axis=1)
    share = (0.5 + 0.4 * np.sin(measured.t / 13.0))[:, None]
    parts = np.stack([share * force / factors[0], (1.0 - share) * force / factors[1]], axis=1)
    seen = windows(replace(measured, parts=parts, angles=np.full((len(parts), 2), np.nan)), *window_lengths(FERRY))
    thin = seen.measurements
    assert FERRY.wind is not None
    still = wind_force(FERRY.wind, np.zeros((len(thin.t), 2)), thin.psi, thin.nu)
    return Member(seen, ForceModel(thin, hull_of(FERRY), thin.parts, thin.angles, still))


def groups(a: list[Member], b: list[Member], known: bool = True) -> Campaign:
    spread = np.append(SPREAD, NONE)
    whole = Campaign((*a, *b), HullPrior(np.append(1.1 * hull_of(FERRY), NONE), spread, known))
    return in_groups(whole, ["A"] * len(a) + ["B"] * len(b))


@cache
def weak() -> JudgedGroups:
    return judge_groups(groups([member(0), member(1)], [member(2, (0.8, 1.0)), member(3, (0.8, 1.0))]), no_progress)


@pytest.mark.parametrize(("a", "b", "group"), [(0.0, 250.0, "B"), (250.0, 0.0, "A")])
def test_a_load_in_either_group_is_a_load(a: float, b: float, group: str) -> None:
    judged = judge_groups(
        groups([member(0, load=a), member(1, load=a)], [member(2, load=b), member(3, load=b)]), no_progress
    )
    (found,) = judged.sure
    assert (found.effect, found.group) == ("payload", group)
    assert found.estimates["mass"].low < 250.0 < found.estimates["mass"].high
    assert found.estimates["x"].value == pytest.approx(0.4, abs=0.2)


def test_what_scatters_from_log_to_log_is_no_difference_of_groups() -> None:
    factors = (0.7, 1.0, 1.3, 0.85, 1.15, 0.75)
    every = [member(number % 4, (factor, 1.0)) for number, factor in enumerate(factors)]
    mixed = estimate_campaign(groups(every[:3], every[3:]))
    (gain,) = (
        one for one in differences_of(mixed.campaign) if (*one.key, one.group) == ("thruster_gain", "thruster1", "B")
    )
    scattered = compare_near(mixed, gain)
    assert scattered.scatter * 0.2 > 0.1
    assert scattered.evidence < 3.0
    assert scattered.errors[0] > 0.1


def test_all_thrusters_alike_are_one_difference() -> None:
    judged = judge_groups(
        groups([member(0), member(1)], [member(2, (0.75, 0.75)), member(3, (0.75, 0.75))]), no_progress
    )
    (found,) = judged.differences
    assert found.key == ("thruster_gain", ALL_THRUSTERS)
    assert "all actuators alike" in found.says
    assert found.estimates["factor"].low < 0.75 < found.estimates["factor"].high


def test_fouling_between_groups_needs_no_hull_model() -> None:
    bare = replace(FERRY, hull=replace(FERRY.hull, D={}))
    clean = member(0)
    seen = replace(clean.windows, measurements=replace(clean.windows.measurements, profile=bare))
    found = differences_of(groups([replace(clean, windows=seen)], [member(1)], known=False))
    assert "fouling" in {one.effect.id for one in found}


@pytest.mark.parametrize("known", [True, False])
def test_fouling_is_confirmed_beside_a_known_hull_and_a_hint_beside_none(known: bool) -> None:
    judged = judge_groups(groups([member(0)], [member(1, fouled=2.0)], known), no_progress)
    (found,) = judged.differences
    assert found.effect == "fouling"
    assert found.doubt == ("" if known else "the damping that it multiplies is known from the same logs only")
    assert (found.probability > JUDGING.hint_probability) == known
    assert judged.verdict == ("different" if known else "perhaps")


def test_a_wind_in_one_group_is_a_load_and_no_difference_of_the_vessel() -> None:
    blown = [replace(member(k, wind=(-3.0, 2.0)), conditions=(WIND,)) for k in (2, 3)]
    calm = [replace(member(k), conditions=(WIND,)) for k in (0, 1)]
    judged = judge_groups(groups(calm, blown), no_progress)
    assert judged.differences == ()
    (wind,) = judged.loads
    assert wind.differs
    for name, true in (("north", -3.0), ("east", 2.0)):
        assert wind.estimates[name].low < true < wind.estimates[name].high
        assert wind.mean["A"][name] == pytest.approx(0.0, abs=0.6)
    assert "They differ in the mean steady wind" in summary(judged)


def test_text_page_and_json_have_the_difference() -> None:
    logs = {group: (GroupLog(f"log-{group}", f"{group}.mcap", 150.0, 70),) for group in ("A", "B")}
    campaign = groups([member(0)], [member(2, (0.8, 1.0))])
    found = Versus("ferry", logs, weak(), notes_of(weak(), campaign), summary(weak()), smallest_note(weak()))
    plain = json.loads(json.dumps({**versus_json(found), "report": "report.html"}))
    schema = json.loads(files("ferryid.schemas").joinpath("versus.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(plain, schema)
    assert plain["differences"][0]["instance"] == "thruster1"
    assert plain["differences"][0]["confirmed"]
    text = as_text(found)
    page, drawings = render(found, ("ferryid", "diagnose"))
    for shown in (text, page):
        assert "1 difference confirmed" in shown
        assert "Thruster force (thruster1), B relative to A: factor 0." in shown
        assert "With one log in each group" in shown
    assert drawings["differences"].startswith("<svg")
    for group, logs in found.groups.items():
        assert f"\n  {group}: {logs[0].name}\n" in text
    unseen = [replace(one, smallest=dict.fromkeys(one.smallest)) for one in found.judged.compared]
    blind = as_text(replace(found, judged=replace(found.judged, compared=tuple(unseen))))
    assert f"note: Would not have been seen at any size: {listed([one.title for one in unseen])}." in blind
