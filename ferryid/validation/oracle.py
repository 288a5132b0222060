"""The oracle: an estimate of effects whose identity, thruster and times are known, but not their size.

It is the reference that a diagnosis is measured against, which has to find out the rest as well. It shares the filter in which
parameters and hull are fitted together with the diagnosis, and omits every confidence rule: rivals, placebos, regressions,
thresholds of size. It compares the likelihood of the log with and without the effect, hull and noise refitted in both.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf

from scipy.stats import chi2

from ferryid.cached import cached_property
from ferryid.counts import counted
from ferryid.diagnose.checks import refilter_velocity
from ferryid.diagnose.data import read_measurements, window_lengths
from ferryid.diagnose.inference import (
    INFERENCE,
    Candidate,
    EstimationProblem,
    Windows,
    estimation_problem,
    prior_force_model,
    windows,
)
from ferryid.effects import effects
from ferryid.effects.force_model import Measurements
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.validation.case import Truth
from ferryid.validation.oracle_calibration import FALSE_SHARE
from ferryid.validation.oracle_forces import force_gains
from ferryid.validation.oracle_sensors import SensorEstimate
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.records import OracleEstimate, OracleResult
from ferryid.vessel.profile import Profile


def oracle(
    log: str, profile: Profile, truths: Sequence[Truth], *, fewest_windows: int = INFERENCE.fewest_windows
) -> OracleResult:
    """Return the gain and size of effects that are known to be in a log.

    Parameters
    ----------
    log
        Path; parts of one recording joined by ``+``.
    profile
        The vessel, as the diagnosis is given it.
    truths
        What is in the log: effects, instances and times are used, values never.
    fewest_windows
        Of which forces can be estimated.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, and for unknown effects.
    """
    start = time.perf_counter()
    _check(profile, truths)
    made = _estimates(_Log(read_measurements(log, profile)[0], fewest_windows), truths)
    return replace(made, seconds=time.perf_counter() - start)


def oracle_of_each(log: str, profile: Profile, truths: Sequence[Truth]) -> OracleResult:
    """Return the same for each effect by itself, such as those that are not in a clean log, for calibration.

    There is no gain of them together: it is left at 0.
    """
    start = time.perf_counter()
    _check(profile, truths)
    shared = _Log(read_measurements(log, profile)[0])
    recovered = tuple(_estimates(shared, [one]).recovered[0] for one in truths)
    return OracleResult(0.0, recovered, time.perf_counter() - start)


def floor_of(free: int, tries: int = 1) -> float:
    """Return the gain that chance exceeds in `FALSE_SHARE` of logs: half of the chi-squared quantile (Wilks 1938).

    Parameters
    ----------
    free
        Parameters that are fitted.
    tries
        Estimators of which the better one is taken; by Bonferroni's inequality.
    """
    return 0.5 * float(chi2.isf(FALSE_SHARE / tries, max(free, 1)))


@dataclass(frozen=True)
class _Log:
    """A log in which several effects may be estimated."""

    measurements: Measurements
    fewest_windows: int = INFERENCE.fewest_windows

    @cached_property
    def windows(self) -> Windows:
        return windows(self.measurements, *window_lengths(self.measurements.profile))

    @cached_property
    def trial(self) -> EstimationProblem:
        """The trial, with the noise that the hull alone leaves."""
        plain, spread = prior_force_model(self.windows.measurements, self.measurements.profile)
        return estimation_problem(self.windows, plain, spread)

    @property
    def too_short(self) -> str:
        """Why nothing can be fitted; empty where it can."""
        found = len(self.windows.starts)
        return f"only {counted(found, 'overlapping window')} without a gap" if found < self.fewest_windows else ""


def _sensor_oracles() -> dict[str, Callable[[Measurements], SensorEstimate]]:
    """Return the estimates from kinematics alone, by effect."""
    return {name: one.oracle for name, one in plant_effects().items() if one.oracle is not None}


def _check(profile: Profile, truths: Sequence[Truth]) -> None:
    known = sorted({*effects(), *_sensor_oracles()})
    for truth in truths:
        if truth.effect not in known:
            raise FerryIdError(
                f'oracle: no effect of the library is called "{truth.effect}".{did_you_mean(truth.effect, known)} '
                f"Fix: give one of {', '.join(known)}"
            )
        effect = effects().get(truth.effect)
        places = (None,) if effect is None else effect.instances(profile)
        if truth.instance not in places:
            raise FerryIdError(
                f"oracle: {truth.effect} has no instance {truth.instance} on {profile.name}, which has "
                f"{', '.join(str(one) for one in places)}. Fix: give one of these"
            )


def _estimates(log: _Log, truths: Sequence[Truth]) -> OracleResult:
    """Return the estimates of a log: errors of the sensors first, and the forces in what is corrected then."""
    oracles = _sensor_oracles()
    found: dict[tuple[str, str | None], OracleEstimate] = {}
    kinematic: dict[tuple[str, str | None], SensorEstimate] = {}
    total, forces, measurements = 0.0, list[Truth](), log.measurements
    for truth in truths:
        if truth.effect not in oracles:
            forces.append(truth)
            continue
        one = oracles[truth.effect](measurements)
        # What position and velocity have in common, forces alone determine: both are tried then.
        tries = 2 if truth.effect in effects() else 1
        sure = one.gain > floor_of(one.free, tries)
        if tries == 2 and not sure:
            kinematic[truth.key] = one
            forces.append(truth)
            continue
        found[truth.key] = OracleEstimate(
            *truth.key, one.gain, one.free, floor_of(one.free, tries), dict(one.parameters), idle=one.idle
        )
        total += one.gain
        measurements = one.correct(measurements) if sure else measurements
    if forces:
        right = log if measurements is log.measurements else _Log(refilter_velocity(measurements), log.fewest_windows)
        gain, recovered = _of_forces(right, forces)
        total += gain
        for made in recovered:
            key = made.effect, made.instance
            found[key] = _better(made, kinematic.get(key))
    return OracleResult(total, tuple(found[truth.key] for truth in truths), 0.0)


def _better(forces: OracleEstimate, kinematic: SensorEstimate | None) -> OracleEstimate:
    """Return the estimate from forces or from kinematics that gains more, with the floor for two tries."""
    if kinematic is None:
        return forces
    floor = floor_of(forces.free, 2)
    if kinematic.gain > forces.gain:
        found = replace(forces, gain=kinematic.gain, floor=floor, parameters=dict(kinematic.parameters))
        return replace(found, idle=kinematic.idle)
    return replace(forces, floor=floor)


def _of_forces(log: _Log, truths: Sequence[Truth]) -> tuple[float, list[OracleEstimate]]:
    """Return the gain of some effects of force together, and what each makes of the log, added last."""
    reasons = [log.too_short or _cannot(log.measurements, truth) for truth in truths]
    made = [
        OracleEstimate(truth.effect, truth.instance, 0.0, 0, floor_of(1), {}, reason)
        for truth, reason in zip(truths, reasons, strict=True)
        if reason
    ]
    able = [truth for truth, reason in zip(truths, reasons, strict=True) if not reason]
    if not able:
        return 0.0, made
    gain, gains = force_gains(log.trial, [_suspect(log.measurements.profile, truth) for truth in able])
    for truth, one in zip(able, gains, strict=True):
        parameters = dict(one.parameters)
        floor = floor_of(one.free)
        made.append(OracleEstimate(truth.effect, truth.instance, one.gain, one.free, floor, parameters, idle=one.idle))
    return gain, made


def _cannot(measurements: Measurements, truth: Truth) -> str:
    effect = effects()[truth.effect]
    return effect.cannot(measurements) or effect.cannot_be_of(measurements, truth.instance)


def _suspect(profile: Profile, truth: Truth) -> Candidate:
    effect = effects()[truth.effect]
    onset_s = 0.0 if truth.onset_s is None else truth.onset_s
    offset_s = inf if truth.offset_s is None else truth.offset_s
    return Candidate(effect, truth.instance, effect.parameters_of(profile), onset_s, offset_s)
