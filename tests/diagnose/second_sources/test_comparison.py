"""A second instrument with one known fault, on a made motion with noise: it is found with its size, and no other."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.second_sources.candidates import Candidate
from ferryid.diagnose.second_sources.comparison import Comparison, compare
from ferryid.diagnose.second_sources.explanations import describe_scale
from ferryid.diagnose.second_sources.first_guess import nearest_unit
from ferryid.diagnose.second_sources.samples import Samples
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats
from ferryid.vessel import load_profile

STEP_S, LENGTH_S = 0.1, 600.0
KNOTS = 3600.0 / 1852.0


def coloured(rng: np.random.Generator, n: int, size: float, step_s: float, time_s: float = 4.0) -> Floats:
    """Return noise that is correlated for some seconds, as a navigation filter's is."""
    keep = np.exp(-step_s / time_s)
    white = rng.normal(size=n) * size * np.sqrt(1.0 - keep**2)
    found = np.zeros(n)
    for k in range(1, n):
        found[k] = keep * found[k - 1] + white[k]
    return found


@cache
def motion(n: int = 9000, step_s: float = 0.08) -> Floats:
    """Return time, north, east, heading, surge, sway and yaw rate of a vessel that turns both ways, shape (n, 7)."""
    t = np.arange(n) * step_s - 20.0
    r = 0.08 * np.sin(0.05 * t) + 0.10 * np.sin(0.21 * t + 1.0) + 0.05 * np.sin(0.11 * t + 2.0)
    psi = 2.5 + np.cumsum(r) * step_s
    u = 1.0 + 0.6 * np.sin(0.07 * t)
    v = 0.3 * np.sin(0.13 * t + 0.5)
    north = np.cumsum(np.cos(psi) * u - np.sin(psi) * v) * step_s
    east = np.cumsum(np.sin(psi) * u + np.cos(psi) * v) * step_s
    return np.column_stack([t, north, east, psi, u, v, r])


def at(when: Floats) -> Floats:
    """Return the motion at some times, shape (n, 6)."""
    known = motion()
    return np.column_stack([np.interp(when, known[:, 0], column) for column in known[:, 1:].T])


@cache
def measured() -> Measurements:
    rng = np.random.default_rng(1)
    t = np.arange(0.0, LENGTH_S, STEP_S)
    true, n = at(t), len(t)
    noise = [0.02, 0.02, 0.002, 0.01, 0.01, 0.001]
    seen = true + np.column_stack([coloured(rng, n, one, STEP_S) for one in noise])
    nothing = np.zeros((n, 0))
    usable = np.ones(n, dtype=np.bool_)
    usable[2000:2040] = False
    profile = load_profile("milliampere")
    return Measurements(profile, t, seen[:, :3], seen[:, 3:], seen[:, 3:], nothing[:, :, None], nothing, usable)


def other(
    kind: str, make: Callable[[Floats], list[Floats]], rate_hz: float = 10.0, late_s: float = 0.0, noise: float = 0.005
) -> Comparison:
    """Return the comparison with an instrument that makes its columns of the true motion."""
    rng = np.random.default_rng(2)
    t = np.arange(-5.0, LENGTH_S + 5.0, 1.0 / rate_hz) + 0.013
    values = np.column_stack(make(at(t - late_s)))
    values = values + np.column_stack([coloured(rng, len(t), noise, 1.0 / rate_hz) for _ in values.T])
    samples = Samples(t, values, 1.0 / rate_hz, "stamp", (t * 1e9).astype(np.int64), np.zeros(values.shape[1]))
    found = compare(Candidate("/second", tuple("xyz"[: values.shape[1]]), kind), [(samples, measured())], 5.0)
    assert found is not None
    return found


def body(motion: Floats, x: float = 0.0, y: float = 0.0) -> list[Floats]:
    return [motion[:, 3] - motion[:, 5] * y, motion[:, 4] + motion[:, 5] * x]


def world(motion: Floats, x: float = 0.0, y: float = 0.0) -> list[Floats]:
    cos, sin = np.cos(motion[:, 2]), np.sin(motion[:, 2])
    return [motion[:, 0] + cos * x - sin * y, motion[:, 1] + sin * x + cos * y]


