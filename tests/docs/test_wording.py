"""Public texts are plain technical English: words that are not the field's stand only where they are known to be left."""

from __future__ import annotations

import ast

import pytest

from tests.docs.pages import PAGES, ROOT
from tests.docs.wording import WORDS, known, places, sentences


@pytest.mark.slow
def test_no_new_text_has_such_a_word() -> None:
    there = set(known())
    new = {f"{path.relative_to(ROOT)}: {place}" for place, path in places().items() if place not in there}
    assert new == set(), "Fix: say it in the words of the field (docs/nomenclature.md)"


@pytest.mark.slow
def test_places_that_are_gone_are_taken_out() -> None:
    left = places()
    assert [one for one in known() if one not in left] == [], "Fix: python -m tests.docs.wording --prune"
    assert known() == sorted(set(known()))


@pytest.mark.slow
def test_documents_have_none() -> None:
    assert [place for place, path in places().items() if path in PAGES] == []


@pytest.mark.parametrize(
    "text", ["what was believed of it", "It is told.", "made anew", "of the wrong hand", "The letter", "was mended"]
)
def test_words_are_found(text: str) -> None:
    assert WORDS.search(text)


@pytest.mark.parametrize("text", ["letters, digits", "a recommended value", "at hand", "the amended profile", "holds"])
def test_other_words_are_not(text: str) -> None:
    assert not WORDS.search(text)


def test_strings_are_read_whole_and_docstrings_left_out() -> None:
    tree = ast.parse('"""What is told."""\nx = f"a {1} b " "c"\ny = "oneword"\nz = {"k": "two words"}\n')
    assert list(sentences(tree)) == ["a {} b c", "two words"]
