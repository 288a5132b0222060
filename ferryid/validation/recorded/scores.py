"""Figures of merit of a proof on real recordings: what a concealed effect changes in the diagnosis."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.json_record import Record
from ferryid.validation.case import Case, Truth
from ferryid.validation.detection_curves import Curve, curve
from ferryid.validation.estimate_errors import EstimateErrors, estimate_errors
from ferryid.validation.name_scores import HULL, Share, label, names, outcome_of_missed, why_missed, wrong_names
from ferryid.validation.recorded.case_sampling import NotMade
from ferryid.validation.recorded.doses import Doses, joined
from ferryid.validation.recorded.effects import Concealment, concealments
from ferryid.validation.recorded.own_errors import OwnErrors, OwnForces
from ferryid.validation.records import UNKNOWN, CaseResult, Key
from ferryid.validation.rival_scores import Compare, RivalScores, rival_scores
from ferryid.validation.targets import COVERED, FALSE, IN_TIME, Target, share_target

AT_TWICE = 0.9
"""Share of doses of twice the oracle's size that is to be named."""
TWICE_DISTINCT = 2.0
"""Of the distinct size, from which on nine in ten ought to be named, too."""
TWICE_SEEN = 2.0
"""Of the oracle's size, from which on it is said why an effect was missed."""
GROSS = "gross"
"""Kind of the cases whose record is wrong altogether."""
STEP_LEVEL = "otherwise"
"""Parameter that a finding has beside the factor of a step, from a level that nobody knows."""
MEDIAN_ERROR = 0.05
"""Median relative error of parameters that is allowed."""


@dataclass(frozen=True)
class Unaltered(Record):
    """A recording as it was.

    Attributes
    ----------
    recording, vessel
        Names.
    verdict, seconds
        Of its diagnosis.
    named, hinted
        Effects with their thrusters.
    """

    recording: str
    vessel: str
    verdict: str
    seconds: float
    named: tuple[str, ...]
    hinted: tuple[str, ...]


@dataclass(frozen=True)
class DoseResponse(Record):
    """How large an effect has to be in a recording to be named.

    Attributes
    ----------
    effect, recording
        Of the cases.
    present
        True where the recording as it was has that name already: such cases enter no other figure.
    sizes, named, noticed
        Of every case: its size, whether it was named, and whether it was named or a hint that the recording had not before.
    oracle_sizes
        Sizes that an oracle sees of the same, all else as in the case.
    distinct_sizes
        Sizes from which one could name them who is not told which effect it is.
    curve, noticed_curve
        Detection curves of both; None where there is no case.
    instead
        What became of those that were not named, and how often.
    """

    effect: str
    recording: str
    present: bool
    sizes: tuple[float, ...]
    named: tuple[bool, ...]
    noticed: tuple[bool, ...]
    curve: Curve | None
    noticed_curve: Curve | None
    instead: Mapping[str, int]
    oracle_sizes: tuple[float, ...] = ()
    distinct_sizes: tuple[float, ...] = ()

    @property
    def from_twice_distinct(self) -> Share:
        """Share that was named of sizes of twice the distinct one and more."""
        known = zip(self.sizes, self.distinct_sizes, self.named, strict=False)
        flags = [named for size, least, named in known if least and size >= TWICE_DISTINCT * least]
        return Share(sum(flags), len(flags))

    @property
    def doses(self) -> Doses:
        """Sizes as multiples of the oracle's; none where these are not known."""
        known = [one for one in zip(self.sizes, self.oracle_sizes, self.named, self.noticed, strict=False) if one[1]]
        return Doses(
            self.effect,
            tuple(size / least for size, least, _, _ in known),
            tuple(named for _, _, named, _ in known),
            tuple(noticed for _, _, _, noticed in known),
        )


@dataclass(frozen=True)
class Later(Record):
    """An effect that began within a recording.

    Attributes
    ----------
    effect, recording, size
        Of the case.
    onset_s
        When it began [s].
    named, noticed
        As in `DoseResponse`.
    found_s
        The onset that was found [s]; None where none was.
    """

    effect: str
    recording: str
    size: float
    onset_s: float
    named: bool
    noticed: bool
    found_s: float | None


