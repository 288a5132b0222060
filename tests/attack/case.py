"""What the attack is made of: undamaged logs, mutated ones, and the choice of one by seed and number."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from random import Random

import numpy as np
from numpy.typing import NDArray

from tests.attack import formats as package

# What checksums of a format promise for the payload that is returned.
EXACT = "exact"
"""Values that differ are never returned."""
EXACT_IF_VERIFIED = "exact if verified"
"""With ``verify=True`` they are never returned."""
REPORTED = "reported"
"""They may be returned (one checksum at the end of everything), but a loss is reported."""
UNCHECKED = "unchecked"
"""The format has no checksum: only the number of messages can be held against the undamaged file."""


@dataclass(frozen=True)
class Rows:
    """Messages of one topic as an independent library reads them: receive times [ns], and one value each."""

    times: NDArray[np.int64]
    values: NDArray[np.float64]


@dataclass(frozen=True)
class Base:
    """One undamaged log.

    Attributes
    ----------
    format, name
        Module of the format, and which of its logs this is.
    files
        Name to content; `path` is the one to open, or the folder.
    truth
        Topic to messages, read by another library than ferryid's readers.
    wanted
        Topic to the fields that are read; `Rows.values` belongs to the first.
    guard
        What its checksums promise.
    spans
        File to stretches of bytes that checksums cover; None where they cover everything.
    whole_at
        Sizes [bytes] at which its file, cut off, is a complete log of fewer messages.
    """

    format: str
    name: str
    files: Mapping[str, bytes]
    path: str
    truth: Mapping[str, Rows]
    wanted: Mapping[str, tuple[str, ...]]
    guard: str = UNCHECKED
    spans: Mapping[str, tuple[tuple[int, int], ...]] | None = None
    whole_at: tuple[int, ...] = ()

    @property
    def count(self) -> int:
        """Number of messages."""
        return sum(len(rows.times) for rows in self.truth.values())


@dataclass(frozen=True)
class Mutated:
    """One damaged or edited log, and what is expected of reading it.

    Attributes
    ----------
    what
        The mutation in words.
    missing, extra
        Messages that the edit takes away or adds without leaving a trace.
    content
        The edit may change values and times where no checksum tells.
    counted
        False where nothing can be said of the number of messages.
    total
        Number of messages in place of the undamaged log's, for text that is edited by whole lines.
    cut
        The end of the file is gone: a log that never was closed may report that as it reports not being closed.
    bomb
        Refusing it for its need of memory is right.
    """

    what: str
    files: Mapping[str, bytes]
    missing: int = 0
    extra: int = 0
    content: bool = False
    counted: bool = True
    total: int | None = None
    cut: bool = False
    bomb: bool = False

    @property
    def legitimate(self) -> bool:
        """Whether the edit changes the content as a writer might have, so that a reader cannot know."""
        return bool(self.missing or self.extra or self.content or not self.counted or self.total is not None)


Mutation = Callable[[Random, Base], "Mutated | None"]
"""Returns None where it cannot be done to this log."""


@dataclass(frozen=True)
class Case:
    """One case of the attack."""

    number: int
    base: Base
    kind: str
    mutated: Mutated
    command: bool = field(default=False)
    """Goes through `inspect` and `ingest` instead of the reader alone."""


RAW_SHARE = 0.35
HEAVY = ("bomb", "metadata: aliases", "metadata: long", "metadata: depth", "metadata: topics")
HEAVY_SHARE = 0.1
"""Of what takes long to read even where it is read well, a tenth of the cases drawn is run."""
COMMAND_EVERY = 200


def format_names() -> list[str]:
    """Return the names of the modules in `tests.attack.formats`."""
    return sorted(module.name for module in pkgutil.iter_modules(package.__path__))


@cache
def formats() -> dict[str, tuple[list[Base], dict[str, Mutation]]]:
    """Return the undamaged logs and the mutations of every module in `tests.attack.formats`."""
    modules = {name: importlib.import_module(f"{package.__name__}.{name}") for name in format_names()}
    return {name: (module.bases(), dict(module.MUTATIONS)) for name, module in modules.items()}


def draw(seed: int, number: int, only: str = "") -> Case:
    """Return the case of this number: the same for the same seed, format filter and version of the attack."""
    from tests.attack import raw

    random = Random(f"{seed}/{number}")
    known = formats()
    while True:
        name = only or random.choice(list(known))
        bases, structured = known[name]
        base = random.choice(bases)
        pool = raw.MUTATIONS if random.random() < RAW_SHARE else structured
        kind = random.choice(list(pool))
        if kind in HEAVY and random.random() > HEAVY_SHARE:
            continue
        mutated = pool[kind](random, base)
        if mutated is not None:
            return Case(number, base, kind, mutated, command=number % COMMAND_EVERY == 0)


def odd_number(random: Random, size: int, neighbour: int) -> int:
    """Return a value that a damaged or hostile file may hold in an unsigned field of `size` bytes."""
    most = 2 ** (8 * size) - 1
    choices = (
        0,
        1,
        most,
        most >> 1,
        (most >> 1) + 1,
        neighbour + 1,
        max(neighbour - 1, 0),
        neighbour * 2,
        neighbour ^ (1 << random.randrange(8 * size)),
        random.randrange(most + 1),
        random.randrange(256),
    )
    return random.choice(choices) & most


def replaced(base: Base, name: str, content: bytes) -> dict[str, bytes]:
    """Return the log's files with one of them replaced."""
    return {**base.files, name: content}
