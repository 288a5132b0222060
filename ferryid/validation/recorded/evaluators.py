"""The proof on real recordings: what draws and writes its cases, and what becomes of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from ferryid.files import write_text
from ferryid.validation.case import Case
from ferryid.validation.interfaces import Evaluator, Pipeline, Trial
from ferryid.validation.log_generation import LogFiles
from ferryid.validation.recorded.case_sampling import NotMade, concealed, logs_of, sample_recorded
from ferryid.validation.recorded.log import cached_log
from ferryid.validation.recorded.manifest import Recording, fingerprint, load_recordings
from ferryid.validation.recorded.writing import write_log
from ferryid.validation.records import RIVALS, CaseResult, RivalDiagnoses

FOLDER = "proof-real"
"""Name of the run's folder and of its page."""


def recorded_pipeline(real: str, vessel: str | None) -> Pipeline:
    """Return what a validation run on real recordings is put together from.

    Parameters
    ----------
    real, vessel
        A manifest and None, or a log and its profile.

    Raises
    ------
    FerryIdError
        For a manifest or a log that cannot be used.
    """
    recordings = load_recordings(real, vessel)
    proof = _Proof(recordings)
    given = {"real": real} | ({} if vessel is None else {"vessel": vessel})
    return Pipeline(
        proof.draw,
        partial(generate_recorded, recordings),
        nothing_realised,
        # Of one's own recording it is the diagnosis alone that is asked about.
        {RIVALS: Evaluator(partial(evaluate_rivals, recordings), RivalDiagnoses)} if vessel is None else {},
        proof.score,
        _targets,
        _render,
        FOLDER,
        given,
        fingerprint(recordings),
        proof.remarks,
    )


def generate_recorded(recordings: Sequence[Recording], case: Case, folder: Path, *, transfer: bool = False) -> LogFiles:
    """Write the logs of a case, with its effect concealed in each, and ``vessel.toml``.

    Parameters
    ----------
    recordings
        Among which the case's is, by its name.
    case
        From `ferryid.validation.recorded.case_sampling.sample_recorded`.
    folder
        Where, made if it is not there.
    transfer
        There is no second recording of the same truth: nothing asks for one.
    """
    assert not transfer
    recording = next(one for one in recordings if one.name == case.path)
    folder.mkdir(parents=True, exist_ok=True)
    logs = logs_of(recording)
    profile = folder / "vessel.toml"
    write_text(profile, logs[0].profile.text)
    paths, before = [], []
    for number, path in enumerate(recording.before):
        before.append(write_log(cached_log(path, recording.vessel), folder, f"{case.name}-before-{number:02d}"))
    for number, log in enumerate(logs):
        for truth in case.truths:
            log = concealed(log, truth, case.seed).log
        paths.append(write_log(log, folder, case.name if len(logs) == 1 else f"{case.name}-{number:02d}"))
    return LogFiles(paths[0], profile, tuple(paths[1:]), tuple(before))


def nothing_realised(case: Case) -> dict[str, dict[str, float]]:
    """Return nothing: all parameters of what is concealed are known beforehand."""
    return {}


def evaluate_rivals(recordings: Sequence[Recording], trial: Trial) -> RivalDiagnoses | None:
    """Return what rivals name in a log; nothing of a campaign or of two groups, as they take one log."""
    from ferryid.validation.rivals.naming import diagnoses
    from ferryid.vessel import load_profile

    recording = next(one for one in recordings if one.name == trial.case.path)
    if len(recording.logs) > 1 or recording.before:
        return None
    return diagnoses(str(trial.log), load_profile(trial.profile), trial.folder / "rivals")


@dataclass
class _Proof:
    """What is known of a run besides its cases: the recordings, and what could not be made of them."""

    recordings: tuple[Recording, ...]
    not_made: tuple[NotMade, ...] = field(default=())

    def draw(self, seed: int, runs: float, only: Sequence[str]) -> Sequence[Case]:
        drawn = sample_recorded(self.recordings, seed, runs, only)
        self.not_made = drawn.not_made
        return drawn.cases

    def remarks(self) -> list[str]:
        return [one.why for one in self.not_made]

    def score(self, results: Sequence[CaseResult]) -> Any:
        from ferryid.validation.recorded.own_errors import own_errors, own_forces
        from ferryid.validation.recorded.scores import is_missed, score_recorded

        used = {(one.case.path, one.case.truths[0].effect) for one in results if one.case.truths}
        missed = {(one.case.path, one.case.truths[0].key) for one in results if one.case.truths and is_missed(one)}
        forces = own_forces(self.recordings, missed)
        return score_recorded(results, self.not_made, own_errors(self.recordings, used), forces)


def _targets(scores: Any) -> Any:
    from ferryid.validation.recorded.scores import recorded_targets

    return recorded_targets(scores)


def _render(result: Mapping[str, Any], scores: Any) -> Mapping[str, str]:
    from ferryid.validation.recorded.page import figures, page

    drawn = {f"{FOLDER}/{name}": text for name, text in figures(scores).items()}
    return {f"{FOLDER}.md": page(result, scores), **drawn}
