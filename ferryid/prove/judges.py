"""The proof as it is: what draws and writes its cases, who is asked once the answers are open, and what becomes of all that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ferryid.files import finite
from ferryid.prove.draw import drawn
from ferryid.prove.generate import generate
from ferryid.prove.parts import Parts, Trial

RIVALS = ("thesis", "sindy", "stepwise")
EVERY = 5
"""Rivals are asked of one log in so many: they take longer than a diagnosis. Numbers of cases tell nothing of what they are."""


def parts() -> Parts:
    """Return what the proof is put together from."""
    return Parts(draw=drawn, generate=generate, judges={"oracle": oracle, "second": second}, score=scored, tell=told)


def oracle(trial: Trial) -> Any:
    """Return what can be told of a log by somebody who knows what is in it, but not how large.

    In a clean log it is told one effect after another: what it gains there, it gains by chance.
    """
    # What judges is heavy, and who draws need not wait for it.
    from ferryid.prove.conceal import HIDINGS
    from ferryid.prove.oracle import oracle as told_of
    from ferryid.prove.oracle import oracle_of_each
    from ferryid.vessel import load_profile

    profile = load_profile(trial.profile)
    if trial.case.kind == "clean":
        return finite(oracle_of_each(str(trial.log), profile, _every(profile, HIDINGS)).as_json())
    if not trial.case.truths:
        return None
    return finite(told_of(str(trial.log), profile, trial.case.truths).as_json())


def second(trial: Trial) -> Any:
    """Return what the diagnosed model, and in one case of `EVERY` the rivals, are worth in another log of the same truth."""
    from ferryid.prove.rivals import RIVALS as LEARNERS
    from ferryid.prove.second import second as judged
    from ferryid.vessel import load_profile

    asked = LEARNERS if int(trial.case.name) % EVERY == 0 else {}
    if trial.model is None and not asked:
        # Where nothing was found, nothing is claimed.
        return None
    other = generate(trial.case, trial.folder, again=True)
    profile, out = load_profile(trial.profile), trial.folder / "out"
    return finite(judged(str(trial.log), str(other.log), profile, out, diagnosed=trial.model, rivals=asked))


def scored(trials: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Return the targets, and all figures of merit."""
    from ferryid.prove.page import targets
    from ferryid.prove.score import score, to_json

    scores = score(lines_of(trials))
    return {"targets": targets(scores), "scores": to_json(scores)}


def told(result: Mapping[str, Any], trials: Sequence[Mapping[str, Any]]) -> Mapping[str, str]:
    """Return the page and its figures, by name in the folder of the proof."""
    from ferryid.prove.page import figures, page
    from ferryid.prove.score import score

    scores = score(lines_of(trials))
    drawn_figures = {f"proof/{name}": text for name, text in figures(scores).items()}
    return {"proof.md": page(result, scores), **drawn_figures}


def lines_of(trials: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return cases with all that was said of them as `ferryid.prove.score.score` takes them."""
    lines = []
    for trial in trials:
        diagnosis, judged = trial["diagnosis"], trial["second"] or {}
        seen = trial["oracle"] or {}
        named = {name: judged[name]["names"] for name in RIVALS if "names" in judged.get(name, {})}
        lines.append(
            {
                "case": trial["case"],
                "acted": trial["acted"],
                "told": diagnosis,
                "seconds": diagnosis["seconds"],
                "oracle": None if "error" in seen else seen,
                "second": {} if "error" in judged else judged,
                "rival_names": {name: [one["effect"] for one in some] for name, some in named.items()},
            }
        )
    return lines


def _every(profile: Any, known: Mapping[str, Any]) -> list[Any]:
    """Return every effect that a vessel can have, as something to be told."""
    from ferryid.effects import effects
    from ferryid.prove.case import Truth

    library = effects()
    return [
        Truth(name, instance, {})
        for name in known
        for instance in (library[name].instances(profile) if name in library else (None,))
    ]
