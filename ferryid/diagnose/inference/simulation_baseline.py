"""A recording against a simulation of it: the simulation's force model of the trial, learnt from its log, is the base.

The simulated log is data like any other, of a world that is the simulator's. What its hull and its conditions are is found in
the weak form as it would be for a recording, and put into the force model of the recording: what the diagnosis then finds is
the difference. An effect that the simulation has already has the simulation's values for its neutral ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import inf, isfinite
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.checks import examine
from ferryid.diagnose.checks.check import SensorFinding
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.data.measurements import read_measurements, window_lengths
from ferryid.diagnose.data.path_comparison import PathComparison
from ferryid.diagnose.data.payload import aboard
from ferryid.diagnose.inference.estimation import Candidate, estimation_problem, fitted_force_model
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.search import list_candidates, search
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import windows
from ferryid.effects import effects
from ferryid.effects.effect import Values
from ferryid.effects.force_model import ForceModel, Measurements
from ferryid.effects.hull_spread import hull_model_spread
from ferryid.errors import FerryIdError
from ferryid.types import IN_MEMORY, Floats, RunContext
from ferryid.vessel.profile import Profile

SHOWN_ROWS = 400


@dataclass(frozen=True)
class Condition:
    """An effect that the simulation has, with its values and their standard deviations.

    `in_hull` where it is one of the hull's coefficients alone, so that it is in `Simulation.hull` already.
    """

    candidate: Candidate
    values: Floats
    errors: Floats
    in_hull: bool = False


@dataclass(frozen=True)
class Simulation:
    """What was learnt from a simulated log.

    Attributes
    ----------
    log
        Its name.
    measurements
        What it holds, at its full rate.
    hull, spread
        Coefficients of its hull, shape (26,), and how far off they may be.
    conditions
        Effects that it has, in the order in which they act.
    sensors
        What is wrong with its sensors.
    """

    log: str
    measurements: Measurements
    hull: Floats
    spread: Floats
    conditions: tuple[Condition, ...]
    sensors: tuple[SensorFinding, ...]


def learn_simulation(path: str, profile: Profile, run: RunContext = IN_MEMORY) -> Simulation:
    """Return the force model that a simulated log shows.

    Parameters
    ----------
    path
        The log, recorded with the same signals as the vessel's own.
    profile
        The vessel that it simulates.
    run
        Folder of the ingested tables, progress, and whether to check every checksum.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, is too short, or moves like no vessel of this profile.
    """
    measurements, survey = read_measurements(path, profile, run)
    sensors, measurements = examine(measurements)
    name = survey.used.log
    simulated_windows = windows(measurements, *window_lengths(profile))
    if len(simulated_windows.starts) < INFERENCE.fewest_windows:
        raise FerryIdError(
            f"{name}: --against needs a simulation long enough to learn its model from, found "
            f"{counted(len(simulated_windows.starts), 'overlapping window')} of "
            f"{window_lengths(profile)[0]:.0f} s without a gap where {INFERENCE.fewest_windows} are needed. "
            "Fix: simulate and record the whole trial"
        )
    plain, spread = prior_force_model(simulated_windows.measurements, profile)
    wide = INFERENCE.simulator_hull_factor * spread if profile.hull.is_known else spread
    run.progress(f"learning what {name} simulates")
    result = search(estimation_problem(simulated_windows, plain, wide), run.progress)
    made = result.fit
    left = float(
        np.mean(
            (
                simulated_windows.gap(fitted_force_model(plain, made))
                / _size(simulated_windows.measured[:, simulated_windows.channels])
            )
            ** 2
        )
    )
    if left > INFERENCE.foreign_share:
        raise FerryIdError(
            f"{name}: --against needs a simulation of {profile.name}, found a motion of which its hull and the actuators' "
            f"force explain no more than {100.0 * max(0.0, 1.0 - left):.0f} %. Fix: give a simulation of this vessel that "
            "moves, with signals as the profile maps them"
        )
    conditions = [
        Condition(candidate, values, made.errors(k), _in_hull(candidate, values, plain))
        for k, (candidate, values) in enumerate(zip(made.candidates, made.values, strict=True))
    ]
    hull = made.hull
    for one in conditions:
        if one.in_hull:
            hull = one.candidate.act(replace(plain, hull=hull), one.values).hull
    posterior = np.sqrt(np.diag(np.linalg.inv(result.problem.by_hull.T @ result.problem.by_hull + np.eye(len(wide)))))
    return Simulation(
        name,
        measurements,
        hull,
        np.hypot(hull_model_spread(profile) * hull, posterior * wide),
        (*_measured(measurements), *conditions),
        sensors,
    )


def _in_hull(candidate: Candidate, values: Floats, plain: ForceModel) -> bool:
    after = candidate.act(plain, values)
    same = all(
        getattr(after, field.name) is getattr(plain, field.name) for field in fields(plain) if field.name != "hull"
    )
    return same and bool((after.hull != plain.hull).any())


def _size(measured: Floats) -> Floats:
    return np.asarray(np.sqrt(np.mean(measured**2, axis=0)))


def _measured(measurements: Measurements) -> tuple[Condition, ...]:
    """Return the conditions that a simulation records, by their means, for a recording that lacks their sensors.

    Of a payload it is the mean while it was aboard.
    """
    found = []
    for name, values in (
        ("wind", measurements.wind),
        ("current", measurements.current),
        ("payload", measurements.payload),
    ):
        if values is None:
            continue
        effect = effects()[name]
        candidate, rows = Candidate(effect, None, effect.parameters_of(measurements.profile)), measurements.usable
        if name == "payload":
            rows, ends = aboard(measurements.t, values, rows)
            candidate = replace(candidate, onset_s=ends.get("onset", 0.0), offset_s=ends.get("offset", inf))
        mean = np.asarray(values[rows].mean(axis=0))
        # Factors on the load, which nothing measures, are as the profile has them.
        mean = np.append(mean, [one.neutral for one in candidate.parameters[len(mean) :]])
        found.append(Condition(candidate, mean, np.zeros_like(mean)))
    return tuple(found)


def simulated_force_model(
    simulated: Simulation, measurements: Measurements, shift_s: float = 0.0
) -> tuple[ForceModel, Floats]:
    """Return the simulation's force model of what a recording shows, and how far its hull's coefficients may be off.

    What the recording measured itself (wind, current, payload) is the recording's.

    Parameters
    ----------
    simulated
        From `learn`.
    measurements
        The recording's.
    shift_s
        What is added to the simulation's times, of onsets and offsets.
    """
    plain, _ = prior_force_model(measurements, measurements.profile)
    force_model = replace(plain, hull=simulated.hull)
    for one in _carried(simulated, measurements, shift_s):
        force_model = one.candidate.act(force_model, one.values)
    return force_model, simulated.spread


def _carried(simulated: Simulation, measurements: Measurements, shift_s: float) -> list[Condition]:
    return [
        replace(one, candidate=_later(one.candidate, shift_s))
        for one in simulated.conditions
        if not one.in_hull and not one.candidate.effect.excluded(measurements)
    ]


def _later(candidate: Candidate, shift_s: float) -> Candidate:
    for end in candidate.times:
        candidate = candidate.moved(end, max(getattr(candidate, end) + shift_s, 0.0))
    return candidate


def differing_candidates(simulated: Simulation, measurements: Measurements, shift_s: float = 0.0) -> list[Candidate]:
    """Return every candidate of a recording, those that the simulation has already as differences to it."""
    plain, _ = prior_force_model(measurements, measurements.profile)
    bare = replace(plain, hull=simulated.hull)
    carried = _carried(simulated, measurements, shift_s)
    known = {one.candidate.key: k for k, one in enumerate(carried)}
    candidates, _ = list_candidates(measurements)
    return [_relative(one, carried, known[one.key], bare) if one.key in known else one for one in candidates]


def difference_notes(simulated: Simulation, measurements: Measurements) -> list[str]:
    """Return the errors of the simulation's sensors, and conditions that differ by what was measured, in sentences."""
    notes = [f"The simulation's log: {one.says}" for one in simulated.sensors]
    return notes + [
        f"The {one.candidate.effect.id} differs by what was measured, and is no finding: "
        f"{_described(one, simulated.measurements)} in the simulation; the recording's own is part of its force model."
        for one in simulated.conditions
        if one.candidate.effect.excluded(measurements) and not one.in_hull
    ]


