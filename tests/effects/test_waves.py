"""Waves: the sentence tells what is known of them."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from scipy.optimize import minimize

from ferryid.effects import effects
from ferryid.types import Floats
from ferryid.vessel import load_profile

EFFECT = effects()["waves"]
FERRY = load_profile("milliampere")
EVERY = {"peak_frequency": 0.4, "force_std": 61.6, "moment_std": 104.4, "time_constant": 6.0}


@pytest.mark.parametrize(
    ("known", "strength"),
    [
        (tuple(EVERY), "62 N and 104 N·m (standard deviations)"),
        (("peak_frequency", "force_std", "moment_std"), "62 N and 104 N·m (standard deviations)"),
        (("peak_frequency", "moment_std", "time_constant"), "104 N·m (standard deviation)"),
        (("peak_frequency", "force_std", "time_constant"), "62 N (standard deviation)"),
    ],
)
def test_the_sentence_tells_the_strengths_that_are_known(known: tuple[str, ...], strength: str) -> None:
    says = EFFECT.says({name: EVERY[name] for name in known}, None)
    assert (
        says == f"Waves pushed the vessel with {strength}, most at a period of 2.5 s, which nothing measured explains."
    )


@pytest.mark.parametrize(("peak", "periods"), [(1.0, 1.17), (3.3, 1.51)])
def test_a_sea_keeps_its_phase_for_longer_than_the_least(peak: float, periods: float) -> None:
    """The covariance of the process, fitted to the spectra of Pierson and Moskowitz and of JONSWAP by Whittle's likelihood."""
    f = np.linspace(0.02, 4.0, 2000)
    sigma = np.where(f <= 1.0, 0.07, 0.09)
    sea = f**-5.0 * np.exp(-1.25 * f**-4.0) * peak ** np.exp(-((f - 1.0) ** 2) / (2.0 * sigma**2))
    sea, floor = sea / sea.max(), 1e-3

    def deviance(logs: Floats) -> float:
        rate, centre, size = np.exp(-logs[0]), np.exp(logs[1]), np.exp(logs[2])
        sides = [rate / (rate**2 + (2.0 * pi * (f - sign * centre)) ** 2) for sign in (1.0, -1.0)]
        fitted = size * (sides[0] + sides[1]) + floor
        return float(np.sum(np.log(fitted) + (sea + floor) / fitted))

    best = minimize(deviance, np.zeros(3), method="Nelder-Mead", options={"maxiter": 2000})
    memory, centre = np.exp(best.x[:2])
    assert memory * centre == pytest.approx(periods, abs=0.02)
    values = {"peak_frequency": 0.4 * float(centre), "time_constant": float(memory) / 0.4}
    assert EFFECT.doubt(values, FERRY) == ""
    assert "a sea is coherent for longer" in EFFECT.doubt(
        values | {"time_constant": 0.8 / values["peak_frequency"]}, FERRY
    )
