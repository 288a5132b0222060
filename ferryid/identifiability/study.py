"""What each set of sensors distinguishes on one simulated trial: the profile's own, and with each further sensor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from ferryid.diagnose.data import read_measurements, window_lengths
from ferryid.diagnose.inference import estimation_problem, fit, prior_force_model, windows
from ferryid.diagnose.judging import Key, Likeness, likeness, responses
from ferryid.errors import FerryIdError
from ferryid.identifiability.sensors import MEASURES, SENSORS, further, mapped, reading
from ferryid.identifiability.trial import Trial, usual_trial
from ferryid.simulate import write_log
from ferryid.simulate.sensors import sense
from ferryid.simulate.trial import Simulation, sail
from ferryid.types import no_progress
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class Assessment:
    """What a set of sensors distinguishes.

    Attributes
    ----------
    sensors
        Of `ferryid.identifiability.sensors.SENSORS`.
    likeness
        On the trial; None where these sensors show no force.
    measured
        Effects that a sensor measures.
    reason
        Why they show none; empty where they do.
    """

    sensors: frozenset[str]
    likeness: Likeness | None
    measured: tuple[str, ...] = ()
    reason: str = ""

    @property
    def apart(self) -> frozenset[Key]:
        """Effects that are visible and look like no other, or are measured."""
        known: set[Key] = {(effect, None) for effect in self.measured}
        if self.likeness is None:
            return frozenset()
        alike = {key for pair in self.likeness.alike for key in (pair.first, pair.second)}
        return frozenset(known | {one.key for one in self.likeness.effects if one.visible and one.key not in alike})

    @property
    def groups(self) -> tuple[tuple[Key, ...], ...]:
        """Effects that look alike, one with the next."""
        if self.likeness is None:
            return ()
        groups: list[set[Key]] = []
        for pair in self.likeness.alike:
            joined = {pair.first, pair.second}
            touched = [group for group in groups if group & joined]
            groups = [group for group in groups if not group & joined] + [joined.union(*touched)]
        return tuple(tuple(one.key for one in self.likeness.effects if one.key in group) for group in groups)

    @property
    def score(self) -> tuple[int, int]:
        """How much is distinguished: the number of effects, then that of pairs that look alike, of which fewer are better."""
        return len(self.apart), 0 if self.likeness is None else -len(self.likeness.alike)


@dataclass(frozen=True)
class Study:
    """What the sensors of a profile distinguish, and what each further one adds.

    Attributes
    ----------
    trial
        That was simulated.
    own
        With the sensors that the profile maps.
    with_further
        With one more each, the one that distinguishes most first.
    """

    trial: Trial
    own: Assessment
    with_further: tuple[tuple[str, Assessment], ...]

    @property
    def best(self) -> str | None:
        """The further sensor that distinguishes most; None where none adds to the profile's own."""
        if self.with_further and self.with_further[0][1].score > self.own.score:
            return self.with_further[0][0]
        return None


def study(profile: Profile, progress: Callable[[str], None] = no_progress) -> Study:
    """Simulate the usual trial of a vessel, and look at it with its sensors, and with one further each.

    Raises
    ------
    FerryIdError
        For a vessel that cannot be simulated.
    """
    trial = usual_trial(profile)
    progress("simulating the usual trial")
    scenario = trial.scenario
    truth, control = sail(scenario, trial.vessel, scenario.seed)
    streams = sense(scenario, trial.vessel, scenario.seed, truth, control)
    with TemporaryDirectory() as folder:
        log = Path(folder) / "trial.mcap"
        write_log(Simulation(scenario, scenario.seed, trial.vessel, truth, control, streams), log)
        there = mapped(profile)
        own = _assessed(log, profile, trial, there, progress)
        more = [(one, _assessed(log, profile, trial, there | {one}, progress)) for one in further(profile)]
    progress("")
    more.sort(key=lambda one: one[1].score, reverse=True)
    return Study(trial, own, tuple(more))


def _assessed(
    log: Path, profile: Profile, trial: Trial, sensors: frozenset[str], progress: Callable[[str], None]
) -> Assessment:
    """Return what a set of sensors distinguishes. Hull and its prior are the profile's own, whatever hull was simulated."""
    progress(f"looking at it with {len(sensors)} of {len(SENSORS)} sensors")
    measured = tuple(effect for name in SENSORS if name in sensors for effect in MEASURES.get(name, ()))
    known = replace(reading(trial.vessel, sensors), hull=profile.hull)
    try:
        measurements, _ = read_measurements(str(log), known)
    except FerryIdError as error:
        return Assessment(sensors, None, measured, str(error).rpartition(": ")[2])
    seen = windows(measurements, *window_lengths(known))
    problem = estimation_problem(seen, *prior_force_model(seen.measurements, known))
    return Assessment(sensors, likeness(responses(problem, fit(problem, ()))), measured)
