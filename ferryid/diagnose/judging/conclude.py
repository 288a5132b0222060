"""The conclusion: confidence rules applied, a verdict derived, and all that was found of a log put together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.checks import checks
from ferryid.diagnose.checks.screening import ScreenedLog
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fitted_force_model
from ferryid.diagnose.inference.force_errors import force_errors, mass_of
from ferryid.diagnose.inference.stages import AveragedLog, Baseline
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging.campaign import JudgedCampaign
from ferryid.diagnose.judging.campaign_posterior import campaign_posterior
from ferryid.diagnose.judging.claims import Claim, Key, LogFigures
from ferryid.diagnose.judging.confidence_rules import apply_rules, lasting, log_notes, predictive
from ferryid.diagnose.judging.credibility import RefittedHull, impossible_throughout, refitted_hull
from ferryid.diagnose.judging.detection_power import (
    detection_powers,
    is_testable,
    recording_advice,
    unexcited_axes,
    untested_notes,
)
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.free_runs import FreeRuns
from ferryid.diagnose.judging.held_out import HeldOutEvidence, Improvement
from ferryid.diagnose.judging.hidden_signal import compare_hidden_signals
from ferryid.diagnose.judging.judge import JudgedLog, sensor_claims
from ferryid.diagnose.judging.least_sizes import least_sizes
from ferryid.diagnose.judging.likeness import likeness_of_logs
from ferryid.diagnose.judging.locate import locate, locate_between
from ferryid.diagnose.judging.posterior import Posterior, posterior_of
from ferryid.diagnose.judging.verdict import Remainder, verdict_of
from ferryid.effects import effects
from ferryid.effects.wording import listed, uncapitalised
from ferryid.signals.time_ranges import ranges_of
from ferryid.types import AXES, Floats
from ferryid.vessel import given_as
from ferryid.vessel.circumstances import Circumstances
from ferryid.vessel.order_response import orders_alone
from ferryid.vessel.profile import Profile

TEN_MINUTES = {
    "": "Record at least ten minutes that excite every axis.",
    "tank": "Record further runs that excite every axis, ten minutes in all, and give all of them together.",
}
"""What to record where a log is too short; by setting, the empty one for any other. A tank's length ends a run."""


def conclude(
    logs: Sequence[AveragedLog],
    judged: Sequence[JudgedLog],
    baseline: Baseline,
    together: JudgedCampaign | None = None,
    left_out: tuple[str, ...] = (),
) -> tuple[Diagnosis, ...]:
    """Return the diagnoses of the logs of a campaign.

    Parameters
    ----------
    logs
        All of them, in the order in which they were given.
    judged
        Those that are long enough.
    baseline
        What they are compared with.
    together
        What the logs of a campaign say together; None of one log.
    left_out
        Why other logs of it could not be used, and what else there is to know of which take part, as sentences.
    """
    by_path = {one.selected.path: one for one in judged}
    claims = {
        one.path: (
            *(() if together is None else together.claims(one.path)),
            *(by_path[one.path].claims if one.path in by_path else sensor_claims(one.screened)),
        )
        for one in logs
    }
    noted = (*left_out, *(() if together is None else together.notes))
    campaign = tuple(_lasting(claims[one.path]) for one in logs) if baseline.joint else ()
    shared = LogFigures(campaign=campaign)
    if together is not None:
        shared = replace(shared, weighed=together.weighed, common_hull_doubt=together.hull_doubt)
    single, of_all = likeness_of_logs(judged, together)
    found = tuple(
        _with_origin(
            _concluded(by_path[one.path], claims[one.path], shared, noted, together)
            if one.path in by_path
            else _too_short(one, claims[one.path], baseline, shared, noted, together),
            one,
            together,
        )
        for one in logs
    )
    return tuple(
        replace(one, likeness=single.get(log.path), likeness_of_all=of_all, gathered=left_out)
        for one, log in zip(found, logs, strict=True)
    )


def _with_origin(diagnosis: Diagnosis, log: AveragedLog, together: JudgedCampaign | None) -> Diagnosis:
    """Return a diagnosis with the path of its log, and with what the log teaches as one of a campaign."""
    screened = log.screened
    diagnosis = replace(
        diagnosis,
        path=log.path,
        profile=given_as(screened.measurements.profile),
        repairs=screened.measured.survey.repairs,
    )
    if together is None:
        return diagnosis
    survey = log.screened.measured.survey
    posterior = campaign_posterior(together, log.path, diagnosis.posterior, diagnosis.findings, survey)
    return replace(diagnosis, posterior=posterior)


