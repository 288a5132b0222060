"""What was found as findings: how probable, since when, on which axes, and what else could stand in their place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.estimation import (
    Candidate,
    EstimationProblem,
    Fit,
    fit,
    fitted_force_model,
    rest_of,
    starting_point,
)
from ferryid.diagnose.inference.feedback import feedback_of
from ferryid.diagnose.inference.folds import block_s
from ferryid.diagnose.inference.onset_estimation import lasts_s, replace_candidate
from ferryid.diagnose.judging.backward_elimination import Elimination
from ferryid.diagnose.judging.claims import Claim, Figures
from ferryid.diagnose.judging.credibility import (
    idle_actuators,
    interval_doubt,
    scaled_as_masses,
    size_deviations,
    value_doubt,
)
from ferryid.diagnose.judging.experiment_design import manoeuvre
from ferryid.diagnose.judging.figure_data import figure_columns, figure_regressor
from ferryid.diagnose.judging.finding import Finding, Rival
from ferryid.diagnose.judging.held_out import Proof
from ferryid.diagnose.judging.locate import locate
from ferryid.diagnose.judging.motion_evidence import beyond_any_hull
from ferryid.diagnose.judging.onset_evidence import regime_of_span, sets_in
from ferryid.diagnose.judging.size_estimates import size_estimates
from ferryid.diagnose.judging.time_posterior import TimePosterior
from ferryid.effects.force_model import Measurements
from ferryid.types import AXES, Floats
from ferryid.vessel.circumstances import Circumstances

TIME_FIT = 3
"""Steps of the fit for each time that an effect may have begun or ended at."""
SHOWN_RIVALS = 3


def force_claims(
    problem: EstimationProblem,
    stands: Elimination,
    measurements: Measurements,
    library: Sequence[Candidate] = (),
    *,
    hull_known: bool,
    hull_shared: bool = False,
) -> list[Claim]:
    """Return the findings of forces with their figures, that which removes most of the error first.

    Parameters
    ----------
    problem
        With the noise that the selection leaves.
    stands
        What is left of the selection.
    measurements
        The log's measurements at its full rate.
    library
        Every candidate, against which a force stands out where the hull is not known.
    hull_known
        Whether the hull comes from elsewhere than this log.
    hull_shared
        Whether it comes from this log and several others.
    """
    removed = removed_shares(problem, stands)
    scales = "" if hull_known else _scaled_throughout(stands, measurements, shared=hull_shared)
    claims = [
        _force_claim(problem, stands, measurements, i, removed.get(one.key, {}), library, scales, hull_known=hull_known)
        for i, one in enumerate(stands.fit.candidates)
    ]
    return sorted(claims, key=lambda one: -sum(one.finding.improvement.values()))


def _scaled_throughout(stands: Elimination, measurements: Measurements, *, shared: bool) -> str:
    """Return why factors on all actuators throughout a log are no names beside a hull that nobody modelled; else nothing."""
    lasting = {one.instance for one in stands.fit.candidates if one.effect.scales and not one.times}
    return scaled_as_masses(lasting, measurements.profile, shared=shared)


def _force_claim(
    problem: EstimationProblem,
    stands: Elimination,
    measurements: Measurements,
    i: int,
    removed: Mapping[str, float],
    library: Sequence[Candidate],
    scales: str,
    *,
    hull_known: bool,
) -> Claim:
    kept, standing = stands.fit, stands.standings[i]
    candidate, values = kept.candidates[i], kept.values[i]
    rivals = tuple(
        Rival(one.candidate.effect.id, one.candidate.instance, one.gain) for one in standing.rivals[:SHOWN_RIVALS]
    )
    unresolved = standing.unresolved(candidate)
    # The hull stays as it is with the finding: refitted without, it would bend to it on axes where it does not act.
    rest, of_rest = rest_of(kept, i)
    bare = replace(kept, candidates=tuple(rest), values=tuple(of_rest))
    place = locate(problem, bare, kept, measurements)
    estimates = _estimates(problem, candidate, kept, i)
    by_name = dict(zip((p.name for p in candidate.parameters), values.tolist(), strict=True))
    reported = {name: value for name, value in by_name.items() if name in estimates}
    proof = None if stands.proof is None else stands.proof.proofs[i]
    finding = Finding(
        effect=candidate.effect.id,
        instance=candidate.instance,
        probability=standing.probability,
        parameters=estimates,
        axes=dict(zip(AXES, place.shares.tolist(), strict=True)),
        intervals=_intervals(problem, estimates),
        onset_s=_value(estimates, "onset"),
        offset_s=_value(estimates, "offset"),
        regime=place.regime,
        improvement={} if proof is None else dict(zip(AXES, proof.improvement.removed.tolist(), strict=True)),
        mse=None if proof is None else _mean_squares(proof),
        held_out=proof is not None,
        rivals=rivals,
        unresolved_with=unresolved,
        separating_manoeuvre=manoeuvre(candidate.effect.id, unresolved, Circumstances.of(measurements.profile)),
        says=candidate.effect.says(reported, candidate.instance) if reported else "",
        **figure_columns(
            problem, place, figure_regressor(candidate, fitted_force_model(problem.plain, bare), values, place)
        ),
    )
    figures = _figures(problem, candidate, values, reported, proof, removed)
    ends = {name: (one.low, one.high) for name, one in estimates.items()}
    doubt = idle_actuators(problem, kept) or figures.doubt or candidate.effect.doubt_of_ends(ends)
    figures = replace(
        figures,
        doubt=doubt or interval_doubt(candidate.parameters, estimates, kept.covariance(i)),
        deviations=size_deviations(candidate.parameters, estimates),
    )
    if proof is not None and candidate.effect.out_of_step:
        beyond = proof.improvement.score_low > feedback_of(problem, kept).high
        figures = replace(figures, beyond_feedback=beyond)
    if not hull_known:
        if candidate.effect.scales and not candidate.times:
            figures = replace(figures, doubt=figures.doubt or scales)
        figures = replace(
            figures,
            sets_in=sets_in(problem, kept, i),
            beyond_hull=beyond_any_hull(problem, kept, i, library, standing.nearest),
        )
    return Claim(finding, figures)


def _mean_squares(proof: Proof) -> tuple[Mapping[str, float], Mapping[str, float]]:
    before, after = (
        dict(zip(AXES, one.tolist(), strict=True))
        for one in (proof.improvement.mse_before, proof.improvement.mse_after)
    )
    return before, after


def _figures(
    problem: EstimationProblem,
    candidate: Candidate,
    values: Floats,
    reported: Mapping[str, float],
    proof: Proof | None,
    removed: Mapping[str, float],
) -> Figures:
    unit, passes = candidate.parameters[0].unit, inf
    if len(candidate.times) == 2 and (size := candidate.effect.passing_size(problem.plain.measurements.profile)) > 0.0:
        # The second level of a step is that of all other times.
        every = candidate.parameters[:1] if candidate.is_step else candidate.parameters
        away = [reported.get(one.name, one.neutral) - one.neutral for one in every if one.unit == unit]
        passes = float(np.linalg.norm(away)) / size
    shown = {} if proof is None else _lower_ends(proof)
    return Figures(
        kind="force",
        removed=removed,
        lasts_s=lasts_s(problem, candidate) if candidate.times else inf,
        block_s=block_s(problem.windows),
        single_visit=candidate.effect.single_visit(problem.plain.measurements, values),
        regime=regime_of_span(problem.plain.measurements, candidate),
        passes=passes,
        doubt=value_doubt(candidate.effect, candidate.parameters, reported, problem.plain.measurements.profile)
        or candidate.effect.doubt_where(reported, problem.plain.measurements),
        **shown,
    )


def _lower_ends(proof: Proof) -> dict[str, Any]:
    # Position and speed belong to surge and sway, heading and yaw rate to yaw; some horizons have no data.
    runs = np.max(np.nan_to_num(proof.free_runs.low, nan=-inf), axis=0).reshape(2, 2).max(axis=0)[[0, 0, 1]]
    return {
        "score": proof.improvement.score,
        "force_low": dict(zip(AXES, proof.improvement.low.tolist(), strict=True)),
        "free_run_low": dict(zip(AXES, runs.tolist(), strict=True)),
        "worse_runs": proof.free_runs.worse,
    }


def removed_shares(problem: EstimationProblem, stands: Elimination) -> dict[tuple[str, str | None], dict[str, float]]:
    """Return how much of the held-out squared force error each candidate removes while it acts, by axis.

    Without a step one level holds throughout, which is wrong on either side.
    """
    times, shares = problem.windows.middle_s, {}
    for proof in () if stands.proof is None else stands.proof.proofs:
        acts = (times >= proof.candidate.onset_s) & (times < proof.candidate.offset_s) | proof.candidate.is_step
        before, after = (np.sum(one[acts] ** 2, axis=0) for one in (proof.improvement.before, proof.improvement.after))
        share = 1.0 - after / np.where(before > 0.0, before, np.inf)
        shares[proof.candidate.key] = dict(zip(AXES, share.tolist(), strict=True))
    return shares


def _estimates(problem: EstimationProblem, candidate: Candidate, kept: Fit, index: int) -> dict[str, Estimate]:
    estimates = size_estimates(problem, kept, index)
    for end in candidate.times:
        estimates[end.removesuffix("_s")] = _time(problem, kept, index, end)
    if candidate.effect.passing:
        estimates["duration"] = _duration(problem, estimates)
    return estimates


def _duration(problem: EstimationProblem, estimates: Mapping[str, Estimate]) -> Estimate:
    """Return how long an effect acted, from its times; an end of the log where it was not seen to begin, or to end."""
    first, last = problem.windows.measurements.t[[0, -1]].tolist()
    begun = estimates.get("onset", Estimate(first, first, first, "s"))
    ended = estimates.get("offset", Estimate(last, last, last, "s"))
    value = ended.value - begun.value
    low = value - float(np.hypot(ended.value - ended.low, begun.high - begun.value))
    high = value + float(np.hypot(ended.high - ended.value, begun.value - begun.low))
    return Estimate(value, max(low, 0.0), high, "s")


def _value(estimates: Mapping[str, Estimate], name: str) -> float | None:
    return estimates[name].value if name in estimates else None


def _time(problem: EstimationProblem, kept: Fit, index: int, end: str) -> Estimate:
    """Return when an effect began or ended, as the median of its posterior with the interval.

    Parameters
    ----------
    problem, kept, index
        The log, what was found, and which of it.
    end
        ``onset_s`` or ``offset_s``.
    """
    candidate = kept.candidates[index]
    middles = problem.windows.middle_s
    window_s = len(problem.windows.weight) * problem.windows.measurements.step_s
    begin = starting_point(problem, kept)

    def evidence_at(time: float) -> float:
        moved = replace_candidate(kept.candidates, index, candidate.moved(end, time))
        return fit(problem, moved, kept.values, steps=TIME_FIT, begin=begin).evidence

    # It ends after it began.
    first = max(candidate.onset_s, float(middles[0])) if end == "offset_s" else float(middles[0])
    last = min(candidate.offset_s, float(middles[-1])) if end == "onset_s" else float(middles[-1])
    found = TimePosterior.about(evidence_at, getattr(candidate, end), first, last, window_s)
    low, middle, high = found.quantiles(np.array([0.025, 0.5, 0.975])).tolist()
    # Forces have a value a row: within one, nothing is known of when they change.
    row_s = problem.windows.measurements.step_s
    return Estimate(middle, max(low - row_s, 0.0), high + row_s, "s")


def _intervals(problem: EstimationProblem, estimates: Mapping[str, Estimate]) -> tuple[tuple[float, float], ...]:
    t = problem.windows.measurements.t
    begun, ended = _value(estimates, "onset"), _value(estimates, "offset")
    return ((max(begun or 0.0, float(t[0])), float(t[-1]) if ended is None else min(ended, float(t[-1]))),)
