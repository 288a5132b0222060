"""What is left when everything with a name has been tried: described, not named.

Either a law of the motion holds for it on data that it was not fitted to, or it is unsteady: then it is told on which axes,
when, where, and how fast it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.bands import BURST_HZ, Band, Burst, bursts_of
from ferryid.diagnose.folds import Folds, folds_of
from ferryid.diagnose.hypothesis import Fit, Trial, fit, imagined
from ferryid.diagnose.law import Law, law_of
from ferryid.diagnose.locate import Location, locate
from ferryid.diagnose.profiles import TELLS
from ferryid.diagnose.result import AXES, HINT, Estimate, Finding, LawTerm
from ferryid.diagnose.search import ODDS
from ferryid.diagnose.shared_laws import Heard
from ferryid.diagnose.shown import columns_of
from ferryid.diagnose.spans import brief
from ferryid.diagnose.terms import FORCE, Term
from ferryid.effects.picture import Picture, Scene
from ferryid.vessel.profile import Floats

USUAL = 0.9
"""Quantile of a quantity's size at which its force is told."""
BAND_SHARE = 0.5
"""A band is told that holds this share of the power."""
SPANS = 5
"""Intervals that are told."""
FAST_HZ = 0.2
"""Frequency above which no force of the library has most of its power: they change with motion, heading and thrust."""
BURSTS = 5.0
"""Standard deviations from even as of which bursts are told."""


@dataclass(frozen=True)
class Unknown:
    """What is left beside all that has a name.

    Attributes
    ----------
    findings
        Without a name.
    left
        What the errors look like.
    unsteady
        True where they come and go.
    holds
        Share of the squared error left that is a force's, by axis, as far as that force is more than a hint and as slow as
        those of the library are: no bursts, and not above `FAST_HZ`. Empty where there is none.
    """

    findings: tuple[Finding, ...]
    left: Location
    unsteady: bool
    holds: dict[str, float]


def unknown_of(trial: Trial, kept: Fit, scene: Scene, heard: Heard | None = None) -> Unknown:
    """Return what is left of a log beside what was named.

    Parameters
    ----------
    trial
        With the noise that the named effects leave.
    kept
        Hull and named effects.
    scene
        The log's scene at its full rate.
    heard
        What the vessel's other logs say; None where there are none.
    """
    findings = []
    folds = folds_of(trial.windows)
    after, seen = kept, trial
    if folds is not None and heard is not None and (common := heard.common(trial, kept, folds)) is not None:
        findings.append(
            _lawful(common, after, scene, f"that holds in all {counted(heard.able, 'log')} that can show it")
        )
        after, seen = common.fit, common.trial
    if folds is not None and (law := law_of(seen, after, folds)) is not None:
        own = _lawful(law, after, scene, "that was seen in this log only")
        findings.append(own if heard is None else _of_one(own, *heard.of_others(law)))
        after, seen = law.fit, law.trial
    left = locate(seen, after, after, scene)
    # An effect that comes and goes by chance stays in these errors: it is a state of the filter, no part of the picture.
    known = bool(trial.filter.processes)
    uneven = bool(left.profiles) and left.profiles[0].statistic >= TELLS
    bursts: list[Finding] = []
    burst = bursts_of(seen, imagined(seen.plain, after), scene)
    if burst is not None and burst.deviations >= BURSTS:
        uneven = True
        bursts = [] if known else [_in_bursts(burst)]
    elif uneven and not known:
        findings.append(_unsteady(seen, left))
    slow = [one for one in findings if one.sure and (one.law or one.band_hz is None or one.band_hz[0] < FAST_HZ)]
    # What no law describes may be all that is left; and of a law that all logs of a vessel have, there may be more.
    described = heard is None and all(one.law for one in slow)
    holds = {axis: max(one.improvement[axis] if described else 1.0 for one in slow) for axis in AXES} if slow else {}
    return Unknown((*findings, *bursts), left, uneven, {axis: max(share, 0.0) for axis, share in holds.items()})


