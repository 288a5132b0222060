"""What is left when everything with a name has been tried: described, not named.

Either a law of the motion holds for it on data that it was not fitted to, or it is unsteady: then it is told on which axes,
when, where, and how fast it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp

import numpy as np

from ferryid.counts import all_counted, per_cent
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.candidate_terms import FORCE, Term
from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fit, fitted_force_model, rest_of
from ferryid.diagnose.inference.folds import Folds, block_s
from ferryid.diagnose.inference.force_errors import force_errors, position_errors
from ferryid.diagnose.inference.onset_estimation import is_brief
from ferryid.diagnose.inference.search import refit_with_own_noise
from ferryid.diagnose.inference.spectra import BURST_HZ, Band, Burst, bursts_of, shown_share
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.campaign_laws import CampaignLaws
from ferryid.diagnose.judging.claims import Claim, Figures, OtherLogs
from ferryid.diagnose.judging.figure_data import figure_columns
from ferryid.diagnose.judging.finding import UNKNOWN, Finding, LawTerm
from ferryid.diagnose.judging.locate import Location, locate
from ferryid.diagnose.judging.sparse_regression import Law, select_law
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.force_model import ForceModel, Measurements
from ferryid.side_by_side import over
from ferryid.types import AXES, Flags, Floats

SPANS = 5
"""Intervals that are told."""
ONE_SENSOR = "as the velocity is the slope of the position or heading"


@dataclass(frozen=True)
class Unexplained:
    """What is left beside all that has a name.

    Attributes
    ----------
    claims
        Findings without a name, with their figures.
    left
        What the errors look like.
    unsteady
        True where they come and go.
    notes
        What was seen of them that is no force, as sentences.
    """

    claims: tuple[Claim, ...]
    left: Location
    unsteady: bool
    notes: tuple[str, ...] = ()


def find_unexplained(
    problem: EstimationProblem, kept: Fit, measurements: Measurements, laws: CampaignLaws | None = None
) -> Unexplained:
    """Return what is left of a log beside what was named.

    Parameters
    ----------
    problem
        With the noise that the named effects leave.
    kept
        Hull and named effects.
    measurements
        The log's measurements at its full rate.
    laws
        What the vessel's other logs say; None where there are none.
    """
    claims = []
    folds = problem.folds
    after, refitted = kept, problem
    if folds is not None and laws is not None and (common := laws.common(problem, kept, folds)) is not None:
        holding = f"that holds in {all_counted(laws.able, 'log')} that can show it"
        shared = _lawful(common, after, measurements, holding, laws.moves)
        claims.append(Claim(shared, Figures("law")))
        after, refitted = common.fit, common.problem
    if folds is not None and (law := select_law(refitted, after, folds)) is not None:
        own = _lawful(law, after, measurements, "that was fitted to this log only")
        claims.append(Claim(own, Figures("law", other_logs=None if laws is None else OtherLogs(*laws.of_others(law)))))
        after, refitted = law.fit, law.problem
    left = locate(refitted, after, after, measurements)
    # An effect that comes and goes by chance stays in these errors: it is a state of the filter, no part of the force model.
    known = bool(problem.filter.processes)
    uneven = bool(left.profiles) and left.profiles[0].statistic >= JUDGING.regime_errors
    burst = bursts_of(refitted, fitted_force_model(refitted.plain, after), measurements)
    notes: list[str] = []
    if burst is not None and burst.deviations >= JUDGING.burst_deviations:
        twice = measurements.seen_twice(int(np.argmax(burst.shares)))
        if twice and _is_force(burst.in_positions):
            uneven = True
            if not known:
                claims.append(Claim(_in_bursts(burst), Figures("bursts")))
        else:
            notes.append(_sensor_bursts(burst, twice=twice))
    elif uneven and not known:
        axis = int(np.argmax(left.shares))
        twice = measurements.seen_twice(axis)
        if twice and _is_force(_in_positions(refitted, after, axis)):
            claims.append(Claim(_unsteady(refitted, left), Figures("unsteady")))
        else:
            uneven = False
            slope = "uvr"[axis] in measurements.slopes
            seen = f"{ONE_SENSOR}, no other sensor" if slope else "no position"
            notes.append(
                f"In the velocities the error comes and goes, most in {AXES[axis]}, and {seen} shows the same: "
                "it may be noise of a sensor."
            )
    return Unexplained(tuple(claims), left, uneven, tuple(notes))


def _is_force(in_positions: tuple[float, float] | None) -> bool:
    """Return whether positions and velocities show the same: a force moves both alike, and noise is one sensor's."""
    if in_positions is None:
        return False
    share, error = in_positions
    least = JUDGING.power_in_positions
    return least <= share <= 1.0 / least and share - 1.96 * error > 0.0


