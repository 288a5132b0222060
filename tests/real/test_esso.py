"""Controls of the campaign page: conditions on a heading that the vessel did not have."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ferryid.diagnose.data import read_measurements
from ferryid.diagnose.inference import Candidate, prior_force_model
from ferryid.diagnose.inference.candidate import OtherHeading
from ferryid.effects import effects
from ferryid.vessel import load_profile
from tests.real.esso import acting

SHORT = str(Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap")
FERRY = load_profile("milliampere")


def test_a_control_acts_on_the_other_heading_and_its_placebo_on_another_still() -> None:
    measurements, _ = read_measurements(SHORT, FERRY)
    plain, _ = prior_force_model(measurements, FERRY)
    wind, p = Candidate.of(effects()["wind"], None, FERRY), np.array([3.0, -2.0])
    mirrored = acting(wind, np.negative)
    true, control = (one.act(plain, p).external for one in (wind, mirrored))
    assert not np.allclose(true, control)
    expected = OtherHeading(-measurements.psi).acted(lambda other: wind.act(other, p), plain).external
    np.testing.assert_allclose(control, expected)
    assert not mirrored.effect.by_row
