"""A diagnosis of one log: its verdict, findings and figures, and the same as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import atan2, degrees, hypot, inf, isfinite
from pathlib import PurePath
from typing import Any

from ferryid.diagnose.data.course import MeasuredCourse
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.judging.credibility import HullChange
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.hidden_gain import HiddenGain
from ferryid.diagnose.judging.learning import Learned
from ferryid.diagnose.judging.least_sizes import LeastSize
from ferryid.diagnose.judging.likeness import Likeness, likeness_as_json
from ferryid.diagnose.judging.locate import Location, plain_location
from ferryid.diagnose.judging.posterior import Posterior
from ferryid.diagnose.judging.verdict import Remainder
from ferryid.diagnose.second_sources import SecondSources
from ferryid.signals.contiguous import LogPart
from ferryid.signals.track import LeftOut
from ferryid.types import Floats

SCHEMA = "ferryid.diagnosis/1"


@dataclass(frozen=True)
class Withheld:
    """What the diagnosis found of a signal that it was not shown, beside what the sensor had measured.

    `found` and `measured` are by the names of the effect's parameters; `measured` is the mean over the log, of a payload
    over the time that it was aboard, in the unit of `found`. `course` is what was measured of a flow over time, beside the
    course of the finding; None where that has none. `gain` is how much of what the sensor explains was found, over all logs of
    a campaign; None of a single log.
    """

    signal: str
    found: Mapping[str, Estimate]
    measured: Mapping[str, float]
    says: str
    course: MeasuredCourse | None = None
    gain: HiddenGain | None = None

    @property
    def off(self) -> tuple[float, float] | None:
        """How far a flow that was found points away from the measured one [deg], and its strength over that.

        None where either is missing, or nothing flowed.
        """
        return flow_off({name: one.value for name, one in self.found.items()}, self.measured)


def flow_off(found: Mapping[str, float], measured: Mapping[str, float]) -> tuple[float, float] | None:
    """Return by how many degrees a flow points away from another, and its strength over that; None where one is missing."""
    if not all(name in one for name in ("north", "east") for one in (found, measured)):
        return None
    strength = hypot(measured["north"], measured["east"])
    if strength == 0.0:
        return None
    apart = degrees(atan2(found["east"], found["north"]) - atan2(measured["east"], measured["north"]))
    return abs((apart + 180.0) % 360.0 - 180.0), hypot(found["north"], found["east"]) / strength


@dataclass(frozen=True)
class Diagnosis:
    """A verdict on one log.

    Attributes
    ----------
    log, vessel
        Names.
    verdict
        One of `VERDICTS`.
    findings
        In the order in which they matter.
    before, after
        On held-out rows, without and with the findings:

        - ``mse``: force error by axis [N² or N²m²];
        - ``free_run``: as `ferryid.models.scores.free_run_plain` gives it, or empty;
        - ``rows`` (in `before`, optional): how many rows these are, so that several logs can be pooled;
        - ``window_s`` (in `before`, optional): length of the windows that force is averaged over [s];
        - ``ratio`` (in `after`, optional): `after` over `before` of the force error by axis, each
          ``{"value", "low", "high"}`` with a 95 % interval from a block bootstrap;
        - ``free_run_ratio`` (in `after`, optional): the same for the root-mean-square errors of the free run, by
          ``position_m``, ``heading_rad``, ``speed_mps`` and ``yaw_rate_radps``, at the horizon ``horizon_s`` [s];
        - ``placebos`` (in `after`, optional): force error by axis with findings that cannot be true in the place of
          these, by name ("time shifted", "heading reversed").
    notes
        Sentences for the reader: what was not tested and why, what is left in the residual.
    model
        Path of the model with the findings in it.
    model_accepted
        Whether that may become the current one of its name.
    evidence
        What was left over in the whole log, one row a window: ``t`` [s], shape (m,); ``before``, ``after`` [N, N, N·m],
        shape (m, 3); optionally what was measured, ``heading`` [deg] and ``speed`` [m/s], shape (m,), ``place`` north and
        east [m], ``wind`` and ``current``, where they go to [m/s], shape (m, 2), ``nu`` [m/s, m/s, rad/s] and ``thrust``
        [N, N, N·m], shape (m, 3). Of a log that is too short, only these.
    withheld
        Signals that were hidden from the diagnosis.
    against
        The simulation that a recording was compared with, as
        `ferryid.diagnose.inference.simulation_baseline.simulation_as_json` gives it, or empty.
    posterior
        What a model can learn from it; None where it found no force left out, or was held against a simulation.
    wider
        The same with the effects of whose name alone it is in doubt; None where there are none, and in a campaign.
    located
        Where and when the recording and the model differ.
    moved
        How far the hull went that was fitted together with the findings; None where there are none of forces.
    duration_s
        From the first to the last row of the log [s].
    remainder
        What is left beside the findings.
    left_out
        Rows of the log that are not used, by reason.
    learned
        What a fit learned beside the findings; None where nothing was to be learned.
    path
        Of the log, as it was given; those of its parts joined by ``+``.
    profile
        Name or path that the vessel's profile is given by; empty where it is known from a model alone.
    copies
        Logs of its campaign that are left out since they hold the motion of another: their paths and that of the other.
    unused
        Further logs that are left out of its campaign, and why each is, as a sentence.
    likeness
        How alike effects look in the log; None where it is too short.
    likeness_of_all
        The same in all logs of its campaign together; None of a single log.
    repairs
        What was repaired of the log while it was read, as sentences.
    sources
        What topics that the profile does not map show of the sensors; of a campaign, over all logs.
    gathered
        Those of the notes that are about which logs of a campaign take part, and in which groups.
    latest
        False for a log of an earlier hull than the one that a model is stored of, where no common hull fits a campaign.
    least_sizes
        Of effects that were tested and not found: from which size on the log would have shown them.
    parts
        The logs that were given, where it is made of several that follow each other without a break.
    """

    log: str
    vessel: str
    verdict: str
    findings: tuple[Finding, ...]
    before: Mapping[str, Any]
    after: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    model: str | None = None
    model_accepted: bool = True
    evidence: Mapping[str, Floats] = field(default_factory=dict)
    withheld: tuple[Withheld, ...] = ()
    against: Mapping[str, Any] = field(default_factory=dict)
    posterior: Posterior | None = None
    wider: Posterior | None = None
    located: Location | None = None
    moved: HullChange | None = None
    duration_s: float | None = None
    remainder: Remainder = field(default_factory=Remainder)
    left_out: tuple[LeftOut, ...] = ()
    learned: Learned | None = None
    path: str = ""
    profile: str = ""
    copies: tuple[tuple[str, str], ...] = ()
    unused: tuple[tuple[str, str], ...] = ()
    likeness: Likeness | None = None
    likeness_of_all: Likeness | None = None
    repairs: tuple[str, ...] = ()
    sources: SecondSources = field(default_factory=SecondSources)
    gathered: tuple[str, ...] = ()
    latest: bool = True
    least_sizes: tuple[LeastSize, ...] = ()
    parts: tuple[LogPart, ...] = ()

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the logs that it is of, as they were given."""
        return tuple(one.path for one in self.parts) or (self.path,)


