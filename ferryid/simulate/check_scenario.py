"""What the sections of a scenario must agree on: among each other, with the files they name, and with the vessel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isnan, pi
from typing import TYPE_CHECKING, Any

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.simulate.added_effects import AddedEffect, unfit
from ferryid.simulate.sections import Current, Fault, Mooring, Payload, Wind
from ferryid.simulate.series import read_series
from ferryid.vessel import faults
from ferryid.vessel.load import load_profile
from ferryid.vessel.profile import Profile
from ferryid.vessel.toml_lines import KeyPath, key_lines, line_of

if TYPE_CHECKING:
    from ferryid.simulate.scenario import Scenario

GRAVITY = 9.81
STEEPEST = 1.0 / 7.0
"""Height over length of the steepest wave that does not break; Fossen (2021), section 10.2.1."""
REACH = 0.6
"""Share of the length within which a payload lies when the body origin is near midship."""
LARGEST_LEVEL = 1.0
LAST_S = 2.0**31
"""First time since 1970 that stamps of ROS cannot hold [s]."""
SPARE_S = 60.0
"""For the way of a message to the recorder [s]."""

Doubt = tuple[KeyPath, str]
"""A key of the file, and what is wrong with it."""


def disagreements(scenario: Scenario, data: Mapping[str, Any]) -> Iterator[Doubt]:
    """Yield the faults that no section has by itself.

    Parameters
    ----------
    scenario
        What was read.
    data
        The file's tables as they stand there.
    """
    if "manoeuvre" in data:
        yield from _manoeuvre(scenario, data)
    law, waypoints = scenario.guidance.law, len(scenario.path.waypoints)
    if law != "set-points" and "path" in data and waypoints < 2:
        yield (
            ("path", "points"),
            f'the law "{law}" needs at least two waypoints that lie apart, found {waypoints}. Fix: add points',
        )
    yield from _sea(scenario)
    for place, entry in _lasting(scenario):
        if entry.until_s <= entry.from_s:
            found = f"found {entry.until_s:g}"
            yield (
                (*place, "until_s"),
                f'"until_s" must come after "from_s" = {entry.from_s:g}, {found}. Fix: make it later',
            )
        if entry.from_s >= scenario.duration_s:
            yield (
                (*place, "from_s"),
                f'"from_s" = {entry.from_s:g} comes after the end of the trial at {scenario.duration_s:g} s. '
                "Fix: make it earlier, or the trial longer",
            )
    scaled = [key for key in ("delta", "sigma") if key in data.get("controller", {})]
    if scenario.controller.model and scaled:
        yield (
            ("controller", scaled[0]),
            f'"{scaled[0]}" scales the profile\'s hull, in whose place "model" stands. Fix: leave out one of the two',
        )
    for key, (low, high) in (("north_m", scenario.shallow.north_m), ("east_m", scenario.shallow.east_m)):
        if low > high:
            yield (
                ("environment", "shallow", key),
                f'"{key}" is reversed: [{low:g}, {high:g}]. Fix: write [lowest, highest]',
            )
    for index, fault in enumerate(scenario.thrusters.faults):
        if not fault.thruster:
            place = ("thrusters", "faults", index)
            yield (
                place,
                'the fault does not say whose it is. Fix: add thruster = "NAME", as the vessel profile names it',
            )
    yield from _time(scenario, data)
    yield from _files(scenario)


def check_against(scenario: Scenario, profile: Profile) -> None:
    """Check a scenario against the vessel that it is to be simulated with.

    Raises
    ------
    FerryIdError
        For the first thing by line that the vessel lacks.
    """
    lines = key_lines(scenario.text)
    raise_first(
        scenario.where,
        [faults.Fault(line_of(lines, place), message) for place, message in _lacking(scenario, profile)],
    )


def vessel_of(scenario: Scenario) -> Profile:
    """Load the scenario's vessel profile.

    Raises
    ------
    FerryIdError
        When it cannot be read; names the scenario and the line, too.
    """
    try:
        return load_profile(scenario.profile)
    except FerryIdError as error:
        raise FerryIdError(f'{scenario.where}:{line_in(scenario, "vessel")}: "vessel": {error}') from error


def line_in(scenario: Scenario, *place: str | int) -> int:
    """Return the line of a key in the scenario's file, or of what holds it."""
    return line_of(key_lines(scenario.text), place)


def raise_first(where: str, found: list[faults.Fault]) -> None:
    """Raise the first fault by line, with the number of further ones; do nothing where there are none."""
    if found:
        first = min(found, key=lambda fault: fault.line)
        more = f" ({len(found) - 1} more)" if len(found) > 1 else ""
        raise FerryIdError(f"{where}:{first.line}: {first.message}{more}")


