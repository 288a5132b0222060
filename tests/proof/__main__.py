"""Writes reports/proof.md from the stored results of the proofs: ``python -m tests.proof [FOLDER]``.

``proof.json``, ``proof-sea.json`` and ``proof-real.json`` in the folder are what `ferryid prove` wrote; any may be missing.
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ferryid.counts import counted
from ferryid.effects.wording import listed
from ferryid.files import write_text
from ferryid.validation.case_sampling import SEA_LOGS
from ferryid.validation.name_scores import Share
from ferryid.validation.page import page
from ferryid.validation.page_parts import command, few
from ferryid.validation.recorded.doses import joined, pooled
from ferryid.validation.recorded.page import page as page_of_recordings
from ferryid.validation.recorded.scores import RecordedScores, from_twice_distinct
from ferryid.validation.records import DIAGNOSED
from ferryid.validation.rival_scores import RivalScores
from ferryid.validation.scores import Detection, Scores
from ferryid.validation.source_hash import EVALUATION, source_hash
from tests.evidence import ROOT, ages, stamp
from tests.real import withheld

REPORTS = ROOT / "reports"
SIMULATED, SEA, REAL, PAGE = "proof.json", "proof-sea.json", "proof-real.json", "proof.md"
Result = Mapping[str, Any]
MULTIPLE = 2.0
"""Of the oracle's size, at which nine in ten ought to be named."""


def main(folder: Path) -> None:
    """Write the page of a folder."""
    found = {
        name: json.loads((folder / name).read_text("utf-8"))
        for name in (SIMULATED, SEA, REAL)
        if (folder / name).exists()
    }
    if not found:
        sys.exit(
            f"{folder}: none of {SIMULATED}, {SEA} and {REAL}. Fix: run make proof, make proof-sea or make proof-real"
        )
    hidden = [] if REAL not in found else withheld.section(folder)
    write_text(folder / PAGE, joint_page(found.get(SIMULATED), found.get(REAL), hidden, found.get(SEA)))
    stamp(folder / PAGE)


def joint_page(
    simulated: Result | None, real: Result | None, hidden: Sequence[str] = (), sea: Result | None = None
) -> str:
    """Return the page of results of `ferryid prove`, any of which may be None, with the section on what was withheld."""
    parts = [
        *([] if simulated is None else [Part.of_trials(simulated)]),
        *([] if sea is None else [Part.of_campaigns(sea)]),
        *([] if real is None else [Part.of_recordings(real)]),
    ]
    answered = [(question, [f"{one.name}: {one.answers[question]}" for one in parts]) for question in QUESTIONS]
    lines = [
        "# Proof: what `ferryid diagnose` finds of effects that were concealed from it",
        "",
        *(f"- **{question}** {'; '.join(said)}." for question, said in answered),
        f"- **How could I check it?** {CHECK}; {_repeat(simulated, sea, real)} repeat the draws, another `SEED` draws others.",
        "",
        SIDE_BY_SIDE,
        *_rows(parts),
        *(["", *hidden] if hidden else []),
        *_rivals(parts),
    ]
    for one in parts:
        lines += ["", re.sub(r"^#", "##", one.text, flags=re.MULTILINE).strip()]
    return "\n".join(lines) + "\n"


def _repeat(*results: Result | None) -> str:
    """Return the targets that draw the same again."""
    targets = zip(("proof", "proof-sea", "proof-real"), results, strict=True)
    made = [
        f"`make {target} SEED={result['seed']} RUNS={result['settings']['runs']:g}`"
        for target, result in targets
        if result is not None
    ]
    return listed(made)


