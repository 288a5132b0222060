"""Figures of a comparison; each model has its colour, its mark and its dashes in all of them."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from ferryid.compare import CommonErrors, ComparedLog, ComparedModel, ComparisonResult, ModelPair
from ferryid.report.figures import MEASURED, STYLE, SYMBOLS, UNITS, canvas, legend_above, margins, svg_text
from ferryid.report.structure import envelope
from ferryid.types import AXES, Flags, Floats

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Okabe and Ito's, which the colour-blind tell apart."""
MARKS = ("o", "s", "^", "D", "v", "P")
DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1)), (0, (6, 1.5, 1.5, 1.5)))
GREY = "#777777"
MINUTE_S = 60.0
TICKS = (
    tuple(10.0**k for k in range(-12, 13)),
    tuple(m * 10.0**k for k in range(-3, 4) for m in (1.0, 3.0)),
    tuple(m * 10.0**k for k in range(-2, 3) for m in (1.0, 2.0, 5.0)),
    (0.5, 0.7, 1.0, 1.5, 2.0, 3.0),
    (0.64, 0.8, 1.0, 1.25, 1.6),
)
"""Round numbers for a logarithmic axis, the sparsest first."""
WILD = 3.0
"""An estimate whose error is this many times the least may leave the frame, lest it flatten the others."""


