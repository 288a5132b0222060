"""Whether what was selected stands: on held-out data, against its placebos, its rivals, and laws without a name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ferryid.diagnose.inference.estimation import Fit, Suspect, Trial, without
from ferryid.diagnose.inference.search import pruned, void
from ferryid.diagnose.judging.axis_consistency import tie_of
from ferryid.diagnose.judging.held_out import Evidence, evidence
from ferryid.diagnose.judging.rivals import Standing, standing_of
from ferryid.diagnose.judging.unexplained import impostors
from ferryid.effects.wording import listed

SWAPS = 6
"""Times that a rival takes a place: physics without a name here may send one effect after the other to stand in for it."""

PLACEBO = (
    "a placebo (the same force at other times, or on mirrored headings) does as well on stretches kept from the fit"
)
TORN = "on an axis where it would have to act, most of it is missing"
LAW = "an empirical law of the motion explains more in that place, and leaves nothing to explain"


@dataclass(frozen=True)
class Judged:
    """What is left of a selection.

    Attributes
    ----------
    fit
        Of it.
    proof
        Held-out evidence; None where nothing is left, or the log is too short to hold anything out.
    standings
        Of every suspect among its rivals.
    told
        What was dropped, and why.
    """

    fit: Fit
    proof: Evidence | None
    standings: tuple[Standing, ...]
    told: tuple[str, ...]


def judged(trial: Trial, found: Fit, library: Sequence[Suspect], progress: Callable[[str], None]) -> Judged:
    """Drop what does not stand, one after the other, as the others are to be judged without it.

    Parameters
    ----------
    trial
        With the noise that the selection leaves.
    found
        The selection.
    library
        Every suspect, for rivals.
    progress
        Called with the name of each stage.
    """
    fallen_by_reason: dict[str, list[str]] = {}
    tried = {found.keys}
    kept, swaps = found, 0
    while kept.suspects:
        progress("weighing rivals")
        standings = tuple(standing_of(trial, kept, i, library) for i in range(len(kept.suspects)))
        better = [one for standing in standings for one in standing.rivals[:1] if one.gain > 0.0]
        better = [one for one in better if one.fit.keys not in tried]
        if better and swaps < SWAPS:
            # What was selected first may be less likely beside what was selected later than another in its place.
            best = max(better, key=lambda one: one.gain)
            tried.add(best.fit.keys)
            swaps += 1
            kept = pruned(trial, best.fit)
            continue
        progress("judging on held-out stretches")
        proof = evidence(trial, kept)
        fallen, why = _fallen(trial, kept, proof)
        if fallen is None:
            return Judged(kept, proof, standings, _told(fallen_by_reason))
        if why:
            fallen_by_reason.setdefault(why, []).append(kept.suspects[fallen].title)
        kept = pruned(trial, without(trial, kept, fallen))
        tried.add(kept.keys)
    return Judged(kept, None, (), _told(fallen_by_reason))


def _told(fallen_by_reason: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return a sentence for every reason; what is dropped twice for it, on the way, is named once."""
    said = []
    for why, titles in fallen_by_reason.items():
        names = list(dict.fromkeys(titles))
        said.append(f"{listed(names)} {'were' if len(names) > 1 else 'was'} suspected, but dropped: {why}.")
    return tuple(said)


def _fallen(trial: Trial, kept: Fit, proof: Evidence | None) -> tuple[int | None, str]:
    """Return the suspect that stands least, and why it falls, if that is worth telling; None where all stand."""
    if proof is not None:
        fallen = [i for i, one in enumerate(proof.proofs) if not one.holds]
        if fallen:
            worst = min(fallen, key=lambda i: proof.proofs[i].beaten)
            return worst, PLACEBO
    # Beside what was found later, it may be hardly anything: nothing to tell, and no sign of another cause.
    idle = [i for i in range(len(kept.suspects)) if void(trial, kept, i)]
    if idle:
        return idle[0], ""
    torn = [i for i in range(len(kept.suspects)) if tie_of(trial, kept, i).torn]
    if torn:
        return torn[0], TORN
    # Physics without a name here may look a little like an effect.
    imitated = impostors(trial, kept)
    return (imitated[0], LAW) if imitated else (None, "")
