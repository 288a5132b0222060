"""Figures of a sweep: a heat map of windows and components, and the curve over components at one window."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.colors import LogNorm, to_hex
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, NullLocator

from ferryid.counts import counted
from ferryid.identify import Selection
from ferryid.identify.sweeps import Sweep
from ferryid.report.figures import BASE, MEASURED, NEW, STYLE, canvas, legend_above, svg_text
from ferryid.report.heat_map import HeatCell, HeatMap
from ferryid.types import AXES, Floats

_COLOURS = (NEW, BASE, "#009e73")
_COLOUR_MAP, _SCALE = "viridis_r", "score above the least of the sweep"


def heat_map(found: Sweep, choice: Selection) -> str:
    """Return the score of every window and component count; what cannot be told from the least is outlined."""
    score, _ = choice.curves.normalised()
    near = choice.curves.near()
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        figure, (ax,) = canvas(1, 5.6, top=0.2)
        excess, least, norm = _shades(choice)
        # Room at the right for the numbers and the label of the colour bar.
        figure.subplots_adjust(right=0.9)
        image = ax.imshow(
            np.maximum(excess.T, least),
            aspect="auto",
            origin="lower",
            cmap=_COLOUR_MAP,
            norm=norm,
        )
        for count, window in np.argwhere(near.T):
            ax.add_patch(Rectangle((window - 0.5, count - 0.5), 1, 1, fill=False, edgecolor=MEASURED, linewidth=0.7))
        ax.plot(choice.window, choice.components - 1, "*", color="#d55e00", markersize=15, markeredgecolor="white")
        ax.set_xticks(range(len(found.windows_s)), [f"{window_s:g}" for window_s in found.windows_s])
        ax.set_yticks(range(score.shape[1]), [str(count + 1) for count in range(score.shape[1])])
        ax.set_xlabel(_across(found))
        ax.set_ylabel("components")
        bar = figure.colorbar(image, ax=ax, pad=0.02)
        bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        bar.ax.yaxis.set_major_formatter("{x:g}")
        bar.ax.yaxis.set_minor_locator(NullLocator())
        bar.set_label(_SCALE)
        return svg_text(figure)


def heat_cells(found: Sweep, choice: Selection) -> HeatMap:
    """Return the same for the page's script: each cell has score, band and the errors of all axes."""
    score, band = choice.curves.normalised()
    near = choice.curves.near()
    excess, least, norm = _shades(choice)
    colours = mpl.colormaps[_COLOUR_MAP]

    def cell(window: int, count: int) -> HeatCell:
        chosen = (window, count) == (choice.window, choice.components - 1)
        ratios = zip(AXES, choice.over_base[window, count], strict=True)
        told = ", ".join(f"{axis} {value:.4g}" for axis, value in ratios if np.isfinite(value))
        marks = ", within one standard error of the least" if near[window, count] else ""
        says = (
            f"{'Choice: ' if chosen else ''}{counted(count + 1, 'component')} at {found.windows_s[window]:.3g} s: score "
            f"{score[window, count]:.4f} ± {band[window, count]:.4f}{marks}. MSE over base model's: {told}."
        )
        fill = to_hex(colours(float(norm(max(float(excess[window, count]), least)))))
        return HeatCell(fill, says[:1].upper() + says[1:], outlined=bool(near[window, count]), chosen=chosen)

    counts = range(score.shape[1])[::-1]
    return HeatMap(
        f"score of every combination, {choice.title} chosen",
        _across(found),
        "components",
        [f"{window_s:g}" for window_s in found.windows_s],
        [str(count + 1) for count in counts],
        [[cell(window, count) for window in range(len(found.windows_s))] for count in counts],
        [to_hex(colours(share)) for share in np.linspace(0.0, 1.0, 9)],
        [f"{value:.2g}" for value in np.geomspace(least, float(norm.vmax or 1.0), 3)],
        _SCALE,
    )


def _shades(choice: Selection) -> tuple[Floats, float, LogNorm]:
    """Return how far each score is above the least, shape (windows, components), where the scale begins, and the scale."""
    score, band = choice.curves.normalised()
    best = np.unravel_index(int(np.argmin(score)), score.shape)
    excess = score - score.min()
    # The least score is nothing in excess: the scale begins at a hundredth of the band within which all count as equal.
    least = max(float(band[best]) / 10.0, 1e-4)
    return excess, least, LogNorm(least, max(float(excess.max()), 10.0 * least))


def _across(found: Sweep) -> str:
    return f"{'window of the weak form' if found.weak else 'smoothing window of the training rows'} [s]"


def curves(found: Sweep, choice: Selection) -> str:
    """Return MSE over the base model's against the number of components, per axis, with one standard error."""
    with mpl.rc_context(STYLE):
        figure, (ax,) = canvas(1, 3.4)
        mse, error = choice.over_base[choice.window], choice.curves.standard_error[choice.window]
        counts = np.arange(1, len(mse) + 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.where(choice.curves.base > 0.0, error / choice.curves.base, np.nan)
        for j, (axis, colour) in enumerate(zip(AXES, _COLOURS, strict=True)):
            ax.plot(counts, mse[:, j], color=colour, label=axis, marker="o", markersize=3)
            ax.fill_between(counts, mse[:, j] - error[:, j], mse[:, j] + error[:, j], color=colour, alpha=0.15)
        ax.axvline(choice.components, color=MEASURED, linewidth=1.0, linestyle="--", label="choice")
        ax.set_xticks(counts)
        ax.set_ylim(bottom=0.0)
        ax.set_xlabel("components")
        ax.set_ylabel("MSE over base model's")
        legend_above(figure, ax, 4)
        return svg_text(figure)
