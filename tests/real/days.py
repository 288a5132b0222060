"""The runs of Esso Osaka in sessions, by the days that their names tell: what that makes of the withheld wind."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from tests.real import esso

DAY = re.compile(r"\d{2}-[A-Z][a-z]{2}-\d{4}")

HEAD = """
## Sessions

The times of these runs are no dates, so that the tool takes them as one session. Their names tell the days, three of them: here
the departure of each day from the mean of all runs is a random effect of its own, as in recordings with dates. The median angle
off and the error are those of random runs, and of zigzags.

| runs | sessions | wind: evidence; held-out gain [nat] | named | angle off [deg] | rms error [m/s] | in the interval |
|---|---|---|---|---|---|---|"""


def days(paths: Sequence[str]) -> tuple[int, ...]:
    """Return a number for each path, the same for those of one day."""
    found = [(DAY.search(path) or [path])[0] for path in paths]
    return tuple(sorted(set(found)).index(one) for one in found)


def section() -> str:
    """Return the section of the page."""
    rows = [HEAD]
    for kind in ("random", "all"):
        for name, sessions in (("one", None), ("by day", days)):
            rows.append(_row(esso.study(kind, controlled=False, sessions=sessions), kind, name))
    rows.append(
        "\nAll zigzags are of one day. What their formulas are off alike, which by themselves they take for a wind some 40 "
        "degrees from the measured one, is then less of all runs and more of that day's."
    )
    return "\n".join(rows)


def _row(study: esso.Study, kind: str, name: str) -> str:
    found, wind = study.found, study.found.wind
    off, error = np.abs(found.off(study.measured)), found.winds - study.measured
    parts = [study.of(one) for one in esso.KINDS if study.of(one).any()]
    angles = "; ".join(f"{np.median(off[part]):.0f}" for part in parts)
    errors = "; ".join(f"{np.sqrt(np.mean(error[part] ** 2)):.2f}" for part in parts)
    named = sum(esso.WIND in one for one in found.named)
    inside = found.inside(study.measured)
    return (
        f"| {kind} | {name} | {wind.evidence:+.0f}; {wind.gain.total:+.0f} ({wind.gain.low:+.0f} to {wind.gain.high:+.0f}) "
        f"| {named} of {len(found.named)} | {angles} | {errors} | {inside.sum()} of {inside.size} |"
    )
