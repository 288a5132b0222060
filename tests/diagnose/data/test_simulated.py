"""Logs of a simulator are recognised by their messages, or by the noise that they lack."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ferryid.diagnose.data.simulated import relative_noise, simulated
from ferryid.effects.force_model import Measurements
from ferryid.ingest.clocks import ClockReport
from ferryid.ingest.log import Topic
from ferryid.signals.artificial import along_share, artificial, summed_share
from ferryid.signals.stream import Recording, Stream
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")


def circling(noise_m: float = 0.0) -> Measurements:
    """Return five minutes of turns at 10 Hz, the position with some noise."""
    t = np.arange(3000) * 0.1
    psi = 2.0 * np.sin(0.05 * t)
    u, r = 0.5 + 0.2 * np.sin(0.1 * t), 0.1 * np.cos(0.05 * t)
    velocity = np.column_stack([u * np.cos(psi), u * np.sin(psi)])
    # By the trapezoid rule on a grid a hundred times as fine, which is exact here.
    fine = np.linspace(0.0, t[-1], 100 * (len(t) - 1) + 1)
    heading, speed = 2.0 * np.sin(0.05 * fine), 0.5 + 0.2 * np.sin(0.1 * fine)
    rate = np.column_stack([speed * np.cos(heading), speed * np.sin(heading)])
    steps = 0.5 * (rate[1:] + rate[:-1]) * (fine[1] - fine[0])
    place = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])[::100]
    place += noise_m * np.random.default_rng(0).standard_normal(place.shape)
    assert velocity.shape == place.shape
    nu = np.column_stack([u, np.zeros_like(u), r])
    parts, angles = np.zeros((len(t), 2, 3)), np.zeros((len(t), 2))
    usable = np.ones(len(t), dtype=np.bool_)
    return Measurements(
        profile=FERRY,
        t=t,
        eta=np.column_stack([place, psi]),
        nu_raw=nu,
        nu=nu,
        parts=parts,
        angles=angles,
        usable=usable,
        wind=None,
        current=None,
        payload=None,
    )


def log(
    measurements: Measurements, found: tuple[str, ...] = ("u", "v", "r"), type_: str = ""
) -> tuple[Recording, Measurements]:
    topics = (Topic("/gazebo/model_states", type_, "ros1", 10, 0, 1, {}),) if type_ else ()
    recording = SimpleNamespace(topics=topics, found=dict.fromkeys(found, ""), streams={})
    return cast("Recording", recording), measurements


def test_a_log_without_noise_is_simulated_and_one_with_a_millimetre_is_not() -> None:
    assert relative_noise(circling()).max() < 1e-4
    assert "no noise" in simulated(*log(circling()))
    assert simulated(*log(circling(0.001))) == ""


def reckoned(away_m: float = 0.0, jumps: int = 0, varied: float = 0.3) -> Stream:
    """Return half a minute at 20 Hz whose positions are added up from surge velocity and heading, set back now and then."""
    t = np.arange(600) * 0.05
    u, psi = 1.0 + varied * np.sin(0.4 * t), 0.3 * t
    x, y = np.cumsum(0.05 * u * np.cos(psi)), np.cumsum(0.05 * u * np.sin(psi))
    for k in range(jumps):
        x[100 * (k + 1) :] += 3.0
    x += away_m * np.random.default_rng(1).standard_normal(len(x))
    columns = {"x": x, "y": y, "u": u, "v": np.zeros_like(u)}
    none = cast("ClockReport", None)
    return Stream("/state", np.round(t * 1e9).astype(np.int64), columns, none, np.zeros(len(t), dtype=np.int64))


def recording(stream: Stream) -> Recording:
    return cast("Recording", SimpleNamespace(topics=(), streams={stream.topic: stream}))


def test_positions_that_are_added_up_from_velocities_are_no_measurement() -> None:
    why = artificial(recording(reckoned(jumps=3)))
    assert "each step of its positions is the speed of /state times one length of time" in why
    assert "the sway velocity is zero throughout" in why
    assert artificial(recording(reckoned(away_m=1e-4))) == ""


def heading(away_rad: float = 0.0, rate: float = 0.3) -> Stream:
    """Return the heading of `reckoned`, on a topic of its own and a little later, with some noise."""
    t = np.arange(600) * 0.05 + 0.003
    psi = rate * (t - 0.003) + away_rad * np.random.default_rng(2).standard_normal(len(t))
    none = cast("ClockReport", None)
    return Stream("/turn", np.round(t * 1e9).astype(np.int64), {"psi": psi}, none, np.zeros(len(t), dtype=np.int64))


def placed(away_m: float = 0.0) -> Stream:
    """Return `reckoned` with the positions alone."""
    full = reckoned(away_m, jumps=3)
    return replace(full, columns={name: full.columns[name] for name in ("x", "y")})


def test_positions_exactly_along_the_heading_are_no_measurement() -> None:
    def of(place: Stream, turn: Stream) -> str:
        return artificial(cast("Recording", SimpleNamespace(topics=(), streams={"/state": place, "/turn": turn})))

    assert "points along the heading to the last digit" in of(placed(), heading())
    assert of(placed(away_m=1e-4), heading()) == ""
    assert of(placed(), heading(away_rad=0.01)) == ""


def test_a_straight_course_along_the_heading_shows_nothing() -> None:
    straight = replace(placed(), columns={"x": np.arange(600) * 0.1, "y": np.zeros(600)})
    turn = heading(rate=0.0)
    x, y = (straight.columns[name] for name in "xy")
    assert along_share(straight.time_ns, x, y, turn.time_ns, turn.columns["psi"]) == 0.0


def test_steps_of_a_constant_speed_show_nothing() -> None:
    assert summed_share(*(reckoned(varied=0.0).columns[name] for name in "xyuv")) == 0.0


def test_velocities_that_come_from_positions_say_nothing() -> None:
    assert simulated(*log(circling(), found=("x", "y", "psi"))) == ""


@pytest.mark.parametrize(("type_", "artificial"), [("gazebo_msgs/ModelStates", True), ("nav_msgs/Odometry", False)])
def test_messages_of_a_simulator_show_it(type_: str, artificial: bool) -> None:
    assert bool(simulated(*log(circling(0.02), type_=type_))) == artificial


def test_a_log_at_rest_is_not_simulated() -> None:
    still = circling()
    at_rest = replace(still, nu_raw=np.zeros_like(still.nu_raw), eta=np.zeros_like(still.eta))
    assert simulated(*log(at_rest)) == ""
