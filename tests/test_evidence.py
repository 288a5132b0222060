"""Pages of evidence name the state of the sources that made them, and what has changed since is seen."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tests import evidence
from tests.evidence import BY_HAND, MAKERS, ROOT, ages, folders, read, stamp, table

PAGE = "reports/waves.md"


def test_every_page_in_reports_has_a_maker_or_was_written_by_hand() -> None:
    there = {path.relative_to(ROOT).as_posix() for path in (ROOT / "reports").rglob("*.md")}
    assert there == {page for page in (*MAKERS, *BY_HAND) if page.endswith(".md")}


def test_every_page_has_a_state_and_old_ones_are_told(record_property: Callable[[str, object], None]) -> None:
    every = ages()
    assert [one.page for one in every if not one.made] == [], "Fix: make the page, or python -m tests.evidence PAGE"
    for one in every:
        if one.changed:
            record_property("notice", str(one))


def test_no_page_names_a_folder_of_the_machine_that_made_it() -> None:
    folder = re.compile(rb"(?<![\w./])/(?:home|root|tmp|work|Users|var/folders)/[^\s\"]*")
    every = [path for path in (ROOT / "reports").rglob("*") if path.is_file()]
    assert {path.name: found for path in every if (found := folder.findall(path.read_bytes()))} == {}


@pytest.mark.slow
@pytest.mark.parametrize("page", MAKERS)
def test_makers_are_there_and_import_what_they_show(page: str) -> None:
    found = folders(page)
    assert set(found) >= {"ferryid", "ferryid/ingest", "ferryid/ingest/formats", "ferryid/vessel/profiles"}
    assert not [one for one in found if one.startswith("cli") or one == "tests"]


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the root of a small project with one page."""
    files = {
        "tests/wavy/__main__.py": "from ferryid.signals import smooth\n",
        "cli/cmd_fit.py": "from ferryid.cli.output import emit\n",
        "ferryid/__init__.py": "",
        "ferryid/signals/__init__.py": "",
        "ferryid/signals/smooth.py": 'import ferryid.compiled\nfrom importlib.resources import files\nfiles("ferryid.data")\n',
        "ferryid/compiled.py": "",
        "ferryid/data/one.toml": "a = 1\n",
        "ferryid/report/__init__.py": "",
        "reports/waves.md": "# Waves\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr(evidence, "MAKERS", {PAGE: ("tests/wavy", "cli/cmd_fit.py")})
    return tmp_path.resolve()


def test_a_page_depends_on_what_its_maker_imports_and_no_more(project: Path) -> None:
    assert folders(PAGE, project) == ("ferryid", "ferryid/data", "ferryid/signals", "tests/wavy")


@pytest.mark.parametrize("change", ["ferryid/signals/smooth.py", "ferryid/data/one.toml", "tests/wavy/new.py"])
def test_a_change_of_what_it_depends_on_makes_a_page_old(project: Path, change: str) -> None:
    assert [one.made for one in ages(project)] == [""]
    stamp(project / PAGE, project)
    assert [one.changed for one in ages(project)] == [()]
    (project / change).write_text("b = 2\n", encoding="utf-8")
    (old,) = ages(project)
    assert old.changed == (str(Path(change).parent.as_posix()),)
    assert str(old).endswith(f"older than {Path(change).parent.as_posix()}")
    assert "older than 1 of its folders" in table((old,))


def test_what_it_does_not_depend_on_may_change(project: Path) -> None:
    stamp(PAGE, project)
    (project / "ferryid" / "report" / "page.py").write_text("", encoding="utf-8")
    (project / "ferryid" / "signals" / "smooth.pyc").write_bytes(b"")
    (project / "tests" / "wavy" / "test_wavy.py").write_text("", encoding="utf-8")
    assert [one.changed for one in ages(project)] == [()]


def test_a_page_elsewhere_is_not_stamped(project: Path) -> None:
    stamp(project.parent / "elsewhere.md", project)
    stamp(project / "reports" / "other.md", project)
    assert read(project) == {}