def distinguished(diagnoses: Sequence[Diagnosis]) -> tuple[Diagnosis, ...]:
    """Return diagnoses whose logs have names of their own."""
    names = distinct([one.log for one in diagnoses], [one.path for one in diagnoses])
    return tuple(replace(one, log=name) for one, name in zip(diagnoses, names, strict=True))


def distinct(names: Sequence[str], paths: Sequence[str]) -> list[str]:
    """Return names of files; of those that are alike, with as many folders before them as make them differ."""
    made = list(names)
    for depth in range(1, max((len(PurePath(one).parts) for one in paths), default=0)):
        others = set(zip(made, paths, strict=True))
        alike = [
            k
            for k, (name, path) in enumerate(zip(made, paths, strict=True))
            if any(name == other and path != where for other, where in others)
        ]
        for k in alike:
            made[k] = "/".join((*PurePath(paths[k]).parts[:-1][-depth:], names[k]))
    return made


def to_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the diagnosis as ``ferryid.diagnosis/1``."""
    return {
        "schema": SCHEMA,
        "log": diagnosis.log,
        "vessel": diagnosis.vessel,
        "verdict": diagnosis.verdict,
        "findings": [finding_as_json(one) for one in diagnosis.findings],
        "before": {"mse": {}, "free_run": {}, **diagnosis.before},
        "after": {"mse": {}, "free_run": {}, **diagnosis.after},
        "notes": list(diagnosis.notes),
        "withheld": [
            {
                "signal": one.signal,
                "found": {name: vars(estimate) for name, estimate in one.found.items()},
                "measured": dict(one.measured),
                "says": one.says,
                **({} if one.course is None else {"over_time": _over_time(one.course)}),
                **({} if one.gain is None else {"held_out_gain": one.gain.to_json()}),
            }
            for one in diagnosis.withheld
        ],
        "model": diagnosis.model,
        **({"against": dict(diagnosis.against)} if diagnosis.against else {}),
        **({} if diagnosis.located is None else {"located": plain_location(diagnosis.located)}),
        **({} if diagnosis.moved is None else {"hull_moved": vars(diagnosis.moved)}),
        **({} if diagnosis.duration_s is None else {"duration_s": diagnosis.duration_s}),
        "left_out": [asdict(one) for one in diagnosis.left_out],
        **({} if diagnosis.likeness is None else {"likeness": likeness_as_json(diagnosis.likeness)}),
        "repairs": list(diagnosis.repairs),
        **({"not_found": [one.to_json() for one in diagnosis.least_sizes]} if diagnosis.least_sizes else {}),
        **({"second_sources": diagnosis.sources.to_json()} if diagnosis.sources else {}),
        **({} if diagnosis.learned is None else {"learned": diagnosis.learned.to_json()}),
        **({"copies": copies} if (copies := copies_as_json([diagnosis])) else {}),
        **({"logs_left_out": unused} if (unused := unused_as_json([diagnosis])) else {}),
    }


def parts_as_json(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return the diagnoses of the parts of a joined log, as they stand in ``logs`` of ``ferryid.diagnosis/1``.

    Each has the findings that act in it, with times from its own start; verdict, errors and model are those of the whole.
    """
    whole = to_json(diagnosis)
    kept = ("vessel", "verdict", "before", "after", "model")
    withheld = [{key: value for key, value in one.items() if key != "over_time"} for one in whole["withheld"]]
    names = distinct([one.name for one in diagnosis.parts], [one.path for one in diagnosis.parts])
    return [
        {
            "log": name,
            "joined": diagnosis.log,
            **{key: whole[key] for key in kept},
            "findings": [finding_as_json(one) for one in findings_in(diagnosis.findings, part)],
            "notes": [
                f"Part of {diagnosis.log}, from {part.begin_s:.1f} to {part.end_s:.1f} s: verdict, errors and "
                "probabilities are those of that log."
            ],
            "withheld": withheld,
            "duration_s": part.end_s - part.begin_s,
            "left_out": [],
            "repairs": [],
        }
        for name, part in zip(names, diagnosis.parts, strict=True)
    ]


