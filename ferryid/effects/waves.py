"""Waves: forces in a narrow band of frequencies, along, across and about the vessel, that nothing measured explains.

They may get up, die away or pass within a log, as wakes do, or grow over it.

A narrow-band Gauss-Markov process on each axis stands for the shaping filter ``K s / (s² + 2 lambda omega_0 s + omega_0²)`` of
Fossen (2021), section 10.2, driven by white noise.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import Any

import numpy as np

from ferryid.counts import plural
from ferryid.effects.effect import Effect, Parameter, Process, Processes, Values
from ferryid.effects.force_model import ForceModel
from ferryid.effects.thresholds import EFFECTS
from ferryid.effects.wording import amount
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

USUAL_HZ = 0.35
"""Usual frequency of the waves that a vessel of `USUAL_M` feels most; longer ones feel longer waves."""
USUAL_M = 5.0


def _length(profile: Profile) -> float:
    hull = profile.hull
    return hull.length_m if np.isfinite(hull.length_m) else 4.0 * sqrt(hull.inertia_z / hull.mass_kg)


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return frequency, strength on surge and sway, strength in yaw, and memory."""
    length = _length(profile)
    frequency = USUAL_HZ * sqrt(USUAL_M / length)
    force = 0.03 * profile.hull.mass_kg
    return (
        Parameter("peak_frequency", "Hz", frequency, EFFECTS.slowest_waves * frequency, 3.0),
        Parameter("force_std", "N", force, 0.0, 100.0 * force),
        Parameter("moment_std", "N·m", 0.2 * force * length, 0.0, 20.0 * force * length),
        Parameter("time_constant", "s", 2.0 / frequency, 0.1, 300.0),
    )


def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Change nothing: what waves push on average is not theirs alone."""
    return force_model


def unsteady(force_model: ForceModel) -> Processes:
    """Return a process on each axis."""
    loads = [np.tile(axis, (len(force_model.measurements.t), 1)) for axis in np.eye(3)]

    def processes(p: Floats) -> tuple[Process, ...]:
        frequency, force, moment, memory = (float(value) for value in p)
        return tuple(
            Process(load, std, memory, frequency) for load, std in zip(loads, (force, force, moment), strict=True)
        )

    return processes


def doubt(values: Values, profile: Profile) -> str:
    """Return that a force is coherent for less than a period, as no sea is, as the end of a sentence."""
    period, memory = 1.0 / values.get("peak_frequency", inf), values.get("time_constant", inf)
    if memory >= EFFECTS.least_coherence * period:
        return ""
    return (
        f"its time constant is {memory / period:.2f} of its period: a sea is coherent for longer than one, so that this may be "
        "any unsteady force"
    )


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence: the period is that of the force, which long waves have less of than their height."""
    forces = [
        f"{amount(values[name])} {unit}" for name, unit in (("force_std", "N"), ("moment_std", "N·m")) if name in values
    ]
    return (
        f"Waves pushed the vessel with {' and '.join(forces)} ({plural(len(forces), 'standard deviation')}), most at a "
        f"period of {1.0 / values['peak_frequency']:.1f} s, which nothing measured explains{_grown(values)}."
    )


def _grown(values: Values) -> str:
    growth = values.get("growth", 1.0)
    if growth == 1.0:
        return ""
    factor = f"{growth:.2g}" if growth > 1.0 else f"1/{1.0 / growth:.2g}"
    return f"; from the start of the log to its end they {'grew' if growth > 1.0 else 'fell'} to {factor} of their strength"


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's waves; how high they are for a force is the hull's affair, a hand's breadth here."""
    return {
        "environment": {
            "waves": {
                "significant_height_m": 0.15,
                "peak_period_s": 1.0 / values["peak_frequency"],
                "direction_deg": 225.0,
            }
        }
    }


EFFECT = Effect(
    "waves",
    "Waves",
    parameters_of,
    apply,
    says,
    scenario,
    in_part=True,
    onset=True,
    unsteady=unsteady,
    doubt=doubt,
    # A tank may have a wave maker.
    rare_in=("tank", "pond"),
    common_in=("sea",),
)
