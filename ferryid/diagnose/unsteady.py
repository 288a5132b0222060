"""Disturbances that nobody measured and that come and go by chance: gusts and waves, as states of the filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, inf, log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.bands import fine_windows, spectrum_of
from ferryid.diagnose.evidence import force_errors
from ferryid.diagnose.filter import Filter, learn, learn_with, likelihood, stride_s
from ferryid.diagnose.hypothesis import Fit, Suspect, Trial, imagined
from ferryid.diagnose.judging.confidence_rules import Claim, Figures
from ferryid.diagnose.result import AXES, Estimate, Finding
from ferryid.diagnose.weak import Windows
from ferryid.effects.effect import Process
from ferryid.effects.picture import Picture, Scene
from ferryid.vessel.profile import Floats

WORTH = 12.0
"""Logarithm of the evidence that a disturbance must show before its states are as likely as none."""
STRENGTHS, BANDS = (0.3, 1.0), (0.5, 0.7, 1.0, 1.4, 2.0)
"""Where the search begins, as shares of the usual ones; from hardly anything nothing leads on."""
FASTEST = 0.4
"""Highest frequency that is believed, in steps of the filter; half of one is aliased."""
WIDEST = 9.0
"""Standard deviation of a logarithm beyond which nothing is known."""
ABOUT_PEAK = 0.1
"""Share of its peak's power down to which a disturbance is compared with the velocities: a navigation that smooths them shifts
a peak a little, and a narrow one then misses itself."""
VAGUE = 0.5
"""A disturbance whose parameters are known no better than within this factor (as a logarithm) was not seen."""

PASSED = 1e-2
"""Share of the power that windows must let through for a frequency to be shown."""


@dataclass(frozen=True)
class State:
    """A disturbance with its parameters, the standard deviations of their logarithms, and the evidence for it."""

    suspect: Suspect
    values: Floats
    widths: Floats
    gain: float

    @property
    def known(self) -> frozenset[str]:
        """Names of the parameters that the log tells."""
        named = zip(self.suspect.parameters, self.widths.tolist(), strict=True)
        return frozenset(one.name for one, width in named if width < VAGUE)

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Parameters with their 95 % intervals, which are even in the logarithm."""
        away = np.exp(1.96 * np.minimum(np.hypot(self.widths, self.suspect.effect.form), WIDEST))
        low, high = self.values / away, self.values * away
        return {
            one.name: Estimate(value, max(a, one.low), min(b, one.high), one.unit)
            for one, value, a, b in zip(
                self.suspect.parameters, self.values.tolist(), low.tolist(), high.tolist(), strict=True
            )
        }


def disturbed(
    trial: Trial,
    made: Fit,
    suspects: Sequence[Suspect],
    calm: Picture,
    least: float = WORTH,
    *,
    near: Sequence[State] = (),
) -> tuple[Trial, tuple[State, ...]]:
    """Return the trial with the disturbances in its filter that what a fit leaves speaks for, and these.

    Each is weighed by its likelihood, at its most likely parameters and noise, less Schwarz's penalty for its parameters.

    Parameters
    ----------
    trial
        Its filter is learnt anew.
    made
        What has been found.
    suspects
        Disturbances that the scene can show.
    calm
        The plain picture without any of them.
    least
        Evidence that the first of them must show: what else explains as much is looked at before it.
    near
        What they were beside another fit: where the search begins.
    """
    picture = imagined(trial.plain, made)
    steps = trial.excerpt
    gaps = steps.gap(picture)
    noise = learn(steps, gaps, trial.filter)
    before = {state.suspect.key: [state.values] for state in near}
    best = likelihood(noise, steps, gaps)
    states: list[State] = []
    left = list(suspects)
    while left:
        worth = WORTH if states else least
        tried = []
        for suspect in left:
            assert suspect.effect.unsteady is not None
            processes = suspect.effect.unsteady(picture)
            if not processes(_sizes(suspect)):
                continue
            places = before.get(suspect.key, _starts(suspect))
            begin = max(places, key=lambda one: _glance(steps, gaps, noise, processes(one), picture))
            price = 0.5 * len(begin) * log(len(steps.starts))
            told, values, widths, after = learn_with(
                steps, gaps, noise, processes, begin, picture, best + price + worth
            )
            gain = after - best - price
            if _seen(suspect, values, widths, stride_s(steps)):
                tried.append((gain, told, State(suspect, values, widths, gain), after))
        if not tried:
            break
        gain, told, state, after = max(tried, key=lambda one: one[0])
        if gain < worth:
            break
        noise, best = told, after
        states.append(state)
        left.remove(state.suspect)
    plain = calm
    for state in states:
        # On average, too, they may do something.
        plain = state.suspect.act(plain, state.values)
    return replace(trial.with_noise_of(made), filter=noise, plain=plain), tuple(states)


def _seen(suspect: Suspect, values: Floats, widths: Floats, step_s: float) -> bool:
    """Tell whether a disturbance is known: how fast it is, how strong on one axis at least, and its moment if it has one.

    A position's error in a narrow band looks like a force along it, but turns nothing; what is faster than the filter's steps
    was not seen by it; and waves slower than any sea are none.
    """
    band = np.array([parameter.unit == "Hz" for parameter in suspect.parameters])
    possible = all(one.low <= value <= one.high for one, value in zip(suspect.parameters, values.tolist(), strict=True))
    if not possible or (values[band] * step_s > FASTEST).any():
        return False
    strength = _strengths(suspect)
    turning = np.array([parameter.unit == "N·m" for parameter in suspect.parameters])
    return bool((widths[~strength | turning] < VAGUE).all() and (widths[strength] < VAGUE).any())


