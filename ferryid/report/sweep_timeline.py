"""Interactive figures of a sweep over its number of components."""

from __future__ import annotations

import numpy as np

from ferryid.identify import Selection
from ferryid.identify.sweeps import Sweep
from ferryid.report.timeline import PALETTE, Axis, Span, Strip, Timeline, Trace
from ferryid.types import AXES, Floats


def sweep_timeline(found: Sweep, choice: Selection) -> Timeline:
    """Return the errors of a sweep against its number of components: of every axis, and of every window where there are some.

    Parameters
    ----------
    found, choice
        The sweep, and what one way of cutting chose.
    """
    several = len(found.windows_s) > 1
    counts = np.arange(1.0, choice.over_base.shape[1] + 1.0)
    span = Span(choice.components - 0.5, choice.components + 0.5, "acts", f"choice: {choice.title}")
    strips = _by_window(found, choice) if several else (_by_axis(choice),)
    return Timeline(f"sweep of {found.what}", counts, strips, (span,), axis=Axis("components", "number"))


def _by_axis(choice: Selection) -> Strip:
    """Return the error of one window on every axis, with one standard error."""
    mse, error = choice.over_base[choice.window], choice.curves.standard_error[choice.window]
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.where(choice.curves.base > 0.0, error / choice.curves.base, np.nan)
    traces = tuple(
        Trace(axis, mse[:, j], f"c{j}", style="marked", low=(mse - error)[:, j], high=(mse + error)[:, j])
        for j, axis in enumerate(AXES)
    )
    return Strip("MSE over base model's", traces, "zero")


def _by_window(found: Sweep, choice: Selection) -> tuple[Strip, ...]:
    """Return the score, and the error on every axis, of all windows."""
    score, _ = choice.curves.normalised()

    def traces(values: Floats) -> tuple[Trace, ...]:
        return tuple(
            Trace(
                f"{window_s:.3g} s",
                values[k],
                f"c{k % PALETTE}",
                dash=(5.0, 3.0) if k >= PALETTE else (),
                style="marked",
            )
            for k, window_s in enumerate(found.windows_s)
        )

    ratios = (Strip(f"{axis}: MSE over base model's", traces(choice.over_base[:, :, j])) for j, axis in enumerate(AXES))
    return Strip("score", traces(score)), *ratios
