"""The oracle: told which effect is in a log, of which thruster and since when, but not how large it is.

It is the limit that a diagnosis is measured against: nobody who has to find out what is in a log as well can need less of it.
It shares the filter, in which parameters and hull are fitted together, with the diagnosis, and leaves out everything that
guards a name: rivals, placebos, laws, thresholds of size. Its one question is whether the log is likelier with the effect than
without, the hull and the noise refitted in both.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from typing import Any

from scipy.stats import chi2

from ferryid.counts import counted
from ferryid.diagnose.checks import resteadied
from ferryid.diagnose.diagnose import FEWEST_WINDOWS
from ferryid.diagnose.hypothesis import Suspect, Trial, trial_of
from ferryid.diagnose.result import Estimate
from ferryid.diagnose.scene import plain_picture, scene_of, window_lengths
from ferryid.diagnose.weak import Windows, windows
from ferryid.effects import effects
from ferryid.effects.picture import Scene
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.prove.calibration import FALSE_SHARE
from ferryid.prove.case import Truth
from ferryid.prove.told_forces import weighed
from ferryid.prove.told_sensors import SENSED, Sensed, sensed
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class Recovered:
    """What the oracle makes of one effect that it was told.

    Attributes
    ----------
    effect, instance
        As told.
    gain
        Logarithm of the likelihood ratio of the log with it over without it, all else that was told in both [nats].
    free
        Parameters that were fitted for it.
    floor
        Gain that chance exceeds in `FALSE_SHARE` of logs if it has a chi-squared distribution; see
        `ferryid.prove.calibration` for what clean logs say.
    parameters
        By name, with 95 % intervals.
    cannot
        Why the log cannot show it; empty where it can.
    idle
        True where it is too small for a diagnosis to find it worth a name.
    """

    effect: str
    instance: str | None
    gain: float
    free: int
    floor: float
    parameters: dict[str, Estimate] = field(default_factory=dict)
    cannot: str = ""
    idle: bool = False

    @property
    def named(self) -> bool:
        """Whether the gain is more than the floor."""
        return self.gain > self.floor


@dataclass(frozen=True)
class Told:
    """What the oracle makes of a log: of everything together, and of each effect in the order in which they were told."""

    gain: float
    recovered: tuple[Recovered, ...]
    seconds: float

    @property
    def named(self) -> bool:
        """Whether all that was told is named."""
        return all(one.named for one in self.recovered)

    def as_json(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "gain": self.gain,
            "named": self.named,
            "seconds": self.seconds,
            "recovered": [
                {
                    **{key: value for key, value in vars(one).items() if key != "parameters"},
                    "named": one.named,
                    "parameters": {name: vars(estimate) for name, estimate in one.parameters.items()},
                }
                for one in self.recovered
            ],
        }


def oracle(log: str, profile: Profile, truths: Sequence[Truth]) -> Told:
    """Return what can be told of a log by somebody who knows what is in it, but not how large.

    Parameters
    ----------
    log
        Path; parts of one recording joined by ``+``.
    profile
        The vessel, as the diagnosis is given it.
    truths
        What is in the log: effects, instances and times are looked at, values never.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, and for effects that nobody knows.
    """
    start = time.perf_counter()
    _check(profile, truths)
    return replace(_told(_Log(scene_of(log, profile, None)[0]), truths), seconds=time.perf_counter() - start)


def oracle_of_each(log: str, profile: Profile, truths: Sequence[Truth]) -> Told:
    """Return the same of effects that are told one at a time, such as those that are not in a clean log, for calibration.

    What they gain together is nothing that means anything, and is left at 0.
    """
    start = time.perf_counter()
    _check(profile, truths)
    shared = _Log(scene_of(log, profile, None)[0])
    recovered = tuple(_told(shared, [one]).recovered[0] for one in truths)
    return Told(0.0, recovered, time.perf_counter() - start)


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
    """A log that several effects may be told of."""

    scene: Scene

    @cached_property
    def windows(self) -> Windows:
        return windows(self.scene, *window_lengths(self.scene.profile))

    @cached_property
    def trial(self) -> Trial:
        """The trial, with the noise that the hull alone leaves."""
        plain, spread = plain_picture(self.windows.scene, self.scene.profile)
        return trial_of(self.windows, plain, spread)

    @property
    def too_short(self) -> str:
        """Why nothing can be fitted; empty where it can."""
        found = len(self.windows.starts)
        return f"only {counted(found, 'stretch')} without a gap" if found < FEWEST_WINDOWS else ""


def _check(profile: Profile, truths: Sequence[Truth]) -> None:
    known = sorted({*effects(), *SENSED})
    for truth in truths:
        if truth.effect not in known:
            raise FerryIdError(
                f'oracle: no effect of the library is called "{truth.effect}".{did_you_mean(truth.effect, known)} '
                f"Fix: tell one of {', '.join(known)}"
            )
        effect = effects().get(truth.effect)
        places = (None,) if effect is None else effect.instances(profile)
        if truth.instance not in places:
            raise FerryIdError(
                f"oracle: {truth.effect} has no instance {truth.instance} on {profile.name}, which has "
                f"{', '.join(str(one) for one in places)}. Fix: tell one of these"
            )


def _told(log: _Log, truths: Sequence[Truth]) -> Told:
    """Return what is told of a log: errors of the sensors first, and the forces in what is right then."""
    found: dict[tuple[str, str | None], Recovered] = {}
    kinematic: dict[tuple[str, str | None], Sensed] = {}
    total, forces, scene = 0.0, list[Truth](), log.scene
    for truth in truths:
        if truth.effect not in SENSED:
            forces.append(truth)
            continue
        one = sensed(scene, truth.effect)
        # What position and velocity have in common, forces alone can tell: both are tried then.
        tries = 2 if truth.effect in effects() else 1
        sure = one.gain > floor_of(one.free, tries)
        if tries == 2 and not sure:
            kinematic[truth.key] = one
            forces.append(truth)
            continue
        found[truth.key] = Recovered(
            *truth.key, one.gain, one.free, floor_of(one.free, tries), dict(one.parameters), idle=one.idle
        )
        total += one.gain
        scene = one.correct(scene) if sure else scene
    if forces:
        right = log if scene is log.scene else _Log(resteadied(scene))
        gain, recovered = _of_forces(right, forces)
        total += gain
        for made in recovered:
            key = made.effect, made.instance
            found[key] = _better(made, kinematic.get(key))
    return Told(total, tuple(found[truth.key] for truth in truths), 0.0)


def _better(forces: Recovered, kinematic: Sensed | None) -> Recovered:
    """Return the better of what forces and kinematics tell of one effect, with the floor for two tries."""
    if kinematic is None:
        return forces
    floor = floor_of(forces.free, 2)
    if kinematic.gain > forces.gain:
        found = replace(forces, gain=kinematic.gain, floor=floor, parameters=dict(kinematic.parameters))
        return replace(found, idle=kinematic.idle)
    return replace(forces, floor=floor)


def _of_forces(log: _Log, truths: Sequence[Truth]) -> tuple[float, list[Recovered]]:
    """Return the gain of some effects of force together, and what each makes of the log, added last."""
    reasons = [log.too_short or effects()[truth.effect].cannot(log.scene) for truth in truths]
    made = [
        Recovered(truth.effect, truth.instance, 0.0, 0, floor_of(1), {}, reason)
        for truth, reason in zip(truths, reasons, strict=True)
        if reason
    ]
    able = [truth for truth, reason in zip(truths, reasons, strict=True) if not reason]
    if not able:
        return 0.0, made
    gain, told = weighed(log.trial, [_suspect(log.scene.profile, truth) for truth in able])
    for truth, one in zip(able, told, strict=True):
        parameters = dict(one.parameters)
        floor = floor_of(one.free)
        made.append(Recovered(truth.effect, truth.instance, one.gain, one.free, floor, parameters, idle=one.idle))
    return gain, made


def _suspect(profile: Profile, truth: Truth) -> Suspect:
    effect = effects()[truth.effect]
    onset_s = 0.0 if truth.onset_s is None else truth.onset_s
    offset_s = inf if truth.offset_s is None else truth.offset_s
    return Suspect(effect, truth.instance, effect.parameters_of(profile), onset_s, offset_s)