def _lasting(claims: Sequence[Claim]) -> frozenset[Key]:
    return frozenset(one.finding.key for one in claims if one.finding.parameters and lasting(one.finding))


def _too_short(
    log: AveragedLog,
    claims: Sequence[Claim],
    baseline: Baseline,
    shared: LogFigures,
    noted: tuple[str, ...],
    together: JudgedCampaign | None,
) -> Diagnosis:
    screened = log.screened
    where = Circumstances.of(screened.measurements.profile)
    figures = replace(
        shared,
        joint=baseline.joint,
        hull_logs=baseline.hull_logs,
        baseline_sensors=baseline.sensors,
        circumstances=where,
    )
    findings, notes = apply_rules(claims, figures)
    profile, window_s = screened.measurements.profile, _window_s(log.windows.weight, log.windows.measurements.step_s)
    # Bags of seconds are welcome in a campaign that they have a say in.
    advice = (
        TEN_MINUTES.get(where.setting, TEN_MINUTES[""])
        if together is None or log.path not in together.hull.place
        else "What all logs say together of hull and properties holds for it too."
    )
    short = (
        f"Only {counted(len(log.windows.starts), 'window')} of {window_s:.0f} s, which overlap, are without a gap, and "
        f"{INFERENCE.fewest_windows} are needed: too few for a conclusion from this log alone. {advice}"
    )
    remainder = Remainder(testable=False)
    errors = None if together is None else together.errors(log.path, findings)
    before, after = ({}, {}) if errors is None else errors.scores(window_s)
    return Diagnosis(
        screened.measured.survey.used.log,
        profile.name,
        verdict_of(findings, remainder),
        findings,
        before,
        after,
        (*survey_notes(screened), *remedies(screened, findings), *noted, short, *notes),
        evidence=_measured(log.windows) if errors is None else _leftover(errors.windows, errors.before, errors.after),
        duration_s=_duration_s(screened),
        left_out=screened.measured.survey.used.left_out,
        remainder=remainder,
    )


def _concluded(
    log: JudgedLog,
    claims: Sequence[Claim],
    shared: LogFigures,
    noted: tuple[str, ...],
    together: JudgedCampaign | None,
) -> Diagnosis:
    selected, stands = log.selected, log.stands
    estimated = selected.estimated
    screened, problem, kept = estimated.averaged.screened, selected.search.problem, stands.fit
    measurements, survey = screened.measurements, screened.measured.survey
    figures = replace(
        log.figures,
        campaign=shared.campaign,
        weighed=shared.weighed,
        common_hull_doubt=shared.common_hull_doubt,
    )
    findings, rule_notes, posterior, wider = _confident(claims, figures, log)
    chances, still = detection_powers(problem, kept, selected.steady), unexcited_axes(problem)
    before, after = _scores(problem, log.base, kept, stands.proof)
    mse = after["mse"]
    errors = None if together is None else together.errors(selected.path, findings)
    leftover = [
        force_errors(problem.windows, fitted_force_model(problem.plain, one), problem.plain) for one in (log.base, kept)
    ]
    located = locate(problem, log.base, kept, measurements) if kept.candidates else log.unknown.left
    if together is not None and errors is not None:
        # What all logs confirm acts in the force model that the log is compared with: without it, there is more.
        if stands.proof is not None and kept.candidates:
            errors = errors.beside(stands.proof.whole.before, stands.proof.whole.after)
        before, after = _joined(errors.scores(before["window_s"]), (before, after))
        leftover = [errors.before, errors.after]
        if not kept.candidates and (models := together.force_models(selected.path)) is not None:
            located = locate_between(problem, models, measurements)
    ratio = {axis: Estimate(unit="-", **one) for axis, one in after.get("ratio", {}).items()}
    left = {axis: share for axis, share in _left_shares(problem, mse).items() if axis not in still}
    remainder = Remainder(is_testable(chances, still), bool(stands.dropped), ratio, left)
    notes = (
        *survey_notes(screened),
        *remedies(screened, findings),
        *drift_of_waves(findings),
        *estimated.expectation.notes,
        *noted,
        *stands.dropped,
        *log.unknown.notes,
        *rule_notes,
        *log_notes(figures),
        *untested_notes(selected.search.untested),
        *recording_advice(chances, still, log.figures.circumstances),
    )
    return Diagnosis(
        survey.used.log,
        measurements.profile.name,
        verdict_of(findings, remainder),
        findings,
        before,
        after,
        notes,
        evidence=_leftover(problem.windows, *leftover),
        located=located,
        withheld=compare_hidden_signals(survey.hidden, measurements, findings),
        against=estimated.expectation.comparison,
        moved=refitted_hull(problem, kept).farthest if kept.candidates else None,
        duration_s=_duration_s(screened),
        left_out=survey.used.left_out,
        posterior=posterior,
        wider=None if together is not None else wider,
        remainder=remainder,
        least_sizes=least_sizes(problem, kept, chances, {one.key for one in findings}),
    )


