"""The stages of a diagnosis that fit: averages over windows, the estimate of hull and noise, and the selection of effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from ferryid.diagnose.checks.screening import ScreenedLog
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, estimation_problem
from ferryid.diagnose.inference.search import Search, search
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows, windows
from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats


@dataclass(frozen=True)
class AveragedLog:
    """A log in the weak form: averages over windows."""

    screened: ScreenedLog
    windows: Windows

    @property
    def path(self) -> str:
        """Where it lies."""
        return self.screened.measured.path

    @property
    def long_enough(self) -> bool:
        """True where there are windows enough to test anything."""
        return len(self.windows.starts) >= INFERENCE.fewest_windows


@dataclass(frozen=True)
class Expectation:
    """What is expected of a log before anything is fitted to it.

    Attributes
    ----------
    force_model
        The forces that the baseline holds to act.
    hull_spread
        How far its hull's coefficients may be off: standard deviations, shape (26,).
    library
        Every candidate for what it left out.
    notes
        What a reader must know of the baseline.
    comparison
        Of a simulation: it and its path against the recording's, as plain values; empty else.
    """

    force_model: ForceModel
    hull_spread: Floats
    library: tuple[Candidate, ...]
    notes: tuple[str, ...] = ()
    comparison: Mapping[str, Any] = field(default_factory=dict)


class Baseline(Protocol):
    """What recordings are compared with: a profile's hull, a model, a simulation, or the hull of a campaign.

    Attributes
    ----------
    hull_known
        True where its hull comes from a profile or a model, not from the logs that are diagnosed.
    joint
        True where its hull was fitted to all logs of a campaign.
    hull_logs
        Logs that its hull is fitted to, references among them: one where each log is compared with its own.
    updates_model
        True where the findings can enter a model.
    sensors
        Errors of its own sensors: parameters by effect.
    """

    @property
    def hull_known(self) -> bool: ...
    @property
    def joint(self) -> bool: ...
    @property
    def hull_logs(self) -> int: ...
    @property
    def updates_model(self) -> bool: ...
    @property
    def sensors(self) -> Mapping[str, Mapping[str, Estimate]]: ...

    def expect(self, log: AveragedLog) -> Expectation:
        """Return what the baseline expects of a log."""
        ...


@dataclass(frozen=True)
class EstimatedLog:
    """A log with hull and noise estimated as if nothing were missing."""

    averaged: AveragedLog
    baseline: Baseline
    expectation: Expectation
    problem: EstimationProblem


@dataclass(frozen=True)
class SelectedLog:
    """A log with the effects that it speaks for."""

    estimated: EstimatedLog
    search: Search

    @property
    def path(self) -> str:
        """Where the log lies."""
        return self.estimated.averaged.path

    @property
    def steady(self) -> list[Candidate]:
        """Candidates that are forces or sensor errors, not disturbances that come and go by chance."""
        return [one for one in self.estimated.expectation.library if one.effect.unsteady is None]


def average(log: ScreenedLog) -> AveragedLog:
    """Average a log over the weak form's windows."""
    return AveragedLog(log, windows(log.measurements, *window_lengths(log.measurements.profile)))


def estimate(log: AveragedLog, baseline: Baseline) -> EstimatedLog:
    """Estimate the hull and the noise of a log as if nothing were missing."""
    expectation = baseline.expect(log)
    return EstimatedLog(
        log, baseline, expectation, estimation_problem(log.windows, expectation.force_model, expectation.hull_spread)
    )


def select(log: EstimatedLog, progress: Callable[[str], None]) -> SelectedLog:
    """Select the effects that a log speaks for."""
    found = search(log.problem, progress, known=log.expectation.library)
    if found.problem is not log.problem:
        # What was worked out under the first noise is not asked for again: a copy has none of it.
        log = replace(log, problem=replace(log.problem))
    return SelectedLog(log, found)
