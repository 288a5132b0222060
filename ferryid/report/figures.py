"""Figures of the fit report, each a function of a result that returns one SVG drawing as text.

All are drawn 6 inches wide with 9-point text, so that they stay legible at the width of a phone.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from copy import copy
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ferryid.identify import ComponentCurve, Excitation, LogFit
from ferryid.models.prediction import FreeRun
from ferryid.report.left_out import shade_left_out
from ferryid.report.structure import autocorrelation, envelope, spectrum
from ferryid.signals.track import segments
from ferryid.types import AXES, Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Tick
    from matplotlib.figure import Figure

WIDTH = 6.0
MEASURED, BASE, NEW, SHADE = "#222222", "#d55e00", "#0072b2", "#e8eef4"
ROLES = {MEASURED: "measured", BASE: "base", NEW: "new"}
"""These colours by their names in the pages, whose interactive figures have a light and a dark one of each."""
UNITS = ("N", "N", "N·m")
REACH = 8.0
"""Where the axis of the coefficient figure ends; a coefficient this far from zero is beyond doubt anyway."""
SYMBOLS = ("X", "Y", "N")
STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    # Beyond, one power of ten for all ticks: longer numbers reach into the label of the axis.
    "axes.formatter.limits": (-4, 5),
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "ferryid",
    "font.family": "sans-serif",
}


def styled(more: Mapping[Any, Any] | None = None) -> AbstractContextManager[None]:
    """Return what draws in the style of all figures, and of `more`, while it lasts."""
    # A fifth of a second to import: a process whose figures another one draws does without.
    import matplotlib as mpl

    return mpl.rc_context({**STYLE, **(more or {})})


def margins(
    height: float, *, top: float = 0.15, left: float = 0.85, between: tuple[float, float] = (0.25, 0.15)
) -> Figure:
    """Return an empty figure with margins in inches; fixed ones, since measuring all text takes longer than drawing it."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height))
    figure.subplots_adjust(
        left=left / WIDTH,
        right=1.0 - 0.12 / WIDTH,
        bottom=0.5 / height,
        top=1.0 - top / height,
        wspace=between[0],
        hspace=between[1],
    )
    return figure


def canvas(rows: int, height: float, *, top: float = 0.35) -> tuple[Figure, list[Axes]]:
    """Return a figure of panels below one another that share their horizontal axis."""
    figure = margins(height, top=top)
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)
    for ax in axes[:, 0]:
        ax.yaxis.set_label_coords(-0.115, 0.5)
    return figure, list(axes[:, 0])


def legend_above(figure: Figure, ax: Axes, columns: int, title: str = "") -> None:
    """Put one legend for the whole figure along its upper edge."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="upper center",
        ncols=columns,
        title=title,
        borderaxespad=0.1,
        columnspacing=1.2,
        handlelength=1.6,
    )


def plain_log(ax: Axes, *, x: bool, y: bool) -> None:
    """Label logarithmic axes as 1e-3, 1e0: typeset exponents take longer than all else on the page."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    from ferryid.report.log_ticks import LogTicks

    for wanted, axis in ((x, ax.xaxis), (y, ax.yaxis)):
        if wanted:
            axis.set_major_locator(LogTicks())
            axis.set_minor_locator(LogTicks(subs=None))
            axis.set_major_formatter(
                FuncFormatter(lambda value, _: f"{value:.0e}".replace("e+0", "e").replace("e-0", "e-"))
            )
            axis.set_minor_formatter(NullFormatter())


def _copy_ticks(ticks: list[Tick], count: int) -> None:
    """Fill a list of ticks up with copies of its first: making each from its styles takes longer than drawing it.

    Matplotlib makes those that are missing when it draws. What its ticks have in common (transforms, markers, fonts) it only
    replaces, so that copies may share it.
    """
    while len(ticks) < count:
        first = ticks[0]
        tick = copy(first)
        for name in ("tick1line", "tick2line", "gridline", "label1", "label2"):
            setattr(tick, name, copy(getattr(first, name)))
        ticks.append(tick)


