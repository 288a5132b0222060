"""What a diagnosis says in words, the same on the page and on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import exp, hypot, isfinite, log
from pathlib import PurePath
from shlex import quote

from ferryid.counts import counted
from ferryid.diagnose import JUDGING, UNKNOWN, Diagnosis, Estimate, Finding, worse_axes
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS
from ferryid.effects.wording import IS_A_HINT, listed, parameter_word, timed, titled, uncapitalised
from ferryid.files import name_of_log
from ferryid.report import least_sizes
from ferryid.report.diagnosis_errors import fitted, ratio_of
from ferryid.report.evaluation_text import NOT_ACCEPTED
from ferryid.types import AXES

EVERYWHERE = "all along"
LIKELY = 0.05
"""Least probability of a hint that a headline names."""
INCREDIBLE = 3.0
"""Standard deviations as of which a coefficient of the hull has moved farther than is credible."""
NAMED_UNSEEN = 3
"""Effects of which a verdict says that the log would never have shown them; the others are counted."""
SHOWN_UNUSED = 5
"""Logs left out of a campaign that its summary names; the others are counted."""
SPANS = 4
"""Intervals that are told."""
RIVALS = 3
"""Rivals that are told; the others are in the JSON."""
USUAL_OUT = "ferryid-out"
"""Output folder where none was given."""
FAR = 1e6
"""Rivals that are less likely by more than this are told in one word."""
UNSTEADY = frozenset({"gusts", "waves"})
"""Effects that are states of the filter, which has them all along."""
ENDS_S = 10.0
"""What begins and ends this near to the ends of the log acts throughout."""
SIGN = (
    "What is left over is model minus measured, as a force along the vessel's axes: a push that the model lacks shows with its "
    "sign turned round."
)
UNITS = {"surge": "N", "sway": "N", "yaw": "N·m"}
DELAYS = {
    "clock_offset": ("the position after the velocity", "the velocity after the position"),
    "time_delay": ("the navigation's data after the actuators'", "the actuators' data after the navigation's"),
}
"""Effects that are a delay of one signal after another: which, for a positive value and for a negative one."""


def title(effect: str, instance: str | None = None) -> str:
    """Return the name of an effect for people."""
    if effect == UNKNOWN:
        return "Something without a name"
    known = effects().get(effect)
    name = known.title if known else effect.replace("_", " ").capitalize()
    return titled(name, instance)


UNRECORDED = "unrecorded_force"
"""A force that the records of the actuators lack: no fault of a sensor, and nothing that could be corrected."""
NOT_CORRECTED = "not corrected"
"""What the sentence of a sensor fault says that is told and left as it is, as a clock offset in a short log."""
APART = 0.1
"""Share of the squared force error by which a finding alone may remove more than all do, before the headline says why."""


def _of_sensor(finding: Finding) -> bool:
    return finding.effect not in effects() and finding.effect != UNRECORDED


def _faults(findings: Sequence[Finding], names: Sequence[str]) -> list[str]:
    """Return which faults the sensors have, those that are corrected here apart from those that are not, as a clause."""
    left = [name for one, name in zip(findings, names, strict=True) if NOT_CORRECTED in one.says]
    corrected = [name for one, name in zip(findings, names, strict=True) if NOT_CORRECTED not in one.says]
    told = [f"{name} (not in every log)" if name in left else name for name in dict.fromkeys(corrected)]
    rest = [name for name in dict.fromkeys(left) if name not in corrected]
    parts = [f"corrected here: {listed(told)}"] if told else []
    parts += [f"not corrected here: {listed(rest)}"] if rest else []
    return [f"sensors have faults, {', and '.join(parts)}"] if parts else []


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict in one sentence."""
    every = [one for one in diagnosis.findings if one.effect != UNKNOWN]
    named = [one for one in every if one.sure]
    hints = list(dict.fromkeys(uncapitalised(title(one.effect, one.instance)) for one in every if likely_hint(one)))
    doubtful = listed(hints)
    physics = [_sure_name(one) for one in named if one.effect in effects()]
    faulty = [one for one in named if _of_sensor(one)]
    sensors = _faults(faulty, [uncapitalised(title(one.effect)) for one in faulty])
    base = "simulation" if diagnosis.against else "model"
    left_out = "the recording differs from the simulation in" if diagnosis.against else "the model left out"
    parts = [f"{left_out} {listed(physics)}"] if physics else []
    parts += [f"the {told}" for told in sensors]
    parts += ["a force acted that was not recorded"] if any(one.effect == UNRECORDED for one in named) else []
    names = "; ".join(parts) + (f"; perhaps also {doubtful}" if doubtful else "")
    removed = {axis: 1.0 - ratio.value for axis, ratio in ratio_of(diagnosis).items()}
    change = changed(removed)
    apart = {axis: share for axis, share in removed.items() if share > -JUDGING.reported_change}
    if any(one.improvement.get(axis, 0.0) > share + APART for one in named for axis, share in apart.items()):
        # A finding's own figure is of the same hull without it, and this one of the hull that makes up for all of them.
        change += f" from what a hull refitted without {'them' if len(named) > 1 else 'it'} leaves"
    them = "them" if len(physics) + len(every) - len(named) > 1 else "it"
    told = f"; with {them}, the squared force error on held-out data {change}"
    more = told if change and physics and fitted(diagnosis) else ""
    if diagnosis.verdict == "explained":
        return f"Explained: {names}{more}."
    if diagnosis.verdict == "partly_explained":
        rest = _rest(diagnosis) or ([] if doubtful else _unlikely(every))
        return " ".join([f"Partly explained: {names}{more}.", *rest])
    if diagnosis.verdict == "unexplained":
        perhaps = f" Perhaps some of it is {doubtful}." if doubtful else ""
        return f"Unexplained: the recording differs from the {base}, and nothing known here surely accounts for it.{perhaps}"
    if diagnosis.verdict == "not_testable":
        perhaps = f" Perhaps {doubtful} {'is' if len(hints) == 1 else 'are'}." if doubtful else ""
        return f"Not testable: this log cannot show whether anything is missing from the {base}.{perhaps}"
    unseen = least_sizes.never_seen(diagnosis)
    if unseen:
        told = listed(
            [*unseen[:NAMED_UNSEEN], *([f"{len(unseen) - NAMED_UNSEEN} more"] if len(unseen) > NAMED_UNSEEN else [])]
        )
        return (
            f"Matched as far as this log can show, which is not all: nothing is found missing from the {base}, but "
            f"{told} would not have been seen at any size."
        )
    return f"Matched: nothing that this log could show is missing from the {base}."


