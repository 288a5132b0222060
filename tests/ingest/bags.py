"""A recording cut into bags of seconds."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import Writer


def cut(log: Path, bags: int, seconds: float = 20.0, folder: Path | None = None) -> list[str]:
    """Write stretches of an MCAP log as bags of their own, beside it where no folder is named, and return their paths."""
    paths = [(folder or log.parent) / f"bag{number:02d}.mcap" for number in range(bags)]
    with ExitStack() as stack:
        reader = make_reader(stack.enter_context(log.open("rb")))
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        writers = [Writer(stack.enter_context(path.open("wb"))) for path in paths]
        for writer in writers:
            writer.start(profile=reader.get_header().profile, library="test")
            for schema in summary.schemas.values():
                assert writer.register_schema(schema.name, schema.encoding, schema.data) == schema.id
            for channel in summary.channels.values():
                given = channel.topic, channel.message_encoding, channel.schema_id, channel.metadata
                assert writer.register_channel(*given) == channel.id
        start = summary.statistics.message_start_time
        for _, channel, message in reader.iter_messages():
            number = int((message.log_time - start) / 1e9 // seconds)
            if number < bags:
                writers[number].add_message(channel.id, message.log_time, message.data, message.publish_time)
        for writer in writers:
            writer.finish()
    return [str(path) for path in paths]
