"""The proof: draw, write logs, seal the answers, diagnose blind, open the seal, judge and score.

All of it lies in one folder: ``logs`` and ``models``, a folder for each case, which are all that a diagnosing process sees;
``seal.json`` and ``answers.sealed``, and afterwards ``answers.json``; ``lines``, what is finished; ``result.json``, and
``proof.md`` with its figures. A run that was killed goes on there when it is started again with the same seed.
"""

from __future__ import annotations

import secrets
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from shlex import quote
from typing import Any

from ferryid import __version__
from ferryid.batch.spread import spread
from ferryid.errors import FerryIdError
from ferryid.files import alone, dump_json, finite, write_text
from ferryid.prove.case import Case, case_of
from ferryid.prove.desk import Desk, desk, sweep
from ferryid.prove.finished import carry_out
from ferryid.prove.guard import python_rooms
from ferryid.prove.parts import Generate, Parts, Trial
from ferryid.prove.seal import lay_open, open_seal, opened, seal, sealed
from ferryid.prove.sources import sources
from ferryid.prove.tasks import Log, diagnosed, judged, write

SCHEMA = "ferryid.prove/1"
SEED_BITS = 48
REACHED = {True: "reached", False: "MISSED ", None: "open   "}
"""How targets are told; one is open that was reached, while its interval allows either."""


def prove(
    out: Path,
    parts: Parts,
    *,
    seed: int | None = None,
    runs: float = 1.0,
    only: Sequence[str] = (),
    processes: int = 1,
    dask: str | None = None,
    progress: Callable[[str], None],
    tell: Callable[[str], None],
) -> dict[str, Any]:
    """Conceal physics in trials, diagnose them blind, and score what was said against the answers.

    Parameters
    ----------
    out
        Output folder; the proof goes into ``proof`` below it. On a cluster, all workers must see it under the same path.
    parts
        What draws, writes, judges and scores.
    seed
        Of the draw; a fresh one where None.
    runs, only
        How many cases, and of which cells, as `parts` takes them.
    processes, dask
        What to spread the work over: see `ferryid.batch.spread.spread`.
    progress
        Called with each stage, what of it is done and the time left.
    tell
        Called with single lines that are to be kept: the seed, the commitment.

    Returns
    -------
    dict
        Schema ``ferryid.prove/1``.

    Raises
    ------
    FerryIdError
        For a seed or a cluster that cannot be used, for answers that were changed, and where a log cannot be written.
    """
    seed = _seed(seed)
    cases = parts.draw(seed, runs, only)
    folder = (out / "proof").resolve()
    python_rooms(folder)
    tell(f"seed {seed}; if interrupted, go on with: {_again(seed, runs, only, out)}")
    with alone(folder, wait=False), ExitStack() as last, spread(processes, dask) as workers:
        at = desk(folder, seed, {"runs": runs, "only": list(only)}, tell)
        # Nothing half-done is left, however this ends: by then nobody works there any more.
        last.callback(sweep, folder)
        do = partial(carry_out, spread=workers, progress=progress)

        written = _written(do, at, cases, parts.generate)
        acted = {name: one["acted"] for name, one in written.items()}
        bound = _sealed(at, {"seed": seed, "cases": [case.as_json() for case in cases], "acted": acted})
        tell(f"{len(cases)} answers are sealed: {bound}")

        logs = {name: Log(at.folder, at.sources, name, one["log"], one["profile"]) for name, one in written.items()}
        diagnoses = do("diagnosing", at.lines("diagnosed"), logs, diagnosed)
        if any(not isinstance(one, dict) or "verdict" not in one for one in diagnoses.values()):
            raise _damaged(at.lines("diagnosed"))
        answers = lay_open(at.folder, at.key)

        trials = {
            case["name"]: _trial(at, logs[case["name"]], case, answers["acted"][case["name"]], diagnoses[case["name"]])
            for case in answers["cases"]
        }
        said = {
            name: do(name, at.lines(f"{name}-{sources(judging=True)}"), trials, partial(judged, judge))
            for name, judge in parts.judges.items()
        }
    progress("scoring")
    every = [
        {"case": trial.case.as_json(), "acted": trial.acted, "diagnosis": trial.diagnosis}
        | {judge: of[name] for judge, of in said.items()}
        for name, trial in trials.items()
    ]
    scored = parts.score(every)
    result = finite(
        {
            "schema": SCHEMA,
            "ferryid_version": __version__,
            "sources": at.sources,
            "seed": seed,
            "commitment": bound,
            "guard": _guard(diagnoses.values()),
            "counts": {"cases": len(cases), **_counts(diagnoses.values())},
            "folder": str(out / "proof"),
            "settings": {"runs": runs, "only": list(only)},
            "targets": scored["targets"],
            "scores": scored["scores"],
        }
    )
    for name, text in ({} if parts.tell is None else parts.tell(result, every)).items():
        (folder / name).parent.mkdir(exist_ok=True)
        write_text(folder / name, text)
    write_text(folder / "result.json", dump_json(result))
    progress("")
    return dict(result)


