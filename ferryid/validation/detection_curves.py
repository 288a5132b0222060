"""Detection curves: how large an effect has to be to be named 19 times in 20, and by how much a tool is behind an oracle.

The share of logs in which an effect of size s is named is taken as logistic in log s::

    logit(share) = logit(0.95) + slope (log s - log reliable)

with two parameters: the size that is named reliably, which has a flat prior, and the slope. A handful of runs
at each of a few sizes is often separated perfectly (none named below a size, all above), where the likelihood grows without
end with the slope. The slope therefore has a gamma prior of shape 2 and scale 3, which keeps it from both nothing and infinity
(Chung et al. 2013). A log-likelihood ratio grows with the square of an effect's size: what is named when it exceeds a
threshold of 4 to 40 nats goes from 1 in 20 to 19 in 20 within a factor of 1.5 to 3 of size, which is a slope of 5 to 14; the
prior's middle 90 % reach from 1 to 14.

References
----------
Chung, Rabe-Hesketh, Dorie, Gelman and Liu (2013), A nondegenerate penalized likelihood estimator for variance parameters in
multilevel models, Psychometrika 78. Venzon and Moolgavkar (1988), A method for computing profile-likelihood-based confidence
intervals, Applied Statistics 37.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, inf, isfinite, isnan, log
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit
from scipy.stats import chi2, norm

from ferryid.errors import FerryIdError
from ferryid.json_record import Record
from ferryid.types import Flags, Floats

RELIABLE = 0.95
"""Share that is named reliably: 19 in 20."""
LEVEL = 0.95
"""Of the intervals."""
SHAPE, SCALE = 2.0, 3.0
"""Of the gamma prior of the slope."""
SLOPES = (0.2, 100.0)
"""Least and greatest slope that is tried."""
BEYOND = 5.0
"""How far beyond the sizes tried the reliable size is looked for, as a logarithm."""
FINE, COARSE = (321, 61), (201, 41)
"""Points of the grids of sizes and slopes: for one curve, and for many that are drawn."""
CLOSER = 61
"""Points along either side of a grid within a step or two of another."""
MARGIN = log(1.1)
"""How far beyond the sizes tried a size still counts as among them, as a logarithm."""
DRAWS = 400
"""Of a parametric bootstrap."""
TOGETHER = np.linspace(0.0, 0.95, 20)
"""Correlations that are tried between what is named by two on the same logs."""


@dataclass(frozen=True)
class Curve(Record):
    """A detection curve.

    Attributes
    ----------
    runs, named
        How many logs, and in how many of them the effect was named.
    least, most
        Smallest and largest size that was tried.
    size
        That is named 19 times in 20; None where it is not among the sizes tried.
    low, high
        Its 95 % interval by the profile of the likelihood; 0 and infinite where no size is too small, and none too large.
    slope
        Of the logit by the logarithm of the size.
    bound
        ``never`` where the size that is named reliably is larger than all that were tried, ``always`` where it is smaller, and
        else empty.
    place
        Where the fitted curve reaches 19 in 20, even beyond the sizes tried; 0 or infinite where it does not.
    """

    DERIVED: ClassVar[Mapping[str, str]] = {"says": "text"}

    runs: int
    named: int
    least: float
    most: float
    size: float | None
    low: float
    high: float
    slope: float
    bound: str
    place: float

    def __post_init__(self) -> None:
        """Take what JSON has no number for as what it was: infinite."""
        for name in ("high", "place"):
            if isnan(getattr(self, name)):
                object.__setattr__(self, name, inf)

    def share(self, sizes: Floats) -> Floats:
        """Return the share of logs in which an effect is named, by its sizes."""
        if not 0.0 < self.place < inf:
            return np.full(len(sizes), 1.0 if self.place == 0.0 else 0.0)
        logit = log(RELIABLE / (1.0 - RELIABLE)) + self.slope * (np.log(sizes) - log(self.place))
        return np.asarray(expit(logit))

    @property
    def text(self) -> str:
        """The size in words."""
        if self.bound == "never":
            return f"beyond the sizes tried (more than {self.most:.3g})"
        if self.bound == "always":
            return f"below the sizes tried (less than {self.least:.3g})"
        return f"{self.size:.3g} ({self.low:.3g} to {self.high:.3g})"


@dataclass(frozen=True)
class Ratio(Record):
    """A size that one names reliably over the size that another does.

    Attributes
    ----------
    value
        None where either is not among the sizes tried.
    low, high
        Its 95 % interval by a paired parametric bootstrap; where a size is beyond those tried, all that it could be counts.
    """

    value: float | None
    low: float
    high: float

    def __post_init__(self) -> None:
        """Take what JSON has no number for as what it was: infinite."""
        for name in ("low", "high"):
            if isnan(getattr(self, name)):
                object.__setattr__(self, name, inf)


@dataclass(frozen=True)
class _Grid:
    """Reliable sizes and slopes with the likelihood that a run is named under each.

    Attributes
    ----------
    place, slope
        Logarithm of the reliable size, shape (p,), and slope, shape (s,).
    yes, no
        Logarithm of the share that is named, and that is not, shape (p, s, n).
    prior
        Of the slope, shape (s,).
    """

    place: Floats
    slope: Floats
    yes: Floats
    no: Floats
    prior: Floats

    @classmethod
    def over(cls, x: Floats, place: Floats, slope: Floats, *, prior: bool) -> _Grid:
        """Return the grid of places and slopes for runs of sizes with these logarithms, shape (n,)."""
        logit = log(RELIABLE / (1.0 - RELIABLE)) + slope[None, :, None] * (x[None, None] - place[:, None, None])
        prior_log = (SHAPE - 1.0) * np.log(slope) - slope / SCALE if prior else np.zeros_like(slope)
        # log(1 + exp(-|logit|)) once for both, without overflow.
        small = np.log1p(np.exp(-np.abs(logit)))
        return cls(place, slope, np.minimum(logit, 0.0) - small, -np.maximum(logit, 0.0) - small, prior_log)

    def profile(self, named: Floats) -> tuple[Floats, NDArray[np.int64]]:
        """Return the greatest logarithm of the posterior at each place, shape (p, d), and where its slope is.

        Parameters
        ----------
        named
            1 for a run that was named, 0 for one that was not, shape (n, d).
        """
        every = self.yes @ named + self.no @ (1.0 - named) + self.prior[:, None]
        return every.max(axis=1), every.argmax(axis=1)

    def profile_of_many(self, x: Floats, named: Floats) -> Floats:
        """Return the greatest logarithm of the posterior at each place for many draws at once, shape (p, d).

        The difference of both logarithms is the logit, which is linear in the size: how many of a draw are named, and the sum
        of their sizes, are sufficient. A profile is less flat than rounding only where the slope has its prior.

        Parameters
        ----------
        x
            Logarithm of the sizes, shape (n,).
        named
            As of `profile`.
        """
        nobody = self.no.sum(axis=2) + self.prior
        intercept = log(RELIABLE / (1.0 - RELIABLE)) - self.slope * self.place[:, None]
        terms = np.stack([nobody, intercept, np.broadcast_to(self.slope, nobody.shape)], axis=2)
        sums = np.stack([np.ones(named.shape[1]), named.sum(axis=0), x @ named])
        return np.asarray((terms.reshape(-1, 3) @ sums).reshape(*nobody.shape, -1).max(axis=1))


def curve(sizes: Sequence[float], named: Sequence[bool], *, prior: bool = True) -> Curve:
    """Return the detection curve of some runs.

    Parameters
    ----------
    sizes
        Of what was injected in each, positive.
    named
        Whether it was named.
    prior
        False leaves out the prior of the slope, for comparison with others; it is then at most 100.

    Raises
    ------
    FerryIdError
        For sizes that are not positive, and for none.
    """
    x, y = _checked(sizes, named)
    grid = _grid(x, FINE, prior=prior)
    profile, at = grid.profile(y[:, None])
    best, slope = float(_top(grid, profile)[0]), float(grid.slope[at[_highest(profile)[0], 0]])
    top = float(profile.max())
    if isfinite(best):
        k = int(_highest(profile)[0])
        near, slopes = _closer(x, y, grid, at, (max(k - 1, 0), k + 1), prior=prior)
        j = int(near[1].argmax())
        best, slope, top = float(near[0][j]), float(slopes[j]), max(top, float(near[1][j]))
    low, high = _interval(x, y, grid, profile[:, 0], at, top, prior=prior)
    least, most = float(x.min()), float(x.max())
    bound = "never" if best > most + MARGIN else "always" if best < least - MARGIN else ""
    return Curve(
        len(x),
        int(y.sum()),
        exp(least),
        exp(most),
        None if bound else exp(best),
        exp(low) if isfinite(low) else 0.0,
        exp(high) if isfinite(high) else inf,
        slope,
        bound,
        exp(best) if isfinite(best) else (0.0 if best < 0.0 else inf),
    )


def ratio(sizes: Sequence[float], one: Sequence[bool], other: Sequence[bool], seed: int = 0) -> Ratio:
    """Return the size that one names reliably over the size that another does, who saw the same logs.

    What both name of a log is resampled by their curves, with the correlation that the logs show: a log that is
    hard for one is hard for the other. Resampled from the logs themselves, a perfect separation would only ever give itself.

    Parameters
    ----------
    sizes
        Of what was injected in each log, positive.
    one, other
        Whether each of them named it.
    seed
        Of the draws.

    Raises
    ------
    FerryIdError
        For sizes that are not positive, and for none.
    """
    (x, a), (_, b) = _checked(sizes, one), _checked(sizes, other)
    grid = _grid(x, COARSE)
    shares = [_share(grid, made, x) for made in (a, b)]
    value = None
    sizes_found = [curve(sizes, [bool(flag) for flag in made]).size for made in (a, b)]
    if sizes_found[0] is not None and sizes_found[1] is not None:
        value = sizes_found[0] / sizes_found[1]
    rho = _correlation(shares, (a > 0.5, b > 0.5))
    rng = np.random.default_rng(seed)
    first, second = rng.standard_normal((2, len(x), DRAWS))
    second = rho * first + np.sqrt(1.0 - rho**2) * second
    drawn = [
        (chance < norm.ppf(share)[:, None]).astype(np.float64)
        for chance, share in zip((first, second), shares, strict=True)
    ]
    tops = [_top(grid, grid.profile_of_many(x, named)) for named in drawn]
    least, most = float(x.min()) - MARGIN, float(x.max()) + MARGIN
    lows = [np.where(top > most, most, np.where(top < least, -inf, top)) for top in tops]
    highs = [np.where(top > most, inf, np.where(top < least, least, top)) for top in tops]
    tail = 0.5 * (1.0 - LEVEL)
    low = float(np.quantile(lows[0] - highs[1], tail, method="lower"))
    high = float(np.quantile(highs[0] - lows[1], 1.0 - tail, method="higher"))
    return Ratio(value, exp(low), exp(high) if high < inf else inf)


def _checked(sizes: Sequence[float], named: Sequence[bool]) -> tuple[Floats, Floats]:
    size = np.asarray(sizes, dtype=np.float64)
    if len(size) == 0 or len(size) != len(named) or not (size > 0.0).all():
        least = "" if len(size) == 0 else f", the smallest {size.min():g}"
        raise FerryIdError(
            f"detection curve: needs runs of positive sizes, each named or not, found {len(size)} sizes{least} and "
            f"{len(named)} answers. Fix: leave out runs in which nothing was injected"
        )
    return np.log(size), np.asarray(named, dtype=np.float64)


def _grid(x: Floats, points: tuple[int, int], *, prior: bool = True) -> _Grid:
    place: Floats = np.linspace(x.min() - BEYOND, x.max() + BEYOND, points[0])
    return _Grid.over(x, place, np.geomspace(*SLOPES, points[1]), prior=prior)


def _highest(profile: Floats) -> NDArray[np.int64]:
    """Return the place of the top of each profile, shape (d,)."""
    return np.asarray(profile.argmax(axis=0))


def _top(grid: _Grid, profile: Floats) -> Floats:
    """Return where profiles are highest, between the points of the grid, shape (d,); infinite at its ends."""
    k, d = _highest(profile), np.arange(profile.shape[1])
    inner = np.clip(k, 1, len(grid.place) - 2)
    before, here, after = profile[inner - 1, d], profile[inner, d], profile[inner + 1, d]
    bend = before - 2.0 * here + after
    shift = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, -1.0), 0.0)
    top = grid.place[inner] + np.clip(shift, -1.0, 1.0) * (grid.place[1] - grid.place[0])
    # Where all or none are named the profile rises to the end and is flat there.
    return np.where(k == 0, -inf, np.where(k == len(grid.place) - 1, inf, top))


def _interval(
    x: Floats, y: Floats, grid: _Grid, profile: Floats, at: NDArray[np.int64], top: float, *, prior: bool
) -> tuple[float, float]:
    """Return the 95 % interval of a place; infinite where the profile does not fall far enough below its top."""
    level = top - 0.5 * float(chi2.ppf(LEVEL, 1))
    inside = np.flatnonzero(profile >= level)
    a, b = int(inside[0]), int(inside[-1])
    low, high = -inf, inf
    if a > 0:
        (place, rising), _ = _closer(x, y, grid, at, (a - 1, a), prior=prior)
        low = float(np.interp(level, rising, place))
    if b < len(profile) - 1:
        (place, falling), _ = _closer(x, y, grid, at, (b, b + 1), prior=prior)
        high = float(np.interp(-level, -falling, place))
    return low, high


def _closer(
    x: Floats, y: Floats, grid: _Grid, at: NDArray[np.int64], between: tuple[int, int], *, prior: bool
) -> tuple[tuple[Floats, Floats], Floats]:
    """Return places between two of a grid with the profile there, and the slopes that belong to it, on a finer grid."""
    growth = grid.slope[1] / grid.slope[0]
    ends = grid.slope[[int(at[k, 0]) for k in between]]
    place: Floats = np.linspace(grid.place[between[0]], grid.place[between[1]], CLOSER)
    slope = np.geomspace(float(ends.min()) / growth, float(ends.max()) * growth, CLOSER)
    fine = _Grid.over(x, place, slope, prior=prior)
    profile, steep = fine.profile(y[:, None])
    return (place, profile[:, 0]), slope[steep[:, 0]]


def _share(grid: _Grid, named: Floats, x: Floats) -> Floats:
    """Return the share that is named at each size by a fitted curve, shape (n,)."""
    profile, at = grid.profile(named[:, None])
    k = int(_highest(profile)[0])
    logit = log(RELIABLE / (1.0 - RELIABLE)) + grid.slope[at[k, 0]] * (x - grid.place[k])
    return np.asarray(np.clip(expit(logit), 1e-9, 1.0 - 1e-9))


def _correlation(shares: Sequence[Floats], named: tuple[Flags, Flags]) -> float:
    """Return the likeliest correlation of two normal variables by whose order what is named is as it is."""
    deviate = [norm.ppf(share) for share in shares]
    best = [float(np.log(_together(deviate, shares, named, rho)).sum()) for rho in TOGETHER.tolist()]
    return float(TOGETHER[int(np.argmax(best))])


def _together(deviate: Sequence[Floats], shares: Sequence[Floats], named: tuple[Flags, Flags], rho: float) -> Floats:
    """Return the probability of what two named of each log, shape (n,); Plackett's integral over the correlation."""
    a, b = deviate
    node, weight = np.polynomial.legendre.leggauss(12)
    angle = 0.5 * np.arcsin(rho) * (node + 1.0)
    sine, cosine = np.sin(angle)[:, None], np.cos(angle)[:, None]
    density = np.exp(-0.5 * (a**2 + b**2 - 2.0 * sine * a * b) / cosine**2) / (2.0 * np.pi)
    both = shares[0] * shares[1] + 0.5 * np.arcsin(rho) * (weight @ density)
    one, other = named
    chance = np.where(
        one & other, both, np.where(one, shares[0] - both, np.where(other, shares[1] - both, 1.0 - sum(shares) + both))
    )
    return np.asarray(np.maximum(chance, 1e-12))
