"""Lift and drag of a hull as a wing of low aspect ratio, with cross-flow drag.

The thesis (5.6.4) names as further work the model of Ross, Perez and Fossen (2007), A Novel Manoeuvring Model Based on
Low-Aspect-Ratio Lift Theory and Lagrangian Mechanics, IFAC CAMS. That paper was not at hand: its parts (added mass, lift and
drag of circulation, cross-flow drag in modulus form) are taken from Perez and Fossen's tutorial at the same conference, and the
terms of each part are derived as follows. Its fourth degree of freedom, roll, is left out.

- Added mass by Kirchhoff's equations: the accelerations, and the products vr, rr, uv, ur.
- Circulation: a station at x meets the water at the drift angle (v + x r)/u. Lift goes with that angle, and gives u(v + x r)
  across, uv and ur. Induced drag goes with the lift squared, and lift has a part along the hull: (v + x r)², vv, vr and rr in
  surge. The coefficients depend on the speed, in first order on u, and lift bends over with the angle in third order:
  uuv, uur, v^3, vvr, vrr and r^3 across, uvv, uvr, urr and u^3 in surge.
- Cross-flow drag, which sets in where lift breaks down: |v|v, |v|r, |r|v, |r|r.
- Resistance |u|u, and linear damping u, v, r, which slow vessels need.

Decoupled, port and starboard are alike.
"""

from __future__ import annotations

from ferryid.regression.bases.term import Form, mirrored_terms

FORM = Form(
    "low-aspect-ratio lift, induced drag and cross-flow drag",
    mirrored_terms(
        ("u_dot", "u_dot"),
        ("v_dot", "v_dot"),
        ("r_dot", "r_dot"),
        ("u", "u"),
        ("v", "v"),
        ("r", "r"),
        ("uv", "u v"),
        ("ur", "u r"),
        ("vv", "v v"),
        ("vr", "v r"),
        ("rr", "r r"),
        ("uvv", "u v v"),
        ("uvr", "u v r"),
        ("urr", "u r r"),
        ("u^3", "u u u"),
        ("uuv", "u u v"),
        ("uur", "u u r"),
        ("v^3", "v v v"),
        ("vvr", "v v r"),
        ("vrr", "v r r"),
        ("r^3", "r r r"),
        ("|u|u", "|u| u"),
        ("|v|v", "|v| v"),
        ("|r|r", "|r| r"),
        ("|v|r", "|v| r"),
        ("|r|v", "|r| v"),
    ),
)
