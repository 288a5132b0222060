"""The folder of a proof: which draw it holds, what of it is finished, and when all has to begin anew."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError
from ferryid.files import dump_json, remove_abandoned, write_text
from ferryid.prove.finished import finished
from ferryid.prove.seal import SALT_BYTES, Key, canonical, key_of
from ferryid.prove.sources import sources

OURS = (
    *("run.json", "seal.json", "answers.sealed", "answers.json", "result.json", "proof.md"),
    *("lines", "logs", "models", "again", "scratch", "proof"),
)
"""All that a proof writes into its folder, and all that is removed where it begins anew."""


@dataclass(frozen=True)
class Desk:
    """A proof's folder.

    Attributes
    ----------
    folder
        Absolute path.
    key
        What seals its answers.
    sources
        Hash of the sources that it is made with.
    """

    folder: Path
    key: Key
    sources: str

    def lines(self, stage: str) -> Path:
        """Return the file of what is finished of a stage."""
        return self.folder / "lines" / f"{stage}.jsonl"

    def forget(self, stage: str, names: Iterable[str]) -> None:
        """Have some cases of a stage done again."""
        gone, path = set(names), self.lines(stage)
        lines = finished(path)
        if gone & set(lines):
            kept = [{"name": name, "result": result} for name, result in lines.items() if name not in gone]
            write_text(path, "".join(json.dumps(line) + "\n" for line in kept))


def desk(folder: Path, seed: int, drawn: Mapping[str, Any], tell: Callable[[str], None]) -> Desk:
    """Return the folder of a proof, emptied where it holds another one that is finished, or was made with other sources.

    Parameters
    ----------
    folder
        Absolute path.
    seed
        Of the draw. It is nowhere written before the answers are open; whether it is that of the folder can be checked by
        whoever knows it.
    drawn
        What else decides which cases there are.
    tell
        Called with what becomes of an earlier proof.

    Raises
    ------
    FerryIdError
        Where another proof is not finished, or what is there is none that this knows of.
    """
    path, stamp = folder / "run.json", sources()
    before = _before(path)
    key = key_of(seed, before["salt"] if before else None)
    mark = key.mark(canonical(drawn).decode())
    if before is None and (strange := [name for name in OURS if (folder / name).exists()]):
        raise FerryIdError(
            f"{folder}: holds {strange[0]}, and no run.json that tells of a proof: it may be somebody's work. "
            "Fix: remove or move the folder, or choose another --out"
        )
    if before is not None and before["sources"] != stamp:
        tell("the sources of ferryid have changed since this folder's proof was begun: it begins anew")
        _clear(folder)
    elif before is not None and before["mark"] != mark:
        if not (folder / "result.json").exists():
            raise FerryIdError(
                f"{folder}: holds a proof of another seed, --runs or --only that is not finished. "
                "Fix: go on with those that it was begun with, or choose another --out"
            )
        tell("this folder's proof, of another seed, --runs or --only, is finished: another begins in its place")
        _clear(folder)
    elif before is not None:
        tell("what is finished of this folder's proof is kept")
        sweep(folder)
        return Desk(folder, key, stamp)
    write_text(path, dump_json({"salt": key.salt.hex(), "mark": mark, "sources": stamp}))
    return Desk(folder, key, stamp)


def _before(path: Path) -> dict[str, Any] | None:
    try:
        plain = json.loads(path.read_text("utf-8"))
        salt = bytes.fromhex(plain["salt"])
        return {**plain, "salt": salt} if len(salt) == SALT_BYTES and {"mark", "sources"} <= set(plain) else None
    except (OSError, ValueError, TypeError, KeyError):
        return None


def _clear(folder: Path) -> None:
    for name in OURS:
        path = folder / name
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def sweep(folder: Path) -> None:
    """Remove what is left half-done, and what nobody needs any more."""
    shutil.rmtree(folder / "scratch", ignore_errors=True)
    shutil.rmtree(folder / "again", ignore_errors=True)
    remove_abandoned(folder / "logs")
