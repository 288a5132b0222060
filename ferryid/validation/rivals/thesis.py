"""The thesis's pipeline: SIMPLS on the lack-of-fit residual. It predicts and names nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ferryid.identify import fit_logs
from ferryid.models.prediction import Prediction, predict
from ferryid.reproduce.learning import THESIS
from ferryid.signals.prepare import Prepared
from ferryid.types import RunContext
from ferryid.validation.rivals.learner import SMOOTHER, WINDOW_S, LearnedModel
from ferryid.vessel.profile import Profile

SETTINGS = replace(THESIS, delta=1.0, sigma=1.0, window_s=WINDOW_S, smoother=SMOOTHER, draws=2)
"""The thesis's choices on the profile's own hull; its intervals are not used, so that hardly any blocks are drawn."""


def learn(log: str, profile: Profile, out: Path) -> LearnedModel:
    """Fit twelve components of the thesis's 21 functions.

    Parameters
    ----------
    log
        Path; parts of one recording joined by ``+``.
    profile
        The vessel.
    out
        Output folder, whose ``logs`` keep the ingested tables.

    Raises
    ------
    FerryIdError
        For a log that cannot be used.
    """
    model = fit_logs([log], profile, SETTINGS, RunContext(out)).model

    def expect(prepared: Prepared) -> Prediction:
        return predict(model, prepared, profile, window_s=WINDOW_S, smoother=SMOOTHER)

    coefficients = {
        f"{term} in {axis}": float(model.theta[k, j])
        for k, term in enumerate(model.terms)
        for j, axis in enumerate(("surge", "sway", "yaw"))
    }
    return LearnedModel("thesis", expect, coefficients=coefficients)
