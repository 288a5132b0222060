"""A log of another vessel in a campaign, references of another vessel, and logs of one vessel in different winds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ferryid.diagnose.inference.campaign import assemble
from ferryid.diagnose.inference.campaign_estimation import estimate_campaign
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.judging import campaign_split
from ferryid.diagnose.judging.campaign_evidence import Gain
from ferryid.diagnose.judging.campaign_split import HullDistance, Split, _Logs, find_split
from ferryid.types import Floats
from ferryid.vessel import load_profile
from tests.diagnose.inference.test_campaign_estimation import CALM, WINDS, campaign
from tests.diagnose.judging.test_group_differences import groups
from tests.diagnose.trials import averaged

pytestmark = pytest.mark.slow

NONE = np.zeros(3, dtype=np.bool_)


def heavy(member: Member, factor: float) -> Member:
    """Return a log as of a vessel on which forces of all actuators are a factor larger."""
    plain = replace(member.plain, parts=factor * member.plain.parts)
    measured = replace(member.windows.measurements, parts=factor * member.windows.measurements.parts)
    return replace(member, windows=replace(member.windows, measurements=measured), plain=plain)


@pytest.mark.parametrize("winds", [WINDS, CALM])
def test_logs_of_one_vessel_stay_together_in_whatever_wind(winds: tuple[tuple[float, float], ...]) -> None:
    assert find_split(campaign(winds), NONE) is None


def test_a_log_of_another_vessel_is_found() -> None:
    split = find_split(campaign(factor=2.0), NONE)
    assert split is not None
    assert split.inside.tolist() == [False, False, True]
    assert split.gain.low > 30.0
    assert split.ratio > 2.5


def test_references_of_another_vessel_are_found() -> None:
    members = campaign().members
    other = tuple(heavy(one, 2.0) for one in members[1:])
    split = find_split(Campaign((*members[:2], *other), campaign().hull), np.array([False, False, True, True]))
    assert split is not None
    assert split.inside.tolist() in ([False, False, True, True], [True, True, False, False])


@pytest.mark.parametrize(("gain", "ratio", "found"), [(676.0, 6.5, True), (676.0, 1.5, False), (50.0, 6.5, False)])
def test_a_hull_that_a_wind_hides_is_judged_beside_the_wind(
    gain: float, ratio: float, found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without any wind two hulls are far likelier, and leave nearly as much of the force error, which is the wind's."""
    inside = np.array([False, True, True])
    told = iter(
        [Split(inside, Gain(392.0, 322.0, 460.0), 1.7), Split(inside, Gain(gain, 0.8 * gain, 1.2 * gain), ratio)]
    )
    monkeypatch.setattr(campaign_split, "_judged", lambda made, ways: [next(told)])
    split = find_split(campaign(), NONE)
    assert (split is not None) == found
    if split is not None:
        assert (split.gain.total, split.ratio) == (gain, ratio)


