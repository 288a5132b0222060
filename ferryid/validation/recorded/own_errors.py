"""What a recording has by itself of the errors that are concealed in it, below what a diagnosis names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ferryid.diagnose.checks import sensor_errors
from ferryid.diagnose.inference import Candidate, fit
from ferryid.effects import effects
from ferryid.validation.recorded.case_sampling import logs_of
from ferryid.validation.recorded.effects import SENSOR, concealments
from ferryid.validation.recorded.log import RecordedLog, cached_problem
from ferryid.validation.recorded.manifest import Recording
from ferryid.validation.records import Key

OwnErrors = Mapping[tuple[str, str], Mapping[str, float]]
"""Recording and effect to the parameters that the checks estimate in the recording as it was."""


OwnForces = Mapping[tuple[str, Key], float]
"""Recording, effect and thruster to the parameter that a fit to the recording as it was has."""


def own_forces(recordings: Sequence[Recording], used: Iterable[tuple[str, Key]]) -> OwnForces:
    """Return how much recordings as they were have of effects that forces show by one parameter, however little it is.

    Parameters
    ----------
    recordings
        Logs, or campaigns, of which the mean counts. Of two groups both have as much of it.
    used
        Recordings, and effects with their thrusters, that are wanted.
    """
    by_name = {one.name: one for one in recordings if not one.before}
    made = dict[tuple[str, Key], float]()
    for name, (effect, instance) in used:
        recording, known = by_name.get(name), effects().get(effect)
        if recording is None or known is None:
            continue
        logs = logs_of(recording)
        candidate = Candidate.of(known, instance, logs[0].profile)
        visible = concealments()[effect].visible
        if len(candidate.parameters) != 1 or any(visible is not None and visible(log) is not None for log in logs):
            continue
        problems = [cached_problem(path, recording.vessel) for path in recording.logs]
        made[name, (effect, instance)] = float(np.mean([fit(one, (candidate,)).values[0][0] for one in problems]))
    return made


def own_errors(recordings: Sequence[Recording], used: Iterable[tuple[str, str]]) -> OwnErrors:
    """Return the sensor errors of recordings as they were, as the same checks estimate them however small they are.

    Noise of the measurement is in them as it is in what is found after an error was concealed.

    Parameters
    ----------
    recordings
        Logs, or campaigns, of which the mean counts.
    used
        Recordings and effects that are wanted; effects of other families than sensors have no such estimate.
    """
    wanted = {key for key in used if concealments()[key[1]].family == SENSOR}
    made = dict[tuple[str, str], Mapping[str, float]]()
    for recording in recordings:
        # Of two groups each has them.
        effects = {effect for name, effect in wanted if name == recording.name and not recording.before}
        if effects:
            found = [_errors(log) for log in logs_of(recording)]
            made |= {(recording.name, effect): _mean([one.get(effect, {}) for one in found]) for effect in effects}
    return made


def _errors(log: RecordedLog) -> dict[str, dict[str, float]]:
    return {
        effect: {name: one.value for name, one in parameters.items()}
        for effect, parameters in sensor_errors(log.measurements).items()
    }


def _mean(some: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return the mean of each parameter over the logs that have it."""
    names = {name for one in some for name in one}
    return {name: float(np.mean([one[name] for one in some if name in one])) for name in sorted(names)}