def findings_in(findings: Sequence[Finding], part: LogPart) -> tuple[Finding, ...]:
    """Return the findings of a joined log that act in a part of it, with times from the start of that part [s]."""
    return tuple(moved for one in findings if (moved := _moved(one, part)) is not None)


def _moved(finding: Finding, part: LogPart) -> Finding | None:
    """Return a finding as it acts in a part of its log; None where it does not."""
    first = -inf if finding.onset_s is None else finding.onset_s
    last = inf if finding.offset_s is None else finding.offset_s
    if first >= part.end_s or last <= part.begin_s:
        return None
    acts = [(max(a, part.begin_s), min(b, part.end_s)) for a, b in finding.intervals]
    intervals = tuple((a - part.begin_s, b - part.begin_s) for a, b in acts if b > a)
    if finding.intervals and not intervals:
        return None
    times = {"onset": first > part.begin_s, "offset": last < part.end_s}
    parameters = {
        name: replace(one, value=one.value - part.begin_s, low=one.low - part.begin_s, high=one.high - part.begin_s)
        if name in times
        else one
        for name, one in finding.parameters.items()
        if times.get(name, True)
    }
    return replace(
        finding,
        parameters=parameters,
        intervals=intervals,
        onset_s=first - part.begin_s if times["onset"] and finding.onset_s is not None else None,
        offset_s=last - part.begin_s if times["offset"] and finding.offset_s is not None else None,
        course=None,
    )


def copies_as_json(diagnoses: Sequence[Diagnosis]) -> list[dict[str, str]]:
    """Return the logs of a campaign that are left out since they hold the motion of another, each once."""
    pairs = dict.fromkeys(pair for one in diagnoses for pair in one.copies)
    return [{"log": path, "of": other} for path, other in pairs]


def unused_as_json(diagnoses: Sequence[Diagnosis]) -> list[dict[str, str]]:
    """Return the other logs that are left out of a campaign, each once, and why."""
    pairs = dict.fromkeys(pair for one in diagnoses for pair in one.unused)
    return [{"log": path, "says": why} for path, why in pairs]


def _over_time(course: MeasuredCourse) -> dict[str, Any]:
    measured = {name: [float(x) if isfinite(x) else None for x in values] for name, values in course.value.items()}
    correlation = course.correlation if isfinite(course.correlation) else None
    return {"correlation": correlation, "inside": course.inside, "measured": measured}


def finding_as_json(one: Finding) -> dict[str, Any]:
    """Return a finding as it stands in ``ferryid.diagnosis/1``."""
    return {
        "effect": one.effect,
        "instance": one.instance,
        "probability": one.probability,
        "parameters": {name: vars(estimate) for name, estimate in one.parameters.items()},
        "where": {
            "axes": dict(one.axes),
            "intervals": [list(pair) for pair in one.intervals],
            "onset": one.onset_s,
            "offset": one.offset_s,
            "regime": one.regime,
            **({} if one.course is None else {"course": one.course.to_json()}),
            **({} if one.band_hz is None else {"band_hz": list(one.band_hz)}),
            **({"law": [{**vars(term), "coefficient": vars(term.coefficient)} for term in one.law]} if one.law else {}),
        },
        "improvement": dict(one.improvement),
        **({} if one.mse is None else {"mse": dict(zip(("before", "after"), map(dict, one.mse), strict=True))}),
        "held_out": one.held_out,
        "rivals": [vars(rival) for rival in one.rivals],
        "unresolved_with": list(one.unresolved_with),
        "separating_manoeuvre": one.separating_manoeuvre,
        "says": one.says,
    }
