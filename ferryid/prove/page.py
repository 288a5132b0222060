"""The proof as a page: what was concealed, what was found, and how near a diagnosis comes to an oracle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, isinf
from textwrap import wrap
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.result import AXES
from ferryid.prove.conceal import HIDINGS
from ferryid.prove.curves import Curve
from ferryid.prove.draw import KINDS, cells
from ferryid.prove.names import Share
from ferryid.prove.plant.vessels import VESSELS
from ferryid.prove.recovery import WITHIN, Recovery
from ferryid.prove.score import CLEAN, Detection, Scores
from ferryid.prove.second_log import Claim, Method
from ferryid.report.proof_figures import Detected, Seen, confusion_matrix, detection_curves, parameter_errors

HEADINGS: Mapping[str, str] = {
    "clean": "Nothing concealed",
    "single": "One effect, from invisible to gross",
    "span": "One effect in a part of the trial",
    "vessel": "Other vessels",
    "pair": "Two effects",
    "triple": "Three effects",
    "weather": "One effect under gusty wind and waves, none of them measured",
    "crossings": "Poor excitation: crossings only",
    "short": "Five minutes",
    "wrong base": "A base model with masses and damping at 40 %",
    "outside": "Outside the library",
}
PLACE = {cell.name: place for place, cell in enumerate(cells())}
"""Of every cell, in the order of the report."""
MOST_RATIO = 1.5
"""Ratio of the sizes named reliably, the diagnosis's over the oracle's, that is allowed."""
COVERED = (0.93, 0.97)
WIDTH = 120
FALSE = 0.01


def targets(scores: Scores) -> list[dict[str, Any]]:
    """Return what was to be reached, what was, and whether: None where an interval leaves it open."""
    every = scores.recoveries[0]
    clean = scores.false_names.get("clean", Share(0, 0))
    overall = scores.false_names["all"]
    ratios = [one for one in scores.detections if one.ratio is not None]
    near = [
        one for one in ratios if one.ratio is not None and one.ratio.value is not None and one.ratio.value <= MOST_RATIO
    ]
    return [
        _target("clean logs with a wrong name: at most 1 %", clean, at_most=FALSE),
        _target("all logs with a wrong name: at most 1 %", overall, at_most=FALSE),
        _target(
            "95 % intervals that hold the truth: 93 to 97 %", every.covered, at_least=COVERED[0], at_most=COVERED[1]
        ),
        _target("onsets and offsets within 5 s: at least 90 %", every.in_time, at_least=0.9),
        {
            "what": f"sizes named 19 times in 20 at most {MOST_RATIO} times the oracle's: {len(near)} of "
            f"{len(scores.detections)} effects",
            "reached": len(near) == len(scores.detections) if scores.detections else None,
            "sure": True,
        },
    ]


def _target(what: str, share: Share, *, at_least: float = 0.0, at_most: float = 1.0) -> dict[str, Any]:
    if not share.of:
        return {"what": f"{what}; there was none", "reached": None, "sure": False}
    low, high = share.interval
    inside = at_least <= share.value <= at_most
    sure = at_least <= low and high <= at_most if inside else high < at_least or low > at_most
    return {"what": f"{what}; {_share(share)}", "reached": inside if sure or not inside else None, "sure": sure}


def figures(scores: Scores) -> dict[str, str]:
    """Return the page's figures by file name, as SVG text."""
    # In the order of the cells, whatever that of the cases.
    told = sorted(zip(scores.confusion.rows, scores.confusion.counts, strict=True), key=lambda row: PLACE[row[0]])
    rows, counts = [row for row, _ in told], [count for _, count in told]
    drawn = {"confusion.svg": confusion_matrix(rows, scores.confusion.columns, counts)}
    if scores.detections:
        drawn["detection.svg"] = detection_curves([_detected(one) for one in _ordered(scores.detections)])
    found = {one.effect: one.errors for one in scores.recoveries[1:] if one.errors}
    if found:
        drawn["errors.svg"] = parameter_errors(found, WITHIN)
    return drawn


