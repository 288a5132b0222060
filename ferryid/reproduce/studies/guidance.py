"""Experiment 3 and Appendix B: carrot steering against both line-of-sight laws."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.compare import signal_power
from ferryid.report.drawing import Drawing, Line, Panel
from ferryid.reproduce.flight import Flight, controlled, fly, trial, weather_seed
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import MASTER, THESIS, learn
from ferryid.reproduce.pictures import control_shares
from ferryid.reproduce.study import Row, Study, Table, changes, median, number, percent, spread
from ferryid.types import AXES, Floats

PLACE = 80
AFTER_S = 30.0
"""How long a turn is followed from entering its circle on [s]."""
LAWS = ("carrot", "look-ahead", "enclosure")
EXPERIMENT_3 = replace(THESIS, components=17, window_s=1.5, delta=1.0, sigma=1.0)
"""Section 5.5.3: 17 components, window 1.5 s, on top of the Master Model."""


@dataclass(frozen=True)
class Ride:
    """How one law follows the path.

    Attributes
    ----------
    off_m, off_most_m
        Distance from the path, rms and largest [m], outside the switching circles.
    slowest, fastest
        Least desired speed from the moment a switching circle is entered to `AFTER_S` after it, and the greatest from the least
        on, over the median speed elsewhere; medians over the turns.
    jerk
        RMS change of the desired acceleration [m/s³].
    feedback, feedforward
        Power of both per axis, shape (3,).
    distance_m
        Way made good [m].
    energy_J
        Mechanical work.
    aimless
        Cycles in which the law had no point to aim at: the path was further away than the enclosure's radius.
    """

    off_m: float
    off_most_m: float
    slowest: float
    fastest: float
    jerk: float
    feedback: Floats
    feedforward: Floats
    distance_m: float
    energy_J: float
    aimless: int


@dataclass(frozen=True)
class Outcome:
    """One seed: a ride per law, and feedback power of rounds 10 and 11."""

    rides: tuple[Ride, ...]
    rounds: Floats
    drawings: tuple[Drawing, ...]


def study(lab: Lab) -> Study:
    """Follow the operational path with three laws."""
    outcomes = lab.each_seed(_experiment, "Experiment 3: guidance")
    rows = (
        Row(
            "least desired speed in a turn over that on the legs, carrot", "", "reduced", _each(outcomes, 0, "slowest")
        ),
        Row("the same, look-ahead", "", None, _each(outcomes, 1, "slowest")),
        Row("the same, enclosure", "", None, _each(outcomes, 2, "slowest")),
        Row(
            "greatest desired speed out of a turn over that on the legs, carrot",
            "",
            None,
            _each(outcomes, 0, "fastest"),
        ),
        Row("the same, look-ahead", "", "increased", _each(outcomes, 1, "fastest")),
        Row("the same, enclosure", "", None, _each(outcomes, 2, "fastest")),
        *(
            Row(
                f"feedback power, {axis}, round 11 (Model 10) against round 10 (Master Model)",
                "%",
                "no significant change",
                changes([one.rounds[1, j] for one in outcomes], [one.rounds[0, j] for one in outcomes]),
            )
            for j, axis in enumerate(AXES)
        ),
    )
    table = Table(
        "Twelve minutes along the operational path, Master Model; median (least to greatest).",
        ("", *LAWS),
        tuple(
            (label, *(spread([factor * value for value in _each(outcomes, k, name)]) for k in range(len(LAWS))))
            for label, name, factor in (
                ("distance from the legs, rms [m]", "off_m", 1.0),
                ("distance from the legs, largest [m]", "off_most_m", 1.0),
                ("least desired speed in turns / on legs", "slowest", 1.0),
                ("greatest desired speed out of turns / on legs", "fastest", 1.0),
                ("jerk of the reference, rms [m/s³]", "jerk", 1.0),
                ("way travelled [m]", "distance_m", 1.0),
                ("energy [kJ]", "energy_J", 1e-3),
                ("cycles without a point to aim at", "aimless", 1.0),
            )
        )
        + tuple(
            (
                f"feedback / feedforward power, {axis}",
                *(
                    spread([float(one.rides[k].feedback[j] / one.rides[k].feedforward[j]) for one in outcomes])
                    for k in range(len(LAWS))
                ),
            )
            for j, axis in enumerate(AXES)
        ),
    )
    return Study(
        "guidance",
        "Path following: carrot against line of sight (Experiment 3)",
        "Does the carrot slow the vessel in turns and let the feedforward do the work, and do the others not?",
        (
            "An operational path with a switching radius of 5 m; all three laws look 10 m ahead and feed the "
            "same reference "
            "filter. Rounds 9 and 10 are flown with the carrot and the Master Model, round 11 with the model of "
            "both (17 components, "
            "window 1.5 s).",
        ),
        rows,
        (table,),
        tuple(_findings(outcomes)),
        outcomes[0].drawings,
    )


def _each(outcomes: list[Outcome], law: int, name: str) -> tuple[float, ...]:
    return tuple(float(getattr(one.rides[law], name)) for one in outcomes)


def _experiment(folder: Path, seed: int) -> Outcome:
    scenario = controlled(trial("operation"), MASTER)
    flights = [
        fly(folder, law, replace(scenario, guidance=replace(scenario.guidance, law=law)), weather_seed(seed, 10))
        for law in LAWS
    ]
    ninth = fly(folder, "round-9", scenario, weather_seed(seed, 9))
    motions = [flight.motion(EXPERIMENT_3.window_s) for flight in (ninth, flights[0])]
    eleventh = fly(folder, "round-11", scenario, weather_seed(seed, 11), learn(motions, ninth.profile, EXPERIMENT_3))
    rounds = [flight.performance.feedback_power for flight in (flights[0], eleventh)]
    return Outcome(
        tuple(_ride(flight) for flight in flights),
        np.array(rounds),
        _pictures(flights, eleventh) if seed == 1 else (),
    )


def _ride(flight: Flight) -> Ride:
    one = flight.simulation
    control, truth = one.control, one.truth
    corners = np.array([pose[:2] for pose in one.scenario.path.poses])
    radius = one.scenario.guidance.radius_m
    position = np.column_stack([np.interp(control.t, truth.t, column) for column in truth.eta[:, :2].T])
    turning = near(position, corners, radius)
    off = distance(position, corners)[~turning]
    speed = np.hypot(control.nu_d[:, 0], control.nu_d[:, 1])
    rate = 1.0 / float(np.median(np.diff(control.t)))
    jerk = np.diff(np.column_stack([control.nu_d[:, 0], control.nu_d[:, 1]]), 2, axis=0) * rate**2
    return Ride(
        float(np.sqrt(np.mean(off**2))),
        float(np.max(off)),
        *through_turns(control.t, speed, turning),
        float(np.sqrt(np.mean(np.sum(jerk**2, axis=1)))),
        flight.performance.feedback_power,
        signal_power(flight.performance.feedforward),
        float(np.sum(np.hypot(*np.diff(truth.eta[:, :2], axis=0).T))),
        flight.performance.EC,
        control.undefined_aims,
    )


def through_turns(t: Floats, speed: Floats, turning: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the least speed in turns and the greatest after it, over the median elsewhere; medians over the turns.

    Parameters
    ----------
    t, speed
        Time [s] and speed [m/s], shape (n,).
    turning
        True inside a switching circle, shape (n,).
    """
    entries = np.flatnonzero(np.diff(turning.astype(np.int8)) == 1) + 1
    spans = [(t >= t[i]) & (t <= t[i] + AFTER_S) for i in entries if t[i] + AFTER_S <= t[-1]]
    if not spans:
        return float("nan"), float("nan")
    legs = float(np.median(speed[~np.logical_or.reduce(spans) & (t > AFTER_S)]))
    slowest, fastest = [], []
    for span in spans:
        part = speed[span]
        bottom = int(np.argmin(part))
        slowest.append(part[bottom] / legs)
        fastest.append(part[bottom:].max() / legs)
    return float(np.median(slowest)), float(np.median(fastest))


