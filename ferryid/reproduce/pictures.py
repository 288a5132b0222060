"""Drawings that several studies need, in the manner of the thesis's figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ferryid.compare import MEASURES
from ferryid.report.drawing import Drawing, Line, Panel
from ferryid.reproduce.performance import Performance
from ferryid.signals.track import Motion
from ferryid.types import Floats

FORCES = ("surge X [N]", "sway Y [N]", "yaw N [N·m]")
UNITS = {"ISE": "ISE [m² s]", "IAE": "IAE [m s]", "IAEW": "IAEW [m s kJ]", "EC": "EC [kJ]"}
_FACTOR = {"ISE": 1.0, "IAE": 1.0, "IAEW": 1e-3, "EC": 1e-3}
_EVERY = 20
"""Integrals are drawn once a second."""


def model_fit(
    name: str, caption: str, motion: Motion, estimates: Mapping[str, Floats], span_s: tuple[float, float] | None = None
) -> Drawing:
    """Measured force and what models estimate, over time (figures 5.6, 5.10, 5.12)."""
    first, last = span_s or (float(motion.t[0]), float(motion.t[-1]))
    rows = (motion.t >= first) & (motion.t <= last)
    t = motion.t[rows]
    panels = tuple(
        Panel(
            label,
            (
                Line("measured", t, np.where(motion.valid, motion.tau[:, j], np.nan)[rows]),
                *(Line(who, t, np.where(motion.valid, force[:, j], np.nan)[rows]) for who, force in estimates.items()),
            ),
        )
        for j, label in enumerate(FORCES)
    )
    return Drawing(name, caption, "time [s]", panels)


def control_shares(name: str, caption: str, performance: Performance) -> Drawing:
    """Feedforward and feedback share of the desired force over time (figures 5.7, 5.8, 5.11)."""
    panels = tuple(
        Panel(
            label,
            (
                Line("feedback", performance.t, performance.feedback[:, j]),
                Line("feedforward", performance.t, performance.feedforward[:, j]),
            ),
        )
        for j, label in enumerate(FORCES)
    )
    return Drawing(name, caption, "time [s]", panels)


def integrals(name: str, caption: str, rounds: Mapping[str, Performance]) -> Drawing:
    """The four performance integrals as they grow during each round (figures 5.3, 5.5, 5.9)."""
    grown = {label: (one.t[::_EVERY], one.cumulative()) for label, one in rounds.items()}
    panels = tuple(
        Panel(
            UNITS[measure],
            tuple(Line(label, t, curves[measure][::_EVERY] * _FACTOR[measure]) for label, (t, curves) in grown.items()),
        )
        for measure in MEASURES
    )
    return Drawing(name, caption, "time [s]", panels, columns=2)


def against(
    name: str,
    caption: str,
    x_label: str,
    y_labels: Sequence[str],
    x: Sequence[float],
    curves: Mapping[str, Floats],
    *,
    logarithmic: bool = False,
    columns: int = 1,
) -> Drawing:
    """Median and range over the seeds against a setting.

    Parameters
    ----------
    x
        The setting, n values.
    curves
        By label: shape (seeds, n, panels).
    """
    at = np.asarray(x, dtype=float)
    panels = []
    for p, y_label in enumerate(y_labels):
        lines = []
        for label, values in curves.items():
            part = values[:, :, p]
            lines.append(
                Line(label, at, np.median(part, axis=0), np.min(part, axis=0), np.max(part, axis=0), marked=True)
            )
        panels.append(Panel(y_label, tuple(lines), logarithmic=logarithmic))
    return Drawing(name, caption, x_label, tuple(panels), columns=columns)
