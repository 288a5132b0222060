"""What stands at the end of a page: commands that follow, links to its sections, texts in the place of drawings."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path
from shlex import split

import pytest
import typer

from ferryid.cli.app import app
from ferryid.report.html import CONTENTS, template, with_contents
from ferryid.report.next_steps import Step, after_fit, after_sweep
from ferryid.types import Given, RunContext

GIVEN = Given(("a b.mcap",), "my boat.toml")


@pytest.mark.parametrize(
    "steps",
    [
        after_fit("ferry@2", True, GIVEN),
        after_fit("ferry@2", False, GIVEN),
        after_sweep(("--components", "3"), True, GIVEN),
        after_sweep(("--components", "3"), False, GIVEN),
    ],
)
def test_steps_are_commands_of_ferryid_with_its_vessel(steps: list[Step]) -> None:
    group = typer.main.get_command(app)
    context = typer.Context(group)
    for _, command in steps:
        program, name, *rest = split(command)
        assert program == "ferryid"
        found = group.get_command(context, name)  # type: ignore[attr-defined]
        # A command of several, such as sweep, has its options one level deeper.
        found = found.get_command(context, rest[0]) if hasattr(found, "commands") else found
        options = {one for each in found.params for one in each.opts}
        assert {word for word in rest if word.startswith("--")} <= options
        if name in ("fit", "diagnose", "plan", "sweep"):
            assert rest[rest.index("--vessel") + 1] == "my boat.toml"


def test_a_sweep_that_loses_to_the_base_model_leads_to_no_fit() -> None:
    assert [command.split()[1] for _, command in after_sweep((), False, GIVEN)] == ["diagnose"]
    assert [command.split()[1] for _, command in after_sweep((), True, GIVEN)] == ["fit", "diagnose"]


def test_several_logs_are_not_named() -> None:
    several = Given(("a.mcap", "b.mcap"))
    assert all(".mcap" not in command for _, command in after_fit("ferry@1", False, several))
    assert all("--vessel" not in command for _, command in after_fit("ferry@1", False, several))
    assert all(".mcap" not in command for _, command in after_sweep((), True, several))


def test_commands_find_the_log_and_the_model_where_the_fit_did() -> None:
    given = Given(("logs/a.mcap",), out="sea trials")
    judge, lacks, *others = (split(step) for _, step in after_fit("ferry@1", True, given))
    assert lacks[2:] == ["logs/a.mcap"]
    assert all(words[-2:] == ["--out", "sea trials"] for words in (judge, *others))
    # A fit of an archive has no path of a log in its words.
    assert split(after_fit("ferry@1", False, Given())[0][1])[2:] == ["LOG"]


def test_commands_take_what_was_used_of_a_log() -> None:
    given = Given(("a.mcap",), ranges=(("60", "300"), ("-90", "-10")))
    steps = [*after_fit("ferry@1", False, given), *after_sweep((), True, given)]
    assert all(split(command)[-4:] == ["--from", "60,-90", "--to", "300,-10"] for _, command in steps)
    from_a_time = Given(("a.mcap",), ranges=((60.0, None),))
    assert split(after_sweep((), False, from_a_time)[0][1])[2:] == ["a.mcap", "--from", "60.0"]
    # Of the log of another day all is used.
    assert "--from" not in after_fit("ferry@1", True, given)[0][1]


def test_the_value_of_an_option_is_no_log(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Given] = []

    def fitted(logs: object, profile: object, settings: object, run: RunContext, **_: object) -> None:
        told.append(run.given)
        raise StopIteration

    monkeypatch.setattr("ferryid.report.fit_report.fit_and_report", fitted)
    log = str(Path(__file__).parents[2] / "fixtures" / "short.mcap")
    # A name, a folder or a profile may be called as the log is.
    words = [
        "fit",
        log,
        "--vessel",
        "milliampere",
        "--name",
        Path(log).name,
        f"--out={log}.d",
        "--from",
        "20",
        "--no-report",
    ]
    with pytest.raises(StopIteration):
        app(words, standalone_mode=False)
    assert told == [Given((log,), "milliampere", f"{log}.d", (("20", None),))]


def test_every_section_has_a_link() -> None:
    page = with_contents(f"{CONTENTS}<h2>One &amp; two</h2><p>x</p><h2>Three</h2>")
    assert re.findall(r'<a href="#([\w-]+)">(.*?)</a>', page) == [
        ("section-1", "One &amp; two"),
        ("section-2", "Three"),
    ]
    assert re.findall(r'<h2 id="([\w-]+)">(.*?)</h2>', page) == [("section-1", "One &amp; two"), ("section-2", "Three")]


def test_a_drawing_has_a_text_in_its_place() -> None:
    labels: list[str | None] = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            if dict(attrs).get("role") == "img":
                labels.append(dict(attrs).get("aria-label"))

    figure = {"file": "x", "svg": "<svg></svg>", "caption": 'Force "X" & more.'}
    drawn = template("figures.html").module.drawn  # type: ignore[attr-defined]
    Reader().feed(str(drawn([figure, figure])))
    assert labels == [figure["caption"]] * 2
