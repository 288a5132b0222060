"""Which logs a batch is about."""

from __future__ import annotations

from pathlib import Path

import pytest

from ferryid.batch.logs import Entry, entries_of
from ferryid.errors import FerryIdError

NAMES = ("a.mcap", "b.mcap", "sub/c.mcap", "sub/[1] x.mcap", "p+q.mcap", "notes.md")


@pytest.fixture
def season(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in NAMES:
        path = tmp_path / "season" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x" * (len(name)))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "season"


def named(*asked: str | Path, vessel: str | None = None) -> list[str]:
    return [entry.log for entry in entries_of([str(one) for one in asked], vessel, lambda line: None)]


def test_patterns_paths_folders_and_parts(season: Path) -> None:
    assert named("season/*.mcap") == ["season/a.mcap", "season/b.mcap", "season/p+q.mcap"]
    assert len(named("season/**/*.mcap")) == 5
    # What is there is taken by its name, whatever it would match.
    assert named("season/sub/[1] x.mcap") == ["season/sub/[1] x.mcap"]
    assert named("season/sub") == ["season/sub"]
    joined = "season/a.mcap+season/b.mcap"
    assert named(joined) == [joined]
    (entry,) = entries_of([joined], "x", lambda line: None)
    assert entry.paths == [season / "a.mcap", season / "b.mcap"]
    assert [file[:2] for file in entry.files] == [(str(season / "a.mcap"), 6), (str(season / "b.mcap"), 6)]
    (folder,) = entries_of(["season/sub"], "x", lambda line: None)
    assert [Path(file.path).name for file in folder.files] == ["[1] x.mcap", "c.mcap"]
    assert Entry("season/p+q.mcap").paths == [season / "p+q.mcap"]


def test_recordings_in_a_folder_are_parts_of_one_and_that_is_told(season: Path) -> None:
    told: list[str] = []
    assert [one.log for one in entries_of(["season/sub"], "x", told.append)] == ["season/sub"]
    assert told == [
        "season/sub: its 2 recordings are taken as parts of one log; if each is a log of its own, name them: "
        '"season/sub/*"'
    ]
    (season / "sub" / "metadata.yaml").write_text("")
    entries_of(["season/sub", "season/*.mcap"], "x", told.append)
    assert len(told) == 1


def test_tables_of_the_same_columns_in_a_folder_are_topics_of_one_and_that_is_told(season: Path) -> None:
    told: list[str] = []
    for name, columns in (("a", "t,u,v"), ("b", "t,u,v"), ("c", "t,u,v")):
        (season / "sub" / f"{name}.csv").write_text(f"{columns}\n0,1,2\n", encoding="utf-8")
    for recording in (season / "sub").glob("*.mcap"):
        recording.unlink()
    assert [one.log for one in entries_of(["season/sub"], "x", told.append)] == ["season/sub"]
    assert told == [
        "season/sub: its 3 tables of the same columns are taken as topics of one log; if each is a log of its own, name them: "
        '"season/sub/*.csv"'
    ]
    (season / "sub" / "c.csv").write_text("t,rudder\n0,1\n", encoding="utf-8")
    entries_of(["season/sub", "season/sub/*.csv"], "x", told.append)
    assert len(told) == 1


def test_a_log_that_is_asked_for_twice_is_one(season: Path) -> None:
    assert named("season/*.mcap", season / "b.mcap", "season/../season/a.mcap") == named("season/*.mcap")


def test_a_list_of_paths_from_where_the_list_is(season: Path) -> None:
    (season / "list.txt").write_text(
        "# of the summer\n\na.mcap\nsub/*.mcap\na.mcap+b.mcap\ngone.mcap\n", encoding="utf-8"
    )
    assert named("season/list.txt") == [
        "season/a.mcap",
        # A pattern in a list is one.
        "season/sub/[1] x.mcap",
        "season/sub/c.mcap",
        "season/a.mcap+season/b.mcap",
        # What is not there is told in its row.
        "season/gone.mcap",
    ]


def test_a_table_with_vessel_date_and_note(season: Path) -> None:
    (season / "list.csv").write_text(
        "\ufefflog,vessel,date,note,crew\n"
        'a.mcap,gunnerus,2024-05-01,"calm, warm",ab\n'
        "b.mcap,,2024-05-02T10:00+02:00,,\n"
        "sub/*.mcap\n",
        encoding="utf-8",
    )
    told: list[str] = []
    entries = entries_of(["season/list.csv"], "milliampere", told.append)
    assert told == ["season/list.csv: columns that are not used: crew"]
    assert [(one.log, one.vessel, one.date, one.note) for one in entries] == [
        ("season/a.mcap", "gunnerus", "2024-05-01T00:00:00+00:00", "calm, warm"),
        ("season/b.mcap", "milliampere", "2024-05-02T08:00:00+00:00", ""),
        ("season/sub/[1] x.mcap", "milliampere", None, ""),
        ("season/sub/c.mcap", "milliampere", None, ""),
    ]


def test_a_table_with_semicolons(season: Path) -> None:
    (season / "list.csv").write_text('log;note\na.mcap;"calm, warm; dry"\nb.mcap;\n', encoding="utf-8")
    entries = entries_of(["season/list.csv"], "milliampere", lambda line: None)
    assert [(one.log, one.note) for one in entries] == [
        ("season/a.mcap", "calm, warm; dry"),
        ("season/b.mcap", ""),
    ]


def test_a_log_in_text_form_is_no_list(season: Path) -> None:
    for name, text in (("log.txt", "0 1 2\n1 2 3\n"), ("log.csv", "time [s],u [m/s]\n0,1\n")):
        (season / name).write_text(text, encoding="utf-8")
        assert named(season / name) == [str(season / name)]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("log,date\n", r"names no log\. Fix: "),
        ("log,vesel\na.mcap,x\n", r'no manifest has a column "vesel"\. Did you mean "vessel"\?'),
        (
            "log,date\na.mcap,2024-13-01\n",
            r"the date of row 2 cannot be read, found '2024-13-01'\. Fix: write 2024-05-17",
        ),
        ("log,note\na.mcap,x,y\n", r"row 2 has 3 cells, the header 2\. Fix: "),
        (
            "file,vessel\na.mcap,x\n",
            r'a manifest needs the column "log" .*, found the columns file, vessel\. Fix: rename the column "file"',
        ),
        ("date,vessel\n2024-05-17,x\n", r"a manifest needs .*, found the columns date, vessel\. Fix: add the column"),
        (
            "file;vessel\na.mcap;x\n",
            r'a manifest needs the column "log" .*, found the columns file, vessel\. Fix: rename',
        ),
        ("path\na.mcap\n", r'a manifest needs .* found the columns path\. Fix: rename the column "path" to log'),
        ('log,note\na.mcap,"' + "x" * 140_000 + '"\n', r"the manifest cannot be read, field larger"),
        ("log\n" + "x" * 5000 + "\n", r"names what cannot be a file .* Fix: correct the path"),
    ],
)
def test_manifests_that_cannot_be_used(season: Path, text: str, says: str) -> None:
    (season / "list.csv").write_text(text, encoding="utf-8")
    with pytest.raises(FerryIdError, match=rf"^season/list\.csv: {says}"):
        named("season/list.csv")


@pytest.mark.parametrize("asked", ["nothing/*.mcap", "season/x.mcap", "season/a.mcap+season/x.mcap"])
def test_what_matches_nothing(season: Path, asked: str) -> None:
    with pytest.raises(FerryIdError, match=r"nothing is there that this matches\. Fix: "):
        named("season/a.mcap", asked)


@pytest.mark.parametrize("asked", ["", "  ", "+", "season/a.mcap+", "+season/a.mcap"])
def test_an_empty_path_is_not_the_working_folder(season: Path, asked: str) -> None:
    with pytest.raises(FerryIdError, match=r"(is empty|matches)[^\n]*\. Fix: "):
        named("season/a.mcap", asked)
