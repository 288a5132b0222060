"""Figures of the diagnoses of real recordings, as SVG text."""

from __future__ import annotations

import io
from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ferryid.effects.force_model import Measurements
from ferryid.report.figures import STYLE
from tests.real.esso import Study, bearing
from tests.real.witnesses import Lag

Floats = NDArray[np.float64]

BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#888888"


def winds(studies: Sequence[Study]) -> str:
    """Draw bearing and strength as estimated against those that were measured and withheld, run by run."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 3.8), layout="constrained")
        left, right = figure.subplots(1, 2)
        for one, colour, label in zip(studies, (BLUE, ORANGE), ("random runs", "zigzags"), strict=False):
            found = one.found.winds
            left.plot(bearing(one.measured), bearing(found), "o", color=colour, label=label)
            right.plot(np.hypot(*one.measured.T), np.hypot(*found.T), "o", color=colour)
        for axes, ends, name in (
            (left, (0.0, 360.0), "wind goes towards [deg]"),
            (right, (0.0, 2.5), "strength [m/s]"),
        ):
            axes.plot(ends, ends, color=GREY, linewidth=0.8)
            axes.set(xlim=ends, ylim=ends, xlabel=f"{name}, measured", ylabel=f"{name}, estimated")
        left.legend()
        return _svg(figure)


def lag(found: Sequence[Lag], names: Sequence[str]) -> str:
    """Draw the correlation of velocity and slope of position against the shift between them."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 3.0), layout="constrained")
        axes = figure.add_subplot()
        for one, name in zip(found, names, strict=True):
            axes.plot(one.lags_s, 1.0 - one.correlations, label=name)
        axes.set(yscale="log", xlabel="velocity later than position [s]", ylabel="1 - correlation")
        axes.legend(fontsize=6, ncol=2)
        return _svg(figure)


def driven(measurements: Measurements) -> str:
    """Draw recorded force and surge velocity."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 3.6), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True)
        above.plot(measurements.t, measurements.parts.sum(axis=1)[:, 0], color=BLUE)
        below.plot(measurements.t, measurements.nu_raw[:, 0], color=ORANGE)
        above.set_ylabel("force ordered [N]")
        below.set(ylabel="surge velocity [m/s]", xlabel="time [s]")
        return _svg(figure)


def raw(t: Floats, columns: dict[str, Floats]) -> str:
    """Draw raw rows, every row marked."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 1.7 * len(columns)), layout="constrained")
        panels = figure.subplots(len(columns), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (name, values) in zip(panels, columns.items(), strict=True):
            axes.plot(t, values, ".-", color=BLUE, markersize=3, linewidth=0.6)
            axes.set_ylabel(name)
        panels[-1].set_xlabel("time [s]")
        return _svg(figure)


def _svg(figure: Figure) -> str:
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    return "\n".join(line.rstrip() for line in buffer.getvalue().splitlines()) + "\n"
