"""Waves: the sentence tells what is known of them."""

from __future__ import annotations

import pytest

from ferryid.effects import effects

EFFECT = effects()["waves"]
EVERY = {"peak_frequency": 0.4, "force_std": 61.6, "moment_std": 104.4, "time_constant": 6.0}


@pytest.mark.parametrize(
    ("known", "strength"),
    [
        (tuple(EVERY), "62 N and 104 N·m (standard deviations)"),
        (("peak_frequency", "force_std", "moment_std"), "62 N and 104 N·m (standard deviations)"),
        (("peak_frequency", "moment_std", "time_constant"), "104 N·m (standard deviation)"),
        (("peak_frequency", "force_std", "time_constant"), "62 N (standard deviation)"),
    ],
)
def test_the_sentence_tells_the_strengths_that_are_known(known: tuple[str, ...], strength: str) -> None:
    says = EFFECT.says({name: EVERY[name] for name in known}, None)
    assert says == f"Waves of 2.5 s pushed the vessel with {strength}, which nothing measured explains."