def _rest(diagnosis: Diagnosis) -> list[str]:
    """Return why a log is explained in part only, as sentences."""
    worse, much = worse_axes(ratio_of(diagnosis)), diagnosis.remainder.much
    parts = []
    if unknown := _without_a_name("More", diagnosis.findings):
        parts.append(unknown)
    if worse:
        parts.append(f"In {listed(worse)} the findings make the force error larger.")
    if much:
        parts.append(f"In {listed(much)} more force is left over than is explained.")
    if not diagnosis.remainder.testable:
        parts.append(f"Whether {'that is all' if unknown or much else 'more is missing'}, this log cannot show.")
    return parts


def _unlikely(findings: Sequence[Finding]) -> list[str]:
    """Return what alone keeps a log from being explained, as a sentence: hints that are hardly likely."""
    named = dict.fromkeys(uncapitalised(title(one.effect, one.instance)) for one in findings if not one.sure)
    return [f"Unlikely, but not excluded: {listed(list(named))}."] if named else []


def _without_a_name(what: str, findings: Sequence[Finding]) -> str:
    """Return that something, or more, is missing for which there is no name, as a sentence; empty where it is not."""
    found = [one for one in findings if one.effect == UNKNOWN]
    if not found:
        return ""
    what = what if any(one.sure for one in found) else f"Perhaps {what.lower()}"
    return f"{what} is missing, which nothing known here explains."


