"""Second logs of the proof: the model that ``diagnose`` stores, ``fit``'s and those of rivals on another log of the same truth.

Cases are those of ``ferryid prove``: a vessel of the independent plant in six degrees of freedom, something that its profile
does not have, a hull that is wrong by some per cent. All learn from the first log and are judged on the second.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.identify import fit_logs
from ferryid.identify.fit_data import Coefficients
from ferryid.identify.settings import FitSettings
from ferryid.models import Model
from ferryid.models.prediction import Prediction, predict
from ferryid.signals.prepare import Prepared, open_track
from ferryid.types import AXES, Floats, RunContext
from ferryid.validation.case import Case
from ferryid.validation.case_sampling import sample_cases
from ferryid.validation.log_generation import TRANSFER_SEED, generate
from ferryid.validation.plant.trial import simulate_trial
from ferryid.validation.plant.vessels import VESSELS
from ferryid.validation.records import DIAGNOSED, TransferResult, TransferScore
from ferryid.validation.rivals import RIVALS
from ferryid.validation.rivals.learner import SMOOTHER, WINDOW_S, LearnedModel
from ferryid.validation.transfer_test import Transfer, transfer
from ferryid.validation.worker import diagnose_log
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile
from tests.rivals.output_error import fit_output_error
from tests.rivals.task import Task

SEED, RUNS = 2020, 0.2
"""Of the draw of cases, of which the first are taken."""
FIT = "fit"
FEWEST = 10
"""Logs from which on it is said whether an aim is reached."""
OF_CASE = ("cell", "concealed", "true_starts_m", "bases")
"""What a line has beside the scores: kind of the case, its effects, errors from true states, and `fit` with other bases."""
SHIFTS_S = np.linspace(-2.0, 2.0, 41)
"""Times by which a log may begin after the trial did [s]; its clock is its own."""
BASES = ("lift", "second-order")
"""Bases with which `fit` is tried as well; they are not compared with the rest, as nobody chose them before the second log."""
NEAR = 1.05
"""Error over the best one's up to which a model counts as best."""


@cache
def cases() -> tuple[Case, ...]:
    """Return the cases in their order; those of several logs are left out."""
    return tuple(case for case in sample_cases(SEED, RUNS) if case.logs == 1)


def try_case(case: Case, folder: Path) -> dict[str, Any]:
    """Return the scores of all models on the second log of a case, as plain values."""
    place = folder / case.name
    # What a run that was ended has left there is not written over.
    shutil.rmtree(place, ignore_errors=True)
    first, second = generate(case, place), generate(case, place / "second", transfer=True)
    out = place / "out"
    diagnosis = diagnose_log(first.log, first.profile, out)
    diagnosed = None if diagnosis.model is None else out / diagnosis.model
    others = {basis: partial(learn_fit, basis=basis) for basis in BASES}
    learners = {FIT: learn_fit, **RIVALS, "output error": learn_output_error, **others}
    profile = load_profile(first.profile)
    found = transfer(str(first.log), str(second.log), profile, out, diagnosed=diagnosed, rivals=learners)
    scores, true = found.scores(), true_starts(found, case)
    return {
        "cell": case.cell,
        "concealed": [truth.effect for truth in case.truths],
        "true_starts_m": {name: error for name, error in true.items() if name not in BASES},
        "bases": {
            basis: [_finite(measure(scores.methods[basis])) for measure in (force_error, position_error)]
            for basis in BASES
        },
        **replace(scores, methods={name: one for name, one in scores.methods.items() if name not in BASES}).to_json(),
    }


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def true_starts(found: Transfer, case: Case) -> dict[str, float | None]:
    """Return the position error after 60 s [m] of free runs that begin with the true states of the second log, by method.

    Those of a log begin with what was measured, whose noise, carried on for a minute, is the same part of every model's error.
    """
    trial = simulate_trial(VESSELS[case.vessel], case.conditions, case.path, case.seed ^ TRANSFER_SEED)
    north, east, _, _, _, heading, surge, sway, _, _, _, turning = trial.states[:, :12].T
    truth = np.column_stack([north, east, np.unwrap(heading), surge, sway, turning])

    def at(t: Floats) -> Floats:
        return np.column_stack([np.interp(t, trial.t, column) for column in truth.T])

    seconds = found.second.motion.t - found.second.motion.t[0]
    measured = found.second.motion.eta[:, :2]
    shift = min(SHIFTS_S, key=lambda one: float(np.nansum((at(seconds + one)[:, :2] - measured) ** 2)))
    states, errors = at(seconds + shift), dict[str, float | None]()
    for name, one in found.found.items():
        motion = one.motion
        eta, nu = (
            np.where(np.isfinite(was), true, was)
            for was, true in ((motion.eta, states[:, :3]), (motion.nu, states[:, 3:]))
        )
        run = replace(one, motion=replace(motion, eta=eta, nu=nu)).free_run(found.rows)
        error = float(run.position_m[-1]) if len(run.position_m) and not run.diverged else float("inf")
        errors[name] = error if isfinite(error) else None
    return errors


