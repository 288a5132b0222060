"""Where a trial may be written: never over its own sources, over other things, or unasked."""

from __future__ import annotations

from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.files import replacing
from ferryid.simulate.output_paths import check_output, log_path

RECORDING = """rosbag2_bagfile_information:
  version: 9
  relative_file_paths: [trial.db3]
  topics_with_message_count: []
  message_count: 0
  duration: {nanoseconds: 0}
  starting_time: {nanoseconds_since_epoch: 0}
"""


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    folder = tmp_path / "trial"
    folder.mkdir()
    (folder / "metadata.yaml").write_text(RECORDING)
    (folder / "trial.db3").write_bytes(b"")
    return folder


def test_a_recording_alone_may_be_replaced(recording: Path) -> None:
    with pytest.raises(FerryIdError, match="exists already"):
        check_output(recording)
    check_output(recording, overwrite=True)


@pytest.mark.parametrize("change", ["note", "folder", "yaml", "other yaml", "no yaml"])
def test_a_folder_that_holds_anything_else_is_never_replaced(recording: Path, change: str) -> None:
    if change == "note":
        (recording / "thesis.txt").write_text("keep me")
    elif change == "folder":
        (recording / "trial.db3").unlink()
        (recording / "trial.db3").mkdir()
    elif change == "no yaml":
        (recording / "metadata.yaml").unlink()
    else:
        (recording / "metadata.yaml").write_text("{" if change == "yaml" else "title: holiday")
    with pytest.raises(FerryIdError, match=r"cannot be replaced.*no ROS2 recording"):
        check_output(recording, overwrite=True)


@pytest.mark.parametrize(
    ("name", "start", "content"),
    [
        ("t.mcap", b"\x89MCAP0\r\n", b"#ROSBAG V2.0"),
        ("t.bag", b"#ROSBAG V2.0\n", b"PAR1"),
        ("", b"PAR1....PAR1", b"MZ"),
    ],
)
def test_only_a_file_of_the_same_kind_is_replaced(tmp_path: Path, name: str, start: bytes, content: bytes) -> None:
    out, truth = (tmp_path / name, None) if name else (tmp_path / "log.bag", tmp_path / "truth")
    path = truth or out
    path.write_bytes(content)
    with pytest.raises(FerryIdError, match="cannot be replaced, found a file of another kind"):
        check_output(out, truth, overwrite=True)
    for good in (start, b""):
        path.write_bytes(good)
        check_output(out, truth, overwrite=True)


def test_no_output_takes_the_place_of_an_input(tmp_path: Path, recording: Path) -> None:
    source = tmp_path / "model.json"
    source.write_text("{}")
    hard = tmp_path / "hard.json"
    hard.hardlink_to(source)
    for asked in ({"json": source}, {"truth": source}, {"json": hard}, {"json": tmp_path / "." / "model.json"}):
        with pytest.raises(FerryIdError, match="cannot take the place of what it is made from"):
            check_output(tmp_path / "log", overwrite=True, inputs=[source], **asked)
    with pytest.raises(FerryIdError, match="cannot take the place of what it is made from"):
        check_output(recording, overwrite=True, inputs=[recording / "trial.db3"])
    check_output(tmp_path / "log", json=tmp_path / "other.json", inputs=[source])


def test_outputs_keep_apart(tmp_path: Path) -> None:
    log = tmp_path / "log"
    for asked in ({"truth": log}, {"json": log}, {"truth": tmp_path / "a", "json": tmp_path / "a"}):
        with pytest.raises(FerryIdError, match="cannot be the same file"):
            check_output(log, **asked)
    for asked in ({"truth": log / "truth"}, {"json": log / "a.json"}):
        with pytest.raises(FerryIdError, match="cannot lie in each other"):
            check_output(log, **asked)


def test_places_that_cannot_be_written_are_told_before(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "note.txt").write_text("keep me")
    for place in ("file/a/t", "x" * 240):
        with pytest.raises(FerryIdError, match=r"cannot be written|longer than"):
            check_output(tmp_path / "t.mcap", tmp_path / place)
        with pytest.raises(FerryIdError, match=r"cannot be written|longer than"):
            check_output(tmp_path / place)
    with pytest.raises(FerryIdError, match="no JSON file"):
        check_output(tmp_path / "t.mcap", json=tmp_path / "note.txt")
    (tmp_path / "gone.mcap").symlink_to(tmp_path / "nowhere")
    with pytest.raises(FerryIdError, match="exists already"):
        check_output(tmp_path / "gone.mcap")
    check_output(tmp_path / "new" / "folders" / "t.mcap")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("folder", [False, True])
def test_what_came_meanwhile_stays(tmp_path: Path, folder: bool) -> None:
    target = tmp_path / "log"

    def make(path: Path, text: str) -> None:
        if folder:
            path.mkdir()
        (path / "x" if folder else path).write_text(text)

    def late() -> None:
        with replacing(target, new=True) as temporary:
            make(temporary, "late")
            make(target, "first")

    with pytest.raises(FerryIdError, match="exists already"):
        late()
    assert (target / "x" if folder else target).read_text() == "first"
    assert [path.name for path in tmp_path.iterdir()] == ["log"]


def test_a_link_to_a_folder_is_replaced_without_a_rest(tmp_path: Path, recording: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(recording)
    with replacing(link) as temporary:
        temporary.mkdir()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "trial"]
    assert not link.is_symlink()
    assert sorted(path.name for path in recording.iterdir()) == ["metadata.yaml", "trial.db3"]


@pytest.mark.parametrize("name", ["t.mcap", "t.bag", "t.bag.active", "t.db3", "t.csv", "t.mcap.zst"])
def test_a_folder_for_results_is_not_named_like_a_log(tmp_path: Path, name: str) -> None:
    with pytest.raises(FerryIdError, match=f"^--out: is the folder .*{name}.* Fix: use --log .*{name}$"):
        log_path("short", tmp_path / name, None)
    (tmp_path / name).mkdir()
    assert log_path("short", tmp_path / name, None) == tmp_path / name / "short.mcap"


def test_a_log_lies_in_the_folder_for_results_unless_it_is_given_a_place(tmp_path: Path) -> None:
    assert log_path("short", tmp_path, None) == tmp_path / "short.mcap"
    assert log_path("short", tmp_path, tmp_path / "trial") == tmp_path / "trial"
