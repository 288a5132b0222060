"""What else is in a log: topics that the profile does not map, beside the mapped signals of their kind.

They are statements about instruments. Nothing that is found here changes a signal that is fitted, or becomes a finding.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import combinations
from math import isfinite
from typing import Any

import numpy as np

from ferryid.diagnose.data.measurements import MeasuredLog
from ferryid.diagnose.second_sources.candidates import Candidate, candidates
from ferryid.diagnose.second_sources.comparison import Comparison, compare
from ferryid.diagnose.second_sources.samples import MANY, Samples, mapped_slopes, read_samples
from ferryid.diagnose.second_sources.thresholds import SECOND
from ferryid.diagnose.second_sources.witnesses import Witness, witnesses
from ferryid.effects.force_model import Measurements


@dataclass(frozen=True)
class SecondSources:
    """What the other topics of one log, or of the logs of a campaign, show of the sensors.

    Attributes
    ----------
    compared
        Signals beside the mapped ones.
    witnesses
        Sensors that disagree with two others.
    passed_over
        How many signals were not compared, by the reason.
    senders
        Number of the sender by topic, where topics carry the same stamps.
    """

    compared: tuple[Comparison, ...] = ()
    witnesses: tuple[Witness, ...] = ()
    passed_over: Mapping[str, int] = field(default_factory=dict)
    senders: Mapping[str, int] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.compared or self.passed_over)

    def to_json(self) -> dict[str, Any]:
        """Return all of it for JSON."""
        return {
            "compared": [_plain(one, self.senders) for one in self.compared],
            "odd_ones": [asdict(one) for one in self.witnesses],
            "passed_over": [{"reason": reason, "signals": count} for reason, count in self.passed_over.items()],
        }


def _plain(one: Comparison, senders: Mapping[str, int]) -> dict[str, Any]:
    return {
        "topic": one.candidate.topic,
        "fields": list(one.candidate.fields),
        "seems": one.kind,
        "axes": one.axes,
        "unit": one.unit,
        "share": one.share,
        "scatter": one.scatter if isfinite(one.scatter) else None,
        "scatter_unit": one.scatter_unit,
        "follows": one.follows,
        "agrees": one.agrees,
        "repeats_mapped": one.same,
        "clock": one.clock,
        "sender": senders.get(one.candidate.topic),
        "logs": one.logs,
        "windows": one.windows,
        "differences": [
            {
                "what": difference.what,
                "parameters": {name: vars(value) for name, value in difference.parameters.items()},
                "says": difference.says,
            }
            for difference in one.differences
        ],
        "says": one.says,
    }


def compare_second_sources(
    logs: Sequence[MeasuredLog], withhold: Collection[str], progress: Callable[[str], None]
) -> SecondSources:
    """Compare what else logs of one vessel hold with what their profile maps.

    A log without such a topic is not opened again.

    Parameters
    ----------
    logs
        As they were measured, of one profile; signals are compared over all of them.
    withhold
        Signals that are hidden: their topics are not looked at.
    progress
        Called with the name of the stage.
    """
    samples: dict[Candidate, list[tuple[Samples, Measurements]]] = {}
    skipped: Counter[str] = Counter()
    looked = False
    for log in logs:
        wanted = candidates(log.measurements.profile, log.survey.recording.topics, withhold)
        if not wanted:
            continue
        if not looked:
            progress("comparing further topics with the mapped ones")
            looked = True
        found, over = read_samples(log, wanted)
        skipped |= over
        for one, values in found.items():
            samples.setdefault(one, []).append((values, log.measurements))
    if not samples:
        return SecondSources(passed_over=dict(skipped))
    skipped[MANY] += max(len(samples) - SECOND.most_signals, 0)
    length_m = logs[0].measurements.profile.hull.length_m
    compared = []
    for one, pairs in list(samples.items())[: SECOND.most_signals]:
        result = compare(one, pairs, length_m)
        if result is not None:
            compared.append(result)
        elif one.kind != "unknown":
            skipped["has too little in common time with the mapped signal"] += 1
    senders = _senders(samples)
    own = [one for one in _own(logs, {one.kind for one in compared}, length_m) if one.follows]
    found_witnesses = witnesses([*compared, *own], senders)
    return SecondSources(tuple(compared), found_witnesses, dict(+skipped), senders)


def _own(logs: Sequence[MeasuredLog], kinds: Collection[str], length_m: float) -> list[Comparison]:
    """Return what the mapped heading and position say of the mapped yaw rate and velocity, where others do as well."""
    found: dict[Candidate, list[tuple[Samples, Measurements]]] = {}
    for log in logs:
        for one, values in mapped_slopes(log).items():
            if one.kind in kinds:
                found.setdefault(one, []).append((values, log.measurements))
    compared = [compare(one, values, length_m) for one, values in found.items()]
    return [one for one in compared if one is not None]


def _senders(samples: Mapping[Candidate, Sequence[tuple[Samples, Measurements]]]) -> dict[str, int]:
    """Return the number of the sender of topics that carry the same stamps."""
    stamps = {one.topic: values[0][0] for one, values in samples.items() if values[0][0].clock == "stamp"}
    number = {topic: k for k, topic in enumerate(stamps)}
    for one, other in combinations(stamps, 2):
        a, b = stamps[one].stamps, stamps[other].stamps
        common = len(np.intersect1d(a, b, assume_unique=True))
        if common >= SECOND.same_stamps * min(len(a), len(b)):
            new, old = number[one], number[other]
            number = {topic: new if k == old else k for topic, k in number.items()}
    return number
