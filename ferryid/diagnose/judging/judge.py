"""Judging: what of a selection stands, and what was measured of it for the confidence rules to weigh."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ferryid.diagnose.checks import SensorFinding
from ferryid.diagnose.checks.screening import ScreenedLog
from ferryid.diagnose.inference.estimation import Fit, fit
from ferryid.diagnose.inference.stages import SelectedLog
from ferryid.diagnose.judging.backward_elimination import Elimination, eliminate_backward
from ferryid.diagnose.judging.campaign_laws import CampaignLaws, find_campaign_laws
from ferryid.diagnose.judging.claims import Claim, Figures, LogFigures
from ferryid.diagnose.judging.credibility import refitted_hull, value_doubt
from ferryid.diagnose.judging.disturbance_findings import disturbance_claims, explained_by
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.findings import force_claims
from ferryid.diagnose.judging.signal_to_noise import velocity_noise_shares
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.diagnose.judging.unexplained import Unexplained, find_unexplained
from ferryid.effects import effects
from ferryid.effects.wording import listed
from ferryid.side_by_side import over
from ferryid.types import AXES
from ferryid.vessel.circumstances import Circumstances


@dataclass(frozen=True)
class JudgedLog:
    """A log with what stands of its selection, before the confidence rules.

    Attributes
    ----------
    selected
        The selection.
    base
        The fit without any effect.
    stands
        What is left of the selection.
    unknown
        What is left of the log.
    claims
        All findings with their figures: of sensors, of forces, of disturbances, and those without a name.
    figures
        Of the log as a whole.
    """

    selected: SelectedLog
    base: Fit
    stands: Elimination
    unknown: Unexplained
    claims: tuple[Claim, ...]
    figures: LogFigures


def judge(logs: Sequence[SelectedLog], progress: Callable[[str], None]) -> tuple[JudgedLog, ...]:
    """Judge the selections of the logs of a campaign: one by one, and by laws that hold in all of them."""
    stand = over(lambda log: eliminate_backward(log.search.problem, log.search.fit, log.steady, progress), logs)
    laws: Mapping[str, CampaignLaws] = {}
    if any(log.estimated.baseline.joint for log in logs):
        progress("looking for laws that hold in all logs")
        laws = find_campaign_laws(
            {log.path: (log.search.problem, one.fit) for log, one in zip(logs, stand, strict=True)}
        )
    return tuple(
        over(lambda one: _judged(one[0], one[1], laws.get(one[0].path), progress), zip(logs, stand, strict=True))
    )


def _judged(
    log: SelectedLog, stands: Elimination, laws: CampaignLaws | None, progress: Callable[[str], None]
) -> JudgedLog:
    problem, states, measurements = log.search.problem, log.search.states, log.estimated.averaged.screened.measurements
    base = fit(problem, ())
    progress("looking for unexplained forces")
    unknown = find_unexplained(problem, stands.fit, measurements, laws)
    explained = over(lambda state: explained_by(log, stands.fit, state), states)
    progress("locating")
    baseline = log.estimated.baseline
    # Beside the hull of several other logs, forces need not stand out against the whole library.
    several = baseline.hull_known or baseline.hull_logs >= JUDGING.campaign_logs
    library = () if baseline.joint and several else log.steady
    claims = (
        *sensor_claims(log.estimated.averaged.screened),
        *force_claims(problem, stands, measurements, library, hull_known=baseline.hull_known, hull_shared=several),
        *disturbance_claims(problem, stands.fit, states, measurements, explained),
        *unknown.claims,
    )
    figures = LogFigures(
        hull_known=baseline.hull_known,
        joint=baseline.joint,
        hull_logs=baseline.hull_logs,
        velocity_noise=velocity_noise_shares(problem),
        unsteady=unknown.unsteady or bool(states),
        wind_measured=measurements.wind is not None,
        baseline_sensors=baseline.sensors,
        circumstances=Circumstances.of(measurements.profile),
        hull_doubt=refitted_hull(problem, stands.fit, known=baseline.hull_known).doubt,
        removed={} if stands.proof is None else dict(zip(AXES, stands.proof.whole.removed.tolist(), strict=True)),
        jumping=log.estimated.averaged.screened.measured.survey.jumping,
    )
    return JudgedLog(log, base, stands, unknown, claims, figures)


def sensor_claims(log: ScreenedLog) -> tuple[Claim, ...]:
    """Return what the checks found in a log as findings: kinematics alone shows them, so that no force is improved."""
    return tuple(
        Claim(
            Finding(
                effect=one.effect,
                instance=None,
                probability=one.probability,
                parameters=one.parameters,
                axes=dict.fromkeys(AXES, 0.0),
                intervals=one.intervals,
                says=one.says,
                vessel=one.vessel,
            ),
            Figures("sensor", doubt=one.doubt or _doubt(one, log)),
        )
        for one in log.sensors
    )


_COMPARES = {
    "yaw_rate_scale": ("heading",),
    **dict.fromkeys(("lever_arm", "velocity_scale", "clock_offset", "heading_bias"), ("heading", "position")),
}
"""What of the pose the checks of the sensors compare velocities with."""


def _doubt(one: SensorFinding, log: ScreenedLog) -> str:
    """Return why an error of a sensor is not credible; those that are no effects of the library have no limits."""
    wrong = [part for part in log.measured.survey.jumping if part in _COMPARES.get(one.effect, ())]
    if wrong:
        return f"too many samples of the {listed(wrong)} that it was compared with jump to know which are wrong"
    profile = log.measurements.profile
    if one.effect not in effects():
        return ""
    values, known = {name: estimate.value for name, estimate in one.parameters.items()}, effects()[one.effect]
    return value_doubt(known, known.parameters_of(profile), values, profile)
