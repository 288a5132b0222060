"""Figures of a diagnosis: what was left over without and with the findings, in time and on what gives each away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from ferryid.diagnose import Course, Diagnosis, Finding, MeasuredCourse, Profiled
from ferryid.report.drawings import Drawings
from ferryid.report.figures import (
    BASE,
    MEASURED,
    NEW,
    SHADE,
    SYMBOLS,
    UNITS,
    canvas,
    legend_above,
    plain_log,
    styled,
    svg_text,
)
from ferryid.report.left_out import shade_left_out
from ferryid.report.structure import envelope
from ferryid.signals.track import LeftOut
from ferryid.types import AXES, Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PROFILES = 4
"""Profiles that are drawn, the most telling ones; all are in the JSON."""
OUTER = 0.01
OFTEN = 0.1
VISITS = 3
"""Visits to a bin, or pieces of them, that an interval of its mean takes."""
PIECE = 8
"""Windows of a piece of a visit: two of their lengths, as four overlap."""
BINS = 10
"""Bins of a profile, of equal width between all but the outermost values."""
LEVELS = (0.45, 2.2)
"""What an axis of mean squares over those of noise shows at least."""
WITHOUT, WITH, FOUND = "without the finding", "with it", "what it explains"
DEPTH = 1e-4
"""Least power that is drawn, over the greatest."""


def drawable(finding: Finding) -> bool:
    """Return whether a finding carries evidence that can be drawn."""
    return all(len(finding.evidence.get(name, ())) > 1 for name in ("t", "before"))


def compared(finding: Finding) -> bool:
    """Return whether it can be drawn what a finding adds, and not only what is left over."""
    return drawable(finding) and len(finding.evidence.get("after", ())) > 1


def spectral(finding: Finding) -> bool:
    """Return whether the evidence is a spectrum: that of what comes and goes by chance."""
    return all(len(finding.evidence.get(name, ())) > 1 for name in ("frequency", "before", "explained"))


def in_frequency(finding: Finding) -> str:
    """Draw the power spectrum of what is left over without and with a disturbance, and the one that it has itself."""
    evidence = finding.evidence
    rest = evidence["before"] - evidence["explained"]
    with styled():
        figure, (ax,) = canvas(1, 3.4)
        ax.plot(evidence["frequency"], evidence["before"], color=BASE, label=WITHOUT)
        ax.plot(evidence["frequency"], np.where(rest > 0.0, rest, np.nan), color=NEW, linewidth=1.0, label=WITH)
        ax.plot(evidence["frequency"], evidence["explained"], color=MEASURED, linewidth=1.5, label=FOUND)
        ax.set_xscale("log")
        ax.set_yscale("log")
        top = float(max(np.max(evidence["before"]), np.max(evidence["explained"])))
        ax.set_ylim(top * DEPTH, 3.0 * top)
        ax.set_xlabel(finding.labels.get("regressor", "frequency [Hz]"))
        ax.set_ylabel(finding.labels.get("residual", "left over"))
        plain_log(ax, x=True, y=True)
        legend_above(figure, ax, 3)
        return svg_text(figure)


def over_time(course: Course, measured: MeasuredCourse | None = None) -> str:
    """Draw the components of a flow over time with their 95 % bands, beside what a withheld sensor measured."""
    with styled():
        figure, axes = canvas(len(course.value), 1.9 * len(course.value) + 0.8)
        for ax, (name, value) in zip(axes, course.value.items(), strict=True):
            half = course.half(name)
            ax.fill_between(course.t, value - half, value + half, color=NEW, alpha=0.18, linewidth=0, label="95 % band")
            ax.plot(course.t, value, color=NEW, label="estimated")
            if measured is not None:
                ax.plot(course.t, measured.value[name], color=MEASURED, linewidth=1.0, label="measured, withheld")
            ax.axhline(0.0, color="#888888", linewidth=0.7)
            ax.set_ylabel(f"{name} [m/s]")
        axes[-1].set_xlabel("time [s]")
        legend_above(figure, axes[0], 3)
        return svg_text(figure)


def in_time(finding: Finding, left_out: Sequence[LeftOut] = ()) -> str:
    """Draw what was left over before and after a finding against time; when it acts is shaded, its ends marked."""
    evidence = finding.evidence
    t = evidence["t"]
    with styled():
        figure, (ax,) = canvas(1, 3.4, top=0.55)
        for k, (first, last) in enumerate(finding.intervals):
            ax.axvspan(first, last, color=SHADE, linewidth=0, label="acts" if k == 0 else None)
        shade_left_out(ax, left_out, t[0], t[-1])
        for k, (_, time) in enumerate(finding.ends):
            ax.axvline(time, color=MEASURED, linewidth=0.9, linestyle="--", label="its ends" if k == 0 else None)
        ax.plot(*envelope(t, evidence["before"]), color=BASE, label=WITHOUT if "after" in evidence else "left over")
        if "after" in evidence:
            ax.plot(*envelope(t, evidence["after"]), color=NEW, label=WITH)
        if "explained" in evidence:
            ax.plot(*envelope(t, evidence["explained"]), color=MEASURED, linewidth=1.5, label=FOUND)
        ax.set_xlabel("time [s]")
        ax.set_ylabel(finding.labels.get("residual", "left over"))
        legend_above(figure, ax, 3)
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
    with styled():
        figure, (ax,) = canvas(1, 3.2)
        for name, colour, label in (("before", BASE, WITHOUT), ("after", NEW, WITH)):
            ax.plot(x, seen[name], ".", color=colour, markersize=2.5, alpha=0.3, rasterized=True)
            _profile(ax, x, seen[name], colour, label)
        if "explained" in seen:
            found = binned(x, seen["explained"])
            ax.plot(found.place, found.mean, color=MEASURED, linewidth=1.5, label=FOUND, marker=".", markersize=3.0)
        ax.set_ylim(*_reach(x, seen))
        unit = "".join(residual.partition("[")[1:])
        ax.set_xlabel(f"{FOUND} {unit}" if own else finding.labels.get("regressor", "regressor"))
        ax.set_ylabel(residual)
        legend_above(figure, ax, 3)
        return svg_text(figure)


def left_over(diagnosis: Diagnosis) -> str:
    """Draw the force that was left over in the whole log, axis by axis, with onsets and offsets of what was found."""
    evidence = diagnosis.evidence
    with styled():
        figure, axes = canvas(3, 5.2)
        for j, ax in enumerate(axes):
            shade_left_out(ax, diagnosis.left_out, evidence["t"][0], evidence["t"][-1])
            for name, colour, label in (("before", BASE, "before"), ("after", NEW, "after")):
                if name in evidence and (name == "before" or diagnosis.findings):
                    ax.plot(*envelope(evidence["t"], evidence[name][:, j]), color=colour, label=label)
            for finding in diagnosis.findings:
                for _, time in finding.ends:
                    ax.axvline(time, color=MEASURED, linewidth=0.9, linestyle="--")
            ax.axhline(0.0, color="#888888", linewidth=0.7)
            ax.set_ylabel(f"{AXES[j]} {SYMBOLS[j]} [{UNITS[j]}]")
        axes[-1].set_xlabel("time [s]")
        if diagnosis.findings or diagnosis.left_out:
            legend_above(figure, axes[0], 3)
        return svg_text(figure)


def by_regime(diagnosis: Diagnosis, column: str, label: str) -> str:
    """Draw means of the force that was left over against heading or speed, with 95 % intervals, axis by axis."""
    evidence = diagnosis.evidence
    with styled():
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
            bins = binned(x, seen[name])
            half = np.nan_to_num(bins.half)
            if np.isfinite(bins.mean).any():
                ends.append(np.array([np.nanmin(bins.mean - half), np.nanmax(bins.mean + half)]))
    low, high = float(np.min(ends)), float(np.max(ends))
    room = 0.1 * max(high - low, 1e-9)
    return low - room, high + room


@dataclass(frozen=True)
class Bins:
    """Means in bins.

    Attributes
    ----------
    place
        Median of what is sorted by, shape (b,).
    mean, half
        Mean, and half its 95 % interval, shape (b,); NaN where there is too little to tell how certain the mean is.
    often
        True where the interval comes from separate visits, and not from the pieces of one or two; shape (b,).
    """

    place: Floats
    mean: Floats
    half: Floats
    often: NDArray[np.bool_]


def binned(x: Floats, y: Floats) -> Bins:
    """Return means of `y` in bins of `x` of equal width, and how certain they are.

    Neighbouring windows overlap and are no independent evidence: the interval comes from the scatter of the means of the
    separate visits to a bin. One or two visits are cut into pieces of `PIECE` windows, which know less of each other.
    """
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    if not x.size:
        nothing: Floats = np.empty(0)
        return Bins(nothing, nothing, nothing, np.empty(0, dtype=np.bool_))
    first, last = np.quantile(x, [OUTER, 1.0 - OUTER]).tolist()
    edges = np.unique(np.linspace(first, last, BINS + 1))
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))
    visit = np.cumsum(np.concatenate([[0], np.diff(index) != 0]))
    count = max(len(edges) - 1, 1)
    place, mean, half = np.full((3, count), np.nan)
    often = np.zeros(count, dtype=np.bool_)
    for k in np.unique(index):
        inside = index == k
        which = visit[inside]
        often[k] = len(np.unique(which)) >= VISITS
        parts = which if often[k] else np.cumsum(_piece_begins(which), dtype=np.int64)
        place[k] = np.median(x[inside])
        mean[k], half[k] = _mean_of(y[inside], parts)
    return Bins(place, mean, half, often)


def _piece_begins(visit: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return where a piece of at least `PIECE` rows begins, shape (m,); what is left at the end of a visit joins the last."""
    begins = np.zeros(len(visit), dtype=np.bool_)
    for one in np.unique(visit):
        rows = np.flatnonzero(visit == one)
        begins[rows[: max(len(rows) - PIECE + 1, 1) : PIECE]] = True
    return begins