def _detected(one: Detection) -> Detected:
    hiding = HIDINGS[one.cell]
    return Detected(
        one.cell,
        hiding.unit,
        (hiding.least / 1.3, 1.3 * hiding.most),
        _seen(one.sizes, one.blind_named, one.blind),
        None if one.oracle is None else _seen(one.oracle_sizes, one.oracle_named, one.oracle),
    )


def _ordered(detections: Sequence[Detection]) -> list[Detection]:
    return sorted(detections, key=lambda one: PLACE[one.cell])


def _seen(sizes: Sequence[float], named: Sequence[bool], fitted: Curve) -> Seen:
    x = np.geomspace(fitted.least, fitted.most, 120)
    return Seen(np.asarray(sizes), np.asarray(named, dtype=bool), x, fitted.share(x))


def page(result: Mapping[str, Any], scores: Scores) -> str:
    """Return the page as Markdown; figures lie in the folder ``proof`` beside it.

    Parameters
    ----------
    result
        Seed, commitment, guard, counts, targets and settings of the proof.
    scores
        Of its cases.
    """
    every = scores.recoveries[0]
    text = [
        "# Proof: what `ferryid diagnose` finds that was concealed",
        "",
        f"Written by `{_command(result)}`: {counted(scores.runs, 'log')}, {result['settings']['runs']:g} of "
        "each size of each effect.",
        _counted(result["counts"], scores.seconds),
        "What was mended because of such proofs, and what remains weak, stands in `reports/proof/mended.md`.",
        "",
        *INTRODUCTION,
        *_lines(
            f"- The answers to these logs were sealed with SHA-256 `{result['commitment']}` before the first diagnosis "
            "began. It is the hash of the salt in `answers.json`, a line feed, and the answers as JSON with sorted keys "
            "and no blanks: `ferryid prove --check FOLDER` makes it again."
        ),
        f"- They were drawn, written and diagnosed by sources of hash `{result['sources']}`.",
        f"- The diagnosing processes could not read them: {GUARDS[result['guard']]}",
        f"- Vessels: {'; '.join(vessel.title for vessel in VESSELS.values())}.",
        "",
        "## Targets",
        "",
        "| | reached |",
        "|---|---|",
        *(f"| {one['what']} | {_reached(one['reached'], one['sure'])} |" for one in result["targets"]),
        "",
        *_lines(
            "A name is a finding with a probability above 0.5. It is wrong unless it is in the log, said in "
            "advance not to be wrong, "
            "or said by the diagnosis not to be told from the truth. Not wrong is `hull_parameters`, as each "
            "profile's hull is off by "
            "design (but it is right only if a concealed coefficient is told); gusts and waves where both blow "
            "or boats pass; what a "
            "changing wind or current is in part; fouling on a model that lacks damping. Without these exceptions "
            f"{_share(scores.strict)} of the logs name something that is not in them; {_share(scores.hinted)} "
            f"have a hint of such, "
            "which no figure counts. Brackets hold 95 % intervals (Clopper-Pearson for shares)."
        ),
        "",
        "## Sizes that are named",
        "",
        "![Detection curves](proof/detection.svg)",
        "",
        *_lines(
            "Blue dots: named (1) or not (0) by the diagnosis, which knew nothing. Orange crosses: by the "
            "oracle, which was told "
            "the effect, thruster and times, but not the size, and names as soon as the likelihood gains more "
            "than it does by "
            "chance on clean logs. It is no upper bound: what it gains by chance on a dozen clean logs sets its "
            "threshold, and it does "
            "not place an effect better. Curves: logistic in the logarithm of the size, with a gamma prior on "
            "the slope, which keeps "
            "runs that are separated perfectly from an endless one; the grey line is 19 in 20. A run of each of "
            "five sizes tells such "
            "a size to a factor of ten or so, which the brackets say; RUNS=4 tells more."
        ),
        "",
        *_lines(
            "The last column says what became of the effect in logs in which the oracle alone named it: too "
            "small to be worth a "
            "name by the oracle's own estimate (less than two per cent of the measured acceleration, or a "
            "sensor's error below its "
            "least size), a hint, dropped because a placebo or a law without a name did as well, taken for "
            "something else, or in "
            "what is told as unexplained."
        ),
        "",
        "| effect | unit | named 19 times in 20 from | by the oracle from | ratio | |",
        "|---|---|--:|--:|--:|---|",
        *(_detection(one) for one in _ordered(scores.detections)),
        "",
        "## What was found of what was concealed",
        "",
        *_cells(scores),
        "![Confusion](proof/confusion.svg)",
        "",
        *_lines(
            "Downwards what is in the log (runs with at most one effect), across what is named first: *unknown*, "
            "something without a "
            "name; *none*, nothing; *wrong place*, the right effect of another thruster, or a hull's other coefficients."
        ),
        "",
        "## Parameters, intervals and times",
        "",
        *_lines(
            f"Of all that was named rightly: median relative error {_percent(every.median_error)}, "
            f"within 10 %: {_share(every.within)}; 95 % intervals that hold the truth: {_share(every.covered)}; "
            f"onsets and offsets within 5 s: {_share(every.in_time)}, their intervals hold: "
            f"{_share(every.times_held)}. "
            "Errors are relative to how far the truth is from changing nothing; those of vectors (a wind's north and "
            "east) are one."
        ),
        "",
        "![Errors](proof/errors.svg)",
        "",
        "| effect | named | median error | within 10 % | intervals hold | times within 5 s |",
        "|---|--:|--:|--:|--:|--:|",
        *(_recovered(one) for one in scores.recoveries[1:]),
        "",
        "## Claimed and achieved",
        "",
        *_lines(
            "The share of the squared force error that a diagnosis says it removes on held-out stretches, and "
            "what it removes on a "
            "second log of the same truth with another path, other weather of the same kind and other noise: "
            "medians, the difference "
            "that of the differences. The last column counts claims of a tenth or more of which four fifths are achieved."
        ),
        "",
        "| axis | logs | claimed | achieved | difference | claims kept to four fifths |",
        "|---|--:|--:|--:|--:|--:|",
        *(_claim(one) for one in scores.claims),
        "",
        "## Rivals, on the same logs",
        "",
        *_lines(
            "Force error on the second log over the base model's, and position error of 60 s of free run over "
            "the base model's "
            "(medians; 1: no better). `thesis` is the pipeline of Aurlien (2021), which names nothing; `sindy` "
            "is sparse "
            "regression by `pysindy` on the residual, `stepwise` least squares with terms chosen by BIC. Rivals "
            "were asked of every "
            "fifth log; the rows are of these logs alone. Where a diagnosis found nothing that enters a model, "
            "it leaves the base "
            "model as it was, while the others refit it whatever they find. Names are scored alike, but for "
            "thrusters, which rivals "
            "do not tell: a first name that is right, and logs with a name that is wrong."
        ),
        "",
        f"| | logs | {' | '.join(AXES)} | position | first name right | logs with a wrong name |",
        "|---|--:|--:|--:|--:|--:|--:|--:|",
        *(_method(one) for one in scores.methods),
        "",
        *(f"- `{name}` could not be asked: {why}" for name, why in scores.missing.items()),
    ]
    return "\n".join(text)


