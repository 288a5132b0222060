"""Figures of the fit report, each a function of a result that returns one SVG drawing as text.

All are drawn 6 inches wide with 9-point text, so that they stay legible at the width of a phone.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ferryid.identify.result import AXES, ComponentCurve, Excitation, FreeRun, LogFit
from ferryid.report.structure import autocorrelation, envelope, spectrum

Floats = NDArray[np.float64]

MEASURED, BASE, NEW, SHADE = "#222222", "#d55e00", "#0072b2", "#e8eef4"
UNITS = ("N", "N", "N·m")
SYMBOLS = ("X", "Y", "N")
STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "ferryid",
    "font.family": "sans-serif",
}


def _canvas(rows: int, height: float, *, share_x: bool = True) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(6.0, height), layout="constrained")
    axes = figure.subplots(rows, 1, sharex=share_x, squeeze=False)
    return figure, list(axes[:, 0])


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    drawing = text.getvalue()
    return drawing[drawing.index("<svg") :]


def forces(log: LogFit, first_s: float | None = None, last_s: float | None = None) -> str:
    """Measured force against the estimates of base and new model over time; validation stretches are shaded."""
    with mpl.rc_context(STYLE):
        figure, axes = _canvas(3, 5.2)
        t = log.motion.t
        inside = np.ones(len(t), dtype=bool) if first_s is None else (t >= first_s) & (t <= (last_s or t[-1]))
        rows = np.flatnonzero(inside)
        shown = np.where(log.motion.valid[:, None], 1.0, np.nan)
        for j, ax in enumerate(axes):
            _shade(ax, t[rows], log.validation[rows])
            for values, colour, label in (
                (log.motion.tau, MEASURED, "measured"),
                (log.tau_base, BASE, "base model"),
                (log.tau_model, NEW, "new model"),
            ):
                x, y = envelope(t[rows], (values * shown)[rows, j])
                ax.plot(x, y, color=colour, label=label, alpha=0.9)
            _limits(ax, log, rows, j)
            ax.set_ylabel(f"{AXES[j]} {SYMBOLS[j]} [{UNITS[j]}]")
        axes[-1].set_xlabel("time [s]")
        axes[0].legend(loc="upper center", bbox_to_anchor=(0.5, 1.28), ncols=3)
        return _svg(figure)


def _shade(ax: Axes, t: Floats, marked: NDArray[np.bool_]) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        ax.axvspan(t[first], t[last - 1], color=SHADE, linewidth=0)


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
    with mpl.rc_context(STYLE):
        figure, axes = _canvas(3, 5.2)
        for j, ax in enumerate(axes):
            for name, colour, label in (("tau_base", BASE, "base model"), ("tau_model", NEW, "new model")):
                for i, log in enumerate(logs):
                    frequency, density = spectrum(log, name, j)
                    if frequency.size > 1:
                        ax.loglog(
                            frequency[1:], density[1:], color=colour, alpha=0.8, label=label if i == 0 else "_nolegend_"
                        )
            ax.set_ylabel(f"{AXES[j]} [({UNITS[j]})²/Hz]")
        axes[-1].set_xlabel("frequency [Hz]")
        axes[0].legend(loc="upper center", bbox_to_anchor=(0.5, 1.28), ncols=2)
        return _svg(figure)


def residual_autocorrelation(logs: Sequence[LogFit]) -> str:
    """Autocorrelation of the residual that remains; white noise would stay inside the dashed band."""
    with mpl.rc_context(STYLE):
        figure, axes = _canvas(3, 4.6)
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
        axes[0].legend(loc="upper center", bbox_to_anchor=(0.5, 1.32), ncols=2)
        return _svg(figure)


def components(curve: ComponentCurve) -> str:
    """Normalised MSE against the number of components, training and validation."""
    with mpl.rc_context(STYLE):
        figure, (ax,) = _canvas(1, 3.2)
        for j, (axis, colour) in enumerate(zip(AXES, ("#0072b2", "#009e73", "#cc79a7"), strict=True)):
            ax.plot(curve.components, curve.validation[:, j], color=colour, marker="o", markersize=3, label=axis)
            ax.plot(curve.components, curve.training[:, j], color=colour, linestyle=":", linewidth=1.0)
        ax.axvline(curve.chosen, color="#888888", linewidth=0.8)
        ax.axhline(1.0, color=BASE, linewidth=0.8)
        top = float(np.nanmax(np.concatenate([curve.validation[max(0, curve.chosen - 2) :].ravel(), [1.0]])))
        ax.set_ylim(0, min(max(1.1, 1.1 * top), 3.0))
        ax.set_xlabel(f"number of components (chosen: {curve.chosen})")
        ax.set_ylabel("MSE over the base model's [-]")
        ax.legend(title="validation; training dotted", ncols=3, loc="upper center", bbox_to_anchor=(0.5, 1.3))
        return _svg(figure)


def coefficient_intervals(terms: Sequence[str], theta: Floats, low: Floats, high: Floats) -> str:
    """Coefficients with 95 % intervals, each in units of its own interval's half width, so that all fit one axis."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 1.2 + 0.2 * len(terms)), layout="constrained")
        columns = figure.subplots(1, 3, sharey=True)
        place = np.arange(len(terms))[::-1]
        for j, ax in enumerate(columns):
            half = (high[:, j] - low[:, j]) / 2
            with np.errstate(divide="ignore", invalid="ignore"):
                significance = np.where(half > 0, theta[:, j] / half, 0.0)
            clear = np.abs(significance) > 1
            for mask, colour in ((clear, NEW), (~clear, "#aaaaaa")):
                ax.barh(place[mask], significance[mask], color=colour, height=0.6)
            ax.axvspan(-1, 1, color=SHADE, linewidth=0, zorder=0)
            ax.set_xscale("symlog", linthresh=2)
            ax.set_title(AXES[j], fontsize=9)
        columns[0].set_yticks(place, terms)
        columns[1].set_xlabel("coefficient over half the width of its 95 % interval; inside the shade it may be zero")
        return _svg(figure)


def excitation(result: Excitation, logs: Sequence[LogFit]) -> str:
    """Singular values of the standardised basis, and where the velocities were."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 5.4), layout="constrained")
        grid = figure.subplots(2, 2)
        values = result.singular_values
        values = values / values[0] if values.size and values[0] > 0 else values
        grid[0, 0].semilogy(np.arange(1, len(values) + 1), np.maximum(values, 1e-17), "o-", color=NEW, markersize=3)
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
        return _svg(figure)


def free_run_errors(base: FreeRun, new: FreeRun) -> str:
    """Free-run error against horizon, base and new model."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 4.6), layout="constrained")
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
        return _svg(figure)


def free_run_example(base: FreeRun, new: FreeRun) -> str:
    """One free run: measured velocities and those that the models predict from the first instant on."""
    with mpl.rc_context(STYLE):
        figure, axes = _canvas(3, 4.8)
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
        axes[0].legend(loc="upper center", bbox_to_anchor=(0.5, 1.32), ncols=3)
        return _svg(figure)


def track(logs: Sequence[LogFit]) -> str:
    """Where the vessel went, north up."""
    with mpl.rc_context(STYLE):
        figure, (ax,) = _canvas(1, 4.0)
        for log in logs:
            eta = np.where(log.motion.valid[:, None], log.motion.eta, np.nan)
            step = max(1, len(eta) // 2000)
            ax.plot(eta[::step, 1], eta[::step, 0], linewidth=0.9, label=log.motion.log)
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel("east [m]")
        ax.set_ylabel("north [m]")
        if 1 < len(logs) <= 6:
            ax.legend(fontsize=7)
        return _svg(figure)
