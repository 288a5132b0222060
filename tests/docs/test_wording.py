"""Public texts are plain technical English, in the words of the field."""

from __future__ import annotations

import ast

import pytest

from tests.docs.pages import ROOT
from tests.docs.wording import WORDS, places, sentences


@pytest.mark.slow
def test_no_public_text_has_such_a_word() -> None:
    found = {f"{path.relative_to(ROOT)}: {place}" for place, path in places().items()}
    assert found == set(), "Fix: say it in the words of the field (docs/nomenclature.md)"


@pytest.mark.parametrize(
    "text",
    [
        "what was believed of it",
        "It is told.",
        "made anew",
        "of the wrong hand",
        "The letter",
        "was mended",
        "no force can be had",
        "The positions are 0.81 s earlier than the velocities.",
    ],
)
def test_words_are_found(text: str) -> None:
    assert WORDS.search(text)


@pytest.mark.parametrize("text", ["letters, digits", "a recommended value", "at hand", "the amended profile", "holds"])
def test_other_words_are_not(text: str) -> None:
    assert not WORDS.search(text)


def test_strings_are_read_whole_and_docstrings_left_out() -> None:
    tree = ast.parse('"""What is told."""\nx = f"a {1} b " "c"\ny = "oneword"\nz = {"k": "two words"}\n')
    assert list(sentences(tree)) == ["a {} b c", "two words"]
