"""Esso Osaka with the wind withheld: the wind of each run that a campaign estimates, what confirms it, and its controls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from ferryid.diagnose.data.course import MeasuredCourse
from ferryid.diagnose.data.measurements import read_measurements, window_lengths
from ferryid.diagnose.inference.campaign import assemble
from ferryid.diagnose.inference.campaign_estimation import estimate_campaign
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.candidate import Candidate, OtherHeading
from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.campaign_conditions import ConditionTest, JudgedConditions, judge_conditions
from ferryid.diagnose.judging.campaign_evidence import EXCHANGED, MIRRORED, Gain, held_out_loss
from ferryid.effects.force_model import ForceModel
from ferryid.types import no_progress
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force
from tests.diagnose.trials import averaged
from tests.real.places import DATA
from tests.real.shared_force import SharedForce, shared_force

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

ESSO = load_profile("esso-osaka")
assert ESSO.wind is not None
AREAS = ESSO.wind
KINDS = ("random", "zigzag")
WIND = "wind"
MEASURED, MEAN = "the measured wind", "its mean over the run"
SCALED = " with the estimated load factors"


def logs(kind: str) -> list[str]:
    """Return the runs of one kind, random or zigzag, or all."""
    kinds = KINDS if kind == "all" else (kind,)
    return [str(path) for one in kinds for path in sorted((DATA / "esso_osaka" / one).glob("*.csv"))]


@dataclass(frozen=True)
class Judged:
    """Conditions of one campaign as the tool judges them.

    Attributes
    ----------
    tests
        Of every condition, the likeliest first.
    winds, errors
        Of each run, north and east, with the standard errors that are reported [m/s], shape (runs, 2).
    named, hinted
        Effects that are claimed of each run: with a probability above that of a hint, and with less.
    """

    tests: tuple[ConditionTest, ...]
    winds: Floats
    errors: Floats
    named: tuple[frozenset[str], ...]
    hinted: tuple[frozenset[str], ...]

    @property
    def wind(self) -> ConditionTest:
        """The wind's test."""
        return next(one for one in self.tests if one.effect == WIND)

    def over_time(self, hidden: list[Floats]) -> list[MeasuredCourse]:
        """Return the course of each run beside the measured wind; none where no wind is confirmed or estimated."""
        found = []
        for course, member, wind in zip(self.wind.courses, self.wind.fit.campaign.members, hidden, strict=False):
            measurements = member.windows.measurements
            rows = measurements.usable
            found.append(MeasuredCourse.beside(course, measurements.t[rows], wind[rows]))
        return found

    @property
    def factors(self) -> Floats:
        """Factors on the wind load of all runs that are estimated beside the winds: surge, sway, yaw."""
        fit = self.wind.fit
        return fit.campaign.values(fit.common, fit.own[0])[0][0][2:]

    @property
    def has_wind(self) -> Flags:
        """Whether a wind is named, shape (runs,)."""
        return np.array([WIND in one for one in self.named])

    def off(self, measured: Floats) -> Floats:
        """Return how far the winds point away from the measured ones [deg], shape (runs,)."""
        apart = bearing(self.winds) - bearing(measured)
        return np.asarray(np.abs((apart + 180.0) % 360.0 - 180.0))

    def strength(self, measured: Floats) -> Floats:
        """Return their strength over that of the measured ones, shape (runs,)."""
        return np.asarray(np.hypot(*self.winds.T) / np.hypot(*measured.T))

    def inside(self, measured: Floats) -> Flags:
        """Return which measured components lie in the 95 % intervals, shape (runs, 2)."""
        return np.asarray(np.abs(self.winds - measured) < norm.ppf(0.975) * self.errors)


@dataclass(frozen=True)
class Study:
    """What a campaign with the wind withheld finds of it, beside the sensor.

    Attributes
    ----------
    names
        Of the runs.
    measured, unsteady
        Mean of the measured wind of each run and its standard deviation over time, north and east [m/s], shape (runs, 2).
    found
        What the tool makes of the campaign.
    controls
        What it makes of the same runs with conditions that cannot be true, by what they stand on; empty where not asked for.
    over_time
        The course of the wind in each run beside the measured one; none where no wind is confirmed or estimated.
    gains
        Held-out gain of the wind as it was measured over none, and of its mean, under the noise of the estimate, with the
        profile's coefficients and with the estimate's factors on the load; likewise.
    shared
        What a steady force of the vessel explains beside the winds; None where a wind is confirmed, and likewise.
    """

    names: tuple[str, ...]
    measured: Floats
    unsteady: Floats
    found: Judged
    controls: Mapping[str, Judged]
    over_time: list[MeasuredCourse]
    gains: Mapping[str, Gain]
    shared: SharedForce | None = None

    def of(self, kind: str) -> Flags:
        """Return which runs are of a kind, shape (runs,)."""
        return np.array([kind == "all" or name.startswith(kind) for name in self.names])


