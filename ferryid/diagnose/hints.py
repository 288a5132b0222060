"""What makes of a finding a hint, which names nothing: reasons to doubt it that lie beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ferryid.diagnose.result import HINT, Finding
from ferryid.effects import effects
from ferryid.effects.wording import listed, titled

OUT_OF_STEP = ("time_delay", "thruster_lag")
"""Effects that a controller's answer to unmeasured, unsteady disturbances looks like."""
MOST_OF_IT = 0.5
"""Share of the squared error on an axis that a finding removes there while it acts, so that less is left than it explains."""
LEAST = 0.1
"""The same share of a finding that is more than a stand-in, whatever else acts."""
Key = tuple[str, str | None]
"""Effect and instance."""


def hint(finding: Finding, *unresolved: str, manoeuvre: str | None = None) -> Finding:
    """Return a finding as a hint, with what it cannot be told from, and what to record to tell."""
    return replace(
        finding,
        probability=min(finding.probability, HINT),
        unresolved_with=tuple(dict.fromkeys((*finding.unresolved_with, *unresolved))),
        separating_manoeuvre=manoeuvre or finding.separating_manoeuvre,
    )


def on_a_guessed_hull(finding: Finding) -> Finding:
    """Return a finding of a force as it stands where the hull is known from nothing but the log that shows it."""
    return hint(finding, "hull_parameters", manoeuvre="a log in calm air and still water, to fit a hull model first")


def beside_gusts(finding: Finding, removed: Mapping[Key, Mapping[str, float]]) -> Finding:
    """Return a finding as it stands beside something unsteady that nobody measured.

    A controller answers every gust some time after it has moved the vessel, so that force and motion seem to be out of step.
    That explains little of what moves the vessel: what removes most of the error is no such thing.

    Parameters
    ----------
    finding
        Of a force or a sensor.
    removed
        Share of the held-out squared error that findings remove while they act, by effect and instance and by axis.
    """
    if finding.effect not in OUT_OF_STEP or max(removed.get(finding.key, {}).values(), default=0.0) >= MOST_OF_IT:
        return finding
    return hint(finding, "gusts", manoeuvre="the same manoeuvres in calm air")


def about_nothing(shaken: Sequence[Finding], forces: Sequence[Finding]) -> list[Finding]:
    """Return what comes and goes by chance: gusts about a wind that is not told are a hint."""
    told = {"", *(one.effect for one in forces if one.sure)}
    return [one if effects()[one.effect].about in told else hint(one) for one in shaken]


def beside_more(
    findings: Sequence[Finding], removed: Mapping[Key, Mapping[str, float]], holds: Mapping[str, float]
) -> tuple[list[Finding], tuple[str, ...]]:
    """Return findings of forces as they stand beside what is left of the log, and what is to be told.

    What removes less than `LEAST` of the error on every axis may be no more than what hull and formulas are off; and what
    explains less than a force without a name on every axis, its stand-in.

    Parameters
    ----------
    findings
        Of forces.
    removed
        Share of the held-out squared error that they remove while they act, by effect and instance and by axis, as far as it
        was judged.
    holds
        Share of the squared error that they leave which is the nameless force's, by axis; none where there is none.
    """

    def stands(one: Finding, holds: Mapping[str, float]) -> bool:
        # Of an error of one, r is removed and h (1 - r) the nameless force's: r is more from h / (1 + h) on.
        return any(
            share >= max(holds.get(axis, 0.0) / (1.0 + holds.get(axis, 0.0)), LEAST)
            for axis, share in removed[one.key].items()
        )

    doubted = [one for one in findings if one.sure and one.key in removed and not stands(one, holds)]
    small = [one for one in doubted if not stands(one, {})]
    notes = (
        _said(small, f"On no axis does any of these remove {100.0 * LEAST:.0f} % of the error while it acts"),
        _said(
            [one for one in doubted if one not in small],
            "A force without a name is left, and on no axis does any of these explain more than it while it acts",
            "They may stand in for it; take",
        ),
    )
    return [hint(one) if one in doubted else one for one in findings], tuple(note for note in notes if note)


def _said(findings: Sequence[Finding], why: str, take: str = "Take") -> str:
    if not findings:
        return ""
    names = listed(list(dict.fromkeys(titled(effects()[one.effect].title, one.instance) for one in findings)))
    return f"{why}: {names}. {take} them as hints, of probability {HINT:g} at most."
