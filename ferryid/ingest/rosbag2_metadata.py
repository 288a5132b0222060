"""The metadata.yaml of a ROS2 recording's folder, versions 1 to 9."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    CollectionEndEvent,
    DocumentStartEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceStartEvent,
)

from ferryid.ingest.formats.rosbag2 import KEY
from ferryid.ingest.log import Topic
from ferryid.ingest.ros2_types import normalized

# Start time of a recording without messages, and anything else that no clock has shown.
NO_TIME = 2**62
# A recording of a thousand topics or files takes less than this; parsing takes seconds for every megabyte.
MAX_BYTES = 1 << 20
# rosbag2 nests nine levels, with quality of service.
MAX_DEPTH = 32


@dataclass(frozen=True)
class File:
    """One file of the recording: its name, and number and times [ns] of its messages, None where not stated."""

    name: str
    messages: int | None
    start_ns: int | None
    end_ns: int | None


@dataclass(frozen=True)
class Metadata:
    """What the file states.

    Attributes
    ----------
    files
        In order of recording, without the folder's name that versions before 4 put before them.
    topics
        Name, type, serialisation and number of messages.
    digests
        Topic name to type hash.
    mode, codec
        Compression, ``"file"``, ``"message"`` or nothing, and its format.
    distro
        ROS distribution that recorded, or an empty string.
    """

    files: tuple[File, ...]
    topics: tuple[Topic, ...]
    digests: Mapping[str, str]
    mode: str
    codec: str
    distro: str


def read_metadata(path: Path) -> Metadata | str:
    """Read a metadata.yaml, or return what is wrong with it as the end of a sentence."""
    with path.open("rb") as file:
        data = file.read(MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        return f"is larger than {MAX_BYTES >> 10} kB, which no recording needs"
    try:
        document = _document(data.decode(errors="replace"))
    except (YAMLError, ValueError, NotImplementedError) as error:
        return f"is no YAML ({' '.join(str(error).split())[:120]})"
    try:
        stated = document[KEY]
        topics = tuple(_topic(entry) for entry in stated.get("topics_with_message_count") or ())
        return Metadata(
            files=_files(stated),
            topics=topics,
            digests={
                entry["topic_metadata"]["name"]: str(entry["topic_metadata"].get("type_description_hash") or "")
                for entry in stated.get("topics_with_message_count") or ()
            },
            mode=str(stated.get("compression_mode") or "").lower().replace("none", ""),
            codec=str(stated.get("compression_format") or "").lower(),
            distro=str(stated.get("ros_distro") or "").lower(),
        )
    except KeyError as error:
        return f"lacks the key {error}"
    except (TypeError, AttributeError, ValueError):
        return f"is not laid out as rosbag2 does it, found {type(document).__name__}"


def _document(text: str) -> Any:
    """Return a document of dictionaries, lists, strings and None; numbers stay strings.

    Raises
    ------
    YAMLError, ValueError
        The text is no YAML, or uses what no recorder writes and what a small file could fill the memory with.
    """
    root: list[Any] = []
    stack: list[Any] = [root]
    keys: list[str | None] = [None]
    documents = 0
    for event in YAML(typ="safe", pure=True).parse(text):
        documents += isinstance(event, DocumentStartEvent)
        if isinstance(event, AliasEvent) or getattr(event, "anchor", None) is not None:
            raise ValueError("anchors and aliases are not read")
        if documents > 1:
            raise ValueError("it holds more than one document")
        if isinstance(event, CollectionEndEvent):
            stack.pop()
            keys.pop()
            continue
        if isinstance(event, ScalarEvent):
            plain = event.style in (None, "") and event.value in ("", "~", "null", "Null", "NULL")
            value: Any = None if plain else str(event.value)
        elif isinstance(event, MappingStartEvent | SequenceStartEvent):
            value = {} if isinstance(event, MappingStartEvent) else []
        else:
            continue
        if getattr(event, "tag", None) is not None:
            raise ValueError("tags are not read")
        above = stack[-1]
        if isinstance(above, list):
            above.append(value)
        elif keys[-1] is not None:
            above[keys[-1]] = value
            keys[-1] = None
        elif not isinstance(value, str) or value in above:
            raise ValueError(f"a key is {'given twice' if isinstance(value, str) else 'no text'}")
        else:
            keys[-1] = value
            continue
        if not isinstance(event, ScalarEvent):
            stack.append(value)
            keys.append(None)
        if len(stack) > MAX_DEPTH:
            raise ValueError(f"it is nested more than {MAX_DEPTH} levels deep")
    return root[0] if root else None


def _integer(value: Any, least: int = -(2**63)) -> int:
    """Return an integer that was read as text.

    Raises
    ------
    ValueError
        It is none, or out of the range of 64 bits.
    """
    number = int(value)
    if not least <= number < 2**63:
        raise ValueError(f"{number} is out of range")
    return number


def _topic(entry: Any) -> Topic:
    about = entry["topic_metadata"]
    return Topic(
        name=str(about["name"]),
        type=normalized(str(about["type"])),
        encoding=str(about["serialization_format"]),
        count=_integer(entry["message_count"], 0),
        start_ns=None,
        end_ns=None,
        fields={},
    )


def _files(stated: Any) -> tuple[File, ...]:
    paths = stated["relative_file_paths"] or ()
    if isinstance(paths, str):
        raise TypeError("a list of paths was expected")
    names = list(dict.fromkeys(PurePosixPath(str(name)).name for name in paths))
    details = {PurePosixPath(str(entry["path"])).name: entry for entry in stated.get("files") or ()}
    if len(names) == 1:
        # A recording of one file is stated as a whole, in every version.
        details.setdefault(names[0], stated)
    return tuple(_file(name, details.get(name)) for name in names)


def _file(name: str, entry: Any) -> File:
    if entry is None:
        return File(name, None, None, None)
    count = _integer(entry["message_count"], 0)
    start = _integer(entry["starting_time"]["nanoseconds_since_epoch"])
    end = start + _integer(entry["duration"]["nanoseconds"])
    if count == 0 or start > NO_TIME or not start <= end < 2**63:
        return File(name, count, None, None)
    return File(name, count, start, end)