def impostors(trial: Trial, kept: Fit) -> tuple[int, ...]:
    """Return which of the named effects a law of fewer means makes idle.

    Physics outside the library may look a little like an effect. If a law that is fitted in the effect's place explains more
    than the effect, and leaves it nothing to explain, then the effect was named by mistake. A law that says the same as the
    effect in other words is no such law, nor is one that explains more by no more than the effect's formula may be off.
    """
    folds = folds_of(trial.windows)
    if folds is None:
        return ()
    every = (i for i, one in enumerate(kept.suspects) if not brief(trial, one))
    return tuple(i for i in every if _displaced(trial, kept, i, folds))


def _displaced(trial: Trial, kept: Fit, index: int, folds: Folds) -> bool:
    others = [k for k in range(len(kept.suspects)) if k != index]
    rest, start = [kept.suspects[k] for k in others], [kept.values[k] for k in others]
    without = fit(trial, rest, start)
    named = trial.windows.gap(imagined(trial.plain, kept))
    bare = replace(kept, suspects=tuple(rest), values=tuple(start))
    moved = named - trial.windows.gap(imagined(trial.plain, bare))
    law = law_of(trial.with_noise_of(without), without, folds, unlike=moved)
    if law is None:
        return False
    told, coefficients = law.fit.suspects[-1], law.fit.values[-1]
    suspect, values = kept.suspects[index], kept.values[index]
    both = fit(trial, [*rest, told, suspect], [*start, coefficients, suspect.start])
    fair = trial.with_noise_of(both)
    with_neither = fit(fair, rest, start).evidence
    with_law = fit(fair, [*rest, told], [*start, coefficients]).evidence
    with_effect = fit(fair, [*rest, suspect], [*start, values]).evidence
    with_both = fit(fair, [*rest, told, suspect], both.values).evidence
    better = with_law - with_effect > max(ODDS, suspect.effect.form * (with_law - with_neither))
    return better and with_both - with_law < ODDS


def _of_one(finding: Finding, others: int, able: int, hold: int) -> Finding:
    """Return a law that is one log's alone as a hint, with what the vessel's other logs say of it."""
    shown = f", and {hold or 'none'} {'does' if hold < 2 else 'do'}" if able else ""
    told = f"Of {counted(others, 'other log')} {able or 'none'} could show it at this size{shown}."
    return replace(finding, probability=min(finding.probability, HINT), says=f"{finding.says} {told}")


def _lawful(law: Law, kept: Fit, scene: Scene, whose: str) -> Finding:
    trial = law.trial
    # The hull stays as it is with the law: refitted without, it would bend to it on axes where it does not act.
    before = replace(law.fit, suspects=law.fit.suspects[:-1], values=law.fit.values[:-1])
    place = locate(trial, before, law.fit, scene)
    picture = imagined(trial.plain, before)
    terms = [
        _told(term, picture, trial, float(value), float(error))
        for term, value, error in zip(law.terms, law.values, law.errors, strict=True)
    ]
    first = law.terms[0]
    size = "" if first.name == "1" else f"{first.name} [{first.unit}]" if first.unit else first.name
    regressor = (size, first.value(picture)) if size else None
    parts = [one.says for one in terms]
    told = "; ".join(parts)
    return Finding(
        effect="unknown",
        instance=None,
        probability=1.0 - exp(-min(law.gain - max(law.chance, 0.0), 700.0)),
        parameters={},
        axes=dict(zip(AXES, place.shares.tolist(), strict=True)),
        intervals=((float(trial.windows.scene.t[0]), float(trial.windows.scene.t[-1])),),
        onset_s=None,
        regime=place.regime,
        improvement=dict(zip(AXES, law.held_out.removed.tolist(), strict=True)),
        held_out=True,
        rivals=(),
        unresolved_with=(),
        separating_manoeuvre=None,
        says=f"A force acts that has no name here, but a law {whose}: {told}.",
        band_hz=_band(place.bands, place.shares, [band.before - band.after for band in place.bands]),
        law=tuple(terms),
        **columns_of(trial, place, regressor),
    )


