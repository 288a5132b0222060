"""Figures of a sweep: a heat map of windows and components, and the curve over components at one window."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, NullLocator

from ferryid.identify import Selection
from ferryid.identify.sweeps import Sweep
from ferryid.report.figures import BASE, MEASURED, NEW, STYLE, canvas, legend_above, svg_text
from ferryid.types import AXES

_COLOURS = (NEW, BASE, "#009e73")


def heat_map(found: Sweep, choice: Selection) -> str:
    """Return the score of every window and component count; what cannot be told from the least is outlined."""
    score, band = choice.curves.normalised()
    best = np.unravel_index(int(np.argmin(score)), score.shape)
    near = choice.curves.near()
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        figure, (ax,) = canvas(1, 5.6, top=0.2)
        excess = score.T - score.min()
        # The least score is nothing in excess: the scale begins at a hundredth of the band within which all count as equal.
        least = max(float(band[best]) / 10.0, 1e-4)
        # Room at the right for the numbers and the label of the colour bar.
        figure.subplots_adjust(right=0.9)
        image = ax.imshow(
            np.maximum(excess, least),
            aspect="auto",
            origin="lower",
            cmap="viridis_r",
            norm=LogNorm(least, max(float(excess.max()), 10.0 * least)),
        )
        for count, window in np.argwhere(near.T):
            ax.add_patch(Rectangle((window - 0.5, count - 0.5), 1, 1, fill=False, edgecolor=MEASURED, linewidth=0.7))
        ax.plot(choice.window, choice.components - 1, "*", color="#d55e00", markersize=15, markeredgecolor="white")
        ax.set_xticks(range(len(found.windows_s)), [f"{window_s:g}" for window_s in found.windows_s])
        ax.set_yticks(range(score.shape[1]), [str(count + 1) for count in range(score.shape[1])])
        ax.set_xlabel(f"{'window of the weak form' if found.weak else 'smoothing window of the training rows'} [s]")
        ax.set_ylabel("components")
        bar = figure.colorbar(image, ax=ax, pad=0.02)
        bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        bar.ax.yaxis.set_major_formatter("{x:g}")
        bar.ax.yaxis.set_minor_locator(NullLocator())
        bar.set_label("score above the least of the sweep")
        return svg_text(figure)


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
