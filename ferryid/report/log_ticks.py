"""Ticks of logarithmic axes."""

from __future__ import annotations

import numpy as np
from matplotlib.ticker import LogLocator

EDGE = 1e-6
"""Share by which a tick may lie beyond the limits of a logarithmic axis: at them it is drawn."""


class LogTicks(LogLocator):
    """Ticks of a logarithmic axis within its limits: one beyond them is not drawn, but takes as long to make."""

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Return the places of the ticks."""
        values = np.asarray(super().tick_values(vmin, vmax), dtype=np.float64)
        low, high = min(vmin, vmax), max(vmin, vmax)
        inside: list[float] = values[(values >= low * (1.0 - EDGE)) & (values <= high * (1.0 + EDGE))].tolist()
        return inside
