"""Effects that act row by row: in logs one after another they do what they do in each."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel, Measurements, hull_of
from ferryid.types import Floats
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force

FERRY = load_profile("milliampere")
NAMES = tuple(name for name, effect in effects().items() if effect.by_row)
LENGTHS = (30, 45)


def force_model(seed: int, rows: int, gust_std: float = 0.0) -> ForceModel:
    """Return a log of chance motion and forces, in water that moves."""
    rng = np.random.default_rng(seed)
    nu = rng.normal(size=(rows, 3)) * [1.0, 0.5, 0.2]
    angles = rng.uniform(-3.0, 3.0, (rows, 2))
    push = rng.uniform(-300.0, 300.0, (rows, 2)) * seed
    parts = np.zeros((rows, 2, 3))
    for k, actuator in enumerate(FERRY.actuators):
        x, y = actuator.position_m
        X, Y = push[:, k] * np.cos(angles[:, k]), push[:, k] * np.sin(angles[:, k])
        parts[:, k] = np.column_stack([X, Y, x * Y - y * X])
    eta = rng.normal(size=(rows, 3))
    measurements = Measurements(FERRY, 0.2 * np.arange(rows), eta, nu, nu, parts, angles, np.ones(rows, dtype=bool))
    still = wind_force(FERRY.wind, np.zeros((rows, 2)), measurements.psi, nu)  # type: ignore[arg-type]
    return ForceModel(
        measurements, hull_of(FERRY), parts, angles, still, flow=rng.normal(size=(rows, 2)), gust_std=gust_std
    )


def joined(one: ForceModel, other: ForceModel) -> ForceModel:
    """Return two logs one after another."""

    def both(a: object, b: object) -> object:
        long = isinstance(a, np.ndarray) and len(a) == len(one.measurements.t)
        return np.concatenate([a, b]) if long else a  # type: ignore[list-item]

    def whole(a: Measurements | ForceModel, b: Measurements | ForceModel) -> dict[str, object]:
        return {each.name: both(getattr(a, each.name), getattr(b, each.name)) for each in fields(a)}

    measurements = Measurements(**whole(one.measurements, other.measurements))  # type: ignore[arg-type]
    return ForceModel(**{**whole(one, other), "measurements": measurements})  # type: ignore[arg-type]


def moved(effect: str, share: float) -> Floats:
    every = effects()[effect].parameters_of(FERRY)
    start = np.array([one.neutral if one.start is None else one.start for one in every])
    return np.clip(start + share * np.array([one.size for one in every]), *np.array([(p.low, p.high) for p in every]).T)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("gust_std", [0.0, 1.5])
def test_logs_one_after_another_are_moved_as_each_by_itself(name: str, gust_std: float) -> None:
    effect = effects()[name]
    logs = [force_model(seed, rows, gust_std) for seed, rows in zip((1, 2), LENGTHS, strict=True)]
    values = [moved(name, 0.4)] * 2
    if effect.of_log:
        # Each log has its own of these, and all share the others.
        own = np.array([one.name in effect.of_log for one in effect.parameters_of(FERRY)])
        values = [values[0], np.where(own, moved(name, -0.7), values[0])]
    given = np.repeat(values, LENGTHS, axis=0) if effect.of_log else values[0]
    instance = effect.instances(FERRY)[0]
    together = effect.apply(joined(*logs), given, instance)
    apart = joined(*(effect.apply(one, p, instance) for one, p in zip(logs, values, strict=True)))
    for each in ("parts", "angles", "external", "flow", "load", "damping_factor", "hull"):
        there, expected = getattr(together, each), getattr(apart, each)
        assert (there is None) == (expected is None)
        if there is not None:
            np.testing.assert_allclose(there, expected, rtol=1e-12, atol=1e-9, err_msg=each)


def test_what_looks_along_the_log_does_not_act_row_by_row() -> None:
    assert {"wind", "current", "thruster_gain"} <= set(NAMES)
    assert not {"thruster_lag", "time_delay", "thruster_interaction"} & set(NAMES)


def test_winds_of_rows_must_be_as_many_as_these() -> None:
    log = force_model(1, 30)
    with pytest.raises(ValueError, match="30 rows with 29 winds"):
        effects()["wind"].apply(log, np.ones((29, 5)), None)


def test_a_log_and_a_copy_of_it_with_other_measurements_are_not_mixed_up() -> None:
    log = force_model(1, 30)
    other = replace(log, measurements=replace(log.measurements, nu=1.1 * log.measurements.nu))
    first, second = (effects()["wind"].apply(one, np.full((30, 5), 1.0), None).external for one in (log, other))
    assert not np.allclose(first, second)
