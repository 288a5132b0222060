"""Bad input gets one line that names file, cause and remedy, exit code 2, and leaves nothing half-written."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.test_every_command import conforms
from tests.ingest.mcap_records import DATA_END, MAGIC, footer, record, text


def refused(run, *parts: str) -> None:
    """Check exit code and form of a refusal, and that it says `parts`."""
    assert run.code == 2, run.out + run.err
    lines = run.err.strip().splitlines()
    assert len(lines) == 1, run.err
    assert lines[0].startswith("ferryid: ")
    assert "Fix:" in lines[0]
    assert "?." not in lines[0]
    assert "Traceback" not in run.err
    for part in parts:
        assert part in lines[0], lines[0]


def drawn(run, out: Path) -> dict:
    """Check that a refusal names a page on its log, which is whole, and that it left nothing else; return its JSON."""
    page = Path(run.err.strip().rpartition("What the log holds is drawn in ")[2].rpartition(" (docs/errors.md#")[0])
    assert page.name == "report.html"
    assert {path.name for path in (out / "reports").iterdir()} - {"assets"} == {page.parent.name}
    assert page.read_text(encoding="utf-8").rstrip().endswith("</html>")
    assert not (out / "models").exists()
    result = conforms((page.parent / "refusal.json").read_text(encoding="utf-8"))
    assert run.err.strip().startswith(f"ferryid: {result['error']}")
    return result


@pytest.mark.parametrize(
    ("words", "remedy"),
    [
        (("show", "nwork"), "Fix: write ferryid models nwork (docs"),
        (("show", "a", "b"), "Fix: name one model, or write promote or rollback before it"),
    ],
)
def test_words_after_models_that_are_no_name_get_the_command_that_shows_one(ferryid, words, remedy: str) -> None:
    refused(ferryid("models", *words), f"found {len(words)} words, 'show' first. {remedy}")


@pytest.mark.parametrize("command", ["inspect", "ingest", "fit"])
@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("missing.bag", None),
        ("empty.mcap", b""),
        ("noise.bag", bytes(range(256)) * 40),
        ("photo.png", b"\x89PNG\r\n\x1a\n"),
    ],
)
def test_what_is_not_a_log(ferryid, tmp_path: Path, command: str, name: str, content: bytes | None) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    vessel = () if command == "inspect" else ("--vessel", "milliampere", "--out", tmp_path / "out")
    refused(ferryid(command, path, *vessel), name)
    assert not list((tmp_path / "out").rglob("*.parquet"))


@pytest.mark.parametrize("size", [8, 20, 33])
def test_an_mcap_that_was_cut_behind_its_first_bytes_holds_no_data(ferryid, tmp_path: Path, size: int) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes((MAGIC + record(1, text("ros2") + text("test")))[:size])
    run = ferryid("fit", path, "--vessel", "milliampere", "--out", tmp_path / "out")
    refused(run, "cut.mcap", "holds no data", "the file ends", "copy it from the recorder again")
    assert "signal map" not in run.err
    shown = ferryid("inspect", path, "--vessel", "milliampere")
    assert shown.code == 0
    assert "holds no data" in shown.out


def test_a_finished_mcap_without_a_message_was_not_cut(ferryid, tmp_path: Path) -> None:
    path = tmp_path / "finished.mcap"
    path.write_bytes(MAGIC + record(1, text("ros2") + text("test")) + DATA_END + footer(0))
    run = ferryid("fit", path, "--vessel", "milliampere", "--out", tmp_path / "out")
    refused(run, "finished.mcap", "holds no data", "a complete file")


def test_an_empty_folder(ferryid, tmp_path: Path) -> None:
    refused(ferryid("inspect", tmp_path), str(tmp_path))


@pytest.mark.parametrize("command", ["inspect", "fit"])
def test_an_empty_path_reads_nothing(ferryid, command: str) -> None:
    refused(ferryid(command, "", *(("--vessel", "milliampere") if command == "fit" else ())), "the path is empty")


@pytest.mark.parametrize("command", ["inspect", "fit"])
def test_a_recording_and_its_copy_in_another_format_in_one_folder(
    ferryid, fixtures: Path, tmp_path: Path, command: str
) -> None:
    for name in ("short.bag", "short.mcap"):
        shutil.copy(fixtures / name, tmp_path)
    vessel = ("--vessel", "milliampere", "--out", tmp_path / "out") if command == "fit" else ()
    refused(ferryid(command, tmp_path, *vessel), "short.mcap", "the same", "short.bag")


@pytest.mark.slow
def test_a_thruster_known_by_its_orders_alone_is_said_on_the_terminal(ferryid, fixtures: Path, tmp_path: Path) -> None:
    profile = profile_with(tmp_path, 'topic = "/thruster1/state"', 'topic = "/thruster1/stat"')
    run = ferryid("fit", fixtures / "short.mcap", "--vessel", profile, "--no-report", "--out", tmp_path / "out")
    assert run.code == 0, run.err
    assert "thruster1.speed: the order is used" in run.out
    again = ferryid("evaluate", "milliampere", fixtures / "short.mcap", "--vessel", profile, "--out", tmp_path / "out")
    assert "thruster1.angle: the order is used" in again.out


def test_control_characters_of_a_log_never_reach_terminal_page_or_json(ferryid, tmp_path: Path) -> None:
    path = tmp_path / "a\x1b]0;b\x07\nc\u202e.csv"
    path.write_text(f"time,{'x' * 64},\x1b[2Ja\u202eb\x9b\n0,9,1\n1,9,3\n2,9\n", encoding="utf-8")
    for options in ((), ("--json", "-")):
        run = ferryid("inspect", path, *options)
        assert run.code == 0, run.err
        assert "\\x1b" in run.out or "\\u001b" in run.out
        assert not set(run.out) & set("\x1b\x07\x9b\u202e")
    missing = ferryid("inspect", tmp_path / "no\x1b.bag")
    refused(missing, "no\\x1b.bag")


def test_a_misspelt_vessel(ferryid, fixtures: Path) -> None:
    refused(ferryid("fit", fixtures / "short.mcap", "--vessel", "miliampere"), "milliampere")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--basis", "thesys"), 'Did you mean "thesis"'),
        (("--structure", "coupld"), 'Did you mean "coupled"'),
        (("--smoother", "squre"), 'Did you mean "square"'),
        (("--split", "block"), 'Did you mean "blocks"'),
        (("--components", "many"), "auto"),
        (("--components", "1000"), "more than the 21 functions of the basis modulus"),
        (("--window", "1e-9"), "1e-09 s is no smoothing window"),
        (("--window", "-1"), "window"),
        (("--window", "50"), "short.mcap"),
        (("--rate", "0"), "rate"),
        (("--zeta", "0"), "zeta"),
        (("--split", "logs"), "two"),
    ],
)
def test_settings_that_cannot_be(ferryid, fixtures: Path, tmp_path: Path, options: tuple[str, str], told: str) -> None:
    log = fixtures / "short.mcap"
    refused(
        ferryid("fit", log, "--vessel", "milliampere", "--out", tmp_path, *options), told.replace("short.mcap", "short")
    )
    assert not (tmp_path / "models").exists()


@pytest.mark.parametrize(
    ("what", "options", "told"),
    [
        ("bases", (), 'Did you mean "basis"'),
        ("window", ("--windows", "a,b"), "'a' is no number of seconds"),
        ("both", ("--windows=-1,2",), "-1.0 s is no smoothing window"),
        ("both", ("--windows", "1,1e9"), "--windows: 1000000000.0 s is no smoothing window"),
        ("window", ("--windows", "1"), "nothing to compare"),
        ("window", ("--smoother", "kalman"), "Kalman"),
        ("components", ("--windows", "1,2"), "at one window"),
        ("components", ("--folds", "1"), "2 to 20"),
        ("basis", ("--windows", "1,2"), "at one window"),
        ("basis", ("--folds", "99"), "2 to 20"),
        ("basis", ("--components", "0"), "number of components"),
        ("basis", ("--window", "59"), "short"),
    ],
)
def test_what_cannot_be_swept(
    ferryid, fixtures: Path, tmp_path: Path, what: str, options: tuple[str, ...], told: str
) -> None:
    refused(
        ferryid("sweep", what, fixtures / "short.mcap", "--vessel", "milliampere", "--out", tmp_path, *options), told
    )
    assert not (tmp_path / "reports").exists()


def test_a_log_in_the_place_of_what_is_swept_is_told(ferryid, fixtures: Path) -> None:
    log = fixtures / "short.mcap"
    refused(ferryid("sweep", log), f"{log}: a log stands where WHAT does", f"Fix: ferryid sweep components {log}")


@pytest.mark.parametrize("command", [("fit",), ("sweep", "components"), ("sweep", "basis")])
def test_a_log_given_twice(
    ferryid, fixtures: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...]
) -> None:
    # By its bare name too, of which Python keeps one copy.
    monkeypatch.chdir(fixtures)
    log = "short.mcap"
    refused(ferryid(*command, log, log, "--vessel", "milliampere", "--out", tmp_path), "short.mcap: given twice")


def profile_with(tmp_path: Path, old: str, new: str) -> Path:
    """Return a copy of the milliAmpère profile with one change."""
    from ferryid.vessel import load_profile

    text = load_profile("milliampere").text
    assert old in text
    path = tmp_path / "boat.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("/navigation/odometry", "/navigation/odometri", 'Did you mean "/navigation/odometry"'),
        ("twist.twist.linear.x", "twist.twist.linear.q", "twist.twist.linear"),
        ('unit = "m/s"', 'unit = "furlong/s"', "furlong/s"),
    ],
)
def test_a_profile_that_does_not_fit_the_log(
    ferryid, fixtures: Path, tmp_path: Path, old: str, new: str, told: str
) -> None:
    profile = profile_with(tmp_path, old, new)
    refused(ferryid("fit", fixtures / "short.mcap", "--vessel", profile, "--out", tmp_path / "out"), told)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_an_output_folder_without_permission(ferryid, fixtures: Path, tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    refused(ferryid("ingest", fixtures / "short.mcap", "--vessel", "milliampere", "--out", tmp_path / "out"), "written")


@pytest.mark.parametrize(
    "command",
    [
        *(("ingest", "short.bag"), ("fit", "short.bag"), ("diagnose", "short.bag"), ("batch", "short.bag")),
        *(("sweep", "basis", "short.bag"), ("evaluate", "a", "short.bag"), ("compare", "a", "short.bag")),
        *(("models",), ("plan", "--vessel", "milliampere"), ("export", "a", "--to", "python"), ("reproduce", "thesis")),
        ("prove", "--only", "wind"),
    ],
    ids=lambda command: command[0],
)
def test_every_output_folder_that_is_a_file_is_told_alike(
    ferryid, fixtures: Path, tmp_path: Path, command: tuple[str, ...]
) -> None:
    (tmp_path / "out").write_text("not a folder")
    for out in (tmp_path / "out", tmp_path / "out" / "deeper"):
        run = ferryid(*(fixtures / word if word == "short.bag" else word for word in command), "--out", out)
        refused(
            run,
            f"ferryid: {tmp_path / 'out'}: is a file, and a folder was to be there, so that results cannot be written. ",
            "Fix: name another place with --out",
        )


def test_a_folder_in_the_place_of_a_json_result(ferryid, fixtures: Path, tmp_path: Path) -> None:
    for command in (("inspect", fixtures / "short.bag"), ("vessel", "list"), ("fit", tmp_path / "none.bag")):
        refused(ferryid(*command, "--json", tmp_path), f"{tmp_path}: is a folder, and a file was to be written")


@pytest.fixture
def circle(tmp_path: Path) -> Path:
    """Give a link that leads to another one, which leads back to it."""
    (tmp_path / "one").symlink_to(tmp_path / "other")
    (tmp_path / "other").symlink_to(tmp_path / "one")
    return tmp_path / "one"


@pytest.mark.parametrize("command", ["inspect", "fit", "ingest", "batch"])
def test_links_that_lead_round_in_a_circle_are_no_log(ferryid, tmp_path: Path, circle: Path, command: str) -> None:
    options = () if command == "inspect" else ("--out", tmp_path / "out")
    refused(ferryid(command, circle, "--vessel", "milliampere", *options), str(circle))


def test_links_that_lead_round_in_a_circle_are_no_place_for_a_result(
    ferryid, fixtures: Path, tmp_path: Path, circle: Path
) -> None:
    fit = ("fit", fixtures / "short.mcap", "--vessel", "milliampere", "--out", tmp_path / "out")
    simulate = ("simulate", fixtures / "short.toml", "--out", tmp_path / "out")
    refused(ferryid(*fit, "--json", circle), f"{circle}: is a link that leads round in a circle", "--json another name")
    refused(ferryid(*fit, "--json", circle / "x.json"), f"{circle}: is a link to nothing", "--json")
    refused(ferryid(*simulate, "--log", circle / "x.mcap"), f"{circle} is no folder")
    refused(ferryid(*simulate, "--log", circle.with_name("x.mcap"), "--json", circle), str(circle))
    assert not (tmp_path / "out").exists()
    assert circle.is_symlink()


@pytest.mark.skipif(sys.platform != "linux", reason="other systems take no such name")
def test_places_whose_names_hold_bytes_that_are_no_characters(ferryid, fixtures: Path, tmp_path: Path) -> None:
    out = tmp_path / os.fsdecode(b"o\xff")
    run = ferryid("ingest", fixtures / "short.mcap", "--vessel", "milliampere", "--out", out)
    assert run.code == 0, run.err
    assert list(out.rglob("*.parquet"))
    truth = tmp_path / os.fsdecode(b"t\xff.parquet")
    run = ferryid("simulate", fixtures / "short.toml", "--out", out, "--truth", truth)
    assert run.code == 0, run.err
    run = ferryid("inspect", truth)
    assert run.code == 0, run.err


@pytest.mark.parametrize("words", [["--version"], ["--help"]], ids=" ".join)
@pytest.mark.parametrize("buffered", [True, False])
def test_a_full_standard_output(words: list[str], buffered: bool) -> None:
    if not os.path.exists("/dev/full"):
        pytest.skip("no /dev/full on this machine")
    python = [sys.executable, *([] if buffered else ["-u"]), "-c", "from ferryid.cli.entry import main; main()"]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*python, *words], stdout=full, stderr=subprocess.PIPE, text=True, check=False, env=environment
        )
    assert done.returncode == 2
    assert done.stderr.startswith("ferryid: standard output: No space left on device. Fix: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.slow
def test_a_full_disk(ferryid, fixtures: Path, tmp_path: Path) -> None:
    if not os.path.exists("/dev/full"):
        pytest.skip("no /dev/full on this machine")
    run = ferryid("inspect", fixtures / "short.mcap", "--json", "/dev/full/x")
    refused(run, "/dev/full")


@pytest.mark.slow
def test_an_interrupt_exits_with_130_and_leaves_nothing(
    ferryid, fixtures: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ferryid.report import page

    def interrupted(*_: object) -> str:
        raise KeyboardInterrupt

    monkeypatch.setattr(page, "render", interrupted)
    run = ferryid("fit", fixtures / "short.mcap", "--vessel", "milliampere", "--out", tmp_path / "out")
    assert run.code == 130
    assert not list((tmp_path / "out").rglob("*.part"))
    assert not list((tmp_path / "out").rglob("*.html"))
    assert [path.name for path in (tmp_path / "out" / "models").rglob("*")] == [".lock"]


@pytest.mark.slow
def test_a_terminated_command_cleans_up_and_exits_with_143(
    ferryid, fixtures: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ferryid.report import page

    def terminated(*_: object) -> str:
        os.kill(os.getpid(), signal.SIGTERM)
        return "never reached"

    # Without a handler of ours the signal would end the tests.
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    monkeypatch.setattr(page, "render", terminated)
    try:
        run = ferryid("fit", fixtures / "short.mcap", "--vessel", "milliampere", "--out", tmp_path / "out")
    finally:
        signal.signal(signal.SIGTERM, before)
    assert run.code == 143
    assert not [path for path in (tmp_path / "out").rglob("*") if path.suffix in (".part", ".html")]


@pytest.mark.slow
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_output_is_no_bug(closed: str) -> None:
    run = "import sys; from ferryid.cli.main import main; sys.argv = ['ferryid', 'simulate', '--list']; main()"
    command = f'"$0" -c "$1" {closed}'
    done = subprocess.run(["sh", "-c", command, sys.executable, run], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_bug_of_ours_exits_with_1_and_asks_for_a_report(
    ferryid, fixtures: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import ferryid.signals.inspect as module

    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(module, "inspect", broken)
    run = ferryid("inspect", fixtures / "short.mcap")
    assert run.code == 1
    assert "report it" in run.err


@pytest.mark.parametrize("name", ["../../evil", "/tmp/evil", "a/b", ".", "x@1", "a\nb", "n" * 300])
def test_a_model_name_that_is_a_path(ferryid, fixtures: Path, tmp_path: Path, name: str) -> None:
    run = ferryid("fit", fixtures / "short.mcap", "--vessel", "milliampere", "--out", tmp_path / "out", "--name", name)
    refused(run, "--name")


@pytest.mark.slow
def test_json_is_never_written_over_an_input(ferryid, fixtures: Path, tmp_path: Path) -> None:
    log = tmp_path / "copy.mcap"
    log.write_bytes((fixtures / "short.mcap").read_bytes())
    refused(ferryid("inspect", log, "--json", log), "copy.mcap")
    assert log.read_bytes() == (fixtures / "short.mcap").read_bytes()


@pytest.mark.slow
def test_the_same_log_twice(ferryid, fixtures: Path, tmp_path: Path) -> None:
    log = fixtures / "short.bag"
    refused(ferryid("fit", log, log, "--vessel", "milliampere", "--out", tmp_path, "--split", "logs"), "given twice")


@pytest.mark.slow
def test_a_model_of_another_vessel(ferryid, fixtures: Path, tmp_path: Path) -> None:
    run = ferryid("fit", fixtures / "short.mcap", "--vessel", "milliampere", "--no-report", "--out", tmp_path)
    assert run.code == 0
    refused(
        ferryid("evaluate", "milliampere", fixtures / "short.csv", "--vessel", "esso-osaka", "--out", tmp_path),
        "esso-osaka",
    )


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('linear.y"]\nunit = "m/s"', 'linear.y"]\nunit = "kn"', "surge velocity"),
        (
            'field = "twist.twist.angular.z"',
            'field = "twist.twist.angular.z"\nsign = -1',
            "yaw rate has the wrong sign",
        ),
    ],
)
def test_signals_that_contradict_each_other(
    ferryid, fixtures: Path, tmp_path: Path, old: str, new: str, told: str
) -> None:
    profile = profile_with(tmp_path, old, new)
    refused(ferryid("fit", fixtures / "short.mcap", "--vessel", profile, "--out", tmp_path / "out"), "contradict", told)


@pytest.mark.parametrize("arguments", [(), ("fit",), ("fitt", "x"), ("fit", "--no-such")])
def test_wrong_use_is_told_shortly(ferryid, arguments: tuple[str, ...]) -> None:
    run = ferryid(*arguments)
    assert "?." not in run.err
    assert run.code == 2
    assert run.err
    assert "Traceback" not in run.err


@pytest.mark.slow
def test_comparisons_that_mean_nothing(ferryid, fixtures: Path, tmp_path: Path) -> None:
    log, out = fixtures / "short.mcap", ("--out", tmp_path)
    for components in ("6", "9"):
        assert ferryid("fit", log, "--vessel", "milliampere", "--components", components, "--no-report", *out).code == 0
    pair = ("compare", "milliampere@1", "milliampere@2")
    refused(ferryid("compare", "milliampere@1", "milliampere@1", *out), "milliampere@1", "the same model")
    refused(ferryid("compare", "milliampere@1", "--on", log, *out), "two or more models")
    refused(ferryid("compare", "--on", log, "milliampere@1", "milliampere@2", *out), "ferryid compare --help")
    refused(ferryid("compare", "milliampere@1", "milliampere@7", *out), "no such version")
    refused(ferryid(*pair, "--on", log, log, *out), "short.mcap", "given twice")
    refused(ferryid(*pair, "--on", tmp_path / "none.bag", *out), "none.bag")
    refused(ferryid(*pair, "--on", log, "--vessel", "gunnerus", *out), "gunnerus")
    refused(ferryid(*pair, "--on", log, "--window", "70", *out), "--window")
    # Fitted with the wind that short.mcap has, and short.csv has not.
    refused(ferryid(*pair, "--on", fixtures / "short.csv", *out, "--vessel", csv_profile(tmp_path)), "needs the wind")
    assert not list(tmp_path.glob("reports/compare*"))


def csv_profile(tmp_path: Path) -> Path:
    """Return a profile of milliAmpère that reads the fixture's table."""
    from ferryid.vessel import load_profile

    text = load_profile("milliampere").text
    signals = [
        *(
            ("position", 'fields = ["north [m]", "east [m]"]', "m", "NED"),
            ("heading", 'field = "heading [deg]"', "deg", "NED"),
        ),
        *(
            ("velocity", 'fields = ["u [m/s]", "v [m/s]"]', "m/s", "FRD"),
            ("yaw_rate", 'field = "r [deg/s]"', "deg/s", "FRD"),
        ),
        *((f'"thruster{k}.speed"', f'field = "thruster{k} speed [rpm]"', "rpm", "") for k in (1, 2)),
        *((f'"thruster{k}.angle"', f'field = "thruster{k} azimuth [deg]"', "deg", "") for k in (1, 2)),
    ]
    parts = [text[: text.index("[signals.")]]
    for name, field, unit, frame in signals:
        parts.append(f'[signals.{name}]\ntopic = "table"\n{field}\nunit = "{unit}"\n')
        parts.append(f'frame = "{frame}"\n' if frame else "")
    path = tmp_path / "table.toml"
    path.write_text("".join(parts), encoding="utf-8")
    return path


def test_a_mapped_column_whose_name_another_one_has(ferryid, fixtures: Path, tmp_path: Path) -> None:
    head, *rows = (fixtures / "short.csv").read_text(encoding="utf-8").splitlines()
    log = tmp_path / "twice.csv"
    log.write_text("\n".join([f"{head},u [m/s]", *(f"{row},9" for row in rows)]), encoding="utf-8")
    said = '2 columns are named "u [m/s]": the first is used.'
    profile = csv_profile(tmp_path)
    assert said in ferryid("inspect", log, "--vessel", profile).out
    for _ in range(2):  # read, and then from the cache
        assert said in ferryid("fit", log, "--vessel", profile, "--no-report", "--out", tmp_path / "out").out
    assert "columns are named" not in ferryid("inspect", fixtures / "short.csv", "--vessel", profile).out
