"""Whether what was selected stands: on held-out data, against its placebos, its rivals, and laws without a name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import partial

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, without
from ferryid.diagnose.inference.needed_correction import needed
from ferryid.diagnose.inference.onset_estimation import is_brief
from ferryid.diagnose.inference.search import is_negligible, prune
from ferryid.diagnose.judging.axis_consistency import check_axis_consistency
from ferryid.diagnose.judging.credibility import harm_alone, interval_doubt
from ferryid.diagnose.judging.held_out import HeldOutEvidence, held_out_evidence
from ferryid.diagnose.judging.rivals import (
    RivalComparison,
    compare_rivals,
    least_gain,
    redundant_shape,
    with_both,
    without_companions,
)
from ferryid.diagnose.judging.size_estimates import UNCONFIRMED, size_estimates, sizes_text
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.diagnose.judging.unexplained import find_displaced
from ferryid.effects.wording import listed, timed
from ferryid.types import AXES

PLACEBO = (
    "a placebo (the same force at other times, or on mirrored headings) does as well on stretches kept from the fit"
)
INCONSISTENT = "on an axis where it would have to act, most of it is missing"
BRIEF = "it acts for less time than held-out data can judge, and its 95 % interval includes no effect at all"
SAME_CURVE = "another shape of the same thrust curve, as idealised, explains nearly as much as both together"
UNRIVALLED = RivalComparison((), 1.0)
"""Standing of what no other effect could stand in for."""
LAW = "an empirical law of the motion explains more in that place, and leaves nothing to explain"


@dataclass(frozen=True)
class Elimination:
    """What is left of a selection.

    Attributes
    ----------
    fit
        Of it.
    proof
        Held-out evidence; None where nothing is left, or the log is too short to hold anything out.
    standings
        Of every candidate among its rivals.
    dropped
        What was dropped, and why.
    """

    fit: Fit
    proof: HeldOutEvidence | None
    standings: tuple[RivalComparison, ...]
    dropped: tuple[str, ...]


def eliminate_backward(
    problem: EstimationProblem, found: Fit, library: Sequence[Candidate], progress: Callable[[str], None]
) -> Elimination:
    """Drop what does not stand, one after the other, as the others are to be judged without it.

    Parameters
    ----------
    problem
        With the noise that the selection leaves.
    found
        The selection.
    library
        Every candidate, for rivals.
    progress
        Called with the name of each stage.
    """
    fallen_by_reason: dict[str, dict[str, str]] = {}
    tried, judged = {found.keys}, set[frozenset[tuple[object, ...]]]()
    kept, swaps = found, 0
    while kept.candidates:
        standings: tuple[RivalComparison, ...] = ()
        if swaps < JUDGING.most_replacements:
            progress("weighing rivals")
            standings = _standings(problem, kept, library)
        better = [(i, one) for i, standing in enumerate(standings) for one in standing.rivals[:1]]
        better = [(i, one) for i, one in better if one.gain > least_gain(problem, kept, i, one)]
        better = [(i, one) for i, one in better if one.fit.keys not in tried]
        swapped = None
        for replaced, best in sorted(better, key=lambda pair: -pair[1].gain):
            if swaps >= JUDGING.most_replacements:
                break
            # What was selected first may be less likely beside what was selected later than another in its place.
            tried.add(best.fit.keys)
            swaps += 1
            swapped = prune(problem, with_both(problem, kept, replaced, best.fit))
            tried.add(swapped.keys)
            # What was judged before would fall again, and lead back here.
            if _spans(swapped) not in judged:
                break
            swapped = None
        if swapped is not None:
            kept = swapped
            continue
        progress("judging on held-out stretches")
        proof = held_out_evidence(problem, kept)
        judged.add(_spans(kept))
        fallen, why = _fallen(problem, kept, proof)
        if fallen is None:
            # Where none takes a place any more, rivals are asked for once all stand.
            standings = standings or _standings(problem, kept, library)
            # What fell may have been right: it is no rival of what is likely beside it.
            standings = tuple(without_companions(problem, kept, i, one) for i, one in enumerate(standings))
            return Elimination(kept, proof, standings, _told(fallen_by_reason, kept))
        if why:
            fallen_by_reason.setdefault(why, {}).setdefault(
                kept.candidates[fallen].title, _sizes(problem, kept, fallen)
            )
        kept = prune(problem, without(problem, kept, fallen))
        tried.add(kept.keys)
    return Elimination(kept, None, (), _told(fallen_by_reason, kept))


def _spans(made: Fit) -> frozenset[tuple[object, ...]]:
    """Return which candidates a fit holds, and when each acts."""
    return frozenset((*one.key, one.onset_s, one.offset_s) for one in made.candidates)


def _standings(problem: EstimationProblem, kept: Fit, library: Sequence[Candidate]) -> tuple[RivalComparison, ...]:
    return tuple(
        UNRIVALLED if needed(problem, one) else compare_rivals(problem, kept, i, library)
        for i, one in enumerate(kept.candidates)
    )


def _told(fallen_by_reason: Mapping[str, Mapping[str, str]], kept: Fit) -> tuple[str, ...]:
    """Return for every reason what was dropped for it and what its sizes were estimated to be; sizes are by title.

    What fell and came back in the place of another stands, and is not called dropped.
    """
    stand = {one.title for one in kept.candidates}
    said = []
    for why, sizes_by_title in fallen_by_reason.items():
        fallen = {title: sizes for title, sizes in sizes_by_title.items() if title not in stand}
        if not fallen:
            continue
        dropped = f"{listed(list(fallen))} {'were' if len(fallen) > 1 else 'was'} considered, but dropped: {why}."
        known = [(f"{title}: " if len(fallen) > 1 else "") + sizes for title, sizes in fallen.items() if sizes]
        said.append(f"{dropped} {UNCONFIRMED}{'; '.join(known)}." if known else dropped)
    return tuple(said)


def _sizes(problem: EstimationProblem, kept: Fit, i: int) -> str:
    """Return the sizes of a candidate, and when it began and ended if it did; empty where none is known."""
    one = kept.candidates[i]
    sizes = sizes_text(size_estimates(problem, kept, i, profiled=False))
    times = timed(*(getattr(one, end) if end in one.times else None for end in ("onset_s", "offset_s")))
    return f"{sizes}; {times}" if sizes and times else sizes


def _fallen(problem: EstimationProblem, kept: Fit, proof: HeldOutEvidence | None) -> tuple[int | None, str]:
    """Return the candidate that stands least, and why it falls, if that is worth telling; None where all stand."""
    questioned = [i for i, one in enumerate(kept.candidates) if not needed(problem, one)]
    if proof is not None:
        fallen = [i for i in questioned if not proof.proofs[i].holds]
        if fallen:
            worst = min(fallen, key=lambda i: proof.proofs[i].beaten)
            return worst, PLACEBO
        gains = {i: proof.proofs[i].improvement for i in questioned}
        harms = {i: harm_alone(dict(zip(AXES, one.removed.tolist(), strict=True))) for i, one in gains.items()}
        if harmful := [i for i in questioned if harms[i]]:
            worst = min(harmful, key=lambda i: gains[i].score)
            return worst, harms[worst]
    # Beside what was found later, it may be hardly anything: nothing to tell, and no sign of another cause.
    idle = [i for i in questioned if is_negligible(problem, kept, i)]
    if idle:
        return idle[0], ""
    # Whatever came just then would do as well: neither its size nor stretches kept from the fit show that it is this.
    unsized = [i for i in questioned if _is_brief_and_unsized(problem, kept, i)]
    if unsized:
        return unsized[0], BRIEF
    inconsistent = [i for i in questioned if check_axis_consistency(problem, kept, i).inconsistent]
    if inconsistent:
        return inconsistent[0], INCONSISTENT
    shapes = redundant_shape(kept.candidates, partial(_evidence_without, problem, kept))
    if shapes is not None:
        return shapes[0], SAME_CURVE
    # Physics without a name here may look a little like an effect.
    imitated = find_displaced(problem, kept)
    return (imitated[0], LAW) if imitated else (None, "")


def _evidence_without(problem: EstimationProblem, kept: Fit, left_out: Set[int]) -> float:
    """Return the evidence of a fit without the candidates at some places."""
    for place in sorted(left_out, reverse=True):
        kept = without(problem, kept, place)
    return kept.evidence


def _is_brief_and_unsized(problem: EstimationProblem, kept: Fit, i: int) -> bool:
    """Tell whether a candidate acts too briefly to be judged, and may as well be nothing."""
    candidate = kept.candidates[i]
    if not is_brief(problem, candidate):
        return False
    estimates = size_estimates(problem, kept, i)
    return bool(interval_doubt(candidate.parameters, estimates, kept.covariance(i)))