@dataclass(frozen=True)
class Gross(Record):
    """A record that is wrong altogether.

    Attributes
    ----------
    effect, recording
        Of the case.
    outcome
        The verdict, or why it was refused.
    named
        Names that the recording as it was lacks: there ought to be none.
    noticed
        Whether it was refused or left unexplained.
    """

    effect: str
    recording: str
    outcome: str
    named: tuple[str, ...]
    noticed: bool


@dataclass(frozen=True)
class Paired(Record):
    """Two effects that were concealed together.

    Attributes
    ----------
    recording
        Of the case.
    effects
        With their thrusters.
    named, noticed
        Of each, as in `DoseResponse`.
    """

    recording: str
    effects: tuple[str, ...]
    named: tuple[bool, ...]
    noticed: tuple[bool, ...]


@dataclass(frozen=True)
class Moved(Record):
    """A parameter of an effect that a recording has already, as a name or a hint, before and after more of it was concealed.

    Attributes
    ----------
    effect, recording, parameter
        Which it is.
    before, concealed
        Estimate in the recording as it was, and the value that was concealed.
    expected
        Both together: their product for a factor, else their sum.
    found, low, high
        Estimate in the altered recording with its 95 % interval; None where it is not found there.
    """

    effect: str
    recording: str
    parameter: str
    before: float
    concealed: float
    expected: float
    found: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Missed(Record):
    """An effect of twice the oracle's size or more that was not named.

    Attributes
    ----------
    effect, recording, size
        Of the case, the effect with its thruster.
    of_oracle, of_distinct
        The size over the oracle's, and over the distinct one; 0: not known.
    outcome, why
        What became of it, and why, in the diagnosis's own words.
    instead
        Names and hints that the recording as it was has not.
    """

    effect: str
    recording: str
    size: float
    of_oracle: float
    of_distinct: float
    outcome: str
    why: str
    instead: tuple[str, ...]


@dataclass(frozen=True)
class RecordedScores(Record):
    """All figures of merit.

    Attributes
    ----------
    runs
        Cases, the recordings as they were among them.
    unaltered
        What the diagnosis makes of each recording as it was.
    responses
        By effect and recording, of effects that act all along.
    later
        Of effects that began within a recording.
    moved
        Parameters of effects that a recording has already.
    right
        Share of cases whose effect is named, of two both.
    wrong, wrong_names
        Share of cases with a name that is neither concealed in them nor in the recording as it was, and how often each.
    gone, gone_names
        Share of cases without a name that the recording as it was has, and how often each.
    recoveries, noticed_recoveries
        Errors of what was named rightly, and of what was named or a new hint: of everything first, then by effect.
    not_made
        What could not be concealed.
    seconds
        Of the median diagnosis, and of the slowest.
    pairs
        Of two effects together.
    gross
        Of records that are wrong altogether; they enter `wrong` and none of the other shares.
    rivals
        The diagnosis beside other methods, on the cases on which these were run.
    missed
        Effects of twice the oracle's size or more that were not named.
    changes
        As `responses`, of effects in a group of recordings that another group lacks.
    """

    runs: int
    unaltered: tuple[Unaltered, ...]
    responses: tuple[DoseResponse, ...]
    later: tuple[Later, ...]
    moved: tuple[Moved, ...]
    right: Share
    wrong: Share
    wrong_names: Mapping[str, int]
    gone: Share
    gone_names: Mapping[str, int]
    recoveries: tuple[EstimateErrors, ...]
    noticed_recoveries: tuple[EstimateErrors, ...]
    not_made: tuple[NotMade, ...]
    seconds: tuple[float, float]
    pairs: tuple[Paired, ...] = ()
    gross: tuple[Gross, ...] = ()
    rivals: tuple[RivalScores, ...] = ()
    missed: tuple[Missed, ...] = ()
    changes: tuple[DoseResponse, ...] = ()


