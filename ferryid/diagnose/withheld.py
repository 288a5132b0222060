"""What was found of a signal that was hidden, beside what its sensor had measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ferryid.diagnose.result import Estimate, Finding, Withheld
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
        aboard = rows & (values[:, 0] > ABOARD * np.max(values[rows, 0], initial=0.0))
        measured = _ends(t[rows], t[aboard])
        rows, names, when = aboard if aboard.any() else rows, ("mass", "x"), "while it was aboard"
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


def _ends(t: Floats, aboard: Floats) -> dict[str, float]:
    """Return when a load came aboard and left [s], if it did so within the log."""
    made = {}
    if aboard.size and aboard[0] > t[0]:
        made["onset"] = float(aboard[0])
    if aboard.size and aboard[-1] < t[-1]:
        made["offset"] = float(aboard[-1])
    return made


def _says(name: str, value: float, units: Mapping[str, str]) -> str:
    return f"{name} {value:.4g} {units.get(name, 's')}"