def changed(shares: Mapping[str, float]) -> str:
    """Return by how much the squared force error falls or rises, from the share removed on each axis."""
    falls = [f"{_percent(shares[axis])} in {axis}" for axis in AXES if shares.get(axis, 0.0) >= JUDGING.reported_change]
    rises = [
        f"{_percent(-shares[axis])} in {axis}" for axis in AXES if shares.get(axis, 0.0) <= -JUDGING.reported_change
    ]
    parts = [f"{word} by {listed(axes)}" for word, axes in (("falls", falls), ("rises", rises)) if axes]
    return " and ".join(parts) if parts or not shares else "stays as it was"


def likely_hint(finding: Finding) -> bool:
    """Tell whether a finding is a hint that is likely enough to be named in a headline."""
    return not finding.sure and finding.probability >= LIKELY


def said(finding: Finding) -> str:
    """Return the sentence of a finding; a hint's begins with "Perhaps", and one that is hardly likely with "Unlikely"."""
    if finding.sure:
        return finding.says
    return f"{'Perhaps' if likely_hint(finding) else 'Unlikely'}: {finding.says}"


def numbers(finding: Finding) -> str:
    """Return the parameters with intervals and units, as a sentence."""
    told = numbers_of(finding.parameters, finding.effect)
    return (
        f"{told if next(iter(finding.parameters)) in COEFFICIENTS else _upper(told)} (95 % intervals)." if told else ""
    )


def numbers_of(parameters: Mapping[str, Estimate], effect: str = "") -> str:
    """Return parameters of an effect with intervals and units, one after the other."""
    every = [in_words(effect, name, [one]) for name, one in parameters.items()]
    return "; ".join(f"{name} {estimate(one)}" for name, (one,) in every)


def positive_words(effect: str) -> str:
    """Return what a positive delay of an effect says is late, as a sentence; empty for an effect that is no delay."""
    return f"Positive: {DELAYS[effect][0]}." if effect in DELAYS else ""


def in_words(effect: str, name: str, every: Sequence[Estimate]) -> tuple[str, list[Estimate]]:
    """Return the name of a parameter of some logs, and its values: delays say what is late, and are positive then."""
    if name != "seconds" or effect not in DELAYS:
        return word(name), list(every)
    positive, negative = DELAYS[effect]
    if any(one.value >= 0.0 for one in every):
        return f"delay of {positive}", list(every)
    return f"delay of {negative}", [Estimate(-one.value, -one.high, -one.low, one.unit) for one in every]


def estimate(one: Estimate) -> str:
    """Return a value with its interval and unit, to the digits that the interval supports."""
    width, digits = one.high - one.low, one.digits
    unit = "" if one.unit in ("-", "") else f" {one.unit}"
    # What rounds to nothing has no sign.
    value = f"{one.value:z.{digits}f}{unit}"
    if not isfinite(width) or width == 0.0:
        return value
    return f"{value} ({one.low:z.{digits}f} to {one.high:z.{digits}f})"


def measured(value: float | None, unit: str) -> str:
    """Return what a sensor measured, with its unit."""
    return "–" if value is None else f"{value:.4g}{'' if unit in ('-', '') else f' {unit}'}"


def where(finding: Finding) -> str:
    """Return since when a finding acts, and where it shows."""
    if finding.ends and len(finding.intervals) < 2:
        # With intervals, these stand among the numbers already.
        known = all(name in finding.parameters for name, _ in finding.ends)
        told = "" if known else f"It {timed(finding.onset_s, finding.offset_s)}"
    elif len(finding.intervals) > 1:
        spans = [f"{first:.0f} to {last:.0f} s" for first, last in finding.intervals[:SPANS]]
        more = " and later" if len(finding.intervals) > SPANS else ""
        told = f"It acts from {listed(spans)}{more}"
    elif finding.intervals and not _throughout(finding):
        first, last = finding.intervals[0]
        told = f"It acts from {first:.0f} s to {last:.0f} s"
    else:
        told = "It acts throughout"
    shares = sorted(finding.axes.items(), key=lambda pair: -pair[1])
    shown = [f"{axis} ({_percent(share)})" for axis, share in shares if share >= 0.05]
    if shown:
        told += f"{', and' if told else 'It'} shows in {listed(shown)}"
    if finding.band_hz is not None:
        told += f", mostly between {finding.band_hz[0]:g} and {finding.band_hz[1]:g} Hz"
    told += power_share(finding)
    # Where the vessel was while something passed is no property of it.
    regime = "" if finding.regime == EVERYWHERE or finding.ends else finding.regime
    return f"{told}; clearest at {regime}." if regime else f"{told}." if told else ""


