"""How large a velocity is of the slope of a position, which decides on its unit."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.draft.agreement import explained


@pytest.mark.parametrize("noise_mps", [0.0, 0.3, 0.6])
def test_noise_of_the_position_is_not_taken_for_size(noise_mps: float) -> None:
    """A velocity in km/h is 3.6 times the slope in m/s however noisy the slope is; knots would be 1.94 times."""
    rng, t = np.random.default_rng(5), np.arange(0.0, 600.0, 0.5)
    ahead, aside = 1.0 + 0.5 * np.sin(t / 20.0), 0.2 * np.cos(t / 11.0)
    noise = noise_mps * rng.standard_normal((2, t.size))
    share, size, _ = explained(3.6 * ahead, 3.6 * aside, ahead + noise[0], aside + noise[1])
    # Rows that agree least are left out, which takes a little of what noise there is for size.
    assert size == pytest.approx(3.6, rel=0.1)
    assert share <= 1.0
    assert share > (0.95 if noise_mps == 0.0 else 0.4)
