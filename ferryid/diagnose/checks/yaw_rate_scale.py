"""Yaw-rate scale: the gyro's rate against the heading's, in the weak form ``∫ w' psi = -∫ w r``.

The factor is known to a per cent after ten minutes; what takes most of that is how well its error is known. Only turns tell of
the factor, and they are few, so that an error from the scatter between them is poor. What is left over is alike throughout,
but for a part that may grow with the rate: with that its whole length tells of the error.

Headings that are rounded are errors in the regressor: in slow turns they step now and then, and stand still between. Windows
are made as long as it takes for that to be small beside the turns, and what rounding can make of a window is no outlier:
without those that hold a step, standing headings would be left, as if the vessel had turned less.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import nan

import numpy as np
from scipy.special import ndtri

from ferryid.diagnose.checks.check import Check, Lasting, SensorFinding, mapped, rescaled
from ferryid.diagnose.checks.heading_rounding import rounding_steps
from ferryid.diagnose.checks.regression import Solution, independence, step
from ferryid.diagnose.checks.spans import LENGTH_S, STRIDE_S, Spans, least_off, spans
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

OVERLAP = LENGTH_S / STRIDE_S
"""Windows that have one stretch of time in common: only every so many are independent."""
NEUTRAL, SIZE = np.array([1.0, 0.0, 0.0]), np.array([2.0, 0.1, 2.0])
"""Factor, bias [rad/s] and delay [s] of a right gyro, and how large they may be."""


@dataclass(frozen=True)
class Rates:
    """The rate measured against that of the heading.

    Attributes
    ----------
    solution
        Factor, bias [rad/s] and delay [s] of the gyro.
    rival
        The factor by the regression on the rate.
    without_bias
        The factor of a gyro that has neither bias nor delay: the whole turn by the gyro over that by the heading.
    scatter
        Standard deviation of the factor from turn to turn; NaN with too few of them.
    middle_s
        Middle of the windows that were used [s], shape (J,).
    heading, gyro
        Rates by the heading and by the gyro [rad/s], shape (J,).
    """

    solution: Solution
    rival: float
    without_bias: float
    scatter: float
    middle_s: Floats
    heading: Floats
    gyro: Floats

    @property
    def doubt(self) -> str:
        """Why it may be no factor, as the end of a sentence; empty where nineteen in twenty turns are on one side of 1."""
        if not self.scatter * float(ndtri(CHECKS.turns_alike)) > abs(self.solution.values[0] - 1.0):
            return ""
        return f"it scatters by {self.scatter:.3f} from turn to turn, as no gyro's does: the heading may err in turns"

    @property
    def off(self) -> float:
        """How far the factor is from 1 at least; 0 where the two regressions do not agree on which side.

        So it is where a factor comes from a bias alone: in a steady turn any factor does, beside a bias that makes up for it.
        """
        one, other, whole = float(self.solution.values[0]) - 1.0, self.rival - 1.0, self.without_bias - 1.0
        if one * other <= 0.0 or whole * np.sign(one) < CHECKS.scale_without_bias * abs(one):
            return 0.0
        return min(abs(one), abs(other))


def compared(measurements: Measurements) -> Rates | None:
    """Compare the rates of heading and gyro; None where the measurements have too little of them, or there is no gyro.

    A bias and a delay of the gyro are solved for along with the factor. Noise of the heading makes the factor of a regression
    on the heading too small, noise of the rate that of the other regression too large: the truth lies between.
    """
    if "r" in measurements.slopes:
        return None
    windows = _windows(measurements)
    if windows is None:
        return None
    problem, heading, measured, rounded = windows
    rate, bend = problem.rate(heading), problem.curvature(heading)
    J = -np.column_stack([rate, np.ones_like(rate), -bend])
    first = _step(J, J, measured, problem)
    if first is None:
        return None
    left = np.abs(measured + J @ first.values)
    # An error of half a step to one side, then to the other, is the most that rounding makes: that times all of |w'|.
    kept = left <= CHECKS.outlier * max(float(np.median(left)), 1e-9) + rounded * float(problem.weight.max())
    problem, J, rate, measured = problem.only(kept), J[kept], rate[kept], measured[kept]
    solved = _step(J, J, measured, problem)
    Z = np.column_stack([-measured, J[:, 1:]])
    other = _step(Z, J, measured, problem)
    if solved is None or other is None:
        return None
    whole = float(rate @ measured) / max(float(rate @ rate), 1e-300)
    scatter = _scatter(rate, measured, problem)
    return Rates(solved, float(other.values[0]), whole, scatter, problem.middle_s, rate, measured)


def _windows(measurements: Measurements) -> tuple[Spans, Floats, Floats, Floats] | None:
    """Return windows, headings, and of every window mean yaw rate and step of the heading; None with too little of them."""
    steps = rounding_steps(measurements.psi)
    needed = np.column_stack([measurements.psi, measurements.nu_raw[:, 2], steps])
    length_s = LENGTH_S
    while True:
        problem, columns = spans(measurements, needed, length_s)
        if len(problem.starts) < 8:
            return None
        rate = problem.rate(columns[:, 0])
        if np.std(rate) < CHECKS.slow_radps:
            return None
        rounded = problem.mean(columns[:, 2])
        if np.mean((rounded / length_s) ** 2) <= CHECKS.rounding_share * np.var(rate):
            return problem, columns[:, 0], problem.mean(columns[:, 1]), rounded
        length_s *= 2.0


def corrected(measurements: Measurements, factor: float) -> Measurements:
    """Return measurements whose yaw rate is divided by a factor."""
    scale = np.array([1.0, 1.0, factor])
    return replace(measurements, nu_raw=measurements.nu_raw / scale, nu=measurements.nu / scale)


def find(measurements: Measurements) -> SensorFinding | None:
    """Return the factor of the yaw rate, measured over true."""
    rates = compared(measurements)
    least = least_off(measurements.step_s, CHECKS.least_rate_scale)
    if rates is None or rates.off < least or not rates.solution.certain(0, 1.0):
        return None
    factor = rates.solution.estimate(0, "-")
    return SensorFinding(
        "yaw_rate_scale",
        {"factor": factor},
        says_of({"factor": factor.value}),
        lambda measured: corrected(measured, factor.value),
        {"time_s": rates.middle_s, "heading_rate_radps": rates.heading, "yaw_rate_radps": rates.gyro},
        doubt=rates.doubt,
    )


def says_of(values: Mapping[str, float]) -> str:
    """Return the factor, as a sentence."""
    sign = " with its sign turned round," if values["factor"] < 0.0 else ""
    return f"The yaw rate measured is{sign} {abs(values['factor']):.3f} times that of the heading."


def _step(Z: Floats, J: Floats, measured: Floats, problem: Spans) -> Solution | None:
    """Return factor, bias and delay by regression with instruments, with errors for noise that grows with the rate."""
    independent, growth = independence(problem.place)
    solved = step(Z[:, None, :], J[:, None, :], measured[:, None], problem.place, SIZE, -NEUTRAL, independent)
    if solved is None:
        return None
    left = measured + J @ solved.values
    size = np.sqrt(_growing(left**2, J[:, 0] ** 2, OVERLAP))
    row = problem.place - problem.place[0]
    known, even, weighed = (np.zeros((int(row[-1]) + 1, k)) for k in (1, 1, 3))
    known[row], even[row, 0], weighed[row] = 1.0, left / size, Z * size[:, None]
    middle = np.zeros((3, 3))
    for lag in range(min(independent, len(known) - 1)):
        pairs = float(np.sum(known[lag:] * known[: len(known) - lag]))
        if pairs == 0.0:
            continue
        covariance = float(np.sum(even[lag:] * even[: len(even) - lag])) / pairs * (1.0 - lag / independent)
        product = weighed[lag:].T @ weighed[: len(weighed) - lag]
        middle += covariance * (product if lag == 0 else product + product.T)
    scaled = (Z * SIZE).T @ (J * SIZE) + float(np.mean(left**2)) * np.eye(3)
    inverse = SIZE[:, None] * np.linalg.inv(scaled) * SIZE
    errors = growth * np.sqrt(np.maximum(np.diag(inverse @ middle @ inverse.T), 0.0))
    freedom = max(solved.freedom, int(len(left) / OVERLAP) - len(NEUTRAL))
    errors[0] = np.hypot(errors[0], CHECKS.filtered_scale)
    return Solution(solved.values, errors, freedom)


def _scatter(rate: Floats, measured: Floats, problem: Spans) -> float:
    """Return how much the factor scatters from one block of time to the next, each by its share of the turns.

    NaN where turns are in too few blocks. Of a gyro it is the same in every turn. A compass that errs while a turn changes has
    one in zigzags and none in steady circles.
    """
    block = ((problem.middle_s - problem.middle_s[0]) // CHECKS.turn_s).astype(np.intp)
    turned = np.bincount(block, rate**2)
    # So many blocks of equal turns (Kish 1965).
    if turned.sum() ** 2 < CHECKS.fewest_turns * (turned @ turned):
        return nan
    factor = np.bincount(block, rate * measured)[turned > 0.0] / turned[turned > 0.0]
    share = turned[turned > 0.0] / turned.sum()
    return float(np.sqrt(share @ (factor - share @ factor) ** 2))


def _growing(power: Floats, by: Floats, overlap: float) -> Floats:
    """Return ``a + b by``, a and b not negative, that a power is on average, shape (m,); b shrunk by what chance makes of it.

    `overlap` is how many values stand for the same noise.
    """
    away = by - by.mean()
    spread = max(float(away @ away), 1e-300)
    slope = max(float(away @ power) / spread, 0.0)
    chance = 2.0 * overlap * power.mean() ** 2 / spread
    slope *= max(1.0 - chance / max(slope**2, 1e-300), 0.0)
    level = power.mean() - slope * by.mean()
    if level <= 0.0:
        level, slope = 0.0, power.mean() / max(float(by.mean()), 1e-300)
    return np.asarray(level + slope * by + 1e-3 * power.mean() + 1e-18)


def in_profile(profile: Profile, values: Mapping[str, float]) -> str:
    """Return the line that scales the rate, or turns its sign round."""
    signal = mapped(profile, "yaw_rate")
    if signal is not None and values["factor"] < 0.0:
        return f"sign = {-signal.sign:g} in [signals.yaw_rate]"
    return rescaled(profile, "yaw_rate", values["factor"])


def estimate(measurements: Measurements) -> dict[str, Estimate]:
    """Return the factor however near to 1; see `find`."""
    rates = compared(measurements)
    return {} if rates is None else {"factor": rates.solution.estimate(0, "-")}


CHECK = Check(
    "yaw_rate_scale",
    "Yaw rate against heading",
    find,
    20,
    estimate,
    Lasting(
        1.0,
        float(SIZE[0]),
        lambda _: CHECKS.least_rate_scale,
        says_of,
        lambda measured, values: corrected(measured, values["factor"]),
    ),
    in_profile,
)