def looks(models: Sequence[ComparedModel]) -> dict[str, dict[str, Any]]:
    """Return colour, mark and dashes of every model by its label; the base model is grey."""
    found: dict[str, dict[str, Any]] = {}
    k = 0
    for model in models:
        if model.is_base:
            found[model.label] = {"color": GREY, "marker": "x", "linestyle": (0, (2, 2))}
            continue
        found[model.label] = {
            "color": COLOURS[k % len(COLOURS)],
            "marker": MARKS[k % len(MARKS)],
            # Dashes set models of one colour apart, the seventh from the first.
            "linestyle": DASHES[k // len(COLOURS) % len(DASHES)],
        }
        k += 1
    return found


def over_reference(pairs: Sequence[ModelPair], label: str, reference: str) -> ModelPair:
    """Return a model's ratios over a reference's; turned round where the pairs hold the inverse."""
    for pair in pairs:
        if (pair.first, pair.second) == (label, reference):
            return pair
        if (pair.first, pair.second) == (reference, label):
            return pair.inverse()
    raise KeyError(label)


def mse_ratios(result: ComparisonResult, shown: Sequence[tuple[str, CommonErrors]], reference: str) -> str:
    """Mean squared prediction error of every model over a reference's, per axis and log, with 95 % intervals."""
    look = looks(result.models)
    labels = [label for label in result.labels if label != reference]
    rows = len(shown) * (len(labels) + 1)
    with mpl.rc_context(STYLE):
        figure = margins(1.25 + 0.21 * rows, top=0.3 + 0.2 * ((len(labels) + 2) // 3), left=0.15, between=(0.08, 0.1))
        panels = figure.subplots(1, 3, sharey=True)
        # The names of logs may be longer than the first panel is wide.
        panels[0].set_zorder(2)
        panels[0].patch.set_visible(False)
        for j, (ax, axis) in enumerate(zip(panels, AXES, strict=True)):
            spans = []
            for group, (title, scope) in enumerate(shown):
                top = -group * (len(labels) + 1)
                if j == 0:
                    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
                    ax.annotate(
                        title, (0.02, top), xycoords=("axes fraction", "data"), fontsize=9, va="center", bbox=box
                    )
                for k, label in enumerate(labels):
                    ratio = over_reference(scope.pairs, label, reference).prediction[axis]
                    if not isfinite(ratio.value):
                        continue
                    y = top - 1 - k
                    known = isfinite(ratio.low) and isfinite(ratio.high)
                    if known:
                        ax.plot((ratio.low, ratio.high), (y, y), color=look[label]["color"], linewidth=1.6)
                    ax.plot(
                        ratio.value,
                        y,
                        marker=look[label]["marker"],
                        color=look[label]["color"],
                        # Hollow: without an interval.
                        markerfacecolor=look[label]["color"] if known else "white",
                        markersize=5,
                        linestyle="none",
                        label=label if group == 0 else "_nolegend_",
                    )
                    spans += [one for one in (ratio.value, ratio.low, ratio.high) if isfinite(one) and one > 0.0]
            ax.axvline(1.0, color=MEASURED, linewidth=0.8)
            _ratio_axis(ax, spans)
            ax.set_title(axis, fontsize=10)
            ax.set_yticks([])
            ax.set_ylim(-rows + 0.4, 0.6)
        panels[1].set_xlabel(f"prediction MSE over that of {reference}")
        legend_above(figure, panels[0], 3)
        return svg_text(figure)


def _ratio_axis(ax: Any, spans: Sequence[float]) -> None:
    """Give a logarithmic axis plain numbers, and room on both sides of one."""
    low, high = min((*spans, 0.8)), max((*spans, 1.25))
    ax.set_xscale("log")
    ax.set_xlim(low / 1.15, high * 1.15)
    _plain_ticks(ax.xaxis, low, high)


def _plain_ticks(axis: Any, low: float, high: float) -> None:
    """Mark a logarithmic axis at round numbers, at least three of them."""
    inside = next((ticks for ticks in TICKS if sum(low <= tick <= high for tick in ticks) >= 3), TICKS[-1])
    axis.set_major_locator(FixedLocator(inside))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def forces(result: ComparisonResult, trial: ComparedLog, start_s: float | None) -> str:
    """Measured force, every model's estimate and its residual below, in the minute of a log from `start_s`; None: in all."""
    look = looks(result.models)
    with mpl.rc_context(STYLE):
        figure, axes = canvas(2 * len(AXES), 8.4, top=0.3 + 0.2 * ((len(look) + 3) // 3))
        t = trial.motion.t
        first, last = (t[0], t[-1]) if start_s is None else (start_s, start_s + MINUTE_S)
        inside = np.flatnonzero((t >= first) & (t <= last))
        missing = np.where(trial.rows[inside, None], 1.0, np.nan)
        known = inside[trial.rows[inside]]
        for j in range(len(AXES)):
            ax, below = axes[2 * j : 2 * j + 2]
            measured = (trial.motion.tau[inside] * missing)[:, j]
            ax.plot(*envelope(t[inside], measured), color=MEASURED, linewidth=2.0, label="measured")
            below.axhline(0.0, color=MEASURED, linewidth=0.8)
            for k, (label, tau) in enumerate(zip(look, trial.taus, strict=True)):
                estimate = (tau[inside] * missing)[:, j]
                style = {key: value for key, value in look[label].items() if key != "marker"}
                x, y = envelope(t[inside], estimate)
                ax.plot(
                    x,
                    y,
                    marker=look[label]["marker"],
                    markevery=(k * len(x) // (8 * len(look)), max(1, len(x) // 8)),
                    markersize=3.5,
                    label=label,
                    **style,
                )
                below.plot(*envelope(t[inside], measured - estimate), **style)
            tau = trial.motion.tau[known, j]
            _frame(ax, tau, trial.taus[:, known, j])
            _frame(below, np.zeros_like(tau), tau - trial.taus[:, known, j])
            ax.set_ylabel(f"{AXES[j]} {SYMBOLS[j]} [{UNITS[j]}]")
            below.set_ylabel(f"residual [{UNITS[j]}]")
        axes[-1].set_xlabel("time [s]")
        legend_above(figure, axes[0], 3)
        return svg_text(figure)


def runs_to_draw(log: ComparedLog) -> list[int]:
    """Return the free runs with the least, the median and the greatest error of position, of those that all models finish."""
    if not log.paths.size or not log.motion.sway_measured:
        return []
    runs = np.isfinite(log.paths).any(axis=(1, 2, 3))
    if not runs.any():
        return []
    seen = np.isfinite(log.paths[runs]).all(axis=3)
    # The longest that any run gets, which is the same for most.
    length = seen.all(axis=0).sum(axis=1)
    whole = np.flatnonzero(length == length.max(initial=0))
    end = int(length.max(initial=0)) - 1
    if end < 1:
        return []
    measured = log.motion.eta[log.path_rows[whole, end], :2]
    error = np.hypot(*np.moveaxis(log.paths[runs][:, whole, end] - measured, 2, 0)).mean(axis=0)
    order = whole[np.argsort(error, kind="stable")]
    return list(dict.fromkeys(int(order[k]) for k in (0, len(order) // 2, len(order) - 1)))


def free_run_tracks(result: ComparisonResult, log: ComparedLog, runs: Sequence[int]) -> str:
    """Where the vessel went in some free runs, and where each model takes it from the same start; north up."""
    look = looks(result.models)
    with mpl.rc_context(STYLE):
        figure = margins(3.4, top=0.5 + 0.2 * ((len(look) + 3) // 3), between=(0.35, 0.12))
        panels = figure.subplots(1, len(runs), squeeze=False)[0]
        for ax, run in zip(panels, runs, strict=True):
            whole: Flags = np.asarray(np.isfinite(log.paths[:, run]).all(axis=2))
            rows = log.path_rows[run, whole.any(axis=0)]
            north, east = log.motion.eta[rows, :2].T
            ax.plot(east, north, color=MEASURED, linewidth=2.0, label="measured")
            ax.plot(east[:1], north[:1], "o", color=MEASURED, markersize=4)
            for label, places, known in zip(look, log.paths[:, run], whole, strict=True):
                if known.any():
                    style = {key: value for key, value in look[label].items() if key != "marker"}
                    ax.plot(*places[known, ::-1].T, label=label, **style)
                    ax.plot(*places[known][-1:, ::-1].T, look[label]["marker"], color=style["color"], markersize=4)
            ax.set_aspect("equal", adjustable="datalim")
            start, end = log.motion.t[rows[[0, -1]]]
            ax.set_title(f"{start:.0f} to {end:.0f} s")
            ax.set_xlabel("east [m]")
        panels[0].set_ylabel("north [m]")
        legend_above(figure, panels[0], 4)
        return svg_text(figure)


def _frame(ax: Any, measured: Floats, estimates: Floats) -> None:
    """Frame the measurement, shape (n,), and those of the estimates, shape (m, n), that are not wild."""
    error = np.mean((estimates - measured) ** 2, axis=1)
    tame = estimates[error <= WILD**2 * error.min()]
    values = np.concatenate([measured, tame.ravel()])
    if np.ptp(values) > 0.0:
        margin = 0.08 * np.ptp(values)
        ax.set_ylim(values.min() - margin, values.max() + margin)


def free_runs(result: ComparisonResult, scope: CommonErrors, reference: str) -> str:
    """Free-run errors against horizon, and below them their ratios over a reference's with 95 % intervals."""
    look = looks(result.models)
    horizons = np.array(scope.free_run.horizons_s)
    with mpl.rc_context(STYLE):
        figure = margins(5.0, top=0.3 + 0.2 * ((len(look) + 2) // 3), between=(0.3, 0.12))
        grid = figure.subplots(2, 2, sharex=True)
        for column, (key, name, unit, factor) in enumerate(
            (("position_m", "position", "m", 1.0), ("heading_rad", "heading", "deg", float(np.degrees(1.0))))
        ):
            upper, lower = grid[:, column]
            spans: list[float] = []
            others = [label for label in look if label != reference]
            for label in look:
                errors = np.array(scope.scores[label].free_run[key])
                if not np.nan_to_num(errors).any():
                    continue
                upper.plot(horizons, errors * factor, markersize=4, label=label, **look[label])
            for k, label in enumerate(others):
                ratios = over_reference(scope.pairs, label, reference).free_run[key]
                value, low, high = np.array([(one.value, one.low, one.high) for one in ratios]).T
                # Side by side, so that no interval hides another.
                at = horizons * 1.04 ** (k - (len(others) - 1) / 2)
                lower.plot(at, value, markersize=4, **look[label])
                lower.vlines(at, low, high, color=look[label]["color"], linewidth=1.6)
                spans += [float(one) for one in (*value, *low, *high) if np.isfinite(one) and one > 0.0]
            upper.set_ylabel(f"{name} error [{unit}]")
            upper.set_ylim(bottom=0)
            lower.axhline(1.0, color=MEASURED, linewidth=0.8)
            bottom, top = min((*spans, 0.8)), max((*spans, 1.25))
            lower.set_yscale("log")
            lower.set_ylim(bottom / 1.1, top * 1.1)
            _plain_ticks(lower.yaxis, bottom, top)
            lower.set_ylabel(f"{name}, over {reference}")
            lower.set_xlabel("horizon [s]")
        legend_above(figure, grid[0, 0], 3)
        return svg_text(figure)
