"""A property of one group of logs relative to another, as it is reported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import exp

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.group_differences import GROUPS
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.campaign_evidence import Gain
from ferryid.diagnose.judging.experiment_design import manoeuvre
from ferryid.diagnose.judging.finding import Rival
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.effect import Parameter
from ferryid.effects.wording import parameter_word
from ferryid.vessel.circumstances import ANYWHERE, Circumstances

FORCES, SENSORS = "forces", "sensors"
"""What a difference was estimated from: from forces beside one hull, or from sensors compared with each other."""


@dataclass(frozen=True, kw_only=True)
class Difference:
    """A property of one group relative to the other.

    Attributes
    ----------
    effect, instance, group, title
        Effect id and thruster, the group in whose logs it acts, and the effect's title with the thruster.
    parameters
        Of the effect, with their units and neutral values.
    estimates
        Of these, by name.
    evidence
        Logarithm of the evidence over that of no such difference [nat].
    scatter
        Standard deviation between logs of one group, of the first parameter, in its unit.
    smallest
        By parameter, the distance from neutral that would have been seen with an even chance; None where none would.
    wide
        True where logs of one group differ in it by all that was looked for.
    selected
        True where the evidence favours it over none.
    shown_by
        `FORCES` or `SENSORS`.
    gain, by_group
        Held-out log-likelihood over that of no difference, of all logs and of each group; None where it was not selected, and
        of sensors.
    rivals, instead
        What was tried in its place, with the evidence over it [nat], and what each of these would be.
    apart
        How many times as much as the noise explains the logs differ about what they share, in variance.
    doubt
        Why it is not confirmed, as the end of a sentence; empty where it is.
    circumstances
        Where the logs were recorded, and what drives the vessel.
    """

    effect: str
    instance: str | None
    group: str
    title: str
    parameters: tuple[Parameter, ...]
    estimates: Mapping[str, Estimate]
    evidence: float
    scatter: float
    smallest: Mapping[str, float | None]
    wide: bool = False
    selected: bool = False
    shown_by: str = FORCES
    gain: Gain | None = None
    by_group: Mapping[str, Gain] | None = None
    rivals: tuple[Rival, ...] = ()
    instead: tuple[Difference, ...] = ()
    apart: float = 1.0
    doubt: str = ""
    circumstances: Circumstances = ANYWHERE

    @classmethod
    def of(
        cls,
        candidate: Candidate,
        estimates: Mapping[str, Estimate],
        evidence: float,
        scatter: float,
        smallest: Mapping[str, float | None],
        apart: float = 1.0,
    ) -> Difference:
        """Return that of an effect which acts in the logs of a candidate's group; arguments as the attributes."""
        return cls(
            effect=candidate.effect.id,
            instance=candidate.instance,
            group=candidate.group,
            title=candidate.title,
            parameters=candidate.parameters,
            estimates=estimates,
            evidence=evidence,
            scatter=scatter,
            smallest=smallest,
            apart=apart,
        )

    @property
    def key(self) -> tuple[str, str | None]:
        """Effect and instance."""
        return self.effect, self.instance

    @property
    def other(self) -> str:
        """The group that it is relative to."""
        return GROUPS[1 - GROUPS.index(self.group)]

    @property
    def probability(self) -> float:
        """Probability that it or what it is unresolved with is there; a hint's at most where it is not confirmed."""
        away = min(max(self.evidence - INFERENCE.prior_odds, -700.0), 700.0)
        probability = 1.0 / (1.0 + exp(-away))
        # Of those that explain the same about as well, any may be the one.
        resolved = [behind for _, behind in self._behind() if behind <= -JUDGING.unresolved_evidence]
        probability /= 1.0 + sum(map(exp, resolved))
        return probability if self.selected and not self.doubt else min(probability, JUDGING.hint_probability)

    @property
    def unresolved_with(self) -> tuple[str, ...]:
        """Effects that explain the same about as well."""
        return tuple(dict.fromkeys(effect for effect, _ in self.near))

    @property
    def near(self) -> tuple[tuple[str, str | None], ...]:
        """Effect and instance of these."""
        return tuple(key for key, behind in self._behind() if behind > -JUDGING.unresolved_evidence)

    def _behind(self) -> list[tuple[tuple[str, str | None], float]]:
        """Return each rival with how far it is behind.

        Logs that differ by more than their noise hold less evidence for the one over the other: a quasi-likelihood, divided by
        the excess of the variance (Burnham and Anderson, 2002, Model Selection and Multimodel Inference, section 2.5).
        """
        return [((one.effect, one.instance), one.delta_score / max(1.0, self.apart)) for one in self.rivals]

    @property
    def separating_manoeuvre(self) -> str | None:
        """What to record to separate it from these."""
        return manoeuvre(self.effect, self.unresolved_with, self.circumstances)

    @property
    def says(self) -> str:
        """The difference as a sentence."""
        text = f"{self.title}, {self.group} relative to {self.other}: {self.values}."
        return f"{text} It is estimated, not confirmed: {self.doubt}." if self.doubt else text

    @property
    def values(self) -> str:
        """Its parameters with their intervals."""
        return ", ".join(self.said(one) for one in self.parameters if one.name in self.estimates)

    def seen_from(self, name: str) -> str:
        """Return the smallest difference of a parameter that would have been seen, with its unit."""
        least, label = self.smallest[name], parameter_word(name)
        if least is None:
            return f"{label} not seen at any size"
        unit = next(each.unit for each in self.parameters if each.name == name)
        return f"{label} {100.0 * least:.0f} %" if unit == "-" else f"{label} {float(f'{least:.2g}'):g} {unit}"

    def said(self, parameter: Parameter) -> str:
        """Return a parameter with its interval."""
        one = self.estimates[parameter.name]
        name = parameter_word(parameter.name)
        form = f"z.{one.digits}f" if parameter.unit == "-" else f"+z.{one.digits}f"
        unit = "" if parameter.unit == "-" else f" {one.unit}"
        return f"{name} {one.value:{form}}{unit} ({one.low:{form}} to {one.high:{form}})"
