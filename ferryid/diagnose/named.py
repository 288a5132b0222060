"""What was found as findings: how probable, since when, on which axes, and what else could stand in their place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ferryid.diagnose.hypothesis import WIDER, Fit, Suspect, Trial, fit, imagined, near
from ferryid.diagnose.judged import Judged
from ferryid.diagnose.locate import locate
from ferryid.diagnose.result import AXES, HINT, NEAR, Estimate, Finding, Rival
from ferryid.diagnose.ridge import intervals
from ferryid.diagnose.separate import manoeuvre
from ferryid.diagnose.shown import columns_of, regressor_of
from ferryid.diagnose.spans import brief, lasts_s, swapped
from ferryid.effects.picture import Scene

TIME_DROP = 50.0
"""Fall of the logarithm of the evidence as of which no time farther away comes into question; smaller dips may lie between."""
TIME_STEP, TIME_FIT = 0.125, 3
"""Step between times that are weighed, in lengths of a window, and steps of the fit for each."""
TIME_NEAR, TIME_FINE_S = 10.0, 0.2
"""Fall of the logarithm of the evidence up to which times are weighed in fine steps, and these [s]: the forces' own."""
SHOWN_RIVALS = 3
HARM = 0.2
"""Share by which the held-out squared error on an axis may grow with a finding by chance, and because the others move too."""


def forces_of(trial: Trial, stands: Judged, scene: Scene) -> tuple[list[Finding], tuple[str, ...]]:
    """Return the findings of forces, that which removes most of the error first, and why some are hints only.

    What makes held-out stretches a little likelier, yet is not seen to improve force or free run on an axis that it claims, is
    a hint.
    """
    made, told = [], []
    kept, proof = stands.fit, stands.proof
    harmed = removed(trial, stands)
    for i, (suspect, standing) in enumerate(zip(kept.suspects, stands.standings, strict=True)):
        others = [j for j in range(len(kept.suspects)) if j != i]
        rest = [kept.suspects[j] for j in others]
        rivals = tuple(
            Rival(one.suspect.effect.id, one.suspect.instance, one.gain) for one in standing.rivals[:SHOWN_RIVALS]
        )
        unresolved = tuple(dict.fromkeys(one.suspect.effect.id for one in standing.rivals if one.gain > -NEAR))
        # The hull stays as it is with the finding: refitted without, it would bend to it on axes where it does not act.
        bare = replace(kept, suspects=tuple(rest), values=tuple(kept.values[j] for j in others))
        place = locate(trial, bare, kept, scene)
        estimates = _estimates(trial, suspect, kept, i)
        if not estimates:
            # Every one of its parameters may be too near the neutral value to be worth a name: the hull's, for one.
            continue
        named = zip((p.name for p in suspect.parameters), kept.values[i].tolist(), strict=True)
        values = {name: value for name, value in named if name in estimates}
        improved = None if proof is None else proof.proofs[i].improvement
        unseen = proof is not None and not proof.proofs[i].shows(place.shares)
        if unseen:
            told.append(
                f"{suspect.title} makes held-out stretches a little likelier, but on the axes that it "
                "claims neither the squared force error nor the free run improves by an interval that excludes none: "
                "it is a hint."
            )
        short = brief(trial, suspect)
        if short:
            told.append(
                f"{suspect.title} acts for {lasts_s(trial, suspect):.0f} s only, too short a time to judge it on data that a "
                "fit has not seen: it is a hint."
            )
        single = suspect.effect.once(trial.plain.scene, kept.values[i])
        if single:
            told.append(
                f"{suspect.title}: the vessel was in that place once, or hardly at all, so that something else may have come "
                "just then: it is a hint."
            )
        first = suspect.parameters[0]
        faint = (
            not short
            and len(suspect.times) == 2
            and abs(values.get(first.name, first.neutral) - first.neutral) < suspect.effect.passing
        )
        if faint:
            told.append(
                f"{suspect.title} comes and goes, by less than hull and formulas may be off in a part of the manoeuvres: it "
                "is a hint."
            )
        shares = harmed.get(suspect.key, {})
        worse = min(shares, key=lambda axis: shares[axis], default="")
        harms = bool(worse) and shares[worse] < -HARM
        if harms:
            told.append(
                f"{suspect.title} makes the held-out squared error in {worse} {-100.0 * shares[worse]:.0f} % larger while it "
                "acts, and what is there makes no axis worse: it is a hint."
            )
        made.append(
            Finding(
                effect=suspect.effect.id,
                instance=suspect.instance,
                probability=min(standing.probability, HINT)
                if unseen or short or single or faint or harms
                else standing.probability,
                parameters=estimates,
                axes=dict(zip(AXES, place.shares.tolist(), strict=True)),
                intervals=_intervals(trial, estimates),
                onset_s=_value(estimates, "onset"),
                offset_s=_value(estimates, "offset"),
                regime=place.regime,
                improvement={} if improved is None else dict(zip(AXES, improved.removed.tolist(), strict=True)),
                held_out=improved is not None,
                rivals=rivals,
                unresolved_with=unresolved,
                separating_manoeuvre=manoeuvre(suspect.effect.id, unresolved),
                says=suspect.effect.says(values, suspect.instance),
                **columns_of(trial, place, regressor_of(suspect, imagined(trial.plain, bare), kept.values[i], place)),
            )
        )
    return sorted(made, key=lambda one: -sum(one.improvement.values())), tuple(told)


