"""Where logs are recorded: what is not there is not looked for, and what is rare there needs more evidence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference import stochastic_disturbance
from ferryid.diagnose.inference.campaign import conditions_of
from ferryid.diagnose.inference.estimation import Candidate, choose_parameters, estimation_problem, fit
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.search import list_candidates
from ferryid.diagnose.inference.stochastic_disturbance import fit_disturbances
from ferryid.diagnose.inference.weak_form import Windows, windows
from ferryid.diagnose.judging.detection_power import detection_powers
from ferryid.diagnose.pipeline import DiagnosisSettings
from ferryid.effects import effects
from ferryid.effects.thresholds import EFFECTS
from ferryid.errors import FerryIdError
from ferryid.vessel import load_profile
from ferryid.vessel.profile import SETTINGS
from tests.diagnose.judging.test_held_out import sailed

FERRY = load_profile("milliampere")
ODDS = {
    "wind": {"pond": -1, "harbour": -1, "sea": -1},
    "current": {"pond": 1, "sea": -1},
    "waves": {"tank": 1, "pond": 1, "sea": -1},
    "mooring": {"tank": 1, "pond": 1, "harbour": -1, "sea": 1},
    "shallow_water": {"tank": 1, "pond": -1, "harbour": -1, "sea": 1},
}
"""Where an effect is rare (1) and common (-1)."""


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
    # A campaign's conditions have the odds of the setting, too.
    own = conditions_of(averaged(setting), replace(FERRY, setting=setting))
    assert {one.effect.id for one in own} == {"wind", "current"} - absent
    shifts = {1: EFFECTS.rarity, 0: 0.0, -1: -EFFECTS.commonness}
    assert all(one.log_alternatives == shifts[ODDS[one.effect.id].get(setting, 0)] for one in own)


@pytest.mark.parametrize("setting", ["", *SETTINGS])
def test_prior_odds_are_those_of_the_setting(setting: str) -> None:
    """All effects that the setting decides on, and none that it has no say in."""
    there = replace(FERRY, setting=setting)
    shift = {-1: -EFFECTS.commonness, 0: 0.0, 1: EFFECTS.rarity}
    found = {
        one.id: Candidate.of(one, None, there).log_alternatives
        for one in effects().values()
        if setting not in one.absent_in
    }
    assert found == {name: shift[ODDS.get(name, {}).get(setting, 0)] for name in found}


FAINT = 0.005
"""Of the usual size: what a log of a minute without much noise finds with an even chance."""


@pytest.mark.slow
@pytest.mark.parametrize(("setting", "odds"), [("pond", EFFECTS.rarity), ("sea", -EFFECTS.commonness)])
def test_a_current_needs_the_evidence_of_its_setting(setting: str, odds: float) -> None:
    evidence, chances = {}, {}
    for where in ("", setting):
        seen = averaged(where)
        problem = estimation_problem(seen, *prior_force_model(seen.measurements, FERRY))
        for candidate in list_candidates(seen.measurements)[0]:
            if candidate.effect.id in ("current", "payload", "shallow_water"):
                chosen = choose_parameters(problem, fit(problem, ()), candidate)
                evidence[candidate.effect.id, where] = fit(problem, [chosen]).evidence
            if candidate.effect.id == "current":
                parameters = tuple(replace(one, size=FAINT * one.size) for one in candidate.parameters)
                (power,) = detection_powers(problem, fit(problem, ()), [replace(candidate, parameters=parameters)])
                chances[where] = power.chance
    assert evidence["current", ""] - evidence["current", setting] == pytest.approx(odds)
    assert evidence["payload", ""] == pytest.approx(evidence["payload", setting])
    # What is chosen in view of the log keeps the odds of its setting.
    shallow = {"pond": -EFFECTS.commonness, "sea": EFFECTS.rarity}[setting]
    assert evidence["shallow_water", ""] - evidence["shallow_water", setting] == pytest.approx(shallow)
    assert (chances[""] > chances[setting]) == (odds > 0.0)


@pytest.mark.slow
def test_waves_have_the_odds_of_their_setting(monkeypatch: pytest.MonkeyPatch) -> None:
    """The log evidence of a state of the filter, too, is more at sea and less in a pond."""
    monkeypatch.setattr(stochastic_disturbance, "_is_identified", lambda *given: True)
    gains = {}
    for setting in ("", "pond", "sea"):
        seen = averaged(setting)
        problem = estimation_problem(seen, *prior_force_model(seen.measurements, FERRY))
        waves = Candidate.of(effects()["waves"], None, seen.measurements.profile)
        _, states = fit_disturbances(problem, fit(problem, ()), [waves], problem.plain, -1e9)
        gains[setting] = states[0].gain
    assert gains[""] - gains["pond"] == pytest.approx(EFFECTS.rarity)
    assert gains["sea"] - gains[""] == pytest.approx(EFFECTS.commonness)


def test_an_option_takes_the_place_of_the_profiles_setting() -> None:
    pond = replace(FERRY, setting="pond")
    assert DiagnosisSettings().recorded(pond) is pond
    assert DiagnosisSettings(setting="sea").recorded(pond).setting == "sea"
    with pytest.raises(
        FerryIdError, match=r'there is no setting "harbor"\. Did you mean "harbour"\? Fix: use one of tank'
    ):
        DiagnosisSettings(setting="harbor").check()


def test_an_unknown_setting_is_a_fault_of_the_profile(tmp_path: Path) -> None:
    path = tmp_path / "boat.toml"
    path.write_text(FERRY.text.replace("title =", 'setting = "ponds"\ntitle =', 1), encoding="utf-8")
    with pytest.raises(
        FerryIdError, match=r'"setting" cannot be "ponds"\. Did you mean "pond"\? Fix: use one of harbour, pond'
    ):
        load_profile(path)
    path.write_text(FERRY.text.replace("title =", 'setting = "pond"\ntitle =', 1), encoding="utf-8")
    assert load_profile(path).setting == "pond"
