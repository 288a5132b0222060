"""Effects of an actuator and a push, stored in a model file and read again: what they do to the force of a log, by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.effects.actuator_force import along, force_limits, speed_limits
from ferryid.effects.force_model import ForceModel, Measurements, hull_of
from ferryid.models.forces.model_forces import ModelForces
from ferryid.models.model import Model
from ferryid.models.store.versions import load_file, save
from ferryid.models.stored_effect import Conditions
from ferryid.types import Floats
from ferryid.vessel.thrusters import force_at
from tests.models.test_stored_effect import FERRY, HERE, diagnosed, stored

AHEAD, ASTERN = force_limits(FERRY.actuators[0])
TURNS = speed_limits(FERRY.actuators[0])[0]
SHARES = np.array([0.01, 0.3, 0.8, -0.5])
"""Of the largest force of the first thruster in that direction; it points ahead, and the vessel to the east."""


def log() -> ForceModel:
    n, k = len(SHARES), len(FERRY.actuators)
    parts = np.zeros((n, k, 3))
    force = SHARES * np.where(SHARES < 0.0, ASTERN, AHEAD)
    parts[:, 0] = force_at(FERRY.actuators[0], force, 0.0)
    zero, east = np.zeros((n, 3)), np.tile([0.0, 0.0, np.pi / 2.0], (n, 1))
    seen = Measurements(FERRY, np.arange(float(n)), east, zero, zero, parts, np.zeros((n, k)), np.ones(n, dtype=bool))
    return ForceModel(seen, hull_of(FERRY), parts, seen.angles, zero)


def again(model: Model, folder: Path) -> ForceModel:
    """Store a model, read it, and return the force model of the log with its effects."""
    decoupled = replace(model, settings={**model.settings, "structure": "decoupled"}, theta=0.0 * model.theta)
    found = ModelForces(load_file(save(decoupled, folder).path)).altered(log(), HERE)
    assert found.idle == ()
    assert len(found.acting) == 1
    return found.force_model


@pytest.mark.parametrize(
    ("effect", "values", "left"),
    [
        ("dead_band", {"ahead": 0.2 * TURNS}, [0.0, 0.3, 0.8, -0.5]),
        ("astern_asymmetry", {"factor": 0.6}, [0.01, 0.3, 0.8, -0.3]),
        ("thrust_saturation", {"ahead": 0.5 * AHEAD, "astern": 0.25 * ASTERN}, [0.01, 0.3, 0.5, -0.25]),
        ("ventilation", {"factor": 0.5, "from": 40.0}, [0.01, 0.3, 0.4, -0.25]),
    ],
)
def test_a_stored_loss_of_an_actuator_acts_in_a_log(
    effect: str, values: dict[str, float], left: list[float], tmp_path: Path
) -> None:
    own = stored(effect, "thruster1", **values)
    after = again(replace(diagnosed(), vessel_effects=(own,), conditions=()), tmp_path)
    most: Floats = np.where(np.array(left) < 0.0, ASTERN, AHEAD)
    np.testing.assert_allclose(along(after, 0), np.array(left) * most, atol=1e-6)
    np.testing.assert_array_equal(after.parts[:, 1:], 0.0)


def test_a_stored_push_acts_in_its_own_log_while_it_lasted(tmp_path: Path) -> None:
    push = stored("external_push", onset_s=1.0, north=-30.0, east=40.0, moment=7.0)
    push = replace(push, sources=(replace(push.sources[0], offset_s=3.0),))
    model = replace(diagnosed(), vessel_effects=(), conditions=(Conditions("trial", HERE, (push,)),))
    after = again(model, tmp_path)
    # To the east is ahead, to the north is to port.
    acting = [40.0, 30.0, 7.0]
    np.testing.assert_allclose(after.external, [[0.0] * 3, acting, acting, [0.0] * 3], atol=1e-9)
    assert "50 N towards 127 deg" in push.says(HERE)
    assert "began at 1 s and ended at 3 s" in push.says(HERE)