def _in_positions(problem: EstimationProblem, kept: Fit, axis: int) -> tuple[float, float] | None:
    """Return the share of the errors of long windows that positions show too, and its standard error."""
    force_model = fitted_force_model(problem.plain, kept)
    seen = position_errors(problem.windows, force_model, problem.plain)
    if seen is None:
        return None
    errors = force_errors(problem.windows, force_model, problem.plain)
    length = round(block_s(problem.windows) / (np.median(np.diff(problem.windows.middle_s)) + 1e-12))
    return shown_share(errors[:, axis], seen[:, axis], max(1, length))


def _sensor_bursts(burst: Burst, *, twice: bool) -> str:
    axis = int(np.argmax(burst.shares))
    if burst.in_positions is None:
        seen = "as there are no positions, nothing shows whether it is a force"
    elif not twice:
        seen = f"{ONE_SENSOR}, nothing shows whether it is a force"
    elif burst.in_positions[0] < JUDGING.power_in_positions:
        seen = "the positions do not show it, so that it is noise of the velocities"
    else:
        seen = f"the positions show {burst.in_positions[0]:.1f} times as much, so that it is noise of the positions"
    band = f"{burst.low_hz:g} to {burst.high_hz:g} Hz"
    return f"In the velocities something comes and goes at {band}, most in {AXES[axis]}: {seen}."


def find_displaced(problem: EstimationProblem, kept: Fit) -> tuple[int, ...]:
    """Return which of the named effects a law of fewer means makes idle.

    Physics outside the library may look a little like an effect. If a law that is fitted in the effect's place explains more
    than the effect, and leaves it nothing to explain, then the effect was named by mistake. A law that says the same as the
    effect in other words is no such law, nor is one that explains more by no more than the effect's formula may be off.
    """
    folds = problem.folds
    if folds is None:
        return ()
    every = [i for i, one in enumerate(kept.candidates) if not is_brief(problem, one)]
    found = over(lambda i: _displaced(problem, kept, i, folds), every)
    return tuple(i for i, displaced in zip(every, found, strict=True) if displaced)


def _displaced(problem: EstimationProblem, kept: Fit, index: int, folds: Folds) -> bool:
    rest, start = rest_of(kept, index)
    without = fit(problem, rest, start)
    named = problem.windows.gap(fitted_force_model(problem.plain, kept))
    bare = replace(kept, candidates=tuple(rest), values=tuple(start))
    moved = named - problem.windows.gap(fitted_force_model(problem.plain, bare))
    law = select_law(problem.with_noise_of(without), without, folds, unlike=moved)
    if law is None:
        return False
    law_candidate, coefficients = law.fit.candidates[-1], law.fit.values[-1]
    candidate, values = kept.candidates[index], kept.values[index]
    both = fit(problem, [*rest, law_candidate, candidate], [*start, coefficients, candidate.start])
    fair = problem.with_noise_of(both)
    with_neither = fit(fair, rest, start).evidence
    with_law = fit(fair, [*rest, law_candidate], [*start, coefficients]).evidence
    with_effect = fit(fair, [*rest, candidate], [*start, values]).evidence
    with_both = fit(fair, [*rest, law_candidate, candidate], both.values).evidence
    better = with_law - with_effect > max(
        INFERENCE.prior_odds, candidate.effect.formula_error * (with_law - with_neither)
    )
    if not better or with_both - with_law >= INFERENCE.prior_odds:
        return False
    return not (candidate.times and _explains_more_with_a_law(problem, kept, law.fit, folds))


