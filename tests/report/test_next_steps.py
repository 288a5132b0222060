"""What stands at the end of a page: commands that follow, links to its sections, texts in the place of drawings."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from shlex import split

import pytest
import typer

from ferryid.cli.app import app
from ferryid.report.html import CONTENTS, template, with_contents
from ferryid.report.next_steps import Step, after_fit, after_sweep

COMMAND = ("ferryid", "fit", "a b.mcap", "--vessel", "my boat.toml")


@pytest.mark.parametrize(
    "steps",
    [
        after_fit("ferry@2", True, ["a b.mcap"], COMMAND),
        after_fit("ferry@2", False, ["a b.mcap"], COMMAND),
        after_sweep(("--components", "3"), True, COMMAND),
        after_sweep(("--components", "3"), False, COMMAND),
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
    assert [command.split()[1] for _, command in after_sweep((), False, COMMAND)] == ["diagnose"]
    assert [command.split()[1] for _, command in after_sweep((), True, COMMAND)] == ["fit", "diagnose"]


def test_several_logs_are_not_named() -> None:
    assert all(".mcap" not in command for _, command in after_fit("ferry@1", False, ["a.mcap", "b.mcap"], ()))
    assert all("--vessel" not in command for _, command in after_fit("ferry@1", False, ["a.mcap"], ()))


@pytest.mark.parametrize("told", [("--out", "sea trials"), ("--out=sea trials",)])
def test_commands_find_the_log_and_the_model_where_the_fit_did(told: tuple[str, ...]) -> None:
    command = ("ferryid", "fit", "logs/a.mcap", *told)
    judge, lacks, *others = (split(step) for _, step in after_fit("ferry@1", True, ["a.mcap"], command))
    assert lacks[2:] == ["logs/a.mcap"]
    assert all(words[-len(told) :] == list(told) for words in (judge, *others))
    # A fit of an archive has no path of a log in its words.
    assert split(after_fit("ferry@1", False, ["a.mcap"], ("ferryid", "fit", "--archive"))[0][1])[2:] == ["LOG"]


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
