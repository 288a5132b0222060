"""Structures compared by the weak form: a truth by its own logs, errors of fits from scratch, and what cannot be compared."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.identify import FitSettings
from ferryid.identify.outcome import EstimatorScore
from ferryid.identify.sweeps import settings_sweep, weak_structures
from ferryid.identify.sweeps.weak_sweep import folds_by_stretches
from tests.identify.test_structure_sweep import Run, find, logs_of, opened, run
from tests.identify.trials import measured

__all__ = ["opened", "run"]
WEAK = FitSettings(estimator="weak")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "structure"), [("modulus", "decoupled"), ("lift", "coupled")])
def test_a_truth_is_supported_by_its_own_logs(run: Run, name: str, structure: str) -> None:
    found = run(logs_of(name, structure), WEAK)
    one = found.by["blocks"]
    told = one.supported
    assert (told.basis, told.structure) == (name, structure)
    assert (found.tested, found.error, found.test_window_s) == ("overlapping window", "squared prediction error", 8.0)
    if structure == "coupled":
        assert not any(each.kept for each in one.structures if each.structure == "decoupled")


@pytest.mark.slow
def test_auto_takes_the_estimator_of_a_fit(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    logs = logs_of("modulus", "decoupled", seconds=400.0)
    plain = run(logs, WEAK)
    assert (plain.asked, plain.estimator_says) == ("weak", "")
    scores = (EstimatorScore("weak", 0.5, 0.5, True), EstimatorScore("derivative", 0.6, 0.6, False))
    chosen = SimpleNamespace(estimator="weak", why="", scores=scores, notes=())
    monkeypatch.setattr(settings_sweep, "estimator_for", lambda *_: chosen)
    found = run(logs, FitSettings())
    assert (found.asked, found.settings.estimator, found.estimators) == ("auto", "weak", scores)
    assert found.estimator_says.startswith("Estimator auto: the weak form was swept, which a fit uses")
    assert plain.by["blocks"].structures[0].score == found.by["blocks"].structures[0].score


@pytest.mark.slow
def test_noise_alone_supports_the_simplest(run: Run) -> None:
    one = run([measured(3, seconds=300.0, noise=200.0)], WEAK).by["blocks"]
    assert one.supported is one.simplest


@pytest.mark.slow
def test_errors_are_those_of_fits_to_the_other_folds(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """By hand: of one fold, the model of a fit to what trains in it, on the windows that it tests."""
    seen = []
    compared = weak_structures._Windows.cross_validated

    def kept(self: weak_structures._Windows, name: str, folds: object, block_s: float, steadied: bool) -> object:
        found = compared(self, name, folds, block_s, steadied)  # type: ignore[arg-type]
        seen.append((self, name, block_s, steadied, found))
        return found

    monkeypatch.setattr(weak_structures._Windows, "cross_validated", kept)
    swept = run(logs_of("modulus", "decoupled", seconds=400.0), replace(WEAK, components=9))
    windows, name, _, steadied, found = seen[0]
    total, count = np.zeros(3), 0
    for fold in folds_by_stretches(windows.judged, 5):
        ((low, high),) = fold.tested
        (log,) = windows.judged
        whole = log.parts[0].windows(steadied)
        inside = (whole.start >= low) & (whole.start + log.length <= high)
        estimate = weak_structures.estimate_correction(windows.data(fold), 9, 0, lambda _: None)
        theta, intercept = estimate.coefficients.theta, estimate.coefficients.intercept
        mass = windows.data().windows.base_mass
        terms = windows.functions.terms
        of = [terms.index(one) for one in ("u_dot", "v_dot", "r_dot")]
        functions = whole.basis(terms, whole.by_velocity)
        force = whole.base(whole.by_velocity) + functions @ theta + intercept
        heavier = mass + theta[of].T
        error = (whole.force - force) @ np.linalg.inv(heavier).T @ mass.T
        total += np.sum(error[inside] ** 2, axis=0)
        count += int(inside.sum())
    assert found.windows.sum() == count
    one = find(swept.by["blocks"], name, windows.settings.structure)
    assert one.mse == pytest.approx(total / count, rel=1e-6)
    assert found.tried.errors.sum(axis=0) == pytest.approx(total, rel=1e-6)


def test_logs_that_are_too_short_and_another_residual_are_refused(run: Run) -> None:
    short = [measured(1, seconds=60.0)]
    with pytest.raises(FerryIdError, match=r"in a fold\. Fix: .*--estimator derivative"):
        run(short, WEAK)
    found = run(short, FitSettings())
    assert found.settings.estimator == "derivative"
    assert "derivative's was swept" in found.estimator_says
    with pytest.raises(FerryIdError, match=r"--residual commanded: the weak form .*Fix: "):
        run([measured(1, seconds=300.0)], replace(WEAK, residual="commanded"))
