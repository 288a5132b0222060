"""Public texts and the words in them that are not the field's: ``python -m tests.docs.wording`` lists them.

Public are the sentences in the code (help, messages, report texts), the templates, the bundled TOML files and the documents.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from tests.docs.pages import FENCE, PAGES, ROOT

WORDS = re.compile(
    r"\b(?:told|tells?|mend(?:s|ed|ing)?|letter|anew|(?:wrong|same|other) hand|(?:un)?believ(?:ed?|able)|learnt|taught"
    r"|suspected|witness(?:es)?|(?:held|hold(?:s|ing)?) (?:\w+ ){0,2}against|says nothing|nothing says"
    r"|speaks? (?:for|against)|imagined?|can be had|ha(?:s|ve) no name|is no chance|something unsteady"
    r"|s (?:earlier|later) than the)\b",
    re.IGNORECASE,
)
CODE = re.compile(r"<(script|style)\b.*?</\1>|<[^>]*>|\{[{%#].*?[}%#]\}", re.DOTALL)
"""What no reader of a template sees."""
AROUND = 40
"""Characters on either side by which a place is known."""


def sentences(tree: ast.AST) -> Iterator[str]:
    """Yield the strings of a module that hold a space: f-strings whole, with ``{}`` for what is filled in."""
    inside: set[int] = set()
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for one in body if isinstance(body, list) else ():
            if isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant):
                inside.add(id(one.value))
        if isinstance(node, ast.JoinedStr):
            parts = [part.value if isinstance(part, ast.Constant) else "{}" for part in node.values]
            inside |= {id(part) for part in node.values}
            text = "".join(map(str, parts))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inside:
            text = node.value
        else:
            continue
        if " " in text.strip():
            yield text


def _help(tree: ast.AST) -> Iterator[str]:
    """Yield the docstrings of a module's commands, which are their help."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and (text := ast.get_docstring(node)):
            yield text


def texts() -> Iterator[tuple[Path, str]]:
    """Yield every public text with its file."""
    for path in sorted([*(ROOT / "ferryid").rglob("*.py"), *(ROOT / "cli").glob("*.py")]):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        yield from ((path, text) for text in sentences(tree))
        if path.name.startswith("cmd_"):
            yield from ((path, text) for text in _help(tree))
    for path in sorted((ROOT / "ferryid").rglob("*.html")):
        yield path, CODE.sub(" ", path.read_text(encoding="utf-8"))
    for path in sorted((ROOT / "ferryid").rglob("*.toml")):
        yield path, path.read_text(encoding="utf-8")
    for path in PAGES:
        # What commands print is public as well, where it is made.
        yield path, FENCE.sub("", path.read_text(encoding="utf-8"))


def places() -> dict[str, Path]:
    """Return every word that is not the field's, with the words around it, and the file it is in."""
    found = {}
    for path, text in texts():
        plain = " ".join(text.split())
        for one in WORDS.finditer(plain):
            found[plain[max(0, one.start() - AROUND) : one.end() + AROUND].strip()] = path
    return found


if __name__ == "__main__":
    for place, path in sorted(places().items(), key=lambda one: (str(one[1]), one[0])):
        print(f"{path.relative_to(ROOT)}: {place}")
