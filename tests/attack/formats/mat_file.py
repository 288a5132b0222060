"""MAT files: compressed, plain and of HDF5; tags of variables, and variables of every kind."""

from __future__ import annotations

import io
import struct
from random import Random
from typing import Any

import h5py
import numpy as np
import scipy.io

from tests.attack.case import EXACT, UNCHECKED, Base, Mutated, Mutation, Rows, odd_number, replaced
from tests.attack.logs import messages

NAME = "log.mat"
WANTED = {"/a": ("data",), "/b": ("data",)}


def bases() -> list[Base]:
    """Two structures, in two versions."""
    return [
        _base("compressed", _level_5(_variables(), do_compression=True), EXACT),
        _base("plain", _level_5(_variables()), UNCHECKED),
        _base("HDF5", _hdf5(_variables()), UNCHECKED),
    ]


def _variables() -> dict[str, dict[str, Any]]:
    found = [(time, value) for topic, time, value in messages() if topic == "/speed"]
    time, data = np.array([one for one, _ in found]), np.array([one for _, one in found])
    return {
        "a": {"time_ns": time[:70], "data": data[:70], "note": "ok"},
        "b": {"time_ns": time, "data": data, "more": np.column_stack([data, data])},
    }


_DESCRIBED = b"MATLAB 5.0 MAT-file, written by a test".ljust(116, b"\0")
"""The text that a MAT file of level 5 begins with."""


def _level_5(variables: dict[str, Any], **options: Any) -> bytes:
    file = io.BytesIO()
    scipy.io.savemat(file, variables, **options)
    # Without the second in which it was written, so that a case is the same when it is drawn again.
    return _DESCRIBED + file.getvalue()[len(_DESCRIBED) :]


def _hdf5(variables: dict[str, dict[str, Any]]) -> bytes:
    content = io.BytesIO()
    with h5py.File(content, "w", userblock_size=512) as file:
        for name, fields in variables.items():
            for field, value in fields.items():
                if isinstance(value, np.ndarray):
                    file[f"{name}/{field}"] = np.atleast_2d(value).T if value.ndim < 2 else value.T
    raw = bytearray(content.getvalue())
    raw[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + struct.pack("<HH", 0x0200, 0x4D49)
    return bytes(raw)


def _base(name: str, content: bytes, guard: str) -> Base:
    truth = {
        f"/{one}": Rows(fields["time_ns"].astype(np.int64), fields["data"].astype(float))
        for one, fields in _variables().items()
    }
    spans = None
    if guard == EXACT:
        # What is compressed ends with a checksum of itself.
        spans = {NAME: tuple((start + 8, end) for start, end in _tags(content))}
    whole_at = () if name == "HDF5" else tuple(end for _, end in _tags(content))
    return Base("mat_file", name, {NAME: content}, NAME, truth, WANTED, guard, spans, whole_at)


def _tags(content: bytes) -> list[tuple[int, int]]:
    found, at = [], 128
    while at + 8 <= len(content):
        end = at + 8 + struct.unpack_from("<I", content, at + 4)[0]
        found.append((at, end))
        at = end
    return found


def tag(random: Random, base: Base) -> Mutated | None:
    """Set type or size of a variable."""
    if base.name == "HDF5":
        return None
    content = bytearray(base.files[NAME])
    at = random.choice(_tags(bytes(content)))[0] + random.choice((0, 4))
    (old,) = struct.unpack_from("<I", content, at)
    new = odd_number(random, 4, old)
    if new == old:
        return None
    struct.pack_into("<I", content, at, new)
    return Mutated(f"word at {at} set from {old} to {new}", replaced(base, NAME, bytes(content)), content=True)


def inside(random: Random, base: Base) -> Mutated | None:
    """Set a word in the first bytes of a variable, where its shape and names are, or anywhere in HDF5."""
    if base.name == "compressed":
        return None
    content = bytearray(base.files[NAME])
    start = 520 if base.name == "HDF5" else random.choice(_tags(bytes(content)))[0] + 8
    at = start + random.randrange(min(400, len(content) - start - 4))
    new = odd_number(random, 4, 8).to_bytes(4, "little")
    if content[at : at + 4] == new:
        return None
    content[at : at + 4] = new
    what = f"bytes {at} to {at + 4} set to {new.hex()}"
    return Mutated(what, replaced(base, NAME, bytes(content)), counted=False, content=True)


def variables(random: Random, base: Base) -> Mutated | None:
    """Save other variables."""
    t = np.arange(50) * 0.1
    made: dict[str, Any] = {
        "a figure": {"hgS_070000": {"type": "figure"}},
        "no variable": {},
        "times alone": {"t": t},
        "complex numbers": {"t": t, "z": t * 1j},
        "texts": {"t": t, "s": np.array(["x"] * 50)},
        "cells": {"t": t, "c": np.array([t, "x", np.eye(2), 3.0], object)},
        "structures in structures": _deep(t, 40),
        "an array of structures": {"s": np.array([(1.0, t), (2.0, t)], dtype=[("a", "f8"), ("b", object)])},
        "a sparse matrix": {"t": t, "s": scipy.sparse.eye_array(50).tocsc()},
        "times that are not numbers": {"t": t * np.nan, "u": t},
        "times beyond all": {"t": t * 1e300, "u": t},
        "wide": {"t": t, "w": np.ones((50, 3000))},
        "of no rows": {"t": t[:0], "u": t[:0]},
        "of three axes": {"t": t, "w": np.ones((2, 3, 50))},
    }
    what = random.choice(list(made))
    content = _level_5(made[what], do_compression=random.random() < 0.5)
    return Mutated(what, replaced(base, NAME, content), counted=False, content=True)


def _deep(t: Any, depth: int) -> dict[str, Any]:
    value: dict[str, Any] = {"t": t, "u": t}
    for _ in range(min(depth, 25)):
        value = {"a": value}
    return value


MUTATIONS: dict[str, Mutation] = {"tag of a variable": tag, "inside a variable": inside, "other variables": variables}
