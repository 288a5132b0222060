"""Which version of a model was current when, and why: ``<out>/models/<name>/history.jsonl``, one change a line.

The note ``current`` alone says which version is current. The history is told beside it: a change whose line was not written,
after a kill or by an older ferryid, is one more version that was current, of which nothing else is known.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ferryid.files import write_text

ACTIONS = ("fit", "diagnose", "promote", "rollback")


@dataclass(frozen=True)
class Change:
    """One change of the current version.

    Attributes
    ----------
    time
        When, UTC.
    action
        One of `ACTIONS`.
    before, version
        The version that was current, None for none, and the one that is since.
    reason
        In a sentence.
    logs
        Name and sha256 of each log that the versions were compared on.
    forced
        Whether it was made against the verdict.
    """

    time: str
    action: str
    before: int | None
    version: int
    reason: str
    logs: tuple[Mapping[str, str], ...] = ()
    forced: bool = False

    @property
    def sentence(self) -> str:
        """The change as a line."""
        gone = "" if self.before is None else f" after @{self.before}"
        return f"{self.time}  {self.action}: @{self.version}{gone}{', forced' if self.forced else ''}. {self.reason}"


def read_history(folder: Path) -> tuple[Change, ...]:
    """Return the changes of a model's folder in their order; lines that cannot be read are passed over."""
    text = ""
    with suppress(OSError):
        text = (folder / "history.jsonl").read_text(encoding="utf-8", errors="replace")
    return tuple(change for line in text.splitlines() if (change := _parsed(line)) is not None)


def make_current(
    folder: Path,
    before: int | None,
    version: int,
    action: str,
    reason: str,
    *,
    logs: Sequence[Mapping[str, str]] = (),
    forced: bool = False,
) -> None:
    """Make a version current, and add the change to the history; a version that is current already is no change."""
    if before == version:
        return
    write_text(folder / "current", f"{version}\n")
    time = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    line = json.dumps(asdict(Change(time, action, before, version, reason, tuple(logs), forced)), ensure_ascii=False)
    path = folder / "history.jsonl"
    known = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    write_text(path, f"{known.rstrip()}\n{line}\n".lstrip())


def earlier_versions(folder: Path, current: int | None) -> list[int]:
    """Return the versions that were current before the present one, oldest first; a rollback takes back what it undid."""
    stack: list[int] = []
    for change in read_history(folder):
        if change.before is not None and not stack:
            stack.append(change.before)
        if change.action == "rollback" and change.version in stack:
            while stack[-1] != change.version:
                stack.pop()
        elif not stack or stack[-1] != change.version:
            stack.append(change.version)
    if current is not None and stack and stack[-1] == current:
        stack.pop()
    return stack


def _parsed(line: str) -> Change | None:
    try:
        found: dict[str, Any] = json.loads(line)
        version, before = found["version"], found["before"]
        if not isinstance(version, int) or not isinstance(before, int | None):
            return None
        return Change(
            time=str(found["time"]),
            action=str(found["action"]),
            before=before,
            version=version,
            reason=str(found["reason"]),
            logs=tuple({str(key): str(value) for key, value in log.items()} for log in found["logs"]),
            forced=bool(found["forced"]),
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