def svg_text(figure: Figure) -> str:
    """Return the drawing of a figure, the same for the same figure."""
    from matplotlib.ticker import NullLocator

    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            _copy_ticks(axis.majorTicks, len(axis.get_majorticklocs()))
            if not isinstance(axis.get_minor_locator(), NullLocator):
                _copy_ticks(axis.minorTicks, len(axis.get_minorticklocs()))
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    drawing = text.getvalue()
    return drawing[drawing.index("<svg") :]


def forces(log: LogFit, first_s: float | None = None, last_s: float | None = None) -> str:
    """Measured force against the estimates of both models over time; what validates and what is left out is shaded."""
    with styled():
        figure, axes = canvas(3, 5.2)
        t = log.motion.t
        inside = np.ones(len(t), dtype=bool) if first_s is None else (t >= first_s) & (t <= (last_s or t[-1]))
        rows = np.flatnonzero(inside)
        shown = np.where(log.motion.valid[:, None], 1.0, np.nan)
        for j, ax in enumerate(axes):
            shade(ax, t[rows], log.validation[rows], "validation")
            shade_left_out(ax, log.motion.left_out, t[rows[0]], t[rows[-1]])
            for values, colour, label in (
                (log.motion.tau, MEASURED, "measured"),
                (log.tau_base, BASE, "base model"),
                (log.tau_model, NEW, "new model"),
            ):
                x, y = envelope(t[rows], (values * shown)[rows, j])
                ax.plot(x, y, color=colour, label=label, alpha=0.9, linewidth=1.8 if colour == MEASURED else 1.1)
            _limits(ax, log, rows, j)
            ax.set_ylabel(f"{AXES[j]} {SYMBOLS[j]} [{UNITS[j]}]")
        axes[-1].set_xlabel("time [s]")
        legend_above(figure, axes[0], 5)
        return svg_text(figure)


def shade(ax: Axes, t: Floats, marked: NDArray[np.bool_], label: str | None = None) -> None:
    """Shade the stretches of time that are marked, with one entry in the legend where there is a label."""
    for stretch in segments(marked):
        ax.axvspan(t[stretch.start], t[stretch.stop - 1], color=SHADE, linewidth=0, label=label)
        label = None


def _limits(ax: Axes, log: LogFit, rows: NDArray[np.int64], j: int) -> None:
    """Keep a wild estimate from flattening the measurement: the frame follows measurement and new model."""
    good = rows[log.motion.valid[rows]]
    values = np.concatenate([log.motion.tau[good, j], log.tau_model[good, j]])
    values = values[np.isfinite(values)]
    if values.size and np.ptp(values) > 0:
        margin = 0.15 * np.ptp(values)
        ax.set_ylim(values.min() - margin, values.max() + margin)


def residual_spectrum(logs: Sequence[LogFit]) -> str:
    """Power spectral density of the force residual before and after, longest unbroken stretch of each log."""
    with styled():
        figure, axes = canvas(3, 5.2)
        for j, ax in enumerate(axes):
            for name, colour, label in (("tau_base", BASE, "base model"), ("tau_model", NEW, "new model")):
                for i, log in enumerate(logs):
                    frequency, density = spectrum(log, name, j)
                    if frequency.size > 1:
                        ax.loglog(
                            frequency[1:], density[1:], color=colour, alpha=0.8, label=label if i == 0 else "_nolegend_"
                        )
            ax.set_ylabel(f"{AXES[j]} [({UNITS[j]})²/Hz]")
            plain_log(ax, x=True, y=True)
        axes[-1].set_xlabel("frequency [Hz]")
        legend_above(figure, axes[0], 2)
        return svg_text(figure)