def _confident(
    claims: Sequence[Claim], figures: LogFigures, log: JudgedLog
) -> tuple[tuple[Finding, ...], tuple[str, ...], Posterior | None, Posterior | None]:
    """Return findings as the confidence rules leave them, notes, and the posteriors of the sure ones and of those that predict.

    The hull is refitted beside the sure findings alone. Where nobody modelled it and no axis has an inertia that is possible
    then, the doubtful ones had made up for forces that are not the vessel's, and the sure ones rest on the same forces.
    """
    selected = log.selected
    problem, screened = selected.search.problem, selected.estimated.averaged.screened

    def judged() -> tuple[tuple[Finding, ...], tuple[str, ...], Posterior | None, Posterior | None]:
        findings, notes = apply_rules(claims, figures)
        if not selected.estimated.baseline.updates_model:
            return findings, notes, None, None
        survey, states, known = screened.measured.survey, selected.search.states, figures.hull_known
        sure = posterior_of(problem, log.stands.fit, states, findings, survey, known=known)
        more = predictive(claims, figures) - {one.key for one in findings if one.sure}
        wider = None
        if more:
            wider = posterior_of(problem, log.stands.fit, states, findings, survey, known=known, predictive=more)
        return findings, notes, sure, wider

    first = judged()
    hull = None if first[2] is None else first[2].hull
    if hull is None or figures.hull_known or figures.hull_doubt:
        return first
    impossible = RefittedHull(impossible=impossible_throughout(screened.measurements.profile, hull.mean))
    if not impossible.doubt:
        return first
    figures = replace(figures, hull_doubt=impossible.doubt)
    return judged()


def remedies(log: ScreenedLog, findings: Sequence[Finding]) -> tuple[str, ...]:
    """Return which lines of the profile correct the sensors' errors that are sure, so that every command reads them right."""
    known, notes = {one.id: one for one in checks()}, []
    sure = {one.effect for one in findings if one.sure}
    for one in log.sensors:
        values = {name: estimate.value for name, estimate in one.parameters.items()}
        line = known[one.effect].in_profile(log.measurements.profile, values) if one.effect in sure & set(known) else ""
        if line:
            notes.append(f"{one.says.rstrip('.')}. In the profile, {line} corrects that for every command.")
    return (*notes, *order_remedies(log.measurements.profile, findings))


def order_remedies(profile: Profile, findings: Sequence[Finding]) -> tuple[str, ...]:
    """Return what a sure lag or delay means where no feedback goes with the orders, and a lead where the profile states these.

    The number is left to the fit: what follows an order is a speed, and the lag of a diagnosis is one of the force.
    """
    if not orders_alone(profile):
        return ()
    if stated := [one for one in profile.signals if one.states_response]:
        if not any(one.effect == "time_delay" and one.parameters["seconds"].value < 0.0 for one in findings):
            return ()
        return (
            f"The profile states how late the orders {listed([one.quantity for one in stated])} are followed: motion that "
            "precedes its force may mean that this is too long.",
        )
    late = {"thruster_lag": "time_constant", "time_delay": "seconds"}
    if not any(one.sure and one.effect in late and one.parameters[late[one.effect]].value > 0.0 for one in findings):
        return ()
    return (
        "The actuators are known by their orders alone, which they may follow late; a late navigation looks alike. ferryid fit "
        "estimates time_constant_s and delay_s of these orders where a log shows them, and prints the lines of the profile "
        "that state them for every command.",
    )


def drift_of_waves(findings: Sequence[Finding]) -> tuple[str, ...]:
    """Return that a sure steady load beside sure waves may hold some of their drift, which no effect has.

    Their mean force is of second order in their height (Faltinsen 1990, Sea loads on ships and offshore structures, chapter 5).
    """
    known = effects()
    sure = [known[one.effect] for one in findings if one.sure and one.effect in known]
    steady = list(dict.fromkeys(uncapitalised(one.title) for one in sure if one.of_log))
    if not steady or not any(one.id == "waves" for one in sure):
        return ()
    return (
        f"Waves push on average as well, mostly the way they run (drift, of second order in their height): the "
        f"{listed(steady)} that was found beside them may hold some of it.",
    )


