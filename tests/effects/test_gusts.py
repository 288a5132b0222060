"""Gusts in words: how long one lasts is never nothing."""

from __future__ import annotations

import pytest

from ferryid.effects.gusts import says


@pytest.mark.parametrize(("seconds", "told"), [(8.4, "8 s"), (0.9, "0.9 s"), (0.23, "0.2 s")])
def test_a_gust_lasts_some_time(seconds: float, told: str) -> None:
    assert says({"std": 0.42, "time_constant": seconds}, None) == (
        f"The wind was gusty: 0.4 m/s about its mean, a gust lasting some {told}."
    )
