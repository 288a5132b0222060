"""What to record so that two explanations come apart."""

from __future__ import annotations

from collections.abc import Collection

TURN = "a slow turn on the spot through all headings, then straight runs at several speeds both ways"
STEPS = "steps of the thrusters' speed from rest, straight ahead and astern"
SINGLE = "each thruster alone, ahead and astern, at several speeds"
ACCELERATE = "hard acceleration and turning at low speed, and long straight runs at constant speed"

PAIRS: tuple[tuple[frozenset[str], str], ...] = (
    (frozenset({"wind", "current"}), TURN),
    (frozenset({"wind", "mooring"}), "station keeping at places far apart, at the same headings"),
    (frozenset({"current", "mooring"}), "station keeping at places far apart, at the same headings"),
    (frozenset({"thruster_lag", "time_delay"}), STEPS),
    (frozenset({"payload", "thruster_gain"}), ACCELERATE),
    (frozenset({"payload", "fouling"}), ACCELERATE),
    (frozenset({"fouling", "thrust_inflow_loss"}), "coasting to a stop from full speed with the thrusters off"),
    (frozenset({"thruster_gain", "azimuth_offset"}), SINGLE),
    (frozenset({"thruster_gain", "thruster_interaction"}), SINGLE),
    (frozenset({"thruster_gain"}), SINGLE),
    (frozenset({"azimuth_offset"}), SINGLE),
)


def manoeuvre(effect: str, rivals: Collection[str]) -> str | None:
    """Return what to record to tell an effect from its rivals; None where there is nothing to tell apart."""
    if not rivals:
        return None
    for rival in rivals:
        pair = frozenset({effect, rival})
        for known, text in PAIRS:
            if pair == known:
                return text
    return "a calibration run that excites every axis at many headings, such as the 12-corner path"
