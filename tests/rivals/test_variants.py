"""Variants of the weak form: each estimates with what it says, and not with what was worked out for another."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.rivals.simulated import KINDS, trial
from tests.rivals.task import Task
from tests.rivals.variants import VARIANTS


@pytest.mark.slow
def test_velocities_and_winds_of_a_variant_take_part_in_its_estimate(tmp_path: Path) -> None:
    (kind,) = (one for one in KINDS if one.plant == "simulator" and one.off == 0.1 and one.breeze)
    one = trial(kind, 0, tmp_path)
    task = Task.of(one.profile, [one.learn])
    found = {name: method(task, 0).theta for name, method in VARIANTS.items()}
    size = np.abs(found["as it is"]).max(axis=0)

    def change(name: str) -> float:
        return float(np.max(np.abs(found[name] - found["as it is"]) / size))

    velocities = sorted(change(name) for name in ("velocities as measured", "velocities steadied by positions"))
    # As it is, the fit takes one of the two.
    assert velocities[0] == 0.0
    others = ("noise-corrected products", "references as instruments", "no winds of single logs")
    assert min(velocities[1], *(change(one) for one in others)) > 0.02