def _mean_of(y: Floats, part: NDArray[np.int64]) -> tuple[float, float]:
    """Return a mean and half its 95 % interval from the scatter between parts; NaN where there are fewer than `VISITS`."""
    _, which = np.unique(part, return_inverse=True)
    counts = np.bincount(which)
    n = len(counts)
    if n < VISITS:
        return float("nan"), float("nan")
    means = np.bincount(which, weights=y) / counts
    mean, weight = float(y.mean()), counts / counts.sum()
    return mean, float(stdtrit(n - 1, 0.975) * np.sqrt(np.sum(weight**2 * (means - mean) ** 2) * n / (n - 1)))


def _profile(ax: Axes, x: Floats, y: Floats, colour: str, label: str) -> None:
    """Draw means with their intervals; lines join those of separate visits, hollow marks are those of one or two."""
    bins = binned(x, y)
    ax.errorbar(bins.place, bins.mean, bins.half, fmt="none", ecolor=colour, elinewidth=1.0, capsize=2)
    ax.plot(bins.place, np.where(bins.often, bins.mean, np.nan), "o-", color=colour, markersize=4.0, label=label)
    once = ~bins.often
    ax.plot(
        bins.place[once], bins.mean[once], "o", color=colour, label="_once", markerfacecolor="white", markersize=4.5
    )


