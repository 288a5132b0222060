"""Hash of ferryid's sources: what was diagnosed with others is diagnosed anew."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

import ferryid

AFTERWARDS = (
    *("report/", "reproduce/", "batch/", "schemas/", "cli/"),
    *(
        "prove/judges",
        "prove/oracle",
        "prove/told",
        "prove/second",
        "prove/rivals/",
        "prove/score",
        "prove/page",
        "prove/figures",
    ),
)
"""How the names of those begin that have no part in a log and its diagnosis: they only judge it, or draw, or print."""
KINDS = (".py", ".toml")


def sources(*, judging: bool = False) -> str:
    """Return a hash of all sources that a log and its diagnosis depend on; with those that judge it if `judging`."""
    root = Path(ferryid.__file__).parent
    digest = sha256()
    for path in sorted(path for path in root.rglob("*") if path.suffix in KINDS):
        name = path.relative_to(root).as_posix()
        if judging or not name.startswith(AFTERWARDS):
            digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
