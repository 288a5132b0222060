"""A log whose positions no sensor measured is named before a model is fitted to it, not by a diagnosis alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ferryid.signals.prepare import open_track
from ferryid.vessel import load_profile


@pytest.mark.parametrize("noise_m", [0.0, 0.05])
def test_positions_reckoned_from_velocities_are_a_doubt_of_every_command(tmp_path: Path, noise_m: float) -> None:
    t = np.arange(600) * 0.5
    u, r = 3.0 + np.sin(0.05 * t), 0.02 * np.sin(0.03 * t)
    psi = np.cumsum(r) * 0.5
    v = -2.0 * r
    north = np.cumsum(u * np.cos(psi) - v * np.sin(psi)) * 0.5
    east = np.cumsum(u * np.sin(psi) + v * np.cos(psi)) * 0.5
    away = noise_m * np.random.default_rng(2).standard_normal((2, t.size))
    columns = {
        "tvec": t, "N": north + away[0], "E": east + away[1], "phi": 0.0 * t, "psi": np.degrees(psi) % 360.0, "u": u, "v": v,
        "r": np.degrees(r), "Azi": 5.0 * np.sin(0.03 * t), "RPM": 120.0 + 20.0 * np.sin(0.05 * t),
    }  # fmt: skip
    rows = "\n".join(",".join(f"{one:.12g}" for one in row) for row in zip(*columns.values(), strict=True))
    log = tmp_path / "trial.csv"
    log.write_text(f"{','.join(columns)}\n{rows}\n", encoding="utf-8")
    doubts = open_track(str(log), load_profile("gunnerus"), None).doubts
    said = [
        one
        for one in doubts
        if one.startswith("It is no recording of a vessel: each step of its positions is the speed")
    ]
    assert len(said) == (noise_m == 0.0)
