"""From a log to a diagnosis, in the order in which an expert would go about it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import exp
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
from ferryid.diagnose.evidence import Evidence, Improvement, evidence, force_errors
from ferryid.diagnose.free_runs import FreeRuns
from ferryid.diagnose.hypothesis import Fit, Suspect, Trial, fit, imagined, settled, trial_of
from ferryid.diagnose.learnt import learnt
from ferryid.diagnose.locate import locate
from ferryid.diagnose.result import AXES, Diagnosis, Estimate, Finding, Rival, Withheld
from ferryid.diagnose.scene import Survey, plain_picture, scene_of, window_lengths
from ferryid.diagnose.search import NEAR, ODDS, search, suspects_of
from ferryid.diagnose.separate import manoeuvre
from ferryid.diagnose.shown import columns_of, regressor_of
from ferryid.diagnose.testable import advice, powers, tells, unexcited
from ferryid.diagnose.together import Together, together
from ferryid.diagnose.unknown import impostors, unknown_of
from ferryid.diagnose.unsteady import findings_of
from ferryid.diagnose.weak import Windows, windows
from ferryid.effects.picture import Scene
from ferryid.errors import FerryIdError
from ferryid.identify.model import Model
from ferryid.vessel.profile import Profile

FEWEST_WINDOWS = 60
"""Windows below which nothing is tested."""
SHOWN_RIVALS = 3
OUT_OF_STEP = ("time_delay", "thruster_lag")
"""Effects that a controller's answer to unmeasured, unsteady disturbances looks like."""
MERE_HINT = 0.5
"""Probability above which no force is named where the hull is known from nothing but the log that shows it."""
ONSET_DROP = 50.0
"""Fall of the logarithm of the evidence as of which no onset farther away comes into question; smaller dips may lie between."""
ONSET_STEP, ONSET_FIT = 0.125, 2
"""Step between onsets that are weighed, in lengths of a window, and steps of the fit for each."""
WITHHELD_EFFECTS = {"wind": "wind", "current": "current", "payload": "payload"}


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
    return tuple(_one(path, profile, out, model, simulated, common, withhold, verify, progress) for path in logs)


def _one(
    path: str,
    profile: Profile,
    out: Path | None,
    model: Model | None,
    simulated: Simulated | None,
    common: Together | None,
    withhold: Sequence[str],
    verify: bool,
    progress: Callable[[str], None],
) -> Diagnosis:
    scene, survey = scene_of(path, profile, out, withhold=withhold, verify=verify, progress=progress)
    progress("checking the sensors against each other")
    sensors, scene = examine(scene)
    seen = windows(scene, *window_lengths(profile))
    name = survey.motion.log
    notes = list(survey.doubts)
    if len(seen.starts) < FEWEST_WINDOWS:
        notes.append(
            f"Only {len(seen.starts)} stretches of {window_lengths(profile)[0]:.0f} s without a gap: too little to tell. "
            "Record at least ten minutes that excite every axis."
        )
        return Diagnosis(name, profile.name, "not_testable", _of_sensors(sensors), {}, {}, tuple(notes))
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
    trial = trial_of(seen, plain, spread)
    found = search(trial, progress, known=library)
    trial, kept = found.trial, found.fit
    progress("judging on held-out stretches")
    proof = evidence(trial, kept) if kept.suspects else None
    if proof is not None:
        kept, proof, dropped = _proved(trial, kept, proof)
        notes += dropped
    progress("looking for what has no name")
    kept, proof, told = _without_impostors(trial, kept, proof)
    notes += told
    base = fit(trial, ())
    unknown = unknown_of(trial, kept, scene)
    progress("locating")
    steady = [suspect for suspect in library if suspect.effect.unsteady is None]
    forces = _findings(steady, trial, base, kept, proof, scene)
    if model is None and common is None and not profile.hull.has_model:
        forces = [hinted(one) for one in forces]
        notes.append(
            "The profile has no hull model: damping and added mass were fitted to this log beside the findings, which can "
            f"stand in for what a hull model would explain. Take them as hints, of probability {MERE_HINT:g} at most."
        )
    shaken = findings_of(trial, found.states)
    if model is None and not profile.hull.has_model:
        # Its own motion, too, is only guessed at: what shakes it may be its measurement.
        shaken = tuple(hinted(one) for one in shaken)
    named = [*forces, *shaken]
    findings = [*_of_sensors(sensors), *named]
    chances, still = powers(trial, kept, steady), unexcited(trial)
    notes += [f"{effect}: not tested, {reason}." for effect, reason in found.untested.items()]
    notes += advice(chances, still)
    if unknown.unsteady or found.states:
        findings = [_doubted(one) for one in findings]
    verdict = _verdict(bool(findings), bool(unknown.findings), tells(chances, still))
    findings += unknown.findings
    before, after = _scores(trial, base, kept, proof)
    return Diagnosis(
        name,
        profile.name,
        verdict,
        tuple(findings),
        before,
        after,
        tuple(notes),
        evidence=_leftover(trial, base, kept),
        located=locate(trial, base, kept, scene) if kept.suspects else unknown.left,
        withheld=_withheld(survey, scene, findings),
        against=compared,
        # A simulation's hull is not the vessel's, and the lift of a common one is in no model file.
        learnt=learnt(trial, kept, findings, survey) if simulated is None and common is None else None,
    )