def score_recorded(
    results: Sequence[CaseResult],
    not_made: Sequence[NotMade],
    own: OwnErrors | None = None,
    forces: OwnForces | None = None,
) -> RecordedScores:
    """Return the figures of merit of finished cases, each beside its recording as it was.

    Parameters
    ----------
    results
        Of all cases.
    not_made
        What could not be concealed.
    own
        What the recordings have of the same errors by themselves; nothing where None.
    forces
        What they have by themselves of effects that forces show; nothing where None.
    """
    plain = {one.case.path: one for one in results if one.case.kind == "clean"}
    altered = [one for one in results if one.case.truths]
    broken = [difference(one, plain[one.case.path]) for one in altered if one.case.kind == GROSS]
    fresh = [one for one in altered if one.case.kind != GROSS and not _present(one, plain[one.case.path])]
    differences = [difference(one, plain[one.case.path], own or {}) for one in fresh]
    wrong = [wrong_names(one) for one in (*differences, *broken)]
    gone = [_gone(one, plain[one.case.path]) for one in fresh]
    seconds = [one.diagnosis.seconds for one in results]
    return RecordedScores(
        len(results),
        tuple(_unaltered(one) for one in plain.values()),
        _responses(altered, plain, "single"),
        tuple(_later(one, plain[one.case.path]) for one in fresh if one.case.kind == "span"),
        tuple(moved for one in altered if one.case.kind == "single" for moved in _moved(one, plain[one.case.path])),
        Share(sum({truth.key for truth in one.truths} <= set(names(one)) for one in differences), len(differences)),
        Share(sum(map(bool, wrong)), len(wrong)),
        Counter(label(key) for keys in wrong for key in keys),
        Share(sum(map(bool, gone)), len(gone)),
        Counter(label(key) for keys in gone for key in keys),
        estimate_errors(differences, concealments()),
        estimate_errors([_sure(one, plain[one.case.path]) for one in differences], concealments()),
        tuple(not_made),
        (float(np.median(seconds)), max(seconds)) if seconds else (0.0, 0.0),
        tuple(_paired(one, plain[one.case.path]) for one in fresh if one.case.kind == "pair"),
        tuple(_gross(one) for one in broken),
        rival_scores([one for one in results if one.case.kind != GROSS], _beside_plain, concealments()),
        tuple(
            _missed(one, plain[one.case.path], forces or {})
            for one in fresh
            if one.case.level is not None and is_missed(one)
        ),
        _responses(altered, plain, "changed"),
    )


def _beside_plain(results: Sequence[CaseResult]) -> Compare:
    """Return what leaves the findings of a case that the same method does not make of the recording as it was."""
    plain = {one.case.path: one for one in results if one.case.kind == "clean"}

    def compare(result: CaseResult) -> CaseResult:
        as_it_was = plain[result.case.path]
        new = difference(result, as_it_was)
        known = set(names(as_it_was))
        findings = tuple(one for one in new.diagnosis.findings if one.key not in known)
        return replace(new, diagnosis=replace(new.diagnosis, findings=findings))

    return compare


def difference(result: CaseResult, plain: CaseResult, own: OwnErrors | None = None) -> CaseResult:
    """Return a case without the findings that the recording as it was has; a hint there does not excuse a name here.

    What its estimates are compared with is `expected` of what was concealed.
    """
    known, concealed = set(names(plain)), {truth.key for truth in result.truths}
    kept = tuple(one for one in result.diagnosis.findings if one.key not in known or one.key in concealed)
    case = replace(result.case, allowed=(*result.case.allowed, HULL))
    steps = {one.key for one in result.diagnosis.findings if STEP_LEVEL in one.parameters}
    # A step goes from whatever level the recording has by itself.
    realised = {
        truth.effect: dict(truth.values) if truth.key in steps else expected(truth, plain, own or {})
        for truth in result.truths
    }
    return replace(result, case=case, realised=realised, diagnosis=replace(result.diagnosis, findings=kept))


def expected(truth: Truth, plain: CaseResult, own: OwnErrors) -> dict[str, float]:
    """Return the parameters to be found: what was concealed beside what the recording has of it by itself.

    That is the estimate in the recording as it was, of a finding or a hint, or of a sensor check that finds none. A factor is
    multiplied, anything else is added.
    """
    known = concealments()[truth.effect]
    before = next((one for one in plain.diagnosis.findings if one.key == truth.key), None)
    mine = own.get((plain.case.path, truth.effect), {})
    if before is not None:
        mine = {name: one.value for name, one in before.parameters.items()}
    return {name: _together(value, mine.get(name), known) for name, value in truth.values.items()}


def _together(concealed: float, own: float | None, known: Concealment) -> float:
    if own is None or known.positions:
        return concealed
    return own * concealed if known.neutral == 1.0 else own + concealed


def from_twice_distinct(responses: Sequence[DoseResponse]) -> Share:
    """Return the share of all doses of twice the distinct size and more that was named."""
    every = [one.from_twice_distinct for one in responses]
    return Share(sum(one.count for one in every), sum(one.of for one in every))


