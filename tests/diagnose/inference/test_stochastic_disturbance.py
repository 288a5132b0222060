"""Gusts and waves of simulated trials become states of the filter; where there are none, none are seen."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import read_measurements, window_lengths
from ferryid.diagnose.inference.estimation import Candidate, estimation_problem
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.search import Search, list_candidates, search
from ferryid.diagnose.inference.stochastic_disturbance import DisturbanceState, _is_identified
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.confidence_rules import absent_in_velocities
from ferryid.diagnose.judging.disturbance_findings import (
    _power_in_velocities,
    density,
    disturbance_claims,
    explained_by,
)
from ferryid.effects import effects
from ferryid.effects.effect import Process
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.types import Floats
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")
BASE = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner", dwell_s = 40 }
controller = { delta = 0.7, sigma = 0.7 }
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
"""
WIND = "north_mps = -3.2, east_mps = 2.4"
TRUE_GUST, TRUE_HZ = 0.8, 1.0 / 2.4
IMITATORS = ("wind", "gusts", "waves", "time_delay", "thruster_lag")
"""What chance disturbances are easily taken for in a closed loop; the whole library takes ten times as long."""


def found_in(environment: str, seed: int, folder: Path) -> Search:
    log = folder / "trial.mcap"
    write_log(simulate(parse_scenario(BASE + environment, "unsteady"), seed), log)
    measurements, _ = read_measurements(str(log), FERRY)
    seen = windows(measurements, *window_lengths(FERRY))
    plain, spread = prior_force_model(seen.measurements, FERRY)
    candidates, _ = list_candidates(seen.measurements)
    known = [one for one in candidates if one.effect.id in IMITATORS]
    assert {one.effect.id for one in known} == set(IMITATORS)
    return search(estimation_problem(seen, plain, spread), lambda stage: None, known=known)


def values_of(state: DisturbanceState) -> dict[str, float]:
    return dict(zip([one.name for one in state.candidate.parameters], state.values.tolist(), strict=True))


def spectrum_in(result: Search) -> Mapping[str, Floats]:
    """Return the figure of the only disturbance."""
    (claim,) = disturbance_claims(result.problem, result.fit, result.states, result.problem.windows.measurements)
    finding = claim.finding
    assert (np.diff(finding.evidence["frequency"]) > 0.0).all()
    return finding.evidence


@pytest.mark.parametrize("frequency_hz", [0.0, 0.4])
def test_the_spectrum_of_a_disturbance_is_the_transform_of_its_covariance(frequency_hz: float) -> None:
    process = Process(np.zeros((1, 3)), 0.8, 3.0, frequency_hz)
    t = np.linspace(0.0, 60.0, 60001)
    covariance = 0.8**2 * np.exp(-t / 3.0) * np.cos(2.0 * np.pi * frequency_hz * t)
    at = np.array([0.01, 0.1, 0.4, 0.7])
    # One-sided: four times the cosine transform over positive times.
    expected = [4.0 * np.trapezoid(covariance * np.cos(2.0 * np.pi * f * t), t) for f in at]
    np.testing.assert_allclose(density(process, at), expected, rtol=1e-3)


@pytest.mark.slow
def test_gusts_are_a_state_and_no_delay(tmp_path: Path) -> None:
    gusts = f"environment = {{ wind = {{ {WIND}, gust_std_mps = {TRUE_GUST}, gust_time_s = 8.0 }} }}\n"
    result = found_in(gusts, 5, tmp_path)
    assert [one.candidate.effect.id for one in result.states] == ["gusts"]
    assert abs(values_of(result.states[0])["std"] / TRUE_GUST - 1.0) < 0.25
    assert [one.effect.id for one in result.fit.candidates] == ["wind"]
    evidence = spectrum_in(result)
    slow = evidence["frequency"] < 0.1
    assert 0.5 < float(np.median(evidence["before"][slow] / evidence["explained"][slow])) < 3.0
    assert evidence["before"][slow].min() > 3.0 * np.median(evidence["before"][evidence["frequency"] > 0.5])


