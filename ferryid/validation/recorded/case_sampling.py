"""Sampling of the cases that are made of real recordings: which effect, where, how large, from when on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import isinf
from zlib import crc32

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.data import window_lengths
from ferryid.diagnose.inference import INFERENCE, windows
from ferryid.effects import effects
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.json_record import Record
from ferryid.validation.case import Case, Truth
from ferryid.validation.case_sampling import LEVELS, check_runs, numbered
from ferryid.validation.recorded.effects import ACTUATOR, Concealed, Concealment, concealments
from ferryid.validation.recorded.given_back import left_over, unfollowed
from ferryid.validation.recorded.log import RecordedLog, cached_log
from ferryid.validation.recorded.manifest import Recording
from ferryid.validation.recorded.oracle_size import baselines, oracle_size, sizes_in

KINDS = ("clean", "single", "span", "pair", "gross", "changed")
"""Kinds of cells: recordings as they are, one effect all along, one that begins within the recording, two together, records
that are wrong altogether, and one effect in a group of recordings that another one lacks."""
PAIRS = (
    ("thruster_gain", "heading_bias"),
    ("thruster_gain", "lever_arm"),
    ("thruster_lag", "time_delay"),
    ("payload", "thruster_gain"),
    ("wind", "payload"),
    ("current", "mooring"),
)
"""Effects that are concealed together: some that look alike, and some of two families."""
IN_PAIRS = 4.0
"""Size of either of two, as a multiple of the oracle's: what one leaves of the other is to be seen, not its size."""
MULTIPLES = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Sizes of the detection curve, as multiples of the oracle's."""
SPREAD = 0.5
"""How much larger a size may be, as a share of the way to the next of them by the logarithm."""
TURNS = (2, 3, 1, 4, 0)
"""Sizes in the order of the runs: a single run is at twice the oracle's, where nine in ten ought to be named."""
TWICE = 2
"""Which of the sizes that is."""
MOST_MISSED = 0.02
"""Share of the rewritten rows that may lack what expresses an effect."""
MOST_LEFT = 0.5
"""Share of the squared change of an actuator's force that the library's effect may leave: more of it is something else then."""
MOST_REASONS = 4
"""Reasons that an error tells."""
LATER = (0.3, 0.6)
"""When an effect begins, as shares of the recording."""
LARGE = (3.0, 8.0)
"""How large it then is, as multiples of the oracle's size."""


@dataclass(frozen=True)
class NotMade(Record):
    """What cannot be concealed in a recording, and why.

    Attributes
    ----------
    recording, effect
        Name and effect id; the effect is empty for a recording that cannot be used.
    size
        Of the case, 0 where no size can be concealed.
    why
        As a sentence.
    """

    recording: str
    effect: str
    size: float
    why: str


@dataclass(frozen=True)
class Drawn:
    """Cases, and those that cannot be made."""

    cases: tuple[Case, ...]
    not_made: tuple[NotMade, ...]


def sample_recorded(recordings: Sequence[Recording], seed: int, runs: float, only: Sequence[str] = ()) -> Drawn:
    """Return the cases of some recordings, in random order; each recording as it is is one of them.

    Parameters
    ----------
    recordings
        To conceal effects in.
    seed
        Of everything.
    runs
        Runs of each of five sizes of each effect in each recording; of an effect that begins within it, one for each.
    only
        Effects or kinds; every one if empty.

    Raises
    ------
    FerryIdError
        For an effect that there is not, a number of runs that is none, and where no recording can be used.
    """
    check_runs(runs)
    known = [*concealments(), *KINDS]
    for name in only:
        if name not in known:
            raise FerryIdError(
                f"--only: no effect that can be concealed is called {name!r}.{did_you_mean(name, known)} "
                f"Fix: give one of {', '.join(known)}"
            )
    cases, lacking = list[Case](), list[NotMade]()
    for recording in recordings:
        try:
            logs = logs_of(recording)
            check_length(recording, logs)
            for path in recording.before:
                cached_log(path, recording.vessel)
        except FerryIdError as error:
            lacking.append(NotMade(recording.name, "", 0.0, str(error)))
            continue
        cases.append(
            _case(recording, logs, "unaltered", "clean", np.random.default_rng([seed, _key(recording, "clean")]))
        )
        for one in concealments().values():
            made, not_made = _of_effect(recording, logs, one, seed, runs * recording.runs, only)
            cases += made
            lacking += not_made
        for pair in PAIRS if (not only or "pair" in only) and not recording.before else ():
            made, not_made = _of_pair(recording, logs, pair, seed, runs * recording.runs)
            cases += made
            lacking += not_made
    if not cases:
        raise FerryIdError(f"--real: no recording can be used. The first: {lacking[0].why}")
    if not any(case.truths for case in cases):
        raise _nothing_to_conceal(recordings, lacking)
    return Drawn(tuple(numbered(cases, seed)), tuple(lacking))