def recorded_targets(scores: RecordedScores) -> list[Target]:
    """Return every target."""
    every = scores.recoveries[0]
    small = f"median relative error of parameters: at most {100.0 * MEDIAN_ERROR:.0f} %"
    error = every.median_error
    twice = joined("all", (one.doses for one in scores.responses)).at_twice
    distinct = from_twice_distinct(scores.responses)
    changed = joined("all", (one.doses for one in scores.changes)).at_twice
    return [
        share_target(
            f"named rightly at twice the oracle's size: at least {100.0 * AT_TWICE:.0f} %", twice, at_least=AT_TWICE
        ),
        *(
            [
                share_target(
                    f"named rightly from twice the distinct size on: at least {100.0 * AT_TWICE:.0f} %",
                    distinct,
                    at_least=AT_TWICE,
                )
            ]
            if distinct.of
            else []
        ),
        *(
            [
                share_target(
                    f"what changed between two groups, named rightly at twice the oracle's size: at least "
                    f"{100.0 * AT_TWICE:.0f} %",
                    changed,
                    at_least=AT_TWICE,
                )
            ]
            if changed.of
            else []
        ),
        share_target(
            f"cases with a name that is neither concealed nor in the recording: at most {100.0 * FALSE:.0f} %",
            scores.wrong,
            at_most=FALSE,
        ),
        share_target(
            f"cases without a name of the recording: at most {100.0 * FALSE:.0f} %", scores.gone, at_most=FALSE
        ),
        share_target(
            "95 % intervals that hold the truth: 93 to 97 %", every.covered, at_least=COVERED[0], at_most=COVERED[1]
        ),
        Target(f"{small}; {100.0 * error:.1f} %", error <= MEDIAN_ERROR, True)
        if every.errors
        else Target(small, None, False, tested=False),
        share_target("onsets within 5 s: at least 90 %", every.in_time, at_least=IN_TIME),
    ]


def _present(result: CaseResult, plain: CaseResult) -> bool:
    return any(truth.key in names(plain) for truth in result.truths)


def _gone(result: CaseResult, plain: CaseResult) -> list[Key]:
    return [key for key in names(plain) if key not in names(result) and key[0] not in (UNKNOWN, HULL)]


def _unaltered(result: CaseResult) -> Unaltered:
    diagnosis, case = result.diagnosis, result.case
    hinted = tuple(label(one.key) for one in diagnosis.findings if one.hint and one.effect != UNKNOWN)
    verdict = diagnosis.error or diagnosis.verdict
    named = tuple(label(key) for key in names(result))
    return Unaltered(case.path, case.vessel, verdict, diagnosis.seconds, named, hinted)


def _responses(results: Sequence[CaseResult], plain: Mapping[str, CaseResult], kind: str) -> tuple[DoseResponse, ...]:
    sorted_by: dict[tuple[str, str], list[CaseResult]] = {}
    for result in results:
        if result.case.kind == kind:
            sorted_by.setdefault((_effect(result.case), result.case.path), []).append(result)
    places = {name: place for place, name in enumerate(concealments())}
    keys = sorted(sorted_by, key=lambda key: (places[key[0]], key[1]))
    return tuple(_response(*key, sorted_by[key], plain[key[1]]) for key in keys)


def _response(effect: str, recording: str, results: Sequence[CaseResult], plain: CaseResult) -> DoseResponse:
    fresh = [one for one in results if not _present(one, plain)]
    sizes = tuple(one.case.size for one in fresh)
    named = tuple(one.truths[0].key in names(one) for one in fresh)
    noticed = tuple(_noticed(one, plain) for one in fresh)
    lost = Counter(
        outcome_of_missed(difference(one, plain), one.truths[0].key)
        for name, one in zip(named, fresh, strict=True)
        if not name
    )
    return DoseResponse(
        effect,
        recording,
        not fresh,
        sizes,
        named,
        noticed,
        curve(sizes, named) if fresh else None,
        curve(sizes, noticed) if fresh else None,
        dict(lost.most_common()),
        tuple(one.case.oracle_size for one in fresh),
        tuple(one.case.distinct_size for one in fresh),
    )


def is_missed(result: CaseResult) -> bool:
    """Return whether an effect of twice the oracle's size or more was not named."""
    case = result.case
    large = 0.0 < TWICE_SEEN * case.oracle_size <= case.size
    return large and case.truths[0].key not in names(result)


