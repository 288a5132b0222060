"""Checks of the sensors before any force is fitted: a module here with a ``CHECK`` is one.

All of them compare measurements with each other: positions with velocities, headings with yaw rates. What position, velocity
and heading have in common (an antenna that both were measured at, a heading with which a receiver resolved its own velocity, a
delay of them all) leaves no trace in them, and only forces can tell: see `ferryid.effects.lever_arm`,
`ferryid.effects.heading_bias` and `ferryid.effects.time_delay`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

import numpy as np

from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.checks.contradiction import opposed
from ferryid.diagnose.checks.pooling import Examined, find_in_turn, pool_check
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.effects.measurements import at_velocity
from ferryid.errors import FerryIdError
from ferryid.signals.complementary_filter import CUBIC_S, complementary_filter
from ferryid.signals.mirror import mirrored
from ferryid.signals.smooth import odd_rows, steady_cubic

SPOILS = frozenset(
    {"held_samples", "heading_wrap", "clock_offset", "heading_bias", "velocity_scale", "yaw_rate_scale", "lever_arm"}
)
"""Errors that spoil the velocity in products, which is made of position, heading and velocity.

Its slow part is that of the positions, so that a late clock is in one part of it and not in the other.
"""

__all__ = [
    "Check",
    "SensorFinding",
    "checks",
    "examine",
    "examine_together",
    "refilter_velocity",
    "sensor_errors",
]


@cache
def checks() -> tuple[Check, ...]:
    """Return every check, in the order in which they act."""
    modules = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
    found = [module.CHECK for module in modules if hasattr(module, "CHECK")]
    return tuple(sorted(found, key=lambda check: (check.place, check.id)))


def examine(measurements: Measurements) -> tuple[tuple[SensorFinding, ...], Measurements]:
    """Return the errors of the sensors, and the measurements corrected for them.

    Raises
    ------
    FerryIdError
        For frames of the wrong hand, which say nothing of their true axes, and for actuators that push the wrong way.
    """
    wrong, says = mirrored(measurements.eta, measurements.nu_raw, measurements.usable, 1.0 / measurements.step_s)
    if wrong:
        raise FerryIdError(
            f"{measurements.profile.path}: signals contradict each other, so no model can be identified from them. {says} "
            f"Fix: correct the frame of [signals.{wrong}] in the profile {measurements.profile.name}, or of what it is "
            "compared with"
        )
    findings, corrected = find_in_turn(checks(), measurements)
    measurements = _refiltered(findings, measurements, corrected)
    if says := opposed(measurements):
        raise FerryIdError(
            f"{measurements.profile.path}: force and motion contradict each other, so no model can be identified from them. "
            f"{says} Fix: correct the sign of the speeds or angles in the profile {measurements.profile.name}, or the "
            "clocks of the log"
        )
    return tuple(findings), measurements


def examine_together(
    logs: Sequence[Measurements], alone: Sequence[Sequence[SensorFinding]], copies: Sequence[bool]
) -> tuple[Examined, ...]:
    """Return the logs of one vessel with the errors of their sensors, those that several show pooled over all of them.

    Parameters
    ----------
    logs
        As they were measured.
    alone
        What `examine` found in each by itself.
    copies
        Which of them hold the motion of another, and have no say of their own.
    """
    examined = tuple(
        Examined({each.effect: each for each in found}, one, copy=copy)
        for one, found, copy in zip(logs, alone, copies, strict=True)
    )
    for number, check in enumerate(checks(), 1):
        pool_check(check, checks()[number:], examined)
    for one, log in zip(examined, logs, strict=True):
        one.measurements = _refiltered(one.findings, log, one.measurements)
    return examined


def _refiltered(findings: Sequence[SensorFinding], measured: Measurements, corrected: Measurements) -> Measurements:
    """Return what was corrected with a velocity in products and forces made of it, where these are spoilt."""
    errors = {finding.effect for finding in findings}
    if corrected is measured or not SPOILS & errors:
        return corrected
    filtered = refilter_velocity(corrected)
    # Angles on a grid were moved between its steps: forces of the recorded ones would undo that.
    same = np.array_equal(corrected.nu_raw, measured.nu_raw, equal_nan=True)
    return filtered if same or "azimuth_resolution" in errors else at_velocity(filtered)


def sensor_errors(measurements: Measurements) -> dict[str, Mapping[str, Estimate]]:
    """Return what each check estimates, however little it is: effect id to parameters, of those that have a size."""
    made = dict[str, Mapping[str, Estimate]]()
    for check in checks():
        if check.estimate is not None:
            made[check.id] = check.estimate(measurements)
        if (finding := check.find(measurements)) is not None:
            measurements = finding.correct(measurements)
    return made


def refilter_velocity(measurements: Measurements) -> Measurements:
    """Return measurements whose velocity that enters products is made anew, of what is corrected now."""
    rate = 1.0 / measurements.step_s
    eta = np.where(measurements.usable[:, None], measurements.eta, np.nan)
    return replace(
        measurements,
        nu=complementary_filter(
            steady_cubic(measurements.nu_raw, odd_rows(CUBIC_S, rate)), measurements.nu_raw, eta, rate
        ),
    )
