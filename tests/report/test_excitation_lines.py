"""How much the weakest combination of terms is excited, in words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ferryid.identify.outcome import Excitation
from ferryid.report.page import _excitation_lines


@pytest.mark.parametrize(
    ("weakest", "told"),
    [
        (0.0, "not excited at all, and 1 is below a thousandth of the strongest."),
        (1e-17, "not excited at all, and 1 is below a thousandth of the strongest."),
        (2e-4, "excited 0.0002 times as much as the strongest, and 1 is below a thousandth of the strongest."),
        (0.5, "excited 0.5 times as much as the strongest, and 0 are below a thousandth of the strongest."),
    ],
)
def test_what_is_nothing_but_rounding_is_not_excited(weakest: float, told: str) -> None:
    excitation = Excitation(np.array([1.0, weakest]), {}, 1.0, {}, np.ones(2))
    result: Any = SimpleNamespace(excitation=excitation, model=SimpleNamespace(terms=("u", "v")))
    assert _excitation_lines(result)[0] == f"2 basis terms; the weakest combination is {told}"
