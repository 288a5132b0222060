"""`inspect`: every fact of a log is in the output, as JSON and as text that fits a terminal."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest.log import Loss
from ferryid.signals.data_quality import loss_sentence, remarks
from ferryid.signals.inspect import inspect, render_inspect
from ferryid.signals.recording import record
from ferryid.signals.render import table
from ferryid.vessel.load import load_profile
from tests.ingest.mcap_records import DATA_END, HEAD, T0, footer, message

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"


def look(path: Path, profile: str | None = None) -> tuple[dict[str, Any], str]:
    result = inspect(path, load_profile(profile) if profile else None)
    json.dumps(result, allow_nan=False)
    for width in (80, 100, 240):
        assert max(map(len, render_inspect(result, width).splitlines())) <= width
    return result, render_inspect(result, 160)


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


def test_truncated_log_shows_what_is_lost() -> None:
    result, text = look(FIXTURES / "truncated.mcap")
    assert result["losses"]
    assert "Lost\n" in text
    assert f"which found {result['messages']} messages" in text
    assert "(0 messages)" not in text


def test_truncated_bag_says_what_is_recovered() -> None:
    result, text = look(FIXTURES / "truncated.bag")
    assert f"found {result['messages']} messages without it" in text.replace("\n      ", " ")
    assert "(0 messages)" not in text


@pytest.mark.parametrize(("messages", "told"), [(None, "x."), (0, "x."), (1, "x (1 message)."), (7, "x (7 messages).")])
def test_amount_of_a_loss(messages: int | None, told: str) -> None:
    assert loss_sentence(Loss("a/b.bag", "x", None, messages)) == f"b.bag: {told}"


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
    assert "Lost: nothing" in text
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


def test_names_are_cut_only_where_the_terminal_is_narrow() -> None:
    result = inspect(FIXTURES / "short.bag", load_profile("milliampere"))
    assert "…" not in render_inspect(result, 240)
    narrow = render_inspect(result, 80)
    for end in ("ressedImage ", "enchStamped ", ".position.x\n", "thruster2/state ", "mand: azimuth\n"):
        assert end in narrow


def test_legend_explains_what_is_shown() -> None:
    log = FIXTURES / "short.bag"
    assert re.search(
        r"^ppm: .*; held: .*; spikes: .*$", render_inspect(inspect(log, load_profile("milliampere")), 160), re.M
    )
    assert re.search(r"^ppm: [^;]*$", render_inspect(inspect(log), 160), re.M)


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
