"""From a log to a diagnosis, in the order in which an expert would go about it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.diagnose.against import (
    Paths,
    Simulated,
    base_picture,
    differing,
    differing_sensors,
    learn,
    paths,
    plain_against,
)
from ferryid.diagnose.checks import examine
from ferryid.diagnose.checks.check import SensorFinding
from ferryid.diagnose.evidence import Evidence, Improvement, force_errors
from ferryid.diagnose.free_runs import FreeRuns
from ferryid.diagnose.hints import about_nothing, beside_gusts, beside_more, hint, on_a_guessed_hull
from ferryid.diagnose.hypothesis import Fit, Suspect, Trial, fit, imagined, trial_of
from ferryid.diagnose.judged import Judged, judged
from ferryid.diagnose.learnt import learnt
from ferryid.diagnose.locate import locate
from ferryid.diagnose.named import forces_of, removed
from ferryid.diagnose.noisy import drowned_axes, says_drowned
from ferryid.diagnose.result import AXES, HINT, Diagnosis, Finding, Moved
from ferryid.diagnose.scene import Survey, plain_picture, scene_of, window_lengths
from ferryid.diagnose.search import Search, search, suspects_of
from ferryid.diagnose.shared_findings import agreed
from ferryid.diagnose.shared_laws import Heard, heard
from ferryid.diagnose.testable import advice, powers, says_untested, tells, unexcited
from ferryid.diagnose.together import Together, together
from ferryid.diagnose.unknown import unknown_of
from ferryid.diagnose.unsteady import unsteady_of
from ferryid.diagnose.weak import Windows, windows
from ferryid.diagnose.withheld import withheld as withheld_beside
from ferryid.effects.picture import COEFFICIENTS, UNITS, Scene
from ferryid.errors import FerryIdError
from ferryid.models import Model
from ferryid.vessel.profile import Profile

FEWEST_WINDOWS = 60
"""Windows below which nothing is tested."""


def diagnose(
    logs: Sequence[str],
    profile: Profile,
    out: Path | None,
    *,
    model: Model | None = None,
    against: str | None = None,
    shared: bool = False,
    withhold: Sequence[str] = (),
    verify: bool = False,
    progress: Callable[[str], None],
) -> tuple[Diagnosis, ...]:
    """Say of every log which physics the model left out, and what shows it.

    Parameters
    ----------
    logs
        Paths; parts of one recording joined by ``+``.
    profile
        The vessel.
    out
        Output folder, whose ``logs`` keep the ingested tables; None keeps none.
    model
        A fitted model to examine; the profile's hull where None.
    against
        Path of a simulated log of the trial: what is found is the difference to that simulation.
    shared
        Fit one hull to all logs first, and diagnose each with what the others say of it.
    withhold
        Signals to hide from the diagnosis.
    verify
        Check every checksum.
    progress
        Called with the name of each stage.

    Raises
    ------
    FerryIdError
        For input that cannot be used.
    """
    if against is not None and model is not None:
        raise FerryIdError(
            "diagnose: a recording is held against one thing at a time, found both --model and --against. "
            "Fix: leave out one of the two"
        )
    if shared and (against is not None or model is not None):
        raise FerryIdError(
            "diagnose: --together finds the hull in the logs, found --model or --against as well, which bring their own. "
            "Fix: leave out one of the two"
        )
    common = together(logs, profile, out, withhold=withhold, verify=verify, progress=progress) if shared else None
    simulated = None if against is None else learn(against, profile, out, verify=verify, progress=progress)
    begun: Iterable[_Begun] = (
        _begun(path, profile, out, model, simulated, common, withhold, verify, progress) for path in logs
    )
    laws: Mapping[str, Heard] = {}
    if common is not None:
        begun = tuple(begun)
        progress("looking for laws that hold in all logs")
        laws = heard({one.path: (one.found.trial, one.stands.fit) for one in begun if isinstance(one, _Examined)})
    made = tuple(
        one if isinstance(one, Diagnosis) else _ended(one, laws.get(one.path), model, simulated, common, progress)
        for one in begun
    )
    return made if common is None else agreed(made)


@dataclass(frozen=True)
class _Examined:
    """A log of which everything with a name was found, with what is needed to tell the rest."""

    path: str
    scene: Scene
    survey: Survey
    sensors: tuple[SensorFinding, ...]
    notes: list[str]
    compared: dict[str, Any]
    steady: list[Suspect]
    found: Search
    stands: Judged


_Begun = Diagnosis | _Examined
"""A diagnosis, of a log too short for more than its sensors, or what is to become one."""


def _begun(
    path: str,
    profile: Profile,
    out: Path | None,
    model: Model | None,
    simulated: Simulated | None,
    common: Together | None,
    withhold: Sequence[str],
    verify: bool,
    progress: Callable[[str], None],
) -> _Begun:
    scene, survey = scene_of(path, profile, out, withhold=withhold, verify=verify, progress=progress)
    progress("checking the sensors against each other")
    sensors, scene = examine(scene)
    seen = windows(scene, *window_lengths(profile))
    notes = [*survey.doubts, *survey.left_out, *_of_actuators(survey, profile)]
    if len(seen.starts) < FEWEST_WINDOWS:
        notes.append(
            f"Only {len(seen.starts)} stretches of {window_lengths(profile)[0]:.0f} s without a gap: too little to tell. "
            "Record at least ten minutes that excite every axis."
        )
        return Diagnosis(
            survey.motion.log,
            profile.name,
            "not_testable",
            _of_sensors(sensors),
            {},
            {},
            tuple(notes),
            duration_s=_duration_s(scene),
        )
    if simulated is None:
        plain, spread = plain_picture(seen.scene, profile, model, survey.recording.sha256)
        library = suspects_of(seen.scene)[0]
        compared = {}
        if common is not None:
            plain, spread = common.picture(path, plain)
            notes.append(common.says(path))
    else:
        path_errors = paths(simulated.scene, scene)
        shift_s = path_errors.shift_s if isinstance(path_errors, Paths) else 0.0
        plain, spread = base_picture(simulated, seen.scene, shift_s)
        library = differing(simulated, seen.scene, shift_s)
        compared = plain_against(simulated, path_errors)
        sensors, told = differing_sensors(simulated, sensors, scene)
        notes += [compared["says"], *told]
    found = search(trial_of(seen, plain, spread), progress, known=library)
    steady = [suspect for suspect in library if suspect.effect.unsteady is None]
    stands = judged(found.trial, found.fit, steady, progress)
    notes += stands.told
    return _Examined(path, scene, survey, tuple(sensors), notes, compared, steady, found, stands)


def _ended(
    log: _Examined,
    laws: Heard | None,
    model: Model | None,
    simulated: Simulated | None,
    common: Together | None,
    progress: Callable[[str], None],
) -> Diagnosis:
    scene, survey, stands, found, notes = log.scene, log.survey, log.stands, log.found, list(log.notes)
    profile, trial, kept, proof = scene.profile, found.trial, stands.fit, stands.proof
    base = fit(trial, ())
    progress("looking for what has no name")
    unknown = unknown_of(trial, kept, scene, laws)
    progress("locating")
    forces, hints = forces_of(trial, stands, scene)
    notes += hints
    shares = removed(trial, stands)
    forces, told = beside_more(forces, shares, unknown.holds)
    notes += told
    if model is None and common is None and not profile.hull.has_model:
        forces = [on_a_guessed_hull(one) for one in forces]
        notes.append(
            "The profile has no hull model: damping and added mass were fitted to this log beside the findings, which can "
            f"stand in for what a hull model would explain. Take them as hints, of probability {HINT:g} at most."
        )
    shaken = about_nothing(unsteady_of(trial, kept, found.states, scene), forces)
    if model is None and not profile.hull.has_model:
        # Its own motion, too, is only guessed at: what shakes it may be its measurement.
        shaken = [on_a_guessed_hull(one) for one in shaken]
    named, nameless = [*forces, *shaken], list(unknown.findings)
    if drowned := drowned_axes(trial):
        notes.append(says_drowned(drowned))
        named, nameless = ([hint(one) for one in every] for every in (named, nameless))
    findings = [*_of_sensors(log.sensors), *named]
    chances, still = powers(trial, kept, log.steady), unexcited(trial)
    notes += says_untested(found.untested)
    notes += advice(chances, still)
    if unknown.unsteady or found.states:
        findings = [beside_gusts(one, shares) for one in findings]
    sure = [one for one in findings if one.sure]
    # What was suspected on strong evidence and fell to a placebo or a law has a cause, known or not.
    more = bool(nameless) or bool(stands.told) or len(sure) < len(findings)
    verdict = _verdict(bool(sure), more, tells(chances, still))
    findings += nameless
    before, after = _scores(trial, base, kept, proof)
    return Diagnosis(
        survey.motion.log,
        profile.name,
        verdict,
        tuple(findings),
        before,
        after,
        tuple(notes),
        evidence=_leftover(trial, base, kept),
        located=locate(trial, base, kept, scene) if kept.suspects else unknown.left,
        withheld=withheld_beside(survey.hidden, scene, findings),
        against=log.compared,
        moved=_moved(trial, kept) if kept.suspects else None,
        duration_s=_duration_s(scene),
        # A simulation's hull is not the vessel's, and the lift of a common one is in no model file.
        learnt=learnt(trial, kept, found.states, findings, survey) if simulated is None and common is None else None,
    )


def _verdict(found: bool, more: bool, telling: bool) -> str:
    if found:
        return "partly_explained" if more else "explained"
    if not telling:
        return "not_testable"
    return "unexplained" if more else "matched"


def _of_actuators(survey: Survey, profile: Profile) -> list[str]:
    """Return what was noted of single actuators: speeds beyond the thrust curve, or never near it."""
    names = tuple(f"{actuator.name}{end}" for actuator in profile.actuators for end in (": ", " never "))
    return [one for one in survey.motion.repairs if one.startswith(names)]


def _of_sensors(sensors: Sequence[SensorFinding]) -> tuple[Finding, ...]:
    """Return what the checks found as findings: kinematics alone shows them, so that no force is improved."""
    return tuple(
        Finding(
            effect=one.effect,
            instance=None,
            probability=1.0,
            parameters=one.parameters,
            axes=dict.fromkeys(AXES, 0.0),
            intervals=(),
            onset_s=None,
            regime="",
            improvement={},
            held_out=False,
            rivals=(),
            unresolved_with=(),
            separating_manoeuvre=None,
            says=one.says,
        )
        for one in sensors
    )


def _scores(trial: Trial, base: Fit, kept: Fit, proof: Evidence | None) -> tuple[dict[str, Any], dict[str, Any]]:
    window_s = len(trial.windows.weight) * trial.windows.scene.step_s
    if proof is None:
        errors = force_errors(trial.windows, imagined(trial.plain, base), trial.plain)
        mse = dict(zip(AXES, np.mean(errors**2, axis=0).tolist(), strict=True))
        return {"mse": mse, "rows": len(errors), "window_s": window_s}, {"mse": mse}
    whole: Improvement = proof.whole
    before: dict[str, Any] = {
        "mse": dict(zip(AXES, whole.mse_before.tolist(), strict=True)),
        "rows": len(whole.before),
        "window_s": window_s,
        "free_run": _free_run(proof.free_runs, proof.free_runs.before),
    }
    after: dict[str, Any] = {
        "mse": dict(zip(AXES, whole.mse_after.tolist(), strict=True)),
        "ratio": {
            axis: {"value": 1.0 - float(removed), "low": 1.0 - float(high), "high": 1.0 - float(low)}
            for axis, removed, low, high in zip(AXES, whole.removed, whole.low, whole.high, strict=True)
        },
        "free_run": _free_run(proof.free_runs, proof.free_runs.after),
    }
    return before, after


def _moved(trial: Trial, kept: Fit) -> Moved | None:
    """Return the hull's coefficient that the refit moved farthest; None where none could move."""
    free = trial.hull_spread > 0.0
    if not free.any():
        return None
    away = np.divide(kept.hull - trial.plain.hull, trial.hull_spread, out=np.zeros_like(kept.hull), where=free)
    k = int(np.argmax(np.abs(away)))
    return Moved(COEFFICIENTS[k], UNITS[k], float(trial.plain.hull[k]), float(kept.hull[k]), float(away[k]))


def _duration_s(scene: Scene) -> float:
    return float(scene.t[-1] - scene.t[0])


def _free_run(runs: FreeRuns, errors: np.ndarray[Any, np.dtype[np.float64]]) -> dict[str, Any]:
    if runs.starts == 0:
        return {}
    names = ("position_m", "heading_rad", "speed_mps", "yaw_rate_radps")
    columns = {name: errors[:, k].tolist() for k, name in enumerate(names)}
    return {"horizons_s": runs.horizons_s.tolist(), **columns, "starts": runs.starts, "note": ""}


def _leftover(trial: Trial, base: Fit, kept: Fit) -> dict[str, Any]:
    seen: Windows = trial.windows
    psi = seen.mean(seen.scene.psi[:, None])[:, 0]
    speed = seen.mean(np.hypot(seen.scene.nu[:, 0], seen.scene.nu[:, 1])[:, None])[:, 0]
    return {
        "t": seen.middle_s,
        "before": force_errors(seen, imagined(trial.plain, base), trial.plain),
        "after": force_errors(seen, imagined(trial.plain, kept), trial.plain),
        "heading": np.degrees(np.mod(psi, 2.0 * np.pi)),
        "speed": speed,
    }