def _manoeuvre(scenario: Scenario, data: Mapping[str, Any]) -> Iterator[Doubt]:
    """Yield what a manoeuvre contradicts."""
    if "kind" not in data["manoeuvre"]:
        yield ("manoeuvre",), '[manoeuvre] lacks "kind". Fix: add kind = "zigzag", or another one'
    if scenario.guidance.law != "set-points":
        yield (
            ("guidance",),
            "guidance follows a path, and a manoeuvre has none. Fix: remove [guidance], or write [path] for [manoeuvre]",
        )
    largest = max(map(abs, scenario.manoeuvre.levels))
    if largest > LARGEST_LEVEL:
        yield (
            ("manoeuvre", "levels"),
            f'"levels" are shares of speed_rpm, from -1 to 1, found {largest:g}. Fix: set speed_rpm to the highest speed',
        )


def _time(scenario: Scenario, data: Mapping[str, Any]) -> Iterator[Doubt]:
    """Yield an end that the stamps of a log cannot hold: seconds since 1970 in 32 bits, by the clock that is most ahead."""
    sensors = scenario.sensors
    ahead_s = 1e-3 * max(0.0, sensors.clock_offset_ms, sensors.thruster_clock_offset_ms)
    if scenario.start_ns * 1e-9 + scenario.duration_s + ahead_s + SPARE_S > LAST_S:
        yield (
            ("start",) if "start" in data else (),
            '"start" must lie so that the trial ends before 2038-01-19, the last day that stamps of ROS can hold. '
            "Fix: start earlier",
        )


def _sea(scenario: Scenario) -> Iterator[Doubt]:
    """Yield waves and wakes that would break: they are steeper than any sea is."""
    seas: list[tuple[KeyPath, float, float]]
    seas = [(("environment", "waves"), scenario.waves.significant_height_m, scenario.waves.peak_period_s)]
    seas += [(("environment", "wakes", i), wake.height_m, wake.period_s) for i, wake in enumerate(scenario.wakes)]
    for place, height_m, period_s in seas:
        highest = STEEPEST * GRAVITY * period_s**2 / (2.0 * pi)
        if height_m > highest:
            key = "significant_height_m" if place[1] == "waves" else "height_m"
            yield (
                (*place, key),
                f'"{key}" must be at most {highest:.2g} with a period of {period_s:g} s, found {height_m:g}: steeper waves '
                "break. Fix: make the period longer",
            )


def _lasting(scenario: Scenario) -> Iterator[tuple[KeyPath, AddedEffect | Current | Wind | Mooring | Payload | Fault]]:
    """Yield everything that has a beginning and an end, with its place in the file."""
    yield ("environment", "wind"), scenario.wind
    yield ("environment", "current"), scenario.current
    yield ("environment", "mooring"), scenario.mooring
    yield from ((("effects", index), entry) for index, entry in enumerate(scenario.effects))
    yield from ((("payload", index), entry) for index, entry in enumerate(scenario.payload))
    yield from ((("thrusters", "faults", index), entry) for index, entry in enumerate(scenario.thrusters.faults))


def _files(scenario: Scenario) -> Iterator[Doubt]:
    """Yield files that are not there or cannot be read."""
    if scenario.wind.series:
        try:
            read_series(scenario.file(scenario.wind.series))
        except FerryIdError as error:
            yield ("environment", "wind", "series"), f'"series": {error}'
    model = scenario.controller.model
    if model and not scenario.file(model).is_file():
        yield (
            ("controller", "model"),
            f'"model": there is no file {scenario.file(model)}, which the feedforward needs. Fix: give the path of a '
            "model that ferryid fit has written, from the scenario's folder on",
        )


def _lacking(scenario: Scenario, profile: Profile) -> Iterator[Doubt]:
    """Yield what the scenario asks for and the vessel cannot give."""
    hull = profile.hull
    if not hull.has_model:
        yield (
            ("vessel",),
            f"the simulator needs the hull's damping, found no [hull.D] in the profile {profile.name}. Fix: simulate a "
            "vessel with a hull model, such as milliampere",
        )
    names = [actuator.name for actuator in profile.actuators]
    for index, fault in enumerate(scenario.thrusters.faults):
        if fault.thruster and fault.thruster not in names:
            yield (
                ("thrusters", "faults", index, "thruster"),
                f'{profile.name} has no thruster "{fault.thruster}", found {", ".join(names)}.'
                f"{did_you_mean(fault.thruster, names)} Fix: name one of these",
            )
    yield from unfit(scenario, profile)
    waves = scenario.waves.significant_height_m > 0.0
    if (waves or any(wake.height_m > 0.0 for wake in scenario.wakes)) and (isnan(hull.length_m) or isnan(hull.beam_m)):
        yield (
            ("environment", "waves" if waves else "wakes"),
            f"waves need the size of the hull, and the profile {profile.name} lacks length_m or beam_m. "
            "Fix: add them to [hull]",
        )
    wind = scenario.wind
    if profile.wind is None and (wind.series or wind.north_mps or wind.east_mps or wind.gust_std_mps):
        yield (
            ("environment", "wind"),
            f"wind acts on areas, and the profile {profile.name} has no [wind]. Fix: add it there, or remove the wind here",
        )
    for index, payload in enumerate(scenario.payload):
        if abs(payload.x_m) > REACH * hull.length_m:
            yield (
                ("payload", index, "x_m"),
                f'"x_m" = {payload.x_m:g} lies off a hull of length {hull.length_m:g} m. '
                "Fix: count from the body origin, forward",
            )