def _described(one: Condition, measurements: Measurements) -> str:
    unreported = one.candidate.effect.unreported(measurements, one.values)
    return ", ".join(
        f"{parameter.name} {_with_unit(value, parameter.unit)}"
        for parameter, value in zip(one.candidate.parameters, one.values.tolist(), strict=True)
        if parameter.name not in unreported
    )


def _relative(candidate: Candidate, carried: Sequence[Condition], index: int, bare: ForceModel) -> Candidate:
    """Return an effect that takes the simulation's values for neutral, and changes a force model from these to its own."""
    own = carried[index]
    neutral = dict(zip((one.name for one in candidate.parameters), own.values.tolist(), strict=True))

    def modelled(hull: Floats, p: Floats) -> ForceModel:
        force_model = replace(bare, hull=hull)
        for k, one in enumerate(carried):
            force_model = one.candidate.act(force_model, p if k == index else one.values)
        return force_model

    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        return _changed(force_model, modelled(force_model.hull, own.values), modelled(force_model.hull, p))

    def says(values: Values, instance: str | None) -> str:
        name = candidate.effect.title + (f" ({instance})" if instance else "")
        parts = [
            f"{one.name.replace('_', ' ')} {_with_unit(neutral[one.name], one.unit)} in the simulation, "
            f"{_with_unit(values[one.name], one.unit)} in the recording"
            for one in candidate.parameters
            if one.name in values
        ]
        return f"{name} differs: {'; '.join(parts)}."

    def impulse(force_model: ForceModel, p: Floats) -> Floats:
        # What the simulation has aboard already gives none.
        assert candidate.effect.impulse is not None
        return candidate.effect.impulse(force_model, p) - candidate.effect.impulse(force_model, own.values)

    # Where the simulation has it for a while, no other span of it can be told, and its own has its own kick.
    has_impulse = candidate.effect.impulse is not None and not own.candidate.times
    effect = replace(candidate.effect, apply=apply, says=says, impulse=impulse if has_impulse else None)
    parameters = tuple(replace(one, neutral=neutral[one.name]) for one in candidate.parameters)
    return Candidate(effect, candidate.instance, parameters)


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.2f}" + ("" if unit == "-" else f" {unit}")