def origin_note(sha256: str) -> tuple[str, ...]:
    """Return where the times of a diagnosis begin, for the hash of a recording whose start was cut off; else nothing."""
    ranges = ranges_of(sha256)
    if not ranges or ranges[0][0] <= 0.0:
        return ()
    return (f"Times are from the start of what was selected, {round(ranges[0][0], 1):.10g} s into the log.",)


def survey_notes(log: ScreenedLog) -> tuple[str, ...]:
    """Return what was noted of a log as it was read: doubts, rows left out, and actuators that leave their thrust curves."""
    survey = log.measured.survey
    names = tuple(
        f"{actuator.name}{end}" for actuator in log.measurements.profile.actuators for end in (": ", " never ")
    )
    return (
        *survey.doubts,
        *survey.averaged_out,
        *survey.left_out,
        *origin_note(survey.recording.sha256),
        *log.notes,
        *(one for one in survey.used.repairs if one.startswith(names)),
    )


def _scores(
    problem: EstimationProblem, base: Fit, kept: Fit, proof: HeldOutEvidence | None
) -> tuple[dict[str, Any], dict[str, Any]]:
    window_s = _window_s(problem.windows.weight, problem.windows.measurements.step_s)
    if proof is None:
        errors = force_errors(problem.windows, fitted_force_model(problem.plain, base), problem.plain)
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


def _left_shares(problem: EstimationProblem, mse: Mapping[str, float]) -> dict[str, float]:
    """Return the squared force error that is left over the squared force that moves the vessel, by axis.

    That is the thrust's or the inertia's, whichever is larger: a vessel that holds its place in a wind hardly accelerates.
    """
    windows = problem.windows
    inertia = windows.measured[:, 3:] @ mass_of(problem.plain.hull).T
    thrust = windows.mean(windows.measurements.parts.sum(axis=1))
    moves = np.maximum(np.mean(inertia**2, axis=0), np.mean(thrust**2, axis=0))
    return {axis: mse[axis] / float(size) for axis, size in zip(AXES, moves, strict=True) if size > 0.0}


def _window_s(weight: Floats, step_s: float) -> float:
    return len(weight) * step_s


def _duration_s(log: ScreenedLog) -> float:
    return float(log.measurements.t[-1] - log.measurements.t[0])


def _free_run(runs: FreeRuns, errors: Floats) -> dict[str, Any]:
    if runs.starts == 0:
        return {}
    names = ("position_m", "heading_rad", "speed_mps", "yaw_rate_radps")
    columns = {name: errors[:, k].tolist() for k, name in enumerate(names)}
    return {"horizons_s": runs.horizons_s.tolist(), **columns, "starts": runs.starts, "note": ""}


def _joined(
    campaign: tuple[dict[str, Any], dict[str, Any]], own: tuple[Mapping[str, Any], Mapping[str, Any]]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the scores of a log with what its campaign confirms, beside the free runs of its own findings alone."""
    before, after = ({**one, "free_run": alone.get("free_run", {})} for one, alone in zip(campaign, own, strict=True))
    if before["free_run"]:
        note = "what all logs confirm acts in both, and the findings of this log alone in the second only"
        before["free_run"] = {**before["free_run"], "note": note}
    return before, after


def _leftover(windows: Windows, before: Floats, after: Floats) -> dict[str, Any]:
    return {**_measured(windows), "before": before, "after": after}


def _measured(windows: Windows) -> dict[str, Any]:
    """Return what was measured in every window, for figures; nothing where there is no window."""
    if not len(windows.starts):
        return {}
    measurements = windows.measurements
    psi = windows.mean(measurements.psi[:, None])[:, 0]
    speed = windows.mean(np.hypot(measurements.nu[:, 0], measurements.nu[:, 1])[:, None])[:, 0]
    flows = {"wind": measurements.wind, "current": measurements.current}
    return {
        "t": windows.middle_s,
        "heading": np.degrees(np.mod(psi, 2.0 * np.pi)),
        "speed": speed,
        "place": windows.mean(measurements.eta[:, :2]),
        "nu": windows.mean(measurements.nu),
        "thrust": windows.mean(measurements.parts.sum(axis=1)),
        **{name: windows.mean(flow) for name, flow in flows.items() if flow is not None},
    }
