"""Findings before the confidence rules: claims, each with what was measured of it, and what was measured of the log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Literal

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.judging.finding import Finding
from ferryid.vessel.circumstances import ANYWHERE, Circumstances

Key = tuple[str, str | None]
"""Effect and instance."""
Kind = Literal["sensor", "force", "condition", "property", "disturbance", "law", "unsteady", "bursts"]
"""What shows a finding: kinematics, the force balance, all logs of a campaign together, the noise model's states, or what is
left without a name: an empirical law, something unsteady, or bursts."""


@dataclass(frozen=True)
class OtherLogs:
    """How many other logs a campaign has, how many of them could show a law, and in how many it holds."""

    count: int
    able: int
    holding: int


@dataclass(frozen=True)
class Figures:
    """What was measured of one finding, for the rules to weigh; what does not apply is left at its default.

    Attributes
    ----------
    kind
        What shows it.
    score
        Gain in held-out log-likelihood, None where nothing could be held out.
    force_low, free_run_low
        Lower end of the 95 % interval of the share of the held-out squared force error, and of the free-run error, that it
        removes, by axis; the greatest over horizons.
    worse_runs
        In which of position, heading, speed and yaw rate free runs err more with it: `FreeRuns.worse`.
    removed
        Share of the held-out squared force error that it removes while it acts, by axis; empty where nothing was held out.
    lasts_s, block_s
        For how many seconds of data it acts, infinite for what acts throughout, and the length of a held-out block [s].
    cycles
        Of a disturbance in a narrow band that acts in a span, how many of its periods that holds.
    single_visit
        True where the vessel was only once in the place in which it acts.
    regime
        How its actuator works in its span as nowhere else in the log, as a clause; empty where it does so at other times too.
    passes
        Of what begins and ends within the log, its size over the one that hull and formulas may be off by.
    power_in_velocities
        Share of a disturbance's power that the velocities show, about its peak.
    gain, gain_in_velocities
        Evidence for a disturbance, and in the velocities alone [nat].
    loss_in_velocities
        Log-likelihood that the velocities lose with the least of it that a force would show in them [nat].
    explained_by
        Id of another effect that the log shows, beside which nothing is left of a disturbance; empty where there is none.
    seen_twice
        True where pose and velocity of the axis on which a disturbance is strongest come from two sensors.
    other_logs
        What the other logs of a campaign say of a law; None where there are none.
    beyond_feedback
        True where a delay or lag gains more on held-out data, at the lower end of the interval, than a controller's answer to
        disturbances could, at its upper end.
    sets_in
        True where it sets in or ends within the log as an event that no hull explains, however far that is off.
    beyond_hull
        True where it acts all along and stands out against all that a hull, however far off, or another effect explains.
    deviations
        Size in standard errors of it, of the parameter of which it is most.
    doubt
        Why its values are not credible, as the end of a sentence; empty where they are.
    """

    kind: Kind
    score: float | None = None
    force_low: Mapping[str, float] = field(default_factory=dict)
    free_run_low: Mapping[str, float] = field(default_factory=dict)
    worse_runs: tuple[str, ...] = ()
    removed: Mapping[str, float] = field(default_factory=dict)
    lasts_s: float = inf
    block_s: float = 0.0
    cycles: float = inf
    single_visit: bool = False
    regime: str = ""
    passes: float = inf
    power_in_velocities: float = inf
    gain: float = inf
    gain_in_velocities: float = inf
    loss_in_velocities: float = 0.0
    explained_by: str = ""
    seen_twice: bool = True
    other_logs: OtherLogs | None = None
    beyond_feedback: bool = False
    sets_in: bool = False
    beyond_hull: bool = False
    deviations: float = 0.0
    doubt: str = ""


@dataclass(frozen=True)
class Claim:
    """A finding with what was measured of it."""

    finding: Finding
    figures: Figures


@dataclass(frozen=True)
class LogFigures:
    """What was measured of a log as a whole.

    Attributes
    ----------
    hull_known
        True where the hull comes from a profile or a model, not from the logs that are diagnosed.
    joint
        True where the hull was fitted to all logs of a campaign.
    hull_logs
        Logs that the hull was fitted to, references among them.
    velocity_noise
        Noise of the velocity, times damping, over what moves the vessel, by axis.
    unsteady
        True where something unsteady that nobody measured was found or left over.
    wind_measured
        True where the wind was measured, so that what is unsteady is no gust that nobody measured.
    campaign
        Lasting properties of the vessel that each log of the campaign shows, this log's among them.
    weighed
        Lasting properties that most logs of the campaign can show, were weighed for together, and do not confirm.
    baseline_sensors
        Sensor errors that the simulation has which the log is compared with: parameters by effect.
    circumstances
        Where it was recorded, and what drives the vessel.
    hull_doubt, common_hull_doubt
        Why the hull that was refitted to the log, and the one that was fitted to all logs of a campaign, cannot be the
        vessel's, as the end of a sentence; empty where they can.
    removed
        Share of the held-out squared force error that all findings on forces together remove, by axis, the hull refitted with
        them and without; empty where nothing was held out.
    jumping
        ``"position"`` or ``"heading"``, where it jumps too often to know which samples are wrong.
    """

    hull_known: bool = True
    joint: bool = False
    hull_logs: int = 1
    velocity_noise: Mapping[str, float] = field(default_factory=dict)
    unsteady: bool = False
    wind_measured: bool = False
    campaign: tuple[frozenset[Key], ...] = ()
    weighed: frozenset[Key] = frozenset()
    baseline_sensors: Mapping[str, Mapping[str, Estimate]] = field(default_factory=dict)
    circumstances: Circumstances = ANYWHERE
    hull_doubt: str = ""
    common_hull_doubt: str = ""
    removed: Mapping[str, float] = field(default_factory=dict)
    jumping: tuple[str, ...] = ()