def residual_autocorrelation(logs: Sequence[LogFit]) -> str:
    """Autocorrelation of the residual that remains; white noise would stay inside the dashed band."""
    with styled():
        figure, axes = canvas(3, 4.6)
        for j, ax in enumerate(axes):
            for name, colour, label in (("tau_base", BASE, "base model"), ("tau_model", NEW, "new model")):
                for i, log in enumerate(logs):
                    lag, correlation, count = autocorrelation(log, name, j)
                    if lag.size:
                        ax.plot(lag, correlation, color=colour, alpha=0.8, label=label if i == 0 else "_nolegend_")
                        if i == 0:
                            band = 1.96 / np.sqrt(count)
                            ax.axhline(band, color="#888888", linestyle="--", linewidth=0.7)
                            ax.axhline(-band, color="#888888", linestyle="--", linewidth=0.7)
            ax.set_ylabel(AXES[j])
            ax.set_ylim(-1.05, 1.05)
        axes[-1].set_xlabel("lag [s]")
        legend_above(figure, axes[0], 2)
        return svg_text(figure)


def components(curve: ComponentCurve) -> str:
    """Normalised MSE against the number of components, training and validation."""
    from matplotlib.ticker import MaxNLocator

    with styled():
        figure, (ax,) = canvas(1, 3.2, top=0.55)
        for j, (axis, colour) in enumerate(zip(AXES, ("#0072b2", "#009e73", "#cc79a7"), strict=True)):
            ax.plot(curve.components, curve.validation[:, j], color=colour, marker="o", markersize=3, label=axis)
            ax.plot(curve.components, curve.training[:, j], color=colour, linestyle=":", linewidth=1.0)
        ax.axvline(curve.chosen, color="#888888", linewidth=0.8)
        ax.axhline(1.0, color=BASE, linewidth=0.8)
        shown = np.concatenate([curve.validation[max(0, curve.chosen - 2) :], curve.training])
        top = float(np.nanmax(np.append(shown.ravel(), 1.0)))
        ax.set_ylim(0, min(max(1.1, 1.1 * top), 3.0))
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        ax.set_xlabel(f"number of components (chosen: {curve.chosen})")
        ax.set_ylabel("MSE over the base model's [-]")
        legend_above(figure, ax, 3, "validation; training dotted")
        return svg_text(figure)


def coefficient_intervals(
    terms: Sequence[str], theta: Floats, low: Floats, high: Floats, undetermined: frozenset[str] = frozenset()
) -> str:
    """Coefficients with 95 % intervals, each in units of its own interval's half width, so that all fit one axis."""
    with styled():
        left = 0.4 + 0.085 * max(len(term) for term in terms)
        figure = margins(1.0 + 0.2 * len(terms), top=0.3, left=left, between=(0.08, 0.1))
        columns = figure.subplots(1, 3, sharey=True)
        place = np.arange(len(terms))[::-1]
        for j, ax in enumerate(columns):
            half = (high[:, j] - low[:, j]) / 2
            with np.errstate(divide="ignore", invalid="ignore"):
                significance = np.where(half > 0, theta[:, j] / half, 0.0)
            clear = np.abs(significance) > 1
            significance = np.clip(significance, -REACH, REACH)
            blind = np.array([term in undetermined for term in terms])
            for sign, marker in ((1.0, ">"), (-1.0, "<")):
                beyond = sign * significance >= REACH
                ax.plot(np.full(beyond.sum(), sign * 0.97 * REACH), place[beyond], marker, color="white", markersize=4)
            for mask, colour in ((clear & ~blind, NEW), (~clear & ~blind, "#aaaaaa"), (blind, "#f0c9a0")):
                ax.barh(place[mask], significance[mask], color=colour, height=0.6)
            ax.axvspan(-1, 1, color=SHADE, linewidth=0, zorder=0)
            ax.set_xlim(-REACH, REACH)
            ax.set_title(AXES[j], fontsize=9)
        columns[0].set_yticks(place, terms)
        columns[1].set_xlabel("coefficient over half the width of its 95 % interval")
        return svg_text(figure)


