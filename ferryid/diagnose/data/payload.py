"""When a load that was measured is aboard."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.data.thresholds import DATA
from ferryid.types import Floats


def aboard(t: Floats, payload: Floats, rows: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], dict[str, float]]:
    """Return the rows in which a load is aboard, all where there is none, and its ``onset`` and ``offset`` within the log [s].

    Parameters
    ----------
    t
        Times [s], shape (n,).
    payload
        Mass [kg] and place [m], shape (n, 2).
    rows
        Those in which it was measured, shape (n,).
    """
    on = rows & (payload[:, 0] > DATA.payload_aboard * np.max(payload[rows, 0], initial=0.0))
    if not on.any():
        return rows, {}
    first, last = float(t[on][0]), float(t[on][-1])
    ends = {} if first <= t[rows][0] else {"onset": first}
    return on, ends if last >= t[rows][-1] else {**ends, "offset": last}
