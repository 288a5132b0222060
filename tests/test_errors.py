"""The nearest name: real misspellings are found, and no far-fetched one is offered."""

from __future__ import annotations

import time

import pytest

from ferryid.errors import FerryIdError, did_you_mean

TOPICS = (
    "/navigation/odometry",
    "/thruster1/state",
    "/thruster2/command",
    "/thruster2/state",
    "/control/tau_d",
    "/camera/image/compressed",
)


@pytest.mark.parametrize(
    ("name", "options", "near"),
    [
        ("/navigation/odometri", TOPICS, "/navigation/odometry"),
        ("/nav/odometry", TOPICS, "/navigation/odometry"),
        ("/odometry", TOPICS, "/navigation/odometry"),
        ("/milliampere/thruster1/state", TOPICS, "/thruster1/state"),
        ("thruster2/comand", TOPICS, "/thruster2/command"),
        ("/control/taud", TOPICS, "/control/tau_d"),
        ("lenght_m", ("length_m", "beam_m", "mass_kg"), "length_m"),
        ("r", ("u", "v", "r_z"), "r_z"),
        ("FRU", ("FRD", "NED", "ENU"), "FRD"),
        ("m/sec", ("m/s", "km/h", "kn"), "m/s"),
        ("miliampere", ("milliampere", "milliampere-2025", "gunnerus"), "milliampere"),
    ],
)
def test_a_misspelt_name_is_found(name: str, options: tuple[str, ...], near: str) -> None:
    assert did_you_mean(name, options) == f' Did you mean "{near}"?'


@pytest.mark.parametrize(
    "name", ["/weather/wind", "/left_thruster", "/thruster1/command_is_missing", "/NED_pose", "/wind"]
)
def test_another_topic_is_not_offered(name: str) -> None:
    assert did_you_mean(name, TOPICS) == ""


def test_no_option_and_no_likeness() -> None:
    assert did_you_mean("speed", ()) == ""
    assert did_you_mean("speed", ("azimuth", "header.frame_id")) == ""


@pytest.mark.parametrize("sign", ["\n", "\r", "\x1b", "\0", "\x85", "\u2028", "\udcff"])
def test_a_message_stays_one_line_whatever_it_quotes(sign: str) -> None:
    message = str(FerryIdError(f"log: found a{sign}b. Fix: write °"))
    assert message.isprintable()
    assert message.startswith("log: found a\\")
    assert message.endswith("b. Fix: write °")


def test_a_message_keeps_its_ends_when_it_quotes_too_much() -> None:
    message = str(FerryIdError(f"log: found {'x' * 10**6}. Fix: less"))
    assert len(message) < 2100
    assert message.startswith("log: found x")
    assert message.endswith("x. Fix: less")


def test_a_log_of_very_many_topics_costs_no_search_for_the_nearest() -> None:
    begun = time.process_time()
    assert did_you_mean("/thruster9/state", (f"/thruster/{number}/state" for number in range(50_000))) == ""
    assert time.process_time() - begun < 0.5
