"""A second log of the same truth: what each learner's model is worth where it has not learnt."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.models import Conditions, Model, StoredEffect, force_scores, usable_rows
from ferryid.models.prediction import FreeRun, Prediction, predict
from ferryid.models.store import load_file
from ferryid.prove.rivals import RIVALS, Learner
from ferryid.prove.rivals.base import base_of, prepared_log
from ferryid.prove.rivals.learnt import SMOOTHER, WINDOW_S
from ferryid.signals.prepare import Prepared
from ferryid.types import AXES
from ferryid.vessel.profile import Floats, Profile

HORIZON_S = 60.0
"""Length of the free runs that are judged [s]."""

Rows = NDArray[np.bool_]


def second(
    first_log: str,
    second_log: str,
    profile: Profile,
    out: Path,
    *,
    diagnosed: Model | str | Path | None,
    rivals: Mapping[str, Learner] = RIVALS,
) -> dict[str, Any]:
    """Judge the base model, a diagnosed one and every rival on a second log of the truth that they learnt in the first.

    All are asked the same: the force that the thrusters must have given for the measured motion, and where the vessel goes in
    60 s under the measured forces. The free runs of all take forces from outside as they were along the measured path.

    Parameters
    ----------
    first_log, second_log
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

    Returns
    -------
    dict
        ``"base"``, ``"diagnosed"`` and the name of each rival, each with

        - ``mse``: force error over the base model's by axis; of the base model, in N² and N²m²;
        - ``position_m``, ``heading_rad``: root-mean-square error of the free runs at 60 s, those that diverged left out, and
          the base model's, ``base_position_m`` and ``base_heading_rad``;
        - ``starts``, ``diverged``: how many free runs there were, and how many of them diverged;
        - ``why``: what could not be had, and why, where anything could not;
        - ``names`` of a rival: as `ferryid.prove.rivals.Named` has them; ``effects`` of the diagnosed model: those that act.

        None takes the place of numbers that could not be had.

    Raises
    ------
    FerryIdError
        For logs that cannot be used, two that are the same, and a model that was not diagnosed from the first.
    """
    one, other = (prepared_log(log, profile, out) for log in (first_log, second_log))
    if one.recording.sha256 == other.recording.sha256:
        raise FerryIdError(
            f"{second_log}: the same log as {first_log}, so that every learner would judge itself. Fix: give another log"
        )
    base = base_of(other, profile).prediction
    found: dict[str, Prediction] = {}
    more: dict[str, dict[str, Any]] = {"diagnosed": {}}
    if diagnosed is None:
        found["diagnosed"] = base
        more["diagnosed"]["why"] = "the diagnosis wrote no model: it judges as the base model does"
    else:
        model = diagnosed if isinstance(diagnosed, Model) else load_file(Path(diagnosed))
        found["diagnosed"] = predict(carried(model, one, other), other, profile, window_s=WINDOW_S, smoother=SMOOTHER)
        more["diagnosed"] |= _acting(found["diagnosed"], other.recording.sha256)
    for name, learn in rivals.items():
        try:
            learnt = learn(first_log, profile, out)
            found[name] = learnt.predict(other)
        except FerryIdError as error:
            more[name] = {"why": str(error)}
            continue
        more[name] = {"names": [named.as_json() for named in learnt.names]}
    motion = other.motion
    # On the same rows for all, so that nobody gains by what it cannot predict.
    rows = usable_rows(motion, base.tau, *(each.tau for each in found.values()))
    run = base.free_run(rows)
    judged = {name: _judged(motion.tau, base.tau, each, rows, run) for name, each in found.items()}
    return {
        "base": _of_base(motion.tau, base, rows, run),
        **{name: _with(judged.get(name, _nothing(run)), said) for name, said in more.items()},
    }


def carried(model: Model, first: Prepared, second: Prepared) -> Model:
    """Return a model diagnosed from one log as if it had been found in another of the same truth as well.

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


def _acting(found: Prediction, sha256: str) -> dict[str, Any]:
    """Return which effects of a diagnosed model act, and what does not."""
    known = [one for one in found.idle if "conditions are those of one log" not in one]
    return {
        "effects": [
            {"effect": one.effect, "instance": one.instance, "says": one.says(sha256)}
            for one in (*found.vessel, *found.conditions)
        ],
        **({"why": " ".join(known)} if known else {}),
    }


def _judged(tau: Floats, base: Floats, found: Prediction, rows: Rows, base_run: FreeRun) -> dict[str, Any]:
    ratio = force_scores(tau, base, found.tau, rows).to_json()["per_axis"]
    return {"mse": {axis: _number(ratio[axis]) for axis in AXES}, **_ran(found.free_run(rows)), **_base_ran(base_run)}


def _of_base(tau: Floats, base: Prediction, rows: Rows, run: FreeRun) -> dict[str, Any]:
    error = force_scores(tau, base.tau, base.tau, rows).to_json()["mse"]["base"]
    return {"mse": {axis: _number(error[axis]) for axis in AXES}, **_ran(run), "rows": int(rows.sum())}


def _ran(run: FreeRun) -> dict[str, Any]:
    """Return the errors of free runs at the horizon, and what became of the runs."""
    at = int(np.argmin(np.abs(run.horizons_s - HORIZON_S)))
    position, heading = _number(float(run.position_m[at])), _number(float(run.heading_rad[at]))
    why = run.note
    if not why and position is None:
        why = f"no stretch of {HORIZON_S:g} s in which position was measured"
    return {
        "position_m": position,
        "heading_rad": heading,
        "starts": run.starts,
        "diverged": run.diverged,
        **({"why": why} if why else {}),
    }


def _base_ran(run: FreeRun) -> dict[str, Any]:
    ran = _ran(run)
    return {"base_position_m": ran["position_m"], "base_heading_rad": ran["heading_rad"]}


def _nothing(base_run: FreeRun) -> dict[str, Any]:
    """Return the entry of a learner that could not learn."""
    nothing = {"position_m": None, "heading_rad": None, "starts": 0, "diverged": 0}
    return {"mse": dict.fromkeys(AXES), **nothing, **_base_ran(base_run)}


def _with(judged: Mapping[str, Any], said: Mapping[str, Any]) -> dict[str, Any]:
    """Return an entry with what else is said of it; two reasons become one text."""
    reasons = [one["why"] for one in (said, judged) if "why" in one]
    return {**judged, **said, **({"why": "; ".join(reasons)} if reasons else {})}


def _number(value: float) -> float | None:
    return float(value) if isfinite(value) else None