def power_share(finding: Finding) -> str:
    """Return how much of the power left over the spectrum of a disturbance is, where it has half of its peak or more.

    As the end of a sentence; empty for what has no spectrum.
    """
    evidence = finding.evidence
    if not all(len(evidence.get(name, ())) > 1 for name in ("frequency", "before", "explained")):
        return ""
    frequency, explained, before = (evidence[name] for name in ("frequency", "explained", "before"))
    strong = explained >= 0.5 * explained.max()
    low, high = frequency[strong][[0, -1]]
    share = min(1.0, float(explained[strong].sum() / max(before[strong].sum(), 1e-300)))
    band = f"below {high:.2g} Hz" if strong[0] else f"{low:.2g} to {high:.2g} Hz"
    axis = max(finding.axes, key=lambda one: finding.axes[one])
    return f"; where it is strongest, {band}, it is {_percent(share)} of the power left over in {axis}"


def _throughout(finding: Finding) -> bool:
    t = finding.evidence.get("t")
    first, last = finding.intervals[0]
    if finding.effect in UNSTEADY:
        return True
    return t is not None and len(t) > 0 and bool(first <= t[0] + ENDS_S and last >= t[-1] - ENDS_S)


def trust(finding: Finding) -> str:
    """Return the probability, and what the finding removes of the squared force error."""
    no_name = finding.effect == UNKNOWN
    of_what = (
        " that it is not due to chance" if no_name else ", among the effects that were tried" if finding.rivals else ""
    )
    told = f"Probability {probability(finding.probability)}{of_what}."
    change = changed(finding.improvement)
    if not change:
        return told
    data = "data that it was not fitted to" if finding.held_out else "the very data that it was fitted to"
    return f"{told} With it, the squared force error on {data} {change}{_in_figures(finding)}."


def _in_figures(finding: Finding) -> str:
    """Return the root-mean-square force error without and with a finding, on the axes on which it changes."""
    if finding.mse is None:
        return ""
    parts = [
        f"{axis} {finding.mse[0][axis] ** 0.5:.3g} to {finding.mse[1][axis] ** 0.5:.3g} {UNITS[axis]}"
        for axis in AXES
        if abs(finding.improvement.get(axis, 0.0)) >= JUDGING.reported_change
    ]
    return f" (root mean square: {', '.join(parts)})" if parts else ""


def probability(value: float) -> str:
    """Return a probability without pretending to certainty."""
    return "above 0.99" if value > 0.99 else "below 0.01" if value < 0.01 else f"{value:.2f}"


def _alike(one: str, other: str) -> bool:
    """Tell whether two ids are of effects whose formulas are alike; what has no name has no formula."""
    known = effects()
    return one in known and other in known and known[one].is_like(known[other])


def rivals(finding: Finding) -> list[str]:
    """Return what else was considered, and what would tell it apart."""
    lines = []
    if finding.unresolved_with:
        names = listed([uncapitalised(one) for name in finding.unresolved_with for one in _meant(finding, name)], "or")
        lines.append(f"These data cannot distinguish it from {names}.")
    # What has a formula alike may be unresolved though the evidence is clear.
    alike = [
        one
        for one in finding.rivals
        if one.effect in finding.unresolved_with
        and one.instance == finding.instance
        and one.delta_score <= -JUDGING.unresolved_evidence
        and _alike(one.effect, finding.effect)
    ]
    if alike:
        shapes = listed([uncapitalised(title(one.effect, one.instance)) for one in alike])
        lines.append(f"The evidence is against {shapes}, but that explains nearly as much, and formulas are idealised.")
    shown = sorted((one for one in finding.rivals if one not in alike), key=lambda rival: -rival.delta_score)[:RIVALS]
    near = [one for one in shown if one.delta_score > -log(FAR)]
    far = [uncapitalised(title(one.effect, one.instance)) for one in shown if one not in near]
    if near:
        parts = [f"{uncapitalised(title(one.effect, one.instance))} {_odds(one.delta_score)}" for one in near]
        lines.append(f"Of the other effects that were tried in its place, {'; '.join(parts)}.")
    if far:
        other = "Any other" if near else "Any other effect that was tried in its place"
        lines.append(f"{other} is less likely by a factor of more than a million: {listed(far, 'or')} would be next.")
    if finding.separating_manoeuvre:
        manoeuvre = finding.separating_manoeuvre.rstrip(".")
        lines.append(f"To separate them, record this: {manoeuvre}.")
    return lines


