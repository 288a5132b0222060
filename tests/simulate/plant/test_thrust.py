"""Tabulated thrust curves against the vessel layer's, and their inverses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.simulate.plant.thrust import curves_of, force_at, largest_force, speed_for
from ferryid.vessel.load import load_profile
from ferryid.vessel.profile import Actuator
from ferryid.vessel.thrusters import thrust

PROFILE = load_profile("milliampere")
CURVE = PROFILE.actuators[0].thrust


def only(**changes):
    return replace(PROFILE, actuators=(replace(PROFILE.actuators[0], **changes),))


def test_table_is_the_curve():
    curves = curves_of(PROFILE)
    for n in np.linspace(-1300.0, 1300.0, 301):
        assert force_at(curves, 1, n) == pytest.approx(thrust(CURVE, np.array([n]))[0][0], abs=1e-4)
    assert largest_force(curves, 0, True) == pytest.approx(496.82, abs=0.01)  # (4.1) at 1050 rpm, by hand
    assert largest_force(curves, 0, False) == pytest.approx(288.92, abs=0.01)  # and at -1050 rpm


def test_every_kind_of_curve():
    model = load_profile("kvlcc2-model").actuators[0]
    kinds = (
        (CURVE, {}),
        (load_profile("milliampere-2025").actuators[0].thrust, {}),
        (replace(CURVE, kind="quadratic", input_unit="rps", valid=(-10.0, 15.0), ahead=3.0, astern=2.0), {}),
        (replace(model.thrust, valid=(-10.0, 20.0), astern=0.2), model.inflow),
    )
    for curve, inflow in kinds:
        curves = curves_of(only(thrust=curve, inflow=inflow, count=2))
        share = 2.0 * (1.0 - inflow.get("thrust_deduction", 0.0))
        for n in np.linspace(-1200.0, 1300.0, 97):
            expected = thrust(curve, np.array([n]), diameter_m=inflow.get("diameter_m", np.nan))[0][0]
            assert force_at(curves, 0, n) == pytest.approx(share * expected, rel=2e-4, abs=2e-4)


def test_inverse_for_both_signs():
    curves = curves_of(PROFILE)
    for force in (0.0, 1.0, 57.3, 300.0, 495.0, -1.0, -57.3, -280.0):
        n = speed_for(curves, 0, force)
        assert force_at(curves, 0, n) == pytest.approx(force, abs=1e-9)
        assert n * force >= 0.0
    assert (speed_for(curves, 0, 1e4), speed_for(curves, 0, -1e4)) == (1050.0, -1050.0)


def test_inverse_stays_before_the_peak_of_a_falling_curve():
    falling = replace(CURVE, kind="table", valid=(0.0, 300.0), table=((0.0, 100.0, 300.0), (0.0, 50.0, 10.0)))
    curves = curves_of(only(thrust=falling))
    assert speed_for(curves, 0, 1e3) == pytest.approx(100.0, abs=0.1)
    assert speed_for(curves, 0, 25.0) == pytest.approx(50.0)
    assert (speed_for(curves, 0, -5.0), force_at(curves, 0, -50.0)) == (0.0, 0.0)


def test_direct_force_is_its_own_order():
    curves = curves_of(replace(PROFILE, actuators=(Actuator("left", "force", (0.0, 0.0)),)))
    assert (force_at(curves, 0, -123.0), speed_for(curves, 0, 77.0)) == (-123.0, 77.0)
    assert largest_force(curves, 0, True) == np.inf


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"thrust": None}, "thrust curve of thruster1"),
        ({"thrust": replace(CURVE, valid=(-np.inf, np.inf))}, r"has valid = \[lowest, highest\]"),
        ({"thrust": replace(CURVE, kind="open_water", input_unit="rps", table=((0.0, 1.0), (0.3, 0.0)))}, "diameter_m"),
    ],
)
def test_what_the_simulator_cannot_use_is_refused(changes, said):
    with pytest.raises(FerryIdError, match=said):
        curves_of(only(**changes))