@pytest.mark.slow
def test_waves_are_a_state_and_no_delay(tmp_path: Path) -> None:
    waves = "waves = { significant_height_m = 0.12, peak_period_s = 2.4, direction_deg = 225.0 }"
    result = found_in(f"environment = {{ {waves} }}\n", 6, tmp_path)
    assert [one.candidate.effect.id for one in result.states] == ["waves"]
    assert abs(values_of(result.states[0])["peak_frequency"] / TRUE_HZ - 1.0) < 0.3
    assert not {one.effect.id for one in result.fit.candidates} & {"time_delay", "thruster_lag"}
    evidence = spectrum_in(result)
    for name in ("before", "explained"):
        assert abs(evidence["frequency"][np.argmax(evidence[name])] / TRUE_HZ - 1.0) < 0.3
    assert 0.2 < evidence["before"].max() / evidence["explained"].max() < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 6])
@pytest.mark.parametrize("wind", ["", f"environment = {{ wind = {{ {WIND} }} }}\n"], ids=["calm", "steady wind"])
def test_where_nothing_comes_and_goes_there_are_no_states(wind: str, seed: int, tmp_path: Path) -> None:
    result = found_in(wind, seed, tmp_path)
    assert result.states == ()
    assert [one.effect.id for one in result.fit.candidates] == (["wind"] if wind else [])


@pytest.mark.parametrize(("share", "unseen"), [(1.0, False), (30.0, False), (0.5, False), (0.05, True)])
def test_what_the_velocities_lack_is_unseen(share: float, unseen: bool) -> None:
    # A peak; far from it something else is stronger, which counts for nothing.
    frequency = np.linspace(0.05, 1.0, 96)
    peak = np.exp(-(((frequency - 0.45) / 0.02) ** 2))
    evidence = {"frequency": frequency, "explained": peak, "before": share * peak + 1.0 * (frequency < 0.2)}
    assert (_power_in_velocities(evidence) < (absent_in_velocities.threshold or 0.0)) == unseen


@pytest.mark.parametrize(("at_hz", "unseen"), [(0.35, False), (0.2, True)])
def test_a_peak_that_the_navigation_shifts_a_little_is_seen(at_hz: float, unseen: bool) -> None:
    """The narrow band of a disturbance of 0.4 Hz, with memory of 6 s, and as much power in the velocities elsewhere."""
    frequency = np.linspace(0.05, 1.0, 96)
    explained, before = (1.0 / (1.0 + (2.0 * np.pi * (frequency - peak) * 6.0) ** 2) for peak in (0.4, at_hz))
    share = _power_in_velocities({"frequency": frequency, "explained": explained, "before": before})
    assert (share < (absent_in_velocities.threshold or 0.0)) == unseen


def test_waves_slower_than_any_sea_are_none() -> None:
    ferry = load_profile("milliampere")
    waves = Candidate(effects()["waves"], None, effects()["waves"].parameters_of(ferry))
    values, widths = np.array([0.45, 60.0, 100.0, 6.0]), np.full(4, 0.1)
    assert _is_identified(waves, values, widths, 0.4)
    assert not _is_identified(waves, np.array([0.044, *values[1:]]), widths, 0.4)


@pytest.mark.parametrize(
    ("gain", "taken", "other"), [(60.0, "wind", "time_delay"), (7.9, "wind", ""), (60.0, "time_delay", "")]
)
def test_a_disturbance_is_explained_by_the_likeliest_effect_that_leaves_nothing_of_it(
    monkeypatch: pytest.MonkeyPatch, gain: float, taken: str, other: str
) -> None:
    wind, delay, gusts = (Candidate.of(effects()[name], None, FERRY) for name in ("wind", "time_delay", "gusts"))
    place = "ferryid.diagnose.judging.disturbance_findings"
    monkeypatch.setattr(f"{place}.fit", lambda problem, candidates, values: [one.effect.id for one in candidates])

    def left(
        problem: object, both: list[str], candidates: object, plain: object, initial: list[Any]
    ) -> tuple[Any, Any]:
        return problem, [] if "time_delay" in both else initial

    monkeypatch.setattr(f"{place}.fit_disturbances", left)
    values = np.ones(1)
    made: Any = SimpleNamespace(candidates=(wind,), values=(values,), keys=frozenset({(taken, None)}))
    ranked = [
        SimpleNamespace(candidate=one, gain=size, fit=SimpleNamespace(values=(values,)))
        for one, size in ((delay, gain), (wind, 5.0))
    ]
    log: Any = SimpleNamespace(
        estimated=SimpleNamespace(problem=SimpleNamespace(plain=None)),
        search=SimpleNamespace(rounds=(SimpleNamespace(ranked=ranked),)),
    )
    state: Any = SimpleNamespace(candidate=gusts)
    assert explained_by(log, made, state) == other
