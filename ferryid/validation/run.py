"""The validation run: draw, commit to the answers, write logs, diagnose blind, publish the answers, evaluate and score.

All of it lies in one folder: ``logs`` and ``models``, a folder for each case, where a diagnosing process reads and writes;
``seal.json`` with the commitment, and afterwards ``answers.json``; ``lines``, the checkpoints; ``result.json``, and
``proof.md`` with its figures. A run that was killed goes on there when it is started again with the same seed.
"""

from __future__ import annotations

import secrets
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from shlex import quote
from typing import Any, TypeVar

from ferryid import __version__
from ferryid.batch.spread import Spread, spread
from ferryid.errors import FerryIdError
from ferryid.files import alone, dump_json, finite, resolved, write_text
from ferryid.json_record import Record
from ferryid.validation.case import Case
from ferryid.validation.checkpoint import discard, run_stage
from ferryid.validation.commitment import SEAL_FILE, commitment, publish_answers, publish_commitment, read_seal
from ferryid.validation.interfaces import Pipeline, Trial
from ferryid.validation.pace import Pace
from ferryid.validation.recorded.summary import size_lines
from ferryid.validation.records import CaseResult, Diagnosis, Failure
from ferryid.validation.run_folder import RESULT_FILE, RunFolder, open_run_folder, remove_temporary
from ferryid.validation.source_hash import source_hash
from ferryid.validation.stages import CaseFiles, LogJob, diagnose_case, evaluate_case, write_case

SCHEMA = "ferryid.prove/1"
SEED_BITS = 48
WRITING, DIAGNOSING = "writing logs", "diagnosing"
Result = TypeVar("Result", bound=Record)
GUARD = "process"
"""What keeps the answers from a diagnosis: no answer is on disk, and its process is given log and profile alone."""


