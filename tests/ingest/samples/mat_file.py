"""A MAT file of two structures of arrays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.io

# A variable that the cut takes away whole leaves no trace.
CUT_SHOWS = False


def write(folder: Path, messages: list[Any], ros: Any) -> Path:
    variables: dict[str, Any] = {}
    for topic in dict.fromkeys(message.topic for message in messages):
        rows = [message for message in messages if message.topic == topic]
        one: dict[str, Any] = {"time_ns": np.array([row.receive_ns for row in rows])}
        if rows[0].stamp_ns is not None:
            seconds, nanoseconds = zip(*(divmod(row.stamp_ns, 10**9) for row in rows), strict=True)
            one |= {"header_stamp_sec": np.array(seconds), "header_stamp_nanosec": np.array(nanoseconds)}
        for path in rows[0].values:
            inside = one
            *outer, last = path.split(".")
            for name in outer:
                inside = inside.setdefault(name, {})
            inside[last] = np.array([row.values[path] for row in rows])
        variables[topic[1:]] = one
    scipy.io.savemat(folder / "log.mat", variables, do_compression=True)
    return folder / "log.mat"
