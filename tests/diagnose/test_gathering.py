"""Which logs of a campaign are used, and which belong together: a change of hull between days, a foreign log, references."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Barrier
from typing import Any

import numpy as np
import pytest

from ferryid import side_by_side
from ferryid.diagnose import gathering
from ferryid.diagnose.gathering import (
    CAMPAIGN,
    REFERENCES,
    Gathered,
    Group,
    _clocks,
    engaged,
    gather,
    part,
    sort_out,
    unused,
    whole,
    without_logs,
)
from ferryid.diagnose.inference.baselines import HullBaseline
from ferryid.diagnose.inference.campaign import assemble
from ferryid.diagnose.inference.sessions import in_time
from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.judging.campaign import judge_campaign
from ferryid.diagnose.pipeline import JudgedGroup
from ferryid.effects.force_model import COEFFICIENTS
from ferryid.effects.wording import MEANS_LITTLE
from ferryid.errors import FerryIdError
from ferryid.identify.engagement import ForceResponse, pooled
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.types import IN_MEMORY, no_progress
from ferryid.vessel import load_profile
from tests.diagnose.trials import FERRY

pytestmark = pytest.mark.slow

SCENARIO = """schema = "ferryid.scenario/1"
vessel = "milliampere"
start = 2021-04-2{day}T1{hour}:00:00Z
path = {{ kind = "twelve-corner", dwell_s = 15 }}
controller = {{ delta = 0.7, sigma = 0.7 }}
sensors = {{ imu_rate_hz = 0.0, camera_rate_hz = 0.0 }}
"""
HEAVY = 1.7


@pytest.fixture(scope="module")
def days(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Two days of two logs, with files of one name; on the second all of the vessel's hull is larger."""
    folder, made = tmp_path_factory.mktemp("days"), []
    for day in (0, 1):
        for hour in (1, 2):
            scenario = parse_scenario(SCENARIO.format(day=day, hour=hour), f"run{hour}")
            hull = dict.fromkeys((name for name in COEFFICIENTS if name[2:] not in ("23", "32")), HEAVY) if day else {}
            path = folder / f"day{day + 1}" / f"run{hour}.mcap"
            path.parent.mkdir(exist_ok=True)
            write_log(simulate(replace(scenario, true_hull=hull), 10 * day + hour), path)
            made.append(str(path))
    return made


@pytest.fixture(scope="module")
def logs(days: list[str]) -> tuple[AveragedLog, ...]:
    return gather(days, FERRY, IN_MEMORY).logs


def paths(found: tuple[AveragedLog, ...]) -> list[str]:
    return [one.path for one in found]


def test_a_campaign_is_split_where_the_hull_changed(days: list[str], logs: tuple[AveragedLog, ...]) -> None:
    # The order in which logs are given is not that of time.
    groups = part(Gathered((*logs[2:], *logs[:2])), Gathered(()), FERRY, None)
    assert [paths(one.logs) for one in groups] == [days[:2], days[2:]]
    for group in groups:
        note, split = group.notes
        assert note.startswith("No common hull fits")
        assert split.startswith("The campaign is split: each side has a hull of its own")
        assert "day1/run1.mcap and day1/run2.mcap" in note


def test_logs_that_are_compared_as_one_group_stay_together_but_for_a_single_one(
    days: list[str], logs: tuple[AveragedLog, ...]
) -> None:
    both = whole(Gathered(logs), FERRY, None)
    assert paths(both.logs) == days
    note, stay = both.notes
    assert note.startswith("No common hull fits day1/run1.mcap and day1/run2.mcap on one side")
    assert stay.startswith("They stay together here")
    rest = whole(Gathered(logs[:3]), FERRY, None)
    assert paths(rest.logs) == days[:2]
    assert len(rest.notes) == 1


def test_a_log_of_another_vessel_is_left_out(days: list[str], logs: tuple[AveragedLog, ...]) -> None:
    (group,) = part(Gathered(logs[:3]), Gathered(()), FERRY, None)
    assert paths(group.logs) == days[:2]
    (note,) = group.notes
    assert note.startswith(f"Left out of the campaign: {days[2]}: no common hull fits it and the 2 other logs")