def _explains_more_with_a_law(problem: EstimationProblem, kept: Fit, law: Fit, folds: Folds) -> bool:
    """Return whether a fit explains more, with a law of its own for what it leaves, than a law in the place of an effect.

    A hull that is off leaves a law beside any effect. Terms for what the hull lacks are no evidence against the effect. What
    sets in at a time is compared so; what acts all along is more easily taken for another law of the motion.
    """
    own = select_law(problem.with_noise_of(kept), kept, folds)
    if own is None:
        return False
    ours, theirs = (refit_with_own_noise(problem, one) for one in (own.fit, law))
    return ours.evidence > theirs.evidence


def _lawful(law: Law, kept: Fit, measurements: Measurements, whose: str, moves: Sequence[float] = ()) -> Finding:
    """Return a law as a finding; of one of all logs, `moves` are its terms' largest shares of the measured acceleration."""
    problem = law.problem
    # The hull stays as it is with the law: refitted without, it would bend to it on axes where it does not act.
    before = replace(law.fit, candidates=law.fit.candidates[:-1], values=law.fit.values[:-1])
    place = locate(problem, before, law.fit, measurements)
    force_model = fitted_force_model(problem.plain, before)
    terms = [
        _law_term(term, force_model, problem, float(value), float(error))
        for term, value, error in zip(law.terms, law.values, law.errors, strict=True)
    ]
    first = law.terms[0]
    size = "" if first.name == "1" else f"{first.name} [{first.unit}]" if first.unit else first.name
    regressor = (size, first.value(force_model)) if size else None
    parts = [one.says for one in terms]
    if moves:
        sizes = [f"{per_cent(share)} of the measured acceleration" for share in moves]
        parts = [f"{one}, up to {size}" for one, size in zip(parts, sizes, strict=True)]
    listing = "; ".join(parts)
    return Finding(
        effect=UNKNOWN,
        instance=None,
        probability=1.0 - exp(-min(law.gain - max(law.chance, 0.0), 700.0)),
        parameters={},
        axes=dict(zip(AXES, place.shares.tolist(), strict=True)),
        intervals=((float(problem.windows.measurements.t[0]), float(problem.windows.measurements.t[-1])),),
        regime=place.regime,
        improvement=dict(zip(AXES, law.held_out.removed.tolist(), strict=True)),
        held_out=True,
        says=f"An unmodelled force follows a law {whose}: {listing}.",
        band_hz=_band(place.bands, place.shares, [band.before - band.after for band in place.bands]),
        law=tuple(terms),
        **figure_columns(problem, place, regressor),
    )


def _law_term(term: Term, force_model: ForceModel, problem: EstimationProblem, value: float, error: float) -> LawTerm:
    """Return a term as people read it: its force where its quantity is as large as it usually gets."""
    quantity = term.value(force_model)[problem.windows.measurements.usable]
    at = 1.0 if term.name == "1" else float(f"{np.quantile(np.abs(quantity), JUDGING.usual_quantile):.1g}")
    low, high = value - 1.96 * error, value + 1.96 * error
    share = not term.force_unit
    scale, unit = (100.0 * at, "%") if share else (at, term.force_unit)
    ends = sorted((low * scale, high * scale))
    size = f"{value * scale:+.3g} {unit} ({ends[0]:.3g} to {ends[1]:.3g})"
    place = "" if term.name == "1" else f" where {term.name} is {at:g} {term.unit}".rstrip()
    if term.name.startswith(("cos", "sin")):
        place = f" times {term.name}"
    grows = "" if term.name == "1" or term.name.startswith(("cos", "sin")) else ", in proportion to it"
    constant = ", constant" if term.name == "1" and not share else ""
    says = f"{_subject(term)} {size}{constant}{place}{grows}"
    return LawTerm(term.on, term.name, Estimate(value, low, high, term.coefficient_unit), says)


def _subject(term: Term) -> str:
    if term.on in AXES:
        return f"in {term.on}"
    return f"towards {term.on}" if term.on in ("north", "east") else f"on the {term.on}"


