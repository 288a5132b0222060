"""A recording cut into bags of seconds: together they are as much evidence as the whole."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose, diagnose_campaign
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.types import IN_MEMORY
from ferryid.vessel import load_profile

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
TRIAL = """schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner", dwell_s = 100, rounds = 1 }
controller = { delta = 0.4, sigma = 0.4 }
environment.wind = { north_mps = 2.5, east_mps = -2.0, gust_std_mps = 0.25, gust_time_s = 8 }
sensors = { imu_rate_hz = 0, camera_rate_hz = 0 }
thrusters.faults = [{ thruster = "thruster2", factor = 0.8, from_s = 0 }]
"""
BAGS, SECONDS = 60, 20.0


def cut(log: Path) -> list[str]:
    """Write every stretch of a log as a bag of its own, and return their paths."""
    paths = [log.with_name(f"bag{number:02d}.mcap") for number in range(BAGS)]
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
            number = int((message.log_time - start) / 1e9 // SECONDS)
            if number < BAGS:
                writers[number].add_message(channel.id, message.log_time, message.data, message.publish_time)
        for writer in writers:
            writer.finish()
    return [str(path) for path in paths]


def found(one: Diagnosis, effect: str) -> Finding:
    """Return a sure finding."""
    (finding,) = (each for each in one.findings if each.effect == effect and each.sure)
    return finding


def test_sixty_bags_of_twenty_seconds_tell_what_twenty_minutes_do(tmp_path: Path) -> None:
    log = tmp_path / "whole.mcap"
    write_log(simulate(parse_scenario(TRIAL, "whole", tmp_path)), log)
    (whole,) = diagnose([str(log)], FERRY, DiagnosisSettings(), IN_MEMORY)
    bags = diagnose_campaign(cut(log), FERRY, DiagnosisSettings(), IN_MEMORY)
    assert len(bags) == BAGS
    one = found(whole, "thruster_gain").parameters["factor"]
    # A property is the vessel's, and stands with each log.
    same = found(bags[0], "thruster_gain")
    assert same.instance == "thruster2"
    every = same.parameters["factor"]
    assert every.low < 0.8 < every.high
    assert one.low < 0.8 < one.high
    assert every.high - every.low < 2.0 * (one.high - one.low)
    named = [{each.effect for each in bag.findings if each.sure} for bag in bags]
    assert all("wind" in each for each in named)
    assert not set().union(*named) - {"wind", "thruster_gain", "gusts"}
    winds = [found(bag, "wind").parameters for bag in bags]
    held = [
        each["north"].low < 2.5 < each["north"].high and each["east"].low < -2.0 < each["east"].high for each in winds
    ]
    assert sum(held) >= 0.9 * BAGS
