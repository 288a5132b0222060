"""Parameters of an autopilot that a log carries: what each was set to, and when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from ferryid.ingest.log import Reader
from ferryid.types import Floats, Nanoseconds


@dataclass(frozen=True)
class Parameter:
    """Values of one parameter in the order in which the log has them.

    Attributes
    ----------
    time_ns
        When each was written [ns], on the clock of the topics, shape (n,).
    values
        The values, shape (n,), n at least one; NaN or infinite where the log has no number.
    """

    time_ns: Nanoseconds
    values: Floats


@runtime_checkable
class Configured(Protocol):
    """A reader of a log that carries parameters."""

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """All parameters by name; read from the file when asked for."""
        ...


def parameters_of(reader: Reader) -> Mapping[str, Parameter]:
    """Return the parameters of a log by name, none for a log without."""
    return reader.parameters if isinstance(reader, Configured) else {}


def gathered(names: Sequence[str], time_ns: Nanoseconds, values: Floats) -> dict[str, Parameter]:
    """Return parameters by name from rows of a log: names, times [ns] and values, shape (n,)."""
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        if name:
            rows.setdefault(name, []).append(row)
    return {name: Parameter(time_ns[chosen], values[chosen]) for name, chosen in rows.items()}


def together(parts: Sequence[Mapping[str, Parameter]]) -> dict[str, Parameter]:
    """Return the parameters of several parts of one recording, in the order of the parts."""
    found: dict[str, Parameter] = {}
    for part in parts:
        for name, one in part.items():
            known = found.get(name)
            found[name] = (
                one if known is None else Parameter(np.r_[known.time_ns, one.time_ns], np.r_[known.values, one.values])
            )
    return found
