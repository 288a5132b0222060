"""The page: tables of all methods, and where a rival did better, all from the run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import hypot, isfinite
from typing import Any

import numpy as np

from ferryid.counts import counted
from tests.rivals import second_logs
from tests.rivals.causes import causes
from tests.rivals.measures import (
    HEADING,
    LAST,
    MOST_DAMPING,
    OURS,
    POSITION,
    expected,
    inertias_covered,
    position_ratio,
)
from tests.rivals.output_error import SEGMENT_S
from tests.rivals.recorded import INSIDER, Recorded
from tests.rivals.scatter import BLOCK
from tests.rivals.scores import HORIZONS_S, Score
from tests.rivals.simulated import DRAWS, GUST_MPS, WIND_MPS, Found, summary

MARGIN = 0.02
"""Share by which an error has to be smaller to count as better."""

HEAD = f"""# ferryid beside other methods

Written by `make rivals`. All methods correct the same base model with the same terms and learn from the same rows; all are
judged on the same windows and the same starts of free runs, which none of them has seen.

| method | what it does |
|---|---|
| base model | the model in the vessel profile; where a vessel has no hull model, its rigid-body mass alone |
| ferryid weak | `fit --estimator weak`: windows, acceleration explained, whitening, prior, bounds |
| ferryid derivative | `fit --estimator derivative`: smoothed and differentiated, SIMPLS, inertia checked |
| ferryid auto | `fit`: the one that errs less on folds of the training rows, a possible one before an impossible one |
| thesis | as ferryid derivative, with 12 components and the inertia as it comes out (Aurlien 2021) |
| output error | multiple shooting, segments of {SEGMENT_S:g} s (5 m; others by Froude's law), free initial states |
| weak SINDy | windows of the same length, pysindy's `STLSQ` by axis, threshold by cross-validation |
| stepwise | ordinary least squares on differentiated motion, terms added and removed by Schwarz's criterion |

Output error (`scipy.optimize.least_squares` from the base model), weak SINDy (Messenger and Bortz 2021) and stepwise are plain
implementations in `tests/rivals`, without what a specialist would tune: no process noise, no prior, no bounds. Times are of one
process on a machine that did other work; reading of logs is left out.
"""

SIMULATED_HEAD = f"""
## Simulated trials

Learnt from one trial with the sensors' noise, judged on another of the same vessel without noise, in calm. Every coefficient of
the profile is off by the stated share, up or down at random. The simulator shares its equations
with ferryid; the independent plant (`ferryid.validation`) has six degrees of freedom, strips in cross flow and lift, which no
method's terms describe exactly. The breeze of {hypot(*WIND_MPS):.1f} m/s, in the simulator with gusts of {GUST_MPS:g} m/s and
in the plant steady, is not measured. *m11*, *m22*, *m33*: relative error, median over trials. *Damping*: error of its force at
the trial's velocities over its size, median; that of water and still air, as a log without a measured wind shows their sum.
*Held*: share of 95 % intervals of the three inertias that hold the truth; by
block bootstrap of {DRAWS} draws for ferryid and thesis, for the others those of white residuals, for weak SINDy none.
*Position*: median error of free runs after {HORIZONS_S[-1]:g} s, diverged ones counted as infinite. *Expected
error of the damping*: by the covariance of ferryid's own estimate, in which are noise, prior and unmeasured wind, and by what
the nearest combination of the terms leaves of the true force; median. It is the limit of these windows, terms and prior.
"""

VARIANTS_HEAD = """
## Errors in the regressors

The weak form with other treatments of noise in the velocity and of wind that nobody measured, on the first three trials of each
kind; medians.
*As it is*: of the velocities measured and steadied by positions those that leave less. *Noise-corrected products*: the products
of either velocity's regressors with the other's in place of squares, without bounds (Fuller 1987, section 2.4). *References as
instruments*: two-stage least squares, whose first stage explains every regressor by those of the motion that guidance asked
for; the simulator's logs hold it, those of the plant and the recordings at hand do not. Orders are no instruments in a closed
loop: the controller forms them from the same noisy navigation.
"""

RECORDED_HEAD = f"""
## Real recordings

Every recording is judged once by models that learnt from others (three folds, two where there are two; one long recording is
cut into parts). *Windows*: squared prediction error in windows of seconds over the base model's, mean of the axes. *Gain*: how
much more probable the windows' errors are than under the base model, nats per window, each with the covariance of its training
windows. *Position*, *heading*: median over free runs, diverged ones counted as infinite. *rms*: of those that did not diverge.
The best is bold. *{INSIDER[0].upper()}{INSIDER[1:]}*: fitted to the very recordings that judge it; what it leaves after a
minute is what these terms, the unmeasured weather and the noise of the starts leave to any method.
*ferryid auto over others*: ratio of the medians, with the interval that holds 95 % of draws of blocks of
{BLOCK} runs that follow each other; where it holds 1, the recordings do not say which is better. Defaults of ferryid were
chosen after looking at scores on these recordings, those of the rivals were not: take the comparison as somewhat flattering to
ferryid. AAUSHIP's recordings are not among them: nobody knows the thrust curve of its propellers, on which the scale of every
coefficient depends, nor did they record a feedback.
"""

ELSEWHERE = f"""
## Where another method is better than `fit`

By more than {100 * MARGIN:g} % of the error of ferryid auto. Diverged runs are not in the rms.
"""


def simulated_targets(found: Mapping[str, Sequence[Mapping[str, Found | str]]]) -> list[str]:
    """Return how many kinds of simulated trials, by name, meet each target, as rows of a table."""
    every = {name: summary([one[OURS] for one in trials]) for name, trials in found.items()}
    share = 100.0 * float(np.nanmean(inertias_covered(found)))
    rows = []
    for what, place, most in (("m11", 0, 2.0), ("m22", 1, 2.0), ("m33", 2, 2.0), ("damping force", 3, MOST_DAMPING)):
        values = [numbers[place] for numbers in every.values()]
        met = sum(value <= most for value in values)
        span = f"{min(values):.1f} to {max(values):.1f} %"
        if what == "damping force":
            limits = [expected(trials) for trials in found.values()]
            span += f"; expected {min(limits):.1f} to {max(limits):.1f} %"
        rows.append(f"| median error of {what} at most {most:g} % | {met} of {len(values)} kinds | {span} |")
    met = "yes" if 93.0 <= share <= 97.0 else "no"
    trials = sum(len(one) for one in found.values())
    rows.append(f"| 95 % intervals of the inertias hold 93 to 97 % | {met} | {share:.1f} % of {trials} trials |")
    return rows


def recorded_targets(every: Sequence[Recorded]) -> list[str]:
    """Return how free runs of 60 s compare with base model and rivals on all recordings, as rows of a table."""
    rows = []
    for name in every[0].scores:
        if name.startswith("ferryid"):
            continue
        ratios = [ratio for one in every if (ratio := position_ratio(one, name)) is not None]
        if not ratios:
            continue
        better = sum(ratio.value < 1.0 for ratio in ratios)
        beyond = sum(ratio.high < 1.0 for ratio in ratios), sum(ratio.low > 1.0 for ratio in ratios)
        rows.append(
            f"| position after {HORIZONS_S[-1]:g} s better than that of {name} | {better} of {len(ratios)} sets | "
            f"median ratio {np.median([ratio.value for ratio in ratios]):.2f}; beyond chance better in {beyond[0]}, worse in "
            f"{beyond[1]} |"
        )
    lost = sum(one.scores[OURS].diverged for one in every)
    runs = sum(len(one.scores[OURS].runs) for one in every)
    rows.append(f"| free runs that diverge | {lost or 'none'} | of {runs} |")
    return rows


def targets(
    found: Mapping[str, Sequence[Mapping[str, Found | str]]],
    recorded: Sequence[Recorded],
    absent: Sequence[str],
    second: Sequence[Mapping[str, Any]] = (),
) -> list[str]:
    """Return the table of what was aimed at and what was reached, by ferryid's default."""
    rows = [
        *(simulated_targets(found) if found else []),
        *(second_logs.targets(second) if second else []),
        *(recorded_targets(recorded) if recorded else []),
    ]
    missing = [] if found else ["simulated trials"]
    missing += [] if second else ["second logs of the proof"]
    missing += ["recordings"] if absent and not recorded else []
    left = [f"\nNot tested: {', '.join(missing)}."] if missing else []
    return [
        "\n## Aims and results\n",
        "Of `fit` with its defaults (ferryid auto). Rivals count where they have a model that can be simulated.",
        "",
        "| aim | reached | figures |",
        "|---|---|---|",
        *rows,
        *causes(found, recorded, second),
        *left,
        "",
    ]


def simulated_section(name: str, found: Sequence[Mapping[str, Found | str]]) -> list[str]:
    """Return the part of the page about one kind of simulated trials."""
    head = [
        "method",
        "m11 [%]",
        "m22 [%]",
        "m33 [%]",
        "damping [%]",
        "held [%]",
        "position [m]",
        "no model",
        "time [s]",
    ]
    rows = [(method, summary([one[method] for one in found])) for method in found[0]]
    low = [True, True, True, True, None, True, None, None]
    form = [".1f", ".1f", ".1f", ".1f", ".0f", ".2f", ".0f", ".1f"]
    return [
        f"\n### {name[0].upper()}{name[1:]}\n",
        f"{counted(len(found), 'trial')}. Expected error of the damping: {expected(found):.1f} %.",
        "",
        *table(head, rows, low, form),
    ]


def table(
    head: Sequence[str], rows: Sequence[tuple[str, Sequence[float]]], low: Sequence[bool | None], form: Sequence[str]
) -> list[str]:
    """Return a table in Markdown with the best of each column bold.

    Parameters
    ----------
    head
        Names of the columns, that of the methods first.
    rows
        Method and its numbers; NaN and infinity are shown as dashes.
    low
        Whether the least is best, the largest (False), or neither (None), by column.
    form
        Format of each column.
    """
    numbers = np.array([values for _, values in rows], dtype=float)
    numbers = np.where(np.isfinite(numbers), numbers, np.nan)
    best = [
        None if way is None or np.isnan(column).all() else format(np.nanmin(column) if way else np.nanmax(column), spec)
        for column, way, spec in zip(numbers.T, low, form, strict=True)
    ]
    lines = ["| " + " | ".join(head) + " |", "|---|" + "---|" * (len(head) - 1)]
    for (name, _), values in zip(rows, numbers.tolist(), strict=True):
        cells = []
        for value, top, spec in zip(values, best, form, strict=True):
            text = format(value, spec) if isfinite(value) else "–"
            cells.append(f"**{text}**" if text == top else text)
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return lines


def recorded_section(one: Recorded) -> list[str]:
    """Return the part of the page about one set of recordings."""
    head = ["method", "windows", "gain", *(f"position {h:g} s [m]" for h in HORIZONS_S), "rms 60 s [m]"]
    head += [f"heading {h:g} s [deg]" for h in HORIZONS_S]
    head += ["diverged", "time [s]"]
    rows = []
    for name, score in one.scores.items():
        rows.append((name, _figures(score)))
    low: list[bool | None] = [True, False, *[True] * 7, None, None]
    form = [".3f", ".2f", ".2f", ".2f", ".2f", ".2f", ".1f", ".1f", ".1f", ".0f", ".1f"]
    runs = len(next(iter(one.scores.values())).runs)
    about = f"{counted(one.logs, 'recording')}, {one.seconds:.0f} s, {counted(runs, 'free run')}."
    if one.case.parts:
        about = f"One recording in {one.case.parts} parts, {one.seconds:.0f} s, {counted(runs, 'free run')}."
    if one.refused:
        about += f" Not usable: {', '.join(one.refused)}."
    # Its row is below the table of those that are compared, so that none of its figures is the best.
    insider = table(head, [(f"*{INSIDER}*", _figures(one.insider))], [None] * len(low), form)[-1]
    lines = [f"\n### {one.case.name}\n", about, "", *table(head, rows, low, form), insider, ""]
    for name, score in one.scores.items():
        if score.failed:
            lines.append(
                f"- {name}: no model that can be simulated in {counted(len(score.failed), 'fold')} ({score.failed[0]})."
            )
    others = [name for name in one.scores if not name.startswith("ferryid")]
    ratios = [f"{name} {ratio.text}" for name in others if (ratio := position_ratio(one, name)) is not None]
    return [*lines, f"- ferryid auto over others, position after {HORIZONS_S[-1]:g} s: {'; '.join(ratios)}."]


def _figures(score: Score) -> list[float]:
    """Return the numbers of a method in the table of a set of recordings; NaN where it has no model."""
    degrees = 180.0 / np.pi
    values = [score.ratio, float(np.mean(score.gain))]
    values += [score.median(POSITION, k) for k in range(len(HORIZONS_S))] + [score.rms(POSITION, LAST)]
    values += [degrees * score.median(HEADING, k) for k in range(len(HORIZONS_S))] + [float(score.diverged)]
    return [*([float("nan")] * len(values) if score.failed else values), score.seconds]


def variants_section(found: Mapping[str, Sequence[Mapping[str, Found | str]]]) -> list[str]:
    """Return the part of the page about treatments of errors in the regressors; trials by the name of their kind."""
    lines = [VARIANTS_HEAD]
    for what, place in (("m33", 2), ("damping force", 3), ("position after 60 s", 5)):
        unit = "m" if place == 5 else "%"
        names = list(next(iter(found.values()))[0])
        rows = []
        for kind, trials in found.items():
            rows.append((kind, [summary([one[name] for one in trials])[place] for name in names]))
        lines += [f"\n*{what}* [{unit}]\n", "| trials | " + " | ".join(names) + " |", "|---|" + "---|" * len(names)]
        spec = ".2f" if place == 5 else ".1f"
        shown = [(kind, [format(one, spec) if isfinite(one) else "–" for one in values]) for kind, values in rows]
        lines += [f"| {kind} | " + " | ".join(values) + " |" for kind, values in shown]
    return lines


def better_simulated(name: str, found: Sequence[Mapping[str, Found | str]]) -> list[str]:
    """Return sentences on where a method's error is smaller than that of ferryid's default in simulated trials."""
    named = ("m11", "m22", "m33", "damping", "", "position after 60 s")
    ours = summary([one[OURS] for one in found])
    told = []
    for method in found[0]:
        if method == OURS:
            continue
        theirs = summary([one[method] for one in found])
        ahead = [
            what
            for what, mine, other in zip(named, ours, theirs, strict=False)
            if what and other < (1.0 - MARGIN) * mine
        ]
        if ahead:
            told.append(f"- {name}: {method} in {', '.join(ahead)}.")
    return told


def better(one: Recorded) -> list[str]:
    """Return sentences on where a method's error is smaller than that of ferryid's default, by more than `MARGIN`."""
    ours = one.scores[OURS]
    measures: Mapping[str, Callable[[Score], float]] = {
        "windows": lambda score: score.ratio,
        "gain": lambda score: -float(np.mean(score.gain)),
        **{f"position after {h:g} s": (lambda score, k=k: score.median(POSITION, k)) for k, h in enumerate(HORIZONS_S)},
        "rms position after 60 s": lambda score: score.rms(POSITION, LAST),
        **{f"heading after {h:g} s": (lambda score, k=k: score.median(HEADING, k)) for k, h in enumerate(HORIZONS_S)},
    }
    told = []
    for name, score in one.scores.items():
        if name == OURS or score.failed:
            continue
        ahead = [what for what, of in measures.items() if of(score) < of(ours) - MARGIN * abs(of(ours))]
        if ahead:
            told.append(f"- {one.case.name}: {name} in {', '.join(ahead)}.")
    return told