def test_a_thruster_that_weakened_between_logs_is_no_other_hull(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = groups((1.0, 1.0, 0.4), ("", "", ""))
    whole = replace(whole, order=tuple(range(len(whole.members))))
    none = np.zeros(len(whole.members), dtype=np.bool_)
    assert find_split(whole, none) is None
    # Unless the change is found, they are told apart as two vessels.
    monkeypatch.setattr(campaign_split, "find_change", lambda made: None)
    split = find_split(whole, none)
    assert split is not None
    assert split.inside.tolist() == [False] * 4 + [True] * 2


def mixed(factor: float) -> Campaign:
    """Return six logs of which the second, fourth and fifth are of a vessel on which all forces are a factor larger."""
    whole = groups((1.0, 1.0, 1.0), ("", "", ""))
    members = [heavy(one, factor) if i in (1, 3, 4) else one for i, one in enumerate(whole.members)]
    # Nobody has modelled the hull.
    unknown = replace(whole.hull, known=False, spread=5.0 * whole.hull.spread)
    return replace(whole, members=tuple(members), hull=unknown)


def test_logs_of_two_vessels_are_told_apart_in_whatever_order() -> None:
    split = find_split(mixed(2.5), np.zeros(6, dtype=np.bool_))
    assert split is not None
    assert split.inside.tolist() == [True, False, True, False, False, True]
    assert split.apart
    assert split.hulls.share > 0.55


def test_logs_whose_hulls_differ_by_a_quarter_stay_together() -> None:
    whole = mixed(1.3)
    (alike,) = _Logs(estimate_campaign(whole)).alike()
    assert alike.tolist() == [True, False, True, False, False, True]
    (split,) = campaign_split._judged(estimate_campaign(whole), [alike])
    # They are known to differ, by what a factor of all forces makes of a hull.
    assert split.hulls.evidence > 70.0
    assert split.hulls.share == pytest.approx(1.0 - 1.0 / 1.3, abs=0.03)
    assert find_split(whole, np.zeros(6, dtype=np.bool_)) is None


def test_logs_of_one_hull_are_all_alike() -> None:
    assert _Logs(estimate_campaign(mixed(1.0))).alike() == []


@pytest.mark.parametrize(
    ("gain", "low", "hulls", "apart"),
    [
        (160.0, 70.0, (90.0, 4.0, 0.6), True),
        (79.0, 70.0, (90.0, 4.0, 0.6), False),
        (160.0, 50.0, (90.0, 4.0, 0.6), False),
        (160.0, 70.0, (66.0, 4.0, 0.6), False),
        (160.0, 70.0, (90.0, 2.9, 0.6), False),
        (160.0, 70.0, (90.0, 4.0, 0.37), False),
    ],
)
def test_hulls_are_apart_where_all_figures_say_so(
    gain: float, low: float, hulls: tuple[float, float, float], apart: bool
) -> None:
    split = Split(np.array([True, False]), Gain(gain, low, 2.0 * gain), 1.2, HullDistance(*hulls))
    assert split.apart == apart


@pytest.mark.parametrize(
    ("gain", "low", "ratio", "hulls", "apart"),
    [
        (123.0, 47.0, 1.6, (63.0, 2.6, 0.73), True),
        (79.0, 47.0, 1.6, (63.0, 2.6, 0.73), False),
        (123.0, -1.0, 1.6, (63.0, 2.6, 0.73), False),
        (123.0, 47.0, 1.2, (63.0, 2.6, 0.73), False),
        (123.0, 47.0, 1.6, (52.0, 2.6, 0.73), False),
        (123.0, 47.0, 1.6, (63.0, 2.6, 0.57), False),
    ],
)
def test_hulls_that_share_little_are_apart_where_the_error_says_so_too(
    gain: float, low: float, ratio: float, hulls: tuple[float, float, float], apart: bool
) -> None:
    split = Split(np.array([True, False]), Gain(gain, low, 2.0 * gain), ratio, HullDistance(*hulls))
    assert split.apart == apart


def test_a_log_that_is_near_to_either_part_stays_with_the_others() -> None:
    """A zigzag that said little of its hull was parted from the others with a log of another vessel."""

    def way(places: Sequence[int], gain: float) -> Split:
        inside = np.isin(np.arange(6), places)
        return Split(inside, Gain(gain, 0.5 * gain, 2.0 * gain), 1.2, HullDistance(90.0, 4.0, 0.6))

    both, alone, other = way([4, 5], 217.0), way([5], 140.0), way([1], 90.0)
    assert campaign_split._fewest([other, both, alone]) == [alone]
    assert campaign_split._fewest([other, both]) == [both]
    assert campaign_split._fewest([]) == []


def with_odd_one(odd: Member) -> Campaign:
    """Return five logs of one vessel, and another one."""
    whole = groups((1.0, 1.0, 1.0), ("", "", ""))
    members = (*whole.members[:5], odd)
    return replace(whole, members=members, order=tuple(range(len(members))))


def test_a_thruster_that_is_weak_in_one_log_explains_why_no_hull_fits() -> None:
    split = find_split(with_odd_one(groups((1.0, 1.0, 0.4), ("", "", "")).members[5]), np.zeros(6, dtype=np.bool_))
    assert split is not None
    assert np.flatnonzero(split.inside).tolist() == [5]
    assert split.change is not None
    assert split.change.confirmed
    assert split.change.difference.estimates["factor"].value == pytest.approx(0.4, abs=0.03)
    assert split.change.says.startswith("thruster1 gave 4")
    assert split.change.says.endswith(" % of the force that it had in the 5 other logs: in 5 alone.")


def test_what_changed_at_a_time_beside_it_hides_no_weak_thruster_of_one_log(monkeypatch: pytest.MonkeyPatch) -> None:
    """The best that a time makes of one log leaves it apart: a load from the third log on stood in for a thruster in it."""
    whole = with_odd_one(groups((1.0, 1.0, 0.4), ("", "", "")).members[5])
    load = SimpleNamespace(scales_all=False, fit=SimpleNamespace(campaign=whole))
    monkeypatch.setattr(campaign_split, "find_change", lambda _: load)
    split = find_split(whole, np.zeros(6, dtype=np.bool_))
    assert split is not None
    assert split.change is not None
    assert split.change.says.startswith("thruster1 gave 4")


def test_a_thruster_that_gives_hardly_any_force_is_no_other_vessel_however_far_the_hulls_are_apart() -> None:
    none = np.zeros(6, dtype=np.bool_)
    for odd, weak in ((groups((1.0, 1.0, 0.2), ("", "", "")), True), (groups((1.0, 1.0, 1.0), ("", "", "")), False)):
        member = odd.members[5] if weak else heavy(odd.members[5], 2.0)
        whole = with_odd_one(member)
        found = campaign_split._found(whole, none)
        assert found is not None
        far = replace(found, gain=Gain(200.0, 100.0, 300.0), hulls=HullDistance(90.0, 5.0, 0.7))
        assert far.apart
        split = campaign_split._with_change(far, estimate_campaign(whole), none)
        assert (split.change is not None) == weak
        assert split.apart != weak


def test_no_load_or_thruster_explains_another_vessel() -> None:
    whole = with_odd_one(heavy(groups((1.0, 1.0, 1.0), ("", "", "")).members[5], 2.0))
    split = find_split(whole, np.zeros(6, dtype=np.bool_))
    assert split is not None
    assert np.flatnonzero(split.inside).tolist() == [5]
    assert split.change is None


def test_hulls_that_a_wind_explains_are_not_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = campaign()
    inside = np.array([False, False, True])
    bare = Split(inside, Gain(160.0, 70.0, 250.0), 1.2, HullDistance(90.0, 4.0, 0.6))
    for evidence, found in ((60.0, True), (50.0, False)):
        told = iter([bare, Split(inside, Gain(20.0, -50.0, 90.0), 1.1, HullDistance(evidence, 2.0, 0.6))])
        monkeypatch.setattr(campaign_split, "_judged", lambda made, ways, told=told: [next(told)])
        assert (find_split(whole, NONE) is not None) == found


COLUMNS = {
    "t [s]": "t",
    "x_position_mid [m]": "x",
    "u_velo [m/s]": "u",
    "y_position_mid [m]": "y",
    "vm_velo [m/s]": "v",
    "psi_hat [rad]": "psi",
    "r_angvelo [rad/s]": "r",
    "n_prop [rps]": "n",
    "delta_rudder [rad]": "rudder",
    "wind_velo_relative_mid [m/s]": "air",
    "wind_dir_relative_mid [rad]": "air_from",
}
"""Columns of Esso Osaka's logs."""


def renamed(tanker: Path, path: Path) -> str:
    """Write a log of the KVLCC2's model in the columns, units and axes of Esso Osaka's, in still air, and return its path."""
    t, x, y, psi, u, v, r, _, rudder, n = np.loadtxt(tanker, skiprows=4, encoding="cp1252").T[:10]
    heading = np.deg2rad(psi)
    ahead, aside = np.cos(heading) * u + np.sin(heading) * v, np.cos(heading) * v - np.sin(heading) * u
    every: dict[str, Floats] = {
        "t": t,
        "x": x,
        "y": y,
        "psi": heading,
        "u": ahead,
        "v": aside,
        "r": np.deg2rad(r),
        "n": n,
    }
    every |= {"rudder": -np.deg2rad(rudder), "air": np.hypot(u, v), "air_from": np.arctan2(aside, ahead)}
    rows = np.column_stack([every[name] for name in COLUMNS.values()])[::2]
    np.savetxt(path, rows, delimiter=",", header=",".join(COLUMNS), comments="")
    return str(path)


def test_logs_of_another_tanker_are_found_among_recorded_ones(
    shared_data: Callable[[str], Path], tmp_path: Path
) -> None:
    """Much of the force error of the pond's logs is noise, so that one hull for both leaves hardly more of it."""
    profile = load_profile("esso-osaka")
    own = [str(one) for one in sorted(shared_data("esso_osaka/random").glob("*.csv"))]
    foreign = [renamed(one, tmp_path / f"{one.stem}.csv") for one in sorted(shared_data("kvlcc2").glob("*.dat"))[:3]]
    for paths in ([*own[:8], foreign[0]], [own[0], foreign[0], own[1], foreign[1], own[2], foreign[2], own[3]], own):
        assembled = assemble(averaged(paths, profile), profile)
        assert assembled is not None
        found, place = assembled
        split = find_split(found, np.zeros(len(paths), dtype=np.bool_))
        if paths == own:
            assert split is None
            continue
        assert split is not None
        assert split.ratio < 2.5
        assert {path for path in paths if split.inside[place[path]]} == set(paths) & set(foreign)


def test_a_log_of_another_tanker_is_found_among_zigzags(shared_data: Callable[[str], Path], tmp_path: Path) -> None:
    """Zigzags hide either hull in noise, so that the gain is not sure by much."""
    profile = load_profile("esso-osaka")
    own = [str(one) for one in sorted(shared_data("esso_osaka/zigzag").glob("*.csv"))[:8]]
    foreign = renamed(shared_data("kvlcc2") / "HSVA_CPMC_KVLCC2_Z_20_10_P.dat", tmp_path / "tank.csv")
    for paths in ([*own, foreign], own):
        assembled = assemble(averaged(paths, profile), profile)
        assert assembled is not None
        found, place = assembled
        split = find_split(found, np.zeros(len(paths), dtype=np.bool_))
        parted = set() if split is None else {path for path in paths if split.inside[place[path]]}
        assert parted == set(paths) - set(own)