def _missed(result: CaseResult, plain: CaseResult, forces: OwnForces) -> Missed:
    case, key = result.case, result.truths[0].key
    before = {one.key for one in plain.diagnosis.findings}
    new = [one for one in result.diagnosis.findings if one.key not in before and one.key != key]
    return Missed(
        label(key),
        case.path,
        case.size,
        case.size / case.oracle_size,
        case.size / case.distinct_size if case.distinct_size else 0.0,
        outcome_of_missed(difference(result, plain), key),
        "; ".join(filter(None, [_cancelled(case, forces), why_missed(result, key)]))
        or ("smaller than the distinct size" if case.size < case.distinct_size else ""),
        tuple(dict.fromkeys(label(one.key) if not one.hint else f"{label(one.key)}, a hint" for one in new)),
    )


def _cancelled(case: Case, forces: OwnForces) -> str:
    """Return that the recording as it was has the opposite of an effect, so that too little is left; empty where it has not."""
    truth = case.truths[0]
    mine, known = forces.get((case.path, truth.key)), concealments()[truth.effect]
    if mine is None or len(truth.values) != 1:
        return ""
    (concealed,) = truth.values.values()
    left = _together(concealed, mine, known) - known.neutral
    size = case.size * abs(left / (concealed - known.neutral))
    if size >= min(case.size, TWICE_SEEN * case.oracle_size):
        return ""
    times = f"{size / case.oracle_size:.1f} times the oracle's size"
    return f"the recording as it was has {mine:.3g} of it by its best estimate, which leaves {times}"


def _gross(difference_: CaseResult) -> Gross:
    diagnosis, case = difference_.diagnosis, difference_.case
    noticed = bool(diagnosis.error) or diagnosis.verdict in ("unexplained", "not_testable")
    named = tuple(label(key) for key in names(difference_))
    # Where the log lay is no part of the reason.
    where, _, reason = diagnosis.error.partition(": ")
    outcome = (reason if "/" in where else diagnosis.error) or diagnosis.verdict.replace("_", " ")
    return Gross(case.truths[0].effect, case.path, outcome, named, noticed)


def _paired(result: CaseResult, plain: CaseResult) -> Paired:
    keys = [truth.key for truth in result.truths]
    named = tuple(key in names(result) for key in keys)
    noticed = tuple(_noticed(result, plain, key) for key in keys)
    return Paired(result.case.path, tuple(map(label, keys)), named, noticed)


def _noticed(result: CaseResult, plain: CaseResult, key: Key | None = None) -> bool:
    """Return whether an effect, the first where none is given, is named, or a hint that the recording as it was lacks."""
    key = result.truths[0].key if key is None else key
    found, before = ({one.key for one in each.diagnosis.findings} for each in (result, plain))
    return key in names(result) or key in found - before


def _sure(result: CaseResult, plain: CaseResult) -> CaseResult:
    """Return a case in which a new hint of an effect in it counts as its name."""
    sure = {truth.key for truth in result.truths if _noticed(result, plain, truth.key)}
    findings = tuple(replace(one, probability=1.0) if one.key in sure else one for one in result.diagnosis.findings)
    return replace(result, diagnosis=replace(result.diagnosis, findings=findings))


def _moved(result: CaseResult, plain: CaseResult) -> list[Moved]:
    truth = result.truths[0]
    known = concealments()[truth.effect]
    before, after = (
        next((one for one in each.diagnosis.findings if one.key == truth.key), None) for each in (plain, result)
    )
    if before is None or known.positions:
        return []
    made = []
    for name, value in truth.values.items():
        if name not in before.parameters:
            continue
        own = before.parameters[name].value
        found = None if after is None else after.parameters.get(name)
        numbers = (None, None, None) if found is None else (found.value, found.low, found.high)
        there = _together(value, own, known)
        made.append(Moved(label(truth.key), result.case.path, name, own, value, there, *numbers))
    return made


def _later(result: CaseResult, plain: CaseResult) -> Later:
    truth = result.truths[0]
    assert truth.onset_s is not None
    noticed = _noticed(result, plain)
    found = next((one.onset for one in result.diagnosis.findings if one.key == truth.key), None) if noticed else None
    named = truth.key in names(result)
    return Later(truth.effect, result.case.path, result.case.size, truth.onset_s, named, noticed, found)


def _effect(case: Case) -> str:
    return case.truths[0].effect