def _told(term: Term, picture: Picture, trial: Trial, value: float, error: float) -> LawTerm:
    """Return a term as people read it: its force where its quantity is as large as it usually gets."""
    quantity = term.value(picture)[trial.windows.scene.usable]
    at = 1.0 if term.name == "1" else float(f"{np.quantile(np.abs(quantity), USUAL):.1g}")
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
    loud = burst.force[np.any(inside, axis=0), axis] if inside else burst.force[:, axis]
    size = float(np.sqrt(np.mean(loud**2)))
    return Finding(
        effect="unknown",
        instance=None,
        probability=_no_chance(burst.deviations, len(BURST_HZ) - 1),
        parameters={},
        axes=dict(zip(AXES, burst.shares.tolist(), strict=True)),
        intervals=burst.intervals,
        onset_s=None,
        regime="",
        improvement={},
        held_out=False,
        rivals=(),
        unresolved_with=(),
        separating_manoeuvre=None,
        says=f"Something unsteady moves the vessel in bursts of {band}, most in {AXES[axis]} ({size:.2g} {unit} in the root "
        f"mean square){when}; no law of its motion explains it.",
        evidence={"t": burst.t, "before": burst.force[:, axis]},
        labels={"residual": f"{AXES[axis]} {'moment' if axis == 2 else 'force'}, {band} [{unit}]"},
        band_hz=(burst.low_hz, burst.high_hz),
    )


def _no_chance(deviations: float, looked_at: int) -> float:
    """Return one less the bound on how often the strongest of so many is as strong by chance."""
    return max(0.0, 1.0 - looked_at * 0.5 * exp(-0.5 * deviations * deviations))


def _unsteady(trial: Trial, left: Location) -> Finding:
    band = _band(left.bands, left.shares, [one.before for one in left.bands])
    spans = [f"{first:.0f}-{last:.0f} s" for first, last in left.intervals[:SPANS]]
    whole = len(left.intervals) == 1 and left.onset_s is None and left.offset_s is None
    more = " and later" if len(left.intervals) > SPANS else ""
    when = "" if whole or not spans else f", strongest at {', '.join(spans)}{more}"
    where = "" if left.regime.startswith("time") or not left.regime else f", most of it at {left.regime}"
    fast = f", mostly at {band[0]:g} to {band[1]:g} Hz" if band else ""
    axis = AXES[int(np.argmax(left.shares))]
    return Finding(
        effect="unknown",
        instance=None,
        probability=_no_chance(left.profiles[0].statistic, len(left.profiles)),
        parameters={},
        axes=dict(zip(AXES, left.shares.tolist(), strict=True)),
        intervals=left.intervals,
        onset_s=left.onset_s,
        offset_s=left.offset_s,
        regime=left.regime,
        improvement={},
        held_out=False,
        rivals=(),
        unresolved_with=(),
        separating_manoeuvre=None,
        says=f"Something unsteady moves the vessel, most in {axis}{fast}{when}{where}; no law of its motion explains it.",
        band_hz=band,
        **columns_of(trial, left, None, alone=True),
    )


def _band(bands: Sequence[Band], shares: Floats, powers: Sequence[Floats]) -> tuple[float, float] | None:
    """Return the fewest neighbouring bands that hold most of the power, each axis in its own unit."""
    if not bands:
        return None
    total = np.maximum(np.sum(np.maximum(powers, 0.0), axis=0), 1e-12)
    level = np.array([float(np.maximum(power, 0.0) / total @ shares) for power in powers])
    for count in range(1, len(bands) + 1):
        sums = [float(level[k : k + count].sum()) for k in range(len(bands) - count + 1)]
        best = int(np.argmax(sums))
        if sums[best] >= BAND_SHARE * level.sum():
            return bands[best].low_hz, bands[best + count - 1].high_hz
    return None
