"""What cannot be true of a vessel whatever the data favour: values at bounds, hulls that are another vessel's, idle effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from math import isfinite, log

import numpy as np
from scipy.special import chdtri, ndtri  # scipy.stats takes a third of a second to import

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.campaign_estimation import CampaignFit
from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fitted_force_model
from ferryid.diagnose.inference.force_errors import mass_of
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.force_model import COEFFICIENTS, UNITS, ForceModel
from ferryid.effects.wording import listed
from ferryid.identify.inertia import inertia_checks
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

IN_THE_HULL = "hull_parameters"
"""The effect that is nothing but other coefficients of the hull: it becomes these."""


@dataclass(frozen=True)
class HullChange:
    """The coefficient of the hull that a refit moved farthest.

    Attributes
    ----------
    coefficient, unit
        Of `ferryid.effects.force_model.COEFFICIENTS`.
    before, value
        What was believed of it, and what came out.
    deviations
        The move in standard deviations of what was believed.
    """

    coefficient: str
    unit: str
    before: float
    value: float
    deviations: float


@dataclass(frozen=True)
class RefittedHull:
    """What a refit made of a hull: the coefficient that moved farthest, and why no hull has its masses, as sentences."""

    farthest: HullChange | None = None
    impossible: tuple[str, ...] = ()

    @property
    def doubt(self) -> str:
        """Why it cannot be the vessel's, as the end of a sentence; empty where it can."""
        if self.farthest is not None and abs(self.farthest.deviations) > JUDGING.credible_move:
            return (
                f"beside it, {self.farthest.coefficient} of the hull moves by {abs(self.farthest.deviations):.0f} prior "
                "standard deviations, which is another vessel's hull"
            )
        for reason in self.impossible:
            return f"beside it, {reason[:1].lower()}{reason[1:].removesuffix('.')}"
        return ""


def refitted_hull(problem: EstimationProblem, kept: Fit, *, known: bool = True) -> RefittedHull:
    """Return what a fit made of the hull; factors on single coefficients are multiplied into its inertia.

    Of a hull that is not `known`, as nobody has modelled it, what little a log may determine of the inertia is no doubt, unless
    no axis has an inertia that is possible: then the forces are not those of the vessel, and any finding may make up for them.
    """
    hull = kept.hull.copy()
    for candidate, values in zip(kept.candidates, kept.values, strict=True):
        if candidate.effect.id == IN_THE_HULL:
            for one, factor in zip(candidate.parameters, values.tolist(), strict=True):
                hull[COEFFICIENTS.index(one.name)] *= factor
    before, spread, profile = problem.plain.hull, problem.hull_spread, problem.plain.measurements.profile
    return RefittedHull(
        _farthest(before, spread, kept.hull),
        impossible_masses(profile, hull) if known else impossible_throughout(profile, hull),
    )


def idle_actuators(problem: EstimationProblem, kept: Fit) -> str:
    """Return that a fit explains the motion all but without its actuators, as the end of a sentence; empty where it does not.

    Forces that the motion does not follow fit best where they are none: masses and damping then have nothing to be told by.
    """
    return _idle([(problem.plain, fitted_force_model(problem.plain, kept))])


def idle_in_campaign(made: CampaignFit) -> str:
    """Return that an estimate explains the motion of all logs but without their actuators; see `idle_actuators`."""
    return _idle([(one.plain, made.whole_force_model(i)) for i, one in enumerate(made.campaign.members)])


def _idle(logs: Sequence[tuple[ForceModel, ForceModel]]) -> str:
    """Return it of logs, of each of which a plain force model and a fitted one are given."""
    recorded, left = (
        float(np.sqrt(sum(np.sum(one[which].parts[one[0].measurements.usable, :, :2] ** 2) for one in logs)))
        for which in (0, 1)
    )
    if left >= JUDGING.idle_share * recorded:
        return ""
    return (
        f"beside it, the actuators are left with {100.0 * left / recorded:.0f} % of their recorded force: the motion does not "
        "follow it, as happens where they were not engaged, or their signals, directions, units or times are not those of the "
        "vessel"
    )


def campaign_hull(made: CampaignFit) -> RefittedHull:
    """Return what all logs of a campaign made of the hull; see `refitted_hull`."""
    prior, h = made.campaign.hull, len(COEFFICIENTS)
    moved = (prior.mean + prior.spread * made.common[: len(prior.mean)])[:h]
    profile = made.campaign.members[0].plain.measurements.profile
    return RefittedHull(
        _farthest(prior.mean[:h], prior.spread[:h], moved),
        impossible_masses(profile, moved) if prior.known else impossible_throughout(profile, moved),
    )


