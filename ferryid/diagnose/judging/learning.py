"""What a fit learns from logs beyond the hull and the effects that their diagnoses name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite, nan

import numpy as np

from ferryid.cached import cached_property
from ferryid.counts import counted, verb
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.wording import listed, titled
from ferryid.errors import FerryIdError, ReversedForcesError
from ferryid.identify import (
    Acceptance,
    FitOutcome,
    FitSettings,
    accept,
    fit_opened,
    fit_remainder,
    prediction_errors,
    read_logs,
    with_remainder,
)
from ferryid.models import ForceScores, Model, ModelScores, StoredEffect, blank_model
from ferryid.models.store import check_name
from ferryid.side_by_side import over
from ferryid.signals.prepare import Opened
from ferryid.types import AXES, Flags, Floats, RunContext, by_axis
from ferryid.vessel.profile import Profile

PREFIX = "Rejected: "
MOST_ROWS_AT_ONCE = 750_000
"""Rows of the logs, half a kilobyte each, of which two fits are made side by side; of more, one after the other."""


@dataclass(frozen=True)
class Learned:
    """What was learned from what the diagnosed model leaves of the logs.

    Attributes
    ----------
    accepted
        Whether it is part of the model that is stored.
    says
        The outcome in one line.
    reasons
        Why it was accepted or not, as sentences.
    ratio
        Held-out squared prediction error with it over that without it, by axis; NaN where it is not known.
    over_fit
        That of the model that is stored over that of ``ferryid fit`` alone, by axis; 1 where that takes the place of one with
        findings, empty where nothing was named, or nothing learned.
    with_hints
        True where effects of whose name the diagnosis is in doubt are in the model, as predictions with them are better.
    fit_alone
        True where the model of ``ferryid fit`` is stored in the place of that of the diagnosis, as it predicts better.
    """

    accepted: bool
    says: str
    reasons: tuple[str, ...] = ()
    ratio: Mapping[str, float] | None = None
    over_fit: Mapping[str, float] | None = None
    with_hints: bool = False
    fit_alone: bool = False

    def to_json(self) -> dict[str, object]:
        """Return it as plain values."""
        return {
            "accepted": self.accepted,
            "says": self.says,
            "reasons": list(self.reasons),
            "per_axis": dict(self.ratio or {}),
            "over_fit": dict(self.over_fit or {}),
            "with_hints": self.with_hints,
            "fit_alone": self.fit_alone,
        }


@dataclass(frozen=True)
class _Fitted:
    """A fit without the rows of its logs but for which of them validate, shape (n,) each."""

    outcome: FitOutcome
    validation: tuple[Flags, ...]

    @classmethod
    def of(cls, outcome: FitOutcome) -> _Fitted:
        """Return what is needed of a fit: several are alive at once, and a campaign has many rows."""
        return cls(replace(outcome, logs=()), tuple(one.validation for one in outcome.logs))


@dataclass(frozen=True)
class _Candidate:
    """A model with a correction on top, to be stored and as it was judged, and the fit of that correction."""

    model: Model
    judged: Model
    fitted: _Fitted

    @property
    def outcome(self) -> FitOutcome:
        """How it was judged."""
        return self.fitted.outcome


@dataclass(frozen=True)
class Learner:
    """The logs of a diagnosis, from which to learn what it leaves.

    Attributes
    ----------
    paths
        Logs; parts of one recording joined by ``+``.
    profile
        The vessel, without the signals that were withheld.
    start
        The model that was examined; None for the profile's hull.
    run
        Folder of the ingested tables, and progress.
    settings
        How to fit: as ``ferryid fit`` does without options.
    usable
        The logs as they were read, where some are left out; else all of `paths` are read.
    """

    paths: tuple[str, ...]
    profile: Profile
    start: Model | None
    run: RunContext
    settings: FitSettings = field(default_factory=FitSettings)
    usable: tuple[Opened, ...] = ()

    def learn(self, diagnosed: Model | None, name: str, wider: Model | None = None) -> tuple[Model | None, Learned]:
        """Return the model to store, and what was learned; logs that cannot be fitted leave the model as it is.

        Parameters
        ----------
        diagnosed
            The model with the findings; None where there are none.
        name
            Name of a model where there is none yet.
        wider
            The same with effects that are hints; None where there are none. Stored where it predicts better.
        """
        self.run.progress("learning what is left")
        try:
            if diagnosed is None and self.start is None:
                found = self._fitted(name)
            else:
                found = self._on_top(diagnosed or replace(self._known_start(), name=name), diagnosed)
        except ReversedForcesError:
            # Whatever was found beside forces that act the wrong way is an error of the profile.
            raise
        except FerryIdError as error:
            if (others := self._that_can_be_fitted()) is not None:
                stored, learned = others.learn(diagnosed, name, wider)
                few = len(self.paths) - len(others.usable)
                without = f"{counted(few, 'log')} that a fit cannot use {verb(few, 'is')} no part of that."
                return stored, replace(learned, says=f"{learned.says.removesuffix('.')}. {without}")
            # What a fit should do instead names options that a diagnosis has not.
            cause = str(error).partition(" Fix: ")[0]
            return diagnosed, Learned(False, f"Nothing was learned beside the findings: {cause.removesuffix('.')}.")
        if wider is None:
            return found
        try:
            return self._with_hints(wider, *found)
        except FerryIdError:
            return found

    def _that_can_be_fitted(self) -> Learner | None:
        """Return a learner from those logs that a fit can use; None where that is all of them, or none.

        A diagnosis has a use for some that a fit has not, such as those of a constant thrust.
        """
        settings = self.settings.on(self.profile)
        try:
            usable = read_logs(self.paths, self.profile, settings, self.run, whole=False, usable_only=True)
        except FerryIdError:
            return None
        return replace(self, usable=tuple(usable)) if len(usable) < len(self.paths) else None

    def _with_hints(self, wider: Model, model: Model | None, learned: Learned) -> tuple[Model | None, Learned]:
        """Return a model with effects that are hints where it predicts better than the one without them, else that one."""
        hints = [titled(effects()[one.effect].title, one.instance) for one in _effects(wider) if not one.confirmed]
        if not hints:
            # Coefficients of the hull are no effect that a model lists.
            return model, learned
        start = self.start or blank_model(self.profile, wider.name)
        # A hull that was refitted to all rows has seen those that decide here.
        unseen = replace(wider, hull=start.hull)
        sure = _confirmed(unseen)
        found = self._remainder(unseen)
        plain = self._plain.outcome
        beside = self._remainder(sure).judged if _effects(sure) else plain.judged
        rows = _both(self._plain, found.fitted)
        compared = [start, beside, plain.judged, unseen, found.judged]
        base, without, fitted, bare, after = self._errors(compared, rows)
        verdict, change = _judged(found.outcome, bare, after), _over(after, without)
        worse = self.start is None and plain.acceptance.accepted and accept(after, fitted, "prediction").accepted
        if worse or not (verdict.accepted and accept(without, after, "prediction").accepted):
            return model, learned
        if self.start is not None or self.profile.hull.has_model:
            # About a hull that is known the refitted one, to all rows and with the noise's colour, is the better estimate; what
            # decides, and is told, are the errors of the one that has not seen these rows.
            stored, on_top = self._on_top(wider, wider)
            if on_top.fit_alone:
                return model, learned
        else:
            stored = replace(found.model, accepted=True, scores=_scores(base, after, found.outcome))
        says = (
            f"{listed(hints)} {'is a hint' if len(hints) == 1 else 'are hints'} and part of the model all the same, which "
            f"predicts better so; held-out squared prediction error against the model without: {_changes(by_axis(change))}."
        )
        over_fit = by_axis(_over(after, fitted))
        return stored, Learned(True, says, verdict.reasons, by_axis(change), over_fit, with_hints=True)

    @cached_property
    def _opened(self) -> list[Opened]:
        """The logs, read once for all fits."""
        return list(self.usable) or read_logs(self.paths, self.profile, self.settings, self.run, whole=False)

    @cached_property
    def _plain(self) -> _Fitted:
        """The fit alone."""
        name, settings = check_name(self.profile.name), self.settings.on(self.profile)
        return _Fitted.of(fit_opened(self._opened, self.profile, settings, self.run, name))

    def _known_start(self) -> Model:
        assert self.start is not None
        return self.start

    def _fitted(self, name: str) -> tuple[Model | None, Learned]:
        """Return what a fit alone makes of the logs, of which nothing was named."""
        found = self._plain.outcome
        ratio, accepted = found.acceptance.per_axis, found.acceptance.accepted
        said = _says(
            "No named effect enters the model. A correction of the hull", ratio, found.acceptance, "the profile's hull"
        )
        return (replace(found.model, name=name) if accepted else None), Learned(
            accepted, said, found.acceptance.reasons, ratio
        )

    def _on_top(self, base: Model, diagnosed: Model | None) -> tuple[Model | None, Learned]:
        """Return the model to store: what is examined or diagnosed, with a correction where that is accepted."""
        start = self.start or blank_model(self.profile, base.name)
        alone, found = self._plain_and_remainder(base)
        plain, rows = alone.outcome, _both(alone, found.fitted)
        before, known, after, fitted = self._errors([start, base, found.judged, plain.judged], rows)
        verdict, what = _judged(found.outcome, known, after), "A correction learned on top of the findings"
        best = after if verdict.accepted else known
        if diagnosed is not None and plain.acceptance.accepted and _fit_is_better(best, fitted):
            # The refit of the diagnosis may be to blame: what was named stays, the hull is the fit's to estimate.
            other = self._remainder(replace(base, hull=start.hull))
            second = self._errors([base, other.judged], rows)[1]
            new = _judged(other.outcome, known, second)
            if new.accepted and float(np.mean(_over(second, best))) < 1.0:
                found, after, verdict, best = other, second, new, second
                what = "A correction learned beside the effects on the hull as it was before the diagnosis"
        stored = diagnosed
        if stored is not None and stored.scores is None:
            # Of logs that are too short for figures of their own.
            stored = replace(stored, scores=_scores(before, known, found.outcome))
        if verdict.accepted:
            stored = replace(found.model, accepted=True, scores=_scores(before, after, found.outcome))
        over_fit = _over(best, fitted)
        # A model that was examined knows other logs, which a fit to these alone would forget.
        of_these = stored is not None and self.start is None and plain.acceptance.accepted
        if of_these and accept(best, fitted, "prediction").accepted:
            return self._instead(base.name, known, best, fitted)
        said = _says(what, by_axis(_over(after, known)), verdict, "the model without it")
        if plain.acceptance.accepted and _fit_is_better(best, fitted):
            said += (
                f" The model of ferryid fit predicts these logs better: the squared error with the model of the diagnosis is "
                f"{float(np.mean(over_fit)):.2f} times as large."
            )
        return stored, Learned(verdict.accepted, said, verdict.reasons, by_axis(_over(after, known)), by_axis(over_fit))

    def _instead(self, name: str, known: Floats, best: Floats, fitted: Floats) -> tuple[Model, Learned]:
        """Return the model of the fit alone, which predicts better than any on what is diagnosed."""
        plain, over_fit = self._plain.outcome, _over(fitted, fitted)
        times = float(np.mean(_over(best, fitted)))
        said = (
            "The model of ferryid fit, which knows no findings, predicts these logs better and is stored: with that of the "
            f"diagnosis the held-out squared prediction error is {times:.2f} times as large."
        )
        ratio = by_axis(_over(fitted, known))
        found = Learned(True, said, plain.acceptance.reasons, ratio, by_axis(over_fit), fit_alone=True)
        return replace(plain.model, name=name), found

    def _plain_and_remainder(self, base: Model) -> tuple[_Fitted, _Candidate]:
        """Return the fit alone, and that to what a model leaves, made side by side unless their rows would fill the memory."""
        plain, left = list[_Fitted](), list[_Candidate]()
        rows = sum(len(one.track.t) for one in self._opened)

        def make(alone: bool) -> None:
            if alone:
                plain.append(self._plain)
            else:
                left.append(self._remainder(base))

        over(make, (True, False), most=1 if rows > MOST_ROWS_AT_ONCE else None)
        return plain[0], left[0]

    def _remainder(self, base: Model) -> _Candidate:
        try:
            outcome = fit_remainder(base, self._opened, self.profile, self.settings, self.run)
        except ReversedForcesError as error:
            # It is an error of the profile only where forces act the wrong way without the findings as well.
            _ = self._plain
            raise FerryIdError(f"with the findings, {error}") from error
        model, judged = (with_remainder(base, one) for one in (outcome.model, outcome.judged))
        return _Candidate(model, judged, _Fitted.of(outcome))

    def _errors(self, models: Sequence[Model], rows: Sequence[Flags]) -> list[Floats]:
        return prediction_errors(models, self._opened, self.profile, self.settings, rows)


def _both(one: _Fitted, other: _Fitted) -> list[Flags]:
    """Return the rows that validate in two fits to the same logs, shape (n,) each."""
    return [mine & theirs for mine, theirs in zip(one.validation, other.validation, strict=True)]


def without_withheld(profile: Profile, withhold: Sequence[str]) -> Profile:
    """Return a profile that does not map what is hidden from a diagnosis."""
    return replace(profile, signals=tuple(one for one in profile.signals if one.quantity not in withhold))


def _confirmed(model: Model) -> Model:
    """Return a model without the effects that are hints."""
    conditions = (replace(log, effects=tuple(one for one in log.effects if one.confirmed)) for log in model.conditions)
    return replace(
        model,
        vessel_effects=tuple(one for one in model.vessel_effects if one.confirmed),
        conditions=tuple(log for log in conditions if log.effects),
    )


def _effects(model: Model) -> list[StoredEffect]:
    """Return the effects of a model, the vessel's and the conditions of its logs."""
    return [*model.vessel_effects, *(one for log in model.conditions for one in log.effects)]


