"""Folders of ROS 2 recordings: metadata.yaml, and SQLite, MCAP or compressed files beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin

from tests.attack.case import UNCHECKED, Base, Mutated, Mutation, replaced
from tests.attack.formats import sqlite3_bag
from tests.attack.logs import WANTED, in_folder, truth_of

YAML = "log/metadata.yaml"
Edit = Callable[[Random, str], "tuple[str, str]"]


def bases() -> list[Base]:
    """SQLite and MCAP, and SQLite with messages or files packed by zstd."""
    zstd = CompressionFormat.ZSTD
    return [
        _base("SQLite", StoragePlugin.SQLITE3, None, UNCHECKED),
        _base("MCAP", StoragePlugin.MCAP, None, UNCHECKED),
        _base("SQLite, messages in zstd", StoragePlugin.SQLITE3, (CompressionMode.MESSAGE, zstd), UNCHECKED),
        _base("SQLite, file in zstd", StoragePlugin.SQLITE3, (CompressionMode.FILE, zstd), UNCHECKED),
    ]


def _base(name: str, plugin: StoragePlugin, packing: tuple[object, object] | None, guard: str) -> Base:
    files, path, folder = in_folder(lambda place: sqlite3_bag.write_folder(place, plugin, packing))
    return Base("rosbag2", name, files, path, truth_of(folder / path, "cdr"), WANTED, guard)


def _number(random: Random, text: str) -> tuple[str, str]:
    lines = text.split("\n")
    places = [i for i, line in enumerate(lines) if line.rpartition(":")[2].strip().lstrip("-").isdigit()]
    place = random.choice(places)
    key = lines[place].rpartition(":")[0]
    value = random.choice(
        ("0", "1", "-1", "9223372036854775807", "1" + "0" * 400, ".inf", ".nan", "1e5", "null", "'x'", "[]", "{}",
         "0x7fffffffffffffff", "1_000", "2001-01-01", "true", "9" * 5000, "*x", "!!binary aGk=", "18446744073709551616")
    )  # fmt: skip
    lines[place] = f"{key}: {value}"
    return f"line {place}: {lines[place].strip()[:60]}", "\n".join(lines)


def _text(random: Random, text: str) -> tuple[str, str]:
    lines = text.split("\n")
    places = [i for i, line in enumerate(lines) if ":" in line and line.rpartition(":")[2].strip()]
    place = random.choice(places)
    key = lines[place].rpartition(":")[0]
    value = random.choice(
        ("null", "7", "''", "/", "../../../../etc/passwd", "[a, b]", "{a: b}", "'\\x00'", '"\\e[2J"', "~", "x" * 70_000,
         "zstd", "lz4", "file", "message", "FILE", "!!python/object/apply:os.system ['true']", "&a [*a]", "2025-01-01")
    )  # fmt: skip
    lines[place] = f"{key}: {value}"
    return f"line {place}: {lines[place].strip()[:60]}", "\n".join(lines)


def _lines(random: Random, text: str) -> tuple[str, str]:
    lines = text.split("\n")
    place = random.randrange(len(lines))
    action = random.choice(("dropped", "twice", "swapped", "indented"))
    if action == "dropped":
        del lines[place]
    elif action == "twice":
        lines.insert(place, lines[place])
    elif action == "swapped":
        other = random.randrange(len(lines))
        lines[place], lines[other] = lines[other], lines[place]
    else:
        lines[place] = "  " + lines[place]
    return f"line {place} {action}", "\n".join(lines)


def _aliases(random: Random, text: str) -> tuple[str, str]:
    depth = random.choice((9, 12, 25))
    names = ["a: &a0 [x, x, x, x, x, x, x, x, x]"]
    names += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, depth)]
    target = random.choice(("relative_file_paths", "topics_with_message_count", "files", "custom_data"))
    what = f"aliases that grow to 9 to the power of {depth}, as {target}"
    lines = text.split("\n")
    place = next((i for i, line in enumerate(lines) if line.strip().startswith(target + ":")), len(lines) - 1)
    indent = " " * (len(lines[place]) - len(lines[place].lstrip()) or 2)
    if random.random() < 0.5:
        lines[place] = f"{indent}{target}: *a{depth - 1}"
    return what, "\n".join(names + lines)


def _depth(random: Random, text: str) -> tuple[str, str]:
    depth = random.choice((100, 2000, 100_000))
    opening, closing = random.choice((("[", "]"), ("{a: ", "}"), ("- ", "")))
    return f"{depth} levels of {opening!r}", text + "\n  odd: \n   " + opening * depth + closing * depth


def _long(random: Random, text: str) -> tuple[str, str]:
    size = random.choice((1_000_000, 20_000_000))
    piece = random.choice(("# comment\n", "k: v\n", " ", "- x\n"))
    return f"{size} bytes of {piece!r} behind it", text + piece * (size // len(piece))


def _self(random: Random, text: str) -> tuple[str, str]:
    return "a list that contains itself", text.replace("relative_file_paths:", "odd: &r [*r]\n  relative_file_paths:")


def _topics(random: Random, text: str) -> tuple[str, str]:
    count = random.choice((1000, 20_000))
    entry = "\n".join(
        f"    - {{topic_metadata: {{name: /t{i}, type: a/msg/B, serialization_format: cdr}}, message_count: 1}}"
        for i in range(count)
    )
    return f"{count} more topics", text.replace("topics_with_message_count:", "topics_with_message_count:\n" + entry)


EDITS: dict[str, Edit] = {
    "metadata: number": _number,
    "metadata: text": _text,
    "metadata: lines": _lines,
    "metadata: aliases": _aliases,
    "metadata: depth": _depth,
    "metadata: long": _long,
    "metadata: refers to itself": _self,
    "metadata: topics": _topics,
}


def _yaml(edit: Edit) -> Mutation:
    def mutation(random: Random, base: Base) -> Mutated | None:
        what, text = edit(random, base.files[YAML].decode())
        content = text.encode()
        # How messages are packed stands nowhere else; another type changes what they mean.
        return None if content == base.files[YAML] else Mutated(what, replaced(base, YAML, content), content=True)

    return mutation


def files_changed(random: Random, base: Base) -> Mutated | None:
    """Lose, empty, rename or double a file of the folder."""
    name = random.choice(sorted(base.files))
    action = random.choice(("lost", "empty", "renamed", "doubled", "journal"))
    files = dict(base.files)
    data = name != YAML
    if action == "lost":
        del files[name]
    elif action == "empty":
        files[name] = b""
    elif action == "renamed":
        files[str(Path(name).with_name("other" + Path(name).suffix))] = files.pop(name)
    elif action == "doubled":
        files[str(Path(name).with_name("other_" + Path(name).name))] = files[name]
    else:
        files[name + random.choice(("-wal", "-journal"))] = random.choice((b"", random.randbytes(4096)))
    # Without the metadata every file in the folder is read.
    return Mutated(f"{name} {action}", files, content=True, extra=base.count if data and action == "doubled" else 0)


def _inside(mutation: Mutation) -> Mutation:
    def inside(random: Random, base: Base) -> Mutated | None:
        if not any(name.endswith(".db3") for name in base.files):
            return None
        made = mutation(random, base)
        return None if made is None else replace(made, what=f"SQLite file: {made.what}")

    return inside


MUTATIONS: dict[str, Mutation] = {
    **{kind: _yaml(edit) for kind, edit in EDITS.items()},
    "files of the folder": files_changed,
    "header of a page": _inside(sqlite3_bag.header_of_page),
    "cell": _inside(sqlite3_bag.cell),
    "SQL": _inside(sqlite3_bag.sql),
}