def _farthest(before: Floats, spread: Floats, moved: Floats) -> HullChange | None:
    """Return the coefficient that moved farthest; None where none could move."""
    free = spread > 0.0
    if not free.any():
        return None
    away = np.divide(moved - before, spread, out=np.zeros_like(moved), where=free)
    k = int(np.argmax(np.abs(away)))
    return HullChange(COEFFICIENTS[k], UNITS[k], float(before[k]), float(moved[k]), float(away[k]))


def impossible_masses(profile: Profile, hull: Floats) -> tuple[str, ...]:
    """Return why no hull can have the masses of these coefficients, shape (26,), as a fit judges them, in sentences."""
    return tuple(one.reason for one in inertia_checks(profile, mass_of(hull)) if not one.passed)


def impossible_throughout(profile: Profile, hull: Floats) -> tuple[str, ...]:
    """Return why none of the three inertias of these coefficients is possible, in a sentence; empty where one is."""
    shares = [one for one in inertia_checks(profile, mass_of(hull)) if one.name.startswith("inertia")]
    if any(one.passed for one in shares):
        return ()
    each = ", ".join(f"{one.value:.2g}" for one in shares)
    return (
        f"The effective inertia in surge, sway and yaw is {each} times the rigid body's, which no hull has: places, "
        "directions or thrust curves of the actuators, or the unit of their signals, are not those of the vessel.",
    )


def value_doubt(effect: Effect, parameters: Sequence[Parameter], values: Mapping[str, float], profile: Profile) -> str:
    """Return why the values of an effect are not credible, as the end of a sentence; empty where they are.

    Parameters
    ----------
    effect
        The effect.
    parameters
        With their limits.
    values
        Those that are reported, by name.
    profile
        The vessel.
    """
    if doubt := effect.doubt(values, profile):
        return doubt
    for one in parameters:
        if one.name in values and one.at_bound(values[one.name]):
            return f"its {one.name.replace('_', ' ')} of {values[one.name]:.3g} {one.unit} stands at the bound of its search"
    return ""


def scaled_as_masses(scaled: Set[str | None], profile: Profile, *, shared: bool = False) -> str:
    """Return that a factor on the masses and the damping does the same as those on actuators, as the end of a sentence.

    Empty where some actuator has none. `scaled` are the actuators with one, beside a hull that nobody modelled; with `shared`
    that hull is that of other logs too, so that it may be off in one.
    """
    every = {one.name for one in profile.actuators}
    if not every or not scaled >= every:
        return ""
    if shared:
        what = "the only actuator has" if len(every) == 1 else "all actuators have"
        return f"{what} a factor in this log, beside a hull that is known from the logs alone and may be off in its manoeuvres"
    all_of_them = "the only actuator" if len(every) == 1 else "all actuators, and each of them has one"
    return f"without a hull model, a factor on the masses and the damping does the same as one on {all_of_them}"


def interval_doubt(
    parameters: Sequence[Parameter], estimates: Mapping[str, Estimate], covariance: Floats | None = None
) -> str:
    """Return that 95 % intervals hold none of an effect at all, as the end of a sentence; empty where they do not.

    Evidence says that something is better than nothing in its place; an interval says that this effect is. Places and times
    have no size, as in `ferryid.diagnose.inference.estimation.Fit.reported_errors`. A place that is confined to a few of its
    sizes, as that of a load to the hull, is taken as it is: no place on the hull makes up for a load of no mass, while a line
    without stiffness to a mooring far away is a steady force.

    Parameters
    ----------
    parameters
        Of the effect, with the values at which it does nothing.
    estimates
        Those that are reported, by name.
    covariance
        Of all parameters, shape (p, p), up to the errors that are reported: components such as north and east are judged by
        their common 95 % region. Where None, by the interval of each, whatever else is confined.
    """
    sized = [k for k, one in enumerate(parameters) if one.name in estimates and one.unit == parameters[0].unit]
    told = [estimates[parameters[k].name] for k in sized]
    neutral = np.array([parameters[k].neutral for k in sized])
    inside = [one.low <= none <= one.high for one, none in zip(told, neutral.tolist(), strict=True)]
    if not sized:
        return ""
    none = all(inside)
    if covariance is not None and (np.diag(covariance)[sized] > 0.0).all():
        confined = [
            k for k, one in enumerate(parameters) if k not in sized and covariance[k, k] > 0.0 and _confined(one)
        ]
        # An interval that ends where nothing acts is cut there: its other end tells the error.
        half = np.array([max(one.high - one.value, one.value - one.low) for one in told])
        away = ndtri(0.975) * (np.array([one.value for one in told]) - neutral) / np.maximum(half, 1e-300)
        spread = np.sqrt(np.diag(covariance)[sized])
        alike = _given(covariance, sized, confined) / np.outer(spread, spread)
        none = float(away @ np.linalg.solve(alike, away)) <= float(chdtri(len(sized), 0.05))
    if not none or all(inside):
        return "its 95 % interval includes no effect at all" if none else ""
    # The intervals that are shown exclude it.
    if len(sized) > 1:
        names = listed([parameters[k].name.replace("_", " ") for k in sized])
        return f"the common 95 % region of {names} includes no effect at all"
    return "its 95 % interval is so uneven that, by its wider side, it includes no effect at all"


