"""Velocities against the pose: wrong signs, units and scales are named; noise, chance and jumps are not taken for them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.signals.consistency import comparable, cross_checks
from ferryid.signals.prepare import open_track
from ferryid.signals.track import Track
from ferryid.vessel import load_profile
from tests.damage import SURGE, changed, scaled, ten_minutes, written

Floats = NDArray[np.float64]

T = np.arange(0, 120, 0.05)


def voyage(**changes: Floats) -> Track:
    """A turning, speeding voyage with position, velocity and heading that agree."""
    psi = 0.5 * np.sin(0.1 * T) + 0.05 * T
    u, v, r = 1.0 + 0.5 * np.sin(0.07 * T), 0.3 * np.cos(0.05 * T), 0.05 * np.cos(0.1 * T) + 0.05
    fine = np.linspace(0, T[-1], 20 * T.size)
    heading = 0.5 * np.sin(0.1 * fine) + 0.05 * fine
    north = np.cos(heading) * (1.0 + 0.5 * np.sin(0.07 * fine)) - np.sin(heading) * 0.3 * np.cos(0.05 * fine)
    east = np.sin(heading) * (1.0 + 0.5 * np.sin(0.07 * fine)) + np.cos(heading) * 0.3 * np.cos(0.05 * fine)
    step = fine[1] - fine[0]
    x, y = (np.interp(T, fine, np.concatenate([[0], np.cumsum((d[1:] + d[:-1]) / 2 * step)])) for d in (north, east))
    columns = {"x": x, "y": y, "psi": psi, "u": u, "v": v, "r": r, **changes}
    return Track("trial", T, 0, 20.0, columns, np.ones(T.size, dtype=bool))


def test_agreeing_signals_raise_no_finding() -> None:
    assert cross_checks(voyage()) == ()


def by_position(offset_deg: float = 0.0, sign: float = 1.0, rows: int = T.size) -> Track:
    """The voyage as a log without velocities has it, its heading turned or counted the other way."""
    track = voyage()
    columns = {name: values[:rows] for name, values in track.columns.items()}
    columns["psi"] = sign * columns["psi"] + np.radians(offset_deg)
    # What nobody measured is the slope of the pose, along axes that the heading gives.
    c, s = np.cos(columns["psi"]), np.sin(columns["psi"])
    north, east = (np.gradient(columns[name], T[:rows]) for name in ("x", "y"))
    columns |= {"u": c * north + s * east, "v": c * east - s * north, "r": np.gradient(columns["psi"], T[:rows])}
    return replace(track, t=T[:rows], columns=columns, valid=np.ones(rows, dtype=bool), slopes=frozenset("uvr"))


@pytest.mark.parametrize("offset_deg", [0.0, 90.0, 187.0])
def test_a_heading_that_goes_against_the_course_is_named_without_velocities(offset_deg: float) -> None:
    (doubt,) = cross_checks(by_position(offset_deg, -1.0))
    assert doubt.certain
    assert doubt.says.startswith("The heading turns the wrong way round against the course (mean resultant length 0.9")
    assert doubt.remedy == "take the other of NED and ENU as frame in [signals.heading]"


@pytest.mark.parametrize(("offset_deg", "said"), [(90.0, "to port"), (-90.0, "to starboard"), (170.0, "to port")])
def test_a_heading_whose_zero_is_off_is_named_without_velocities(offset_deg: float, said: str) -> None:
    (doubt,) = cross_checks(by_position(offset_deg))
    assert not doubt.certain
    assert said in doubt.says
    added = float(doubt.says.partition("add ")[2].partition(" deg")[0])
    assert added == pytest.approx(-offset_deg, abs=15.0)
    assert cross_checks(by_position(offset_deg + added)) == ()


def test_one_heading_or_a_right_one_shows_nothing_without_velocities() -> None:
    assert cross_checks(by_position()) == ()
    straight = by_position(rows=800)
    turned = replace(straight, columns={**straight.columns, "psi": np.full(800, 1.0), "x": T[:800], "y": 0.0 * T[:800]})
    assert cross_checks(turned) == ()


def test_short_logs_and_logs_at_rest_can_show_no_contradiction() -> None:
    whole = voyage()
    assert comparable(whole)

    def cut(rows: int) -> Track:
        columns = {name: values[:rows] for name, values in whole.columns.items()}
        return Track("short", T[:rows], 0, 20.0, columns, np.ones(rows, dtype=bool))

    assert not comparable(cut(300))
    still = {name: np.zeros(T.size) for name in whole.columns}
    assert not comparable(voyage(**still))
    nothing_turns = dict.fromkeys(("psi", "r"), np.zeros(T.size))
    assert comparable(voyage(**nothing_turns))


@pytest.mark.parametrize(
    ("name", "factor", "said"),
    [
        ("r", -1.0, "yaw rate has the wrong sign against the heading"),
        ("r", 180 / np.pi, "degrees per second look read as rad/s"),
        ("r", np.pi / 180, "rad/s look read as degrees per second"),
        (
            "u",
            1 / 0.514444,
            "surge velocity does not match the position (whose slope is 0.514 times it, 99 % interval 0.514 to 0.514, "
            "correlation 1.00): knots look",
        ),
        ("u", 0.514444, "m/s look read as knots"),
        ("v", -1.0, "sway velocity has the wrong sign against the position (whose slope is -1 times it"),
        ("u", 1.3, "surge velocity does not match the position (whose slope is 0.769 times it"),
    ],
)
def test_wrong_signs_and_units_are_named(name: str, factor: float, said: str) -> None:
    track = voyage()
    (finding,) = cross_checks(voyage(**{name: factor * track.columns[name]}))
    assert said in finding.says
    assert finding.certain is (factor != 1.3)


@pytest.mark.parametrize("turned", [0.0, 0.4])
def test_frames_of_the_wrong_hand_are_named(turned: float) -> None:
    track = voyage()
    x, y, psi = (track.columns[name] for name in ("x", "y", "psi"))
    (finding,) = cross_checks(voyage(x=y, y=x))
    assert finding.says.startswith("The positions are mirrored")
    assert finding.certain
    doubts = cross_checks(voyage(psi=0.5 * np.pi + turned - psi))
    assert [doubt.certain for doubt in doubts] == [True, True]
    assert "wrong sign against the heading" in doubts[0].says
    assert doubts[1].says.startswith("The heading turns the wrong way round")


def test_a_turned_frame_is_not_of_the_wrong_hand() -> None:
    track = voyage()
    doubts = cross_checks(voyage(psi=track.columns["psi"] + 1.5))
    assert doubts
    assert not any(doubt.certain for doubt in doubts if "mirrored" in doubt.says or "round" in doubt.says)


@pytest.mark.parametrize(
    ("name", "factor", "offset", "remedy"),
    [
        ("delta_main", np.degrees(1.0), 0.0, 'set unit = "deg" in [signals."main.rudder"]'),
        ("delta_cmd_main", np.degrees(1.0), 0.0, 'set unit = "deg" in [signals."main.rudder.command"]'),
        # Twenty radians are three turns and a right angle less.
        ("delta_main", np.degrees(1.0), -40.0, 'set unit = "deg" in [signals."main.rudder"]'),
        ("delta_main", 1.0, np.pi, 'check unit and offset in [signals."main.rudder"]'),
        ("delta_main", 1.0, 2.0 * np.pi, ""),
        ("delta_main", 1.0, 0.0, ""),
        # A thruster turns all the way round.
        ("alpha_main", np.degrees(1.0), 0.0, ""),
    ],
)
def test_a_rudder_across_the_hull_is_named(name: str, factor: float, offset: float, remedy: str) -> None:
    rudder = np.radians(20.0) * np.sin(0.2 * T) * factor + offset
    said = cross_checks(voyage(**{name: rudder}))
    assert [one.remedy for one in said if one.certain] == [remedy] * bool(remedy)
    # Single wrong samples are no unit.
    rudder = np.where(np.arange(T.size) % 25 == 0, 2.0, np.radians(20.0) * np.sin(0.2 * T))
    assert cross_checks(voyage(delta_main=rudder)) == ()


def test_a_yaw_rate_from_elsewhere_is_named() -> None:
    (finding,) = cross_checks(voyage(r=0.1 * np.sin(2.1 * T)))
    assert "does not follow the heading" in finding.says
    assert not finding.certain


def test_only_measured_rows_enter_the_cross_checks() -> None:
    track = voyage()
    columns = {name: values.copy() for name, values in track.columns.items()}
    columns["x"][600:1800] = np.nan
    columns["r"][1000:1400] = 1.0
    valid = columns["r"] < 0.9
    assert cross_checks(Track("trial", T, 0, 20.0, columns, valid)) == ()


def test_one_jump_of_the_position_does_not_outweigh_the_rest() -> None:
    track = voyage()
    assert cross_checks(voyage(x=track.columns["x"] + np.where(T > 60, 500.0, 0.0))) == ()


@pytest.mark.parametrize("name", ["u", "v", "r"])
@pytest.mark.parametrize("gain", [0.9, 1.1])
def test_a_tenth_is_found_in_clean_signals(name: str, gain: float) -> None:
    (finding,) = cross_checks(voyage(**{name: voyage().columns[name] / gain}))
    assert f"(whose slope is {gain:.3g} times it, 99 % interval " in finding.says
    assert "check the scale of the" in finding.says
    assert ("lever arm" in finding.says) is (name != "r")
    assert not finding.certain


def noisy_scale(scale: float, noise: float) -> Track:
    """A voyage whose surge velocity is `scale` times the position's slope, with slow errors of `noise` times its own size."""
    u = voyage().columns["u"]
    rng = np.random.default_rng(3)
    slow = np.convolve(rng.standard_normal(T.size + 200), np.ones(201) / np.sqrt(201.0), mode="valid")
    return voyage(u=scale * (u - noise * np.sqrt(np.mean(u**2)) * slow))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_interval_that_holds_several_units_names_them_and_picks_none(sign: float) -> None:
    (doubt,) = cross_checks(noisy_scale(sign * 3.3, 0.36))
    assert "km/h look read as m/s or knots look read as m/s, the interval holds both" in doubt.says
    # A sign is certain whatever the unit; a unit that is one of several is no reason to refuse a log.
    assert doubt.certain is (sign < 0.0)
    assert ("check the scale of the surge velocity" in doubt.says) is (sign > 0.0)


