"""The site builds without a warning, its equations convert, and links, drawing, citation and licence are right."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from shutil import copytree

import pytest
from ruamel.yaml import YAML

import ferryid
from tests.docs.drawing import DRAWING, built_on, drawn
from tests.docs.pages import PAGES, ROOT, blocks, links

README_BYTES = 6000


def built(folder: Path) -> subprocess.CompletedProcess[str]:
    """Build the site of the documents in a folder's ``docs``."""
    (folder / "mkdocs.yml").write_text((ROOT / "mkdocs.yml").read_text(encoding="utf-8"), encoding="utf-8")
    command = [sys.executable, "-W", "ignore", "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder / "site")]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=300)


@pytest.mark.slow
def test_it_builds_strictly_and_needs_no_network(tmp_path: Path) -> None:
    copytree(ROOT / "docs", tmp_path / "docs")
    run = built(tmp_path)
    assert run.returncode == 0, run.stderr
    pages = {path.stem: path.read_text(encoding="utf-8") for path in (tmp_path / "site").rglob("*.html")}
    assert {"first-fit", "concealed-wind", "planning"} <= pages.keys()
    assert "<table" in pages["first-fit"]
    assert ".svg" in pages["first-fit"]
    equations = sum(one.language == "math" for page in PAGES for one in blocks(page))
    assert sum(text.count('display="block"') for text in pages.values()) == equations > 30
    for name, text in pages.items():
        assert not re.search(r"\$<code>|language-math", text), f"{name}: an equation was left as it is"
        assert not re.search(r"""(src|<link[^>]*href)=["'](https?:)?//""", text), (
            f"{name}: something is fetched from elsewhere"
        )


@pytest.mark.slow
def test_a_broken_link_and_a_page_outside_the_contents_fail(tmp_path: Path) -> None:
    copytree(ROOT / "docs", tmp_path / "docs")
    page = tmp_path / "docs" / "guide.md"
    page.write_text(page.read_text(encoding="utf-8") + "\n[nowhere](diagnosis.md#nothing)\n", encoding="utf-8")
    (tmp_path / "docs" / "alone.md").write_text("# Alone\n", encoding="utf-8")
    run = built(tmp_path)
    assert run.returncode != 0
    assert "#nothing" in run.stderr
    assert "alone.md" in run.stderr


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_to_files_lead_somewhere(page: Path) -> None:
    local = [one.partition("#")[0] for one in links(page) if not one.startswith(("http", "#"))]
    assert [one for one in local if one and not (page.parent / one).exists()] == []


def test_readme_is_one_page() -> None:
    assert len((ROOT / "README.md").read_bytes()) <= README_BYTES


@pytest.mark.slow
def test_drawing_is_that_of_the_imports() -> None:
    assert DRAWING.read_text(encoding="utf-8") == drawn(built_on()), "Fix: python -m tests.docs.drawing"


def test_every_schema_is_described() -> None:
    page = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    schemas = {
        f"ferryid.{path.name.removesuffix('.json')}/1"
        for path in files("ferryid.schemas").iterdir()
        if path.name.endswith(".json")
    }
    assert [one for one in sorted(schemas) if f"`{one}`" not in page] == []


def test_every_effect_and_check_is_described() -> None:
    from ferryid.effects import effects

    page = (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8")
    assert [name for name in effects() if f"| `{name}` |" not in page] == []


def test_every_column_and_coefficient_is_in_the_nomenclature() -> None:
    from ferryid.effects.force_model import COEFFICIENTS
    from ferryid.vessel.parse_signals import VESSEL_QUANTITIES
    from ferryid.vessel.signal_map import _SIMPLE

    page = (ROOT / "docs" / "nomenclature.md").read_text(encoding="utf-8")
    columns = [column for names in _SIMPLE.values() for column in names]
    assert columns
    assert VESSEL_QUANTITIES
    assert [name for name in columns if f"`{name}`" not in page] == []
    assert [name for name in COEFFICIENTS if name.startswith("m") and f"`{name}`" not in page] == []


def test_licence_and_citation_are_those_of_the_project() -> None:
    licence = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert "Apache License" in licence
    assert "END OF TERMS AND CONDITIONS" in licence
    citation = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert set(citation) >= {"cff-version", "message", "title", "authors", "version", "license"}
    assert citation["authors"] == [{"name": "The ferryid authors"}]
    assert citation["version"] == ferryid.__version__
    assert citation["license"] == "Apache-2.0"


def test_changelog_has_what_is_unreleased_and_this_version() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    headings = re.findall(r"^## (.*)$", text, flags=re.MULTILINE)
    assert headings[0] == "[Unreleased]"
    assert ferryid.__version__ in headings
    kinds = set(re.findall(r"^### (.*)$", text, flags=re.MULTILINE))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
