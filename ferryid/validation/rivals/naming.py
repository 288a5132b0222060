"""What each rival names in a log, as findings, so that the same scores serve it as the diagnosis.

Nothing but a method's own result makes a name: no rule, no held-out stretch and no placebo lowers it.

- Weak SINDy and stepwise regression choose from `ferryid.validation.rivals.candidates`; the effect whose term is chosen is
  named, with the size that its coefficient stands for, and a time where the term sets in.
- The thesis's 21 functions belong to the hull: those of acceleration of which the 95 % interval excludes zero speak for a load
  (``payload``), those of the squares for ``fouling``, all others for ``hull_parameters``. It can name nothing else.
- Output error names what lowers the criterion; see `ferryid.validation.rivals.output_error`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from ferryid.diagnose import Estimate
from ferryid.effects import effects
from ferryid.errors import FerryIdError
from ferryid.identify import fit_logs
from ferryid.types import RunContext
from ferryid.validation.records import Diagnosis, Finding, RivalDiagnoses
from ferryid.validation.rivals import output_error, sindy, stepwise, thesis
from ferryid.validation.rivals.candidates import LINEAR
from ferryid.validation.rivals.learner import LearnedModel, Learner
from ferryid.vessel.profile import Profile

Namer = Callable[[str, Profile, Path], tuple[Finding, ...]]
"""``name(log, profile, out)``; arguments as of `ferryid.validation.rivals.learner.Learner`."""
DRAWS = 100
"""Draws of the thesis's bootstrap, whose intervals decide what it names."""
ACCELERATIONS = ("u_dot", "v_dot", "r_dot")
NAMEABLE: Mapping[str, tuple[str, ...]] = {
    "thesis": ("fouling", "hull_parameters", "payload"),
    "weak SINDy": (*LINEAR, "fouling", "hull_parameters", "mooring", "payload", "shallow_water", "wind"),
    "stepwise": (*LINEAR, "fouling", "hull_parameters", "mooring", "payload", "shallow_water", "wind"),
    "output error": tuple(one.id for one in effects().values() if output_error.has_parameters(one)),
}
"""Effects that a method has a regressor or parameters for."""


def diagnoses(log: str, profile: Profile, out: Path) -> RivalDiagnoses:
    """Return what every rival names; one that cannot use a log is ``refused``.

    Parameters
    ----------
    log, profile, out
        As of `ferryid.validation.rivals.learner.Learner`.
    """
    found = {}
    for name, namer in NAMERS.items():
        start = time.perf_counter()
        try:
            findings = namer(log, profile, out)
            made = Diagnosis("explained" if findings else "matched", time.perf_counter() - start, findings)
        except FerryIdError as error:
            made = Diagnosis("refused", time.perf_counter() - start, error=str(error))
        found[name] = made
    return RivalDiagnoses(found)


def _of_sparse(learn: Learner, log: str, profile: Profile, out: Path) -> tuple[Finding, ...]:
    learnt = learn(log, profile, out)
    known = effects()
    return tuple(
        Finding(one.effect, one.instance, 1.0, *_sizes(one.effect, one.instance, one.terms, learnt, profile))
        for one in learnt.names
        if one.effect in known
    )


def _sizes(
    effect: str, instance: str | None, terms: tuple[str, ...], learnt: LearnedModel, profile: Profile
) -> tuple[dict[str, Estimate], dict[str, float], tuple[str, ...], tuple[()], float | None]:
    """Return what follows the probability in a `Finding`: parameters, and the time at which the largest term sets in."""
    largest = max(terms, key=lambda one: abs(learnt.coefficients[one]))
    onset = largest.partition(" from ")[2]
    onset_s = float(onset.removesuffix(" s")) if onset else None
    values: dict[str, Estimate] = {}
    for one in effects()[effect].parameters_of(profile):
        label = " ".join(filter(None, (effect, instance, one.name)))
        for term in terms:
            base = term.partition(" from ")[0]
            coefficient = learnt.coefficients[term]
            if base == label:
                value = one.neutral + coefficient * one.size
            elif effect == "payload" and one.name == "mass" and base == "mass aboard":
                value = coefficient * one.size
            elif effect == "fouling" and base == f"damping of second order in {one.name}":
                value = 1.0 + coefficient
            elif (effect == "mooring" and base == one.name.replace("stiffness_", "spring ")) or (
                effect == "hull_parameters" and base == one.name
            ):
                value = coefficient
            else:
                continue
            values[one.name] = Estimate(value, value, value, one.unit)
    return values, {}, (), (), onset_s


def _of_thesis(log: str, profile: Profile, out: Path) -> tuple[Finding, ...]:
    model = fit_logs([log], profile, replace(thesis.SETTINGS, draws=DRAWS), RunContext(out)).model
    spoken = set()
    for k, term in enumerate(model.terms):
        if not ((model.low[k] > 0.0) | (model.high[k] < 0.0)).any():
            continue
        factors = term.split()
        if any(one in ACCELERATIONS for one in factors):
            spoken.add("payload")
        elif term in ("|u|u", "|v|v", "|r|r"):
            spoken.add("fouling")
        else:
            spoken.add("hull_parameters")
    return tuple(Finding(one, None, 1.0, {}) for one in sorted(spoken))


NAMERS: Mapping[str, Namer] = {
    "thesis": _of_thesis,
    "weak SINDy": partial(_of_sparse, sindy.learn),
    "stepwise": partial(_of_sparse, stepwise.learn),
    "output error": output_error.diagnose,
}
"""Every rival by the name that the page gives it."""
