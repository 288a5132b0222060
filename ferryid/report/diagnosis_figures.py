"""Figures of a diagnosis: what was left over without and with the findings, in time and on what gives each away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from scipy.special import stdtrit

from ferryid.diagnose.result import AXES, Diagnosis, Finding
from ferryid.report.figures import (
    BASE,
    MEASURED,
    NEW,
    SHADE,
    STYLE,
    SYMBOLS,
    UNITS,
    Floats,
    canvas,
    grid_of,
    legend_above,
    plain_log,
    svg_text,
)
from ferryid.report.structure import envelope

PROFILES = 4
"""Profiles that are drawn, the most telling ones; all are in the JSON."""
OUTER = 0.01
OFTEN = 0.1
VISITS = 3
"""Visits to a bin that an interval of its mean takes."""
BINS = 10
"""Bins of a profile, of equal width between all but the outermost values."""
WITHOUT, WITH, FOUND = "without the finding", "with it", "what it adds"


def drawable(finding: Finding) -> bool:
    """Return whether a finding carries evidence that can be drawn."""
    return all(len(finding.evidence.get(name, ())) > 1 for name in ("t", "before"))


def compared(finding: Finding) -> bool:
    """Return whether it can be drawn what a finding adds, and not only what is left over."""
    return drawable(finding) and len(finding.evidence.get("after", ())) > 1


def in_time(finding: Finding) -> str:
    """Draw what was left over before and after a finding against time; when it acts is shaded, its ends marked."""
    evidence = finding.evidence
    t = evidence["t"]
    with mpl.rc_context(STYLE):
        figure, (ax,) = canvas(1, 3.2)
        for first, last in finding.intervals:
            ax.axvspan(first, last, color=SHADE, linewidth=0)
        for name, time in finding.ends:
            ax.axvline(time, color=MEASURED, linewidth=0.9, linestyle="--" if name == "onset" else ":", label=name)
        ax.plot(*envelope(t, evidence["before"]), color=BASE, label=WITHOUT if "after" in evidence else "left over")
        if "after" in evidence:
            ax.plot(*envelope(t, evidence["after"]), color=NEW, label=WITH)
        if "explained" in evidence:
            ax.plot(*envelope(t, evidence["explained"]), color=MEASURED, linewidth=1.5, label=FOUND)
        ax.set_xlabel("time [s]")
        ax.set_ylabel(finding.labels.get("residual", "left over"))
        legend_above(figure, ax, 4)
        return svg_text(figure)


def on_regressor(finding: Finding) -> str:
    """Draw what was left over against the quantity that gives the finding away, with means of bins and their intervals."""
    evidence = finding.evidence
    residual = finding.labels.get("residual", "left over")
    own = "regressor" not in evidence
    x = evidence.get("explained", evidence["t"]) if own else evidence["regressor"]
    # What has not begun, or is over, cannot give itself away.
    ends = dict(finding.ends)
    acts = (evidence["t"] >= ends.get("onset", -np.inf)) & (evidence["t"] < ends.get("offset", np.inf))
    x, seen = x[acts], {name: values[acts] for name, values in evidence.items()}
    with mpl.rc_context(STYLE):
        figure, (ax,) = canvas(1, 3.2)
        for name, colour, label in (("before", BASE, WITHOUT), ("after", NEW, WITH)):
            ax.plot(x, seen[name], ".", color=colour, markersize=2.0, alpha=0.25, rasterized=True)
            _profile(ax, x, seen[name], colour, label)
        if "explained" in seen:
            places, means, _ = binned(x, seen["explained"])
            ax.plot(places, means, color=MEASURED, linewidth=1.5, label=FOUND)
        ax.set_ylim(*_reach(x, seen))
        unit = "".join(residual.partition("[")[1:])
        ax.set_xlabel(f"{FOUND} {unit}" if own else finding.labels.get("regressor", "regressor"))
        ax.set_ylabel(residual)
        legend_above(figure, ax, 3)
        return svg_text(figure)


def left_over(diagnosis: Diagnosis) -> str:
    """Draw the force that was left over in the whole log, axis by axis, with onsets and offsets of what was found."""
    evidence = diagnosis.evidence
    with mpl.rc_context(STYLE):
        figure, axes = canvas(3, 5.2)
        for j, ax in enumerate(axes):
            for name, colour, label in (("before", BASE, "before"), ("after", NEW, "after")):
                if name in evidence and (name == "before" or diagnosis.findings):
                    ax.plot(*envelope(evidence["t"], evidence[name][:, j]), color=colour, label=label)
            for finding in diagnosis.findings:
                for name, time in finding.ends:
                    ax.axvline(time, color=MEASURED, linewidth=0.9, linestyle="--" if name == "onset" else ":")
            ax.axhline(0.0, color="#888888", linewidth=0.7)
            ax.set_ylabel(f"{AXES[j]} {SYMBOLS[j]} [{UNITS[j]}]")
        axes[-1].set_xlabel("time [s]")
        if diagnosis.findings:
            legend_above(figure, axes[0], 2)
        return svg_text(figure)


def by_regime(diagnosis: Diagnosis, column: str, label: str) -> str:
    """Draw means of the force that was left over against heading or speed, with 95 % intervals, axis by axis."""
    evidence = diagnosis.evidence
    with mpl.rc_context(STYLE):
        figure, axes = canvas(3, 5.2)
        for j, ax in enumerate(axes):
            for name, colour in (("before", BASE), ("after", NEW)):
                if name in evidence and (name == "before" or diagnosis.findings):
                    _profile(ax, evidence[column], evidence[name][:, j], colour, name)
            ax.axhline(0.0, color="#888888", linewidth=0.7)
            ax.set_ylabel(f"{AXES[j]} {SYMBOLS[j]} [{UNITS[j]}]")
        axes[-1].set_xlabel(label)
        if diagnosis.findings:
            legend_above(figure, axes[0], 2)
        return svg_text(figure)


def _reach(x: Floats, seen: Mapping[str, Floats]) -> tuple[float, float]:
    """Return limits within which means, their intervals and most points lie: single points are not what convinces."""
    ends = [np.quantile(seen[name], [OFTEN, 1.0 - OFTEN]) for name in ("before", "after")]
    for name in ("before", "after", "explained"):
        if name in seen:
            _, means, halves = binned(x, seen[name])
            known = np.nan_to_num(halves)
            ends.append(np.array([np.min(means - known), np.max(means + known)]))
    low, high = float(np.min(ends)), float(np.max(ends))
    room = 0.1 * max(high - low, 1e-9)
    return low - room, high + room


def binned(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Return middle, mean, and half the 95 % interval of the mean of `y` in bins of `x` of equal width.

    Neighbouring windows overlap and are no independent evidence: the interval comes from the scatter of the means of the
    separate visits to a bin, and is NaN where there were fewer than `VISITS`.
    """
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    if not x.size:
        return np.empty(0), np.empty(0), np.empty(0)
    first, last = np.quantile(x, [OUTER, 1.0 - OUTER]).tolist()
    edges = np.unique(np.linspace(first, last, BINS + 1))
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))
    visit = np.cumsum(np.concatenate([[0], np.diff(index) != 0]))
    rows: list[tuple[float, float, float]] = []
    for k in np.unique(index):
        inside = index == k
        _, which = np.unique(visit[inside], return_inverse=True)
        counts = np.bincount(which)
        means = np.bincount(which, weights=y[inside]) / counts
        mean, n = float(y[inside].mean()), len(means)
        half = float("nan")
        if n >= VISITS:
            weight = counts / counts.sum()
            half = float(stdtrit(n - 1, 0.975) * np.sqrt(np.sum(weight**2 * (means - mean) ** 2) * n / (n - 1)))
        rows.append((float(np.median(x[inside])), mean, half))
    places, means, halves = np.array(rows).T
    return places, means, halves