def _nothing_to_conceal(recordings: Sequence[Recording], lacking: Sequence[NotMade]) -> FerryIdError:
    """Return the error for a draw without an effect, with every reason once, and what the recordings could carry instead."""
    whys = list(dict.fromkeys(one.why for one in lacking))
    told = " ".join(whys[:MOST_REASONS]) + (
        f" And {len(whys) - MOST_REASONS} more." if len(whys) > MOST_REASONS else ""
    )
    unusable = {one.recording for one in lacking if not one.effect}
    able = [
        one.id
        for one in concealments().values()
        if any(not any(map(one.cannot, logs_of(each))) for each in recordings if each.name not in unusable)
    ]
    fix = f"conceal others, such as --only {','.join(able[:3])}" if able else "give other recordings"
    return FerryIdError(f"--real: none of these effects can be concealed. {told} Fix: {fix}")


def logs_of(recording: Recording) -> list[RecordedLog]:
    """Return the logs of a recording, read once."""
    return [cached_log(path, recording.vessel) for path in recording.logs]


def check_length(recording: Recording, logs: Sequence[RecordedLog]) -> None:
    """Refuse a recording that is too short for a diagnosis.

    Raises
    ------
    FerryIdError
        For a log by itself that has too few windows without a gap.
    """
    if len(logs) > 1:
        return
    measurements = logs[0].measurements
    found = len(windows(measurements, *window_lengths(measurements.profile)).starts)
    if found < INFERENCE.fewest_windows:
        raise FerryIdError(
            f"{recording.logs[0]}: too short for a diagnosis, found {logs[0].duration_s:.0f} s with "
            f"{counted(found, 'overlapping window')} without a gap, and {INFERENCE.fewest_windows} are needed. "
            "Fix: give a longer recording, or several as a campaign"
        )


def concealed(log: RecordedLog, truth: Truth, seed: int) -> Concealed:
    """Return a recording in which an effect is concealed; the same for the same arguments."""
    return concealments()[truth.effect].conceal(log, truth, np.random.default_rng([seed, 1]))


def _of_effect(
    recording: Recording,
    logs: Sequence[RecordedLog],
    one: Concealment,
    seed: int,
    runs: float,
    only: Sequence[str],
) -> tuple[list[Case], list[NotMade]]:
    alone = len(logs) == 1 and not recording.before
    kinds = {"single": LEVELS * runs, "span": runs if one.time_limited and alone else 0.0}
    if recording.before:
        kinds = {"changed": LEVELS * runs}
    if one.gross:
        kinds = {"gross": runs if alone else 0.0}
    wanted = {kind: many for kind, many in kinds.items() if many and (not only or {kind, one.id} & set(only))}
    if not wanted or (recording.only and one.id not in recording.only):
        return [], []
    why = next((reason for log in logs if (reason := one.cannot(log))), "")
    why = why or _unfollowed(recording, logs, one)
    if why:
        return [], [NotMade(recording.name, one.id, 0.0, f"{one.id} cannot be concealed in {recording.name}: {why}.")]
    cases, lacking = list[Case](), list[NotMade]()
    for kind, many in wanted.items():
        for number in range(max(1, round(many))):
            rng = np.random.default_rng([seed, _key(recording, f"{one.id} {kind}"), number])
            case = _drawn(recording, logs, one, kind, number, rng)
            if isinstance(case, NotMade):
                lacking.append(case)
            elif (worst := _worst(logs, case)).missed > MOST_MISSED:
                text = f"{one.id} of {case.size:.3g} {one.unit} was not made in {recording.name}:"
                text = f"{text} {100.0 * worst.missed:.0f} % of"
                lacking.append(
                    NotMade(recording.name, one.id, case.size, f"{text} the rows cannot express it, as {worst.why}.")
                )
            elif (left := _left_over(logs, case)) > MOST_LEFT:
                text = f"{one.id} of {case.size:.3g} {one.unit} was not made in {recording.name}: by the altered record"
                text = (
                    f"{text} {100.0 * left:.0f} % of the squared change of a force is another one than by the effect."
                )
                lacking.append(NotMade(recording.name, one.id, case.size, text))
            else:
                cases.append(case)
    return cases, lacking


def _unfollowed(recording: Recording, logs: Sequence[RecordedLog], one: Concealment) -> str:
    """Return why forces show no effect in a recording whose vessel does not follow its actuators; empty elsewhere."""
    if any(one.visible is not None and one.visible(log) is not None for log in logs):
        return ""
    found = [unfollowed(path, recording.vessel) for path in recording.logs]
    return f"only forces would show it, and {found[0]}" if all(found) else ""


def _left_over(logs: Sequence[RecordedLog], case: Case) -> float:
    """Return the most that the library's own effect leaves of what is concealed in actuators all along, as a share."""
    some = [
        truth
        for truth in case.truths
        if concealments()[truth.effect].family == ACTUATOR and truth.effect in effects() and truth.onset_s is None
    ]
    return max((left_over(log, concealed(log, one, case.seed).log, one) for one in some for log in logs), default=0.0)


def _worst(logs: Sequence[RecordedLog], case: Case) -> Concealed:
    """Return what expresses least of a case, of its logs and its effects."""
    made = list[Concealed]()
    for log in logs:
        for truth in case.truths:
            made.append(concealed(log, truth, case.seed))
            log = made[-1].log
    return max(made, key=lambda one: one.missed)


