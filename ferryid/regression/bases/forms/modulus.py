"""The thesis's functions without the three that occur twice.

Aurlien (2021), (3.4): the terms of the hull model (2.3)-(2.14), which follows Blanke (1981), and the cubes of u, v and r. The
decoupled axes are those of that model; it has no lift, so that uv acts in yaw alone, as the Munk moment.
"""

from __future__ import annotations

from ferryid.regression.bases.term import SURGE, SWAY, YAW, Form, terms

_ACROSS = (SWAY, YAW)

LINEAR = terms(
    ("u_dot", "u_dot", (SURGE,)),
    ("v_dot", "v_dot", _ACROSS),
    ("r_dot", "r_dot", _ACROSS),
    ("uv", "u v", (YAW,)),
    ("ur", "u r", _ACROSS),
    ("vr", "v r", (SURGE,)),
    ("rr", "r r", (SURGE,)),
    ("u", "u", (SURGE,)),
    ("v", "v", _ACROSS),
    ("r", "r", _ACROSS),
)
"""Inertia, Coriolis and centripetal forces, linear damping."""
CUBIC = terms(
    ("u^3", "u u u", (SURGE,)),
    ("v^3", "v v v", _ACROSS),
    ("r^3", "r r r", _ACROSS),
)
AHEAD = terms(("|u|u", "|u| u", (SURGE,)))
ACROSS = terms(
    ("|v|v", "|v| v", _ACROSS),
    ("|r|r", "|r| r", _ACROSS),
    ("|v|r", "|v| r", _ACROSS),
    ("|r|v", "|r| v", _ACROSS),
)
"""Cross-flow drag in second-order modulus form."""

FORM = Form("the thesis's functions without duplicates", LINEAR + CUBIC + AHEAD + ACROSS)
