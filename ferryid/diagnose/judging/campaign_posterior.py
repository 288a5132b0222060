"""What a campaign teaches: the hull that all logs speak for, lasting properties, and the conditions of each log.

A hull that nobody has modelled gets drag that no model file has; what a model keeps of it is for a fit to all logs to estimate,
with what was found taken off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import nan

from ferryid.diagnose.data.measurements import Survey
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.judging.campaign import JudgedCampaign
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.posterior import Posterior, ranges_of, stored_effect, trained
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
    vessel = [] if own is None else list(own.vessel)
    conditions = [] if own is None else list(own.conditions)
    if i is not None:
        values, lasting = fit.campaign.values(fit.common, fit.own[i])
        here = {one.key for one in fit.campaign.members[i].conditions}
        for kept, candidates, found in (
            (conditions, fit.campaign.conditions, values),
            (vessel, fit.campaign.properties, lasting),
        ):
            for candidate, p in zip(candidates, found, strict=True):
                finding = reported.get(candidate.key)
                if finding is not None and (candidate.key in here or kept is vessel):
                    kept.append(_stored(candidate, p, finding, survey))
    if not vessel and not conditions:
        return None
    if own is not None:
        return replace(own, vessel=tuple(vessel), conditions=tuple(conditions), hull=together.hull_posterior)
    return Posterior(trained(survey), ranges_of(survey), tuple(vessel), tuple(conditions), together.hull_posterior)


def _stored(candidate: Candidate, values: Floats, finding: Finding, survey: Survey) -> StoredEffect:
    source = Source(
        survey.motion.log,
        survey.recording.sha256,
        finding.probability,
        None,
        dict(finding.improvement),
        finding.unresolved_with,
    )
    # What is reported brings its own interval, the rest has none.
    return stored_effect(candidate, values, [nan] * len(candidate.parameters), finding.parameters, source)