def hinted(finding: Finding) -> Finding:
    """Return a finding of a force as it stands where the hull is known from nothing but the log that shows it."""
    return replace(
        finding,
        probability=min(finding.probability, MERE_HINT),
        unresolved_with=tuple(dict.fromkeys((*finding.unresolved_with, "hull_parameters"))),
        separating_manoeuvre="a log in calm air and still water, to fit a hull model first",
    )


def _doubted(finding: Finding) -> Finding:
    """Return a finding as it stands beside something unsteady that nobody measured.

    A controller answers every gust some time after it has moved the vessel, so that force and motion seem to be out of step.
    """
    if finding.effect not in OUT_OF_STEP:
        return finding
    return replace(
        finding,
        probability=min(finding.probability, 0.5),
        unresolved_with=(*finding.unresolved_with, "gusts"),
        separating_manoeuvre="the same manoeuvres in calm air",
    )


def _verdict(found: bool, more: bool, telling: bool) -> str:
    if found:
        return "partly_explained" if more else "explained"
    if not telling:
        return "not_testable"
    return "unexplained" if more else "matched"


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


def _proved(trial: Trial, kept: Fit, proof: Evidence) -> tuple[Fit, Evidence | None, list[str]]:
    """Drop what does not help on held-out data, or no more than a placebo, and judge the rest again."""
    told = []
    holds = []
    for one in proof.proofs:
        if one.holds:
            holds.append(one.suspect)
        else:
            told.append(
                f"{one.suspect.effect.title} was suspected, but does not improve held-out stretches beyond what a placebo "
                "does: it is no finding."
            )
    if not told:
        return kept, proof, told
    start = [values for suspect, values in zip(kept.suspects, kept.values, strict=True) if suspect in holds]
    again = fit(trial, holds, start)
    return again, evidence(trial, again) if holds else None, told


def _without_impostors(trial: Trial, kept: Fit, proof: Evidence | None) -> tuple[Fit, Evidence | None, list[str]]:
    """Drop what an empirical law in its place makes idle: physics without a name here may look a little like an effect."""
    told = []
    while idle := impostors(trial, kept):
        title = kept.suspects[idle[0]].effect.title
        told.append(
            f"{title} was suspected, but a law in its place explains more and leaves it nothing: it is no finding."
        )
        holds = [suspect for i, suspect in enumerate(kept.suspects) if i != idle[0]]
        kept = fit(trial, holds, [values for i, values in enumerate(kept.values) if i != idle[0]])
        proof = evidence(trial, kept) if holds else None
    return kept, proof, told


def _findings(
    library: Sequence[Suspect], trial: Trial, base: Fit, kept: Fit, proof: Evidence | None, scene: Scene
) -> list[Finding]:
    made = []
    for i, suspect in enumerate(kept.suspects):
        others = [j for j in range(len(kept.suspects)) if j != i]
        rest = [kept.suspects[j] for j in others]
        without = fit(trial, rest, [kept.values[j] for j in others])
        rivals, probability = _rivals(trial, suspect, kept, rest, without, library)
        unresolved = tuple(
            dict.fromkeys(
                rival.effect for rival in rivals if rival.delta_score > -NEAR and rival.effect != suspect.effect.id
            )
        )
        # The hull stays as it is with the finding: refitted without, it would bend to it on axes where it does not act.
        bare = replace(kept, suspects=tuple(rest), values=tuple(kept.values[j] for j in others))
        place = locate(trial, bare, kept, scene)
        estimates = _estimates(trial, suspect, kept, i)
        if not estimates:
            # Every one of its parameters may be too near the neutral value to be worth a name: the hull's, for one.
            continue
        named = zip((p.name for p in suspect.parameters), kept.values[i].tolist(), strict=True)
        values = {name: value for name, value in named if name in estimates}
        if suspect.effect.onset:
            values["onset"] = estimates["onset"].value if "onset" in estimates else suspect.onset_s
        improved = None if proof is None else proof.proofs[i].improvement
        made.append(
            Finding(
                effect=suspect.effect.id,
                instance=suspect.instance,
                probability=probability,
                parameters=estimates,
                axes=dict(zip(AXES, place.shares.tolist(), strict=True)),
                intervals=_intervals(trial, estimates),
                onset_s=estimates["onset"].value if "onset" in estimates else None,
                regime=place.regime,
                improvement={} if improved is None else dict(zip(AXES, improved.removed.tolist(), strict=True)),
                held_out=improved is not None,
                rivals=rivals[:SHOWN_RIVALS],
                unresolved_with=unresolved,
                separating_manoeuvre=manoeuvre(suspect.effect.id, unresolved),
                says=suspect.effect.says(values, suspect.instance),
                **columns_of(trial, place, regressor_of(suspect, imagined(trial.plain, bare), kept.values[i], place)),
            )
        )
    return sorted(made, key=lambda one: -sum(one.improvement.values()))


