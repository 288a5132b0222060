"""The simulator: how many times faster than real time it runs, on one core."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ferryid.simulate.scenario import Scenario, parse_scenario
from ferryid.simulate.sections import Fouling, Mooring, Payload, Shallow, Wake, Waves
from ferryid.simulate.trial import sail, simulate
from ferryid.vessel.load import load_profile
from tests.bench.page import Row, Section, duration, seconds

ROUND_S = 720.0
STEP_HZ = 50.0
PLAIN = """
schema = "ferryid.scenario/1"
title = "One round of the 12-corner path"
vessel = "milliampere"

[path]
kind = "twelve-corner"

[controller]
delta = 0.4
sigma = 0.4

[environment.wind]
north_mps = -3.0
east_mps = 2.0
gust_std_mps = 0.5
"""


def run(quick: bool) -> Section:
    """Measure; a quick run differs in the number of repeats alone."""
    repeats = 3 if quick else 7
    plain = parse_scenario(PLAIN, "bench")
    full = everything(plain)
    profile = load_profile("milliampere")
    start = time.perf_counter()
    sail(plain, profile, 0)
    first_s = time.perf_counter() - start
    rows = [
        real_time(
            "full plant: wind, gusts, current, 40 waves, wakes, payload and all losses", sailing(full), repeats, 4000
        ),
        real_time("the same without waves", sailing(replace(full, waves=Waves(), wakes=())), repeats, None),
        real_time("hull, wind and gusts", sailing(plain), repeats, None),
        real_time("hull, wind and gusts, with every sensor's messages", lambda: simulate(plain, 1), repeats, None),
    ]
    notes = [
        "A 12-minute round at 50 Hz in Runge-Kutta steps of fourth order, controller at 20 Hz, random series included; one "
        "thread. The rival is the trial itself, not the yardstick: the goal is reached by this machine or it is not.",
        f"{waves_alone(full)} Of the whole, what waves do not take is the row without them.",
        f"The first run of this process, with the compiled code read from disk or compiled, took {duration(first_s)}.",
    ]
    return Section("Simulator", rows, notes, ("numba", "numpy"))


def waves_alone(scenario: Scenario) -> str:
    """Return, as a sentence, what the waves' sines and cosines take at every stage of the round, by NumPy."""
    stages = round(4 * STEP_HZ * ROUND_S)
    turns = np.random.default_rng(0).random((stages // 10, scenario.waves.components + len(scenario.wakes)))
    start = time.perf_counter()
    np.sin(2.0 * np.pi * turns)
    np.cos(2.0 * np.pi * turns)
    numpy_s = 10.0 * (time.perf_counter() - start)
    return (
        f"Sines and cosines of {turns.shape[1]} components at {stages:,} stages take {duration(numpy_s)} by NumPy, without "
        "their forces."
    )


def everything(plain: Scenario) -> Scenario:
    """Return the scenario with every force and loss that the plant knows switched on."""
    thrusters = replace(plain.thrusters, force_lag_s=0.1, inflow_loss_per_mps=0.05, interaction_fraction=0.1)
    return replace(
        plain,
        current=replace(plain.current, north_mps=0.1, east_mps=0.05, turn_degpmin=2.0),
        waves=Waves(significant_height_m=0.1),
        wakes=(Wake(at_s=200.0, height_m=0.2),),
        payload=(Payload(mass_kg=300.0, x_m=0.5, from_s=300.0),),
        fouling=Fouling(1.2, 1.2, 1.2),
        shallow=Shallow((0.0, 10.0), (-20.0, 0.0), 1.3),
        mooring=Mooring(0.0, 0.0, 2.0, 2.0),
        thrusters=thrusters,
    )


def sailing(scenario: Scenario) -> Callable[[], object]:
    """Return a run of the closed loop alone."""
    profile = load_profile("milliampere")
    return lambda: sail(scenario, profile, 1)


def real_time(what: str, work: Callable[[], object], repeats: int, goal: float | None) -> Row:
    """Measure how many times faster than the trial itself a run is: the median."""
    work()
    times = sorted(seconds(work) for _ in range(repeats))
    ratio = ROUND_S / times[repeats // 2]
    values = (what, duration(times[repeats // 2]), "real time", duration(ROUND_S), ratio)
    return Row(*values) if goal is None else Row(*values, f"≥ {goal:g}", ratio >= goal)