def learn_fit(log: str, profile: Profile, out: Path, basis: str = "modulus") -> LearnedModel:
    """Fit as ``ferryid fit`` does, with its own basis or another."""
    return _learned(FIT, _fitted(log, profile, out, basis), profile)


def learn_output_error(log: str, profile: Profile, out: Path) -> LearnedModel:
    """Fit by output error, with the terms of ``ferryid fit``."""
    task = Task.of(profile, [open_track(log, profile, out)])
    try:
        found: Coefficients = fit_output_error(task, 0)
    except ValueError as error:
        raise FerryIdError(f"{log}: {error}") from error
    like = _fitted(log, profile, out)
    if like.terms != task.functions.terms:
        raise FerryIdError(f"{log}: output error has other terms than the fit")
    return _learned("output error", replace(like, theta=found.theta, intercept=found.intercept), profile)


def _fitted(log: str, profile: Profile, out: Path, basis: str = "modulus") -> Model:
    return fit_logs([log], profile, FitSettings(draws=2, basis=basis), RunContext(out)).model


def _learned(name: str, model: Model, profile: Profile) -> LearnedModel:
    def expect(given: Model, prepared: Prepared) -> Prediction:
        return predict(given, prepared, profile, window_s=WINDOW_S, smoother=SMOOTHER)

    return LearnedModel(name, partial(expect, model))


def force_error(score: TransferScore) -> float:
    """Return the squared force error in windows over the base model's, mean of the axes; infinite without a prediction."""
    return _mean(score.windows)


def row_error(score: TransferScore) -> float:
    """Return the same row by row."""
    return _mean(score.mse)


def _mean(ratios: Mapping[str, float | None]) -> float:
    values = [ratios.get(axis) for axis in AXES]
    known = [one for one in values if one is not None and isfinite(one)]
    return float(np.mean(known)) if known else float("inf")


def position_error(score: TransferScore) -> float:
    """Return the position error of free runs after 60 s [m]; infinite where there is none or a run diverged."""
    return float("inf") if score.position_m is None or score.diverged else score.position_m


