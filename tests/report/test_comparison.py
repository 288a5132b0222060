"""A comparison in words: what is shown, what may be, and what is left open; and its figures' bookkeeping."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isnan, nan

import numpy as np
import pytest

from ferryid.compare.candidates import BASE
from ferryid.compare.comparison_result import (
    Coefficient,
    CoefficientRow,
    Coefficients,
    ComparedModel,
    ComparisonResult,
    FreeRunCounts,
    LogErrors,
    ModelPair,
    Ratio,
    Statement,
)
from ferryid.compare.comparison_statements import PairedErrors, comparison_statements, format_probability
from ferryid.regression.resampling.paired_bootstrap import PairedRatios, compare_pairs
from ferryid.report import comparison_words
from ferryid.report.comparison_figures import looks, over_reference
from ferryid.report.comparison_report import _coefficient_table

HORIZONS = (5.0, 30.0)


def paired(size: dict[tuple[int, int], float], p: float, m: int, columns: int) -> PairedRatios:
    """Return ratios that are the same in all columns, with intervals of ten per cent and one probability."""
    pairs = tuple((i, j) for i in range(m) for j in range(i + 1, m))
    ratio = np.array([[size[pair]] * columns for pair in pairs])
    return PairedRatios(pairs, ratio, 0.9 * ratio, 1.1 * ratio, np.full(ratio.shape, p))


def model(label: str) -> ComparedModel:
    return ComparedModel(label, label, 1, label == BASE, True, "modulus", False, {}, (), None, None)


def result(
    labels: tuple[str, ...], p: float, trained: frozenset[str] = frozenset(), step: float = 1.3, windows: int = 4
) -> ComparisonResult:
    """Return a comparison in which every model errs `step` times more than the one before."""
    m = len(labels)
    size = {(i, j): step ** (i - j) for i in range(m) for j in range(i + 1, m)}
    # Errors of single rows say the opposite of those in windows, and do not count.
    axes, wrong = paired(size, p, m, 3), paired({pair: 1.0 / value for pair, value in size.items()}, p, m, 3)
    judged = PairedErrors("log", labels, wrong, axes, (paired(size, p, m, 4),) * 2, HORIZONS, 30.0, trained)
    runs = FreeRunCounts(HORIZONS, 30.0, 3, (3, 3), (9, 9))
    return ComparisonResult(
        schema="ferryid.compare/1",
        vessel="ferry",
        window_s=1.0,
        prediction_window_s=8.0,
        models=tuple(map(model, labels)),
        warnings=(),
        logs=(LogErrors("log", "", 30.0, 10, 1.0, 9, windows, {}, runs, (), None, ()),),
        pooled=None,
        statements=tuple(comparison_statements(judged)),
        coefficients=Coefficients((), ()),
        effects=(),
    )


def test_what_is_better_is_said_with_its_ratio_and_chance() -> None:
    said = comparison_words.sentences(result(("one", "two"), 0.001), "log")
    assert said[0] == (
        "one is better than two on surge (p 0.005): its prediction MSE is 0.769 of the other's "
        "(95 % interval 0.692 to 0.846)"
    )
    # Errors of free runs are not squared.
    assert "one is better than two in heading, run free for 30 s (p 0.005): its heading error is 0.877 of" in said[4]
    assert len(said) == 5


def test_the_better_one_comes_first_whichever_was_named_first() -> None:
    row = result(("one", "two"), 0.001, step=1.0 / 1.3).statements[0]
    assert (row.first, row.better) == ("two", "two")
    assert row.ratio == pytest.approx(1.0 / 1.3)
    assert row.low < row.ratio < row.high < 1.0


def test_what_the_number_of_comparisons_makes_doubtful_may_be() -> None:
    said = comparison_words.sentences(result(("one", "two"), 0.03), "log")
    assert said[0].startswith(
        "one may be better than two on surge (p 0.03 by itself, 0.15 among all): its prediction MSE is 0.769"
    )


def test_what_is_not_shown_is_one_sentence_for_two_models() -> None:
    (said,) = comparison_words.sentences(result((BASE, "one"), 0.4), "log")
    # The base model is what a model is held against.
    assert said.startswith(
        f"no difference shown between one and {BASE}, error of the first over the second's: surge 1.3 ["
    )
    assert said.count("p 1.00") == 5


@pytest.mark.parametrize(
    ("p", "says"), [(0.001, "worse"), (0.03, "may be worse"), (0.5, "no difference"), (nan, "too little data")]
)
def test_one_matrix_says_which_of_every_two_models_is_better_in_what(p: float, says: str) -> None:
    found = result((BASE, "one", "two"), p)
    if isnan(p):
        found = replace(found, statements=tuple(replace(row, low=nan, high=nan) for row in found.statements))
    heads, rows = comparison_words.outcomes(found, "log")
    assert heads == ["surge", "sway", "yaw", "position, free 30 s", "heading, free 30 s"]
    assert [pair for pair, _ in rows] == [f"one against {BASE}", f"two against {BASE}", "two against one"]
    assert all(cells == [says] * 5 for _, cells in rows)


def test_the_matrix_says_what_is_no_evidence_and_what_is_better() -> None:
    rows = comparison_words.outcomes(result(("one", BASE), 0.001, frozenset({"one"})), "log")[1]
    assert rows == [(f"one against {BASE}", ["better, no evidence"] * 5)]
    assert comparison_words.outcomes(result(("one", BASE), 0.001), "log")[1][0][1] == ["better"] * 5


def test_with_many_models_the_matrix_has_each_against_the_first() -> None:
    rows = comparison_words.outcomes(result(("a", "b", "c", "d", "e"), 0.001), "log")[1]
    assert [pair for pair, _ in rows] == [f"{one} against a" for one in "bcde"]


def test_alike_is_what_differs_by_next_to_nothing_however_surely() -> None:
    row = result(("one", "two"), 0.0001, step=1.004).statements[0]
    assert row.better is None
    assert row.sentence == "one and two are alike on surge: their prediction MSE differs by less than 0.5 %"


def test_many_models_are_held_against_the_best() -> None:
    labels = ("a", "b", "c", "d", "e")
    said = comparison_words.sentences(result(labels, 0.0001), "log")
    assert len(said) == 4 * 5
    assert all(sentence.startswith("a is better than ") for sentence in said)
    unclear = comparison_words.sentences(result(labels, 0.9), "log")
    assert len(unclear) == 5
    assert unclear[0].startswith("on surge, a errs least, but no difference is shown: its error over that of b 0.769 [")
    # Holm's first factor is the number of all pairs, not of those that are told.
    assert result(labels, 0.0001).statements[0].p_corrected == pytest.approx(10 * 5 * 0.0001)


def test_what_has_seen_the_log_is_no_evidence() -> None:
    found = result(("one", "two"), 0.001, frozenset({"one"}))
    assert found.statements[0].sentence.endswith("; no evidence, as one was fitted to this log")
    assert "where it was trained, which is no evidence" in comparison_words.headline(found)
    assert result(("one", "two"), 0.001, frozenset({"two"})).statements[0].evidence


@pytest.mark.parametrize(
    ("p", "told"), [(0.001, "one on surge, sway and yaw, beyond chance."), (0.5, "which may be chance.")]
)
def test_the_headline_says_who_errs_least_and_how_surely(p: float, told: str) -> None:
    headline = comparison_words.headline(result(("one", "two", BASE), p))
    assert headline.endswith(told)
    advice = "No fitted model is shown to be better than the profile's hull: keep the hull. Least prediction error"
    assert headline.startswith(advice) == (p > 0.05)
    assert "keep the hull" not in comparison_words.headline(result(("one", "two"), p))


def test_the_headline_does_not_keep_a_hull_that_too_little_data_are_held_against() -> None:
    found = result(("one", BASE), nan)
    none = tuple(replace(row, low=nan, high=nan, better=None) for row in found.statements)
    headline = comparison_words.headline(replace(found, statements=none))
    assert headline == (
        "Too little data to decide whether a fitted model is better than the profile's hull: an interval needs 8 blocks of "
        "30 s, and 1 s are compared. Give longer logs, or more of them. "
        "Least prediction error, log: one on surge, sway and yaw, with too little data to decide."
    )


def test_the_headline_says_on_which_axes_a_model_is_better_than_the_base_model() -> None:
    found = result(("one", BASE), 0.001)
    assert BASE not in comparison_words.headline(found)

    def changed(row: Statement) -> Statement:
        if row.what == "sway":
            return replace(row, better=None, p=0.5, p_corrected=1.0)
        if row.what == "yaw":
            return replace(row, first=row.second, second=row.first, better=row.second)
        return row

    partly = replace(found, statements=tuple(map(changed, found.statements)))
    assert comparison_words.headline(partly).startswith(
        "one is better than the base model on surge, worse on yaw and not shown to be better or worse on sway. "
        "Least prediction error, log: "
    )


def test_without_a_window_the_force_in_single_rows_is_what_counts() -> None:
    found = result(("one", "two"), 0.001, windows=0)
    assert comparison_words.headline(found).startswith("Least force error, log: two on surge, sway and yaw, beyond")
    said = comparison_words.sentences(found, "log")
    assert len(said) == 5
    assert any(one.startswith("two is better than one on surge (p 0.003): its MSE is") for one in said)


def test_without_a_window_and_an_interval_nothing_is_advised() -> None:
    found = result(("one", "two", BASE), 0.4, windows=0)
    none = tuple(replace(row, low=nan, high=nan, p=nan, p_corrected=nan) for row in found.statements)
    headline = comparison_words.headline(replace(found, statements=none))
    assert headline == "Too little data to compare the models, log: 1 s, of which nothing is shown."


def test_too_few_blocks_are_too_little_data() -> None:
    few = np.random.default_rng(1).gamma(3.0, 1.0, (3, 2, 3))
    runs = compare_pairs([few[:, :, [0, 1, 2, 0]]])
    judged = PairedErrors(
        "log", ("one", "two"), *(compare_pairs([few]),) * 2, (runs, runs), HORIZONS, None, frozenset()
    )
    rows = comparison_statements(judged)
    # Without a horizon that has intervals, free runs have no sentence.
    assert [(row.kind, row.what) for row in rows] == [
        (kind, axis) for kind in ("prediction", "force") for axis in ("surge", "sway", "yaw")
    ]
    assert all(row.sentence.startswith("too little data to distinguish") for row in rows)


def test_chances_are_short() -> None:
    assert [format_probability(p) for p in (0.0001, 0.0123, 0.049, 0.31, 1.0)] == [
        "0.0001",
        "0.01",
        "0.05",
        "0.31",
        "1.00",
    ]


def test_no_two_of_many_models_look_alike() -> None:
    models = [model(str(k) if k else BASE) for k in range(20)]
    seen = [(look["color"], look["marker"], look["linestyle"]) for look in looks(models).values()]
    assert len(set(seen)) == 20


def test_a_ratio_over_a_reference_is_turned_round_with_its_interval() -> None:
    ratio = Ratio(2.0, 1.6, 4.0, 0.1)
    pair = ModelPair(BASE, "one", {"sway": ratio}, {"yaw": ratio}, {"position_m": (ratio,)})
    turned = over_reference([pair], "one", BASE)
    assert turned.mse["sway"] == Ratio(0.5, 0.25, 0.625, 0.1)
    assert turned.prediction["yaw"] == turned.mse["sway"]
    assert turned.free_run["position_m"] == (turned.mse["sway"],)
    assert over_reference([pair], BASE, "one") is pair


@pytest.mark.parametrize("unknown", [nan, inf, 0.0])
def test_the_inverse_of_what_is_not_known_is_not_known_either(unknown: float) -> None:
    turned = Ratio(0.5, unknown, 2.0, 0.1).inverse()
    assert (turned.value, turned.low) == (2.0, 0.5)
    assert isnan(turned.high)


def test_nor_is_it_where_it_may_be_better() -> None:
    (row, *_) = result(("one", "two"), 0.03, frozenset({"one"})).statements
    assert row.perhaps == "one"
    assert row.sentence.endswith("; no evidence, as one was fitted to this log")


def test_what_is_nothing_but_rounding_beside_the_masses_is_no_coefficient() -> None:
    rows = [
        CoefficientRow(name, "kg", dict.fromkeys(("one", "none"), Coefficient(value, nan, nan)))
        for name, value in (("m22", 4000.0), ("m32", -1.4e-12), ("X_u", 1e-3))
    ]
    found = replace(result(("one", "none"), 0.5), coefficients=Coefficients(tuple(rows), ()))
    table = {
        name: comparison_words.cell(values["one"]) for name, _, values in comparison_words.coefficient_table(found)
    }
    assert table == {"m22": ("4000", ""), "X_u": ("0.001", "")}
    assert not any("m32" in line for line in _coefficient_table(found))


def test_what_a_fit_did_not_estimate_is_held_and_has_no_interval() -> None:
    here = {"one": Coefficient(30.0, 20.0, 40.0), "none": Coefficient(28.0, nan, nan)}
    held = {"one": Coefficient(15.0, nan, nan), "none": Coefficient(15.0, nan, nan)}
    rows = (CoefficientRow("m11", "kg", here), CoefficientRow("m22", "kg", held))
    found = replace(result(("one", "none"), 0.5), coefficients=Coefficients(rows, ()))
    # A model without any interval, such as a base model, says nothing of what it estimated.
    assert comparison_words.estimated(found) == {"one"}
    text = "\n".join(_coefficient_table(found))
    assert "15 (held)" in text
    assert text.count("held: not estimated, as in the profile") == 1
    assert text.count("(held)") == 1
    assert comparison_words.cell(held["one"], of_fit=True) == ("15", "held")
    assert comparison_words.cell(held["none"]) == ("15", "")
    assert comparison_words.cell(Coefficient(0.0, -1.0, 1.0)) == ("0", "-1 to 1")
    assert "held" not in "\n".join(_coefficient_table(replace(found, coefficients=Coefficients(rows[:1], ()))))
