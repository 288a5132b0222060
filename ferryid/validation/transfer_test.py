"""The transfer test: the models of diagnosis and rivals on another log of the same truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.models import Conditions, Model, StoredEffect, force_scores, usable_rows
from ferryid.models.prediction import FreeRun, Prediction, predict, predicted_acceleration
from ferryid.models.store import load_file
from ferryid.regression import window_rows, window_starts, window_sums, window_weights
from ferryid.signals.prepare import Prepared
from ferryid.signals.track import segments
from ferryid.types import AXES, Floats
from ferryid.validation.records import DIAGNOSED, StoredEffectNote, TransferResult, TransferScore
from ferryid.validation.rivals import RIVALS, Learner
from ferryid.validation.rivals.base import base_of, prepared_log
from ferryid.validation.rivals.learner import SMOOTHER, WINDOW_S
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile

HORIZON_S = 60.0
"""Length of the free runs that are scored [s]."""

Rows = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Transfer:
    """What all models expect of the second log.

    Attributes
    ----------
    second
        The log.
    base, found
        What the base model expects, and every other by its name.
    known
        What is known of each method beside its errors.
    rows
        Rows that all can predict, shape (n,): nobody gains by what it cannot.
    mass, length_s
        Mass matrix of the profile, shape (3, 3), and length of the windows that errors are averaged over [s].
    """

    second: Prepared
    base: Prediction
    found: Mapping[str, Prediction]
    known: Mapping[str, TransferScore]
    rows: Rows
    mass: Floats
    length_s: float

    def scores(self) -> TransferResult:
        """Return the scores of all models."""
        motion, rows, base = self.second.motion, self.rows, self.base
        base_run = base.free_run(rows)

        def in_windows(prediction: Prediction) -> Floats:
            seen = prediction.motion
            errors = (seen.nu_dot - predicted_acceleration(prediction.force, seen)) @ self.mass.T
            return _power(window_errors(errors, rows, motion.rate_hz, self.length_s))

        base_windows = in_windows(base)
        scores = {}
        for name, known in self.known.items():
            found = self.found.get(name)
            one = _score(motion.tau, base.tau, found, rows, base_run, known)
            scores[name] = one if found is None else replace(one, windows=_by_axis(in_windows(found) / base_windows))
        return TransferResult(
            replace(_base_score(motion.tau, base, rows, base_run), windows=_by_axis(base_windows)), scores
        )


def transfer(
    first_log: str,
    transfer_log: str,
    profile: Profile,
    out: Path,
    *,
    diagnosed: Model | str | Path | None,
    rivals: Mapping[str, Learner] = RIVALS,
) -> Transfer:
    """Return what the base model, a diagnosed one and every rival expect of another log of the truth that they were fitted to.

    All predict the same: the force that the thrusters must have given for the measured motion, the acceleration under the
    measured forces, and where the vessel goes in 60 s under them. The free runs of all take forces from outside as they were
    along the measured path. In windows the error is the acceleration's times the mass in the profile, the same for all: a
    model that takes the thrusters for half as strong and the hull for half as heavy moves alike, with half the force error.

    Parameters
    ----------
    first_log, transfer_log
        Paths; parts of one recording joined by ``+``.
    profile
        The vessel.
    out
        Output folder, whose ``logs`` keep the ingested tables.
    diagnosed
        The model that a diagnosis of the first log wrote, or its path; None where it wrote none, having found no force left
        out: the base model is then what it leaves.
    rivals
        Learners by name.

    Raises
    ------
    FerryIdError
        For logs that cannot be used, two that are the same, and a model that was not diagnosed from the first.
    """
    one, other = (prepared_log(log, profile, out) for log in (first_log, transfer_log))
    if one.recording.sha256 == other.recording.sha256:
        raise FerryIdError(
            f"{transfer_log}: the same log as {first_log}, so that every model would be scored on its training data. "
            "Fix: give another log"
        )
    base = base_of(other, profile).prediction
    found: dict[str, Prediction] = {}
    known: dict[str, TransferScore] = {}
    if diagnosed is None:
        found[DIAGNOSED] = base
        known[DIAGNOSED] = TransferScore({}, why="the diagnosis wrote no model: the base model takes its place")
    else:
        model = diagnosed if isinstance(diagnosed, Model) else load_file(Path(diagnosed))
        moved = transferred(model, one, other)
        found[DIAGNOSED] = predict(moved, other, profile, window_s=WINDOW_S, smoother=SMOOTHER)
        known[DIAGNOSED] = _acting_effects(found[DIAGNOSED], other.recording.sha256)
    for name, learn in rivals.items():
        try:
            learnt = learn(first_log, profile, out)
            found[name] = learnt.predict(other)
        except FerryIdError as error:
            known[name] = TransferScore({}, why=str(error))
            continue
        known[name] = TransferScore({}, names=learnt.names)
    rows = usable_rows(other.motion, base.tau, *(each.tau for each in found.values()))
    return Transfer(other, base, found, known, rows, profile.hull.M, window_seconds(profile))


def window_errors(errors: Floats, rows: Rows, rate_hz: float, length_s: float) -> Floats:
    """Return force errors averaged over windows as the weak form averages forces, so that noise does not drown them.

    An average of a differentiated velocity, weighted with a test function, is one of the velocity with its slope.

    Parameters
    ----------
    errors
        In every row [N, N, N·m], shape (n, 3).
    rows
        Rows to use, shape (n,); every window lies wholly within an unbroken stretch of them. They overlap by half.
    rate_hz
        Rows per second.
    length_s
        Length of a window [s].

    Returns
    -------
    ndarray
        Shape (J, 3).
    """
    m = window_rows(length_s, rate_hz)
    return window_sums(errors, window_weights(m, 1.0 / rate_hz)[0] / rate_hz, window_starts(segments(rows), m)[0])


def transferred(model: Model, first: Prepared, second: Prepared) -> Model:
    """Return a model diagnosed from one log as it applies to another of the same truth.

    The conditions of a log belong to its hash, and act in no other. Where the truth is known to be the same, those of the
    first prevail in the second, and all begins and ends at the same time in both.

    Raises
    ------
    FerryIdError
        For a model that was not diagnosed from the first log.
    """
    before, after = first.recording.sha256, second.recording.sha256
    if not any(log["sha256"] == before for log in model.training):
        raise FerryIdError(
            f"{model.label}: not a model of {first.motion.log}, whose conditions are to hold in {second.motion.log} too. "
            "Fix: give the model that the diagnosis of the first log wrote"
        )

    def also(stored: StoredEffect) -> StoredEffect:
        sources = [replace(one, log=second.motion.log, sha256=after) for one in stored.sources if one.sha256 == before]
        return replace(stored, sources=(*stored.sources, *sources))

    prevailing = tuple(also(one) for one in model.conditions_of(before))
    return replace(
        model,
        vessel_effects=tuple(also(one) for one in model.vessel_effects),
        conditions=(
            *(one for one in model.conditions if one.sha256 != after),
            *((Conditions(second.motion.log, after, prevailing),) if prevailing else ()),
        ),
    )


def _acting_effects(found: Prediction, sha256: str) -> TransferScore:
    """Return which effects of a diagnosed model act, and which do not."""
    idle = [one for one in found.idle if "conditions are those of one log" not in one]
    acting = (*found.vessel, *found.conditions)
    notes = tuple(StoredEffectNote(one.effect, one.instance, one.says(sha256)) for one in acting)
    return TransferScore({}, effects=notes, why=" ".join(idle))


def _score(
    tau: Floats, base: Floats, found: Prediction | None, rows: Rows, base_run: FreeRun, known: TransferScore
) -> TransferScore:
    """Return the errors of a method, none where it has no prediction; several reasons become one text."""
    _, base_position_m, base_heading_rad = _free_run_errors(base_run)
    if found is None:
        ran, mse = TransferScore(dict.fromkeys(AXES)), dict[str, float | None](dict.fromkeys(AXES))
    else:
        ran = _free_run_score(found.free_run(rows))
        ratio = force_scores(tau, base, found.tau, rows).ratio
        mse = _by_axis(ratio)
    return replace(
        ran,
        mse=mse,
        base_position_m=base_position_m,
        base_heading_rad=base_heading_rad,
        why="; ".join(one for one in (known.why, ran.why) if one),
        names=known.names,
        effects=known.effects,
    )


def _base_score(tau: Floats, base: Prediction, rows: Rows, run: FreeRun) -> TransferScore:
    error = force_scores(tau, base.tau, base.tau, rows).mse_base
    return replace(_free_run_score(run), mse=_by_axis(error))


def _free_run_score(run: FreeRun) -> TransferScore:
    """Return the errors of free runs at the horizon, and what became of the runs."""
    why, position_m, heading_rad = _free_run_errors(run)
    return TransferScore({}, position_m, heading_rad, run.starts, run.diverged, why=why)


def _free_run_errors(run: FreeRun) -> tuple[str, float | None, float | None]:
    """Return why there is no error at the horizon, and the errors of position and heading."""
    at = int(np.argmin(np.abs(run.horizons_s - HORIZON_S)))
    position, heading = _number(float(run.position_m[at])), _number(float(run.heading_rad[at]))
    why = run.note
    if not why and position is None:
        why = f"no stretch of {HORIZON_S:g} s in which position was measured"
    return why, position, heading


def _power(errors: Floats) -> Floats:
    """Return the mean square by axis, shape (3,); NaN without any."""
    return np.asarray(np.mean(errors**2, axis=0)) if len(errors) else np.full(3, np.nan)


def _by_axis(values: Floats) -> dict[str, float | None]:
    return {axis: _number(value) for axis, value in zip(AXES, values.tolist(), strict=True)}


def _number(value: float) -> float | None:
    return float(value) if isfinite(value) else None
