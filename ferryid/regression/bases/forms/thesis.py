"""The thesis's 21 functions, (3.4), in its order: three pairs of them are identical columns."""

from __future__ import annotations

from ferryid.regression.bases.forms.modulus import ACROSS, AHEAD, CUBIC, LINEAR
from ferryid.regression.bases.term import SURGE, SWAY, YAW, Form, terms

_SIGNED = terms(
    ("sgn(u)u^2", "|u| u", (SURGE,)),
    ("sgn(v)v^2", "|v| v", (SWAY, YAW)),
    ("sgn(r)r^2", "|r| r", (SWAY, YAW)),
)

FORM = Form("the thesis's 21 functions, three pairs of them alike", LINEAR + _SIGNED + CUBIC + AHEAD + ACROSS)