def section(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the part of the page about second logs."""
    results = [result(one) for one in found]
    lines = [
        "\n## Second logs of the proof\n",
        f"{counted(len(results), 'case')} of `ferryid prove` (seed {SEED}), each learnt from its first log and judged on its "
        "second. *Force*: squared error of the acceleration, averaged over windows and as a force on the mass in the profile, "
        "as `fit` is judged, over the base model's, mean of the axes. *Row by row*: squared error of the thrust that the "
        f"motion must have taken, with the noise of velocities smoothed over {WINDOW_S:g} s, which is most of it; thesis and "
        "stepwise regression are fitted to rows with that very noise, and a method that takes thrusters and hull for half as "
        "strong has half that error with the same motion. *Position*: of free runs after 60 s over the "
        "base model's. All are medians; a model that there is not, or of which a run diverges, counts as infinite. *Best*: "
        f"logs on which it has the least error, or at most {NEAR:g} times that. *Ours over it*: position of the diagnosed "
        "model over that of the other, median. *True starts*: of free runs that begin with the true state of the vessel in "
        "place of the measured one. Output error and `fit` have the same terms; sparse regressions choose from "
        "physics, too.",
        "",
        "| model | force | row by row | position | ours over it | best, force | best, position | best, true starts | "
        "no model or diverged |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    truly = [np.mean(one) for one in zip(*(best_truly(each) for each in found), strict=True)]
    ours = np.array([position_error(one.methods[DIAGNOSED]) for one in results])
    for place, name in enumerate(results[0].methods):
        force = np.array([force_error(one.methods[name]) for one in results])
        position = np.array([position_error(one.methods[name]) for one in results])
        rows = np.array([row_error(one.methods[name]) for one in results])
        base = np.array([one.base.position_m or np.nan for one in results])
        first = [np.mean(best(results, name, measure)) for measure in (force_error, position_error)]
        title = "diagnosed and learnt (`diagnose`)" if name == DIAGNOSED else name
        lines.append(
            f"| {title} | {np.median(force):.2f} | {np.median(rows):.2f} | {np.nanmedian(position / base):.2f} | "
            f"{np.median(ours / position):.2f} | {100 * first[0]:.0f} % | {100 * first[1]:.0f} % | "
            f"{100 * truly[place]:.0f} % | {int(np.sum(~np.isfinite(position)))} |"
        )
    truth = [
        100.0 * truly[list(results[0].methods).index(DIAGNOSED)],
        float(np.median([_over_rival(one) for one in found])),
    ]
    lines += [
        "",
        "Free runs begin with the measured velocity, heading and yaw rate, whose noise is carried on for a minute by every "
        f"model alike. From the true states the diagnosed model is best or within 5 % on {truth[0]:.0f} % of the logs, and its "
        f"position error is {truth[1]:.2f} of the best rival's in the median. The best rival is another one from log to log, "
        "and is known afterwards only.",
    ]
    return lines + _log_by_log(found, results)


def _true_errors(plain: Mapping[str, Any]) -> dict[str, float]:
    """Return the errors of free runs from true states by method, infinite where there is none, in the order of the methods."""
    known = plain["true_starts_m"]
    return {name: float("inf") if known.get(name) is None else float(known[name]) for name in plain["methods"]}


def best_truly(plain: Mapping[str, Any]) -> list[bool]:
    errors = list(_true_errors(plain).values())
    return [one <= NEAR * min(errors) for one in errors]


def _over_rival(plain: Mapping[str, Any]) -> float:
    errors = _true_errors(plain)
    rival = min(error for name, error in errors.items() if name not in (DIAGNOSED, FIT))
    return errors[DIAGNOSED] / rival if isfinite(rival) else 0.0


def _log_by_log(found: Sequence[Mapping[str, Any]], results: Sequence[TransferResult]) -> list[str]:
    """Return each log: what was concealed, what the diagnosed model has of it, and how this stands beside the best other."""
    lines = [
        "",
        "Log by log: *in the model* are the effects in the stored model, hints that predict among them. Errors are those of "
        "the diagnosed model over those of the best other.",
        "",
        "| case | concealed | in the model | force | best other | position | best other |",
        "|---|---|---|--:|---|--:|---|",
    ]
    lost, missed = 0, 0
    for plain, one in zip(found, results, strict=True):
        ours, others = one.methods[DIAGNOSED], {name: s for name, s in one.methods.items() if name != DIAGNOSED}
        known = [effect.effect for effect in ours.effects or ()]
        cells = [str(plain["cell"]), ", ".join(plain["concealed"]) or "nothing", ", ".join(known) or "nothing"]
        for measure in (force_error, position_error):
            name = min(others, key=lambda each, measure=measure: measure(others[each]))  # type: ignore[misc]
            least = measure(others[name])
            cells += [f"{measure(ours) / least:.2f}" if isfinite(least) else "0", name if isfinite(least) else "none"]
        lines.append(f"| {' | '.join(cells)} |")
        if force_error(ours) > NEAR * min(map(force_error, others.values())):
            lost, missed = lost + 1, missed + (not set(plain["concealed"]) <= set(known))
    lines += [
        "",
        f"On {counted(lost, 'log')} another model has the least force error; in {missed} of them the diagnosed one lacks some "
        "of what was concealed. Sparse and stepwise regression take what lowers the error.",
    ]
    return lines


def targets(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what is aimed at on second logs and what was reached, as rows of a table."""
    results = [result(one) for one in found]
    rows = []
    for what, measure in (("force", force_error), ("free run", position_error)):
        share = 100.0 * float(np.mean(best(results, DIAGNOSED, measure)))
        met = _reached(share >= 90.0, len(results))
        rows.append(
            f"| second logs: diagnosed model best or within 5 %, {what}, on 90 % | {met} | "
            f"{share:.0f} % of {len(results)} logs |"
        )
    ratios = []
    for one in results:
        rival = min(position_error(score) for name, score in one.methods.items() if name not in (DIAGNOSED, FIT))
        ratios.append(position_error(one.methods[DIAGNOSED]) / rival if isfinite(rival) else 0.0)
    median = float(np.median(ratios))
    met = _reached(median <= 0.8, len(results))
    rows.append(f"| second logs: position after 60 s at most 0.8 of the best rival's | {met} | median {median:.2f} |")
    return rows


def _reached(good: bool, logs: int) -> str:
    return "too few logs" if logs < FEWEST else "yes" if good else "no"


def best(results: Sequence[TransferResult], name: str, measure: Any) -> list[bool]:
    out = []
    for one in results:
        least = min(measure(score) for score in one.methods.values())
        out.append(measure(one.methods[name]) <= NEAR * least if isfinite(least) else True)
    return out


def result(plain: Mapping[str, Any]) -> TransferResult:
    return TransferResult.from_json({name: value for name, value in plain.items() if name not in OF_CASE})