def test_a_log_with_a_weak_thruster_stays_with_what_changed_in_it(
    logs: tuple[AveragedLog, ...], days: list[str], tmp_path: Path
) -> None:
    """No common hull fits it, and beside the loss of force one does; a group that is compared has it left out with that."""
    weak = str(tmp_path / "weak.mcap")
    fault = '[[thrusters.faults]]\nthruster = "thruster1"\nfactor = 0.3\nfrom_s = 0\n'
    write_log(simulate(parse_scenario(SCENARIO.format(day=0, hour=3) + fault, "weak"), 7), Path(weak))
    extra = str(tmp_path / "run4.mcap")
    write_log(simulate(parse_scenario(SCENARIO.format(day=0, hour=4), "run4"), 8), Path(extra))
    every = Gathered((*logs[:2], *gather([weak, extra], FERRY, IN_MEMORY).logs))
    (group,) = part(every, Gathered(()), FERRY, None)
    assert (paths(group.logs), group.changed, group.notes) == ([*days[:2], weak, extra], {weak}, ())
    assembled = assemble([every.logs[i] for i in in_time(every.logs)], FERRY)
    assert assembled is not None
    together = judge_campaign(*assembled, no_progress, group.changed)
    assert together.change is not None
    assert together.change.confirmed
    assert together.change.says.startswith("thruster1 gave 3")
    assert together.change.says.endswith(" % of the force that it had in the 3 other logs: in weak.mcap alone.")
    assert [one.finding.effect for one in together.claims(weak)] == ["thruster_gain"]
    assert together.claims(days[0]) == ()
    assert not JudgedGroup(group, HullBaseline(FERRY, None), together).unconfirmed
    assert JudgedGroup(group, HullBaseline(FERRY, None), replace(together, change=None)).unconfirmed
    alone = whole(every, FERRY, None)
    assert paths(alone.logs) == [*days[:2], extra]
    (note,) = alone.notes
    assert note.startswith(f"Left out of the campaign: {weak}: no common hull fits it and the 3 other logs (")
    assert "One hull fits all of them beside this, as where they are of one vessel: thruster1 gave 3" in note
    assert "Fix: see what differs with ferryid diagnose OTHERS... --versus LOG..., or diagnose it with --each" in note


def test_references_of_another_vessel_are_left_out(days: list[str], logs: tuple[AveragedLog, ...]) -> None:
    (group,) = part(Gathered(logs[:1]), Gathered(logs[2:]), FERRY, None)
    assert (paths(group.logs), group.references) == (days[:1], ())
    (note,) = group.notes
    assert note.startswith("Left out of the references: day2/run1.mcap and run2.mcap: no common hull")


def test_logs_and_references_of_one_vessel_stay_together(logs: tuple[AveragedLog, ...]) -> None:
    (group,) = part(Gathered(logs[:1]), Gathered(logs[1:2]), FERRY, None)
    assert (group.logs, group.references, group.notes) == (logs[:1], logs[1:2], ())


def test_times_that_overlap_are_noted(days: list[str], tmp_path: Path) -> None:
    path = tmp_path / "late.mcap"
    late = parse_scenario(SCENARIO.format(day=0, hour=1).replace("T11:00", "T11:01"), "late")
    write_log(simulate(late, 5), path)
    (note,) = gather([days[0], str(path)], FERRY, IN_MEMORY).notes
    assert note.startswith("The times of logs overlap")
    assert "run1.mcap and late.mcap by" in note
    assert gather(days[:2], FERRY, IN_MEMORY).notes == ()


def test_a_copy_is_left_out_with_its_line(days: list[str], tmp_path: Path) -> None:
    copy = shutil.copy(days[0], tmp_path / "again.mcap")
    found = gather([days[0], days[1], str(copy)], FERRY, IN_MEMORY)
    assert [one.path for one in found.logs] == days[:2]
    assert found.copies == ((str(copy), days[0]),)
    (note,) = found.notes
    assert note.startswith(
        f"Left out of the campaign: {copy}: it holds the motion of run1.mcap, as the same recording does"
    )
    groups = part(found, Gathered(()), FERRY, None)
    assert all(one.copies == found.copies for one in groups)


