"""The oracle's size of an effect in a recording: what could be seen by one who knows everything but the size.

The oracle knows which effect it is, on which thruster, in which direction and from when on, and the noise of the recording as
it was; only the size is fitted, and the hull beside it within its prior. An effect that changes the whitened prediction errors
by ``d``, of which the hull takes up what it can, has the log-likelihood ratio ``|d|²/2`` on average. It exceeds the floor of
one parameter, which chance exceeds in `FALSE_SHARE` of the logs, 19 times in 20 where ``|d|`` is `SIGMAS`. Of ``d`` counts what
lies along what the library's own formula does: a load that is worked out from a measured motion has the noise of its
acceleration in it, which is no evidence of a load, and a record has its steps.
Sensors that err are seen in kinematics likewise, by the standard error of their parameter.

What moves the vessel less than a diagnosis reports is nothing that it is asked for: the size is at least so large. Doses are
multiples of it.

A diagnosis is not told the effect. The best that could be made of a recording by one who is not has the same evidence for the
effect over none, and beside it for the effect over each other one of the library, whose parameters it fits as well: a delay of
a tenth of a second does what a lag of a tenth of a second does. The effect is the likelier of two in `RELIABLE` of the logs
where what the other leaves of its deviation is `APART` long. Nor is such a one told what form the hull has that nobody
modelled: the evidence over none is what is left where any force of the motion is free, and in a campaign the current and the
wind of each log. Nor does one know how strong all actuators are together beside such a hull, as a factor on its masses and
damping does the same. That is the distinct size; the oracle's stays what doses are multiples of.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import inf, sqrt
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import norm

from ferryid.cached import cached_property
from ferryid.diagnose.data import read_measurements
from ferryid.diagnose.inference import INFERENCE, VAGUE, Candidate, EstimationProblem, fit, motion_responses
from ferryid.diagnose.judging import candidates_of, response_columns
from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.detection_curves import RELIABLE
from ferryid.validation.recorded.effects.effect import Concealment
from ferryid.validation.recorded.kinematic_sizes import SIGMAS
from ferryid.validation.recorded.log import RecordedLog, cached_log, cached_problem
from ferryid.validation.recorded.writing import write_log
from ferryid.validation.records import Key

ROUNDS = 6
"""Of the search for a size."""
CLOSE = 0.05
"""Relative accuracy of a size at which the search ends."""
FURTHEST = 30.0
"""Factor by which a step of the search changes the size at most."""
SMOOTHED = 9
"""Frequencies over which a spectrum is averaged."""
APART = float(2.0 * norm.ppf(RELIABLE))
"""Length of what another effect leaves of a deviation where the true one is the likelier of the two 19 times in 20.

The log-likelihood ratio is half the square on average, with the length as its standard deviation.
"""
SMALL = 0.1
"""Of the usual size of an effect, at which another one is looked at besides."""
SEARCHED = 4.0
"""How far beyond the largest size of an effect its oracle's is looked for, as a factor."""


@dataclass(frozen=True, eq=False)
class Baseline:
    """A recording as it was, for the oracle.

    Attributes
    ----------
    log, problem
        As read, and its estimation problem, with the noise that the hull alone leaves.
    """

    log: RecordedLog
    problem: EstimationProblem

    @cached_property
    def any_hull(self) -> Floats:
        """What the hull does to them within its prior, shape (w, n); of one that nobody modelled, any force of the motion."""
        slopes = self.problem.by_hull
        if self.log.profile.hull.is_known:
            return slopes
        return np.hstack([slopes, motion_responses(self.problem, fit(self.problem, ()))])

    @cached_property
    def responses(self) -> tuple[dict[Key, Floats], ...]:
        """What every effect does to them by each parameter of usual size, shape (w, parameters).

        Once as at that size, and once as at `SMALL` of it: a lag of a second does not look like ten of a tenth.
        """
        return tuple(_responses(self.problem, share) for share in (1.0, SMALL))


def _responses(problem: EstimationProblem, share: float) -> dict[Key, Floats]:
    """Return what every effect does by a share of its usual size, in whole ones."""
    some = [
        replace(one, parameters=tuple(replace(each, size=share * each.size) for each in one.parameters))
        for one in candidates_of(problem)
    ]
    found, columns = response_columns(problem, fit(problem, ()), some)
    made: dict[Key, list[Floats]] = {}
    for (key, _), column in zip(found.parameters, columns.T[len(found.hull_spread) :], strict=True):
        made.setdefault(key, []).append(column / share)
    return {key: np.column_stack(every) for key, every in made.items()}


@dataclass(frozen=True)
class Sizes:
    """Sizes of an effect in a recording.

    Attributes
    ----------
    oracle
        That the oracle names 19 times in 20; infinite where it is beyond all that is concealed.
    distinct
        From which one could who is not told which effect it is; where nobody could, as far as was looked.
    """

    oracle: float
    distinct: float