def _in_bursts(burst: Burst) -> Finding:
    axis = int(np.argmax(burst.shares))
    band = f"{burst.low_hz:g} to {burst.high_hz:g} Hz"
    spans = [f"{first:.0f}-{last:.0f} s" for first, last in burst.intervals[:SPANS]]
    more = " and later" if len(burst.intervals) > SPANS else ""
    when = f", strongest at {', '.join(spans)}{more}" if spans else ""
    unit = FORCE[axis]
    inside = [(burst.t >= first) & (burst.t <= last) for first, last in burst.intervals]
    rows = np.any(inside, axis=0) if inside else np.ones(len(burst.t), dtype=np.bool_)
    size, whole = (float(np.sqrt(np.mean(one[rows, axis] ** 2))) for one in (burst.force, burst.whole))
    share = size / max(whole, 1e-300)
    return Finding(
        effect=UNKNOWN,
        instance=None,
        probability=_no_chance(burst.deviations, len(BURST_HZ) - 1),
        parameters={},
        axes=dict(zip(AXES, burst.shares.tolist(), strict=True)),
        intervals=burst.intervals,
        says=f"An unsteady disturbance acts in bursts of {band}, most in {AXES[axis]} ({size:.2g} {unit} RMS, "
        f"{100.0 * share:.0f} % of all that is left then){when}; no law of "
        "the vessel's motion explains it.",
        evidence={"t": burst.t, "before": burst.force[:, axis]},
        labels={"residual": f"{AXES[axis]} {'moment' if axis == 2 else 'force'}, {band} [{unit}]"},
        band_hz=(burst.low_hz, burst.high_hz),
    )


def _no_chance(deviations: float, looked_at: int) -> float:
    """Return one less the bound on how often the strongest of so many is as strong by chance."""
    return max(0.0, 1.0 - looked_at * 0.5 * exp(-0.5 * deviations * deviations))


def _unsteady(problem: EstimationProblem, left: Location) -> Finding:
    band = _band(left.bands, left.shares, [one.before for one in left.bands])
    spans = [f"{first:.0f}-{last:.0f} s" for first, last in left.intervals[:SPANS]]
    whole = len(left.intervals) == 1 and left.onset_s is None and left.offset_s is None
    more = " and later" if len(left.intervals) > SPANS else ""
    when = "" if whole or not spans else f", strongest at {', '.join(spans)}{more}"
    where = "" if left.regime.startswith("time") or not left.regime else f", most of it at {left.regime}"
    fast = f", mostly at {band[0]:g} to {band[1]:g} Hz" if band else ""
    axis = AXES[int(np.argmax(left.shares))]
    return Finding(
        effect=UNKNOWN,
        instance=None,
        probability=_no_chance(left.profiles[0].statistic, len(left.profiles)),
        parameters={},
        axes=dict(zip(AXES, left.shares.tolist(), strict=True)),
        intervals=left.intervals,
        onset_s=left.onset_s,
        offset_s=left.offset_s,
        regime=left.regime,
        says=f"An unsteady disturbance acts, most in {axis} ({left_over_size(left)}){fast}{when}{where}; no law of the "
        "vessel's motion explains it.",
        band_hz=band,
        **figure_columns(problem, left, None, alone=True),
    )


def left_over_size(left: Location) -> str:
    """Return the size of what is left over while an unsteady disturbance acts, and at other times, on its strongest axis."""
    axis = int(np.argmax(left.shares))
    inside = np.zeros(len(left.middle_s), dtype=np.bool_)
    for first, last in left.intervals:
        inside |= (left.middle_s >= first) & (left.middle_s <= last)

    def size(rows: Flags) -> str:
        return f"{np.sqrt(np.mean(left.before[rows, axis] ** 2)):.2g} {FORCE[axis]}"

    if inside.any() and not inside.all():
        return f"{size(inside)} RMS left over then, {size(~inside)} at other times"
    return f"{size(np.ones_like(inside))} RMS left over"


def _band(bands: Sequence[Band], shares: Floats, detection_powers: Sequence[Floats]) -> tuple[float, float] | None:
    """Return the fewest neighbouring bands that hold most of the power, each axis in its own unit."""
    if not bands:
        return None
    total = np.maximum(np.sum(np.maximum(detection_powers, 0.0), axis=0), 1e-12)
    level = np.array([float(np.maximum(power, 0.0) / total @ shares) for power in detection_powers])
    for count in range(1, len(bands) + 1):
        sums = [float(level[k : k + count].sum()) for k in range(len(bands) - count + 1)]
        best = int(np.argmax(sums))
        if sums[best] >= JUDGING.band_share * level.sum():
            return bands[best].low_hz, bands[best + count - 1].high_hz
    return None
