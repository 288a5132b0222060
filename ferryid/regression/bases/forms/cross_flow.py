"""Cross-flow drag as an integral along the hull, in the place of the modulus functions that approximate it.

A station at x is drawn through the water sideways at v + x r, and the force on it is that of a cylinder:
``Y = ½ rho T Cd ∫|v + x r|(v + x r) dx`` and ``N = ½ rho T Cd ∫ x |v + x r|(v + x r) dx``; Faltinsen (1990), chapter 6, and
Fossen (2021), section 6.7. Draught and Cd are constant over each half of the hull, and may differ between fore and aft. The
coefficient of an integral is then ½ rho T Cd of that half, in sway for the force and in yaw for the moment.

The hull reaches from -L/2 to L/2 about the body origin. L is `length_m` of the profile, and stands in the name of a
fitted basis: ``cross-flow-5m``. The other functions are those of `modulus` without its cubes.
"""

from __future__ import annotations

from ferryid.regression.bases.forms.modulus import AHEAD, LINEAR
from ferryid.regression.bases.term import SWAY, YAW, Form, terms

FORM = Form(
    "cross-flow drag integrated along the hull",
    LINEAR
    + AHEAD
    + terms(
        ("fore |v+xr|(v+xr)", "fore", (SWAY,)),
        ("aft |v+xr|(v+xr)", "aft", (SWAY,)),
        ("fore x|v+xr|(v+xr)", "x_fore", (YAW,)),
        ("aft x|v+xr|(v+xr)", "x_aft", (YAW,)),
    ),
)