def removed(trial: Trial, stands: Judged) -> dict[tuple[str, str | None], dict[str, float]]:
    """Return how much of the held-out squared force error each suspect removes while it acts, by axis."""
    times, shares = trial.windows.middle_s, {}
    for proof in () if stands.proof is None else stands.proof.proofs:
        acts = (times >= proof.suspect.onset_s) & (times < proof.suspect.offset_s)
        before, after = (np.sum(one[acts] ** 2, axis=0) for one in (proof.improvement.before, proof.improvement.after))
        share = 1.0 - after / np.where(before > 0.0, before, np.inf)
        shares[proof.suspect.key] = dict(zip(AXES, share.tolist(), strict=True))
    return shares


def _estimates(trial: Trial, suspect: Suspect, kept: Fit, index: int) -> dict[str, Estimate]:
    error = kept.told_errors(index)
    estimates = {}
    untold = suspect.effect.untold(trial.plain.scene, kept.values[index])
    followed = intervals(trial, kept, index) if suspect.effect.ridge and not suspect.times else {}
    for parameter, value, spread in zip(suspect.parameters, kept.values[index].tolist(), error.tolist(), strict=True):
        low, high = max(value - 1.96 * spread, parameter.low), min(value + 1.96 * spread, parameter.high)
        if parameter.name in followed:
            low, high = min(followed[parameter.name][0], value), max(followed[parameter.name][1], value)
        least = suspect.effect.least
        if parameter.name in untold:
            continue
        if least > 0.0 and low < parameter.neutral + least and high > parameter.neutral - least:
            continue
        estimates[parameter.name] = Estimate(value, low, high, parameter.unit)
    for end in suspect.times:
        estimates[end.removesuffix("_s")] = _time(trial, kept, index, end)
    return estimates


def _value(estimates: Mapping[str, Estimate], name: str) -> float | None:
    return estimates[name].value if name in estimates else None


def _time(trial: Trial, kept: Fit, index: int, end: str) -> Estimate:
    """Return when an effect began or ended, as the median of its posterior with the interval.

    An idle thruster hides its fault, so that the posterior may be wide, and have several tops.

    Parameters
    ----------
    trial, kept, index
        The log, what was found, and which of it.
    end
        ``onset_s`` or ``offset_s``.
    """
    suspect = kept.suspects[index]
    times = trial.windows.middle_s
    step = TIME_STEP * len(trial.windows.weight) * trial.windows.scene.step_s

    begin = near(trial, kept)

    def evidence_at(time: float) -> float:
        moved = swapped(kept.suspects, index, suspect.moved(end, time))
        return fit(trial, moved, kept.values, steps=TIME_FIT, begin=begin).evidence

    # It ends after it began.
    first = max(suspect.onset_s, float(times[0])) if end == "offset_s" else float(times[0])
    last = min(suspect.offset_s, float(times[-1])) if end == "onset_s" else float(times[-1])
    here = getattr(suspect, end)
    tried = {here: evidence_at(here)}
    for side in (-1.0, 1.0):
        time = here + side * step
        while first < time < last:
            tried[time] = evidence_at(time)
            if tried[time] < max(tried.values()) - TIME_DROP:
                break
            time += side * step
    # About the likeliest it changes within a step.
    top = max(tried.values())
    for time in [time for time, evidence in tried.items() if evidence > top - TIME_NEAR]:
        for near_by in (
            time + TIME_FINE_S * np.arange(-round(step / TIME_FINE_S), round(step / TIME_FINE_S) + 1)
        ).tolist():
            if first < near_by < last and min(abs(near_by - other) for other in tried) > 0.5 * TIME_FINE_S:
                tried[near_by] = evidence_at(near_by)
    moments = np.array(sorted(tried))
    # Each moment stands for the time about it; the posterior is as much wider as that of other parameters.
    edges = np.concatenate([moments[:1], 0.5 * (moments[1:] + moments[:-1]), moments[-1:]])
    edges[[0, -1]] += np.array([-0.5, 0.5]) * TIME_FINE_S
    log_weights = np.array([tried[time] for time in moments.tolist()]) / WIDER**2
    weights = np.exp(log_weights - log_weights.max()) * np.diff(edges)
    shares = np.concatenate([[0.0], np.cumsum(weights) / weights.sum()])
    low, middle, high = np.interp([0.025, 0.5, 0.975], shares, edges).tolist()
    # Forces have a value a row: within one, nothing is known of when they change.
    row_s = trial.windows.scene.step_s
    return Estimate(middle, max(low - row_s, 0.0), high + row_s, "s")


def _intervals(trial: Trial, estimates: Mapping[str, Estimate]) -> tuple[tuple[float, float], ...]:
    t = trial.windows.scene.t
    begun, ended = _value(estimates, "onset"), _value(estimates, "offset")
    return ((max(begun or 0.0, float(t[0])), float(t[-1]) if ended is None else min(ended, float(t[-1]))),)
