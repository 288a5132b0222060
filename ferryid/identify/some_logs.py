"""Some of many logs, which say as well as all of them what is about all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ferryid.identify.thresholds import IDENTIFY


def some_logs(windows: Sequence[int]) -> list[int]:
    """Return places of evenly spaced logs that have windows enough, from the number of windows of each log, (L,).

    Those of all logs where there are no more than `IDENTIFY.sample_logs`, or these have fewer than `IDENTIFY.sample_windows`.
    """
    every = np.array(windows, dtype=np.int64)
    known = np.flatnonzero(every)
    wanted = int(np.ceil(len(known) * IDENTIFY.sample_windows / max(int(every.sum()), 1)))
    wanted = max(wanted, IDENTIFY.sample_logs)
    if wanted >= len(known):
        return list(range(len(every)))
    return [int(one) for one in known[np.linspace(0, len(known) - 1, wanted).round().astype(np.int64)]]
