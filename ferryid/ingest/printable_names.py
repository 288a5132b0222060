"""Names out of a log that hold control characters, escaped for everything that reads, prints or stores them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ferryid.errors import printable
from ferryid.ingest.log import Loss, Reader, Series, Topic

NOTE = "control characters in its names are shown escaped"


def printable_names(reader: Reader) -> Reader:
    """Return a reader whose topics, types and fields have printable names: the same one where they do already."""
    return reader if all(_is_printable(topic) for topic in reader.topics) else PrintableNames(reader)


class PrintableNames:
    """A log under printable names: ``"/a\\x1bb"`` with the escape character written out, as a profile would map it."""

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self.paths: tuple[Path, ...] = reader.paths
        self._topics = _escaped(topic.name for topic in reader.topics)
        shown = {name: escaped for escaped, name in self._topics.items()}
        self._fields: dict[str, dict[str, str]] = {}
        topics = []
        for topic in reader.topics:
            name = shown[topic.name]
            self._fields[name] = _escaped(topic.fields)
            topics.append(
                topic
                if _is_printable(topic)
                else replace(
                    topic,
                    name=name,
                    type=printable(topic.type),
                    fields={escaped: topic.fields[field] for escaped, field in self._fields[name].items()},
                    note="; ".join(filter(None, (topic.note, NOTE))),
                )
            )
        self.topics: tuple[Topic, ...] = tuple(topics)
        self.losses: tuple[Loss, ...] = reader.losses

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Decode the wanted fields of the wanted topics, both by their printable names.

        Raises
        ------
        FerryIdError
            For a topic or field that the log does not have.
        """
        original = {
            self._topics.get(name, name): [self._fields.get(name, {}).get(path, path) for path in paths]
            for name, paths in wanted.items()
        }
        found = self._reader.read(original, verify=verify)
        self.losses = self._reader.losses
        series = {}
        for name, paths in wanted.items():
            one = found[self._topics.get(name, name)]
            fields = self._fields.get(name, {})
            series[name] = replace(
                one,
                topic=name,
                columns={path: one.columns[fields.get(path, path)] for path in paths},
                time_column=printable(one.time_column),
            )
        return series


def _is_printable(topic: Topic) -> bool:
    return all(name == printable(name) for name in (topic.name, topic.type, *topic.fields))


def _escaped(names: Iterable[str]) -> dict[str, str]:
    """Return printable names and the name that each stands for; a second one that comes out alike is numbered."""
    originals: dict[str, str] = {}
    for name in names:
        escaped, number = printable(name), 2
        while escaped in originals:
            escaped, number = f"{printable(name)} ({number})", number + 1
        originals[escaped] = name
    return originals