def _profile(ax: Axes, x: Floats, y: Floats, colour: str, label: str) -> None:
    places, means, halves = binned(x, y)
    known = np.isfinite(halves)
    ax.errorbar(places[known], means[known], halves[known], fmt="none", ecolor=colour, elinewidth=1.0, capsize=2)
    ax.plot(places, means, "o-", color=colour, markersize=3.5, label=label)


def in_regimes(diagnosis: Diagnosis) -> str:
    """Draw mean squares over that of the noise by where the vessel was and what it did: the most telling profiles."""
    assert diagnosis.located is not None
    chosen = diagnosis.located.profiles[:PROFILES]
    with mpl.rc_context(STYLE):
        figure, grid = grid_of(len(chosen), 3, 1.55 * len(chosen) + 0.6)
        for row, one in zip(grid, chosen, strict=True):
            edges = np.append(one.low, one.high[-1])
            for j, ax in enumerate(row):
                noise = np.append(one.error, one.error[-1])
                ax.fill_between(
                    edges, 1.0 / (1.0 + 2.0 * noise), 1.0 + 2.0 * noise, step="post", color=SHADE, linewidth=0
                )
                for values, colour, label in ((one.excess, BASE, "before"), (one.left, NEW, "after")):
                    if label == "before" or diagnosis.findings:
                        ax.stairs(values[:, j] + 1.0, edges, baseline=None, color=colour, linewidth=1.4, label=label)
                ax.set_yscale("log")
                ax.set_xlabel(f"{one.name} [{one.unit}]", labelpad=1.0)
                _few_labels(ax)
        for j, ax in enumerate(grid[0]):
            ax.set_title(AXES[j], fontsize=10)
        if diagnosis.findings:
            legend_above(figure, grid[0][0], 2)
        return svg_text(figure)