def doubtful(log: AveragedLog, **changed: object) -> AveragedLog:
    """Return a log with something else known of it."""
    measured = log.screened.measured
    survey = replace(measured.survey, **changed)  # type: ignore[arg-type]
    return replace(log, screened=replace(log.screened, measured=replace(measured, survey=survey)))


def test_a_log_that_contradicts_itself_is_left_out_where_most_do_not(logs: tuple[AveragedLog, ...]) -> None:
    wrong = doubtful(logs[2], contradictions=("The surge velocity has the wrong sign.",))
    kept, (note,) = sort_out([*logs[:2], wrong], "campaign")
    assert kept == list(logs[:2])
    assert note.startswith(f"Left out of the campaign: {wrong.path}: its signals contradict each other")
    assert "The surge velocity has the wrong sign. Fix:" in note
    # Of two logs, nobody knows which is right.
    assert sort_out([logs[0], wrong], "campaign") == ([logs[0], wrong], [])


def test_logs_that_cannot_show_a_contradiction_do_not_count_as_agreeing(logs: tuple[AveragedLog, ...]) -> None:
    wrong = [doubtful(one, contradictions=("The surge velocity has the wrong sign.",)) for one in logs[:2]]
    short = [doubtful(one, comparable=False) for one in logs[2:] * 3]
    assert len(short) > len(wrong)
    assert sort_out([*wrong, *short], "campaign") == ([*wrong, *short], [])
    longer = [replace(one) for one in logs[2:] * 3]
    assert sort_out([*wrong, *longer], "campaign")[0] == longer


def test_a_clock_that_was_not_set_is_noted(logs: tuple[AveragedLog, ...]) -> None:
    early = doubtful(logs[1], t0_ns=5_000_000_000)
    (note,) = _clocks([logs[0], early])
    assert note.startswith("The clock was not set in run2.mcap")
    assert _clocks([early]) == ()
    assert _clocks(logs[:2]) == ()


