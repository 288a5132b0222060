"""Ticks of logarithmic axes: those that can be seen, and no others."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.ticker import LogLocator

from ferryid.report.log_ticks import LogTicks


@pytest.mark.parametrize("limits", [(0.3, 4.0), (1e-3, 1e4), (2.0, 2e2), (4.0, 0.3)])
@pytest.mark.parametrize("subs", [(1.0,), (1.0, 2.0, 5.0), None])
def test_only_ticks_within_the_limits_are_made(limits: tuple[float, float], subs: tuple[float, ...] | None) -> None:
    every = np.asarray(LogLocator(subs=subs, numticks=9).tick_values(*limits))
    inside = every[(every >= min(limits) * (1.0 - 1e-9)) & (every <= max(limits) * (1.0 + 1e-9))]
    assert len(inside) < len(every)
    np.testing.assert_array_equal(LogTicks(subs=subs, numticks=9).tick_values(*limits), inside)
