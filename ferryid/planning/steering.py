"""Manoeuvres of a vessel that steers and cannot go sideways: orders to its actuators, in place of a path with headings."""

from __future__ import annotations

from dataclasses import dataclass

LASTS_S = 150.0
"""Length of a manoeuvre of a vessel of 5 m; others by Froude's law."""
LEAD_S = 20.0
"""Straight ahead before it."""
HOLD_S = 20.0
"""On each order of steps."""
SHARES = (0.5, 1.0, 1.5)
"""Of the usual orders, at which manoeuvres are drawn."""
ZIGZAGS = (10.0, 20.0, 35.0)
"""Helm, and change of heading that reverses it [deg]."""
CIRCLES = (-35.0, -15.0, 15.0, 35.0)
"""Helm of turning circles [deg]."""


@dataclass(frozen=True)
class Manoeuvre:
    """Orders straight to the actuators.

    Attributes
    ----------
    kind
        As in a scenario.
    share
        Order over the usual one.
    helm_deg, heading_deg
        Helm, and change of heading that reverses a zigzag's [deg].
    lead_s, hold_s, duration_s
        Straight ahead before it, time on each order of steps, and length [s].
    says
        What it is, as a part of a sentence.
    """

    kind: str
    share: float
    helm_deg: float
    heading_deg: float
    lead_s: float
    hold_s: float
    duration_s: float
    says: str


def manoeuvres(time: float) -> list[Manoeuvre]:
    """Return all manoeuvres, with times by a factor from those of a vessel of 5 m."""

    def made(kind: str, share: float, helm: float, heading: float, says: str) -> Manoeuvre:
        return Manoeuvre(kind, share, helm, heading, LEAD_S * time, HOLD_S * time, LASTS_S * time, says)

    found = []
    for share in SHARES:
        found += [made("zigzag", share, one, one, f"a {one:.0f}/{one:.0f} zigzag") for one in ZIGZAGS]
        for helm in CIRCLES:
            side = "starboard" if helm > 0.0 else "port"
            found.append(
                made("turning-circle", share, helm, 20.0, f"a circle to {side} with {abs(helm):.0f} deg of helm")
            )
        found.append(made("rpm-steps", share, 0.0, 20.0, "steps straight ahead and astern"))
    return found
