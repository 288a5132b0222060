"""The fit report as one HTML page that needs nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.counts import counted, verb
from ferryid.identify import FitOutcome, LogFit
from ferryid.models import RANGE_UNITS, ForceScores
from ferryid.models.forces import effective_mass
from ferryid.report import figures
from ferryid.report.drawings import Asked, Calls, Drawings, drawn
from ferryid.report.fit_timeline import fit_timeline
from ferryid.report.folder import made
from ferryid.report.headline import headline_of
from ferryid.report.html import template, with_contents
from ferryid.report.interactive import STATIC, Interactive, interactive_of
from ferryid.report.left_out import left_out_table
from ferryid.report.model_text import error_ratio
from ferryid.report.next_steps import after_fit
from ferryid.report.structure import remainder, worst_and_best_minute
from ferryid.types import AXES, NOTHING, Floats, Given
from ferryid.vessel import parse_profile
from ferryid.vessel.parse_hull import rigid_mass

MAX_LOGS = 6
"""Logs whose forces are drawn; the page stays below ten megabytes and readable."""


Page = tuple[str, dict[str, str], dict[str, str]]
"""HTML, drawings (SVG) by name, and the data of the interactive figures by file name."""


def page_of(
    result: FitOutcome,
    folder: Path,
    out: Path,
    command: Sequence[str],
    given: Given = NOTHING,
    draw: Callable[[Calls], Mapping[str, str]] = drawn,
) -> Page:
    """Return the report of a fit.

    Parameters
    ----------
    result
        The fit.
    folder, out
        Folder of the page, and the output folder that keeps the scripts of interactive figures; see `write_assets`.
    command
        The words that it was asked for with.
    given
        Logs and options among them.
    draw
        Makes the drawings.
    """
    timelines = {k: fit_timeline(log) for k, log in enumerate(result.logs[:MAX_LOGS])}
    interactive = interactive_of(timelines, folder, out)
    text, every = render(result, interactive, made(command), draw, given)
    return text, every, interactive.files()


def load_all() -> None:
    """Load what is loaded otherwise when the first page is made."""
    pages = template("fit.html").environment
    for name in ("figures.html", "left_out.html", "style.html"):
        pages.get_template(name)
    # A figure with all that those of a page have: fonts, a legend, a logarithmic axis, and points as a picture.
    with figures.styled():
        figure = figures.margins(1.0)
        ax = figure.subplots()
        ax.set_title("fonts")
        ax.semilogy([1.0, 10.0], [1.0, 10.0], ".", label="points", rasterized=True)
        figures.plain_log(ax, x=False, y=True)
        figures.legend_above(figure, ax, 1)
        figures.svg_text(figure)


def render(
    result: FitOutcome,
    interactive: Interactive = STATIC,
    origin: Mapping[str, str] | None = None,
    draw: Callable[[Calls], Mapping[str, str]] = drawn,
    given: Given = NOTHING,
) -> tuple[str, dict[str, str]]:
    """Return the report of a fit as HTML with the drawings inside, and the drawings (SVG) by name.

    `origin` is what `ferryid.report.folder.made` returns, `draw` makes the drawings, and `given` is what the fit was given.
    """
    asked = Asked()
    context = {**_context(result, interactive, asked), "made": origin}
    context["next"] = after_fit(result.model.label, result.acceptance.accepted, given)
    every = dict(draw(asked.calls))
    for figure in _figures(context):
        figure["svg"] = every[figure["file"]]
    return with_contents(template("fit.html").render(context)), every


def _figures(part: Any) -> Iterator[dict[str, Any]]:
    """Yield every figure of a context."""
    if isinstance(part, dict):
        if "svg" in part:
            yield part
        else:
            for value in part.values():
                yield from _figures(value)
    elif isinstance(part, list):
        for value in part:
            yield from _figures(value)


_HOLDS = {True: "yes", False: "no", None: "not known"}


def _context(result: FitOutcome, interactive: Interactive, drawings: Drawings) -> dict[str, Any]:
    model, verdict = result.model, result.acceptance
    shown = result.logs[:MAX_LOGS]
    left = [log.motion.log for log in result.logs[MAX_LOGS:]]
    return {
        "title": parse_profile(model.profile_text, model.name).title,
        "name": model.name,
        "version": model.version,
        "accepted": verdict.accepted,
        "verdict_word": "accepted" if verdict.accepted else "not accepted",
        "headline": headline_of(result),
        "reasons": verdict.reasons,
        "estimators": [
            {
                "name": one.name
                + (", used" if one.chosen else "")
                + ("" if one.possible else ", with inertia or damping that no hull has"),
                "folds": error_ratio(one.folds) if isfinite(one.folds) else "unknown, too short for it",
                "held_out": error_ratio(one.held_out) if isfinite(one.held_out) else "–",
            }
            for one in result.estimators
        ],
        "winds": [str(one) for one in result.winds],
        "conditions": [f"{one.title}, {one}" for one in result.conditions],
        "condition_kinds": [str(one) for one in result.condition_kinds],
        "checks": [
            {"name": check.name.replace("_", " "), "holds": _HOLDS[check.passed], "reason": check.reason}
            for check in verdict.checks
        ],
        "checks_held": _held([check.passed for check in verdict.checks]),
        "warnings": result.warnings,
        "notes": result.notes,
        "axes": AXES,
        "score_rows": _score_rows(result.scores.force),
        "refitted": "estimated_from" in result.model.settings,
        "split_notes": result.scores.split_notes,
        "logs": [
            {"name": log.motion.log, "figures": _force_figures(log, drawings), "timeline": interactive.number(k)}
            for k, log in enumerate(shown)
        ],
        "assets": interactive.assets,
        "omitted": f"Not drawn, but part of every number: {', '.join(left)}." if left else "",
        "free_run_notes": [
            f"{who}: {run.note}."
            for who, run in (("Base model", result.free_run_base), ("New model", result.free_run_model))
            if run.note
        ],
        "free_run_figures": _free_run_figures(result, drawings),
        "residual_lines": [line for log in shown for line in remainder(log)],
        "residual_figures": []
        if not shown
        else [
            {
                "file": "residual-spectrum",
                "svg": drawings.of("residual-spectrum", figures.residual_spectrum, shown),
                "caption": "Power spectral density of measured minus estimated force. A peak at some tenths of a hertz "
                "is mostly waves; what stays at the lowest frequencies is wind, current or a wrong model. The regular "
                "notches are zeros of the smoothing window.",
            },
            {
                "file": "residual-autocorrelation",
                "svg": drawings.of("residual-autocorrelation", figures.residual_autocorrelation, shown),
                "caption": "Autocorrelation of the same residual. White noise would stay inside the dashed band; a slow "
                "decay shows that something with a memory was left out, and that neighbouring samples are no independent "
                "evidence.",
            },
        ],
        "model_figures": [
            {
                "file": "components",
                "svg": drawings.of("components", figures.components, result.curve),
                "caption": "Force error over the base model's on the validation rows (orange line at 1) against the number of "
                "SIMPLS components. Training rows, dotted, may hold more force, and so more error.",
            },
            {
                "file": "coefficients",
                "svg": drawings.of(
                    "coefficients",
                    figures.coefficient_intervals,
                    (*model.terms, "1"),
                    np.vstack([model.theta, model.intercept]),
                    np.vstack([model.low, model.intercept_low]),
                    np.vstack([model.high, model.intercept_high]),
                    frozenset(result.excitation.undetermined),
                ),
                "caption": "Coefficients of the correction, each over half the width of its own 95 % block-bootstrap "
                "interval; an arrow goes on beyond the frame. Grey ones are not distinguishable from zero, pale orange ones "
                "not from each other: the data do not determine them. Intervals hold the scatter at this number of "
                "components; those of the derivative's estimator hold neither the bias by noise in the derivative nor the "
                "shrinkage that few components bring.",
            },
        ],
        "coefficients": _coefficients(result),
        "inertia": _inertia(result),
        "excitation_lines": _excitation_lines(result),
        "undetermined": sorted(result.excitation.undetermined.items()),
        "excitation_figures": []
        if not shown
        else [
            {
                "file": "excitation",
                "svg": drawings.of("excitation", figures.excitation, result.excitation, shown),
                "caption": "Top left: singular values of the standardised basis; a value near zero is a combination of "
                "terms that this trial does not identify. The rest: velocities in the training rows, each pair against "
                "the other; a model is only as good as the cloud it saw.",
            },
            {
                "file": "track",
                "svg": drawings.of("track", figures.track, result.logs),
                "caption": "Where the vessel went. Gaps are stretches without data.",
            },
        ],
        "ranges": [
            {"name": name, "low": f"{low:.4g}", "high": f"{high:.4g}", "unit": RANGE_UNITS[name]}
            for name, (low, high) in model.ranges.items()
        ],
        "quality": [_quality(log) for log in result.logs],
        "archive": [
            {
                "name": log.name,
                "rows": log.rows,
                "validation_rows": log.validation_rows,
                "ratios": [_text(ratio, ".3f") for ratio in log.mse_ratio.tolist()],
            }
            for log in result.archive
        ],
        "provenance": _provenance(result),
    }


def _held(passed: Sequence[bool | None]) -> str:
    """Return how many conditions hold, and of how many the data say nothing."""
    judged = [one for one in passed if one is not None]
    unknown = len(passed) - len(judged)
    return f"{sum(judged)} of {len(judged)} hold" + (f", {unknown} could not be judged" if unknown else "")


def _score_rows(scores: ForceScores) -> list[dict[str, Any]]:
    def row(name: str, values: Floats, pattern: str, mean: str = "") -> dict[str, Any]:
        return {"name": name, "values": [_text(value, pattern) for value in values.tolist()], "mean": mean}

    still = np.sqrt(scores.mse_constant_velocity)
    constant = (
        [row("root-mean-square error of a constant velocity [N, N, N·m]", still, ".3g")]
        if np.isfinite(still).any()
        else []
    )
    return [
        row("MSE over the base model's", scores.ratio, ".3f", _text(scores.normalised_mse, ".3f")),
        row("root-mean-square error, base [N, N, N·m]", np.sqrt(scores.mse_base), ".3g"),
        row("root-mean-square error, new [N, N, N·m]", np.sqrt(scores.mse_model), ".3g"),
        *constant,
        row("R² against the applied force, base", scores.r2_base, ".3f"),
        row("R² against the applied force, new", scores.r2_model, ".3f"),
    ]


def _force_figures(log: LogFit, drawings: Drawings) -> list[dict[str, Any]]:
    shown: list[dict[str, Any]] = [
        {
            "file": f"forces-{log.motion.log}",
            "svg": drawings.of(f"forces-{log.motion.log}", figures.forces, log),
            "caption": "Applied force as measured at the actuators, and as each model estimates it from the motion. "
            "Shaded: validation, which the new model did not see, and what is left out.",
            "over_time": True,
        }
    ]
    minutes = worst_and_best_minute(log)
    if minutes is not None:
        for start, word in zip(minutes, ("worst", "best"), strict=True):
            shown.append(
                {
                    "file": f"forces-{log.motion.log}-{word}-minute",
                    "svg": drawings.of(
                        f"forces-{log.motion.log}-{word}-minute", figures.forces, log, start, start + 60.0
                    ),
                    "caption": f"The {word} minute of the new model, from {start:.0f} s.",
                    "over_time": True,
                }
            )
    return shown


def _free_run_figures(result: FitOutcome, drawings: Drawings) -> list[dict[str, str]]:
    base, new = result.free_run_base, result.free_run_model
    shown = []
    if base.starts or new.starts:
        shown.append(
            {
                "file": "free-run-errors",
                "svg": drawings.of("free-run-errors", figures.free_run_errors, base, new),
                "caption": f"Root-mean-square error of {counted(max(base.starts, new.starts), 'run')} on "
                "validation rows: each takes "
                "the measured state once and then only the measured actuator forces.",
            }
        )
    if base.example or new.example:
        shown.append(
            {
                "file": "free-run",
                "svg": drawings.of("free-run", figures.free_run_example, base, new),
                "caption": "One of these runs, over the longest stretch there is.",
            }
        )
    return shown


def _coefficients(result: FitOutcome) -> list[dict[str, Any]]:
    model = result.model
    rows = []
    for k, term in enumerate((*model.terms, "1 (constant)")):
        constant = k == len(model.terms)
        cells = []
        for j, axis in enumerate(AXES):
            value, low, high = (
                (model.intercept[j], model.intercept_low[j], model.intercept_high[j])
                if constant
                else (model.theta[k, j], model.low[k, j], model.high[k, j])
            )
            unit = ("N·m" if axis == "yaw" else "N") if constant else model.units[k][j]
            if value == low == high == 0.0:
                # Not in the structure on this axis, or not varying in this log.
                cells.append({"value": "–", "low": "", "high": "", "unit": "", "faint": True})
                continue
            cells.append(
                {
                    "value": f"{value:.4g}",
                    "low": f"{low:.4g}",
                    "high": f"{high:.4g}",
                    "unit": unit,
                    "faint": bool(low <= 0.0 <= high),
                }
            )
        rows.append({"term": term, "cells": cells})
    return rows


def _inertia(result: FitOutcome) -> list[dict[str, str]]:
    """Return the inertias that base and new model imply, beside those of the rigid body."""
    model = result.model
    profile = parse_profile(model.profile_text, model.name)
    base = effective_mass(profile, model.scale, (), np.empty((0, 3)))
    new = effective_mass(profile, model.scale, model.terms, model.theta)
    rigid = rigid_mass(profile.hull.mass_kg, profile.hull.x_g_m, profile.hull.inertia_z)
    return [
        {
            "name": f"m{i + 1}{j + 1}",
            "rigid": f"{rigid[i, j]:.5g}",
            "base": f"{base[i, j]:.5g}",
            "new": f"{new[i, j]:.5g}",
            "unit": ("kg", "kg·m", "kg·m²")[(i == 2) + (j == 2)],
        }
        for i, j in ((0, 0), (1, 1), (1, 2), (2, 1), (2, 2))
    ]


def _excitation_lines(result: FitOutcome) -> list[str]:
    excitation = result.excitation
    values = excitation.singular_values
    lines = []
    if values.size and values[0] > 0:
        weak = int(np.sum(values < 1e-3 * values[0]))
        # Less than rounding leaves of the strongest is nothing.
        nothing = values[-1] <= np.finfo(float).eps * len(values) * values[0]
        excited = (
            "not excited at all" if nothing else f"excited {values[-1] / values[0]:.2g} times as much as the strongest"
        )
        lines.append(
            f"{counted(len(values), 'basis term')}; the weakest combination is {excited}, and {weak} "
            f"{verb(weak, 'is')} below a thousandth of the strongest."
        )
    if np.isfinite(excitation.heading_coverage):
        lines.append(f"Headings cover {100.0 * excitation.heading_coverage:.0f} % of twelve 30° sectors.")
    known = [k for k, term in enumerate(result.model.terms) if term not in excitation.undetermined]
    best = sorted(known, key=lambda k: -excitation.vip[k])[:5]
    names = ", ".join(f"{result.model.terms[k]} ({excitation.vip[k]:.1f})" for k in best)
    lines.append(f"Terms that matter most, of those the data determine (variable importance in projection): {names}.")
    return lines


def _quality(log: LogFit) -> dict[str, Any]:
    quality: Mapping[str, Any] = log.data_quality
    streams = []
    for topic, stream in quality["streams"].items():
        clock = stream["clock"]
        streams.append(
            {
                "topic": topic,
                "values": [
                    clock["count"],
                    _text(clock["rate_hz"], ".2f"),
                    clock["source"],
                    _text(clock["offset_s"], ".4f"),
                    _text(clock["drift_ppm"], ".1f"),
                    _text(clock["jitter_s"], ".2f", 1e3),
                    len(clock["gaps"]),
                    clock["out_of_order"],
                    clock["duplicates"],
                ],
            }
        )
    left_out = left_out_table(log.motion.left_out)
    return {"name": log.motion.log, "remarks": quality["remarks"], "streams": streams, "left_out": left_out}


def _provenance(result: FitOutcome) -> list[dict[str, str]]:
    model = result.model
    rows = [
        ("model", f"{model.name}@{model.version}, ferryid {model.ferryid_version}, {model.created}"),
        ("settings", ", ".join(f"{key} = {value}" for key, value in model.settings.items() if value is not None)),
        ("base model scaled by", ", ".join(f"{key} = {value:g}" for key, value in model.scale.items())),
    ]
    known = [
        name
        for name in ("wind", "current", "payload")
        if any(getattr(log.motion, name) is not None for log in result.logs)
    ]
    if known:
        rows.append(("measured, and known to the model", ", ".join(known)))
    for log in model.training:
        rows.append(
            (
                f"log {log['name']}",
                f"{', '.join(log['files'])}; {log['seconds']:.0f} s, {counted(log['rows'], 'row')}; {log['sha256']}",
            )
        )
    return [{"name": name, "value": value} for name, value in rows]


def _text(value: float | None, pattern: str, factor: float = 1.0) -> str:
    return "–" if value is None or not np.isfinite(value) else format(value * factor, pattern)