def excitation(result: Excitation, logs: Sequence[LogFit]) -> str:
    """Singular values of the standardised basis, and where the velocities were."""
    with styled():
        figure = margins(5.6, between=(0.38, 0.3))
        grid = figure.subplots(2, 2)
        values = result.singular_values
        values = values / values[0] if values.size and values[0] > 0 else values
        grid[0, 0].semilogy(np.arange(1, len(values) + 1), np.maximum(values, 1e-17), "o-", color=NEW, markersize=3)
        plain_log(grid[0, 0], x=False, y=True)
        grid[0, 0].set_xlabel("index")
        grid[0, 0].set_ylabel("singular value over largest [-]")
        pairs = ((0, 1, "u [m/s]", "v [m/s]"), (0, 2, "u [m/s]", "r [deg/s]"), (1, 2, "v [m/s]", "r [deg/s]"))
        factor = np.array([1.0, 1.0, np.degrees(1.0)])
        for (i, j, x_label, y_label), ax in zip(pairs, (grid[0, 1], grid[1, 0], grid[1, 1]), strict=True):
            for log in logs:
                rows = np.flatnonzero(log.training)
                rows = rows[:: max(1, len(rows) // 1500)]
                nu = log.motion.nu[rows] * factor
                ax.plot(nu[:, i], nu[:, j], ".", markersize=1.2, alpha=0.5, rasterized=True)
            ax.set_xlabel(x_label)
            ax.set_ylabel(y_label)
        return svg_text(figure)


def free_run_errors(base: FreeRun, new: FreeRun) -> str:
    """Free-run error against horizon, base and new model."""
    with styled():
        figure = margins(4.6, between=(0.3, 0.15))
        grid = figure.subplots(2, 2, sharex=True)
        for ax, name, label, factor in (
            (grid[0, 0], "position_m", "position [m]", 1.0),
            (grid[0, 1], "heading_rad", "heading [deg]", np.degrees(1.0)),
            (grid[1, 0], "speed_mps", "speed [m/s]", 1.0),
            (grid[1, 1], "yaw_rate_radps", "yaw rate [deg/s]", np.degrees(1.0)),
        ):
            for run, colour, who in ((base, BASE, "base model"), (new, NEW, "new model")):
                ax.plot(run.horizons_s, getattr(run, name) * factor, "o-", color=colour, markersize=3, label=who)
            ax.set_ylabel(label)
            ax.set_ylim(bottom=0)
        for ax in grid[1]:
            ax.set_xlabel("horizon [s]")
        grid[0, 0].legend()
        return svg_text(figure)


def free_run_example(base: FreeRun, new: FreeRun) -> str:
    """One free run: measured velocities and those that the models predict from the first instant on."""
    with styled():
        figure, axes = canvas(3, 4.8)
        factor = (1.0, 1.0, np.degrees(1.0))
        for j, (ax, label) in enumerate(zip(axes, ("u [m/s]", "v [m/s]", "r [deg/s]"), strict=True)):
            example = new.example or base.example
            start = example["t"][0]
            ax.plot(example["t"] - start, example["measured"][:, j] * factor[j], color=MEASURED, label="measured")
            for run, colour, who in ((base, BASE, "base model"), (new, NEW, "new model")):
                if run.example:
                    ax.plot(
                        run.example["t"] - run.example["t"][0],
                        run.example["predicted"][:, j] * factor[j],
                        color=colour,
                        label=who,
                    )
            ax.set_ylabel(label)
        axes[-1].set_xlabel("time since the start of the run [s]")
        legend_above(figure, axes[0], 3)
        return svg_text(figure)


def track(logs: Sequence[LogFit]) -> str:
    """Where the vessel went, north up."""
    with styled():
        figure, (ax,) = canvas(1, 4.0, top=0.15)
        for log in logs:
            eta = np.where(log.motion.valid[:, None], log.motion.eta, np.nan)
            step = max(1, len(eta) // 2000)
            ax.plot(eta[::step, 1], eta[::step, 0], linewidth=0.9, label=log.motion.log)
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel("east [m]")
        ax.set_ylabel("north [m]")
        if 1 < len(logs) <= 6:
            ax.legend(fontsize=7)
        return svg_text(figure)
