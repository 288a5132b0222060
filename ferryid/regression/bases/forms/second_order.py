"""Second-order modulus functions of a fully coupled vessel: every product of two velocities, with and without a modulus.

The thesis (5.6.4) names them as further work. Fedyaevsky and Sobolev (1963), Norrbin (1971) and Blanke (1981) write the force
of the water in second order in u, v and r, with a modulus where drag must change its sign, and each keeps the few terms of its
own ship. Here none is left out, for boats that are driven in every direction.

Decoupled, port and starboard are alike: |u|u, |v|u, |r|u and the products uu, vv, rr, vr act in surge, uv, ur and what has a
modulus and ends in v or r in sway and yaw. Ahead and astern need not be alike, nor bow and stern. Where a log has u of one sign
only, |u|u is uu, |u|v is uv and |u|r is ur but for that sign, and the fit shares an effect out between the two.
"""

from __future__ import annotations

from ferryid.regression.bases.term import Form, mirrored_terms

FORM = Form(
    "fully coupled second-order modulus",
    mirrored_terms(
        ("u_dot", "u_dot"),
        ("v_dot", "v_dot"),
        ("r_dot", "r_dot"),
        ("u", "u"),
        ("v", "v"),
        ("r", "r"),
        ("uu", "u u"),
        ("vv", "v v"),
        ("rr", "r r"),
        ("uv", "u v"),
        ("ur", "u r"),
        ("vr", "v r"),
        *((f"|{a}|{b}", f"|{a}| {b}") for a in "uvr" for b in "uvr"),
    ),
)