def _changed(force_model: ForceModel, old: ForceModel, new: ForceModel) -> ForceModel:
    """Return a force model changed as `old` becomes `new`: hull and factors by the ratio, all else by the difference."""
    measurements = force_model.measurements
    if new.measurements is not old.measurements:
        measurements = replace(
            measurements,
            eta=measurements.eta + new.measurements.eta - old.measurements.eta,
            nu=measurements.nu + new.measurements.nu - old.measurements.nu,
        )
    changed: dict[str, Any] = {"measurements": measurements}
    for field in fields(force_model):
        own, before, after = (getattr(one, field.name) for one in (force_model, old, new))
        if field.name == "measurements" or before is after:
            continue
        if field.name in ("hull", "damping_factor"):
            upper, lower = (np.ones(1) if one is None else one for one in (after, before))
            # What was zero stays so, whatever it is multiplied by.
            ratio = np.divide(upper, lower, out=np.ones(np.broadcast(upper, lower).shape), where=lower != 0.0)
            changed[field.name] = ratio if own is None else own * ratio
        else:
            change = (0.0 if after is None else after) - (0.0 if before is None else before)
            changed[field.name] = change if own is None else own + change
    return replace(force_model, **changed)


def simulation_as_json(simulated: Simulation, compared: PathComparison | str) -> dict[str, Any]:
    """Return the simulation and its path against the recording's as plain values, for JSON."""
    conditions = [
        {
            "effect": one.candidate.effect.id,
            "instance": one.candidate.instance,
            "onset": one.candidate.onset_s if one.candidate.onset_s > 0.0 else None,
            "offset": one.candidate.offset_s if isfinite(one.candidate.offset_s) else None,
            "parameters": {
                parameter.name: vars(Estimate(value, value - 1.96 * error, value + 1.96 * error, parameter.unit))
                for parameter, value, error in zip(
                    one.candidate.parameters, one.values.tolist(), one.errors.tolist(), strict=True
                )
                if parameter.name not in one.candidate.effect.unreported(simulated.measurements, one.values)
            },
        }
        for one in simulated.conditions
    ]
    made: dict[str, Any] = {"log": simulated.log, "conditions": conditions, "paths": None}
    if isinstance(compared, str):
        return {**made, "says": f"The paths are not compared: {compared}."}
    every = max(1, -(-len(compared.t) // SHOWN_ROWS))
    columns: Mapping[str, Floats] = {
        "t_s": compared.t,
        "position_m": compared.position_m,
        "heading_rad": compared.heading_rad,
        "speed_mps": compared.speed_mps,
    }
    rms = {name: float(np.sqrt(np.mean(column**2))) for name, column in columns.items() if name != "t_s"}
    worst = int(np.argmax(compared.position_m))
    made["paths"] = {
        "shift_s": compared.shift_s,
        "rms": rms,
        **{name: column[::every].tolist() for name, column in columns.items()},
    }
    made["says"] = (
        f"The recording's path is {rms['position_m']:.2f} m, {np.degrees(rms['heading_rad']):.1f} deg and "
        f"{rms['speed_mps']:.2f} m/s from the simulation's (root mean square), most at {compared.t[worst]:.0f} s: "
        f"{compared.position_m[worst]:.2f} m."
    )
    return made
