"""What an effect is: parameters, how it changes the force model, and how a simulated trial shows it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf, isfinite, log
from types import FunctionType
from typing import Any

from ferryid.effects.force_model import Action, ForceModel, Measurements, between
from ferryid.effects.simulated import Simulated
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

Values = Mapping[str, float]
Residual = Callable[[ForceModel], Floats]
"""Whitened residual of a force model: half its square is minus the logarithm of the likelihood, but for a constant."""

HELD = 1e-6
"""Size of a parameter that is not to move: one of several alternatives that was not chosen."""


def span(values: Values) -> dict[str, float]:
    """Return from when until when an effect acts as a scenario has it, from its ``onset`` and ``offset`` [s] if it has them."""
    until = {"until_s": values["offset"]} if "offset" in values else {}
    return {"from_s": values.get("onset", 0.0), **until}


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect.

    `size` is what a parameter of moderate size is, in `unit`: the standard deviation of what is believed of it before a log is
    seen. `low` and `high` are the ends of what is possible. `neutral` changes nothing. `start` is where a search begins, if not
    there: where another parameter has no meaning at the neutral value of this one. `attainable` are ends that can be true as
    they are, such as no force at all of a thruster.
    """

    name: str
    unit: str
    size: float
    low: float
    high: float
    neutral: float = 0.0
    start: float | None = None
    attainable: frozenset[float] = frozenset()

    def at_bound(self, value: float) -> bool:
        """Return whether a value stands at an end of what is possible, at which the search for it stopped.

        An end at which nothing acts is none, nor one that a vessel can really be at. The range of what is positive and has
        no neutral value in it, such as a time constant from 0.1 to 300 s, is that of its logarithm.
        """
        scale = log if self.low > max(self.neutral, 0.0) else float
        near = EFFECTS.at_bound * (scale(self.high) - scale(self.low))
        ends = [end for end in (self.low, self.high) if end != self.neutral and end not in self.attainable]
        return any(abs(scale(max(value, self.low)) - scale(end)) <= near for end in ends)


@dataclass(frozen=True)
class Choice:
    """Parameters that were chosen in view of a log, and the logarithm of how many alternatives they were chosen from."""

    parameters: tuple[Parameter, ...]
    log_alternatives: float


@dataclass(frozen=True)
class Process:
    """A disturbance that comes and goes by chance, with covariance ``std² exp(-|t| / time_constant_s) cos(2 pi f t)``.

    Attributes
    ----------
    force
        On the hull by a unit of it [N, N, N·m], shape (n, 3).
    std
        Its standard deviation.
    time_constant_s
        For how long it remembers itself [s].
    frequency_hz
        f; with 0 it is a first-order Gauss-Markov process, such as gusts, and else a narrow band, such as waves.
    """

    force: Floats
    std: float
    time_constant_s: float
    frequency_hz: float = 0.0


@dataclass(frozen=True)
class Turbulence:
    """How a flow over ground changes about its mean: each horizontal component a first-order Gauss-Markov process.

    Attributes
    ----------
    intensity
        Standard deviation over the mean speed.
    least_std_mps
        Standard deviation in the weakest flow [m/s].
    length_m
        Distance over which it is carried by the mean flow within its time constant [m].
    """

    intensity: float
    least_std_mps: float
    length_m: float

    def std(self, speed_mps: float) -> float:
        """Return the standard deviation of each component at a mean speed [m/s]."""
        return max(self.intensity * speed_mps, self.least_std_mps)

    def time_constant_s(self, speed_mps: float) -> float:
        """Return the time constant at a mean speed [s]; a flow without a mean carries it by its own changes."""
        return self.length_m / max(speed_mps, self.std(speed_mps))


Processes = Callable[[Floats], tuple[Process, ...]]
"""What disturbances are by their parameters."""


