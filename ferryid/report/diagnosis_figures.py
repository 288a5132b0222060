"""Figures of a diagnosis: what was left over without and with the findings, in time and on what gives each away."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
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
    legend_above,
    svg_text,
)
from ferryid.report.structure import envelope

BINS = 10
"""Bins of a profile; each holds about the same number of windows."""
WITHOUT, WITH, FOUND = "without the finding", "with it", "what it adds"


def drawable(finding: Finding) -> bool:
    """Return whether a finding carries evidence that can be drawn."""
    return all(len(finding.evidence.get(name, ())) > 1 for name in ("t", "before", "after"))


def in_time(finding: Finding) -> str:
    """Draw what was left over before and after a finding against time; when it acts is shaded, its onset marked."""
    evidence = finding.evidence
    t = evidence["t"]
    with mpl.rc_context(STYLE):
        figure, (ax,) = canvas(1, 3.2)
        for first, last in finding.intervals:
            ax.axvspan(first, last, color=SHADE, linewidth=0)
        if finding.onset_s is not None:
            ax.axvline(finding.onset_s, color=MEASURED, linewidth=0.9, linestyle="--", label="onset")
        ax.plot(*envelope(t, evidence["before"]), color=BASE, label=WITHOUT)
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
    with mpl.rc_context(STYLE):
        figure, (ax,) = canvas(1, 3.2)
        for name, colour, label in (("before", BASE, WITHOUT), ("after", NEW, WITH)):
            ax.plot(x, evidence[name], ".", color=colour, markersize=2.0, alpha=0.25, rasterized=True)
            _profile(ax, x, evidence[name], colour, label)
        if "explained" in evidence:
            places, means, _ = binned(x, evidence["explained"])
            ax.plot(places, means, color=MEASURED, linewidth=1.5, label=FOUND)
        unit = "".join(residual.partition("[")[1:])
        ax.set_xlabel(f"{FOUND} {unit}" if own else finding.labels.get("regressor", "regressor"))
        ax.set_ylabel(residual)
        legend_above(figure, ax, 3)
        return svg_text(figure)


def left_over(diagnosis: Diagnosis) -> str:
    """Draw the force that was left over in the whole log, axis by axis, with the onsets of what was found."""
    evidence = diagnosis.evidence
    with mpl.rc_context(STYLE):
        figure, axes = canvas(3, 5.2)
        for j, ax in enumerate(axes):
            for name, colour, label in (("before", BASE, "before"), ("after", NEW, "after")):
                if name in evidence and (name == "before" or diagnosis.findings):
                    ax.plot(*envelope(evidence["t"], evidence[name][:, j]), color=colour, label=label)
            for finding in diagnosis.findings:
                if finding.onset_s is not None:
                    ax.axvline(finding.onset_s, color=MEASURED, linewidth=0.9, linestyle="--")
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


def binned(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Return middle, mean, and half the 95 % interval of the mean of `y` in bins of `x` that hold as many values each.

    Neighbouring windows overlap and are no independent evidence: the interval comes from the scatter of the means of the
    separate visits to a bin, and is NaN where there was but one.
    """
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    if not x.size:
        return np.empty(0), np.empty(0), np.empty(0)
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, BINS + 1)))
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
        if n > 1:
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


def figures_of(diagnosis: Diagnosis) -> Sequence[tuple[str, str, str]]:
    """Return name, drawing and caption of every figure of the whole log that its evidence allows."""
    evidence = diagnosis.evidence
    if not all(len(evidence.get(name, ())) > 1 for name in ("t", "before")):
        return ()
    both = " Orange: before; blue: with the findings." if diagnosis.findings else ""
    shown = [("left-over", left_over(diagnosis), f"Force that the model leaves unexplained, over the whole log.{both}")]
    for column, label in (("heading", "heading [deg]"), ("speed", "speed [m/s]")):
        if column in evidence:
            caption = f"Mean of the same force against {column}, with 95 % intervals from separate visits.{both}"
            shown.append((f"by-{column}", by_regime(diagnosis, column, label), caption))
    return shown
