"""What was found of a signal that was hidden, beside what its sensor had measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.judging.diagnosis import Withheld
from ferryid.diagnose.result import Estimate, Finding
from ferryid.effects import effects
from ferryid.effects.picture import Scene
from ferryid.vessel.profile import Floats

ABOARD = 0.5
"""Share of the heaviest load measured from which on it counts as aboard."""


def withheld(hidden: Mapping[str, Floats], scene: Scene, findings: Sequence[Finding]) -> tuple[Withheld, ...]:
    """Return every hidden signal beside the finding of the same name.

    Parameters
    ----------
    hidden
        By signal, two columns: north and east [m/s], of a payload mass [kg] and place [m], shape (n, 2).
    scene
        What was measured otherwise.
    findings
        Of the log.
    """
    return tuple(_beside(signal, values, scene, findings) for signal, values in hidden.items())


def _beside(signal: str, values: Floats, scene: Scene, findings: Sequence[Finding]) -> Withheld:
    # A signal has the name of the effect that it measures.
    finding = next((one for one in findings if one.effect == signal), None)
    t = scene.t[: len(values)]
    rows = scene.usable[: len(values)] & np.isfinite(values).all(axis=1)
    measured: dict[str, float] = {}
    if signal == "payload":
        rows, measured = aboard(t, values, rows)
        names, when = ("mass", "x"), "while it was aboard"
    else:
        names, when = ("north", "east"), "on average"
    measured = {**dict(zip(names, np.mean(values[rows], axis=0).tolist(), strict=True)), **measured}
    units = {one.name: one.unit for one in effects()[signal].parameters_of(scene.profile)}
    found: dict[str, Estimate] = {}
    if finding is not None:
        found = {name: one for name, one in finding.parameters.items() if name in measured}
    shown = ", ".join(_says(name, value, units) for name, value in measured.items())
    told = ", ".join(_says(name, one.value, units) for name, one in found.items())
    says = (
        f"The {signal} was hidden. Measured {when}: {shown}; {f'found: {told}' if told else 'nothing of it was found'}."
    )
    return Withheld(signal, found, measured, says)


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
    on = rows & (payload[:, 0] > ABOARD * np.max(payload[rows, 0], initial=0.0))
    if not on.any():
        return rows, {}
    first, last = float(t[on][0]), float(t[on][-1])
    ends = {} if first <= t[rows][0] else {"onset": first}
    return on, ends if last >= t[rows][-1] else {**ends, "offset": last}


def _says(name: str, value: float, units: Mapping[str, str]) -> str:
    return f"{name} {value:.4g} {units.get(name, 's')}"