def _sure_name(finding: Finding, *, sizes: bool = True) -> str:
    """Return what a sure finding is called within a sentence, with its size, and all that cannot be distinguished from it."""
    first, *others = _called(finding)
    if sizes:
        first = sized(first, finding.effect, finding.parameters)
    return listed([uncapitalised(one) for one in (first, *others)], "or")


def sized(name: str, effect: str, parameters: Mapping[str, Estimate]) -> str:
    """Return the name of a finding with its size behind it in brackets: of a vector its length, else the first parameter."""
    size = _brief_size(effect, parameters)
    if not size:
        return name
    # A thruster's name stands in brackets already.
    return f"{name[:-1]}, {size})" if name.endswith(")") else f"{name} ({size})"


def _brief_size(effect: str, found: Mapping[str, Estimate]) -> str:
    """Return the size of a finding in a few words; empty where none is known."""
    if "north" in found and "east" in found:
        one = found["north"]
        return _value(hypot(one.value, found["east"].value), one.digits, one.unit)
    for name, one in found.items():
        if name not in ("onset", "offset"):
            called, (value,) = in_words(effect, name, [one])
            # What has the name of an axis or of a coefficient and no unit is a factor on it.
            factor = name in (*AXES, *COEFFICIENTS) and one.unit in ("-", "")
            return f"{called} {'× ' if factor else ''}{_value(value.value, value.digits, value.unit)}"
    return ""


def _value(value: float, digits: int, unit: str) -> str:
    return f"{value:z.{digits}f}" + ("" if unit in ("-", "") else f" {unit}")


def _called(finding: Finding) -> list[str]:
    """Return the titles of a finding's effect and of all that cannot be distinguished from it."""
    return [
        title(finding.effect, finding.instance),
        *(one for name in finding.unresolved_with for one in _meant(finding, name)),
    ]


def _meant(finding: Finding, name: str) -> list[str]:
    """Return what an effect that is not told apart is called: of the finding's own it is that of another thruster."""
    if name != finding.effect:
        return [title(name)]
    others = [
        title(name, one.instance)
        for one in finding.rivals
        if one.effect == name and one.delta_score > -JUDGING.unresolved_evidence
    ]
    return others or [title(name)]


def new_model(diagnosis: Diagnosis) -> str:
    """Return which model it is, where it lies and how to use it; empty where there is none."""
    if diagnosis.model is None:
        return ""
    path = PurePath(diagnosis.model)
    label = f"{path.parent.name}@{path.stem}"
    out = path.parents[2] if len(path.parents) > 2 else PurePath(USUAL_OUT)
    where = "" if out == PurePath(USUAL_OUT) else f" --out {quote(str(out))}"
    learned = diagnosis.learned
    alone = learned is not None and (diagnosis.posterior is None or learned.fit_alone)
    what = "The model that was learned is" if alone else "The model with the findings is"
    told = "use it with" if diagnosis.model_accepted else f"it is {NOT_ACCEPTED}. Judge it on a log of another day with"
    return f"{what} {label}, which is {diagnosis.model}; {told}: ferryid evaluate {label} LOG{where}"


def model_of_all(diagnoses: Sequence[Diagnosis]) -> str:
    """Return the same of the one model that several logs lead to; empty of one log, and where there is none."""
    stored = [one for one in diagnoses if one.model]
    if len(diagnoses) < 2 or not stored:
        return ""
    return new_model(next((one for one in stored if one.posterior), stored[0]))