def near(position: Floats, corners: Floats, radius_m: float) -> NDArray[np.bool_]:
    """Return True within a radius of any corner, shape (n,)."""
    away = np.linalg.norm(position[:, None, :] - corners[None, :, :], axis=2)
    return np.asarray(away.min(axis=1) <= radius_m)


def distance(position: Floats, corners: Floats) -> Floats:
    """Return the distance of points from a closed course through corners [m], shape (n,)."""
    least = np.full(len(position), np.inf)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = b - a
        length = float(along @ along)
        share = np.clip((position - a) @ along / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(position))
        least = np.minimum(least, np.linalg.norm(position - a - share[:, None] * along, axis=1))
    return least


def _pictures(flights: list[Flight], eleventh: Flight) -> tuple[Drawing, ...]:
    corners = np.array([pose[:2] for pose in flights[0].simulation.scenario.path.poses])
    closed = np.vstack([corners, corners[:1]])
    track = [Line("path", closed[:, 1], closed[:, 0])]
    speeds = []
    for law, flight in zip(LAWS, flights, strict=True):
        truth, control = flight.simulation.truth, flight.simulation.control
        track.append(Line(law, truth.eta[::25, 1], truth.eta[::25, 0]))
        rows = control.t <= 300.0
        speeds.append(Line(law, control.t[rows], np.hypot(control.nu_d[rows, 0], control.nu_d[rows, 1])))
    return (
        Drawing(
            "5-16-path",
            "Tracks along the operational path, in the manner of figure 5.16.",
            "east [m]",
            (Panel("north [m]", tuple(track)),),
            equal=True,
        ),
        Drawing(
            "guidance-speeds",
            "Desired speed of the three laws.",
            "time [s]",
            (Panel("desired speed [m/s]", tuple(speeds)),),
        ),
        _response(flights[0], body=True),
        _response(flights[0], body=False),
        control_shares(
            "5-19-shares-round-10", "Feedforward and feedback in round 10, as in figure 5.19.", flights[0].performance
        ),
        control_shares(
            "5-20-shares-round-11", "Feedforward and feedback in round 11, as in figure 5.20.", eleventh.performance
        ),
    )