def run_validation(
    out: Path,
    pipeline: Pipeline,
    *,
    seed: int | None = None,
    runs: float = 1.0,
    only: Sequence[str] = (),
    processes: int = 1,
    dask: str | None = None,
    progress: Callable[[str], None],
    announce: Callable[[str], None],
) -> dict[str, Any]:
    """Inject effects into simulated trials, diagnose them blind, and score the findings against the answers.

    Parameters
    ----------
    out
        Output folder; the run goes into ``proof`` below it. On a cluster, all workers must see it under the same path.
    pipeline
        What draws, writes, evaluates and scores.
    seed
        Of the draw; a fresh one where None.
    runs, only
        How many cases, and of which cells, as `pipeline` takes them.
    processes, dask
        What to spread the work over: see `ferryid.batch.spread.spread`.
    progress
        Called with each stage, what of it is done and the time left.
    announce
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
    seed = _checked_seed(seed)
    cases = pipeline.draw(seed, runs, only)
    settings = {"runs": runs, "only": list(only), **pipeline.recordings}
    path = resolved(out / pipeline.folder)
    for line in pipeline.remarks():
        announce(line)
    announce(f"seed {seed}; if interrupted, go on with: {_resume_command(seed, runs, only, out, pipeline.recordings)}")
    with alone(path, wait=False), ExitStack() as last, spread(processes, dask) as workers:
        folder = open_run_folder(path, seed, _request(settings, pipeline), announce)
        # Nothing half-done is left, however this ends: by then nobody works there any more.
        last.callback(remove_temporary, path)
        pace = Pace((WRITING, DIAGNOSING, *pipeline.evaluators), len(cases))
        stage = partial(run_stage, workers=workers, progress=progress, pace=pace)

        answers = _answers(seed, cases, pipeline, workers, progress)
        committed = _commit(folder, answers)
        announce(f"commitment to {len(cases)} answers: {committed}")

        jobs = _written_logs(stage, folder, cases, pipeline)
        lines = folder.lines("diagnosed")
        diagnoses = _parsed(Diagnosis, lines, stage(DIAGNOSING, lines, jobs, diagnose_case))
        publish_answers(path, answers, folder.salt)

        trials = {case.name: _trial(path, case, jobs[case.name], diagnoses[case.name]) for case in cases}
        evaluations: dict[str, dict[str, Record | None]] = {}
        for name, evaluator in pipeline.evaluators.items():
            lines = folder.lines(f"{name}-{source_hash(evaluation=True)}")
            found = stage(name, lines, trials, partial(evaluate_case, evaluator.function))
            evaluations[name] = {case: _evaluation(evaluator.result, one, lines) for case, one in found.items()}
    progress("scoring")
    scores = pipeline.score(
        [
            CaseResult(
                case,
                answers["realised"][case.name],
                diagnoses[case.name],
                {name: found[case.name] for name, found in evaluations.items()},
            )
            for case in cases
        ]
    )
    result = finite(
        {
            "schema": SCHEMA,
            "ferryid_version": __version__,
            "sources": folder.sources,
            "seed": seed,
            "commitment": committed,
            "guard": GUARD if diagnoses else "",
            "counts": {"cases": len(cases), **_counts(diagnoses.values())},
            "folder": str(out / pipeline.folder),
            "settings": settings,
            "targets": [one.to_json() for one in pipeline.targets(scores)],
            "scores": scores.to_json(),
        }
    )
    for name, text in ({} if pipeline.render is None else pipeline.render(result, scores)).items():
        (path / name).parent.mkdir(exist_ok=True)
        write_text(path / name, text)
    write_text(path / RESULT_FILE, dump_json(result))
    progress("")
    return dict(result)


def _checked_seed(seed: int | None) -> int:
    if seed is None:
        return secrets.randbits(SEED_BITS)
    if seed < 0:
        raise FerryIdError(f"--seed: {seed} is negative. Fix: give a whole number from 0 on, or leave it out")
    return seed


def _request(settings: Mapping[str, Any], pipeline: Pipeline) -> dict[str, Any]:
    """Return what decides which cases there are: the settings, and for real recordings their fingerprint."""
    return {**settings, "fingerprint": pipeline.fingerprint} if pipeline.fingerprint else dict(settings)


def _resume_command(seed: int, runs: float, only: Sequence[str], out: Path, recordings: Mapping[str, str]) -> str:
    cells = f" --only {quote(','.join(only))}" if only else ""
    real = "".join(f" --{name} {quote(value)}" for name, value in recordings.items())
    return f"ferryid prove{real} --seed {seed} --runs {runs:g}{cells} --out {quote(str(out))}"


def _answers(
    seed: int, cases: Sequence[Case], pipeline: Pipeline, workers: Spread, progress: Callable[[str], None]
) -> dict[str, Any]:
    """Return all answers as plain data; nothing of them is kept on disk, so that a run that goes on makes them again."""
    progress("answers")
    realised = dict(workers.over(pipeline.realise, cases))
    progress("")
    return {
        "seed": seed,
        "cases": [case.to_json() for case in cases],
        "realised": {case.name: finite(realised[number]) for number, case in enumerate(cases)},
    }


def _commit(folder: RunFolder, answers: Mapping[str, Any]) -> str:
    """Publish the commitment and return it; one that was published before must be the same."""
    path = folder.path / SEAL_FILE
    if not path.exists():
        if folder.lines("diagnosed").exists():
            raise FerryIdError(
                f"{folder.path}: logs were diagnosed there, and {SEAL_FILE} is gone. Fix: choose a new folder with --out"
            )
        return publish_commitment(folder.path, answers, folder.salt, folder.sources)
    committed = commitment(finite(answers), folder.salt)
    if read_seal(folder.path)["commitment"] != committed:
        raise FerryIdError(f"{path}: not the commitment to what this seed draws. Fix: choose a new folder with --out")
    return committed


def _written_logs(stage: Any, folder: RunFolder, cases: Sequence[Case], pipeline: Pipeline) -> dict[str, LogJob]:
    """Write the logs of all cases."""
    logs, lines = folder.path / "logs", folder.lines("written")
    # A log that somebody has removed is written again; it comes out the same.
    discard(lines, [case.name for case in cases if not (logs / case.name).is_dir()])
    work = {case.name: case for case in cases}
    written = stage(WRITING, lines, work, partial(write_case, pipeline.generate, logs))
    return {
        name: LogJob(folder.path, folder.sources, name, files.log, files.profile, files.more, files.before)
        for name, files in _parsed(CaseFiles, lines, written).items()
    }


def _parsed(kind: type[Result], lines: Path, found: Mapping[str, Any]) -> dict[str, Result]:
    try:
        return {name: kind.from_json(one) for name, one in found.items()}
    except ValueError as error:
        raise _damaged(lines) from error


def _evaluation(kind: type[Record], found: Any, lines: Path) -> Record | None:
    if found is None:
        return None
    try:
        return Failure.from_json(found) if set(found) == {"error"} else kind.from_json(found)
    except (ValueError, TypeError) as error:
        raise _damaged(lines) from error


def _damaged(path: Path) -> FerryIdError:
    return FerryIdError(
        f"{path}: holds a line that ferryid has not written. Fix: remove the file, its cases are done again"
    )


def _trial(path: Path, case: Case, job: LogJob, diagnosis: Diagnosis) -> Trial:
    model = None if diagnosis.model is None else job.out / diagnosis.model
    folder = path / "transfer" / case.name
    more = tuple(job.folder / name for name in job.more)
    return Trial(case, job.folder / job.log, job.folder / job.profile, diagnosis, model, folder, more)


def _counts(diagnoses: Any) -> dict[str, int]:
    verdicts = Counter(one.verdict for one in diagnoses)
    lost = {name: verdicts[name] for name in ("refused", "crashed")}
    return {"diagnosed": verdicts.total() - sum(lost.values()), **lost}


def render_summary(result: Mapping[str, Any]) -> str:
    """Return a short account of a run as text."""
    counts = result["counts"]
    lines = [
        f"{counts['cases']} cases of seed {result['seed']}: {counts['diagnosed']} diagnosed, {counts['refused']} refused, "
        f"{counts['crashed']} crashed",
        *size_lines(result.get("scores", {}).get("responses", ())),
        *(f"  {_outcome(one):<10}  {one['what']}" for one in result["targets"]),
        f"commitment: {result['commitment']}",
        f"page:       {result['folder']}/{Path(result['folder']).name}.md",
    ]
    return "\n".join(lines)


def _outcome(target: Mapping[str, Any]) -> str:
    """Return whether a target was reached; it is open where the interval of its value allows either."""
    if not target.get("tested", True):
        return "not tested"
    if target["reached"] is None or not target["sure"]:
        return "open"
    return "reached" if target["reached"] else "MISSED"