def _of_pair(
    recording: Recording, logs: Sequence[RecordedLog], pair: tuple[str, str], seed: int, runs: float
) -> tuple[list[Case], list[NotMade]]:
    """Return the cases of two effects together, and those that are not made.

    Of a recording that cannot carry one of them whatever its size there is nothing: that effect has its own line.
    """
    both = [concealments()[name] for name in pair]
    if recording.only and not set(pair) <= set(recording.only):
        return [], []
    if any(one.cannot(log) for one in both for log in logs) or any(_unfollowed(recording, logs, one) for one in both):
        return [], []
    cases, lacking, title = list[Case](), list[NotMade](), " and ".join(pair)

    def not_made(why: str) -> NotMade:
        return NotMade(recording.name, title, 0.0, f"{title} cannot be concealed in {recording.name}: {why}.")

    for number in range(max(1, round(runs))):
        rng = np.random.default_rng([seed, _key(recording, f"{' '.join(pair)} pair"), number])
        truths, beyond = list[Truth](), ""
        for one in both:
            truth_of, most = _truth_of(logs, one, rng, None), one.sizes(logs[0])[1]
            size = IN_PAIRS * _repeatable(oracle_size(one, baselines(recording.logs, recording.vessel), truth_of))
            if size > most:
                beyond = f"together, {one.id} of {IN_PAIRS:g} times the oracle's size is beyond {most:.3g} {one.unit}"
            truths.append(truth_of(min(size, most)))
        if beyond:
            lacking.append(not_made(beyond))
            continue
        case = replace(_case(recording, logs, title, "pair", rng, truths[0], None, IN_PAIRS), truths=tuple(truths))
        if (worst := _worst(logs, case)).missed > MOST_MISSED:
            lacking.append(
                not_made(f"together, {100.0 * worst.missed:.0f} % of the rows cannot express it, as {worst.why}")
            )
        elif (left := _left_over(logs, case)) > MOST_LEFT:
            lacking.append(
                not_made(
                    f"together, {100.0 * left:.0f} % of the squared change of a force is another one than by the effect"
                )
            )
        else:
            cases.append(replace(case, allowed=tuple(name for one in both for name in one.allowed)))
    return cases, lacking


def _repeatable(size: float) -> float:
    """Return a size in eight digits: the last ones differ from one process to the next, as sums of several threads do.

    A run that goes on draws its cases again, and must draw those that it has committed itself to.
    """
    return float(f"{size:.8g}")


def _truth_of(
    logs: Sequence[RecordedLog], one: Concealment, rng: np.random.Generator, begin: float | None
) -> Callable[[float], Truth]:
    """Return what is concealed by its size: direction, thruster and times are the same for every size."""
    drawn = int(rng.integers(2**31))
    return lambda size: one.sample(size, logs[0], np.random.default_rng(drawn), (begin, None))


def _drawn(
    recording: Recording,
    logs: Sequence[RecordedLog],
    one: Concealment,
    kind: str,
    number: int,
    rng: np.random.Generator,
) -> Case | NotMade:
    if kind == "gross":
        return _case(recording, logs, one.id, kind, rng, one.sample(0.0, logs[0], rng, (None, None)))
    level = TURNS[number % LEVELS]
    multiple = MULTIPLES[level] * float(MULTIPLES[1] / MULTIPLES[0]) ** (SPREAD * rng.uniform())
    later = kind == "span"
    if later:
        multiple = float(np.exp(rng.uniform(*np.log(LARGE))))
    begin = float(rng.uniform(*LATER)) * logs[0].duration_s if later else None
    truth_of = _truth_of(logs, one, rng, begin)
    before = baselines(recording.before, recording.vessel)
    known = sizes_in(one, baselines(recording.logs, recording.vessel), truth_of, before)
    least, distinct = _repeatable(known.oracle), _repeatable(known.distinct)
    size, most = multiple * least, one.sizes(logs[0])[1]
    if size > most:
        seen = "an oracle sees none" if isinf(least) else f"an oracle needs {least:.3g} {one.unit}"
        text = f"{one.id} of {multiple:.2g} times the oracle's size was not made in {recording.name}: {seen},"
        return NotMade(recording.name, one.id, 0.0, f"{text} and sizes end at {most:.3g} {one.unit}.")
    case = _case(recording, logs, one.id, kind, rng, truth_of(size), None if later else level, size)
    return replace(case, oracle_size=least, distinct_size=distinct, allowed=one.allowed)


def _case(
    recording: Recording,
    logs: Sequence[RecordedLog],
    effect: str,
    kind: str,
    rng: np.random.Generator,
    truth: Truth | None = None,
    level: int | None = None,
    size: float = 0.0,
) -> Case:
    return Case(
        "",
        f"{effect}: {recording.name}",
        kind,
        logs[0].profile.name,
        recording.name,
        logs[0].kind,
        seed=int(rng.integers(2**31)),
        level=level,
        size=size,
        truths=() if truth is None else (truth,),
        before=len(recording.before),
    )


def _key(recording: Recording, what: str) -> int:
    return crc32(f"{recording.name} {what}".encode())