INTRODUCTION = (
    "The plant shares no formula with the hypotheses. It moves in six degrees of freedom (Dormand and Prince's rule, steps",
    "of 0.05 s), with cross flow by strips, friction by the ITTC line, lift, and Kirchhoff's added masses that couple roll",
    "and pitch into sway, surge and yaw; wind loads from a table of wall pressures; races that take time to form; pressure of",
    "short-crested waves on sides and ends; gusts of Kaimal's spectrum; a navigation whose errors come from an observer of",
    "GNSS and inertial instruments; and an autopilot in the loop. A profile is what a towing tank and a bollard pull would",
    "give: its damping is fitted to the true forces, then each coefficient is put 10 % off, either way, anew for each log.",
    "",
)
GUARDS = {
    "landlock+audit": "the kernel (Landlock) and a hook of Python refuse every file but the log, its profile and the programs.",
    "audit": "a hook of Python refuses every file but the log, its profile and the programs (this kernel "
    "has no Landlock); on "
    "disk the answers lie encrypted.",
    "": "nothing was diagnosed.",
}


def _lines(paragraph: str) -> list[str]:
    return wrap(paragraph, WIDTH, break_long_words=False, break_on_hyphens=False)


def _cells(scores: Scores) -> list[str]:
    titles = {cell.name: cell.title for cell in cells()}
    text = []
    for kind in KINDS:
        some = sorted((one for one in scores.cells if one.kind == kind), key=lambda one: PLACE[one.cell])
        if not some:
            continue
        wrong = scores.false_names.get(kind)
        text += [
            f"### {HEADINGS[kind]}",
            "",
            *([f"Logs with a wrong name: {_share(wrong)}.{_verdicts(kind, scores)}", ""] if wrong is not None else []),
            "| cell | runs | named first | all named | wrong names |",
            "|---|--:|--:|--:|--:|",
            *(
                f"| {titles.get(one.cell, one.cell)} | {one.runs} | {_few(one.first)} | {_few(one.every)} | {_few(one.false)} |"
                for one in some
            ),
            "",
        ]
    return text


