"""Scores on second logs: which model is best, and what one that diverges counts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ferryid.validation.log_generation import generate
from ferryid.validation.records import DIAGNOSED, StoredEffectNote, TransferResult, TransferScore
from ferryid.validation.transfer_test import transfer
from ferryid.vessel import load_profile
from tests.rivals import causes, second_logs
from tests.rivals.second_logs import FIT, cases, force_error, position_error, section, targets, true_starts


def score(force: float | None, position_m: float | None, diverged: int = 0) -> TransferScore:
    """Force in windows; row by row a tenth more."""
    rows = None if force is None else 1.1 * force
    axes = ("surge", "sway", "yaw")
    in_windows = dict.fromkeys(axes, force)
    return TransferScore(dict.fromkeys(axes, rows), position_m, 0.1, 60, diverged, windows=in_windows)


def result(*known: str, **methods: TransferScore) -> dict[str, Any]:
    ours = replace(methods["ours"], effects=tuple(StoredEffectNote(one, None, "") for one in known))
    methods = {**methods, "ours": ours}
    named = {DIAGNOSED: methods["ours"], FIT: methods["fit"], "stepwise": methods["stepwise"]}
    # From true states ours errs half as much, and nobody else otherwise.
    true = {
        name: one.position_m and one.position_m * (0.5 if name == DIAGNOSED else 1.0) for name, one in named.items()
    }
    plain = TransferResult(score(100.0, 4.0), named).to_json()
    bases = {"lift": [0.4, 0.3], "second-order": [0.6, 5.0]}
    return {"cell": "wind", "concealed": ["wind"], "true_starts_m": true, "bases": bases, **plain}


FOUND = [
    result("wind", ours=score(0.5, 1.0), fit=score(0.6, 0.5), stepwise=score(0.9, 2.0)),
    result(ours=score(0.52, 3.0), fit=score(0.5, 3.0), stepwise=score(0.7, 0.1, diverged=2)),
    result(ours=score(0.9, 3.0), fit=score(0.8, 2.9), stepwise=score(0.3, 2.0)),
]


def test_a_run_that_diverges_and_a_model_that_is_not_there_count_as_infinite() -> None:
    assert position_error(score(0.5, 0.1, diverged=1)) == float("inf")
    assert position_error(score(0.5, None)) == float("inf")
    assert force_error(score(None, 1.0)) == float("inf")
    assert force_error(score(0.4, 1.0)) == pytest.approx(0.4)


def test_aims_compare_with_rivals_and_the_best_with_all() -> None:
    force, free_run, ratio = targets(4 * FOUND)
    # 0.52 is within 5 % of 0.5; 0.9 of 0.3 is not.
    assert "| no | 67 % of 12 logs |" in force
    # fit is better in the first log, and beaten by nobody in the second; stepwise wins the third.
    assert "| no | 33 % of 12 logs |" in free_run
    # 1.0 / 2.0, no rival that did not diverge, 3.0 / 2.0.
    assert "| yes | median 0.50 |" in ratio
    assert all("| too few logs |" in row for row in targets(FOUND))


def test_the_table_has_every_model() -> None:
    text = "\n".join(section(FOUND))
    assert "| diagnosed and learnt (`diagnose`) | 0.52 | 0.57 | 0.75 | 1.00 | 67 % | 33 % | 67 % | 0 |" in text
    assert "| stepwise | 0.70 | 0.77 | 0.50 | 0.50 | 33 % | 33 % | 33 % | 1 |" in text
    # Ours over stepwise: 0.5 / 2.0, 1.5 / 0.1, 1.5 / 2.0.
    assert "best or within 5 % on 67 % of the logs, and its position error is 0.75 of the best rival's" in text


def test_each_log_says_what_was_concealed_and_how_the_diagnosed_model_stands() -> None:
    lines = section(FOUND)
    assert "| wind | wind | wind | 0.83 | fit | 2.00 | fit |" in lines
    assert "| wind | wind | nothing | 1.04 | fit | 1.00 | fit |" in lines
    assert "| wind | wind | nothing | 3.00 | stepwise | 1.50 | stepwise |" in lines
    assert lines[-1].startswith(
        "On 1 log another model has the least force error; in 1 of them the diagnosed one lacks some"
    )


def test_free_runs_that_another_model_wins_are_put_down_to_starts_to_what_is_unnamed_or_to_the_rest() -> None:
    first, rival, lift, second = causes.second_logs(FOUND)
    # From true starts ours has 0.5 as fit in the first log; 1.5 / 2.0 is best in the third, where nothing is in the model.
    assert "2 logs of 3 on which another model is more than 5 % ahead: on 2 ours is best from true starts" in first
    assert "on 0 nothing is in the model" in first
    assert "the one that is best over all logs, stepwise, the diagnosed model has 0.50 in the median" in rival
    assert lift.startswith("`fit --basis lift`: position errors 0.10 times those of the default")
    assert second.endswith("more on 3.")


@pytest.mark.slow
def test_free_runs_from_true_states_are_those_of_a_log_without_noise(tmp_path: Path) -> None:
    # Noise shows in free runs where these err little otherwise, as on the path and with the seed of this case.
    case = next(one for one in cases() if one.cell == "wrong base: wind")
    quiet = replace(case, truths=(), conditions={"noise": 0.0}, hull_factors={})
    first, second = generate(quiet, tmp_path), generate(quiet, tmp_path / "second", transfer=True)
    profile = load_profile(first.profile)
    found = transfer(str(first.log), str(second.log), profile, tmp_path / "out", diagnosed=None, rivals={})
    ran = found.scores().methods[DIAGNOSED].position_m
    assert ran == pytest.approx(true_starts(found, quiet)[DIAGNOSED], rel=0.05, abs=0.02)
    noisy = replace(quiet, conditions={"noise": 3.0})
    worse = generate(noisy, tmp_path / "noisy", transfer=True)
    found = transfer(str(first.log), str(worse.log), profile, tmp_path / "out", diagnosed=None, rivals={})
    error = found.scores().methods[DIAGNOSED].position_m
    assert error is not None
    assert true_starts(found, noisy)[DIAGNOSED] == pytest.approx(ran, rel=0.3)
    assert error > 1.5 * ran  # type: ignore[operator]


def test_the_draw_is_the_same_every_time() -> None:
    names = [one.name for one in cases()]
    cases.cache_clear()
    assert [one.name for one in cases()] == names == sorted(set(names))
    assert len({one.cell for one in cases()[:20]}) > 10


def test_every_case_is_one_log_that_a_rival_can_learn_from() -> None:
    assert {case.logs for case in cases()} == {1}


def test_what_an_ended_run_has_left_of_a_case_is_in_nobodys_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case, left = cases()[0], []
    (tmp_path / case.name / case.name).mkdir(parents=True)

    def generate(one: Any, place: Path, *, transfer: bool = False) -> None:
        left.append(place.exists())
        raise InterruptedError

    monkeypatch.setattr(second_logs, "generate", generate)
    with pytest.raises(InterruptedError):
        second_logs.try_case(case, tmp_path)
    assert left == [False]