def _judged(found: FitOutcome, without: Floats, after: Floats) -> Acceptance:
    """Return the verdict on a correction: that of its fit, unless the folds or what would be stored speak against it.

    Parameters
    ----------
    found
        The correction.
    without, after
        Held-out squared prediction errors of the models without and with it, shape (3,) each.
    """
    stored = accept(without, after, "prediction")
    # The fit's own figures are of other rows, and would stand beside these as if they were the same; where they alone speak
    # against it, they are the reason.
    own = found.acceptance.checks[0].reason if found.acceptance.checks else PREFIX
    kept = [one for one in found.acceptance.reasons if own not in one or (stored.accepted and one.startswith(PREFIX))]
    reasons = [*stored.reasons, *kept]
    folds = next((one.folds for one in found.estimators if one.chosen), 0.0)
    accepted = found.acceptance.accepted and stored.accepted and folds < 1.0
    if not folds < 1.0:
        times = f"{folds:.2f} times as large" if isfinite(folds) else "infinite"
        reasons.insert(0, f"{PREFIX}on folds of the training rows the squared prediction error with it is {times}.")
    return replace(found.acceptance, accepted=accepted, reasons=tuple(reasons))


def _fit_is_better(stored: Floats, fitted: Floats) -> bool:
    """Return whether the error of the model to be stored is larger than that of a fit, by more than is reported."""
    return float(np.mean(_over(stored, fitted))) > 1.0 + JUDGING.reported_change


