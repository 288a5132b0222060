"""Hash of ferryid's sources: what was diagnosed with others is diagnosed again."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

import ferryid

EVALUATION = (
    *("report/", "reproduce/", "batch/", "draft/", "schemas/", "cli/"),
    *(
        "validation/campaign_oracle",
        "validation/estimate_errors",
        "validation/evaluators",
        "validation/name_scores",
        "validation/oracle",
        "validation/page",
        "validation/recorded/page",
        "validation/recorded/scores",
        "validation/rivals/",
        "validation/scores",
        "validation/sea_scores",
        "validation/transfer",
    ),
)
"""How the names of those begin that have no part in a log and its diagnosis: they evaluate, draw, print or draft profiles."""
KINDS = (".py", ".toml")


def source_hash(*, evaluation: bool = False) -> str:
    """Return a hash of all sources that a log and its diagnosis depend on; with those that evaluate it if `evaluation`."""
    root = Path(ferryid.__file__).parent
    digest = sha256()
    for path in sorted(path for path in root.rglob("*") if path.suffix in KINDS):
        name = path.relative_to(root).as_posix()
        if evaluation or not name.startswith(EVALUATION):
            digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