def _response(flight: Flight, *, body: bool) -> Drawing:
    """Return figure 5.17, velocities, or 5.18, position and heading, of round 10: true and desired."""
    truth, control = flight.simulation.truth, flight.simulation.control
    wanted, real = (control.nu_d, truth.nu) if body else (control.eta_d, truth.eta)
    degrees = np.array([1.0, 1.0, 180.0 / np.pi])
    labels = ("u [m/s]", "v [m/s]", "r [deg/s]") if body else ("north [m]", "east [m]", "heading [deg]")
    every, seldom = 25, 10  # half a second each
    panels = tuple(
        Panel(
            label,
            (
                Line("true", truth.t[::every], degrees[j] * real[::every, j]),
                Line("desired", control.t[::seldom], degrees[j] * wanted[::seldom, j]),
            ),
        )
        for j, label in enumerate(labels)
    )
    name, what = ("5-17-body", "Velocities") if body else ("5-18-ned", "Position and heading")
    figure = name[:4].replace("-", ".")
    return Drawing(name, f"{what} in round 10, carrot and Master Model, as in figure {figure}.", "time [s]", panels)


def _findings(outcomes: list[Outcome]) -> list[str]:
    least = {law: median(_each(outcomes, k, "slowest")) for k, law in enumerate(LAWS)}
    most = {law: median(_each(outcomes, k, "fastest")) for k, law in enumerate(LAWS)}
    off = {law: median(_each(outcomes, k, "off_m")) for k, law in enumerate(LAWS)}
    told = [
        "In a turn the desired speed falls to "
        + ", ".join(f"{number(value)} ({law})" for law, value in least.items())
        + " of that on the legs, and rises out of it to "
        + ", ".join(f"{number(value)} ({law})" for law, value in most.items())
        + ". "
        + (
            "The carrot slows down in turns, as designed"
            if least["carrot"] < 0.98
            else "The carrot does not slow down in turns"
        )
        + (
            ", more than the look-ahead law does. "
            if least["carrot"] < 0.98 * least["look-ahead"]
            else ", but no more than the look-ahead law: whatever the goal does, a turn of the path makes the "
            "reference filter's velocity "
            "turn too, and its speed dips. "
        )
        + (
            "The look-ahead law overshoots its speed out of turns, as the thesis observed."
            if most["look-ahead"] > 1.02
            else "The look-ahead law's speeding up, which the thesis reports without numbers, is not seen on this path."
        ),
        "Distance from the legs (rms): "
        + ", ".join(f"{law} {number(value)} m" for law, value in off.items())
        + (
            f"; {min(off, key=lambda law: off[law])} stays nearest."
            if min(off.values()) < 0.9 * max(off.values())
            else ": less than a tenth between them."
        ),
    ]
    shift = [
        median(changes([one.rounds[1, j] for one in outcomes], [one.rounds[0, j] for one in outcomes]))
        for j in range(3)
    ]
    told.append(
        "From round 10 to round 11 feedback power changes by "
        + ", ".join(f"{percent(value)} % in {axis}" for value, axis in zip(shift, AXES, strict=True))
        + (
            ": little, as in the thesis."
            if max(abs(value) for value in shift) < 15.0
            else ". The thesis saw no significant change."
        )
    )
    return told