@cache
def cached_baseline(path: str, vessel: str) -> Baseline:
    """Return a log of a recording, whose responses are made once in a process."""
    return Baseline(cached_log(path, vessel), cached_problem(path, vessel))


def baselines(logs: Sequence[str], vessel: str) -> list[Baseline]:
    """Return the logs of a recording, read once in a process."""
    return [cached_baseline(path, vessel) for path in logs]


def sizes_in(
    one: Concealment,
    recording: Sequence[Baseline],
    truth_of: Callable[[float], Truth],
    before: Sequence[Baseline] = (),
) -> Sizes:
    """Return the oracle's size of an effect, and that from which it is distinct from all others.

    With logs before, in which it does not act, one who is not told which effect it is knows no more of the level that both
    groups share than of the hull.
    """

    def seen_by_all(one: Concealment, recording: Sequence[Baseline], truth: Truth) -> float:
        return distinctness(one, recording, truth, before)

    def seen_by_oracle(one: Concealment, recording: Sequence[Baseline], truth: Truth) -> float:
        return visibility(one, recording, truth, before)

    least = oracle_size(one, recording, truth_of, seen_by_oracle)
    kinematic = any(one.visible is not None and one.visible(base.log) is not None for base in recording)
    # Kinematics is fitted with all errors of the sensors at once.
    distinct = least if kinematic else max(least, oracle_size(one, recording, truth_of, seen_by_all))
    return Sizes(least, min(distinct, SEARCHED * one.sizes(recording[0].log)[1]))


def oracle_size(
    one: Concealment,
    recording: Sequence[Baseline],
    truth_of: Callable[[float], Truth],
    seen_as: Callable[[Concealment, Sequence[Baseline], Truth], float] | None = None,
) -> float:
    """Return the size of an effect that the oracle names 19 times in 20; infinite where it is beyond all that is concealed.

    Parameters
    ----------
    one
        The concealment.
    recording
        Its logs, which are a campaign where there are several.
    truth_of
        Returns the truth of a size, all else the same.
    seen_as
        How far a truth is beyond what is seen, 1 where it just is; `visibility` where None.
    """
    seen_as = seen_as or visibility
    measured = [] if one.visible is None else [one.visible(base.log) for base in recording]
    if seen_there := [size for size in measured if size is not None]:
        return min(seen_there)
    least, most = one.sizes(recording[0].log)
    size, power, before = sqrt(least * most), 1.0, (0.0, 0.0)
    for _ in range(ROUNDS):
        seen = seen_as(one, recording, truth_of(size))
        if abs(seen - 1.0) < CLOSE:
            break
        if before[1] > 0.0 and seen > 0.0 and size != before[0]:
            # A load grows with the size, or with its square.
            power = float(np.clip(np.log(seen / before[1]) / np.log(size / before[0]), 0.5, 3.0))
        step = FURTHEST if seen <= 0.0 else float(np.clip(seen ** (-1.0 / power), 1.0 / FURTHEST, FURTHEST))
        before, size = (size, seen), min(max(size * step, least), SEARCHED * most)
        if size == before[0]:
            return inf if seen < 1.0 else size
    return size


def visibility(one: Concealment, recording: Sequence[Baseline], truth: Truth, before: Sequence[Baseline] = ()) -> float:
    """Return how far an effect is beyond what an oracle sees, 1 where it just does.

    It is the smaller of two ratios: of the deviation in standard deviations to `SIGMAS`, and of what the vessel moves by it, or
    of its parameter, to the least that a diagnosis reports. Logs `before`, in which it does not act, share the hull.
    """
    change = _change(one, recording, truth)
    hull = np.vstack([base.problem.by_hull for base in (*recording, *before)])
    deviation = sqrt(2.0 * change.gain) if change.unsteady else _seen(change, before, hull)
    return min(deviation / SIGMAS, change.moved / INFERENCE.void_share, _over_least(one, truth))


def distinctness(
    one: Concealment, recording: Sequence[Baseline], truth: Truth, before: Sequence[Baseline] = ()
) -> float:
    """Return how far an effect is beyond what one sees who is not told which it is, 1 where it just shows.

    Of a random push the spectrum alone is known, which no other effect has: it is as distinct as it is visible.
    """
    change = _change(one, recording, truth)
    if change.unsteady:
        return visibility(one, recording, truth, before)
    logs = [*recording, *before]
    conditions = [*_conditions(logs, truth), *_strength(logs, truth, before, change)]
    # A level that both groups have in common.
    shown = before and any(truth.key in base.responses[0] for base in logs)
    common = [_stacked(logs, [base.responses[0] for base in logs], truth.key)] if shown else []
    alone = _seen(change, before, np.hstack([_of_any_hull(logs), *conditions, *common])) / SIGMAS
    known, beside = [np.vstack([base.problem.by_hull for base in logs]), *conditions, *common], inf
    none = [dict[Key, Floats]()] * len(before)
    for every in zip(*(base.responses for base in recording), strict=True):
        for key in {key for one in every for key in one} - {truth.key}:
            others = _stacked(logs, [*every, *none], key)
            beside = min(beside, _seen(change, before, np.hstack([*known, others])))
    return min(alone, beside / APART, change.moved / INFERENCE.void_share, _over_least(one, truth))