def _over(one: Floats, other: Floats) -> Floats:
    ratio: Floats = np.divide(one, other, out=np.full(3, nan), where=other > 0.0)
    return ratio


def _changes(ratio: Mapping[str, float]) -> str:
    """Return by how much an error changes on each axis."""
    known = [f"{axis} {100.0 * (ratio[axis] - 1.0):+.0f} %" for axis in AXES if isfinite(ratio.get(axis, nan))]
    return ", ".join(known) or "unknown"


def _says(what: str, ratio: Mapping[str, float], verdict: Acceptance, base: str) -> str:
    """Return in one line what was learned, or why it was not accepted."""
    told = f"held-out squared prediction error against {base}: {_changes(ratio)}"
    if verdict.accepted:
        return f"{what} is part of the model; {told}."
    reasons = [one.removeprefix(PREFIX) for one in verdict.reasons if one.startswith(PREFIX)]
    why = reasons[0] if reasons else (verdict.reasons or ("it was not judged.",))[0]
    return f"{what} was not accepted ({told}): {why}"


def _scores(before: Floats, after: Floats, outcome: FitOutcome) -> ModelScores:
    """Return the held-out prediction errors of the model before and after, as a model file has its scores."""
    unknown, ratio = np.full(len(AXES), nan), _over(after, before)
    judged = outcome.model.scores
    assert judged is not None
    return replace(
        judged,
        force=ForceScores(before, after, unknown, unknown, ratio, float(np.mean(ratio))),
        split_notes=(*judged.split_notes, "Hull and effects have seen the held-out rows, what was learned has not."),
        measure="prediction",
    )
