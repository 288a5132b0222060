"""What is on a disk after a loss of power: the content of files and the names in folders that were synced, and perhaps more."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tests.faults.system import Operation

VARIANTS = ("nothing kept", "names kept", "mixed")


@dataclass
class Node:
    """A file or folder: as the process sees it, and as it is on disk."""

    folder: bool = False
    content: bytes = b""
    synced: bytes = b""
    names: dict[str, Node] = field(default_factory=dict)
    synced_names: dict[str, Node] = field(default_factory=dict)


def read(path: Path) -> Node:
    """Return what is in a folder, all of it synced."""
    if not path.is_dir():
        data = path.read_bytes()
        return Node(content=data, synced=data)
    names = {one.name: read(one) for one in path.iterdir()}
    return Node(True, names=names, synced_names=dict(names))


def after(start: Path, operations: Sequence[Operation], variant: str, seed: int = 0) -> Node:
    """Return the disk after operations and a loss of power.

    With ``nothing kept`` it holds what was synced and no more: no name that its folder was not synced with, no content of a
    file that was not. With ``names kept`` all names are there, as with a file system that writes names before content. With
    ``mixed`` the names are those at some time since the last sync, and of each file's content some part is there.
    """
    rng = random.Random(seed)
    synced = max((number for number, one in enumerate(operations, 1) if one.kind == "fsync"), default=0)
    named = rng.randint(synced, len(operations)) if variant == "mixed" else len(operations)
    root = read(start)
    for one in operations[:named]:
        _do(root, one)
    return _kept(root, variant, rng)


def write(node: Node, path: Path) -> None:
    """Write what is on a disk to a folder that is not there yet."""
    if not node.folder:
        path.write_bytes(node.content)
        return
    path.mkdir()
    for name, one in node.names.items():
        write(one, path / name)


def _kept(node: Node, variant: str, rng: random.Random) -> Node:
    if node.folder:
        names = node.synced_names if variant == "nothing kept" else node.names
        return Node(True, names={name: _kept(one, variant, rng) for name, one in names.items()})
    content = node.synced
    if variant == "mixed" and node.content != node.synced:
        content = rng.choice([node.synced, node.content[: rng.randint(0, len(node.content))]])
    return Node(content=content)


def _find(root: Node, path: str) -> Node:
    node = root
    for name in Path(path).parts:
        node = node.names[name]
    return node


def _do(root: Node, one: Operation) -> None:
    above, name = _find(root, str(Path(one.path).parent)), Path(one.path).name
    if one.kind == "mkdir":
        above.names[name] = Node(True)
    elif one.kind == "create":
        if name in above.names:
            above.names[name].content = b""
        else:
            above.names[name] = Node()
    elif one.kind == "write":
        above.names[name].content = one.content
    elif one.kind == "fsync":
        node = _find(root, one.path)
        node.synced, node.synced_names = node.content, dict(node.names)
    elif one.kind in ("unlink", "rmdir"):
        del above.names[name]
    else:
        node = above.names[name] if one.kind == "link" else above.names.pop(name)
        _find(root, str(Path(one.target).parent)).names[Path(one.target).name] = node
