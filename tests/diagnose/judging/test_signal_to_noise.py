"""How large the velocity's noise is against the thrust, on a hull whose only force is linear damping in sway."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.claims import LogFigures
from ferryid.diagnose.judging.confidence_rules import drowned_axes, log_notes, noise_drowns_an_axis
from ferryid.diagnose.judging.signal_to_noise import velocity_noise_shares
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, Measurements
from tests.diagnose.trials import FERRY

MASS, DAMPING, THRUST_N, NOISE_MPS = 1000.0, 400.0, 100.0, 0.02
T = np.arange(20000) * 0.2
DROWNED = noise_drowns_an_axis.threshold or 0.0


def still(*, noise_mps: float = NOISE_MPS, damping: float = DAMPING, mass: float = MASS, placed: bool = True) -> Any:
    """Return the trial of a vessel that lies still, as its positions know, under a slow swing of sideways thrust."""
    nu = np.zeros((len(T), 3))
    nu[:, 1] = noise_mps * np.random.default_rng(3).standard_normal(len(T))
    parts = np.zeros((len(T), len(FERRY.actuators), 3))
    parts[:, 0, 1] = THRUST_N * np.sqrt(2.0) * np.sin(2.0 * np.pi * T / 200.0)
    eta = np.zeros((len(T), 3)) if placed else np.full((len(T), 3), [np.nan, np.nan, 0.0])
    measurements = Measurements(FERRY, T, eta, nu, nu, parts, parts[:, :, 0], np.ones(len(T), dtype=bool))
    hull = dict.fromkeys(COEFFICIENTS, 0.0) | {"m11": mass, "m22": mass, "m33": mass, "Y_v": -damping}
    seen = windows(measurements, 8.0, 2.0)
    plain = ForceModel(seen.measurements, np.array(list(hull.values())), parts, parts[:, :, 0], np.zeros((len(T), 3)))
    return SimpleNamespace(windows=seen, plain=plain)


def test_noise_times_damping_is_held_against_the_thrust() -> None:
    problem = still()
    # Independent errors of rows, averaged over 2 s, average out in a window by the root of the sum of squared weights; of two
    # equally noisy velocities each has half of the variance between them, and here one has all of it.
    share = np.sqrt(np.sum(np.convolve(problem.windows.weight * 0.2, np.full(11, 1.0 / 11.0)) ** 2))
    assert velocity_noise_shares(problem)["sway"] == pytest.approx(
        NOISE_MPS * DAMPING * share / np.sqrt(2.0) / THRUST_N, rel=0.05
    )
    assert list(velocity_noise_shares(problem)) == ["sway"], "nothing pushes along or turns"
    assert drowned_axes(LogFigures(velocity_noise=velocity_noise_shares(problem)), DROWNED) == {}


def test_mass_plays_no_part_and_noise_and_damping_do() -> None:
    once = velocity_noise_shares(still())["sway"]
    assert velocity_noise_shares(still(mass=3.0 * MASS))["sway"] == pytest.approx(once)
    assert velocity_noise_shares(still(noise_mps=3.0 * NOISE_MPS))["sway"] == pytest.approx(3.0 * once, rel=1e-3)
    assert velocity_noise_shares(still(damping=3.0 * DAMPING))["sway"] == pytest.approx(3.0 * once, rel=1e-3)


def test_an_axis_that_noise_drowns_is_told() -> None:
    figures = LogFigures(velocity_noise=velocity_noise_shares(still(noise_mps=20.0 * NOISE_MPS)))
    drowned = drowned_axes(figures, DROWNED)
    assert list(drowned) == ["sway"]
    (note,) = log_notes(figures)
    assert f"times damping, is {100.0 * drowned['sway']:.0f} % of what moves the vessel in sway" in note


def test_without_positions_nothing_is_known_of_the_noise() -> None:
    assert velocity_noise_shares(still(placed=False)) == {}