@dataclass(frozen=True)
class Part:
    """One of the proofs.

    Attributes
    ----------
    name
        Of it.
    answers
        To `QUESTIONS`.
    text
        Its own page.
    cells
        Cells of the table of both, by effect.
    rivals
        The diagnosis beside other methods; none where these were not run.
    """

    name: str
    answers: Mapping[str, str]
    text: str
    cells: Mapping[str, tuple[str, ...]]
    rivals: Sequence[RivalScores] = ()

    @classmethod
    def of_trials(cls, result: Result) -> Part:
        """Return that of simulated trials."""
        scores = Scores.from_json(result["scores"])
        clean = sum(one.runs for one in scores.cells if one.kind == "clean")
        every = [one.every for one in scores.cells]
        whole = Share(sum(one.count for one in every), sum(one.of for one in every))
        twice = [_from_twice(one) for one in scores.detections]
        far = Share(sum(one.count for one in twice), sum(one.of for one in twice))
        said = (
            f"{counted(scores.runs, 'trial')}, {clean} of them without an effect",
            f"{whole.text} of all sizes, invisible ones among them; "
            + (
                f"{far.text} from twice the oracle's size on"
                if far.of
                else "what the oracle needs is not known, as it sees what so few sizes show"
            ),
            f"a name that is not in the trial in {scores.false_names['all'].text}",
            ON_TRIALS,
            _sources(SIMULATED, result),
        )
        cells = {
            one.cell: (f"{sum(one.blind_named)}/{len(one.blind_named)}", one.blind.text, few(_from_twice(one)))
            for one in scores.detections
        }
        return cls("simulated", dict(zip(QUESTIONS, said, strict=True)), page(result, scores), cells, scores.rivals)

    @classmethod
    def of_campaigns(cls, result: Result) -> Part:
        """Return that of simulated campaigns at sea."""
        scores = Scores.from_json(result["scores"])
        sea = scores.sea
        assert sea is not None, "a run of campaigns at sea has scores of them"
        plain = sum(not one.effect for one in sea.campaigns)
        said = (
            f"{counted(len(sea.campaigns), 'campaign')} of {SEA_LOGS} logs, {plain} of them with the wind alone",
            f"{sea.named.text} of all sizes; {sea.named_from_twice.text} from twice what the oracle sees on; of the winds of "
            f"the day {sea.winds_from_twice.text}",
            f"a name that is not in the logs in {sea.false.text}",
            ON_CAMPAIGNS,
            _sources(SEA, result),
        )
        return cls("at sea, simulated", dict(zip(QUESTIONS, said, strict=True)), page(result, scores), {})

    @classmethod
    def of_recordings(cls, result: Result) -> Part:
        """Return that of real recordings."""
        scores = RecordedScores.from_json(result["scores"])
        plain = len(scores.unaltered)
        doses = {one.effect: one for one in pooled([each.doses for each in scores.responses])}
        twice, distinct = joined("all", doses.values()).at_twice, from_twice_distinct(scores.responses)
        every = [flag for one in scores.changes for flag in one.named]
        changed = Share(sum(every), len(every))
        said = (
            f"{counted(scores.runs - plain, 'altered recording')} beside {plain} as they were",
            f"{scores.right.text} of all sizes"
            + (f"; {twice.text} at twice the oracle's size" if twice.of else "")
            + (f"; {distinct.text} from twice the size on at which no other effect does as well" if distinct.of else "")
            + (f"; of what changed between two groups of recordings {changed.text} of all sizes" if changed.of else ""),
            f"a name neither concealed nor in the recording as it was in {scores.wrong.text}",
            f"{', '.join(one.recording for one in scores.unaltered)}, their records changed so that the effect explains them",
            _sources(REAL, result),
        )
        cells = {}
        for effect in dict.fromkeys(one.effect for one in scores.responses if one.named):
            flags = [flag for one in scores.responses if one.effect == effect for flag in one.named]
            seen = few(doses[effect].at_twice) if effect in doses else ""
            cells[effect] = (few(Share(sum(flags), len(flags))), seen)
        text = page_of_recordings(result, scores)
        return cls("real recordings", dict(zip(QUESTIONS, said, strict=True)), text, cells, scores.rivals)


