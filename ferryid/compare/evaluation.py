"""Judge a stored model on other logs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.compare.candidates import trained_on
from ferryid.compare.thresholds import COMPARE
from ferryid.errors import FerryIdError
from ferryid.identify import check_window
from ferryid.log_warnings import left_out_together
from ferryid.models import RANGE_UNITS, ForceScores, Model, StoredEffect, force_scores, outside_ranges, usable_rows
from ferryid.models.forces import Estimator, effective_mass, without_inputs
from ferryid.models.prediction import Prediction, predict, predict_base, signal_map, window_errors, window_scores
from ferryid.signals.copies import GivenLogs, has_marks
from ferryid.signals.prepare import Prepared, prepare
from ferryid.signals.stream import Recording
from ferryid.signals.track import Motion
from ferryid.signals.usable import left_out_of, usable
from ferryid.types import Flags, Floats, RunContext
from ferryid.vessel import parse_profile
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile

_Windows = tuple[Floats, Floats, Floats, Floats]


def evaluate(
    model: Model,
    logs: Sequence[str],
    run: RunContext,
    *,
    profile: Profile | None = None,
    window_s: float | None = None,
) -> dict[str, Any]:
    """Compare a model's and its base model's force with the measured one, predict accelerations, and run both free.

    The base of a model that a diagnosis has changed is the model before it. Accelerations are predicted in windows, as a fit
    is judged: the base model then knows no measured wind, current or payload.

    Parameters
    ----------
    model
        The model.
    logs
        Paths; parts of one recording joined by ``+``.
    run
        Output folder and progress.
    profile
        Signal map of the logs; the profile inside the model where None.
    window_s
        Smoothing window of the test data [s]; the model's own where None.

    Returns
    -------
    dict
        Schema ``ferryid.evaluate/1``. Of several logs, those that cannot be used are left out, with a warning.
    """
    profile = signal_map(model, profile)
    check_window(window_s)
    window = float(model.settings["window_s"]) if window_s is None else window_s
    smoother = str(model.settings.get("smoother", "square"))
    given = GivenLogs()

    def on(path: str) -> _Evaluated:
        run.progress(f"evaluating on {Path(path).name}")
        prepared = prepare(
            path,
            profile,
            run.tables,
            window_s=window,
            smoother=smoother,
            rate_hz=model.settings.get("rate_hz"),
            keep_track=model.diagnosed,
            ranges=run.ranges,
        )
        given.add(prepared.recording)
        return _evaluated(model, prepared, profile, window, smoother)

    errors: dict[str, FerryIdError] = {}
    found = list(usable(logs, on, errors))
    windows = [one.windows for one in found]
    beside_hull = [one.beside_hull for one in found if one.beside_hull is not None]
    left_out = left_out_together(left_out_of("evaluation", errors))
    run.progress("")
    tau, base_all, model_all = (np.concatenate(columns) for columns in zip(*(one.forces for one in found), strict=True))
    return {
        "schema": "ferryid.evaluate/1",
        "model": {
            "name": model.name,
            "version": model.version,
            "accepted": model.accepted,
            "scale": model.changed_scale,
            **({"base": _base_of(model)} if model.diagnosed else {}),
        },
        "window_s": window,
        "logs": [one.entry for one in found],
        "pooled": {
            **_scores(force_scores(tau, base_all, model_all, np.ones(len(tau), dtype=bool)), profile).to_json(),
            "prediction": _prediction_json(windows, model, profile),
            **_beside_hull_json(beside_hull, model, profile),
        },
        **({"warnings": left_out} if left_out else {}),
    }


@dataclass(frozen=True, eq=False)
class _Evaluated:
    """What one log says of a model.

    Attributes
    ----------
    entry
        Of the log, in the result.
    forces
        Measured force, the base model's and the model's on its usable rows [N, N, N·m], shape (n, 3) each.
    windows
        What `_in_windows` returns.
    beside_hull
        What `_beside_unscaled` returns.
    """

    entry: dict[str, Any]
    forces: tuple[Floats, Floats, Floats]
    windows: _Windows
    beside_hull: _Windows | None


def _evaluated(model: Model, prepared: Prepared, profile: Profile, window_s: float, smoother: str) -> _Evaluated:
    """Judge a model on one log that was read."""
    motion = prepared.motion
    old = predict_base(model, prepared, profile, window_s=window_s, smoother=smoother)
    # A model that adds nothing is its base model: the free run takes longer than all else and is not done twice.
    new = old if model.blank else predict(model, prepared, profile, window_s=window_s, smoother=smoother)
    tau_base, tau_model = old.tau, new.tau
    rows = usable_rows(motion, tau_model)
    old_run = old.free_run(rows)
    new_run = old_run if new is old else new.free_run(rows)
    windows = _in_windows(model, old, new, motion, rows, profile)
    unscaled = _beside_unscaled(model, prepared, new, rows, profile)
    entry = {
        "name": motion.log,
        "sha256": prepared.recording.sha256,
        "rows": int(rows.sum()),
        "seconds": float(rows.sum() / motion.rate_hz),
        **_scores(force_scores(motion.tau, tau_base, tau_model, rows), profile).to_json(),
        "prediction": _prediction_json([windows], model, profile),
        **_beside_hull_json([] if unscaled is None else [unscaled], model, profile),
        "free_run": {
            "base": old_run.to_json(),
            "model": new_run.to_json(),
        },
        **({"effects": _list_effects(new, prepared.recording.sha256)} if model.diagnosed else {}),
        "outside": outside_ranges(model.ranges, motion, rows),
        "warnings": [
            *prepared.doubts,
            *_warnings(prepared.recording, model, motion, rows),
            *prepared.left_out,
        ],
        "data_quality": prepared.quality,
    }
    return _Evaluated(entry, (motion.tau[rows], tau_base[rows], tau_model[rows]), windows, unscaled)


def _in_windows(
    model: Model, old: Prediction, new: Prediction, motion: Motion, rows: Flags, profile: Profile
) -> _Windows:
    """Return force, prediction errors of base model, model and constant velocity, averaged over windows, shape (J, 3) each.

    The base model of a model without a diagnosis sees a log without measured wind, current and payload, as that of a fit does.
    """
    own = parse_profile(model.profile_text, model.name)
    mass = effective_mass(own, model.scale, (), np.zeros((0, 3)))
    base = old if model.diagnosed else replace(old, motion=without_inputs(old.motion))
    length_s, reduced = window_seconds(own), not profile.measures_sway
    found = window_errors((base, new), motion, rows, mass, length_s, reduced=reduced)
    base_error, error = found.errors
    return found.force, base_error, error, found.accelerating


def _beside_unscaled(
    model: Model, prepared: Prepared, new: Prediction, rows: Flags, profile: Profile
) -> _Windows | None:
    """Return what `_in_windows` does with the hull of the profile as it is for a base; None where the base is that hull."""
    if model.diagnosed or not model.changed_scale:
        return None
    own = parse_profile(model.profile_text, model.name)
    hull = Estimator(own, {})
    old = Prediction(hull.of(prepared.motion), prepared.motion, hull)
    return _in_windows(model, old, new, prepared.motion, rows, profile)


def _beside_hull_json(windows: Sequence[_Windows], model: Model, profile: Profile) -> dict[str, Any]:
    return {"prediction_beside_hull": _prediction_json(windows, model, profile)} if windows else {}


def _prediction_json(windows: Sequence[_Windows], model: Model, profile: Profile) -> dict[str, Any]:
    """Return the prediction errors of what `_in_windows` returned for every log."""
    pooled = [np.concatenate(columns) for columns in zip(*windows, strict=True)]
    return {
        "window_s": window_seconds(parse_profile(model.profile_text, model.name)),
        "windows": len(pooled[0]),
        **_scores(window_scores(*pooled), profile).to_json(),
    }


def _base_of(model: Model) -> str:
    return "the base model" if model.learned else "the model before its diagnosis"


def _scores(force: ForceScores, profile: Profile) -> ForceScores:
    """Return force errors on the axes of which the velocity is measured."""
    return force if profile.measures_sway else force.without_sway()


def _list_effects(found: Prediction, sha256: str) -> dict[str, Any]:
    """Return the effects that act on a log, and why others do not."""

    def told(several: Iterable[StoredEffect]) -> list[dict[str, Any]]:
        return [{"effect": one.effect, "instance": one.instance, "says": one.says(sha256)} for one in several]

    return {
        "vessel": told(found.vessel),
        "conditions": told(found.conditions),
        "left_out": list(found.idle),
    }


def range_warnings(model: Model, motion: Motion, rows: Flags) -> list[str]:
    """Say where the marked rows of a log are not what a model was made for."""
    warnings = []
    if motion.payload is None and "payload_kg" in model.ranges:
        warnings.append("the model was trained with the payload known, and this log has none: it is taken as empty")
    for name, share in outside_ranges(model.ranges, motion, rows).items():
        if share > COMPARE.outside:
            low, high = model.ranges[name]
            warnings.append(
                f"{100.0 * share:.0f} % of the rows have {name} outside the model's range of validity, {low:.3g} to {high:.3g} "
                f"{RANGE_UNITS[name]}"
            )
    return warnings


def _parts_of_one(recording: Recording, model: Model) -> Iterator[str]:
    """Yield a sentence where a log is a part of one whose conditions the model knows: by itself it has none of these."""
    if model.conditions_of(recording.sha256):
        return
    for log in model.training:
        several = len(log["files"]) > 1 and "motion" in log and model.conditions_of(str(log["sha256"]))
        if several and has_marks(recording, [log["motion"]]):
            yield (
                f"it is a part of {log['name']}, in which its parts were diagnosed as one: what acted there is not in these "
                "figures. Fix: give all of its parts as one log, joined by +"
            )


def _warnings(recording: Recording, model: Model, motion: Motion, rows: Flags) -> list[str]:
    warnings = range_warnings(model, motion, rows)
    if trained_on(model, recording):
        warnings.append("the model was trained on this log: its scores here are no evidence")
        warnings += _parts_of_one(recording, model)
    return warnings
