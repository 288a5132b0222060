"""A flow of one log over time, as it was estimated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ferryid.types import Floats

NORMAL = 1.96
"""Standard deviations to either side in a 95 % interval, as of `Estimate`."""


@dataclass(frozen=True)
class Course:
    """A flow of one log over time.

    Attributes
    ----------
    t
        Times [s], ascending, shape (m,); between them it is linear.
    value, std
        Components by their parameters' names, in their unit, and posterior standard deviations, shape (m,) each.
    mean, covariance
        Over the rows that are used, in the order of the names, shapes (q,) and (q, q).
    """

    t: Floats
    value: Mapping[str, Floats]
    std: Mapping[str, Floats]
    mean: Floats
    covariance: Floats

    def half(self, name: str) -> Floats:
        """Return half the width of the 95 % band of a component, shape (m,)."""
        return NORMAL * self.std[name]

    def to_json(self) -> dict[str, list[float]]:
        """Return times, and each component with the ends of its 95 % band."""
        columns = {"t": self.t}
        for name, value in self.value.items():
            half = self.half(name)
            columns |= {name: value, f"{name}_low": value - half, f"{name}_high": value + half}
        return {name: np.round(values, 4).tolist() for name, values in columns.items()}


@dataclass(frozen=True)
class MeasuredCourse:
    """What a sensor measured of a flow, beside its estimated course.

    Attributes
    ----------
    value
        Components by name, averaged about the times of the course, shape (m,) each; NaN where nothing was measured.
    correlation
        Between both over time, the mean of the components'; NaN where one of them is constant.
    inside
        Share of the measured rows that lie in the 95 % band.
    """

    value: Mapping[str, Floats]
    correlation: float
    inside: float

    @classmethod
    def beside(cls, course: Course, t: Floats, values: Floats) -> MeasuredCourse:
        """Compare a course with measured components, in its order, at times [s], shapes (n, q) and (n,)."""
        edges = np.concatenate([[-np.inf], (course.t[1:] + course.t[:-1]) / 2.0, [np.inf]])
        count = np.histogram(t, edges)[0].astype(np.float64)
        count[count == 0.0] = np.nan
        averaged, correlations, inside = {}, [], []
        for name, measured in zip(course.value, values.T, strict=True):
            averaged[name] = np.histogram(t, edges, weights=measured)[0] / count
            estimated = np.interp(t, course.t, course.value[name])
            inside.append(np.abs(estimated - measured) < np.interp(t, course.t, course.half(name)))
            constant = min(float(np.ptp(estimated)), float(np.ptp(measured))) == 0.0
            correlations.append(np.nan if constant else float(np.corrcoef(estimated, measured)[0, 1]))
        return cls(averaged, float(np.mean(correlations)), float(np.mean(inside)))