def in_bands(diagnosis: Diagnosis) -> str:
    """Draw the power of the force that was left over in frequency bands, axis by axis."""
    assert diagnosis.located is not None
    bands = diagnosis.located.bands
    edges = np.array([bands[0].low_hz, *(band.high_hz for band in bands)])
    # A logarithmic axis has no place for zero.
    edges[0] = 0.5 * edges[1] if edges[0] == 0.0 else edges[0]
    with mpl.rc_context(STYLE):
        figure, grid = grid_of(1, 3, 2.4)
        for j, ax in enumerate(grid[0]):
            for label, colour in (("before", BASE), ("after", NEW)):
                if label == "before" or diagnosis.findings:
                    power = np.sqrt([getattr(band, label)[j] for band in bands])
                    ax.stairs(power, edges, baseline=None, color=colour, linewidth=1.4, label=label)
            ax.set_xscale("log")
            ax.set_yscale("log")
            ax.set_title(f"{AXES[j]} [{UNITS[j]}]", fontsize=10)
            ax.set_xlabel("frequency [Hz]", labelpad=1.0)
            plain_log(ax, x=True, y=False)
            _few_labels(ax)
        if diagnosis.findings:
            legend_above(figure, grid[0][0], 2)
        return svg_text(figure)


def _few_labels(ax: Axes) -> None:
    """Label a logarithmic axis that may span less than a decade."""
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=5))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_locator(NullLocator())


def figures_of(diagnosis: Diagnosis) -> Sequence[tuple[str, str, str]]:
    """Return name, drawing and caption of every figure of the whole log that its evidence allows."""
    evidence = diagnosis.evidence
    if not all(len(evidence.get(name, ())) > 1 for name in ("t", "before")):
        return ()
    both = " Orange: before; blue: with the findings." if diagnosis.findings else ""
    shown = [("left-over", left_over(diagnosis), f"Force that the model leaves unexplained, over the whole log.{both}")]
    located = diagnosis.located
    if located is None:
        for column, label in (("heading", "heading [deg]"), ("speed", "speed [m/s]")):
            if column in evidence:
                caption = f"Mean of the same force against {column}, with 95 % intervals from separate visits.{both}"
                shown.append((f"by-{column}", by_regime(diagnosis, column, label), caption))
        return shown
    if located.profiles:
        caption = (
            "Its mean square over that of the noise that remains, where the vessel was and by what it did; shaded: what "
            f"noise alone would give.{both}"
        )
        shown.append(("regimes", in_regimes(diagnosis), caption))
    if located.bands:
        caption = f"Its root mean square in bands of frequency, by windows short enough to show them.{both}"
        shown.append(("bands", in_bands(diagnosis), caption))
    return shown