def _verdicts(kind: str, scores: Scores) -> str:
    """Return the verdicts on logs in which nothing is concealed: a hull of ten per cent off is something to be found too."""
    if kind != CLEAN or not scores.verdicts:
        return ""
    told = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in scores.verdicts.items())
    return f" Verdicts, on a hull that is ten per cent off everywhere: {told}."


def _detection(one: Detection) -> str:
    unit = HIDINGS[one.cell].unit
    ratio = ""
    note = ", ".join(f"{count} {what}" for what, count in one.instead.items())
    if one.ratio is not None:
        value = "" if one.ratio.value is None else f"{one.ratio.value:.2g} "
        ratio = f"{value}[{_end(one.ratio.low)}, {_end(one.ratio.high)}]"
        if (one.ratio.value is not None and one.ratio.value > MOST_RATIO) or one.ratio.low > MOST_RATIO:
            note = f"**more than {MOST_RATIO}**: {note}"
    return f"| {one.cell} | {unit} | {one.blind.says} | {'' if one.oracle is None else one.oracle.says} | {ratio} | {note} |"


def _recovered(one: Recovery) -> str:
    return (
        f"| {one.effect} | {one.found} | {_percent(one.median_error)} | {_few(one.within)} | {_few(one.covered)} | "
        f"{_few(one.in_time)} |"
    )


def _claim(one: Claim) -> str:
    return (
        f"| {one.axis} | {one.logs} | {_percent(one.claimed)} | {_percent(one.achieved)} | "
        f"{_percent(one.apart)} [{_percent(one.low)}, {_percent(one.high)}] | {_share(one.kept)} |"
    )


def _method(one: Method) -> str:
    mse = " | ".join(_number(one.mse.get(axis)) for axis in AXES)
    first, false = ("" if share is None else _share(share) for share in (one.first, one.false))
    return f"| {one.name} | {one.logs} | {mse} | {_number(one.free_run)} | {first} | {false} |"


def _counted(counts: Mapping[str, int], seconds: tuple[float, float]) -> str:
    lost = "".join(f", {counts[name]} {name}" for name in ("refused", "crashed") if counts[name])
    usual, slowest = seconds
    return f"{counts['diagnosed']} were diagnosed{lost}, each in {usual:.0f} s (median; the slowest {slowest:.0f} s)."


def _reached(reached: bool | None, sure: bool) -> str:
    if reached is None:
        return "reached, though the interval allows either"
    return "yes" if reached else "**missed**" if sure else "**missed**, though the interval allows either"


def _command(result: Mapping[str, Any]) -> str:
    only = result["settings"]["only"]
    return f"ferryid prove --seed {result['seed']}" + (f" --only {','.join(only)}" if only else "")


def _few(share: Share) -> str:
    return f"{share.count}/{share.of}" if share.of else ""


def _share(share: Share) -> str:
    if not share.of:
        return "none"
    low, high = share.interval
    return f"{100.0 * share.value:.1f} % ({share.count}/{share.of}) [{100.0 * low:.1f}, {100.0 * high:.1f}]"


def _percent(value: float) -> str:
    return f"{100.0 * value:.1f} %" if isfinite(value) else "none"


def _number(value: float | None) -> str:
    return "none" if value is None or not isfinite(value) else f"{value:.2f}"


def _end(value: float) -> str:
    return "∞" if isinf(value) else f"{value:.2g}"