def _strengths(suspect: Suspect) -> NDArray[np.bool_]:
    return np.array([parameter.name.endswith("std") for parameter in suspect.parameters])


def _glance(steps: Windows, gaps: Floats, noise: Filter, processes: tuple[Process, ...], picture: Picture) -> float:
    return likelihood(Filter(noise.channels, (*noise.processes, *processes), picture), steps, gaps)


def _starts(suspect: Suspect) -> list[Floats]:
    """Return parameters to begin with: strengths, and frequencies where there is one, about the usual ones."""
    usual = _sizes(suspect)
    strength = _strengths(suspect)
    band = np.array([parameter.unit == "Hz" for parameter in suspect.parameters])
    bands = BANDS if band.any() else (1.0,)
    return [usual * np.where(strength, a, np.where(band, b, 1.0)) for a in STRENGTHS for b in bands]


def _sizes(suspect: Suspect) -> Floats:
    return np.array([parameter.size for parameter in suspect.parameters])


def disturbance_claims(trial: Trial, made: Fit, states: Sequence[State], scene: Scene) -> list[Claim]:
    """Return disturbances as findings; each pushes all along, on the axes on which it is strong against what is left over.

    Parameters
    ----------
    trial
        With the disturbances in its filter.
    made
        What else was found.
    states
        The disturbances.
    scene
        The log's scene at its full rate.
    """
    short = fine_windows(trial, scene)
    frequency, power = spectrum_of(short, force_errors(short, imagined(trial.plain, made), trial.plain))
    return [_claim(trial, state, short, frequency, power) for state in states]


def density(process: Process, frequency_hz: Floats) -> Floats:
    """Return the one-sided power spectral density of a disturbance's amplitude [1/Hz], shape (f,).

    The Fourier transform of its covariance, ``std² exp(-|t| / T) cos(2 pi f t)``: a peak at f and its mirror image at -f.
    """
    T, peak = process.time_constant_s, process.frequency_hz
    sides = [1.0 / (1.0 + (2.0 * np.pi * (frequency_hz + side * peak) * T) ** 2) for side in (-1.0, 1.0)]
    return np.asarray(2.0 * process.std**2 * T * (sides[0] + sides[1]))


def _columns(short: Windows, frequency: Floats, power: Floats, pushes: Sequence[Process], axis: int) -> dict[str, Any]:
    """Return `evidence` and `labels` of a disturbance: the spectrum of what is left over, and its own by its parameters."""
    if frequency.size < 2:
        return {}
    step_s = short.scene.step_s
    turns = np.exp(-2j * np.pi * np.outer(frequency, step_s * np.arange(len(short.weight))))
    passed = np.abs(turns @ short.weight * step_s) ** 2
    # A mean is no part of what comes and goes, and what the windows stop tells nothing.
    seen = (frequency > 0.0) & (passed > PASSED)
    pushed = sum(
        (np.mean(one.force[:, axis] ** 2) * density(one, frequency) for one in pushes), np.zeros_like(frequency)
    )
    kind, unit = ("moment", "(N·m)²/Hz") if axis == 2 else ("force", "N²/Hz")
    return {
        "evidence": {
            "frequency": frequency[seen],
            "before": (power[:, axis] / frequency[1])[seen],
            "explained": (passed * pushed)[seen],
        },
        "labels": {
            "residual": f"{AXES[axis]} {kind} left over [{unit}]",
            "regressor": "frequency [Hz]",
        },
    }


def _claim(trial: Trial, state: State, short: Windows, frequency: Floats, spectrum: Floats) -> Claim:
    scene = trial.windows.scene
    suspect = state.suspect
    assert suspect.effect.unsteady is not None
    parameters = {name: one for name, one in state.estimates.items() if name in state.known}
    picture = trial.filter.picture or trial.plain
    pushes = suspect.effect.unsteady(picture)(state.values)
    pushed = [np.mean((one.std * one.force) ** 2, axis=0) for one in pushes]
    # Newtons and newton metres compare as what they do to the vessel.
    arm = np.array([1.0, 1.0, np.sqrt(picture.hull[0] / picture.hull[4])])
    power = np.sum(pushed, axis=0) * arm**2
    values = {name: one.value for name, one in parameters.items()}
    shown = _columns(short, frequency, spectrum, pushes, int(np.argmax(power)))
    finding = Finding(
        effect=suspect.effect.id,
        instance=None,
        probability=1.0 / (1.0 + exp(min(WORTH - state.gain, 50.0))),
        parameters=parameters,
        axes=dict(zip(AXES, (power / power.sum()).tolist(), strict=True)),
        intervals=((float(scene.t[0]), float(scene.t[-1])),),
        onset_s=None,
        regime="",
        improvement={},
        held_out=False,
        rivals=(),
        unresolved_with=(),
        separating_manoeuvre=None,
        says=suspect.effect.says(values, None),
        **shown,
    )
    power_in_velocities = _power_in_velocities(shown["evidence"]) if shown else inf
    return Claim(finding, Figures("disturbance", power_in_velocities=power_in_velocities))


def _power_in_velocities(evidence: Mapping[str, Floats]) -> float:
    """Return the share of what a disturbance does about its peak that the velocities show.

    It was found in positions, whose errors in a narrow band look like a force; a force moves velocities as well.
    """
    strong = evidence["explained"] >= ABOUT_PEAK * evidence["explained"].max()
    return float(evidence["before"][strong].sum() / max(evidence["explained"][strong].sum(), 1e-300))
