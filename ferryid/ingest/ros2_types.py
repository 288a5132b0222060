"""Definitions of ROS2 message types: those in the log, or those that rosbags bundles where a log has none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

from rosbags.typesys import Stores, get_typestore

from ferryid.ingest.definitions import DefinitionError, parse_definition, typestore_of
from ferryid.ingest.layout import EMPTY_MEMBER, leaf_fields

# Newest first; the common message types hardly ever change between them.
DISTROS = ("lyrical", "kilted", "jazzy", "iron", "humble", "galactic", "foxy", "eloquent", "dashing")
DEFAULT_DISTRO = "humble"


@dataclass(frozen=True)
class RecordedText:
    """Definition of one message type as a log holds it; `encoding` is ``"ros2msg"`` or ``"ros2idl"``."""

    encoding: str
    text: str


@dataclass(frozen=True)
class Definition:
    """A message type that can be decoded, or the reason why it cannot.

    Attributes
    ----------
    typestore
        rosbags Typestore that holds the type and what it is made of; None where it is not known.
    fields
        Leaf path to primitive type, as `ferryid.ingest.log.Topic` lists them.
    note
        What a user must know: which definitions stood in, or why there are none. Empty for a type defined in the log.
    """

    typestore: Any
    fields: Mapping[str, str]
    note: str


def normalized(msgtype: str) -> str:
    """Return the full name of a message type; the first ROS2 releases wrote ``std_msgs/String``."""
    package, _, name = msgtype.partition("/")
    return msgtype if "/" in name or not name else f"{package}/msg/{name}"


@lru_cache(maxsize=4096)
def define(msgtype: str, recorded: RecordedText | None, digest: str, distro: str) -> Definition:
    """Find the definition of a message type; remembered, for the parts of a recording define the same types.

    Parameters
    ----------
    msgtype
        Full name.
    recorded
        The definition in the log, None where it has none.
    digest
        Type hash in the log (``"RIHS01_..."``), or an empty string.
    distro
        ROS distribution that recorded the log, or an empty string.
    """
    fault = "no definition in the log"
    if recorded is not None:
        typestore, fault = _parsed(msgtype, recorded)
        if typestore is not None:
            return Definition(typestore, leaf_fields(typestore, msgtype), "")
    order = sorted(DISTROS, key=lambda name: (name != distro, name != DEFAULT_DISTRO))
    known = [name for name in order if msgtype in _store(name).fielddefs]
    if not known:
        return Definition(None, {}, f"cannot be decoded: {fault}, and rosbags bundles none of {msgtype}")
    if digest.startswith("RIHS01_"):
        same = [name for name in known if _store(name).hash_rihs01(msgtype) == digest]
        if not same:
            return Definition(
                None,
                {},
                f"cannot be decoded: {fault}, and its type hash fits no definition that rosbags bundles",
            )
        name, sure = same[0], ", confirmed by the type hash"
    else:
        name, sure = known[0], ""
    typestore = _store(name)
    return Definition(
        typestore,
        leaf_fields(typestore, msgtype),
        f"{fault}: that of ROS2 {name.capitalize()} stands in{sure}",
    )


def _parsed(msgtype: str, recorded: RecordedText) -> tuple[Any, str]:
    """Return a typestore with the recorded type alone, or None and what is wrong with the text."""
    if recorded.encoding not in ("ros2msg", "ros2idl"):
        return None, f"the log's definition is in {recorded.encoding or 'no'} format"
    try:
        typestore = typestore_of(parse_definition(recorded.text, msgtype, recorded.encoding))
    except DefinitionError as error:
        return None, f"the log's definition {error}"
    if msgtype not in typestore.fielddefs:
        return None, f"the log's definition does not describe {msgtype}"
    members = [name for name, _ in typestore.fielddefs[msgtype][1] if name != EMPTY_MEMBER]
    if members and not leaf_fields(typestore, msgtype):
        return None, "the log's definition is incomplete"
    return typestore, ""


@cache
def _store(distro: str) -> Any:
    return get_typestore(Stores[f"ROS2_{distro.upper()}"])