def summary(diagnoses: Sequence[Diagnosis]) -> str:
    """Return the verdict in one sentence, of one log or of several."""
    if len(diagnoses) == 1:
        return " ".join(filter(None, (headline(diagnoses[0]), copies(diagnoses), unused(diagnoses))))
    counts = [
        f"{sum(one.verdict == verdict for one in diagnoses)} {verdict.replace('_', ' ')}"
        for verdict in dict.fromkeys(one.verdict for one in diagnoses)
    ]
    every = [finding for one in diagnoses for finding in one.findings]
    named = [one for one in every if one.effect != UNKNOWN]
    # Sizes differ from log to log.
    sure = list(dict.fromkeys(_sure_name(one, sizes=False) for one in named if one.sure and one.effect in effects()))
    faulty = [one for one in named if one.sure and _of_sensor(one)]
    sensors = _faults(faulty, [_sure_name(one, sizes=False) for one in faulty])
    unrecorded = sum(any(one.sure and one.effect == UNRECORDED for one in each.findings) for each in diagnoses)
    doubtful = dict.fromkeys(uncapitalised(title(one.effect, one.instance)) for one in named if likely_hint(one))
    known = {uncapitalised(name) for one in named if one.sure for name in _called(one)}
    perhaps = [one for one in doubtful if one not in known]
    parts = [f"Of {counted(len(diagnoses), 'log')}, {listed(counts)}."]
    if sure:
        parts.append(f"The model left out {listed(sure)}.")
    parts += [f"The {told}." for told in sensors]
    if unrecorded:
        parts.append(f"In {unrecorded} of them a force acted that was not recorded.")
    if perhaps:
        parts.append(f"Perhaps the model {'also ' if sure else ''}left out {listed(perhaps)}.")
    if unknown := _without_a_name("More" if named else "Something", every):
        parts.append(unknown)
    return " ".join(filter(None, (*parts, copies(diagnoses), unused(diagnoses))))


def copies(diagnoses: Sequence[Diagnosis]) -> str:
    """Return which logs are copies of others and have no part in the estimate, as a sentence; empty where none is."""
    found = dict.fromkeys(pair for one in diagnoses for pair in one.copies)
    if not found:
        return ""
    told = listed([f"{name_of_log(path)} (of {name_of_log(other)})" for path, other in found])
    are = "log is a copy and" if len(found) == 1 else "logs are copies and"
    return f"{len(found)} further {are} left out of the estimate: {told}."


def unused(diagnoses: Sequence[Diagnosis]) -> str:
    """Return which other logs are left out of a campaign, as a sentence; empty where none is. The notes give the reasons."""
    found = list(dict.fromkeys(path for one in diagnoses for path, _ in one.unused))
    if not found:
        return ""
    names = [name_of_log(path) for path in found[:SHOWN_UNUSED]]
    more = len(found) - len(names)
    names += [f"{more} more"] if more else []
    return (
        f"{counted(len(found), 'log')} {'is' if len(found) == 1 else 'are'} left out of the campaign: {listed(names)}."
    )


def about_errors(diagnosis: Diagnosis) -> list[str]:
    """Return what a reader of the table of force errors must know: what they are of, and what is not in them."""
    lines = []
    if diagnosis.findings:
        unsteady = [uncapitalised(title(one.effect)) for one in diagnosis.findings if one.effect in UNSTEADY]
        absent = [
            *unsteady,
            *(["unexplained forces"] if any(one.effect == UNKNOWN for one in diagnosis.findings) else []),
        ]
        if absent:
            rows = ", and left in both rows" if fitted(diagnosis) else ""
            lines.append(f"Not subtracted from these errors{rows}: {listed(absent)}.")
    if diagnosis.moved is not None:
        one = diagnosis.moved
        lines.append(
            "The hull's coefficients were refitted too, by themselves for the errors without the findings and together with "
            f"them for the others. There, the coefficient {one.coefficient} moved farthest, from {one.before:.4g} to "
            f"{one.value:.4g} {one.unit}: {abs(one.deviations):.2g} prior standard deviations"
            f"{', farther than is credible' if abs(one.deviations) > INCREDIBLE else ''}."
        )
    if "window_s" in diagnosis.before:
        lines.append(
            f"These errors are means over windows of {diagnosis.before['window_s']:.2g} s, in which what is faster cancels. "
            "Those of ferryid evaluate are of all rows of a log, and row by row larger as a rule."
        )
    return lines