QUESTIONS = (
    "How many cases?",
    "How many right?",
    "How many wrong?",
    "On what?",
    "Made by which sources?",
)
WHY: Mapping[str, str] = tomllib.loads((Path(__file__).parent / "why.toml").read_text("utf-8"))
"""Why trials and recordings differ, by effect."""
ON_TRIALS = (
    "a plant of six degrees of freedom, which shares no formula with the hypotheses, three vessels and a controller"
)
ON_CAMPAIGNS = "the same plant in logs of minutes, no hull model, a receiver that lags, gaps and an unsteady wind"
CHECK = (
    "`ferryid prove --check reports/proof`, `--check reports/proof-sea` and `--check reports/proof-real` hash the published "
    "answers against the commitments made before the first diagnosis"
)
SIDE_BY_SIDE = """## Side by side

Named of all doses, and of those that an oracle, who knows everything but the size, sees with a wide margin. The oracle's sizes
are not made alike: in a trial it estimates the effect in the log itself, in a recording its size follows from the noise.

| effect | simulated: named | 19 times in 20 from | twice the oracle's on | real: named | twice the oracle's | why they differ |
|---|--:|--:|--:|--:|--:|---|"""


RIVALS = """## Rivals on the same cases

Other methods on the cases of both proofs, all given the log and the profile alone; on the simulated trials one case in five.
Nothing but its own result makes a name of a method: no placebo and no held-out stretch lowers it. In a recording counts what a
method names in the altered one and not in the recording as it was.

- *thesis*: twelve components of 21 functions of the motion (Aurlien 2021). It has no regressor for an effect. Terms whose 95 %
  interval excludes zero count as names: those of acceleration as a load, those of squares as fouling, others as the hull.
- *weak SINDy*, *stepwise*: sparse regression on a library of terms, one or more for each nearly linear effect. The effect of a
  term that is chosen is named. Neither has a term for gusts, waves and errors of the navigation other than a delay, an antenna
  and a heading. A thruster counts, so that the right effect of the wrong thruster is wrong.
- *output error*: each effect's parameters added to a fit of the hull to segments of 10 s by prediction error, and the effect
  kept that lowers BIC most, up to four. Gusts, waves, pushes, the hull's coefficients one by one and what the checks of
  sensors find have no parameters in it.

"Of those it can name" leaves out cases of effects without a regressor, which else count as missed.

| cases | method | named right | of those it can name | named wrong | median error | s per case | refused |
|---|---|--:|--:|--:|--:|--:|--:|"""


def _rivals(parts: Sequence[Part]) -> list[str]:
    """Return the section on rivals; nothing where none were run."""
    rows = []
    for part in parts:
        for one in part.rivals:
            name = "ferryid" if one.name == DIAGNOSED else one.name
            error = "" if one.median_error is None else f"{100.0 * one.median_error:.0f} % of {one.parameters}"
            cells = (one.right.text, one.able.text, one.wrong.text, error, f"{one.seconds:.0f}", str(one.refused))
            rows.append(f"| {part.name} | {name} | {' | '.join(cells)} |")
    return ["", RIVALS, *rows] if rows else []


def _sources(name: str, result: Result) -> str:
    same = "the present ones" if result["sources"] == source_hash() else f"older than the present ones{_in(name)}"
    return f"`{result['sources']}` of version {result['ferryid_version']} ({same}), `{command(result)}`"


def _in(name: str) -> str:
    """Return in which folders that a diagnosis depends on the sources have changed since a result was made."""
    changed = [folder for age in ages() if age.page == f"reports/{name}" for folder in age.changed]
    every = [folder for folder in changed if folder.startswith("ferryid")]
    inside = [one for one in every if not f"{one.removeprefix('ferryid/')}/".startswith(EVALUATION)]
    return f", which differ in {', '.join(inside)}" if inside else ""


def _from_twice(one: Detection) -> Share:
    """Return the share of runs that were named from twice the size on that the oracle names 19 times in 20."""
    if one.oracle is None or one.oracle.size is None:
        return Share(0, 0)
    flags = [
        named for size, named in zip(one.sizes, one.blind_named, strict=True) if size >= MULTIPLE * one.oracle.size
    ]
    return Share(sum(flags), len(flags))


def _rows(parts: Sequence[Part]) -> list[str]:
    """Return a row for each effect that either has."""
    cells = {one.name: one.cells for one in parts}
    simulated, real = cells.get("simulated", {}), cells.get("real recordings", {})
    return [
        f"| {effect} | {' | '.join((*simulated.get(effect, ('', '', '')), *real.get(effect, ('', ''))))} | {why} |"
        for effect, why in WHY.items()
        if effect in simulated or effect in real
    ]


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else REPORTS)
