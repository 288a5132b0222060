"""The verdict and the sentences on it, for any findings and any figures: they contradict neither."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.finding import UNKNOWN, Finding
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.diagnose.judging.verdict import VERDICTS, Remainder, campaign_verdict, verdict_of, worse_axes
from ferryid.effects import effects
from ferryid.report.diagnosis_words import UNRECORDED, headline, likely_hint, summary, title
from ferryid.types import AXES
from tests.diagnose.judging.findings import found

SURE, HINT, NAMELESS, SENSOR = found("wind"), found("current", 0.5), found(UNKNOWN), found("clock_offset")


def ratio(value: float, low: float | None = None) -> Estimate:
    return Estimate(value, value - 0.1 if low is None else low, value + 0.1, "-")


@pytest.mark.parametrize(
    ("findings", "remainder", "verdict"),
    [
        ((), Remainder(), "matched"),
        ((), Remainder(eliminated=True), "unexplained"),
        ((), Remainder(testable=False), "not_testable"),
        ((), Remainder(testable=False, eliminated=True), "not_testable"),
        ((HINT,), Remainder(), "unexplained"),
        ((HINT,), Remainder(testable=False), "not_testable"),
        ((NAMELESS,), Remainder(), "unexplained"),
        # A sure finding above "not testable" would contradict it.
        ((NAMELESS,), Remainder(testable=False), "unexplained"),
        ((SURE,), Remainder(), "explained"),
        ((SURE,), Remainder(testable=False), "partly_explained"),
        ((SENSOR,), Remainder(testable=False), "partly_explained"),
        ((SURE,), Remainder(eliminated=True), "partly_explained"),
        ((SURE, HINT), Remainder(), "partly_explained"),
        ((SURE, NAMELESS), Remainder(), "partly_explained"),
        # Figures that grow on an axis, or leave more than they explain, are not explained.
        ((SURE,), Remainder(ratio={"surge": ratio(0.73), "sway": ratio(4.33)}), "partly_explained"),
        ((SURE,), Remainder(ratio={"surge": ratio(0.73), "sway": ratio(1.1)}), "explained"),
        ((SURE,), Remainder(ratio={"surge": ratio(0.73), "sway": ratio(1.1, 1.01)}), "partly_explained"),
        ((SURE,), Remainder(left={"yaw": JUDGING.unexplained_share}), "partly_explained"),
        ((SURE,), Remainder(left={"yaw": 0.9 * JUDGING.unexplained_share}), "explained"),
        ((), Remainder(left={"yaw": JUDGING.unexplained_share}), "matched"),
    ],
)
def test_every_combination_has_its_word(findings: tuple[Finding, ...], remainder: Remainder, verdict: str) -> None:
    assert verdict_of(findings, remainder) == verdict


def test_an_axis_is_worse_by_much_or_beyond_doubt() -> None:
    every = {
        "surge": ratio(1.0 + 1.01 * JUDGING.worsening, 0.5),
        "sway": ratio(1.0 + 2.0 * JUDGING.reported_change, 1.001),
        "yaw": ratio(1.1, 0.9),
    }
    assert worse_axes(every) == ("surge", "sway")
    assert worse_axes({"yaw": Estimate(1.1, float("nan"), float("nan"), "-")}) == ()


@pytest.mark.parametrize(
    ("verdicts", "one"),
    [
        (("not_testable", "not_testable"), "not_testable"),
        (("explained", "matched", "not_testable"), "explained"),
        (("matched", "matched"), "matched"),
        (("explained", "unexplained"), "partly_explained"),
        (("matched", "unexplained"), "unexplained"),
        (("partly_explained", "matched"), "partly_explained"),
    ],
)
def test_several_logs_have_one_verdict(verdicts: tuple[str, ...], one: str) -> None:
    assert campaign_verdict(verdicts) == one


def by_axis(values: st.SearchStrategy[float]) -> st.SearchStrategy[dict[str, float]]:
    return st.fixed_dictionaries(dict.fromkeys(AXES, values))


findings_ = st.lists(
    st.builds(
        found,
        st.sampled_from(["wind", "current", "fouling", "gusts", "clock_offset", "held_samples", UNKNOWN]),
        st.floats(0.0, 1.0),
    ),
    max_size=4,
    unique_by=lambda one: one.key,
)
positive = st.floats(1e-3, 1e3)


@st.composite
def diagnoses(draw: st.DrawFn) -> Diagnosis:
    """Any findings and any figures, put together as a conclusion does."""
    findings = tuple(draw(findings_))
    before, after = draw(by_axis(positive)), draw(by_axis(positive))
    width = draw(st.floats(0.0, 1.0))
    ratios = {axis: after[axis] / before[axis] for axis in AXES} if draw(st.booleans()) else {}
    remainder = Remainder(
        testable=draw(st.booleans()),
        eliminated=draw(st.booleans()),
        ratio={axis: Estimate(one, one * (1.0 - width), one * (1.0 + width), "-") for axis, one in ratios.items()},
        left=draw(by_axis(st.floats(0.0, 2.0))),
    )
    plain = {
        axis: {name: getattr(one, name) for name in ("value", "low", "high")} for axis, one in remainder.ratio.items()
    }
    return Diagnosis(
        "log",
        "ferry",
        verdict_of(findings, remainder),
        findings,
        {"mse": before},
        {"mse": after if ratios else before, **({"ratio": plain} if plain else {})},
        remainder=remainder,
    )


@pytest.mark.slow
@settings(max_examples=500, deadline=None)
@given(diagnoses())
def test_no_sentence_contradicts_findings_and_figures(one: Diagnosis) -> None:
    says = headline(one)
    sure = [finding for finding in one.findings if finding.sure]
    named = [finding for finding in sure if finding.effect != UNKNOWN]
    assert one.verdict in VERDICTS
    if says.startswith("Not testable"):
        assert not sure
    if says.startswith("Matched"):
        assert one.findings == ()
        assert one.remainder.testable
        assert not one.remainder.eliminated
    if says.startswith("Explained"):
        assert named
        assert len(named) == len(one.findings)
        assert one.remainder.testable
        assert not one.remainder.worse
        assert max(one.remainder.left.values()) < JUDGING.unexplained_share
    assert says.startswith(("Explained", "Partly explained")) == bool(named)
    for finding in one.findings:
        name = title(finding.effect)
        if finding.effect != UNKNOWN and likely_hint(finding) and name[1:] in says:
            assert re.search(rf"[Pp]erhaps.*{name[1:]}", says), "a hint is told as one"
    if says.startswith("Partly explained") and not one.remainder.eliminated:
        told = ("perhaps", "Perhaps", "Unlikely", "More is missing", "cannot show", "larger", "is left over")
        assert any(word in says for word in told), "why it is explained in part is told"
    if "falls by" in says:
        for axis in one.remainder.worse:
            assert re.search(rf"rises by [^;.]*{axis}", says), f"{axis} gets worse, which is not said"
            assert f"{axis}" in says.partition("larger")[0].rpartition("In ")[2]
    for axis in one.remainder.much if named else ():
        assert re.search(rf"In [^.]*{axis}[^.]* more force is left", says)


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(st.lists(diagnoses(), min_size=2, max_size=4))
def test_no_sentence_on_several_logs_contradicts_them(logs: list[Diagnosis]) -> None:
    says, verdict = summary(logs), campaign_verdict([one.verdict for one in logs])
    every = [finding for one in logs for finding in one.findings]
    named = [one for one in every if one.sure and one.effect != UNKNOWN]
    assert (verdict in ("explained", "partly_explained")) == bool(named)
    assert ("The model left out" in says) == any(one.effect in effects() for one in named)
    apart = {UNRECORDED, *effects()}
    assert ("The sensors have faults" in says) == any(one.effect not in apart for one in named)
    assert ("a force acted that was not recorded" in says) == any(one.effect == UNRECORDED for one in named)
    if verdict == "explained":
        assert {one.verdict for one in logs} <= {"explained", "matched", "not_testable"}
    for name, hints in ((title(one.effect), likely_hint(one)) for one in every if one.effect != UNKNOWN):
        if hints and name[1:] not in says.partition("Perhaps")[0]:
            assert name[1:] in says.partition("Perhaps")[2]


def test_the_axis_that_gets_worse_is_named() -> None:
    after = {"mse": {"surge": 73.0, "sway": 433.0, "yaw": 100.0}}
    remainder = Remainder(ratio={"surge": ratio(0.73), "sway": ratio(4.33), "yaw": ratio(1.0)})
    one = Diagnosis(
        "log", "ferry", verdict_of((SURE,), remainder), (SURE,), {"mse": dict.fromkeys(AXES, 100.0)}, after,
        remainder=remainder,
    )  # fmt: skip
    assert headline(one) == (
        "Partly explained: the model left out steady wind (value 1.00) or current; with it, the squared force error on "
        "held-out data falls by 27 % in surge and rises by 333 % in sway. In sway the findings make the force error larger."
    )


def test_a_repeated_sample_explains_no_forces_that_were_not_testable() -> None:
    held = found("held_samples")
    one = Diagnosis("log", "ferry", verdict_of((held,), Remainder(testable=False)), (held,), {}, {})
    assert headline(replace(one, remainder=Remainder(testable=False))) == (
        "Partly explained: the sensors have faults, corrected here: held samples. Whether more is missing, this log cannot "
        "show."
    )


def test_a_log_that_shows_that_more_is_missing_cannot_show_only_whether_that_is_all() -> None:
    remainder = Remainder(testable=False)
    one = Diagnosis(
        "log", "ferry", verdict_of((SURE, NAMELESS), remainder), (SURE, NAMELESS), {}, {}, remainder=remainder
    )
    assert headline(one).endswith(
        " More is missing, which nothing known here explains. Whether that is all, this log cannot show."
    )


def test_hints_of_several_logs_are_told_as_hints() -> None:
    logs = [
        Diagnosis(name, "ferry", verdict_of(findings, Remainder()), findings, {}, {})
        for name, findings in (("a", (SURE,)), ("b", (HINT, replace(HINT, effect="waves"), NAMELESS)))
    ]
    assert summary(logs) == (
        "Of 2 logs, 1 explained and 1 unexplained. The model left out steady wind or current. Perhaps the model also left out "
        "waves. More is missing, which nothing known here explains."
    )


@pytest.mark.parametrize(("beside", "what"), [((), "something"), ((replace(HINT, effect="waves"),), "more")])
def test_something_without_a_name_that_is_a_hint_is_perhaps_missing(beside: tuple[Finding, ...], what: str) -> None:
    doubtful = replace(NAMELESS, probability=HINT.probability)
    logs = [Diagnosis(name, "ferry", "not_testable", (doubtful, *beside), {}, {}) for name in "ab"]
    assert summary(logs).endswith(f" Perhaps {what} is missing, which nothing known here explains.")
    partly = Diagnosis("log", "ferry", "partly_explained", (SURE, doubtful), {}, {})
    assert headline(partly).endswith(" Perhaps more is missing, which nothing known here explains.")


def test_where_no_log_has_a_name_something_is_missing_and_not_more() -> None:
    logs = [Diagnosis(name, "ferry", verdict_of((NAMELESS,), Remainder()), (NAMELESS,), {}, {}) for name in "ab"]
    assert summary(logs) == "Of 2 logs, 2 unexplained. Something is missing, which nothing known here explains."


def test_enumerated_figures_never_explain_what_they_leave() -> None:
    for findings, testable, eliminated, value, left in product(
        ((), (SURE,), (HINT,), (NAMELESS,), (SURE, HINT), (SURE, NAMELESS), (SENSOR,)),
        (True, False),
        (True, False),
        (0.3, 1.0, 1.5),
        (0.0, 1.0),
    ):
        remainder = Remainder(testable, eliminated, {"sway": ratio(value)}, {"sway": left})
        whole = testable and not eliminated and value < 1.2 and left < JUDGING.unexplained_share
        expected = whole and findings in ((SURE,), (SENSOR,))
        assert (verdict_of(findings, remainder) == "explained") == expected


def test_a_force_that_was_not_recorded_is_no_fault_of_a_sensor() -> None:
    pushed = found(UNRECORDED)
    one = Diagnosis("log", "ferry", verdict_of((pushed,), Remainder(testable=False)), (pushed,), {}, {})
    one = replace(one, remainder=Remainder(testable=False))
    assert headline(one).startswith("Partly explained: a force acted that was not recorded.")
    assert "In 2 of them a force acted that was not recorded." in summary([one, replace(one, log="other")])