def in_regime(diagnosis: Diagnosis, one: Profiled) -> str:
    """Draw mean squares over that of the noise by where the vessel was or what it did, axis by axis."""
    edges = np.append(one.low, one.high[-1])
    # Nothing is told, not even of noise, where there are too few windows.
    noise = 2.0 * np.where(np.isfinite(one.excess).all(axis=1), one.error, np.nan)
    with styled():
        figure, axes = canvas(3, 4.6)
        for j, ax in enumerate(axes):
            ax.stairs(1.0 + noise, edges, baseline=1.0 / (1.0 + noise), fill=True, color=SHADE, linewidth=0)
            _steps(ax, diagnosis, edges, {"before": one.excess[:, j] + 1.0, "after": one.left[:, j] + 1.0})
            # At least two numbers stand beside the axis.
            low, high = ax.get_ylim()
            ax.set_ylim(min(low, LEVELS[0]), max(high, LEVELS[1]))
            ax.set_ylabel(AXES[j])
        axes[-1].set_xlabel(f"{one.name} [{one.unit}]")
        if diagnosis.findings:
            legend_above(figure, axes[0], 2)
        return svg_text(figure)


def in_bands(diagnosis: Diagnosis) -> str:
    """Draw the power of the force that was left over in frequency bands, axis by axis."""
    assert diagnosis.located is not None
    bands = diagnosis.located.bands
    edges = np.array([bands[0].low_hz, *(band.high_hz for band in bands)])
    # A logarithmic axis has no place for zero.
    edges[0] = 0.5 * edges[1] if edges[0] == 0.0 else edges[0]
    with styled():
        figure, axes = canvas(3, 4.6)
        for j, ax in enumerate(axes):
            power = {name: np.sqrt([getattr(band, name)[j] for band in bands]) for name in ("before", "after")}
            _steps(ax, diagnosis, edges, power)
            ax.set_xscale("log")
            plain_log(ax, x=True, y=False)
            ax.set_ylabel(f"{AXES[j]} {SYMBOLS[j]} [{UNITS[j]}]")
        axes[-1].set_xlabel("frequency [Hz]")
        if diagnosis.findings:
            legend_above(figure, axes[0], 2)
        return svg_text(figure)