def test_simulated_logs_among_recorded_ones_are_left_out(
    logs: tuple[AveragedLog, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    artificial = {logs[0].path}
    monkeypatch.setattr(gathering, "_simulated", lambda one: "it has no noise" if one.path in artificial else "")
    kept, (note,) = sort_out(logs[:2], "references")
    assert kept == [logs[1]]
    assert note.startswith(f"Left out of the references: {logs[0].path}: it is simulated among recorded logs")
    artificial.add(logs[1].path)
    kept, notes = sort_out(logs[:2], "campaign")
    assert kept == list(logs[:2])
    assert [one.split(": ")[0] for one in notes] == [f"{one.path} is no recording of a vessel" for one in logs[:2]]


def test_references_that_are_logs_are_refused(logs: tuple[AveragedLog, ...]) -> None:
    kept = without_logs(Gathered(logs[1:3]), logs[:1])
    assert kept.logs == logs[1:3]
    again = replace(logs[0], screened=replace(logs[0].screened, measured=replace(logs[0].screened.measured, path="b")))
    assert without_logs(Gathered((again, logs[1])), logs[:1]).logs == logs[1:2]
    with pytest.raises(FerryIdError, match="holds the motion of"):
        without_logs(Gathered((again,)), logs[:1])


def test_logs_are_measured_side_by_side_and_stay_in_their_order(
    days: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    together, measure = Barrier(2, timeout=30.0), gathering.measure_log

    def met(path: str, *rest: Any, **more: Any) -> Any:
        together.wait()
        return measure(path, *rest, **more)

    monkeypatch.setattr(side_by_side, "usable_cores", lambda: 2)
    monkeypatch.setattr(gathering, "measure_log", met)
    assert [one.path for one in gather(days[:2], FERRY, IN_MEMORY).logs] == days[:2]


def test_a_path_given_twice_counts_once(tmp_path: Path) -> None:
    fixtures = Path(__file__).resolve().parents[2] / "fixtures"
    log = str(shutil.copy(fixtures / "short.mcap", tmp_path / "a.mcap"))
    found = gather([log, f"{tmp_path}/../{tmp_path.name}/a.mcap"], FERRY, IN_MEMORY)
    assert [one.path for one in found.logs] == [log]
    assert any(note == f"Given twice: {log}: it counts once" for note in found.notes)


def test_a_piece_of_a_log_is_left_out(tmp_path: Path) -> None:
    fixtures = Path(__file__).resolve().parents[2] / "fixtures"
    found = gather([str(fixtures / "short.mcap"), str(fixtures / "short_ros2")], FERRY, IN_MEMORY)
    assert [Path(one.path).name for one in found.logs] == ["short.mcap"]
    assert [Path(path).name for path, _ in found.copies] == ["short_ros2"]


def adrift(log: AveragedLog) -> AveragedLog:
    """Return a log in which the vessel follows the applied force by a hundredth."""
    response = ForceResponse(np.full(3, 0.01), np.full(3, 0.002), np.full(3, 4.0), np.ones(3, dtype=bool), np.ones(3))
    return replace(log, screened=replace(log.screened, measured=replace(log.screened.measured, response=response)))


def test_a_log_says_whether_its_vessel_follows_the_applied_force(logs: tuple[AveragedLog, ...]) -> None:
    response = logs[0].screened.measured.response
    assert response is not None
    assert response.answered


def test_logs_that_take_part_in_no_group_come_with_their_reasons(logs: tuple[AveragedLog, ...]) -> None:
    start = "Left out of the campaign: "
    notes = (
        f"{start}run10: too short",
        f"{start}a/run1.mcap: no velocity",
        f"{start}the column t of run7 is empty",
        "Other",
    )
    group = Group(logs[1:2], notes=notes, copies=(("b.mcap", logs[1].path),))
    found = dict(unused([logs[1].path, "a/run1.mcap", "a/run10.mcap", "run7.csv", "b.mcap", "twice.mcap"], [group]))
    assert found == {"a/run1.mcap": notes[1], "a/run10.mcap": notes[0], "run7.csv": notes[2]}


def test_logs_whose_actuators_were_not_engaged_are_left_out(days: list[str], logs: tuple[AveragedLog, ...]) -> None:
    (found,) = engaged([(CAMPAIGN, Gathered((logs[0], adrift(logs[1]), logs[2]), ("before",)))], FERRY)
    assert paths(found.logs) == [days[0], days[2]]
    before, note = found.notes
    assert before == "before"
    assert note.startswith(
        f"Left out of the campaign: {days[1]}: the applied forces accelerate the vessel by surge 0.01"
    )
    assert "In other logs the vessel follows them. Fix: see whether the actuators were engaged in this log" in note


def test_the_logs_of_another_group_show_it_too(days: list[str], logs: tuple[AveragedLog, ...]) -> None:
    references = Gathered((adrift(logs[1]),))
    campaign, left = engaged([(CAMPAIGN, Gathered(logs[:1])), (REFERENCES, references)], FERRY)
    assert (campaign, left.logs) == (Gathered(logs[:1]), ())
    assert left.notes[0].startswith(f"Left out of the references: {days[1]}: the applied forces")
    # What is to be diagnosed or compared stays, as there is nothing else.
    _, alone = engaged([(CAMPAIGN, Gathered(logs[:1])), (CAMPAIGN, references)], FERRY)
    assert paths(alone.logs) == [days[1]]
    assert f"{MEANS_LITTLE} Fix:" in alone.notes[0]


def test_a_log_by_itself_comes_with_what_explains_that_its_force_has_no_answer(
    days: list[str], logs: tuple[AveragedLog, ...]
) -> None:
    (found,) = engaged([(CAMPAIGN, Gathered((adrift(logs[0]), adrift(logs[1]), logs[2])))], FERRY)
    assert len(found.logs) == 3
    (note,) = found.notes
    assert note.startswith(f"{Path(days[0]).name}: the applied forces accelerate the vessel by surge 0.01")
    assert (
        f"{MEANS_LITTLE} So it is in 1 more log. Fix: see whether the actuators were engaged, or in milliampere, correct"
        in note
    )
    assert "Left out" not in note
    assert engaged([(CAMPAIGN, Gathered(logs[:1]))], FERRY) == (Gathered(logs[:1]),)


def mirrored(log: AveragedLog) -> AveragedLog:
    """Return a log in which the yaw moment turns the vessel the other way."""
    way, reach = np.array([0.9, 0.9, -0.9]), np.full(3, 0.05)
    response = ForceResponse(way, reach, np.full(3, 2.3), np.ones(3, dtype=bool), np.ones(3))
    return replace(log, screened=replace(log.screened, measured=replace(log.screened.measured, response=response)))


def test_logs_whose_forces_act_the_other_way_are_left_out(days: list[str], logs: tuple[AveragedLog, ...]) -> None:
    (found,) = engaged([(CAMPAIGN, Gathered((logs[0], mirrored(logs[1]), logs[2])))], FERRY)
    assert paths(found.logs) == [days[0], days[2]]
    (note,) = found.notes
    said = "the yaw moment of the actuators turns the vessel the other way (-0.9 ± 0.05 times what the base model expects; "
    assert note.startswith(f"Left out of the campaign: {days[1]}: {said}")
    assert "in the 2 other logs). Fix: see whether" in note
    # What is compared stays, as there is nothing else.
    _, alone = engaged([(CAMPAIGN, Gathered((logs[0], logs[2]))), (CAMPAIGN, Gathered((mirrored(logs[1]),)))], FERRY)
    assert paths(alone.logs) == [days[1]]
    (note,) = alone.notes
    assert note.startswith(f"{Path(days[1]).name}: {said}")
    assert f"{MEANS_LITTLE} Fix: see whether" in note


def unsure(log: AveragedLog, value: float) -> AveragedLog:
    """Return a log that is too short to show how its vessel follows the applied force."""
    response = ForceResponse(np.full(3, value), np.full(3, 0.1), np.full(3, 4.0), np.ones(3, dtype=bool), np.ones(3))
    return replace(log, screened=replace(log.screened, measured=replace(log.screened.measured, response=response)))


def test_short_logs_show_together_that_the_vessel_does_not_follow_the_force(logs: tuple[AveragedLog, ...]) -> None:
    some = [unsure(log, value) for value in (0.02, 0.04) for log in (*logs, *logs, *logs)]
    (found,) = engaged([(CAMPAIGN, Gathered(tuple(some)))], FERRY)
    assert len(found.logs) == len(some)
    (note,) = found.notes
    assert note.startswith(
        f"In these {len(some)} logs together the applied forces accelerate the vessel by surge 0.03 ±"
    )
    assert f"{MEANS_LITTLE} Fix: see whether the actuators were engaged, or in milliampere, correct" in note
    # A few of them do not, nor do logs in one of which the vessel follows.
    for other in (some[:2], [*some, logs[0]]):
        assert engaged([(CAMPAIGN, Gathered(tuple(other)))], FERRY)[0].notes == ()


def test_logs_that_scatter_are_no_surer_together() -> None:
    spread, sigmas = np.full(3, 0.01), np.full(3, 4.0)
    alike, apart = (
        pooled([ForceResponse(np.full(3, one), spread, sigmas, np.ones(3, dtype=bool), np.ones(3)) for one in values])
        for values in ((0.1, 0.1, 0.1, 0.1), (-0.3, 0.5, -0.3, 0.5))
    )
    assert alike is not None
    assert apart is not None
    assert np.allclose(alike.response, 0.1)
    assert np.allclose(alike.spread, 0.005)
    assert np.allclose(apart.response, 0.1)
    assert np.allclose(apart.spread, np.std([-0.3, 0.5, -0.3, 0.5], ddof=1) / 2.0)


def test_an_unengaged_run_of_the_catamaran_is_left_out_of_its_campaign(shared_data: Callable[[str], Path]) -> None:
    bags = [str(one) for one in sorted(shared_data("vtec_usv").glob("*.bag"))[:4]]
    profile = load_profile("vtec-usv")
    (found,) = engaged([(CAMPAIGN, gather(bags, profile, IN_MEMORY))], profile)
    assert [Path(one.path).name[:5] for one in found.logs] == ["48000", "exp37", "exp38"]
    assert any("52000_2016-02-11-10-40-10.bag: the applied forces accelerate" in note for note in found.notes)
