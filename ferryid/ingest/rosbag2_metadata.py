"""The metadata.yaml of a ROS2 recording's folder, versions 1 to 9."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from ferryid.ingest.log import Topic
from ferryid.ingest.ros2_types import normalized

NAME = "metadata.yaml"
KEY = "rosbag2_bagfile_information"
# Start time of a recording without messages, and anything else that no clock has shown.
NO_TIME = 2**62


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
    try:
        document = YAML(typ="safe").load(path.read_text(encoding="utf-8", errors="replace"))
    except (YAMLError, ValueError) as error:
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


def _topic(entry: Any) -> Topic:
    about = entry["topic_metadata"]
    return Topic(
        name=str(about["name"]),
        type=normalized(str(about["type"])),
        encoding=str(about["serialization_format"]),
        count=int(entry["message_count"]),
        start_ns=None,
        end_ns=None,
        fields={},
    )


def _files(stated: Any) -> tuple[File, ...]:
    names = [PurePosixPath(str(name)).name for name in stated["relative_file_paths"] or ()]
    details = {PurePosixPath(str(entry["path"])).name: entry for entry in stated.get("files") or ()}
    if len(names) == 1:
        # A recording of one file is stated as a whole, in every version.
        details.setdefault(names[0], stated)
    return tuple(_file(name, details.get(name)) for name in names)


def _file(name: str, entry: Any) -> File:
    if entry is None:
        return File(name, None, None, None)
    count = int(entry["message_count"])
    start = int(entry["starting_time"]["nanoseconds_since_epoch"])
    if count == 0 or start > NO_TIME:
        return File(name, count, None, None)
    return File(name, count, start, start + int(entry["duration"]["nanoseconds"]))
