"""`inspect`: every fact of a log is in the output, as JSON and as text that fits a terminal."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest.log import Loss
from ferryid.signals.data_quality import loss_sentence, main_loss, remarks, unread
from ferryid.signals.inspect import inspect, render_inspect
from ferryid.signals.prepare import open_track
from ferryid.signals.recording import record
from ferryid.signals.render import table
from ferryid.vessel.load import load_profile
from tests.damage import NAVIGATION, SURGE, changed, held_at_its_last, paused, stuck, ten_minutes, written
from tests.ingest.autopilot_logs import ulog
from tests.ingest.mcap_records import DATA_END, HEAD, T0, footer, message

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"


def look(path: Path, profile: str | None = None) -> tuple[dict[str, Any], str]:
    result = inspect(path, load_profile(profile) if profile else None)
    json.dumps(result, allow_nan=False)
    for width in (80, 100, 240):
        assert max(map(len, render_inspect(result, width).splitlines())) <= width
    return result, render_inspect(result, 160)


def test_a_log_does_not_begin_or_end_with_one_message_far_from_all_others(tmp_path: Path) -> None:
    t = (np.arange(100) * 100_000 + 20_000_000).astype(np.uint64)
    once = {"mission": 1_200_000_000, "test_motor": 2_000_000, "parameter_update": 0, "home_position": 19_500_000}
    alone = {name: {"timestamp": np.array([at], np.uint64), "a": np.ones(1, np.float32)} for name, at in once.items()}
    (tmp_path / "boat.ulg").write_bytes(
        ulog({"vehicle_status": {"timestamp": t, "a": np.ones(100, np.float32)}, **alone})
    )
    result, text = look(tmp_path / "boat.ulg")
    assert result["duration_s"] == pytest.approx(10.4)
    assert "/mission: its only time is 1.17e+03 s after the others: the duration of the log is without it" in text
    assert "/test_motor: its only time is 18 s before the others: start and duration of the log are without it" in text
    assert "home_position: its only time" not in text


@pytest.mark.slow
def test_mcap_without_a_profile() -> None:
    result, text = look(FIXTURES / "short.mcap")
    assert result["schema"] == "ferryid.inspect/1"
    assert result["format"] == "MCAP"
    topics = {topic["name"]: topic for topic in result["topics"]}
    assert len(topics) == 9
    odometry = topics["/navigation/odometry"]
    assert (odometry["count"], odometry["type"], odometry["encoding"]) == (900, "nav_msgs/msg/Odometry", "cdr")
    assert odometry["clock"]["source"] == "stamp"
    assert odometry["clock"]["offset_s"] == pytest.approx(0.05, abs=0.02)  # the recorder is 40 ms ahead, plus latency
    assert odometry["rate_hz"] == pytest.approx(10, rel=0.01)
    assert topics["/camera/image/compressed"]["clock"] is None
    assert "header stamps were not read" in text
    (match,) = (one for one in result["bundled"] if one["name"] == "milliampere")
    assert match["usable"]
    # Current, payload and the desired pose, which this log does not have.
    assert match["found"] == match["signals"] - 4
    assert "milliampere: fits" in text
    assert "Lost: nothing" in text


@pytest.mark.slow
def test_mcap_with_its_profile_shows_signals_in_si() -> None:
    result, text = look(FIXTURES / "short.bag", "milliampere")
    vessel = result["vessel"]
    assert vessel["usable"]
    assert set(vessel["missing"]) == {"current", "payload", "position_d", "heading_d"}
    surge = vessel["streams"]["/navigation/odometry"]["signals"]["u"]
    assert surge["unit"] == "m/s"
    assert -1 < surge["minimum"] < surge["maximum"] < 2
    assert "n_thruster1" in text
    assert "rpm" in text


@pytest.mark.slow
def test_truncated_log_shows_what_is_lost() -> None:
    result, text = look(FIXTURES / "truncated.mcap")
    assert result["losses"]
    assert "Lost\n" in text
    assert f"which found {result['messages']} messages" in text
    assert "(0 messages)" not in text


@pytest.mark.slow
def test_truncated_bag_says_what_is_recovered() -> None:
    result, text = look(FIXTURES / "truncated.bag")
    assert f"found {result['messages']} messages without it" in text.replace("\n      ", " ")
    assert "(0 messages)" not in text


@pytest.mark.parametrize(("messages", "told"), [(None, "x."), (0, "x."), (1, "x (1 message)."), (7, "x (7 messages).")])
def test_amount_of_a_loss(messages: int | None, told: str) -> None:
    assert loss_sentence(Loss("a/b.bag", "x", None, messages)) == f"b.bag: {told}"


@pytest.mark.slow
@pytest.mark.parametrize("change", ["broken", "renamed"])
def test_a_metadata_file_that_costs_no_message_is_a_remark(tmp_path: Path, change: str) -> None:
    folder = tmp_path / "log"
    shutil.copytree(FIXTURES / "short_ros2", folder)
    if change == "broken":
        (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    else:
        (file,) = folder.glob("*.db3")
        file.rename(folder / "other.db3")
    result, text = look(folder, "milliampere")
    assert re.search("Lost: (nothing|no message)", text)
    notes = " ".join(text[text.index("Notes\n") :].split())
    if change == "broken":
        assert "metadata.yaml: the file is no YAML" in notes
    else:
        assert "the file is named in metadata.yaml but is not in the folder; other.db3 there was read instead" in notes
    assert [loss["messages"] for loss in result["losses"]] == [0]
    recorded = record(folder, load_profile("milliampere"))
    said = remarks(recorded)
    assert any("metadata.yaml" in one for one in said)
    assert not any(one.startswith("Lost") for one in said)


def with_stray_times(folder: Path, *changes: tuple[str, int]) -> Path:
    """Return a copy of the ROS 2 fixture with a bit of one receive time flipped, per topic and row of it."""
    shutil.copytree(FIXTURES / "short_ros2", folder)
    (file,) = folder.glob("*.db3")
    with closing(sqlite3.connect(file)) as connection, connection:
        for topic, row in changes:
            found = connection.execute(
                "SELECT m.id, timestamp FROM messages m JOIN topics t ON t.id = topic_id WHERE name = ? ORDER BY m.id",
                (topic,),
            ).fetchall()
            number, time_ns = found[row]
            connection.execute("UPDATE messages SET timestamp = ? WHERE id = ?", (time_ns ^ 1 << 61, number))
    return folder


@pytest.mark.slow
def test_a_stray_receive_time_does_not_make_the_log_longer(tmp_path: Path) -> None:
    camera, thruster = "/camera/image/compressed", "/thruster1/state"
    result, text = look(with_stray_times(tmp_path / "log", (camera, 2), (thruster, 100)), "milliampere")
    assert 29 < result["duration_s"] < 30
    durations = {topic["name"]: topic["duration_s"] for topic in result["topics"]}
    assert 20 < durations[camera] < 30
    assert 29 < durations[thruster] < 30
    assert "1 of 300 receive times contradict" in " ".join(text.split())
    sound, _ = look(FIXTURES / "short_ros2", "milliampere")
    assert sound["start"] == result["start"]
    assert "receive times contradict" not in str(sound)


def test_rows_that_are_left_out_do_not_make_an_mcap_longer(tmp_path: Path) -> None:
    times = [T0 + 100_000_000 * row for row in range(100)]
    times[40] ^= 1 << 61
    path = tmp_path / "log.mcap"
    path.write_bytes(
        HEAD + b"".join(message(row, time_ns=time) for row, time in enumerate(times)) + DATA_END + footer(0)
    )
    result, text = look(path)
    assert result["duration_s"] == pytest.approx(9.9)
    assert result["topics"][0]["duration_s"] == pytest.approx(9.9)
    assert "1 of 100 rows left out" in text


def test_wrong_profile_says_what_is_missing(tmp_path: Path) -> None:
    result, text = look(FIXTURES / "short.mcap", "vtec-usv")
    assert not result["vessel"]["usable"]
    assert result["vessel"]["missing"]
    assert "does not fit" in text
    assert 'missing position, heading: found no topic "/NED_pose".' in text
    assert text.count("/thruster1/command, ") == 1


def test_table_without_a_profile_lists_its_columns(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time [s],speed over ground\n0,1\n0.1,2\n0.2,3\n5,x\n5.1,5\n")
    result, text = look(path)
    assert "speed over ground" in text
    assert "time guessed" in text
    assert 'times are those of its time column "time [s]"' in text
    assert "receive" not in text
    assert result["topics"][0]["clock"]["source"] == "receive"
    assert result["start"] is None
    assert result["topics"][0]["clock"]["gaps"] == [[200_000_000, 5_000_000_000]]


def test_folder_of_runs_says_so(tmp_path: Path) -> None:
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("t,u\n0,1\n0.1,2\n0.2,3\n")
    _, text = look(tmp_path)
    assert "separate runs" in text


def test_no_log_is_an_error() -> None:
    with pytest.raises(FerryIdError, match="Fix:"):
        inspect(FIXTURES / "README.md")


def test_long_names_keep_their_end_and_fit() -> None:
    text = table(["topic", "type", "count"], [["/very" * 30 + "/end", "a_package/" + "t" * 40, "1"]], 100, left=(0, 1))
    assert max(map(len, text.splitlines())) <= 100
    assert "/end" in text
    assert "/" + "t" * 40 in text


@pytest.mark.slow
def test_names_are_cut_only_where_the_terminal_is_narrow() -> None:
    result = inspect(FIXTURES / "short.bag", load_profile("milliampere"))
    assert "…" not in render_inspect(result, 240)
    narrow = render_inspect(result, 80)
    for end in ("ressedImage ", "enchStamped ", ".position.x\n", "thruster2/state ", "mand: azimuth\n"):
        assert end in narrow


@pytest.mark.slow
def test_legend_explains_what_is_shown() -> None:
    log = FIXTURES / "short.bag"
    assert re.search(
        r"^ppm: .*; held: .*; spikes: .*$", render_inspect(inspect(log, load_profile("milliampere")), 160), re.M
    )
    assert re.search(r"^ppm: [^;]*$", render_inspect(inspect(log), 160), re.M)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("relative", "profile"),
    [
        ("milliampere1", "milliampere-2025"),
        ("vtec_usv/exp37_1_2016-02-11-10-41-20.bag", "vtec-usv"),
        ("gunnerus/RVG_ManeuveringTests.csv", "gunnerus"),
        ("kvlcc2/HSVA_CPMC_KVLCC2_Z_10_05.dat", "kvlcc2-model"),
        ("esso_osaka/zigzag/zigzag_31-Jul-2020_13_04_24.csv", "esso-osaka"),
    ],
)
def test_bundled_profile_of_a_real_recording_is_found(
    shared_data: Callable[[str], Path], relative: str, profile: str
) -> None:
    result, _ = look(shared_data(relative))
    assert [one["name"] for one in result["bundled"] if one["usable"]] == [profile]
    assert look(shared_data(relative), profile)[0]["vessel"]["usable"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("names", "said"), [((SURGE,), "u: the surge velocity stays at 0"), ((), "u: 99 of 12000 samples repeat")]
)
def test_held_velocities_that_a_fit_leaves_out_are_said_with_counts(
    tmp_path: Path, names: tuple[str, ...], said: str
) -> None:
    edit = stuck(names, 0.0) if names else held_at_its_last(SURGE)
    log = written(changed(ten_minutes(), [(60.0, 200.0) if names else (100.0, 5.0)], edit), tmp_path / "held.mcap")
    result, text = look(log, "milliampere")
    assert any(one.startswith(said) for one in result["vessel"]["remarks"])
    assert said in text
    (left,) = result["vessel"]["left_out"]
    (fitted,) = open_track(str(log), load_profile("milliampere"), None).measured.left_out
    assert (left["rows"], left["reason"]) == (fitted.rows, fitted.reason)
    assert f"{left['rows']} of 11999 rows" in text
    assert "Lost: nothing" not in text
    assert f"Lost: no message; a fit leaves out {left['rows']} rows for gaps and faults" in text


@pytest.mark.slow
def test_interpolated_velocities_are_said_with_counts(tmp_path: Path) -> None:
    edit = stuck((SURGE,), float("nan"))
    log = written(changed(ten_minutes(), [(100.0, 0.3)], edit), tmp_path / "short.mcap")
    assert "u: 5 of 12000 samples are missing (NaN); short ones are interpolated." in look(log, "milliampere")[1]


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [3 * 86_400.0, 600.0])
def test_a_pause_is_judged_by_inspect_as_by_a_fit_with_and_without_a_profile(tmp_path: Path, seconds: float) -> None:
    log, ferry = written(paused(ten_minutes(), 200.0, seconds), tmp_path / "pause.mcap"), load_profile("milliampere")
    vessel = look(log, "milliampere")[0]["vessel"]
    result, text = look(log)
    (match,) = (one for one in result["bundled"] if one["name"] == "milliampere")
    assert match["usable"] == vessel["usable"]
    assert match["problem"] == vessel["problem"]
    if seconds < 3600.0:
        assert vessel["usable"]
        (gap,) = vessel["left_out"][0]["intervals"]
        assert gap["end_s"] - gap["start_s"] == pytest.approx(seconds, abs=0.2)
        return
    with pytest.raises(FerryIdError) as error:
        open_track(str(log), ferry, None)
    assert str(error.value) == vessel["problem"]
    assert "a pause of 72.0 h is too long for one log" in vessel["problem"]
    assert "with nothing measured from 200 s on. Fix: record or cut" in vessel["problem"]
    assert "milliampere: fits" not in text
    found = f"{match['found']} of {match['signals']} signals found"
    assert f"milliampere: {found}, but a fit refuses the log: " in re.sub(r"\s+", " ", text)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["short.mcap", "short.bag", "truncated.mcap", "truncated.bag"])
def test_a_fixture_is_judged_the_same_with_and_without_its_profile(name: str) -> None:
    with_profile, without = inspect(FIXTURES / name, load_profile("milliampere"))["vessel"], inspect(FIXTURES / name)
    (match,) = (one for one in without["bundled"] if one["name"] == "milliampere")
    assert (match["usable"], match["problem"]) == (with_profile["usable"], with_profile["problem"])


@pytest.mark.slow
def test_rows_left_out_for_their_times_stand_beside_what_is_lost(tmp_path: Path) -> None:
    made = ten_minutes()
    streams = []
    for stream in made.streams:
        stamp, receive = stream.stamp_ns.copy(), stream.receive_ns.copy()
        if stream.topic == NAVIGATION:
            stamp[700], receive[700] = stamp[699], receive[699]
            stamp[900:903], receive[900:903] = stamp[899], receive[899]
        streams.append(replace(stream, stamp_ns=stamp, receive_ns=receive))
    _, text = look(written(replace(made, streams=tuple(streams)), tmp_path / "twice.mcap"), "milliampere")
    said = re.sub(r"\s+", " ", text)
    assert "Lost: nothing" not in said
    assert "Lost: no message; 4 rows are left out for wrong times: 4 as they repeat the time of another." in said
    assert "4 rows repeat the time of another and were left out" in said


def test_the_most_that_was_lost_is_told_first_and_what_was_repaired_is_no_loss() -> None:
    repaired = Loss("a.bag", "the index cannot be used", None, 0)
    chunk = Loss("a.bag", "the file ends in a chunk")
    rest = Loss("a.bag", "about half is lost at the end", start_ns=7)
    assert main_loss([repaired, chunk, rest]) is rest
    assert unread([repaired, chunk, rest]) == (
        "messages may be lost: a.bag: about half is lost at the end; and 1 more loss, see ferryid inspect.",
    )
    assert unread([repaired]) == ("no message is known to be lost: a.bag: the index cannot be used.",)
