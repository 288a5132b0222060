"""Units: values from the SI brochure and the definitions, and what is said of a wrong one."""

from __future__ import annotations

import math

import pytest

from ferryid.vessel.units import KINDS, factor, unit_fault


@pytest.mark.parametrize(
    ("unit", "kind", "expected"),
    [
        ("ft", "length", 0.3048),
        ("nmi", "length", 1852.0),
        ("km", "length", 1000.0),
        ("deg", "angle", math.pi / 180),
        ("degrees", "angle", math.pi / 180),
        ("kn", "speed", 0.514444444444),
        ("knots", "speed", 0.514444444444),
        ("km/h", "speed", 0.277777777778),
        ("deg/s", "rate", 0.017453292520),
        ("rpm", "rate", 0.104719755120),  # one turn a minute
        ("rps", "rotation", 60.0),
        ("rad/s", "rotation", 9.549296585514),
        ("kN", "force", 1000.0),
        ("kgf", "force", 9.80665),
        ("lbf", "force", 4.4482216152605),
        ("kN*m", "moment", 1000.0),
        ("Nm", "moment", 1.0),
        ("%", "fraction", 0.01),
    ],
)
def test_factor(unit: str, kind: str, expected: float) -> None:
    assert factor(unit, kind) == pytest.approx(expected, rel=1e-11)
    assert unit_fault(unit, kind) == ""


def test_every_kind_has_its_canonical_unit_with_factor_one() -> None:
    canonical = {"length": "m", "angle": "rad", "speed": "m/s", "rate": "rad/s", "rotation": "rpm", "force": "N"}
    canonical |= {"moment": "N*m", "mass": "kg", "time": "s", "fraction": "1"}
    assert set(canonical) == set(KINDS)
    assert all(factor(unit, kind) == 1.0 for kind, unit in canonical.items())


def test_unit_of_another_kind_is_named_as_such() -> None:
    assert unit_fault("deg", "length").startswith('unit "deg" measures an angle, but this is a length. Fix: ')


def test_unknown_unit_suggests_the_nearest() -> None:
    assert 'unknown unit "m/sec"' in unit_fault("m/sec", "speed")
    assert 'Did you mean "m/s"?' in unit_fault("m/sec", "speed")