def _and_none(white: Floats, before: Sequence[Baseline]) -> Floats:
    """Return whitened changes of logs with those of logs before them, in which nothing changes."""
    return np.concatenate([white, *(np.zeros(len(base.problem.by_hull)) for base in before)])


def _strength(logs: Sequence[Baseline], truth: Truth, before: Sequence[Baseline], change: _Change) -> list[Floats]:
    """Return what a factor on the force of all actuators does, of any size, beside a hull that nobody modelled, all along.

    Logs before and a time before the effect began show that force as it was.
    """
    effect, profile = effects().get(truth.effect), logs[0].log.profile
    later = truth.onset_s is not None or truth.offset_s is not None
    if effect is None or not effect.scales or profile.hull.is_known or before or later:
        return []
    if len(profile.actuators) == 1:
        together = np.column_stack(change.formulas)
    else:
        every = (base.responses[0].items() for base in logs)
        each = [np.sum([columns[:, :1] for key, columns in one if key[0] == effect.id], axis=0) for one in every]
        together = np.vstack(each)
    return [together * (VAGUE / np.maximum(np.linalg.norm(together, axis=0), 1e-300))]


def _of_any_hull(recording: Sequence[Baseline]) -> Floats:
    """Return what a hull of any form does in all logs; forces that one has no motion for do nothing there."""
    most = max(base.any_hull.shape[1] for base in recording)
    return np.vstack([np.pad(base.any_hull, ((0, 0), (0, most - base.any_hull.shape[1]))) for base in recording])


def _conditions(recording: Sequence[Baseline], truth: Truth) -> list[Floats]:
    """Return the responses of conditions that each log of a campaign has of its own, every log's in columns of its own."""
    own = []
    rows = np.cumsum([0, *(len(base.problem.by_hull) for base in recording)])
    for base, first in zip(recording if len(recording) > 1 else (), rows.tolist(), strict=False):
        for (effect, instance), columns in base.responses[0].items():
            if effects()[effect].of_log and (effect, instance) != truth.key:
                every = np.zeros((int(rows[-1]), columns.shape[1]))
                every[first : first + len(columns)] = columns
                own.append(every)
    return own


def _stacked(recording: Sequence[Baseline], responses: Sequence[Mapping[Key, Floats]], key: Key) -> Floats:
    """Return the responses of an effect in all logs, shape (w, parameters); a log in which it does nothing has none."""
    most = max(one[key].shape[1] for one in responses if key in one)
    every = []
    for base, one in zip(recording, responses, strict=True):
        own = np.zeros((len(base.problem.by_hull), most))
        if key in one:
            own[:, : one[key].shape[1]] = one[key]
        every.append(own)
    return np.vstack(every)


@dataclass(frozen=True)
class _Change:
    """What an effect changes in a recording.

    Attributes
    ----------
    white
        Of the whitened prediction errors of all logs, shape (w,).
    gain
        Expected log-likelihood ratio of a random push, else 0.
    moved
        Acceleration by it over the measured one, of the channel where that is most.
    unsteady
        Whether it is a random push.
    formulas
        What the library's own effect does to the same, where it acts on the record as it was, and on the altered one; none of
        an effect that the library has not.
    """

    white: Floats
    gain: float
    moved: float
    unsteady: bool
    formulas: tuple[Floats, ...] = ()


def _change(one: Concealment, recording: Sequence[Baseline], truth: Truth) -> _Change:
    changed, moved, gain = list[Floats](), 0.0, 0.0
    formulas: list[list[Floats]] = []
    unsteady = truth.effect in effects() and effects()[truth.effect].unsteady is not None
    for base in recording:
        problem, as_it_was = base.problem, base.problem.plain
        if one.altered is not None:
            altered = one.altered(as_it_was, truth)
        else:
            parts = _parts(one, base.log, truth)
            more = resampled(parts - base.log.measurements.parts, base.log.measurements.t, as_it_was.measurements.t)
            altered = replace(as_it_was, parts=as_it_was.parts + more)
        by_step = problem.steps.gap(altered) - problem.steps.gap(as_it_was)
        white = problem.whitening_filter.white(by_step)
        gain += _gain_of_noise(white.reshape(by_step.shape)) if unsteady else 0.0
        changed.append(white)
        if not unsteady:
            formulas.append(_formulas(base, altered, truth))
        windows = problem.windows
        by_window = windows.gap(altered) - windows.gap(as_it_was)
        usual = np.sqrt(np.mean(windows.measured[:, windows.channels] ** 2, axis=0))
        moved = max(moved, float((np.sqrt(np.mean(by_window**2, axis=0)) / np.maximum(usual, 1e-12)).max()))
    together = tuple(np.concatenate(every) for every in zip(*formulas, strict=True))
    return _Change(np.concatenate(changed), gain, moved, unsteady, together)