def _steps(ax: Axes, diagnosis: Diagnosis, edges: Floats, values: Mapping[str, Floats]) -> None:
    """Draw steps before and after on a logarithmic axis that may span less than a decade."""
    from matplotlib.ticker import FuncFormatter, NullLocator

    from ferryid.report.log_ticks import LogTicks

    for name, colour in (("before", BASE), ("after", NEW)):
        if name == "before" or diagnosis.findings:
            ax.stairs(values[name], edges, baseline=None, color=colour, linewidth=1.6, label=name)
    ax.set_yscale("log")
    ax.yaxis.set_major_locator(LogTicks(subs=(1.0, 2.0, 5.0), numticks=5))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_locator(NullLocator())


def figures_of(diagnosis: Diagnosis, prefix: str, drawings: Drawings) -> Sequence[tuple[str, str, str]]:
    """Return file, drawing and caption of every figure of the whole log that its evidence allows.

    Names of files begin with `prefix`; `drawings` are those that exist already.
    """
    evidence = diagnosis.evidence
    if not all(len(evidence.get(name, ())) > 1 for name in ("t", "before")):
        return ()
    both = " Orange: before; blue: with the findings." if diagnosis.findings else ""
    apart = " Shaded: what is left out of the log." if diagnosis.left_out else ""
    shown = [
        (
            f"{prefix}left-over",
            drawings.of(f"{prefix}left-over", left_over, diagnosis),
            f"Force that the model leaves unexplained, over the whole log.{both}{apart}",
        )
    ]
    located = diagnosis.located
    if located is None:
        for column, label in (("heading", "heading [deg]"), ("speed", "speed [m/s]")):
            if column in evidence:
                caption = f"Mean of the same force against {column}, with 95 % intervals.{both}"
                file = f"{prefix}by-{column}"
                shown.append((file, drawings.of(file, by_regime, diagnosis, column, label), caption))
        return shown
    for k, one in enumerate(located.profiles[:PROFILES], 1):
        caption = (
            f"Its mean square by {one.name}, over that of the noise that remains; shaded: what noise alone would give. Bins "
            f"with too few windows are left out.{both}"
        )
        file = f"{prefix}regime-{k}"
        shown.append((file, drawings.of(file, in_regime, diagnosis, one), caption))
    if located.bands:
        caption = f"Its root mean square in bands of frequency, by windows short enough to show them.{both}"
        shown.append((f"{prefix}bands", drawings.of(f"{prefix}bands", in_bands, diagnosis), caption))
    return shown
