"""Hull parameters: masses or damping of the model itself are wrong, far beyond what every hypothesis refits anyway.

A factor on some of the hull's coefficients, one or all of them: which ones is chosen beforehand, by the evidence of a linear
model in which those chosen are believed to be off by half and the others by no more than usual. What fouling, a payload or
shallow water explain with fewer parameters is theirs. The scale of all forces is the thrust's.

References
----------
Scott and Berger (2010), Bayes and empirical-Bayes multiplicity adjustment in the variable-selection problem: the number of
subsets of a size, times that of sizes, is what choosing one of them costs. Each is an error of its own besides, with the odds
of any effect: many that have one cause, such as fouling or a load, are that. So is a model that is wrong all over: it is of
another vessel.
"""

from __future__ import annotations

from math import lgamma, log
from typing import Any

import numpy as np

from ferryid.effects.effect import HELD, Choice, Effect, Parameter, Residual, Values
from ferryid.effects.force_model import COEFFICIENTS, MASS, ForceModel, Measurements, hull_of, touches
from ferryid.effects.hull_spread import hull_model_spread
from ferryid.effects.linear_evidence import hull_jacobian
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

ARMS = ("m23", "m32")
"""How far ahead the mass lies; that a few hundred kilograms lie elsewhere is a payload's to say."""
SURGE_ALONE = frozenset({"X_|u|u"})
"""What one factor of fouling is as well."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return a factor for each coefficient that the profile's hull has."""
    return tuple(_factor(name, EFFECTS.selected_spread) for name in _nonzero_names(profile))


def _nonzero_names(profile: Profile) -> list[str]:
    return [name for name, value in zip(COEFFICIENTS, hull_of(profile).tolist(), strict=True) if value != 0.0]


def _factor(name: str, size: float) -> Parameter:
    return Parameter(name, "-", size, 0.05, 10.0, neutral=1.0)


def choose(force_model: ForceModel, prior_hull: Floats, residual: Residual) -> Choice:
    """Return factors of which only those of the coefficients that are worth it can move."""
    names = _nonzero_names(force_model.measurements.profile)
    able = [name for name in names if name not in ARMS]
    places = [COEFFICIENTS.index(name) for name in able]
    J, e = hull_jacobian(force_model, prior_hull, residual, places)
    usual = hull_model_spread(force_model.measurements.profile)
    chosen, log_alternatives = _best_subset(J.T @ J, -J.T @ e, able, usual)
    if 2 * len(chosen) > len(able):
        # A model that is wrong all over is wrong there, too.
        chosen |= frozenset(ARMS)
    return Choice(
        tuple(_factor(name, EFFECTS.selected_spread if name in chosen else HELD) for name in names), log_alternatives
    )


def _best_subset(G: Floats, b: Floats, names: list[str], usual: float) -> tuple[frozenset[str], float]:
    """Return the coefficients whose evidence is best, going from few to many and from many to few, and what choosing cost."""
    n = len(names)

    def log_alternatives(chosen: frozenset[str]) -> float:
        k = len(chosen)
        apart = min(k - 1, EFFECTS.coefficients_apart)
        return log(n) + lgamma(n + 1) - lgamma(k + 1) - lgamma(n - k + 1) + EFFECTS.coefficient_odds * apart

    def score(chosen: frozenset[str]) -> float:
        if not chosen or chosen == SURGE_ALONE:
            return -np.inf
        spread = np.array([EFFECTS.selected_spread if name in chosen else usual for name in names])
        A = np.eye(n) + G * np.outer(spread, spread)
        c = spread * b
        return 0.5 * float(c @ np.linalg.solve(A, c)) - 0.5 * float(np.linalg.slogdet(A)[1]) - log_alternatives(chosen)

    all_names = frozenset(names)
    best, best_score = all_names, score(all_names)
    for chosen in (frozenset[str](), all_names):
        grows = not chosen
        while len(chosen) < n if grows else len(chosen) > 1:
            near = [chosen | {name} for name in all_names - chosen] if grows else [chosen - {name} for name in chosen]
            chosen = max(near, key=lambda one: (score(one), sorted(one)))
            if score(chosen) > best_score:
                best, best_score = chosen, score(chosen)
    return best, log_alternatives(best)


@touches("hull")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Multiply the coefficients."""
    factor = np.ones(len(COEFFICIENTS))
    factor[force_model.measurements.modelled] = p
    return force_model.replaced(hull=force_model.hull * factor)


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show a wrong hull model."""
    return measurements.profile.hull.why_unknown


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence; the values are those of the coefficients that are certainly off."""
    changed = {name: value for name, value in values.items() if abs(value - 1.0) > EFFECTS.coefficient_change}
    masses = [name for name in changed if name in MASS]
    what = " and ".join(
        word for word, some in (("masses", masses), ("damping", [name for name in changed if name not in MASS])) if some
    )
    listing = ", ".join(f"{name} is {value:.2f} times the model's" for name, value in changed.items())
    return (
        f"The hull model's {what or 'coefficients'} {'is' if what == 'damping' else 'are'} wrong: {listing}."
        if listing
        else "The hull model is somewhat wrong."
    )


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's true hull."""
    return {"true_hull": {name: value for name, value in values.items() if value != 1.0}}


EFFECT = Effect(
    "hull_parameters",
    "Hull model",
    parameters_of,
    apply,
    says,
    scenario,
    cannot=cannot,
    vessel=True,
    choose=choose,
    minimum_change=EFFECTS.coefficient_change,
    changes_hull=True,
    of_coefficients=True,
)
