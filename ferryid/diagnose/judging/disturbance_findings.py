"""Disturbances that come and go by chance, as findings with their figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import exp, inf
from typing import Any

import numpy as np

from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fit, fitted_force_model
from ferryid.diagnose.inference.force_errors import force_errors
from ferryid.diagnose.inference.spectra import fine_windows, spectrum_of
from ferryid.diagnose.inference.stages import SelectedLog
from ferryid.diagnose.inference.stochastic_disturbance import DisturbanceState, fit_disturbances
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging.claims import Claim, Figures
from ferryid.diagnose.judging.credibility import value_doubt
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.effect import Process
from ferryid.effects.force_model import Measurements
from ferryid.types import AXES, Floats


def explained_by(log: SelectedLog, made: Fit, state: DisturbanceState) -> str:
    """Return the id of the likeliest other effect, where nothing is left of a disturbance beside it; empty where something is.

    Such an effect is not among the findings, as it is too small to matter or a placebo does as well: a delay of a fiftieth of a
    second leaves errors that come and go with the motion, as gusts do.

    Parameters
    ----------
    log
        With its disturbances.
    made
        What else was found.
    state
        One of the disturbances.
    """
    problem, taken = log.estimated.problem, made.keys
    likely = [one for one in log.search.rounds[-1].ranked if one.gain > INFERENCE.prior_odds]
    for one in [one for one in likely if one.candidate.key not in taken][:1]:
        both = fit(problem, (*made.candidates, one.candidate), (*made.values, one.fit.values[-1]))
        _, left = fit_disturbances(problem, both, [state.candidate], problem.plain, initial=[state])
        if not left:
            return one.candidate.effect.id
    return ""


def disturbance_claims(
    problem: EstimationProblem,
    made: Fit,
    states: Sequence[DisturbanceState],
    measurements: Measurements,
    explained: Sequence[str] = (),
) -> list[Claim]:
    """Return disturbances as findings; each pushes all along, on the axes on which it is strong against what is left over.

    Parameters
    ----------
    problem
        With the disturbances in its filter.
    made
        What else was found.
    states
        The disturbances.
    measurements
        The log's measurements at its full rate.
    explained
        By what each is explained as well (`explained_by`); by nothing where empty.
    """
    short = fine_windows(problem, measurements)
    errors = force_errors(short, fitted_force_model(problem.plain, made), problem.plain)
    claims = []
    for state, other in zip(states, explained or [""] * len(states), strict=True):
        acts = _while_acting(short, state)
        claim = _claim(problem, state, acts, *spectrum_of(acts, errors))
        claims.append(replace(claim, figures=replace(claim.figures, explained_by=other)))
    return claims


def _while_acting(short: Windows, state: DisturbanceState) -> Windows:
    """Return windows of which only those within the span of a disturbance belong to a series."""
    if not state.course.ends:
        return short
    times = short.middle_s
    first = int(np.searchsorted(times, state.course.onset_s))
    end = int(np.searchsorted(times, state.course.offset_s))
    runs = [(max(a, first), min(b, end)) for a, b in short.runs]
    return replace(short, runs=tuple((a, b) for a, b in runs if b > a))


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
    step_s = short.measurements.step_s
    turns = np.exp(-2j * np.pi * np.outer(frequency, step_s * np.arange(len(short.weight))))
    passed = np.abs(turns @ short.weight * step_s) ** 2
    # A mean is no part of what comes and goes, and what the windows stop tells nothing.
    transmitted = (frequency > 0.0) & (passed > JUDGING.passed_power)
    pushed = sum(
        (np.mean(one.force[:, axis] ** 2) * density(one, frequency) for one in pushes), np.zeros_like(frequency)
    )
    kind, unit = ("moment", "(N·m)²/Hz") if axis == 2 else ("force", "N²/Hz")
    return {
        "evidence": {
            "frequency": frequency[transmitted],
            "before": (power[:, axis] / frequency[1])[transmitted],
            "explained": (passed * pushed)[transmitted],
        },
        "labels": {
            "residual": f"{AXES[axis]} {kind} left over [{unit}]",
            "regressor": "frequency [Hz]",
        },
    }


def _claim(
    problem: EstimationProblem, state: DisturbanceState, short: Windows, frequency: Floats, spectrum: Floats
) -> Claim:
    measurements = problem.windows.measurements
    candidate = state.candidate
    assert candidate.effect.unsteady is not None
    parameters = {**{name: one for name, one in state.estimates.items() if name in state.known}, **state.times}
    force_model = problem.filter.force_model or problem.plain
    pushes = candidate.effect.unsteady(force_model)(state.values)
    pushed = [np.mean((one.std * one.force) ** 2, axis=0) for one in pushes]
    # Newtons and newton metres compare as what they do to the vessel.
    arm = np.array([1.0, 1.0, np.sqrt(force_model.hull[0] / force_model.hull[4])])
    power = np.sum(pushed, axis=0) * arm**2
    values = {name: one.value for name, one in parameters.items()}
    first, last = float(measurements.t[0]), float(measurements.t[-1])
    onset, offset = (state.times[name].value if name in state.times else None for name in ("onset", "offset"))
    shown = _columns(short, frequency, spectrum, pushes, int(np.argmax(power)))
    finding = Finding(
        effect=candidate.effect.id,
        instance=None,
        probability=1.0 / (1.0 + exp(min(INFERENCE.disturbance_gain - state.gain, 50.0))),
        parameters=parameters,
        axes=dict(zip(AXES, (power / power.sum()).tolist(), strict=True)),
        intervals=((first if onset is None else onset, last if offset is None else offset),),
        onset_s=onset,
        offset_s=offset,
        says=candidate.effect.says(values, None),
        **shown,
    )
    power_in_velocities = _power_in_velocities(shown["evidence"]) if shown else inf
    doubt = value_doubt(candidate.effect, candidate.parameters, values, measurements.profile)
    return Claim(
        finding,
        Figures(
            "disturbance",
            power_in_velocities=power_in_velocities,
            gain=state.gain,
            gain_in_velocities=state.gain_in_velocities,
            loss_in_velocities=state.loss_in_velocities,
            seen_twice=measurements.seen_twice(int(np.argmax(power))),
            cycles=_cycles(state, pushes),
            doubt=doubt,
        ),
    )


def _cycles(state: DisturbanceState, pushes: Sequence[Process]) -> float:
    """Return how many of its periods a disturbance lasts for; infinite for one that has none, or acts throughout."""
    highest = max((one.frequency_hz for one in pushes), default=0.0)
    return inf if highest == 0.0 else (state.course.offset_s - state.course.onset_s) * highest


def _power_in_velocities(evidence: Mapping[str, Floats]) -> float:
    """Return the share of what a disturbance does about its peak that the velocities show.

    It was found in positions, whose errors in a narrow band look like a force; a force moves velocities as well.
    """
    strong = evidence["explained"] >= JUDGING.peak_share * evidence["explained"].max()
    return float(evidence["before"][strong].sum() / max(evidence["explained"][strong].sum(), 1e-300))
