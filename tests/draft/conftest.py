"""A trial that logs of autopilots are written of."""

from __future__ import annotations

import numpy as np
import pytest

from tests.draft.test_draft import Columns, sailed


@pytest.fixture(scope="module")
def trial() -> Columns:
    """A trial with velocity over ground, and latitude and longitude near Trondheim [deg]."""
    made = sailed(120.0)
    u, v, psi = made["u"], made["v"], made["psi"]
    # Measured: positions that are the velocities' sum to the last digit would be reckoned.
    made["N"], made["E"] = 1e-3 * np.random.default_rng(5).standard_normal((2, len(u))) + [made["N"], made["E"]]
    made["vn"], made["ve"] = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    made["lat"] = 63.4 + np.degrees(made["N"] / 6.371e6)
    made["lon"] = 10.4 + np.degrees(made["E"] / (6.371e6 * np.cos(np.radians(63.4))))
    return made
