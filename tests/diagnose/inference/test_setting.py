"""Where logs are recorded: what is not there is not looked for, and what is rare there needs more evidence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference.campaign import conditions_of
from ferryid.diagnose.inference.estimation import estimation_problem, fit
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.search import list_candidates
from ferryid.diagnose.inference.weak_form import Windows, windows
from ferryid.effects.thresholds import EFFECTS
from ferryid.errors import FerryIdError
from ferryid.vessel import load_profile
from tests.diagnose.judging.test_held_out import sailed

FERRY = load_profile("milliampere")


def averaged(setting: str) -> Windows:
    measurements = sailed(60.0, np.zeros(2))
    return windows(replace(measurements, profile=replace(FERRY, setting=setting)), *window_lengths(FERRY))


@pytest.mark.parametrize(
    ("setting", "absent"), [("tank", {"wind", "gusts", "current"}), ("pond", set()), ("sea", set()), ("", set())]
)
def test_what_a_setting_does_not_have_is_not_looked_for(setting: str, absent: set[str]) -> None:
    candidates, untested = list_candidates(averaged(setting).measurements)
    assert absent.isdisjoint(one.effect.id for one in candidates)
    said = {effect for effect, reason in untested.items() if reason == "the profile's setting is a tank"}
    assert said == absent
    own = {one.effect.id for one in conditions_of(averaged(setting), replace(FERRY, setting=setting))}
    assert own == {"wind", "current"} - absent


def test_a_current_in_a_pond_needs_more_evidence() -> None:
    evidence = {}
    for setting in ("", "pond"):
        seen = averaged(setting)
        problem = estimation_problem(seen, *prior_force_model(seen.measurements, FERRY))
        for candidate in list_candidates(seen.measurements)[0]:
            if candidate.effect.id in ("current", "payload"):
                evidence[candidate.effect.id, setting] = fit(problem, [candidate]).evidence
    assert evidence["current", ""] - evidence["current", "pond"] == pytest.approx(EFFECTS.rarity)
    assert evidence["payload", ""] == pytest.approx(evidence["payload", "pond"])


def test_an_unknown_setting_is_a_fault_of_the_profile(tmp_path: Path) -> None:
    path = tmp_path / "boat.toml"
    path.write_text(FERRY.text.replace("title =", 'setting = "ponds"\ntitle =', 1), encoding="utf-8")
    with pytest.raises(
        FerryIdError, match=r'"setting" cannot be "ponds"\. Did you mean "pond"\? Fix: use one of harbour, pond'
    ):
        load_profile(path)
    path.write_text(FERRY.text.replace("title =", 'setting = "pond"\ntitle =', 1), encoding="utf-8")
    assert load_profile(path).setting == "pond"
