"""Calm water and air in which trials of a vessel are simulated, and looked at with its own sensors."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ferryid.diagnose.judging import Key, Responses
from ferryid.identifiability.sensors import mapped, reading
from ferryid.identifiability.trial import MODEL, controller_lines, cruising, equipment_lines
from ferryid.planning.information import information
from ferryid.planning.limits import Limits
from ferryid.planning.segments import STEP_S
from ferryid.planning.steering import Manoeuvre
from ferryid.simulate import Scenario, parse_scenario, write_log
from ferryid.simulate.paths import TWELVE_CORNER
from ferryid.simulate.sensors import sense
from ferryid.simulate.trial import Simulation, sail
from ferryid.types import Floats
from ferryid.vessel.dimensions import dimensions, froude_seconds
from ferryid.vessel.profile import Profile

QUICK = 3.0
"""Natural frequency of the reference over the simulator's usual one: a plan's poses are close together and smooth already."""
MARGIN = 1.2
"""Of the reference's limits over those of a plan, which has its own."""
DIGITS = 4
"""Decimals of poses in a scenario."""


@dataclass(frozen=True)
class Waters:
    """Where trials of a vessel are simulated.

    Attributes
    ----------
    profile, vessel
        As it is known, and as it can be simulated.
    keys
        Effects whose responses are kept beside the hull's.
    folder
        For the log.
    seed
        Of the simulated noise.
    """

    profile: Profile
    vessel: Profile
    keys: frozenset[Key]
    folder: Path
    seed: int

    @property
    def scale(self) -> tuple[float, float]:
        """Factors on lengths and times from those of milliAmpère."""
        return dimensions(self.profile)[0] / MODEL[0], froude_seconds(self.profile, 1.0)

    def following(self, poses: Floats, limits: Limits) -> Scenario:
        """Return the scenario of poses, a row every step: north, east [m] and heading [rad], shape (n, 3)."""
        points = [
            [round(n, DIGITS), round(e, DIGITS), round(float(np.degrees(h)), DIGITS)] for n, e, h in poses.tolist()
        ]
        path = ["[path]", 'kind = "points"', f"dwell_s = {STEP_S * self.scale[1]!r}", f"points = {json.dumps(points)}"]
        speed, acceleration = ([MARGIN * one for one in of] for of in (limits.speed, limits.acceleration))
        return self._scenario([*path, *controller_lines(self.profile, *self.scale, QUICK, speed, acceleration)])

    def twelve_corners(self, seconds: float) -> Scenario:
        """Return the twelve-corner trial at the vessel's scale, with the simulator's usual speeds, in a time [s]."""
        path = [
            "[path]",
            'kind = "twelve-corner"',
            f"dwell_s = {seconds / len(TWELVE_CORNER)!r}",
            f"size = {self.scale[0]!r}",
        ]
        return self._scenario([*path, *controller_lines(self.profile, *self.scale)])

    def steering(self, manoeuvre: Manoeuvre) -> Scenario:
        """Return the scenario of orders straight to the actuators."""
        return self._scenario(
            [
                "[manoeuvre]",
                f"kind = {json.dumps(manoeuvre.kind)}",
                f"speed_rpm = {manoeuvre.share * cruising(self.vessel)!r}",
                f"helm_deg = {manoeuvre.helm_deg!r}",
                f"heading_deg = {manoeuvre.heading_deg!r}",
                f"lead_s = {manoeuvre.lead_s!r}",
                f"hold_s = {manoeuvre.hold_s!r}",
                f"duration_s = {manoeuvre.duration_s!r}",
            ]
        )

    def _scenario(self, lines: Sequence[str]) -> Scenario:
        name = self.profile.name
        head = ['schema = "ferryid.scenario/1"', f'title = "Trial planned for {name}"', f"vessel = {json.dumps(name)}"]
        text = [*head, f"seed = {self.seed}", *lines, *equipment_lines(self.vessel, *self.scale)]
        return parse_scenario("\n".join(text) + "\n", f"{name}-plan.toml")

    def tells(self, scenario: Scenario, ends_s: Sequence[float]) -> tuple[list[Responses], Floats]:
        """Return what a trial tells in each of its parts, which end at these times [s], and the poses sailed, shape (n, 3)."""
        truth, control = sail(scenario, self.vessel, scenario.seed)
        streams = sense(scenario, self.vessel, scenario.seed, truth, control)
        log = self.folder / "trial.mcap"
        write_log(Simulation(scenario, scenario.seed, self.vessel, truth, control, streams), log, overwrite=True)
        seen = replace(reading(self.vessel, mapped(self.profile)), hull=self.profile.hull)
        return information(str(log), seen, self.keys, ends_s), truth.eta