def only(found: Comparison, what: str) -> dict[str, tuple[float, float, float]]:
    """Return the parameters of the only difference."""
    assert [one.what for one in found.differences] == [what], found.says
    return {name: (one.value, one.low, one.high) for name, one in found.differences[0].parameters.items()}


def holds(estimate: tuple[float, float, float], true: float, widest: float) -> None:
    value, low, high = estimate
    # Twice the 95 % interval: 28 such estimates with one seed each should all pass.
    assert abs(value - true) <= high - low, estimate
    assert high - low <= widest, estimate


@pytest.mark.parametrize(
    ("kind", "make", "axes"),
    [
        ("position", world, "north, east"),
        ("position", lambda m: [m[:, 1] + 500.0, m[:, 0] - 90.0], "east, north"),
        ("velocity", body, "forward, starboard"),
        ("velocity", lambda m: [m[:, 3], -m[:, 4]], "forward, port"),
        ("yaw_rate", lambda m: [m[:, 5]], ""),
        ("heading", lambda m: [m[:, 2] + 2.0 * np.pi], ""),
        ("speed", lambda m: [np.hypot(m[:, 3], m[:, 4])], ""),
    ],
)
@pytest.mark.parametrize("rate_hz", [1.0, 50.0])
def test_nothing_is_found_where_both_agree(
    kind: str, make: Callable[[Floats], list[Floats]], axes: str, rate_hz: float
) -> None:
    found = other(kind, make, rate_hz, noise=0.001 if kind == "yaw_rate" else 0.005)
    assert found.agrees, found.says
    assert found.axes == axes
    assert found.share > 0.97


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [1.0, 20.0])
def test_a_second_position_at_a_lever_arm_that_is_late(rate_hz: float) -> None:
    found = other("position", lambda m: world(m, 2.1, 0.3), rate_hz, late_s=0.24, noise=0.02)
    values = {one.what: one.parameters for one in found.differences}
    assert set(values) == {"place", "delay"}, found.says
    x, y, delay = values["place"]["x"], values["place"]["y"], values["delay"]["delay"]
    holds((x.value, x.low, x.high), 2.1, 0.3)
    holds((y.value, y.low, y.high), 0.3, 0.3)
    holds((delay.value, delay.low, delay.high), 0.24, 0.12)
    assert "ahead" in found.says
    assert "to starboard" in found.says
    assert "later" in found.says


@pytest.mark.slow
def test_noise_does_not_move_the_place_by_what_is_left_of_the_delay() -> None:
    found = other("position", lambda m: world(m, 2.1, 0.3), late_s=0.24, noise=0.05)
    x = next(one for one in found.differences if one.what == "place").parameters["x"]
    assert x.value == pytest.approx(2.1, abs=0.03)


def test_a_velocity_of_another_place() -> None:
    place = only(other("velocity", lambda m: body(m, -1.5, 0.8)), "place")
    holds(place["x"], -1.5, 0.4)
    holds(place["y"], 0.8, 0.4)


def test_a_velocity_in_knots() -> None:
    found = other("velocity", lambda m: [KNOTS * one for one in body(m)])
    holds(only(found, "scale")["factor"], KNOTS, 0.06)
    assert found.unit == "kn"
    assert "knots" in found.says


def test_a_velocity_with_a_wrong_constant_of_a_knot() -> None:
    found = other("velocity", lambda m: [0.5 * KNOTS * one for one in body(m)])
    holds(only(found, "scale")["factor"], 0.5 * KNOTS, 0.03)
    assert "0.5 m/s" in found.says


def test_a_gyro_in_degrees_that_points_up() -> None:
    found = other("yaw_rate", lambda m: [-np.degrees(m[:, 5])], noise=0.05)
    assert [one.what for one in found.differences] == ["sign", "scale"], found.says
    assert found.unit == "deg/s"
    assert "z axis up" in found.says


def test_a_gyro_that_does_not_read_zero_at_rest() -> None:
    bias = only(other("yaw_rate", lambda m: [m[:, 5] + 0.004], noise=0.0005), "bias")
    holds(bias["bias"], np.degrees(0.004), 0.05)


def test_a_compass_that_is_mirrored() -> None:
    found = other("heading", lambda m: [-m[:, 2]])
    assert [one.what for one in found.differences] == ["sign"], found.says
    assert found.axes == "anticlockwise, z up"


