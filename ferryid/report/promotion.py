"""Which stored version is the current one: moved forwards after a replay, and back."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from ferryid.compare import Ratio, Replay, replay_versions
from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError
from ferryid.files import alone
from ferryid.models import Model
from ferryid.models.store import current_version, load, promote, roll_back
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile


def promote_version(
    reference: str, logs: Sequence[str], run: RunContext, vessel: Profile | None = None, *, force: bool = False
) -> tuple[dict[str, Any], str]:
    """Promote a version, and return the result as JSON and as text; see `ferryid.api.promote`."""
    name, _, version = reference.partition("@")
    if not name or not version:
        raise FerryIdError(f"{reference}: names no version. Fix: write it as NAME@VERSION, see ferryid models")
    new = load(f"{name}@{version}", run.out)
    current = current_version(name, run.out)
    if current == new.version:
        return _told(new, current, True, "It is the current version already.", None)
    found = None
    if logs and current is not None:
        run.progress("replaying")
        found = replay_versions(new, load(f"{name}@{current}", run.out), logs, run, vessel)
    allowed, reason = _verdict(new, current, found)
    if allowed or force:
        with alone(run.out / "models"):
            known = () if found is None else found.logs
            promote(new, run.out, reason, logs=known, forced=not allowed)
    return _told(new, current, allowed or force, reason, found)


def roll_back_version(name: str, out: Path, to: int | None = None) -> tuple[dict[str, Any], str]:
    """Roll back, and return the result as JSON and as text; see `ferryid.api.roll_back`."""
    with alone(out / "models"):
        before, version = roll_back(name, out, to)
    text = f"{name}@{version} is current" + ("" if before is None else f", before it was @{before}")
    return {"schema": "ferryid.promotion/1", "name": name, "version": version, "before": before, "promoted": True}, text


def _verdict(new: Model, current: int | None, found: Replay | None) -> tuple[bool, str]:
    """Return whether a version may become current, and why or why not."""
    if found is None:
        if not new.accepted and current is None:
            return False, "It was rejected by its fit, and no version is current that a replay could compare it with."
        if not new.accepted:
            return False, "It was rejected by its fit, and it was not replayed on any log."
        if current is None:
            return True, "It was accepted, and no version was current."
        return True, "It was accepted; it was not compared with the version before on any log."
    where = counted(len(found.logs), "log")
    if not found.decides:
        short = f"{where} {verb(len(found.logs), 'is')} too short to distinguish it from @{current}"
        if not new.accepted:
            return False, f"It was rejected by its fit, and {short}."
        return True, f"It was accepted, and {short}."
    if found.worse:
        return False, f"Replayed on {where} it is worse than @{current} in {_named(found.worse)}."
    if not new.accepted and not found.better:
        return (
            False,
            f"It was rejected by its fit, and replayed on {where} it is not better than @{current} in anything.",
        )
    better = f"better than @{current} in {_named(found.better)}" if found.better else f"not worse than @{current}"
    return True, f"Replayed on {where} it is {better}."


def _with_interval(ratio: Ratio) -> str:
    if not isfinite(ratio.p):
        return f"{ratio.value:.2f} (too little data for one)"
    return f"{ratio.value:.2f} ({ratio.low:.2f} to {ratio.high:.2f})"


def _named(rows: Sequence[Any]) -> str:
    return ", ".join(row.quantity for row in rows)


def _told(
    new: Model, before: int | None, promoted: bool, reason: str, found: Replay | None
) -> tuple[dict[str, Any], str]:
    lines = [f"{new.label} is {'current' if promoted else 'not made current'}. {reason}"]
    if not promoted:
        replay = "" if before is None else "replay it on logs that neither was trained on, or "
        lines.append(f"Fix: {replay}use --force, which the history mentions")
    if found is not None:
        title = "rms error of free runs" if found.free else "rms error, no free runs"
        lines += ["", f"{title:<28}{f'@{new.version}':>10}{f'@{before}':>10}  ratio (95 % interval)"]
        lines += [
            f"{f'{row.quantity} [{row.unit}]':<28}{row.new:>10.3g}{row.old:>10.3g}  {_with_interval(row.ratio)}"
            for row in found.rows
        ]
        lines += [f"warning: {label} was trained on such a log: it is no evidence for it" for label in found.trained]
    rows = [] if found is None else [row.to_json() for row in found.rows]
    result = {
        "schema": "ferryid.promotion/1",
        "name": new.name,
        "version": new.version,
        "before": before,
        "promoted": promoted,
        "reason": reason,
        "replay": rows,
    }
    return result, "\n".join(lines)
