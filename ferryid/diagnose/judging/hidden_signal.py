"""What was found of a signal that was hidden, beside what its sensor had measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ferryid.diagnose.data.course import MeasuredCourse
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.data.payload import aboard
from ferryid.diagnose.judging.diagnosis import Withheld, flow_off
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.hidden_gain import HiddenGain
from ferryid.effects import effects
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats


def compare_hidden_signals(
    hidden: Mapping[str, Floats], measurements: Measurements, findings: Sequence[Finding]
) -> tuple[Withheld, ...]:
    """Return every hidden signal beside the finding of the same name.

    Parameters
    ----------
    hidden
        By signal, two columns: north and east [m/s], of a payload mass [kg] and place [m], shape (n, 2).
    measurements
        What was measured otherwise.
    findings
        Of the log.
    """
    return tuple(_beside(signal, values, measurements, findings) for signal, values in hidden.items())


def with_gains(
    withheld: Sequence[Withheld], gains: Mapping[str, HiddenGain], *, told: bool = True
) -> tuple[Withheld, ...]:
    """Return hidden signals with how much of what each explains was found, by signal.

    It is of all logs together: not `told` in words of each, where it is told of all.
    """
    return tuple(_gained(one, gains[one.signal], told=told) if one.signal in gains else one for one in withheld)


def _gained(one: Withheld, gain: HiddenGain, *, told: bool) -> Withheld:
    return replace(one, gain=gain, says=f"{one.says} {gain.says(one.signal)}" if told else one.says)


def _beside(signal: str, values: Floats, measurements: Measurements, findings: Sequence[Finding]) -> Withheld:
    # A signal has the name of the effect that it measures.
    finding = next((one for one in findings if one.effect == signal), None)
    t = measurements.t[: len(values)]
    rows = measurements.usable[: len(values)] & np.isfinite(values).all(axis=1)
    measured: dict[str, float] = {}
    if signal == "payload":
        rows, measured = aboard(t, values, rows)
        names, when = ("mass", "x"), "while it was aboard"
    else:
        names, when = ("north", "east"), "on average"
    measured = {**dict(zip(names, np.mean(values[rows], axis=0).tolist(), strict=True)), **measured}
    units = {one.name: one.unit for one in effects()[signal].parameters_of(measurements.profile)}
    found: dict[str, Estimate] = {}
    if finding is not None:
        found = {name: one for name, one in finding.parameters.items() if name in measured}
    shown = ", ".join(_says(name, value, units) for name, value in measured.items())
    found_values = ", ".join(_says(name, one.value, units) for name, one in found.items())
    result = f"found: {found_values}" if found_values else "nothing of it was found"
    says = f"The {signal} was hidden. Measured {when}: {shown}; {result}{_compared(found, measured)}."
    if finding is None or finding.course is None:
        return Withheld(signal, found, measured, says)
    course = MeasuredCourse.beside(finding.course, t[rows], values[rows])
    says += (
        f" Over time, the estimated course and the measured one correlate by {course.correlation:.2f}, and the 95 % band holds "
        f"{100.0 * course.inside:.0f} % of what was measured."
    )
    return Withheld(signal, found, measured, says, course)


def _compared(found: Mapping[str, Estimate], measured: Mapping[str, float]) -> str:
    """Return how far a flow points away from the measured one, and its strength over it, as the end of a sentence."""
    off = flow_off({name: one.value for name, one in found.items()}, measured)
    if off is None:
        return ""
    inside = sum(found[name].low <= measured[name] <= found[name].high for name in ("north", "east"))
    held = {0: "neither", 1: "one", 2: "both"}[inside]
    return f", {off[0]:.0f} degrees off at {off[1]:.2f} of its strength; intervals hold {held} of the components"


def _says(name: str, value: float, units: Mapping[str, str]) -> str:
    return f"{name} {value:.4g} {units.get(name, 's')}"
