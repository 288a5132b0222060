"""A proof on real recordings as a whole: committed, written, diagnosed, resumed, and scored as a difference."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid import diagnose
from ferryid.errors import FerryIdError
from ferryid.validation import stages
from ferryid.validation.case import Case, Truth
from ferryid.validation.commitment import verified_answers
from ferryid.validation.name_scores import (
    DROPPED,
    NO_HULL_MODEL,
    NOT_CONFIRMED,
    NOT_TESTED,
    SINCE,
    SIZES,
    SMALLEST,
    TO_SHOW,
    why_missed,
)
from ferryid.validation.recorded.case_sampling import NotMade
from ferryid.validation.recorded.evaluators import recorded_pipeline
from ferryid.validation.recorded.log import read_log
from ferryid.validation.recorded.page import page
from ferryid.validation.recorded.scores import from_twice_distinct, recorded_targets, score_recorded
from ferryid.validation.records import CaseResult, Diagnosis, Finding
from ferryid.validation.run import render_summary, run_validation
from ferryid.validation.source_hash import source_hash
from ferryid.vessel import load_profile
from tests.cli.conftest import ferryid as ferryid_fixture
from tests.cli.test_every_command import conforms
from tests.validation.recorded_logs import BAG, zigzag
from tests.validation.test_scores import finding

pytestmark = pytest.mark.draws

ferryid_run = ferryid_fixture

LEAST_M = 0.3


class Surveyor:
    """A diagnosis that looks at nothing but the place of the antenna, against the log as it was."""

    sources = source_hash()

    def __init__(self, original: Path) -> None:
        self.eta = read_log(str(original), load_profile("kvlcc2-model")).measurements.eta
        self.seen: list[str] = []

    def diagnose(
        self, log: Path, profile: Path, out: Path, more: Sequence[Path] = (), before: Sequence[Path] = ()
    ) -> Diagnosis:
        self.seen.append(log.name)
        assert sorted(path.name for path in log.parent.iterdir()) == sorted([log.name, "vessel.toml"])
        eta = read_log(str(log), load_profile(profile)).measurements.eta
        c, s = np.cos(eta[:, 2]), np.sin(eta[:, 2])
        north, east = (eta - self.eta)[:, :2].T
        x, y = float(np.mean(c * north + s * east)), float(np.mean(c * east - s * north))
        found = (finding("lever_arm", {"x": x, "y": y}),) if np.hypot(x, y) > LEAST_M else ()
        return Diagnosis("explained", 1.0, found)


def validated(out: Path, log: Path, **options: Any) -> dict[str, Any]:
    options = {"seed": 7, "only": ["lever_arm"], "processes": 1, **options}
    pipeline = recorded_pipeline(str(log), "kvlcc2-model")
    return run_validation(out, pipeline, progress=lambda stage: None, announce=lambda line: None, **options)


@pytest.mark.slow
def test_from_the_recording_to_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log, out = zigzag(tmp_path / "zigzag.dat", 240.0), tmp_path / "out"
    surveyor = Surveyor(log)
    monkeypatch.setattr(stages, "worker_of", lambda run: surveyor)
    result = validated(out, log)
    conforms(json.dumps(result))
    assert result["settings"] == {"runs": 1.0, "only": ["lever_arm"], "real": str(log), "vessel": "kvlcc2-model"}
    assert result["counts"] == {"cases": 6, "diagnosed": 6, "refused": 0, "crashed": 0}
    (response,) = result["scores"]["responses"]
    assert response["named"] == [size > LEAST_M for size in response["sizes"]]
    assert 0 < sum(response["named"]) < 5
    every = result["scores"]["recoveries"][0]
    assert every["found"] == sum(response["named"])
    assert every["median_error"] < 1e-3
    folder = out / "proof-real"
    text = (folder / "proof-real.md").read_text("utf-8")
    assert "| lever_arm | zigzag | m |" in text
    assert "(proof-real/detection.svg)" in text
    assert (folder / "proof-real" / "detection.svg").exists()
    summary = render_summary(result)
    assert f"{folder}/proof-real.md" in summary
    sizes, named = sorted(response["sizes"]), sum(response["named"])
    least, most, first = sizes[0], sizes[-1], sizes[-named]
    line = f"lever_arm: named from {first:.3g} m on; {named} of 5 sizes from {least:.3g} to {most:.3g} m named"
    assert line in summary
    assert len(verified_answers(folder)["cases"]) == 6
    # Killed after four diagnoses, it goes on with the other two.
    lines = folder / "lines" / "diagnosed.jsonl"
    lines.write_text("".join(lines.read_text("utf-8").splitlines(keepends=True)[:4]), encoding="utf-8")
    surveyor.seen.clear()
    assert validated(out, log)["scores"]["responses"] == result["scores"]["responses"]
    assert len(surveyor.seen) == 2
    # Other recordings are another run.
    (folder / "result.json").unlink()
    with pytest.raises(FerryIdError, match="unfinished run of another seed"):
        validated(out, zigzag(tmp_path / "zigzag.dat", 241.0))


class Comparer:
    """A comparison that looks at nothing but how far the antenna moved between the first log of each group."""

    sources = source_hash()

    def diagnose(
        self, log: Path, profile: Path, out: Path, more: Sequence[Path] = (), before: Sequence[Path] = ()
    ) -> Diagnosis:
        (first,) = before
        assert sorted(path.name for path in log.parent.iterdir()) == sorted([log.name, first.name, "vessel.toml"])
        eta, was = (read_log(str(path), load_profile(profile)).measurements.eta for path in (log, first))
        away = (eta - was)[:, :2]
        c, s = np.cos(eta[:, 2]), np.sin(eta[:, 2])
        x, y = (float(np.mean(one)) for one in (c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]))
        found = (finding("lever_arm", {"x": x, "y": y}),) if np.hypot(x, y) > LEAST_M else ()
        return Diagnosis("different" if found else "alike", 1.0, found)


@pytest.mark.slow
def test_what_is_concealed_in_one_group_is_to_be_found_beside_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("march.dat", "may.dat"):
        zigzag(tmp_path / name, 240.0)
    manifest = tmp_path / "list.toml"
    manifest.write_text(
        'schema = "ferryid.recordings/1"\n[[recording]]\nname = "may"\nvessel = "kvlcc2-model"\n'
        'before = ["march.dat"]\ncampaign = ["may.dat"]\nonly = ["lever_arm", "dead_band", "thruster_lag"]\n',
        encoding="utf-8",
    )
    monkeypatch.setattr(stages, "worker_of", lambda run: Comparer())
    pipeline = recorded_pipeline(str(manifest), None)
    pipeline = replace(pipeline, evaluators={})
    options: dict[str, Any] = {"seed": 7, "only": ["lever_arm"], "processes": 1}
    options |= {"progress": lambda stage: None, "announce": lambda line: None}
    result = run_validation(tmp_path / "out", pipeline, **options)
    assert result["scores"]["responses"] == []
    (change,) = result["scores"]["changes"]
    assert change["named"] == [size > LEAST_M for size in change["sizes"]]
    assert 0 < sum(change["named"]) < 5
    assert result["scores"]["recoveries"][0]["median_error"] < 1e-3
    text = (tmp_path / "out" / "proof-real" / "proof-real.md").read_text("utf-8")
    assert "## What changed between two groups" in text
    assert any(one["what"].startswith("what changed between two groups") for one in result["targets"])


RUN: dict[str, Any] = {
    "settings": {"real": "list.toml", "runs": 1.0, "only": []},
    "seed": 7,
    "counts": {"refused": 0, "crashed": 0, "diagnosed": 6},
    "commitment": "0" * 64,
}
ARM = Truth("lever_arm", None, {"x": 1.0, "y": 0.0})


def case(truths: tuple[Truth, ...], findings: list[Finding], size: float = 1.0, **more: Any) -> CaseResult:
    made = Case("1", "lever_arm: a", "single", "boat", "a", "table", 1, 2, size, truths)
    return CaseResult(replace(made, **more), {}, Diagnosis("explained", 2.0, tuple(findings)))


def plain(findings: list[Finding]) -> CaseResult:
    return case((), findings, kind="clean", cell="unaltered: a", level=None)


def test_what_counts_is_the_difference() -> None:
    arm = finding("lever_arm", {"x": 1.1, "y": 0.0}, 0.2)
    own, hint = finding("time_delay", {"seconds": 0.2}), finding("mooring", p=0.4)
    results = [
        plain([own, hint]),
        case((ARM,), [arm, own]),
        case((ARM,), [arm, own, finding("payload")]),
        case((ARM,), [finding("lever_arm", p=0.5), own], size=0.5),
        case((ARM,), [arm, finding("mooring")]),
        case((ARM,), [], size=0.1),
    ]
    lacking = [
        NotMade("a", "wind", 0.0, "wind cannot be concealed in a: no areas."),
        *(NotMade("a", "payload", size, "payload: 4 % of the rows cannot express it, as so.") for size in (0.3, 0.5)),
        NotMade("a", "thruster_lag", 0.7, "thruster_lag of 0.7 s was not made in a: by the record another one."),
        NotMade("b", "", 0.0, "b.bag: too short. Fix: none"),
        NotMade(
            "b", "wind and payload", 0.0, "wind and payload cannot be concealed in b: together, wind is beyond 20 m/s."
        ),
    ]
    scores = score_recorded(results, lacking)
    assert scores.runs == 6
    assert scores.unaltered[0].named == ("time_delay",)
    assert scores.unaltered[0].hinted == ("mooring",)
    assert (scores.right.count, scores.right.of) == (3, 5)
    # The recording's own delay is not wrong, a hint of it does not excuse a name, and a name of it that is missing is gone.
    assert (scores.wrong.count, scores.wrong_names) == (2, {"payload": 1, "mooring": 1})
    assert (scores.gone.count, scores.gone_names) == (2, {"time_delay": 2})
    (response,) = scores.responses
    assert response.named == (True, True, False, True, False)
    assert response.noticed == (True, True, True, True, False)
    assert response.instead == {"a hint": 1, "none": 1}
    assert scores.recoveries[0].errors == pytest.approx([0.1, 0.1, 0.1])
    assert scores.recoveries[0].covered.value == 1.0
    (errors,) = [one for one in recorded_targets(scores) if one.what.startswith("median")]
    assert errors.reached is False
    text = page(RUN, scores)
    assert "| a | boat | explained | 2 | time_delay | mooring |" in text
    assert (
        "- a: wind (no areas); payload of 0.3 and 0.5 share of the mass (more than 2 % of the rows cannot express it, as so);"
        " thruster_lag of 0.7 s (by the record another one)." in text
    )
    assert "- b: b.bag: too short. Fix: none; wind and payload (together, wind is beyond 20 m/s)." in text
    assert "| Sensors | 60.0 % (3/5)" in text
    assert "2 time_delay" in text


def test_why_effects_of_twice_the_oracles_size_were_missed_stands_on_the_page() -> None:
    weak = Truth("thruster_gain", "port", {"factor": 0.8})
    doubt = "It is estimated, not confirmed: on no axis does it remove 10 % of the error."
    hint = finding("thruster_gain", {"factor": 0.82}, 0.05, "port", p=0.5, says=f"Port gives 82 %. {doubt}")
    seen, own = {"size": 0.2, "oracle_size": 0.1, "distinct_size": 0.05}, finding("time_delay", p=0.5)
    notes = (
        "The profile has no hull model, or one of unknown spread: take them as hints.",
        "Thruster force (port) is a hint: it makes the error in yaw 27 % larger.",
        "Thruster force (port) and Payload were considered, but dropped: a law explains more. Estimated, not confirmed: "
        "Thruster force (port): factor 0.90 (0.78 to 1.02).",
        "Thruster force (starboard) is a hint: it is another one.",
    )
    told, last = case((weak,), [own], **seen), case((weak,), [replace(hint, says="")], **seen)
    results = [
        plain([own]),
        case((weak,), [hint, own, finding("waves", p=0.5), finding("unknown")], **seen),
        replace(told, diagnosis=replace(told.diagnosis, notes=notes)),
        replace(told, diagnosis=replace(told.diagnosis, notes=notes[:1])),
        replace(last, diagnosis=replace(last.diagnosis, notes=notes[:1])),
        # Less than the oracle needs twice over, one that was named, and one of which no oracle's size is known.
        case((weak,), [], **(seen | {"size": 0.19})),
        case((weak,), [replace(hint, probability=1.0)], **seen),
        case((weak,), []),
    ]
    scores = score_recorded(results, [])
    assert [(one.of_oracle, one.of_distinct, one.outcome, one.instead) for one in scores.missed] == [
        (2.0, 4.0, "a hint", ("waves, a hint", "unknown")),
        (2.0, 4.0, "dropped", ()),
        (2.0, 4.0, "none", ()),
        (2.0, 4.0, "a hint", ()),
    ]
    assert [one.why for one in scores.missed] == [
        "on no axis does it remove 10 % of the error",
        "it makes the error in yaw 27 % larger; a law explains more",
        # The note says why findings are hints, not why there is none.
        "",
        "the hull was fitted to the same log, as the profile has none",
    ]
    assert type(scores).from_json(scores.to_json()).missed == scores.missed
    text = page(RUN, scores)
    assert "Of these 4, 0 are below twice the distinct size." in " ".join(text.split())
    row = "| a | 2.0 | 4.0 | a hint: on no axis does it remove 10 % of the error | waves, a hint; unknown |"
    assert f"| thruster_gain (port) {row}" in text


@pytest.mark.parametrize(
    ("notes", "why"),
    [
        (["Not tested: fouling and thruster force, since there is none."], "not tested, since there is none"),
        (["b.bag: too large. What is found of forces in such logs means little."], "the vessel hardly follows"),
        (
            ["Would have been seen with an even chance, from: Payload, mass 3 kg; Thruster force (port), factor 33 %."],
            "the logs show it with an even chance from factor 33 % on",
        ),
        (
            ["To make sure: for payload and thruster force (aft, port), record turns."],
            "an effect of its usual size would not have shown in this log",
        ),
        (["To make sure: for thruster force (aft, starboard), record turns; for dead band (port), record steps."], ""),
        (["Not tested: dead band, since there is none."], ""),
    ],
)
def test_what_a_diagnosis_does_not_mention_is_missed_for_what_it_says_of_its_logs(notes: list[str], why: str) -> None:
    weak = Truth("thruster_gain", "port", {"factor": 0.8})
    missed = case((weak,), [])
    noted = replace(missed, diagnosis=replace(missed.diagnosis, notes=tuple(notes)))
    assert why_missed(noted, weak.key).startswith(why)
    assert bool(why_missed(noted, weak.key)) == bool(why)
    # What it was not distinguished from says more.
    instead = replace(finding("payload", p=0.5), unresolved_with=("thruster_gain",))
    found = case((weak,), [instead])
    assert why_missed(replace(found, diagnosis=replace(found.diagnosis, notes=tuple(notes))), weak.key) == (
        "not distinguished from payload"
    )


def test_what_is_smaller_than_the_distinct_size_needs_no_other_reason() -> None:
    weak = Truth("thruster_gain", "port", {"factor": 0.8})
    sizes = {"size": 0.2, "oracle_size": 0.1}
    results = [plain([]), *(case((weak,), [], **sizes, distinct_size=one) for one in (0.3, 0.1))]
    assert [one.why for one in score_recorded(results, []).missed] == ["smaller than the distinct size", ""]


def test_what_the_recording_has_of_an_effect_may_cancel_it() -> None:
    weak, late = Truth("thruster_gain", "port", {"factor": 0.8}), Truth("time_delay", None, {"seconds": 0.2})
    sizes = {"size": 0.2, "oracle_size": 0.1, "distinct_size": 0.1}
    results = [plain([]), case((weak,), [], **sizes), case((late,), [], **sizes)]

    def why(factor: float, seconds: float) -> list[str]:
        forces = {("a", weak.key): factor, ("a", late.key): seconds}
        return [one.why for one in score_recorded(results, [], None, forces).missed]

    # A factor of 1.1 by itself makes 0.88 of 0.8, and a delay that is negative goes off the other.
    assert why(1.1, -0.15) == [
        "the recording as it was has 1.1 of it by its best estimate, which leaves 1.2 times the oracle's size",
        "the recording as it was has -0.15 of it by its best estimate, which leaves 0.5 times the oracle's size",
    ]
    assert why(0.9, 0.15) == ["", ""]


@pytest.mark.parametrize("words", [NOT_CONFIRMED, NO_HULL_MODEL, DROPPED, SIZES, NOT_TESTED, SINCE, SMALLEST, TO_SHOW])
def test_reasons_are_found_by_words_that_the_diagnosis_has(words: str) -> None:
    sources = Path(diagnose.__file__).parent.rglob("*.py")
    assert any(words in one.read_text("utf-8") for one in sources)


def test_a_hint_that_the_recording_has_already_is_not_noticed() -> None:
    hint = finding("lever_arm", p=0.4)
    scores = score_recorded([plain([hint]), case((ARM,), [hint])], [])
    assert scores.responses[0].noticed == (False,)
    assert scores.noticed_recoveries[0].found == 0


def test_a_step_is_measured_from_the_level_that_the_recording_has() -> None:
    """A factor on a thruster that gives 90 % by itself is multiplied with that; a step to it is not."""
    weak = Truth("thruster_gain", "port", {"factor": 0.8}, 100.0)
    own = finding("thruster_gain", {"factor": 0.9}, 0.05, "port", p=0.5)
    for parameters in ({"factor": 0.8, "otherwise": 0.9}, {"factor": 0.72}):
        found = finding("thruster_gain", parameters, 0.05, "port", onset=101.0)
        scores = score_recorded([plain([own]), case((weak,), [found], kind="span", level=None)], [])
        every = scores.recoveries[0]
        assert every.errors == pytest.approx([0.0], abs=1e-9)
        assert every.in_time.value == 1.0


def test_an_effect_that_began_within_a_recording() -> None:
    weak = Truth("thruster_gain", "port", {"factor": 0.8}, 100.0)
    hint = finding("thruster_gain", {"factor": 0.82}, 0.05, "port", p=0.5, onset=103.0)
    scores = score_recorded([plain([]), case((weak,), [hint], kind="span", level=None)], [])
    assert scores.responses == ()
    (later,) = scores.later
    assert (later.onset_s, later.named, later.noticed, later.found_s) == (100.0, False, True, 103.0)
    assert scores.noticed_recoveries[0].in_time.value == 1.0


def test_what_the_recording_has_already_is_left_out() -> None:
    arm = finding("lever_arm", {"x": 1.0, "y": 0.0})
    scores = score_recorded([plain([arm]), case((ARM,), [arm])], [])
    assert scores.right.of == 0
    (response,) = scores.responses
    assert response.present
    assert response.curve is None
    # One metre of its own and one concealed are two, of which one is found.
    assert [(one.parameter, one.expected, one.found) for one in scores.moved] == [("x", 2.0, 1.0), ("y", 0.0, 0.0)]


def test_factors_of_an_effect_and_of_the_recording_multiply() -> None:
    weak = Truth("velocity_scale", None, {"factor": 0.8})
    own, after = (finding("velocity_scale", {"factor": value}, p=0.4) for value in (0.9, 0.73))
    scores = score_recorded([plain([own]), case((weak,), [after])], [])
    assert [(one.before, one.expected, one.found) for one in scores.moved] == [(0.9, pytest.approx(0.72), 0.73)]
    scores = score_recorded([plain([own]), case((weak,), [])], [])
    assert scores.moved[0].found is None


def test_an_error_below_what_is_named_counts_as_the_recordings_own() -> None:
    arm = case((ARM,), [finding("lever_arm", {"x": 1.3, "y": 0.0}, 0.2)])
    assert score_recorded([plain([]), arm], []).recoveries[0].covered.value == 0.5
    scores = score_recorded([plain([]), arm], [], {("a", "lever_arm"): {"x": 0.28}})
    assert scores.recoveries[0].covered.value == 1.0
    assert scores.recoveries[0].errors == pytest.approx([0.015625])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        (("--vessel", "milliampere"), "--vessel: the profile of a real recording, found no --real"),
        (("--real", "none.toml"), "none.toml: cannot be read as a list of recordings"),
        (("--real", str(BAG), "--vessel", "milliampere"), "no recording can be used. The first: "),
    ],
)
def test_the_command_refuses_in_one_line(ferryid_run: Any, tmp_path: Path, given: tuple[str, ...], wanted: str) -> None:
    run = ferryid_run("prove", *given, "--processes", "1", "--out", tmp_path / "out")
    assert run.code == 2
    (line,) = run.err.splitlines()
    assert wanted in line
    assert "Fix: " in line
    assert not (tmp_path / "out").exists()


def test_of_two_effects_either_has_its_own_outcome() -> None:
    weak = Truth("thruster_gain", "port", {"factor": 0.8})
    arm, hint = (
        finding("lever_arm", {"x": 1.1, "y": 0.0}, 0.2),
        finding("thruster_gain", {"factor": 0.8}, 0.1, "port", p=0.5),
    )
    both = [finding("thruster_gain", {"factor": 0.8}, 0.1, "port"), arm]
    cases = [case((weak, ARM), found, kind="pair", level=None) for found in (both, [arm, hint], [])]
    scores = score_recorded([plain([]), *cases], [])
    assert [one.named for one in scores.pairs] == [(True, True), (False, True), (False, False)]
    assert [one.noticed for one in scores.pairs] == [(True, True), (True, True), (False, False)]
    # Right is what has both names, and neither is wrong.
    assert (scores.right.count, scores.wrong.count) == (1, 0)
    assert scores.responses == ()


def test_doses_are_counted_by_the_multiple_of_the_oracles_size() -> None:
    arm = finding("lever_arm", {"x": 1.1, "y": 0.0}, 0.2)
    cases = [
        case((ARM,), found, size=size, oracle_size=0.5)
        for size, found in ((0.3, []), (1.0, [arm]), (1.3, []), (2.5, [arm]))
    ]
    scores = score_recorded([plain([]), *cases], [])
    (response,) = scores.responses
    assert response.doses.multiples == pytest.approx((0.6, 2.0, 2.6, 5.0))
    assert (response.doses.at_twice.count, response.doses.at_twice.of) == (1, 2)
    (target,) = [one for one in recorded_targets(scores) if "twice the oracle's size" in one.what]
    assert target.reached is not True
    # Doses without an oracle's size are none of these.
    assert score_recorded([plain([]), case((ARM,), [arm])], []).responses[0].doses.multiples == ()


def test_doses_are_counted_by_the_distinct_size() -> None:
    arm = finding("lever_arm", {"x": 1.1, "y": 0.0}, 0.2)
    cases = [
        case((ARM,), found, size=size, oracle_size=0.5, distinct_size=least)
        for size, found, least in ((1.0, [], 0.8), (1.0, [arm], 0.5), (4.0, [], 0.5), (9.0, [arm], 0.0))
    ]
    scores = score_recorded([plain([]), *cases], [])
    share = from_twice_distinct(scores.responses)
    assert (share.count, share.of) == (1, 2)
    (target,) = [one for one in recorded_targets(scores) if "twice the distinct size" in one.what]
    assert "50.0 % (1/2)" in target.what
    text = " ".join(page(RUN, scores).split())
    assert "Named from twice the distinct size on: 50.0 % (1/2)" in text
    assert "(sensors 1/2)" in text
    # Answers of a run before there was one lack it.
    assert not any(
        "distinct" in one.what for one in recorded_targets(score_recorded([plain([]), case((ARM,), [arm])], []))
    )


def test_of_a_record_that_is_wrong_altogether_nothing_may_be_named() -> None:
    truth = Truth("mirrored_axis", None, {})
    cases = [case((truth,), found, kind="gross", level=None) for found in ([], [finding("wind")])]
    refused = replace(
        cases[0],
        diagnosis=Diagnosis("refused", 1.0, error="/a/vessel.toml: The positions are mirrored. Fix: see frame"),
    )
    scores = score_recorded([plain([]), *cases, refused], [])
    assert [one.named for one in scores.gross] == [(), ("wind",), ()]
    assert [one.noticed for one in scores.gross] == [False, False, True]
    assert scores.gross[2].outcome.startswith("The positions are mirrored.")
    assert (scores.wrong.count, scores.wrong.of) == (1, 3)
    assert scores.right.of == 0