def findings_of_all(diagnoses: Sequence[Diagnosis]) -> tuple[Finding, ...]:
    """Return the findings of the vessel, not of a log: those of its sensors, and what every log has in the same words.

    What has a figure of its own stays with its log. Sure ones come first.
    """
    if len(diagnoses) < 2:
        return ()
    every = [{(one.key, one.says) for one in diagnosis.findings} for diagnosis in diagnoses]
    found = {
        (one.key, one.says): one
        for diagnosis in diagnoses
        for one in diagnosis.findings
        if one.vessel or ("before" not in one.evidence and all((one.key, one.says) in shown for shown in every))
    }
    return tuple(sorted(found.values(), key=lambda one: not one.sure))


def where_common(diagnoses: Sequence[Diagnosis], common: Sequence[Finding]) -> str:
    """Return in which logs the findings of all logs are: a log that differs keeps its own."""
    return (
        "In several logs"
        if any(len(findings_of(one, common)) + len(common) > len(one.findings) for one in diagnoses)
        else "In all logs"
    )


def findings_of(diagnosis: Diagnosis, shared: Sequence[Finding] = ()) -> list[Finding]:
    """Return the findings of a log without those of all logs."""
    known = {(one.key, one.says) for one in shared}
    return [one for one in diagnosis.findings if (one.key, one.says) not in known]


def notes_of_all(diagnoses: Sequence[Diagnosis]) -> tuple[str, ...]:
    """Return the notes that every one of several logs has."""
    if len(diagnoses) < 2:
        return ()
    return tuple(note for note in dict.fromkeys(diagnoses[0].notes) if all(note in one.notes for one in diagnoses))


def notes_of(diagnosis: Diagnosis, told: Sequence[str] = ()) -> list[str]:
    """Return the notes of a log, each once, without those that were told of all logs."""
    return _with_one_reason([note for note in dict.fromkeys(diagnosis.notes) if note not in told])


def _with_one_reason(notes: Sequence[str]) -> list[str]:
    """Return notes in which findings that are hints for one reason are told together, where the first of them stands."""
    titles = dict[str, list[str]]()
    for note in notes:
        title, _, why = note.partition(IS_A_HINT)
        titles.setdefault(why, []).append(title)
    together = {
        f"{alike[0]}{IS_A_HINT}{why}": f"Each of {listed(list(map(uncapitalised, alike)))}{IS_A_HINT}{why}"
        for why, alike in titles.items()
        if why and len(alike) > 1
    }
    taken = {f"{title}{IS_A_HINT}{why}" for why, alike in titles.items() if why for title in alike[1:]}
    return [together.get(note, note) for note in notes if note not in taken]


def foremost_notes(diagnosis: Diagnosis) -> list[str]:
    """Return those notes on a single log that come before its findings: that it is no recording, and what was left out."""
    return [note for note in notes_of(diagnosis) if note in diagnosis.gathered]


def about_log(diagnosis: Diagnosis) -> str:
    """Return how long the log is."""
    if diagnosis.duration_s is None:
        return ""
    minutes, seconds = divmod(round(diagnosis.duration_s), 60)
    return f"The log lasts {minutes} min {seconds} s." if minutes else f"The log lasts {seconds} s."


def _odds(delta: float) -> str:
    if delta > -0.7:
        return "is as likely"
    return f"is {float(f'{exp(-delta):.2g}'):,.0f} times less likely".replace(",", " ")


def word(name: str) -> str:
    """Return the name of a parameter for people."""
    return name if name in COEFFICIENTS else parameter_word(name)


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if isfinite(share) else "an unknown share"