@dataclass(frozen=True)
class Effect:
    """Physics that a model may have left out.

    Attributes
    ----------
    id, title
        Name in results, and for people.
    parameters
        Scales and limits; those that depend on the vessel come from ``parameters_of``.
    parameters_of
        Parameters for a vessel.
    apply
        ``apply(force_model, p, instance)`` returns the force model with the effect in it; `p` has one value per parameter.
    instances
        The thrusters that it can be an effect of; ``(None,)`` where it is one of the whole vessel.
    cannot
        Why the measurements cannot show it, as a sentence; empty where it can.
    cannot_be_of
        ``cannot_be_of(measurements, instance)`` returns why they cannot show it of one of its instances, in the same form.
    onset
        True where it may begin or end during the log.
    longest_s
        Longest time for which it acts [s], at most `EFFECTS.longest_share` of a log, as one that never lasts throughout: see
        `passing`. Infinite for one that may.
    otherwise
        ``otherwise(force_model, p, instance)`` returns the force model as it is before it begins and after it ends; None where
        nothing acts then.
    step
        The same effect as a step from a level that is not known, its second parameter: of a vessel without a hull model, on
        which masses and damping that are off look like another level. None where there is no such form.
    by_level
        The same effect as a function of how hard its actuator works, in place of a step. What sets in when an actuator is set
        to another level, and ends when it is set back, may be either. None where there is no such form.
    impulse
        ``impulse(force_model, p)`` returns the momentum that an effect gives the vessel if it begins in a row
        [N·s, N·s, N·m·s], shape (n, 3). What ends leaves the velocity as it is.
    says
        One sentence on a finding, from its values by name and its instance.
    single_visit
        ``single_visit(measurements, p)`` is True where the vessel was in the place in which it acts only once, so that
        whatever acted at that time would look the same.
    in_part
        True where that sentence can be said of some of the values alone, those that a log tells.
    scenario
        What has to stand in a scenario file for the effect to act, from its values by name: nested tables as in TOML.
    simulated
        What it does to the simulated vessel, so that ``[[effects]]`` of a scenario can name it; None for one that the plant
        knows by sections of its own.
    vessel
        True for a property of hull or actuators, which carries over to other logs; False for a condition of one log.
    choose
        ``choose(force_model, prior_hull, residual)`` returns the parameters for a log whose forces are otherwise those of the
        force model, where there are alternatives to choose from (places, coefficients): a quick scan, in place of
        ``parameters_of``. The force model's hull is the fitted one, `prior_hull` the prior's coefficients, shape (26,).
    minimum_change
        How far the interval of a parameter has to stay from its neutral value for the parameter to be worth a report.
    unreported
        ``unreported(measurements, p)`` returns the names of parameters that a log does not determine, whatever their values.
    negligible
        An effect whose parameters are all nearer to neutral than this is void: hull or instruments may be as much off anyway.
        Those count that have the unit of the first; a place has no size.
    formula_error
        How far off its formula, and what the model has beside it, are believed to be: a standard deviation, as a share of how
        far a parameter is from neutral. A log tells of noise and coefficients only.
    passing_size
        ``passing_size(profile)``: what both begins and ends within a log and is nearer to neutral than this, in the unit of
        the first parameter, is a hint: hull and formulas are as much off in a part of the manoeuvres.
    changes_hull
        True where the effect changes how the hull's coefficients act: masses, damping, the flow.
    of_coefficients
        True where it is errors of single coefficients of the hull, each by itself: one cause of most of them is likelier.
    piecewise
        True where a parameter is the end of a range, so that the slope where a search begins leads a part of the way only, and
        a fit that ranks it among others takes more steps.
    profiled
        Parameter that others trade with, along which the posterior of an effect that acts all along is followed; empty where
        its curvature tells all.
    by_row
        True where what it does to a row depends on that row and the parameters alone, so that logs one after another are one.
        Where ``of_log`` names parameters, it takes them for each row as well, shape (n, p).
    of_sensor
        True where it corrects what was measured: such effects act first, as the others act on what is true.
    acts_last
        True where it reads and changes neither the actuators' forces nor the water's flow, and so may act after all that do: a
        fit that moves one of its parameters works out anew what acts after it.
    sidewise
        Names of parameters that make port and starboard unlike: a hull whose two sides are alike cannot take after them.
    unsteady
        ``unsteady(force_model)(p)`` returns stochastic disturbances from positive parameters; none where the force model has
        nothing for them to act on. Such an effect changes no force model: it is a state of the filter.
    doubt
        ``doubt(values, profile)`` returns why values by name are not credible of a vessel, or may stand in for something else,
        whatever the data say, as the end of a sentence; empty where they are as they may be.
    doubt_where
        ``doubt_where(values, measurements)`` does so by where the vessel was in a log.
    doubt_of_ends
        ``doubt_of_ends(ends)`` does so by the lower and upper ends of 95 % intervals by name, where a value may be chance.
    later
        Parameters that models of before lack, which are neutral in these.
    scales
        True where it multiplies all that an actuator gives: of a vessel with one actuator and no hull model, a factor on its
        masses and damping does the same.
    of_thrust_curve
        True where it is another shape of an actuator's thrust curve, and so may be the profile's error.
    out_of_step
        True where it puts force and motion out of step, as a delay does and a lag, and a controller that answers disturbances.
    of_log
        Of a condition that steadily acts on a whole log: names of the parameters that each log of a vessel has its own of; the
        others are the vessel's. Empty for what is no such condition.
    turbulence
        How such a condition changes within a log; None for one that is taken as steady.
    absent_in, rare_in, common_in
        Settings of a profile (`ferryid.vessel.profile.SETTINGS`) in which there is no such thing, so that it is not tested, in
        which it is less likely than where the setting is not known, and in which it is more likely.
    about
        Id of the effect about which an unsteady one comes and goes, and beside which it is looked for.
    regressor
        ``regressor(force_model, p, instance, axis)`` returns label with unit and values, shape (n,), of the quantity against
        which the residual force of that axis is drawn to show the effect.
    """

    id: str
    title: str
    parameters_of: Callable[[Profile], tuple[Parameter, ...]]
    apply: Action
    says: Callable[[Values, str | None], str]
    scenario: Callable[[Values, str | None], dict[str, Any]]
    instances: Callable[[Profile], tuple[str | None, ...]] = lambda profile: (None,)
    cannot: Callable[[Measurements], str] = lambda measurements: ""
    cannot_be_of: Callable[[Measurements, str | None], str] = lambda measurements, instance: ""
    onset: bool = False
    longest_s: float = inf
    otherwise: Action | None = None
    step: Effect | None = None
    by_level: Effect | None = None
    impulse: Callable[[ForceModel, Floats], Floats] | None = None
    vessel: bool = False
    choose: Callable[[ForceModel, Floats, Residual], Choice] | None = None
    minimum_change: float = 0.0
    unreported: Callable[[Measurements, Floats], frozenset[str]] = lambda measurements, p: frozenset()
    single_visit: Callable[[Measurements, Floats], bool] = lambda measurements, p: False
    in_part: bool = False
    negligible: float = 0.0
    formula_error: float = EFFECTS.formula_error
    passing_size: Callable[[Profile], float] = lambda profile: 0.0
    changes_hull: bool = False
    of_coefficients: bool = False
    piecewise: bool = False
    profiled: str = ""
    by_row: bool = False
    of_sensor: bool = False
    acts_last: bool = False
    sidewise: tuple[str, ...] = ()
    unsteady: Callable[[ForceModel], Processes] | None = None
    doubt: Callable[[Values, Profile], str] = lambda values, profile: ""
    doubt_where: Callable[[Values, Measurements], str] = lambda values, measurements: ""
    doubt_of_ends: Callable[[Mapping[str, tuple[float, float]]], str] = lambda ends: ""
    later: tuple[str, ...] = ()
    scales: bool = False
    of_thrust_curve: bool = False
    out_of_step: bool = False
    of_log: tuple[str, ...] = ()
    turbulence: Turbulence | None = None
    absent_in: tuple[str, ...] = ()
    rare_in: tuple[str, ...] = ()
    common_in: tuple[str, ...] = ()
    about: str = ""
    regressor: Callable[[ForceModel, Floats, str | None, str], tuple[str, Floats]] | None = None
    simulated: Simulated | None = None

    def untestable(self, measurements: Measurements) -> str:
        """Return why it is not looked for, as the end of a sentence; empty where it is, at least of one instance."""
        if reason := self.excluded(measurements):
            return reason
        reasons = [self.cannot_be_of(measurements, one) for one in self.instances(measurements.profile)]
        return reasons[0] if reasons and all(reasons) else ""

    def excluded(self, measurements: Measurements) -> str:
        """Return why vessel, setting and signals rule it out for any instance and whatever was done in a log."""
        setting = measurements.profile.setting
        if setting in self.absent_in:
            return f"the profile's setting is a {setting}"
        return self.cannot(measurements)

    def testable_instances(self, measurements: Measurements) -> tuple[str | None, ...]:
        """Return the instances of which the measurements can show it."""
        every = () if self.excluded(measurements) else self.instances(measurements.profile)
        return tuple(one for one in every if not self.cannot_be_of(measurements, one))

    def is_like(self, other: Effect) -> bool:
        """Tell whether both formulas idealise what lies between them: shapes of a thrust curve, or a delay and a lag."""
        return (self.of_thrust_curve and other.of_thrust_curve) or (self.out_of_step and other.out_of_step)

    @property
    def passing(self) -> bool:
        """True for what only ever comes and goes: it begins and ends within a log, or touches one end of it, and is short."""
        return isfinite(self.longest_s)

    def log_rarity(self, profile: Profile) -> float:
        """Return by how much its log prior odds are lower in the profile's setting than in an unknown one [nat].

        Negative where it is common.
        """
        if profile.setting in self.common_in:
            return -EFFECTS.commonness
        return EFFECTS.rarity if profile.setting in self.rare_in else 0.0

    @property
    def order(self) -> int:
        """When it acts among others: what corrects the measurements first, then what the others build on."""
        return 0 if self.of_sensor else 1 if self.unsteady is not None else 3 if self.acts_last else 2

    @property
    def touched(self) -> frozenset[str] | None:
        """Attributes of a force model that it reads or changes; None where that is not known."""
        actions = [self.apply] if self.otherwise is None else [self.apply, self.otherwise]
        told: list[frozenset[str] | None] = [
            vars(one).get("touches") for one in actions if isinstance(one, FunctionType)
        ]
        if len(told) < len(actions) or None in told:
            return None
        return frozenset().union(*(one for one in told if one), () if self.impulse is None else ("external",))

    def act(
        self, force_model: ForceModel, p: Floats, instance: str | None, onset_s: float = 0.0, offset_s: float = inf
    ) -> ForceModel:
        """Return the force model with the effect in it from an onset until an offset [s]; as they stand here, all along."""
        after = self.apply(force_model, p, instance)
        if onset_s <= 0.0 and not isfinite(offset_s):
            return after
        impulse = None if self.impulse is None or onset_s <= 0.0 else self.impulse(force_model, p)
        before = force_model if self.otherwise is None else self.otherwise(force_model, p, instance)
        return between(before, after, onset_s, offset_s, impulse)
