"""What rosbags generates of a message type, as far as reading needs it.

rosbags generates thirteen functions of every type that it is asked for, and of every type in it; reading uses one, and
generating the others takes longer than reading some minutes of messages.
"""

from __future__ import annotations

from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.serde.cdr import generate_deserialize_cdr
from rosbags.serde.ros1 import generate_deserialize_ros1
from rosbags.typesys.base import normalize_fieldname


class _Type:
    """A type's description as rosbags keeps it, whose functions are generated when they are first asked for."""

    def __init__(self, name: str, store: Any) -> None:
        self.name, self._store = name, store
        self.fields = [(normalize_fieldname(field), kind) for field, kind in store.fielddefs[name][1]]
        self.cls = store.types[name]

    def __getattr__(self, wanted: str) -> Any:
        if wanted.startswith("_"):
            raise AttributeError(wanted)
        if wanted in ("deserialize_cdr_le", "deserialize_cdr_be"):
            made: Any = generate_deserialize_cdr(self.fields, self._store, wanted[-2:])
        elif wanted == "deserialize_ros1":
            made = generate_deserialize_ros1(self.fields, self._store)
        else:
            del self._store.cache[self.name]
            made = getattr(self._store.get_msgdef(self.name), wanted)
        setattr(self, wanted, made)
        return made


def generate_reading(store: Any, name: str, function: str) -> None:
    """Prepare a rosbags Typestore for reading messages of a type by this function of its description.

    Raises
    ------
    KeyError
        Where the store lacks a type that it is made of.
    """
    if name in store.cache:
        return
    found = store.cache[name] = _Type(name, store)
    try:
        for _, (kind, inner) in store.fielddefs[name][1]:
            if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                kind, inner = inner[0]
            if kind == Nodetype.NAME:
                generate_reading(store, inner, function)
        # Faults of a definition show when a function is generated of it.
        getattr(found, function)
    except BaseException:
        del store.cache[name]
        raise
