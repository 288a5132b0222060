"""Numbers and their nouns: one helper says "1 row" and "2 rows", and no message counts without it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from ferryid.counts import all_counted, counted, per_cent, plural, verb

ROOT = Path(__file__).resolve().parents[1]
NOUNS = (
    "axes|bases|blocks|bytes|cells|chunks|columns|components|draws|entries|faults|fields|files|findings|"
    "folders|folds|frames|gaps|jumps|lines|logs|losses|messages|models|others|pages|parts|pieces|places|"
    "points|poses|records|rows|runs|samples|signals|spikes|stamps|steps|stretches|structures|terms|topics|"
    "values|visits|warnings|windows|words"
)
ADJECTIVES = (
    "aligned|CSV|damaged|empty|free|implausible|independent|more|other|required|senseless|separate|single|"
    "such|unbroken|usable|validation"
)
BARE = re.compile(rf"^ (?:(?:{ADJECTIVES}) )*(?:{NOUNS})\b")
HAND_MADE = re.compile(
    r"\{\{? ?'e?s' (if|\*)|'e?s' \*|'s' if|[a-z]\(e?s\) |\b1 (rows|messages|logs|topics|gaps|losses)\b"
)
NO_COUNT = re.compile(
    r"[A-Z_]+|(number|spread|_series|_share|counted|plural|verb)\(.*|\[.*|what|signal|digest|instance"
)
"""What may stand before a noun and is no count that can be one: a limit, a ratio in words, a name, a verb."""


def _counts(path: Path) -> Iterator[str]:
    """Yield every number in a text that is followed by a noun in the plural."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.JoinedStr):
            continue
        for value, text in zip(node.values, node.values[1:], strict=False):
            if not (isinstance(value, ast.FormattedValue) and isinstance(text, ast.Constant)):
                continue
            if value.format_spec is None and value.conversion == -1 and BARE.match(text.value):
                shown = ast.unparse(value.value)
                if not NO_COUNT.fullmatch(shown):
                    yield f"{path.relative_to(ROOT)}:{node.lineno}: {{{shown}}}{text.value[:40]}"


@pytest.mark.parametrize(
    ("number", "noun", "said"),
    [
        (0, "row", "0 rows"),
        (1, "row", "1 row"),
        (2, "row", "2 rows"),
        (1, "stretch", "1 stretch"),
        (3, "stretch", "3 stretches"),
        (2, "more loss", "2 more losses"),
        (2, "entry", "2 entries"),
        (2, "day", "2 days"),
        (2, "basis", "2 bases"),
        (1, "damaged row", "1 damaged row"),
    ],
)
def test_a_number_has_its_noun(number: int, noun: str, said: str) -> None:
    assert counted(number, noun) == said


def test_two_of_two_are_both() -> None:
    assert all_counted(2, "log") == "both logs"
    assert all_counted(3, "log") == "all 3 logs"


def test_verbs_agree() -> None:
    assert [verb(1, word) for word in ("is", "was", "has", "repeats")] == ["is", "was", "has", "repeats"]
    assert [verb(2, word) for word in ("is", "was", "has", "repeats")] == ["are", "were", "have", "repeat"]
    assert plural(1.0, "sample") == "sample"


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["ferryid", "cli"])
def test_every_message_counts_with_the_helper(folder: str) -> None:
    modules = [path for path in sorted((ROOT / folder).rglob("*.py")) if path.name != "counts.py"]
    assert [said for path in modules for said in _counts(path)] == []


def test_no_plural_is_made_by_hand() -> None:
    paths = [*(ROOT / "ferryid").rglob("*.py"), *(ROOT / "cli").rglob("*.py"), *(ROOT / "ferryid").rglob("*.html")]
    found = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for path in paths
        for line in path.read_text(encoding="utf-8").splitlines()
        if ('f"' in line or "f'" in line or path.suffix == ".html") and HAND_MADE.search(line)
    ]
    assert found == []


def test_the_search_finds_what_it_looks_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        'said = f"{count} rows; {len(these)} more required signals; {count:.1f} rows; {MOST_ROWS} rows"\n'
    )
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    assert [said.partition(": ")[2] for said in _counts(module)] == [
        "{count} rows; ",
        "{len(these)} more required signals; ",
    ]
    for line in ("{n} row{'s' * (n > 1)}", "{{ n }} row{{ 's' if n > 1 }}", "{n} line(s) skipped", "found 1 rows"):
        assert HAND_MADE.search(line)


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (1.0, "100 %"),
        (12.34, "1200 %"),
        (0.0057, "0.57 %"),
        (0.124, "12 %"),
        (0.0, "0 %"),
        (-1.0, "-100 %"),
        (0.00012, "0.012 %"),
    ],
)
def test_a_share_is_written_without_a_power_of_ten(share: float, text: str) -> None:
    assert per_cent(share) == text
