"""Properties of a vessel that one of its logs shows alone: what the others could show and do not is a hint, as a law is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ferryid.diagnose.hints import hint
from ferryid.diagnose.result import Diagnosis, Finding
from ferryid.effects import effects
from ferryid.effects.wording import listed, titled

FEWEST = 3
"""Logs of one vessel as of which they are held against each other."""


def agreed(made: Sequence[Diagnosis]) -> tuple[Diagnosis, ...]:
    """Return the diagnoses of logs of one vessel; a property that fewer than half of the logs show is a hint.

    A fault that begins or ends in a log is an event of it, and a condition its own.
    """
    if len(made) < FEWEST:
        return tuple(made)
    shown = [{one.key for one in log.findings if _lasting(one)} for log in made]

    def lonely(one: Finding) -> bool:
        return one.sure and _lasting(one) and 2 * sum(one.key in keys for keys in shown) < len(made)

    found = []
    for log in made:
        alone = [one for one in log.findings if lonely(one)]
        if not alone:
            found.append(log)
            continue
        names = listed([titled(effects()[one.effect].title, one.instance) for one in alone])
        note = (
            f"Fewer than half of the vessel's logs show this: {names}. A property of the vessel would be in all of them; "
            "take it as a hint."
        )
        findings = tuple(hint(one) if one in alone else one for one in log.findings)
        named = any(one.sure and one.effect != "unknown" for one in findings)
        verdict = log.verdict if log.verdict == "not_testable" else "partly_explained" if named else "unexplained"
        found.append(replace(log, findings=findings, notes=(*log.notes, note), verdict=verdict))
    return tuple(found)


def _lasting(one: Finding) -> bool:
    return one.effect in effects() and effects()[one.effect].vessel and one.onset_s is None and one.offset_s is None
