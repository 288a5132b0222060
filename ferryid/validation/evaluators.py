"""The validation run as it is: what draws and writes its cases, what evaluates them, and what becomes of all that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ferryid.validation.case import Truth
from ferryid.validation.case_sampling import sample_cases
from ferryid.validation.interfaces import Evaluator, Pipeline, Trial
from ferryid.validation.log_generation import generate, profile_with_hull, realised_parameters
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.records import RIVALS, CaseResult, OracleResult, RivalDiagnoses, TransferResult
from ferryid.vessel.profile import Profile

RIVALS_EVERY = 5
"""Rivals run on one log in so many: they take longer than a diagnosis. The numbers of cases are random."""

CLEAN_SPAN_S = (100.0, 200.0)
"""When what only passes is estimated in a clean log, to learn what it gains by chance."""


def pipeline() -> Pipeline:
    """Return what a validation run is put together from."""
    evaluators = {
        "oracle": Evaluator(evaluate_oracle, OracleResult),
        "transfer": Evaluator(evaluate_transfer, TransferResult),
        RIVALS: Evaluator(evaluate_rivals, RivalDiagnoses),
    }
    return Pipeline(sample_cases, generate, realised_parameters, evaluators, _score, _targets, _render)


def evaluate_oracle(trial: Trial) -> OracleResult | None:
    """Return the oracle's estimates of what is in a log; in a clean log, those of every effect, gained by chance."""
    # What evaluates is heavy, and drawing need not wait for it.
    from ferryid.validation.oracle import oracle, oracle_of_each
    from ferryid.vessel import load_profile

    if trial.more:
        return _oracle_of_campaign(trial)
    profile = load_profile(trial.profile)
    if trial.case.kind == "clean":
        return oracle_of_each(str(trial.log), profile, _every_effect(profile))
    if not trial.case.truths:
        return None
    return oracle(str(trial.log), profile, trial.case.truths)


def _oracle_of_campaign(trial: Trial) -> OracleResult:
    """Return the oracle's estimates in a campaign: it is given the hull model that the diagnosis has to find."""
    from ferryid.validation.campaign_oracle import campaign_oracle
    from ferryid.vessel import load_profile

    path = trial.folder / "vessel.toml"
    path.write_text(profile_with_hull(trial.case), encoding="utf-8")
    logs = [str(log) for log in (trial.log, *trial.more)]
    return campaign_oracle(logs, load_profile(path), trial.case.truths, trial.case.first_log)


def evaluate_transfer(trial: Trial) -> TransferResult | None:
    """Return the scores of the diagnosed model, and in one case of `RIVALS_EVERY` of the rivals, on a transfer log."""
    from ferryid.validation import rivals as learners
    from ferryid.validation.transfer_test import transfer
    from ferryid.vessel import load_profile

    if trial.more:
        return None
    rivals = learners.RIVALS if int(trial.case.name) % RIVALS_EVERY == 0 else {}
    if trial.model is None and not rivals:
        # Where nothing was found, nothing is claimed.
        return None
    other = generate(trial.case, trial.folder, transfer=True)
    profile, out = load_profile(trial.profile), trial.folder / "out"
    return transfer(str(trial.log), str(other.log), profile, out, diagnosed=trial.model, rivals=rivals).scores()


def evaluate_rivals(trial: Trial) -> RivalDiagnoses | None:
    """Return what rivals name in one case of `RIVALS_EVERY`, as the diagnosis: of the log alone."""
    from ferryid.validation.rivals.naming import diagnoses
    from ferryid.vessel import load_profile

    if trial.more or int(trial.case.name) % RIVALS_EVERY:
        return None
    return diagnoses(str(trial.log), load_profile(trial.profile), trial.folder / "rivals")


def _score(results: Sequence[CaseResult]) -> Any:
    from ferryid.validation.scores import score

    return score(results)


def _targets(scores: Any) -> Any:
    from ferryid.validation.targets import targets

    return targets(scores)


def _render(result: Mapping[str, Any], scores: Any) -> Mapping[str, str]:
    from ferryid.validation.page import figures, page

    drawn = {f"proof/{name}": text for name, text in figures(scores).items()}
    return {"proof.md": page(result, scores), **drawn}


def _every_effect(profile: Profile) -> list[Truth]:
    """Return every effect that a vessel can have, without its size."""
    from ferryid.effects import effects

    library = effects()

    def truth(name: str, instance: str | None) -> Truth:
        # What only passes cannot act all along.
        times = CLEAN_SPAN_S if name in library and library[name].passing else (None, None)
        return Truth(name, instance, {}, *times)

    return [
        truth(name, instance)
        for name in plant_effects()
        for instance in (library[name].instances(profile) if name in library else (None,))
    ]
