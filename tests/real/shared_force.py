"""A steady force and moment that all runs of a campaign share, as of a propeller's side force, beside their winds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.inference.campaign_estimation import CampaignFit, estimate_campaign
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.force_errors import mass_of
from ferryid.effects import effects
from ferryid.effects.effect import Parameter
from ferryid.effects.force_model import COEFFICIENTS, ForceModel

Floats = NDArray[np.float64]

SIZES = (0.1, 0.3, 1.0, 3.0, 10.0)
"""How large the force is believed to be, in spreads of the steady accelerations between runs: that of most evidence counts."""
FARTHEST = 100.0
"""Limit of its search, in sizes: none that acts."""
DAMPING = COEFFICIENTS.index("Y_v")


@dataclass(frozen=True)
class SharedForce:
    """What a steady force of the vessel explains beside the wind of every run.

    Attributes
    ----------
    evidence
        What it gains beside the estimated winds [nat].
    winds
        Of each run beside it, north and east [m/s], shape (runs, 2).
    beside_measured
        What it gains where the measured wind blows over time in the place of an estimated one [nat].
    damping
        Linear sway damping Y_v of the hull beside the estimated winds, and beside the measured one [kg/s].
    """

    evidence: float
    winds: Floats
    beside_measured: float
    damping: tuple[float, float]


def shared_force(test: CampaignFit, measured: Campaign) -> SharedForce:
    """Return what a steady force of all runs explains; `measured` are the runs in the measured wind, with no other."""
    known = estimate_campaign(measured, noise=test.noise)
    best = _best(test.campaign, test)
    return SharedForce(
        evidence=best.evidence - test.evidence,
        winds=np.array([best.condition(i, 0)[0] for i in range(len(best.parts))]),
        beside_measured=_best(measured, known).evidence - known.evidence,
        damping=(float(test.belief()[0][DAMPING]), float(known.belief()[0][DAMPING])),
    )


def _best(campaign: Campaign, plain: CampaignFit) -> CampaignFit:
    """Return the estimate with such a force, of the size that has the most evidence under the noise without."""
    force = mass_of(plain.force_model(0).hull) @ np.array([0.0, *plain.spreads.steady[1:]])
    tried = [
        estimate_campaign(replace(campaign, properties=(_candidate(size * np.abs(force[1:])),)), noise=plain.noise)
        for size in SIZES
    ]
    return max([plain, *tried], key=lambda one: one.evidence)


def _candidate(sizes: Sequence[float] | Floats) -> Candidate:
    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        external = force_model.external.copy()
        external[:, 1:] += p
        return replace(force_model, external=external)

    parameters = tuple(
        Parameter(name, unit, float(size), -FARTHEST * float(size), FARTHEST * float(size))
        for name, unit, size in zip(("force", "moment"), ("N", "N·m"), sizes, strict=True)
    )
    effect = replace(effects()["azimuth_offset"], id="steady_force", apply=apply)
    return Candidate(effect, None, parameters)
