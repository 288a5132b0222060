"""Every error ends with the section of the page that explains it, and every section is there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from markdown.extensions.toc import slugify

from ferryid.cli import error_pages
from ferryid.cli.error_pages import MEMORY, OPTION, PAGE, PLACE, SECTIONS, section
from ferryid.errors import FerryIdError
from ferryid.vessel import load_profile

ROOT = Path(__file__).resolve().parents[2]


def anchors() -> set[str]:
    text = (ROOT / PAGE).read_text(encoding="utf-8")
    return {slugify(title, "-") for title in re.findall(r"^## (.*)$", text, re.MULTILINE)}


def test_sections_are_on_the_page_and_all_of_them_are_used() -> None:
    assert {*SECTIONS.values(), PLACE, OPTION, MEMORY} == anchors()


@pytest.mark.slow
def test_every_part_that_raises_errors_has_a_section() -> None:
    parts = set()
    for path in [*(ROOT / "ferryid").rglob("*.py"), *(ROOT / "cli").glob("*.py")]:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        if any(isinstance(node, ast.Raise) for node in ast.walk(tree)) and "FerryIdError(" in path.read_text(
            encoding="utf-8"
        ):
            parts.add(
                "cli" if path.parent.name == "cli" else path.relative_to(ROOT / "ferryid").parts[0].removesuffix(".py")
            )
    assert parts - {name.partition(".")[0] for name in SECTIONS} - {"errors", "api"} == set()


def test_the_last_module_of_ferryid_counts() -> None:
    code = {"FerryIdError": FerryIdError}
    inner = {**code, "__name__": "ferryid.signals.time_ranges"}
    exec("def fail():\n    raise FerryIdError('x')", inner)
    outer = {"__name__": "ferryid.ingest.log", "fail": inner["fail"]}
    exec("def call():\n    fail()", outer)
    with pytest.raises(FerryIdError) as caught:
        outer["call"]()
    assert section(caught.value) == "a-range-of-time"
    assert section(FerryIdError("never raised")) == OPTION
    assert error_pages.see(OPTION) == f" ({PAGE}#{OPTION})"


def test_an_error_that_is_its_own_cause_has_a_section() -> None:
    error = FerryIdError("x")
    error.__cause__ = error
    assert section(error) == OPTION


def test_a_log_of_which_the_profile_takes_no_velocity_is_refused_at_once(
    ferryid, tmp_path: Path, fixtures: Path
) -> None:
    text = load_profile("milliampere").text
    for name in ("position", "velocity"):
        text, count = re.subn(
            rf"^(\[signals\.{name}\]\n)topic = .*$", r'\1topic = "/nowhere"\nrequired = false', text, flags=re.MULTILINE
        )
        assert count == 1
    profile = tmp_path / "still.toml"
    profile.write_text(text, encoding="utf-8")
    run = ferryid("fit", fixtures / "short.mcap", "--vessel", profile, "--out", tmp_path / "out")
    assert run.code == 2
    assert "still.toml: surge and sway velocity are needed, found neither body velocity" in run.err


@pytest.mark.parametrize(
    ("words", "where"),
    [
        (("inspect", "missing.bag"), "a-log"),
        (("fit", "--no-such"), "an-option-or-argument"),
        (("vessel", "check", "missing.toml"), "a-vessel-profile"),
        (("models", "none-such"), "a-stored-model"),
        (("simulate", "no-such"), "a-scenario-or-a-simulation"),
        (("export", "boat", "--to", "pyton"), "an-export"),
    ],
)
def test_errors_lead_to_their_section(
    ferryid, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], where: str
) -> None:
    monkeypatch.chdir(tmp_path)
    run = ferryid(*words)
    assert run.code == 2
    assert run.err.endswith(f" ({PAGE}#{where})\n"), run.err