def size_deviations(parameters: Sequence[Parameter], estimates: Mapping[str, Estimate]) -> float:
    """Return by how many standard errors a size is away from none, of the parameter of which it is most; places have no size.

    Parameters
    ----------
    parameters
        Of the effect, with the values at which it does nothing.
    estimates
        Those that are reported, by name.
    """
    found = [0.0]
    for one in parameters:
        if one.name not in estimates or one.unit != parameters[0].unit:
            continue
        told = estimates[one.name]
        half = told.value - told.low if told.value > one.neutral else told.high - told.value
        if half > 0.0:
            found.append(float(ndtri(0.975)) * abs(told.value - one.neutral) / half)
    return max(found)


def _confined(one: Parameter) -> bool:
    return one.high - one.low <= JUDGING.confined * one.size


def _given(covariance: Floats, wanted: Sequence[int], known: Sequence[int]) -> Floats:
    """Return the covariance of some parameters with others known, shape (wanted, wanted)."""
    own = covariance[np.ix_(wanted, wanted)]
    if not known:
        return own
    shared = covariance[np.ix_(wanted, known)]
    return np.asarray(own - shared @ np.linalg.solve(covariance[np.ix_(known, known)], shared.T))


def worsened(removed: Mapping[str, float]) -> str:
    """Return on which axis predictions get worse, as the end of a sentence; empty where none does, or for far better others.

    Physics that acts improves what it acts on, and hardly harms the rest. Its formula may be off on an axis where little of it
    acts: what counts is by how much the squared error of an axis grows beside how much those of the others shrink, each as the
    logarithm of a ratio, so that it does not matter how much of a force an axis has. An axis whose squared error more than
    doubles counts whatever the others gain.

    Parameters
    ----------
    removed
        Share of the held-out squared force error that a finding removes, by axis; below zero where it grows.
    """
    known = {axis: share for axis, share in removed.items() if isfinite(share)}
    worst = min(known, key=lambda axis: known[axis], default="")
    if not worst or known[worst] >= -JUDGING.worsening:
        return ""
    # Of an axis without an error before, nothing was removed.
    shrinks = [-log(1.0 - share) for share in known.values() if share < 1.0]
    gained, lost = (sum(max(sign * one, 0.0) for one in shrinks) for sign in (1.0, -1.0))
    if known[worst] >= -JUDGING.worst_growth and lost <= JUDGING.worsening_over_gain * gained:
        return ""
    return f"it makes the held-out squared force error in {worst} {-100.0 * removed[worst]:.0f} % larger"


def harm_alone(removed: Mapping[str, float]) -> str:
    """Return on which axis predictions get worse while they get better on none, as the end of a sentence; else nothing.

    What does so on stretches kept from the fit is no more than a way in which the fit bent.
    """
    gained = max((share for share in removed.values() if isfinite(share)), default=0.0)
    harm = worsened(removed) if gained < JUDGING.least_hinted else ""
    return f"{harm}, and on none smaller" if harm else ""


def felt(made: CampaignFit, common: Floats, own: Floats) -> Floats:
    """Return how much of the measured acceleration what sets two estimates apart is, by axis, shape (logs, 3).

    Parameters
    ----------
    made
        One of them.
    common, own
        Vectors of the other: of all logs, shape (g,), and of each, shape (logs, l).
    """
    campaign, shares = made.campaign, []
    pairs = zip(campaign.gaps(made.common, made.own), campaign.gaps(common, own), strict=True)
    for member, (there, moved) in zip(campaign.members, pairs, strict=True):
        moved = there - moved
        measured = member.windows.along_vessel(member.windows.measured[:, member.windows.channels])
        size = np.sqrt(np.mean(measured**2, axis=0))
        shares.append(np.sqrt(np.mean(moved**2, axis=0)) / np.where(size > 0.0, size, np.inf))
    return np.array(shares)


def unfelt(shares: Floats) -> str:
    """Return that accelerations by an effect, over the measured ones, shape (3,), are too small; empty where one is not."""
    if (shares >= INFERENCE.void_share).any():
        return ""
    return f"it moves the vessel by less than {100.0 * INFERENCE.void_share:g} % of its measured acceleration"
