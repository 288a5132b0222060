"""What a campaign teaches: the hull that all logs speak for, lasting properties, and the conditions of each log.

A hull that nobody has modelled gets drag that no model file has; what a model keeps of it is for a fit to all logs to estimate,
with what was found taken off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import nan

import numpy as np

from ferryid.diagnose.data.measurements import Survey
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.group_differences import GROUPS
from ferryid.diagnose.judging.campaign import JudgedCampaign
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.posterior import Posterior, stored_effect, trained
from ferryid.effects.wording import ALL_THRUSTERS
from ferryid.models import Source, StoredEffect
from ferryid.types import Floats


def campaign_posterior(
    together: JudgedCampaign,
    path: str,
    own: Posterior | None,
    findings: Sequence[Finding],
    survey: Survey,
) -> Posterior | None:
    """Return what a log of a campaign teaches; None where nothing is more likely than not.

    Parameters
    ----------
    together
        What all logs say.
    path
        The log.
    own
        What was found in this log alone, beside the campaign's hull.
    findings
        Of the log, as they are reported.
    survey
        Of the log.
    """
    reported = {(one.effect, one.instance): one for one in findings if one.sure}
    fit, i = together.hull.fit, together.hull.place.get(path)
    conditions, vessel = list[StoredEffect](), list[StoredEffect]()
    if i is not None:
        here = {one.key for one in fit.campaign.members[i].conditions}
        names = fit.campaign.members[i].windows.measurements.names
        values, lasting = fit.campaign.values(fit.common, fit.own[i])
        conditions = [
            _stored(one, p, reported[one.key], survey)
            for one, p in zip(fit.campaign.conditions, values, strict=True)
            if one.key in here and one.key in reported
        ]
        for one, p in zip(fit.campaign.properties, lasting, strict=True):
            # What came back after earlier logs is not lost any more, and no model has it.
            over = one.effect.vessel and one.group == GROUPS[0]
            if one.key in reported and not over:
                # What was aboard in all logs may not be in the next one.
                kind = vessel if one.effect.vessel else conditions
                kind += [_stored(each, p, reported[one.key], survey) for each in _one_by_one(one, names)]
    if own is not None:
        # What all logs say of a property stands above what one of them says.
        shared = {one.key for one in vessel}
        conditions += own.conditions
        vessel += [one for one in own.vessel if one.key not in shared]
    if not vessel and not conditions:
        return None
    return Posterior(
        trained(survey),
        survey.used.ranges,
        tuple(vessel),
        tuple(conditions),
        together.hull_posterior,
        together.hull_doubt,
        () if own is None else own.notes,
    )


def _one_by_one(candidate: Candidate, names: Sequence[str]) -> list[Candidate]:
    """Return what all actuators have in common as that of each: a model knows no other."""
    if candidate.instance != ALL_THRUSTERS:
        return [candidate]
    return [replace(candidate, instance=name) for name in names]


def _stored(candidate: Candidate, values: Floats, finding: Finding, survey: Survey) -> StoredEffect:
    source = Source(
        survey.used.log,
        survey.recording.sha256,
        finding.probability,
        None,
        dict(finding.improvement),
        finding.unresolved_with,
    )
    # What is reported brings its own value and interval, such as the mean of a flow's course; the rest has no interval.
    own = [
        finding.parameters[one.name].value if one.name in finding.parameters else None for one in candidate.parameters
    ]
    values = np.array([value if mine is None else mine for value, mine in zip(values.tolist(), own, strict=True)])
    return stored_effect(candidate, values, [nan] * len(candidate.parameters), finding.parameters, source)