def study(
    kind: str, *, controlled: bool = True, sessions: Callable[[Sequence[str]], tuple[int, ...]] | None = None
) -> Study:
    """Estimate runs together with the wind withheld and judge their conditions; where `controlled`, the controls' as well.

    `sessions` numbers the session of each path; None for what the tool makes of their times.
    """
    screened = averaged(logs(kind), ESSO, withhold=(WIND,))
    assembled = assemble(screened, ESSO)
    assert assembled is not None
    campaign, place = assembled
    kept = sorted(place, key=lambda path: place[path])
    if sessions is not None:
        campaign = replace(campaign, sessions=sessions(kept))
    by_path = {one.path: one for one in screened}
    hidden = [hidden_wind(by_path[path]) for path in kept]
    usable = [wind[member.windows.measurements.usable] for wind, member in zip(hidden, campaign.members, strict=True)]
    found = judged(campaign, place)
    steady = [np.broadcast_to(rows.mean(axis=0), wind.shape) for wind, rows in zip(hidden, usable, strict=True)]
    return Study(
        names=tuple(Path(path).stem for path in kept),
        measured=np.array([rows.mean(axis=0) for rows in usable]),
        unsteady=np.array([rows.std(axis=0) for rows in usable]),
        found=found,
        controls={name: judged(one, place) for name, one in controls(campaign).items() if controlled},
        over_time=found.over_time(hidden),
        gains={
            name + of: gain_of(campaign, winds, factors, found.wind)
            for of, factors in (("", np.ones(3)), (SCALED, found.factors))
            for name, winds in ((MEASURED, hidden), (MEAN, steady))
            if controlled
        },
        shared=shared_force(found.wind.fit, in_wind(campaign, hidden, np.ones(3)))
        if controlled and not found.wind.confirmed
        else None,
    )


def judged(campaign: Campaign, place: Mapping[str, int]) -> Judged:
    """Return what the tool makes of a campaign."""
    made = judge_conditions(campaign, place, no_progress)
    test = next(one for one in made.tests if one.effect == WIND)
    parts = [test.condition(i) for i in range(len(campaign.members))]
    return Judged(
        tests=made.tests,
        winds=np.array([value for value, _ in parts]),
        errors=np.array([np.sqrt(np.diag(covariance)) for _, covariance in parts]),
        named=_claimed(made, sure=True),
        hinted=_claimed(made, sure=False),
    )


def _claimed(made: JudgedConditions, *, sure: bool) -> tuple[frozenset[str], ...]:
    place = made.hull.place
    return tuple(
        frozenset(one.finding.effect for one in made.claims(path) if one.finding.sure == sure)
        for path in sorted(place, key=lambda path: place[path])
    )


def controls(campaign: Campaign) -> dict[str, Campaign]:
    """Return the campaign with conditions on the mirrored heading, and on that of another log, in the place of its own.

    They give what `ferryid.diagnose.judging.campaign_evidence.placebos` gives. But its conditions have their headings for good:
    a placebo of a placebo is the same once more, gains nothing over itself and is never confirmed. These turn the heading that
    they are given, so that placebos of them are others.
    """
    every = [member.windows.measurements.psi for member in campaign.members]
    apart = [np.resize(every[(i + 1) % len(every)], len(psi)) - psi for i, psi in enumerate(every)]
    return {
        MIRRORED: _acting(campaign, [np.negative] * len(every)),
        EXCHANGED: _acting(campaign, [partial(np.add, one) for one in apart]),
    }


def _acting(campaign: Campaign, headings: list[Callable[[Floats], Floats]]) -> Campaign:
    members = tuple(
        replace(member, conditions=tuple(acting(one, heading) for one in member.conditions))
        for member, heading in zip(campaign.members, headings, strict=True)
    )
    return replace(campaign, members=members)


def acting(candidate: Candidate, heading: Callable[[Floats], Floats]) -> Candidate:
    """Return a condition that acts as if the vessel's heading were another, made from what it is, shape (n,) each."""

    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        other = OtherHeading(heading(force_model.measurements.psi))
        return other.acted(lambda turned: candidate.effect.apply(turned, p, instance), force_model)

    # The heading is that of all rows of one log.
    return replace(candidate, effect=replace(candidate.effect, apply=apply, by_row=False))


def gain_of(campaign: Campaign, winds: list[Floats], factors: Floats, test: ConditionTest) -> Gain:
    """Return the held-out gain over none of known winds, shape (n, 2) of each run, under the noise of a test's estimate."""
    made = estimate_campaign(in_wind(campaign, winds, factors), noise=test.fit.noise)
    return Gain.of(held_out_loss(made).gain(test.loss[0]))


def in_wind(campaign: Campaign, winds: list[Floats], factors: Floats) -> Campaign:
    """Return the runs in known winds, shape (n, 2) of each; see `blown`."""
    members = tuple(blown(member, wind, factors) for member, wind in zip(campaign.members, winds, strict=True))
    return replace(campaign, members=members)


def hidden_wind(log: AveragedLog) -> Floats:
    """Return the wind that a run measured, on the rows of its windows' measurements, shape (n, 2)."""
    wind = read_measurements(log.path, ESSO)[0].wind
    corrected = windows(replace(log.screened.measurements, wind=wind), *window_lengths(ESSO)).measurements
    assert corrected.wind is not None
    assert np.allclose(corrected.t, log.windows.measurements.t)
    return corrected.wind


def blown(member: Member, wind: Floats, factors: Floats) -> Member:
    """Return a run without conditions of its own, in whose force model a wind blows, shape (n, 2).

    `factors` are those on the load beyond that of still air, shape (3,).
    """
    still = member.plain.external
    load = wind_force(AREAS, wind, member.windows.measurements.psi, member.windows.measurements.nu)
    return replace(member, plain=replace(member.plain, external=still + factors * (load - still)), conditions=())


def bearing(wind: Floats) -> Floats:
    """Return where winds go to [deg], shape (runs,)."""
    return np.degrees(np.arctan2(wind[:, 1], wind[:, 0])) % 360.0