def _seed(seed: int | None) -> int:
    if seed is None:
        return secrets.randbits(SEED_BITS)
    if seed < 0:
        raise FerryIdError(f"--seed: {seed} is no seed. Fix: give a whole number from 0 on, or leave it out")
    return seed


def _again(seed: int, runs: float, only: Sequence[str], out: Path) -> str:
    cells = f" --only {quote(','.join(only))}" if only else ""
    return f"ferryid prove --seed {seed} --runs {runs:g}{cells} --out {quote(str(out))}"


def _written(do: Any, at: Desk, cases: Sequence[Case], generate: Generate) -> dict[str, dict[str, Any]]:
    """Write the logs of all cases; what their effects did is an answer, and stands sealed in the file of what is finished."""
    logs, path = at.folder / "logs", at.lines("written")
    # A log that somebody has removed is written again; it comes out the same.
    at.forget("written", [case.name for case in cases if not (logs / case.name).is_dir()])
    work = {case.name: case for case in cases}
    lines = do("writing logs", path, work, partial(write, generate, logs), hidden=lambda one: sealed(one, at.key).hex())
    return {name: opened(_bytes(line, path), at.key, str(path)) for name, line in lines.items()}


def _bytes(line: Any, path: Path) -> bytes:
    try:
        return bytes.fromhex(line)
    except (TypeError, ValueError) as error:
        raise _damaged(path) from error


def _damaged(path: Path) -> FerryIdError:
    return FerryIdError(
        f"{path}: holds a line that no proof has written. Fix: remove the file, its cases are done again"
    )


def _sealed(at: Desk, answers: Mapping[str, Any]) -> str:
    """Seal the answers and return the commitment; what was sealed before must be the same."""
    if not (at.folder / "seal.json").exists():
        if at.lines("diagnosed").exists():
            raise FerryIdError(
                f"{at.folder}: logs were diagnosed there, and seal.json is gone. Fix: choose a new folder with --out"
            )
        return seal(at.folder, answers, at.key, at.sources)
    bound, before = open_seal(at.folder, at.key)
    if before != finite(answers):
        raise FerryIdError(
            f"{at.folder}: what was sealed there is not what this seed draws. Fix: choose a new folder with --out"
        )
    return bound


def _trial(at: Desk, log: Log, case: Mapping[str, Any], acted: Any, diagnosis: Mapping[str, Any]) -> Trial:
    model = None if diagnosis["model"] is None else log.out / diagnosis["model"]
    folder = at.folder / "again" / log.name
    return Trial(case_of(case), acted, log.folder / log.log, log.folder / log.profile, diagnosis, model, folder)


def _guard(diagnoses: Iterable[Mapping[str, Any]]) -> str:
    """Return what kept the answers from every one of the diagnoses: the weakest, where machines differ."""
    return min((str(one["guard"]) for one in diagnoses), key=len, default="")


def _counts(diagnoses: Iterable[Mapping[str, Any]]) -> dict[str, int]:
    verdicts = Counter(one["verdict"] for one in diagnoses)
    lost = {name: verdicts[name] for name in ("refused", "crashed")}
    return {"diagnosed": verdicts.total() - sum(lost.values()), **lost}


def render_proof(result: Mapping[str, Any]) -> str:
    """Return a short account of a proof as text."""
    counts = result["counts"]
    lines = [
        f"{counts['cases']} cases of seed {result['seed']}: {counts['diagnosed']} diagnosed, {counts['refused']} refused, "
        f"{counts['crashed']} crashed",
        *(f"  {REACHED[one['reached']]}  {one['what']}" for one in result["targets"]),
        f"guard:  {result['guard']}",
        f"sealed: {result['commitment']}",
        f"page:   {result['folder']}/proof.md",
    ]
    return "\n".join(lines)
