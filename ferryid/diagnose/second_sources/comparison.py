"""One further signal against the mapped one: what it seems to be, how well both agree, and each difference that is certain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import degrees, isfinite, sqrt

import numpy as np
from scipy.special import stdtrit

from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.second_sources.candidates import Candidate
from ferryid.diagnose.second_sources.explanations import (
    KINDS,
    describe_angle,
    describe_bias,
    describe_delay,
    describe_heading_bias,
    describe_lag,
    describe_place,
    describe_quarter_turn,
    describe_reversed_sign,
    describe_scale,
    describe_steps,
    describe_wraps,
)
from ferryid.diagnose.second_sources.first_guess import Guess, axes_of, first_guess, nearest_unit
from ferryid.diagnose.second_sources.fit import ANGLE, BIAS, BIAS_2, LATE, SCALE, Fitted, X, Y, fit
from ferryid.diagnose.second_sources.pairs import PSI, Pair, pair_of
from ferryid.diagnose.second_sources.samples import Samples
from ferryid.diagnose.second_sources.thresholds import SECOND
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats
from ferryid.vessel.frames import wrap

KINDS_TRIED = ("yaw_rate", "heading", "speed")
"""What a column without a telling name is compared with."""
UNITS = {"position": "m", "velocity": "m/s", "speed": "m/s", "yaw_rate": "deg/s", "heading": "deg"}
ALIGNMENTS = 3
_ALIGNED_S = 0.05
_SAME = 1e-9
NORMAL_95 = 1.96
BLOCKS_S = (30.0, 60.0, 120.0, 240.0, 480.0)
"""Lengths of blocks whose means show how certain a bias is."""


@dataclass(frozen=True)
class Difference:
    """One certain difference between a signal and the mapped one.

    Attributes
    ----------
    what
        ``"scale"``, ``"sign"``, ``"angle"``, ``"place"`` (of two components x and y), ``"delay"``, ``"lag"``, ``"bias"``,
        ``"drift"``, ``"steps"`` or ``"wraps"``.
    parameters
        By name, with 95 % intervals; empty of a sign.
    says
        What it is and what would explain it, as a phrase.
    """

    what: str
    parameters: Mapping[str, Estimate]
    says: str


@dataclass(frozen=True)
class Comparison:
    """A further signal beside the mapped one.

    Attributes
    ----------
    candidate
        Where it is.
    kind
        What it seems to be.
    axes, unit
        Directions of its axes, and its unit where that is not SI; empty where usual or not known.
    share
        What both have in common, of the variance in windows of some seconds.
    scatter
        Robust standard deviation of the difference after correction, in `scatter_unit`.
    differences
        Those that are certain.
    logs, windows
        What was compared.
    clock
        ``"stamp"`` or ``"receive"``: what its times are.
    follows
        False where it has less than half of its variance in common with the mapped signal.
    same
        True where it repeats the mapped signal.
    fitted
        Values and errors of all parameters.
    """

    candidate: Candidate
    kind: str
    axes: str
    unit: str
    share: float
    scatter: float
    scatter_unit: str
    differences: tuple[Difference, ...]
    logs: int
    windows: int
    clock: str
    follows: bool = True
    same: bool = False
    estimates: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def says(self) -> str:
        """All of it in one sentence."""
        what = KINDS[self.kind]
        frame = f" ({self.axes})" if self.axes else ""
        if not self.follows:
            common = f"has {100.0 * self.share:.0f} % of its variance in common with the mapped one"
            return f"{self.candidate.label}: by its name a {what}, and {common}."
        if self.same:
            return f"{self.candidate.label}: repeats the mapped {what}{frame}."
        differences = "; ".join(one.says for one in self.differences) or "agrees with the mapped one"
        left = f"; scatter {self.scatter:.2g} {self.scatter_unit}" if isfinite(self.scatter) else ""
        return f"{self.candidate.label}: {what}{frame}, {differences}{left}."

    @property
    def agrees(self) -> bool:
        """Whether both measure the same, to within scatter."""
        return self.follows and not self.differences


def compare(one: Candidate, samples: Sequence[tuple[Samples, Measurements]], length_m: float) -> Comparison | None:
    """Compare a signal, recorded in some logs, with the mapped one of its kind.

    Returns
    -------
    Comparison or None
        None where too much of either is missing, and for a column without a telling name that follows nothing.
    """
    if one.kind != "unknown":
        return _compare(one, one.kind, samples, length_m)
    found = []
    for kind in KINDS_TRIED:
        pairs = _pairs(samples, kind, 0.0)
        guess = first_guess(kind, pairs) if pairs else None
        if (
            guess is not None
            and guess.share >= SECOND.recognised
            and abs(guess.late_s) <= SECOND.recognised_delay_s
            and (kind != "speed" or guess.setting.gain.real > 0.0)
        ):
            found.append((guess.share, kind))
    return _compare(one, max(found)[1], samples, length_m) if found else None


def _pairs(samples: Sequence[tuple[Samples, Measurements]], kind: str, late_s: float) -> list[Pair]:
    pairs = [pair_of(one, measured, kind, late_s) for one, measured in samples]
    return [pair for pair in pairs if pair is not None and len(pair.spans.starts)]


def _compare(
    one: Candidate, kind: str, samples: Sequence[tuple[Samples, Measurements]], length_m: float
) -> Comparison | None:
    pairs = _pairs(samples, kind, 0.0)
    if sum(len(pair.spans.starts) for pair in pairs) < SECOND.fewest_windows:
        return None
    guess = first_guess(kind, pairs)
    if guess is None:
        return None
    first = samples[0][0]
    base = Comparison(
        one, kind, "", "", guess.share, float("nan"), UNITS[kind], (), len(pairs), sum(len(p.spans.starts) for p in pairs),
        first.clock, follows=False,
    )  # fmt: skip
    if guess.share < SECOND.follows:
        return base
    late, fitted = guess.late_s, None
    for _ in range(ALIGNMENTS):
        pairs = _pairs(samples, kind, late)
        fitted = fit(guess.setting, pairs, length_m, delayed=late != 0.0) if pairs else None
        if fitted is None:
            return replace(base, follows=guess.share >= SECOND.follows, axes=axes_of(guess.setting), unit=guess.unit)
        if abs(fitted.values[LATE]) < _ALIGNED_S:
            break
        late += float(fitted.values[LATE])
    assert fitted is not None
    lagging = _with_lag(guess, fitted, _pairs(samples, kind, 0.0), length_m)
    if lagging is not None:
        late, fitted, guess = 0.0, lagging, replace(guess, setting=replace(guess.setting, filtered=True))
    scale = degrees(1.0) if kind in ("yaw_rate", "heading") else 1.0
    size = float(np.std(np.concatenate([np.abs(guess.setting.signal(pair))[pair.good] for pair in pairs])))
    differences = _differences(guess, fitted, late, pairs, [entry for entry, _ in samples], scale)
    return replace(
        base,
        axes=axes_of(guess.setting),
        unit=guess.unit or first.unit * (first.unit == "deg"),
        share=fitted.share,
        scatter=fitted.scatter * scale,
        differences=differences,
        follows=True,
        same=not differences and fitted.scatter <= _SAME * max(size, 1e-12),
        windows=fitted.windows,
        estimates=_estimates(guess, fitted, late, differences),
    )


def _with_lag(guess: Guess, delayed: Fitted, pairs: Sequence[Pair], length_m: float) -> Fitted | None:
    """Return what lies between the signals where one of them is filtered, None where a delay does as well."""
    if not delayed.active[LATE] and guess.late_s == 0.0:
        return None
    lagging = fit(replace(guess.setting, filtered=True), pairs, length_m)
    if lagging is None or not lagging.certain(LATE) or abs(lagging.values[LATE]) < SECOND.least_lag_s:
        return None
    return lagging if 1.0 - lagging.share < SECOND.better_lag * (1.0 - delayed.share) else None


def _estimates(
    guess: Guess, fitted: Fitted, late: float, differences: Sequence[Difference]
) -> dict[str, tuple[float, float]]:
    """Return factor, delay, bias and sign with their standard errors: what can be held against those of a third sensor."""
    found = {}
    for name, index, more, size in (("scale", SCALE, 0.0, abs(guess.setting.gain)), ("delay", LATE, late, 1.0)):
        one = fitted.estimate(index)
        if one is not None:
            found[name] = (size * one[0] + more, size * one[1])
    if guess.setting.kind in ("yaw_rate", "heading"):
        found["sign"] = (float(np.sign(guess.setting.gain.real)), 0.0)
        bias = next((one.parameters["bias"] for one in differences if one.what == "bias"), None)
        if bias is not None:
            found["bias"] = (bias.value, (bias.high - bias.low) / (2.0 * NORMAL_95))
    return found


def _differences(
    guess: Guess, fitted: Fitted, late: float, pairs: Sequence[Pair], samples: Sequence[Samples], unit: float
) -> tuple[Difference, ...]:
    found = []
    kind = guess.setting.kind
    if kind in ("yaw_rate", "heading") and guess.setting.gain.real < 0.0:
        found.append(Difference("sign", {}, describe_reversed_sign(kind)))
    scale = _scale(guess, fitted)
    if scale is not None:
        found.append(scale)
    if fitted.certain(ANGLE):
        value, low, high = (degrees(one) for one in fitted.interval(ANGLE))
        angle = Estimate(value, low, high, "deg")
        found.append(Difference("angle", {"angle": angle}, describe_angle(angle)))
    if fitted.certain(X) or fitted.certain(Y):
        x, y = (Estimate(*fitted.interval(index), "m") for index in (X, Y))
        found.append(Difference("place", {"x": x, "y": y}, describe_place(x, y)))
    delay = _delay(fitted, late)
    if delay is not None:
        found.append(delay)
    if kind == "heading":
        found += _heading_bias(guess, fitted, late, pairs)
    else:
        found += _bias(guess, fitted, unit)
    found += _of_values(guess, fitted, samples, unit)
    return tuple(found)


def _scale(guess: Guess, fitted: Fitted) -> Difference | None:
    certain = fitted.certain(SCALE)
    if not guess.unit and guess.known and not certain:
        return None
    size = abs(guess.setting.gain)
    factor = _scaled(fitted.interval(SCALE), size, "-")
    rest = Estimate(*fitted.interval(SCALE), "-") if certain and guess.unit else None
    # What looked like no unit at first may turn out to be near one.
    near = "" if guess.unit else nearest_unit(factor.value, guess.setting.kind)
    return Difference("scale", {"factor": factor}, describe_scale(factor, guess.unit, rest, near))


def _scaled(interval: tuple[float, float, float], scale: float, unit: str) -> Estimate:
    value, low, high = interval
    return Estimate(scale * value, scale * low, scale * high, unit)


def _delay(fitted: Fitted, late: float) -> Difference | None:
    found = fitted.estimate(LATE)
    if found is None or (late == 0.0 and not fitted.certain(LATE)):
        return None
    value, error = late + found[0], found[1]
    freedom = fitted.one.freedom
    if abs(value) <= float(stdtrit(freedom, 1.0 - 0.5 * CHECKS.false_alarm)) * error:
        return None
    reach = float(stdtrit(freedom, 0.975)) * error
    delay = Estimate(value, value - reach, value + reach, "s")
    if fitted.filtered:
        return Difference("lag", {"time_constant": delay}, describe_lag(delay))
    return Difference("delay", {"delay": delay}, describe_delay(delay))


def _bias(guess: Guess, fitted: Fitted, unit: float) -> list[Difference]:
    vector = guess.setting.kind in ("position", "velocity")
    indices = (BIAS, BIAS_2) if vector else (BIAS,)
    if not any(fitted.certain(index) for index in indices):
        return []
    names = (("north", "east") if guess.setting.world else ("forward", "starboard")) if vector else ("bias",)
    what = "drift" if guess.setting.kind == "position" else "bias"
    shown = "deg/s" if guess.setting.kind == "yaw_rate" else "m/s"
    values = {name: _scaled(fitted.interval(index), unit, shown) for name, index in zip(names, indices, strict=True)}
    return [Difference(what, values, describe_bias(values, what))]


def _heading_bias(guess: Guess, fitted: Fitted, late: float, pairs: Sequence[Pair]) -> list[Difference]:
    """Return the constant difference of a heading, quarter turns taken as axes."""
    sign = 1.0 if guess.setting.gain.real > 0.0 else -1.0
    parts, around = [], []
    for pair in pairs:
        away = pair.other[:, 0] - sign * pair.mapped[:, PSI]
        around.append(np.exp(1j * away[pair.good]).mean())
    middle = float(np.angle(sum(around)))
    for pair in pairs:
        away = np.where(pair.good, wrap(pair.other[:, 0] - sign * pair.mapped[:, PSI] - middle), np.nan)
        parts.append(away)
    found = _mean(parts, pairs[0].spans.step_s)
    if found is None:
        return []
    value, error, freedom = found
    error = sqrt(error**2 + SECOND.axis_rad**2)
    quarter = round((middle + value) / (0.5 * np.pi))
    rest = float(wrap(np.array([middle + value - 0.5 * np.pi * quarter]))[0])
    if abs(rest) > CHECKS.gross:
        quarter, rest = 0, float(wrap(np.array([middle + value]))[0])
    result = []
    if quarter % 4:
        result.append(Difference("sign", {}, describe_quarter_turn(quarter % 4, sign)))
    if abs(rest) > float(stdtrit(freedom, 1.0 - 0.5 * CHECKS.false_alarm)) * error:
        reach = float(stdtrit(freedom, 0.975)) * error
        low, value, high = sorted(degrees(sign * (rest + more)) for more in (-reach, 0.0, reach))
        bias = Estimate(value, low, high, "deg")
        result.append(Difference("bias", {"bias": bias}, describe_heading_bias(bias)))
    return result


def _mean(parts: Sequence[Floats], step_s: float) -> tuple[float, float, int] | None:
    """Return mean, standard error and freedom of a difference that may wander: the largest over blocks of several lengths."""
    whole = np.concatenate(parts)
    known = np.isfinite(whole)
    if not known.any():
        return None
    worst, freedom = 0.0, 0
    for length_s in BLOCKS_S:
        rows = max(1, round(length_s / step_s))
        means = []
        for part in parts:
            for block in (part[k : k + rows] for k in range(0, len(part), rows)):
                if np.count_nonzero(np.isfinite(block)) >= rows // 2:
                    means.append(float(np.nanmean(block)))
        if len(means) < 4:
            break
        error = float(np.std(means, ddof=1)) / sqrt(len(means))
        if error >= worst:
            worst, freedom = error, len(means) - 1
    if freedom == 0:
        return None
    return float(whole[known].mean()), worst, freedom


def _of_values(guess: Guess, fitted: Fitted, samples: Sequence[Samples], unit: float) -> list[Difference]:
    """Return what values show by themselves: a coarse resolution, and angles interpolated through a wrap."""
    found = []
    quantum = float(max(one.quantum.max(initial=0.0) for one in samples)) / abs(guess.setting.gain)
    if quantum / sqrt(12.0) > SECOND.coarse * fitted.scatter and quantum > 0.0:
        step = unit * quantum
        name = UNITS[guess.setting.kind]
        found.append(Difference("steps", {"step": Estimate(step, step, step, name)}, describe_steps(step, name)))
    wraps = sum(one.wraps for one in samples)
    if wraps:
        found.append(Difference("wraps", {"samples": Estimate(wraps, wraps, wraps, "-")}, describe_wraps(wraps)))
    return found
