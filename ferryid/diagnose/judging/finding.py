"""Findings with their evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ferryid.diagnose.data.course import Course
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.types import Floats

UNKNOWN = "unknown"
"""Effect id of what has no name."""


@dataclass(frozen=True)
class LawTerm:
    """One term of an empirical law: what it acts on, what it is in proportion to, its coefficient, and the same in words."""

    on: str
    quantity: str
    coefficient: Estimate
    says: str


@dataclass(frozen=True)
class Rival:
    """Another effect that explains the same, and how much worse: difference of the logarithms of evidence, negative."""

    effect: str
    instance: str | None
    delta_score: float


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One piece of physics, or one sensor's error, that was left out.

    Attributes
    ----------
    effect, instance
        Effect id, and the thruster it is one of.
    probability
        Posterior probability against its rivals and against no effect at all.
    parameters
        By name.
    axes
        Share of the improvement on each axis; they add up to 1.
    intervals
        When it acts [s], pairs of first and last.
    onset_s, offset_s
        When it began and when it ended, None where it acted from the start, and to the end.
    regime
        Where it shows most, in words.
    improvement
        Fraction of the held-out force MSE removed, by axis.
    mse
        The same in figures: mean square of the force error [N², N², N²m²] without and with the finding, by axis; None where it
        was not measured.
    held_out
        True where these were measured on rows that the finding was not fitted to.
    rivals, unresolved_with
        What else was considered, and what this log cannot tell it from.
    separating_manoeuvre
        What to record to tell them apart.
    says
        One sentence in plain words.
    evidence
        Columns for the figure that shows it, one row a window, shape (m,) each, on the one axis that shows it best:

        - ``t``: middle of the window [s], ascending;
        - ``before``, ``after``: what is left over without and with the finding, in one unit;
        - ``explained``: what the finding adds, in the same unit; where it holds, `before` follows it and `after` does not;
        - ``regressor``, optional: the quantity that gives it away (heading for a wind, squared speed for fouling);
          `explained` takes its place where there is none.

        Of what comes and goes by chance, one row a frequency: ``frequency`` [Hz], ascending; ``before``, the power spectrum of
        what is left over on the axis on which it acts most; ``explained``, the one that it has by its parameters.
    course
        A flow over time, of one that changes within the log.
    band_hz
        Frequencies that hold most of it [Hz], where that is told.
    law
        Terms of an empirical law, of an effect without a name.
    vessel
        True for what the checks of the sensors show in all logs of a campaign together.
    labels
        Names of the columns of `evidence` for people, with unit: ``residual`` (of `before`, `after` and `explained`) and
        ``regressor``. Such as ``{"residual": "sway force left over [N]", "regressor": "heading [deg]"}``.
    """

    effect: str
    instance: str | None
    probability: float
    parameters: Mapping[str, Estimate]
    axes: Mapping[str, float]
    intervals: tuple[tuple[float, float], ...]
    onset_s: float | None = None
    offset_s: float | None = None
    regime: str = ""
    improvement: Mapping[str, float] = field(default_factory=dict)
    mse: tuple[Mapping[str, float], Mapping[str, float]] | None = None
    held_out: bool = False
    rivals: tuple[Rival, ...] = ()
    unresolved_with: tuple[str, ...] = ()
    separating_manoeuvre: str | None = None
    says: str
    evidence: Mapping[str, Floats] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    course: Course | None = None
    band_hz: tuple[float, float] | None = None
    law: tuple[LawTerm, ...] = ()
    vessel: bool = False

    @property
    def ends(self) -> tuple[tuple[str, float], ...]:
        """Onset and offset by name [s], those within the log."""
        return tuple(
            (name, time) for name, time in (("onset", self.onset_s), ("offset", self.offset_s)) if time is not None
        )

    @property
    def key(self) -> tuple[str, str | None]:
        """Effect and instance."""
        return self.effect, self.instance

    @property
    def sure(self) -> bool:
        """True where it is more than a hint."""
        return self.probability > JUDGING.hint_probability
