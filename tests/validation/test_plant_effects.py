"""Effects of the plant: one file each, found where it lies."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.validation.case_sampling import LEVELS, cells, sample_cases
from ferryid.validation.log_generation import generate
from ferryid.validation.oracle import oracle
from ferryid.validation.plant import effects
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.plant.trial import simulate_trial
from ferryid.validation.plant.vessels import FERRY
from ferryid.vessel import load_profile

NAME = "yaw_rate_bias"
FILE = '''"""A gyro with a constant error."""

import numpy as np

from ferryid.validation.plant.effects.effect import PlantEffect, injection, random_sign

BLOCKS = 20


def sample(size, vessel, rng, span):
    bias = size * random_sign(rng)
    return injection("yaw_rate_bias", {"bias": bias}, {"yaw_rate_bias_degps": bias})


def act(plant, conditions, rng):
    bias = np.radians(conditions["yaw_rate_bias_degps"])

    def report(pose):
        pose[5] += bias

    if bias != 0.0:
        plant.reports.append(report)


def oracle(measurements):
    from ferryid.diagnose.data.estimate import Estimate
    from ferryid.validation.oracle_sensors import SensorEstimate, gain_of_score

    edges = np.linspace(0, len(measurements.t) - 1, BLOCKS + 1).astype(int)
    heading = np.unwrap(measurements.psi)
    off = [
        np.degrees(np.trapezoid(measurements.nu_raw[a : b + 1, 2], measurements.t[a : b + 1]) - (heading[b] - heading[a]))
        / (measurements.t[b] - measurements.t[a])
        for a, b in zip(edges[:-1], edges[1:])
    ]
    bias, error = float(np.mean(off)), float(np.std(off, ddof=1) / np.sqrt(BLOCKS))
    estimate = Estimate(bias, bias - 2.1 * error, bias + 2.1 * error, "deg/s")
    return SensorEstimate(gain_of_score(abs(bias) / error, BLOCKS - 1), 1, {"bias": estimate})


EFFECT = PlantEffect(
    "yaw_rate_bias",
    "deg/s",
    (0.01, 1.0),
    0.3,
    sample,
    settings={"yaw_rate_bias_degps": 0.0},
    act=act,
    oracle=oracle,
)
'''


@pytest.fixture
def added(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Put one more file beside those of the package."""
    folder = tmp_path / "effects"
    folder.mkdir()
    (folder / f"{NAME}.py").write_text(FILE, encoding="utf-8")
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(folder)])
    plant_effects.cache_clear()
    yield
    plant_effects.cache_clear()
    sys.modules.pop(f"{effects.__name__}.{NAME}", None)


@pytest.mark.slow
@pytest.mark.usefixtures("added")
def test_an_effect_is_added_by_one_file(tmp_path: Path) -> None:
    assert list(plant_effects())[-1] == NAME
    assert [cell.title for cell in cells() if cell.name == NAME] == [f"{NAME}, five sizes"]
    cases = sorted(sample_cases(5, 1.0, [NAME]), key=lambda case: case.size)
    assert [case.level for case in cases] == list(range(LEVELS))
    assert {case.truths[0].effect for case in cases} == {NAME}

    # Its physics act in the plant,
    bias = cases[-1].truths[0].values["bias"]
    without, biased = (simulate_trial(FERRY, given, "short", 3) for given in ({}, {"yaw_rate_bias_degps": bias}))
    assert np.degrees(biased.reported[0, 5] - without.reported[0, 5]) == pytest.approx(bias)

    # and the oracle estimates it from the log.
    made = generate(replace(cases[-1], path="short"), tmp_path / "log")
    (found,) = oracle(str(made.log), load_profile(made.profile), cases[-1].truths).recovered
    assert found.named
    # The plant's gyro has errors of its own, of a hundredth of a degree per second.
    assert found.parameters["bias"].value == pytest.approx(bias, rel=0.05)


def test_without_its_file_there_is_no_such_effect() -> None:
    assert NAME not in plant_effects()
    with pytest.raises(ValueError, match="no effect of the plant has the settings yaw_rate_bias_degps"):
        simulate_trial(FERRY, {"yaw_rate_bias_degps": 1.0}, "short", 3)


def test_effects_keep_their_order_as_the_cases_of_a_seed_depend_on_it() -> None:
    ranks = [effect.rank for effect in plant_effects().values()]
    assert ranks == sorted(set(ranks))
