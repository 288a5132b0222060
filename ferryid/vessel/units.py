"""Units that a profile may name, by the kind of quantity that they measure, and their factors."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import Final

from ferryid.errors import did_you_mean

_TURN = 2.0 * math.pi

KINDS: Final = MappingProxyType(
    {
        "length": {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "ft": 0.3048, "nmi": 1852.0},
        "angle": {"rad": 1.0, "deg": math.pi / 180.0, "degE7": math.pi / 180.0e7},
        "speed": {"m/s": 1.0, "km/h": 1.0 / 3.6, "kn": 1852.0 / 3600.0, "ft/s": 0.3048, "mph": 0.44704},
        "rate": {
            "rad/s": 1.0,
            "deg/s": math.pi / 180.0,
            "deg/min": math.pi / 10800.0,
            "rpm": _TURN / 60.0,
        },
        "rotation": {"rpm": 1.0, "rps": 60.0, "rad/s": 60.0 / _TURN, "deg/s": 1.0 / 6.0},
        "force": {"N": 1.0, "kN": 1000.0, "kgf": 9.80665, "lbf": 4.4482216152605},
        "moment": {"N*m": 1.0, "kN*m": 1000.0, "kgf*m": 9.80665, "lbf*ft": 1.3558179483314004},
        "mass": {"kg": 1.0, "t": 1000.0, "lb": 0.45359237},
        "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
        "fraction": {"1": 1.0, "%": 0.01, "fraction": 1.0},
    }
)
"""Kind of quantity to unit name to factor. Canonical: m, rad, m/s, rad/s, rpm (rotation), N, N*m, kg, s, 1."""

_SPELLINGS: Final = MappingProxyType(
    {
        "metre": "m",
        "meter": "m",
        "metres": "m",
        "meters": "m",
        "degree": "deg",
        "degrees": "deg",
        "°": "deg",
        "1e-7 deg": "degE7",
        "radian": "rad",
        "radians": "rad",
        "knot": "kn",
        "knots": "kn",
        "kt": "kn",
        "kts": "kn",
        "kmh": "km/h",
        "kph": "km/h",
        "mps": "m/s",
        "RPM": "rpm",
        "r/min": "rpm",
        "rad/sec": "rad/s",
        "deg/sec": "deg/s",
        "°/s": "deg/s",
        "Nm": "N*m",
        "N m": "N*m",
        "N·m": "N*m",
        "kNm": "kN*m",
        "kN·m": "kN*m",
        "kilogram": "kg",
        "kilograms": "kg",
        "tonne": "t",
        "tonnes": "t",
    }
)

_ARTICLE = {"angle": "an angle", "rate": "a rate of turn", "rotation": "a propeller speed"}


def unit_name(unit: str) -> str:
    """Return the name used here for a unit that may be spelt in another usual way (``knots``, ``Nm``)."""
    return _SPELLINGS.get(unit, unit)


def unit_fault(unit: str, kind: str) -> str:
    """Say in one sentence why `unit` cannot measure a quantity of `kind`, or return an empty string.

    Parameters
    ----------
    unit
        Unit as written in a profile.
    kind
        A key of `KINDS`.
    """
    name = unit_name(unit)
    if name in KINDS[kind]:
        return ""
    usable = ", ".join(KINDS[kind])
    wanted = _ARTICLE.get(kind, f"a {kind}")
    others = [other for other, units in KINDS.items() if name in units]
    if others:
        measured = _ARTICLE.get(others[0], f"a {others[0]}")
        return f'unit "{unit}" measures {measured}, but this is {wanted}. Fix: use one of {usable}'
    every = {known for units in KINDS.values() for known in units}
    hint = did_you_mean(name, KINDS[kind]) or did_you_mean(name, every)
    return f'unknown unit "{unit}" for {wanted}.{hint} Fix: use one of {usable}'


def factor(unit: str, kind: str) -> float:
    """Return the factor from `unit` to the canonical unit of `kind`.

    Raises
    ------
    KeyError
        For a unit that `unit_fault` explains; profiles are checked before their factors are asked for.
    """
    return KINDS[kind][unit_name(unit)]