def test_a_heading_counted_from_east() -> None:
    found = other("heading", lambda m: [0.5 * np.pi - m[:, 2]])
    assert [one.what for one in found.differences] == ["sign", "sign"], found.says
    assert "ENU" in found.says


def test_a_compass_with_an_offset() -> None:
    bias = only(other("heading", lambda m: [m[:, 2] + np.radians(3.0)]), "bias")
    holds(bias["bias"], 3.0, 0.5)


def test_a_heading_behind_a_filter_is_no_delay() -> None:
    def filtered(m: Floats) -> list[Floats]:
        psi = m[:, 2].copy()
        for k in range(1, len(psi)):
            psi[k] = psi[k - 1] + (m[k, 2] - psi[k - 1]) * (1.0 - np.exp(-0.1 / 3.0))
        return [psi]

    lag = only(other("heading", filtered), "lag")
    holds(lag["time_constant"], 3.0, 0.5)


def test_what_does_not_follow_is_not_compared() -> None:
    found = other("yaw_rate", lambda m: [0.05 * np.sin(np.arange(len(m)) * 0.037)])
    assert not found.follows
    assert not found.agrees
    assert not found.differences


def test_the_mapped_signal_itself_repeats_it() -> None:
    known = measured()
    # At a fifth of the rate: what is sampled alike is alike to the last digit.
    samples = Samples(
        known.t[::5], known.nu_raw[::5, 2:], 5.0 * STEP_S, "stamp", np.arange(len(known.t[::5])), np.zeros(1)
    )
    found = compare(Candidate("/copy", ("r",), "yaw_rate"), [(samples, known)], 5.0)
    assert found is not None
    assert found.same
    assert "repeats" in found.says


def test_a_column_without_a_name_is_known_by_how_it_moves() -> None:
    assert other("unknown", lambda m: [np.degrees(m[:, 5])], noise=0.01).kind == "yaw_rate"


def test_an_order_that_the_vessel_follows_is_no_sensor() -> None:
    t = np.arange(0.0, LENGTH_S, 0.1)
    samples = Samples(t, at(t + 3.0)[:, 5:], 0.1, "stamp", np.arange(len(t)), np.zeros(1))
    assert compare(Candidate("/order", ("a",), "unknown"), [(samples, measured())], 5.0) is None


def test_a_column_that_follows_in_part_is_no_sensor() -> None:
    t = np.arange(0.0, LENGTH_S, 0.1)
    rudder = at(t)[:, 5:] + coloured(np.random.default_rng(7), len(t), 0.03, 0.1, 20.0)[:, None]
    samples = Samples(t, rudder, 0.1, "stamp", np.arange(len(t)), np.zeros(1))
    assert compare(Candidate("/state", ("a",), "yaw_rate"), [(samples, measured())], 5.0) is not None
    assert compare(Candidate("/state", ("a",), "unknown"), [(samples, measured())], 5.0) is None


def test_short_logs_of_a_campaign_count_together() -> None:
    parts = []
    for first in range(0, 600, 60):
        rows = slice(first * 10, first * 10 + 400)
        known = measured()
        part = Measurements(
            known.profile, known.t[rows], known.eta[rows], known.nu_raw[rows], known.nu[rows], known.parts[rows],
            known.angles[rows], np.ones(400, dtype=np.bool_),
        )  # fmt: skip
        t = known.t[rows]
        parts.append(
            (Samples(t, np.column_stack(body(at(t), 1.0, -2.0)), 0.1, "stamp", np.arange(400), np.zeros(2)), part)
        )
    found = compare(Candidate("/second", ("u", "v"), "velocity"), parts, 5.0)
    assert found is not None
    assert found.logs == 10
    place = only(found, "place")
    holds(place["x"], 1.0, 0.6)
    holds(place["y"], -2.0, 0.6)


def test_a_factor_that_looked_like_no_unit_names_the_one_that_it_is_near() -> None:
    factor = Estimate(1.909, 1.885, 1.933, "-")
    near = nearest_unit(factor.value, "speed")
    assert describe_scale(factor, "", None, near) == "factor 1.909 ± 0.024, near 1.944 of knots"
    assert describe_scale(factor, "", None) == "factor 1.909 ± 0.024"
    assert [nearest_unit(size, "speed") for size in (1.0, 1.2, 1.6, 0.514)] == [""] * 4
    assert nearest_unit(2.0, "heading") == ""
