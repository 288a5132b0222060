"""The model that is stored is estimated from all rows, once one of the training rows alone was judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.identify.outcome import FitOutcome
from ferryid.identify.pipeline import fit_opened
from ferryid.identify.settings import FitSettings
from ferryid.models import Model
from ferryid.regression.bases import make_basis
from ferryid.signals.prepare import Opened, open_track
from ferryid.signals.smooth import Measured
from ferryid.types import RunContext
from ferryid.vessel import load_profile
from tests.identify.rounds import motion
from tests.identify.trials import measured

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
PROFILE = load_profile("milliampere")
SETTINGS = FitSettings(delta=0.4, sigma=0.4, draws=40, estimator="weak", weak_window_s=4.0)
SECONDS = 480.0


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Opened:
    return open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path_factory.mktemp("out"))


def fitted(opened: Opened, *logs: Measured, **settings: object) -> FitOutcome:
    known = replace(SETTINGS, **settings)  # type: ignore[arg-type]
    some = [replace(opened, measured=log) for log in logs]
    return fit_opened(some, PROFILE, known.on(PROFILE), RunContext(Path("nowhere")), "fit")


@pytest.fixture(scope="module")
def outcome(opened: Opened) -> FitOutcome:
    return fitted(opened, measured(1, seconds=SECONDS, noise=20.0, jitter=0.05))


def test_held_out_rows_reach_the_model_and_not_what_is_judged(opened: Opened, outcome: FitOutcome) -> None:
    log = measured(1, seconds=SECONDS, noise=20.0, jitter=0.05)
    (rows,) = (one.validation for one in outcome.logs)
    # A thrust of another strength in the middle of the stretches, so that no training window sees it.
    altered = replace(log, tau=np.where(rows[:, None], 1.1, 1.0) * log.tau)
    other = fitted(opened, altered)
    np.testing.assert_allclose(other.judged.theta, outcome.judged.theta, rtol=1e-6, atol=1e-6)
    assert not np.allclose(other.model.theta, outcome.model.theta, rtol=1e-2)
    assert outcome.model.settings["estimated_from"] == "all rows"
    assert "estimated_from" not in outcome.judged.settings
    assert outcome.model.training[0]["rows"] > 1.4 * outcome.judged.training[0]["rows"]
    assert np.isnan(outcome.judged.covariance).all()
    assert outcome.model.scores == outcome.judged.scores == outcome.scores


def test_the_model_is_that_of_a_fit_to_all_rows(opened: Opened, outcome: FitOutcome) -> None:
    log = measured(1, seconds=SECONDS, noise=20.0, jitter=0.05)
    whole = fitted(opened, log, measured(2, seconds=60.0), split="logs", components=outcome.curve.chosen)
    # There the second log validates, and all rows of the first one train.
    assert whole.model is whole.judged
    np.testing.assert_allclose(outcome.model.theta, whole.model.theta, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(outcome.model.low, whole.model.low, rtol=1e-9, atol=1e-9)


def test_more_rows_leave_less_error_of_the_force_on_another_log(opened: Opened) -> None:
    other = motion(99, seconds=240.0)
    exact = fitted(opened, measured(0, seconds=SECONDS)).model
    X = make_basis("modulus").of(other)

    def error(model: Model) -> float:
        return float(np.mean((X @ (model.theta - exact.theta) + model.intercept - exact.intercept) ** 2))

    logs = (measured(seed, seconds=240.0, noise=100.0, jitter=0.05) for seed in range(1, 7))
    found = [fitted(opened, log, draws=1, split="blocks") for log in logs]
    # Half as many rows again leave two thirds of the variance, were they as much to each other as to these coefficients.
    ratio = [np.log(error(one.model) / error(one.judged)) for one in found]
    assert float(np.mean(ratio)) < -0.1


def test_the_derivative_is_refitted_too(opened: Opened) -> None:
    log, settings = measured(1, noise=20.0), {"estimator": "derivative", "draws": 5, "components": 6}
    found = fitted(opened, log, **settings)
    whole = fitted(opened, log, measured(2, seconds=60.0), split="logs", **settings)
    np.testing.assert_allclose(found.model.theta, whole.model.theta, rtol=1e-9, atol=1e-9)
    assert not np.allclose(found.judged.theta, whole.model.theta, rtol=1e-2)


def test_every_kth_row_held_out_stays_out(opened: Opened) -> None:
    found = fitted(opened, measured(1, noise=20.0), estimator="derivative", split="every-kth", draws=5, components=6)
    assert found.model is found.judged
    assert "estimated_from" not in found.model.settings