def _formulas(base: Baseline, altered: ForceModel, truth: Truth) -> list[Floats]:
    """Return what the library's own effect does to the whitened prediction errors of a log, shape (w,) each.

    One that is far from linear, such as a delay of what changes fast, does to the altered record what undoes it, and another
    thing to the record as it was. A mass would take its share of the noise in the altered one along.
    """
    effect = effects().get(truth.effect)
    if effect is None:
        return []
    problem, profile = base.problem, base.log.profile
    candidate = replace(
        Candidate.of(effect, truth.instance, profile),
        onset_s=truth.onset_s or 0.0,
        offset_s=inf if truth.offset_s is None else truth.offset_s,
    )
    p = np.array([truth.values.get(one.name, one.neutral) for one in candidate.parameters])
    records = [problem.plain] if effect.changes_hull else [problem.plain, altered]
    return [problem.white(candidate.act(one, p)) - problem.white(one) for one in records]


def _parts(one: Concealment, log: RecordedLog, truth: Truth) -> Floats:
    """Return the actuators' forces that an altered record claims, as a diagnosis reads them, shape (n, k, 3)."""
    if one.parts is not None:
        return one.parts(log, truth)
    made = one.conceal(log, truth, np.random.default_rng(0))
    with TemporaryDirectory() as folder:
        return reread(write_log(made.log, Path(folder), "altered"), log)


def reread(path: Path, log: RecordedLog) -> Floats:
    """Return the actuators' forces of a log on the rows of another's measurements, shape (n, k, 3)."""
    again = read_measurements(str(path), log.profile)[0]
    return resampled(again.parts, again.t, log.measurements.t)


def resampled(parts: Floats, t: Floats, at: Floats) -> Floats:
    """Return forces, shape (n, k, 3) at times t [s], at other times, linear in between."""
    flat = parts.reshape(len(t), -1)
    return np.column_stack([np.interp(at, t, one) for one in flat.T]).reshape(len(at), *parts.shape[1:])


def _seen(change: _Change, before: Sequence[Baseline], slopes: Floats) -> float:
    """Return the length of an effect's deviation, less what others take up, as far as the library's formula has it."""
    white = _and_none(change.white, before)
    if not change.formulas:
        return _beside(white, slopes)
    return max(_along(white, _and_none(one, before), slopes) for one in change.formulas)


def _beside(changed: Floats, slopes: Floats) -> float:
    """Return the length of whitened changes, shape (w,), less what others take up within their prior; slopes shape (w, n)."""
    return sqrt(max(float(changed @ _left(changed, slopes)), 0.0))


def _along(changed: Floats, formula: Floats, slopes: Floats) -> float:
    """Return the length of whitened changes along what a formula does, shape (w,) each, less what others take up of both."""
    left = _left(formula, slopes)
    return abs(float(changed @ left)) / sqrt(max(float(formula @ left), 1e-300))


def _left(changed: Floats, slopes: Floats) -> Floats:
    """Return what others leave of whitened changes, shape (w,), within their prior of one; slopes shape (w, n)."""
    return np.asarray(
        changed - slopes @ np.linalg.solve(slopes.T @ slopes + np.eye(slopes.shape[1]), slopes.T @ changed)
    )


def _gain_of_noise(white: Floats) -> float:
    """Return the expected log-likelihood ratio of a random push of known spectrum, whitened, shape (steps, channels).

    By Whittle's likelihood: half a nat for each frequency and channel times ``s - log(1 + s)``, with s the ratio of its power
    to that of the noise, which is one.
    """
    power = np.abs(np.fft.rfft(white, axis=0)) ** 2 / len(white)
    kernel = np.ones(SMOOTHED) / SMOOTHED
    ratio = np.stack([np.convolve(one, kernel, mode="same") for one in power.T], axis=1)
    return float(np.sum(ratio - np.log1p(ratio)))


def _over_least(one: Concealment, truth: Truth) -> float:
    """Return by how much the largest parameter of an effect is over the least that is reported."""
    effect = effects().get(truth.effect)
    if effect is None or effect.negligible == 0.0:
        return inf
    neutral = one.neutral
    return (
        max(abs(value - neutral) for name, value in truth.values.items() if name not in one.positions)
        / effect.negligible
    )