def _rivals(
    trial: Trial, suspect: Suspect, kept: Fit, rest: Sequence[Suspect], without: Fit, library: Sequence[Suspect]
) -> tuple[tuple[Rival, ...], float]:
    """Return what else could stand in a finding's place, the nearest first, and how probable the finding is."""
    taken = {one.key for one in kept.suspects}
    rivals = []
    for other in library:
        if other.key in taken:
            continue
        begins = replace(other, onset_s=suspect.onset_s if other.effect.onset else 0.0)
        stand_in = settled(trial, without, begins)
        neutral = np.array([parameter.neutral for parameter in stand_in.parameters])
        made = fit(trial, [*rest, stand_in], [*without.values, neutral])
        rivals.append(Rival(other.effect.id, other.instance, made.evidence - kept.evidence))
    rivals.sort(key=lambda one: -one.delta_score)
    none = without.evidence - kept.evidence + ODDS
    against = exp(min(none, 50.0)) + sum(exp(min(one.delta_score, 50.0)) for one in rivals)
    return tuple(rivals), 1.0 / (1.0 + against)


def _estimates(trial: Trial, suspect: Suspect, kept: Fit, index: int) -> dict[str, Estimate]:
    error = kept.errors(index)
    estimates = {}
    for parameter, value, spread in zip(suspect.parameters, kept.values[index].tolist(), error.tolist(), strict=True):
        low, high = max(value - 1.96 * spread, parameter.low), min(value + 1.96 * spread, parameter.high)
        least = suspect.effect.least
        if least > 0.0 and low < parameter.neutral + least and high > parameter.neutral - least:
            continue
        estimates[parameter.name] = Estimate(value, low, high, parameter.unit)
    if suspect.onset_s > 0.0:
        estimates["onset"] = _onset(trial, kept, index)
    return estimates


def _onset(trial: Trial, kept: Fit, index: int) -> Estimate:
    """Return when an effect began, as the median of its posterior with the interval: an idle thruster hides its fault."""
    suspect = kept.suspects[index]
    times = trial.windows.middle_s
    step = ONSET_STEP * len(trial.windows.weight) * trial.windows.scene.step_s

    def evidence_at(onset: float) -> float:
        moved = [replace(one, onset_s=onset) if i == index else one for i, one in enumerate(kept.suspects)]
        return fit(trial, moved, kept.values, steps=ONSET_FIT).evidence

    tried = {suspect.onset_s: evidence_at(suspect.onset_s)}
    for side in (-1.0, 1.0):
        onset = suspect.onset_s + side * step
        while times[0] < onset < times[-1]:
            tried[onset] = evidence_at(onset)
            if tried[onset] < max(tried.values()) - ONSET_DROP:
                break
            onset += side * step
    onsets = np.array(sorted(tried))
    weights = np.exp(np.array([tried[onset] for onset in onsets.tolist()]) - max(tried.values()))
    # Each onset stands for the step about it.
    shares = np.concatenate([[0.0], np.cumsum(weights) / weights.sum()])
    edges = np.concatenate([onsets - 0.5 * step, onsets[-1:] + 0.5 * step])
    low, middle, high = np.interp([0.025, 0.5, 0.975], shares, edges).tolist()
    return Estimate(middle, max(low, 0.0), high, "s")


def _intervals(trial: Trial, estimates: Mapping[str, Estimate]) -> tuple[tuple[float, float], ...]:
    t = trial.windows.scene.t
    begun = estimates["onset"].value if "onset" in estimates else 0.0
    return ((max(begun, float(t[0])), float(t[-1])),)


def _scores(trial: Trial, base: Fit, kept: Fit, proof: Evidence | None) -> tuple[dict[str, Any], dict[str, Any]]:
    if proof is None:
        errors = force_errors(trial.windows, imagined(trial.plain, base), trial.plain)
        mse = dict(zip(AXES, np.mean(errors**2, axis=0).tolist(), strict=True))
        return {"mse": mse, "rows": len(errors)}, {"mse": mse}
    whole: Improvement = proof.whole
    before: dict[str, Any] = {
        "mse": dict(zip(AXES, whole.mse_before.tolist(), strict=True)),
        "rows": len(whole.before),
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


def _withheld(survey: Survey, scene: Scene, findings: Sequence[Finding]) -> tuple[Withheld, ...]:
    made = []
    for signal, hidden in survey.hidden.items():
        mean = np.nanmean(hidden[scene.usable], axis=0)
        found = next((one for one in findings if one.effect == WITHHELD_EFFECTS.get(signal)), None)
        names = ("mass", "x") if signal == "payload" else ("north", "east")
        measured = dict(zip(names, mean.tolist(), strict=True))
        shown = ", ".join(f"{name} {value:.2f}" for name, value in measured.items())
        told = (
            "nothing of it was found"
            if found is None
            else "found: " + ", ".join(f"{name} {found.parameters[name].value:.2f}" for name in names)
        )
        made.append(
            Withheld(
                signal,
                {} if found is None else {name: found.parameters[name] for name in names},
                measured,
                f"{signal} was hidden; measured on average: {shown}; {told}.",
            )
        )
    return tuple(made)