def test_an_interval_that_holds_one_unit_refuses_the_log_in_spite_of_noise() -> None:
    (doubt,) = cross_checks(noisy_scale(3.6, 0.05))
    assert doubt.says.endswith(": km/h look read as m/s.")
    assert doubt.certain


def test_an_interval_without_end_names_no_unit_with_a_wrong_sign() -> None:
    (doubt,) = (one for one in cross_checks(noisy_scale(-1.3, 0.8)) if "wrong sign" in one.says)
    assert "look read as" not in doubt.says


@pytest.mark.slow
def test_slow_noise_of_a_velocity_is_no_wrong_scale() -> None:
    """Errors of a navigation filter last for many seconds and attenuate the gain, by their size and by chance."""
    fired = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        white = np.convolve(rng.standard_normal(T.size + 400), np.ones(401) / np.sqrt(401.0), mode="valid")
        u = voyage().columns["u"]
        # Motion without its mean, as on a course that turns back.
        fired += bool(cross_checks(voyage(u=u + 0.2 * np.sqrt(np.mean(u**2)) * white)))
    assert fired <= 2


@pytest.mark.slow
def test_the_undamaged_trial_raises_no_doubt_and_a_tenth_does(tmp_path: Path) -> None:
    ferry = load_profile("milliampere")
    assert open_track(str(written(ten_minutes(), tmp_path / "clean.mcap")), ferry, None).doubts == ()
    made = changed(ten_minutes(), [(-1.0, 1e4)], scaled(SURGE, 1.0 / 0.9))
    (doubt,) = open_track(str(written(made, tmp_path / "tenth.mcap")), ferry, None).doubts
    assert doubt.startswith("The surge velocity does not match the position (whose slope is 0.8")
    assert doubt.endswith(
        "check the scale of the surge velocity in the profile, and the lever arm of what is measured away "
        "from the body origin."
    )
