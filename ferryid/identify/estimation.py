"""Estimation of a correction to the base model: SIMPLS coefficients, and their spread by block bootstrap."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ferryid.identify.fit_data import Coefficients, Estimate, FitData
from ferryid.identify.inertia.shares import held_inertia_reason, implausible_inertia, without_inertia
from ferryid.models.forces import effective_mass
from ferryid.regression import Simpls, fit_simpls
from ferryid.regression.bases import Basis
from ferryid.regression.resampling import bootstrap_coefficients
from ferryid.types import Floats


def estimate_correction(data: FitData, components: int, draws: int, progress: Callable[[str], None]) -> Estimate:
    """Estimate the correction with a number of components, and with `draws` its spread.

    Where no actuator acts on an axis, or the inertia there cannot be right, the base model's inertia is held; see
    `ferryid.identify.inertia.shares`.

    Parameters
    ----------
    data
        Training rows, or their sums.
    components
        Number wanted; beyond the terms as many as there are terms.
    draws
        Draws of the bootstrap; 0: no intervals.
    progress
        Called with the name of each stage.
    """
    functions, regression, chosen, held = _regress(data, components)
    found, offset = regression.coefficients[chosen - 1], regression.intercepts[chosen - 1]
    feasible = data.feasible(found, functions.mask)
    possible = found if feasible is None else feasible.gains
    theta, intercept = data.force_form(possible, offset)
    contradicted = () if feasible is None else feasible.notes
    if not draws:
        K = len(functions.terms)
        none = np.full((K, 3), np.nan)
        covariance = np.full((3, K + 1, K + 1), np.nan)
        coefficients = Coefficients(theta, intercept, none, none, none[0], none[0], covariance)
        return Estimate(functions, regression, chosen, coefficients, (*held, *contradicted), ())
    progress("resampling blocks for the intervals")
    blocks, block_s, notes = data.resampling_blocks(found, offset)

    def drawn(coefficients: Floats, intercepts: Floats) -> tuple[Floats, Floats]:
        coefficients = data.scattered(coefficients, functions.mask)
        return data.force_form(coefficients if feasible is None else feasible.moved(coefficients), intercepts)

    spread = bootstrap_coefficients(
        blocks,
        chosen,
        draws=draws,
        seed=data.settings.seed,
        allowed=functions.mask,
        block_s=block_s,
        notes=notes,
        where=data.where,
        transform=drawn,
    )
    coefficients = Coefficients(
        theta, intercept, spread.low, spread.high, spread.intercept_low, spread.intercept_high, spread.covariance
    )
    return Estimate(functions, regression, chosen, coefficients, (*held, *contradicted), spread.notes)


def _regress(data: FitData, components: int) -> tuple[Basis, Simpls, int, tuple[str, ...]]:
    """Return basis, SIMPLS fit and number of components, and on which axes the inertia had to be held and why."""
    functions, settings = data.functions, data.settings
    already = 0.0 if data.before is None else data.before
    most = len(functions.terms)
    chosen = min(components, most)
    fitted = functions.mask.any(axis=0)
    axes = data.without_force & fitted if settings.inertia == "auto" else np.zeros(3, dtype=bool)
    held = {
        axis: held_inertia_reason(axis, np.zeros((3, 3)), data.profile, True) for axis in np.flatnonzero(axes).tolist()
    }
    while True:
        functions = replace(functions, mask=without_inertia(functions.mask, functions.terms, axes))
        regression = fit_simpls(data.training, most, allowed=functions.mask)
        found, offset = regression.coefficients[chosen - 1], regression.intercepts[chosen - 1]
        feasible = data.feasible(found, functions.mask)
        theta = data.force_form(found if feasible is None else feasible.gains, offset)[0] + already
        mass = effective_mass(data.profile, settings.scale, functions.terms, theta)
        more = implausible_inertia(data.profile, mass) & fitted & ~axes
        if settings.inertia == "fitted" or feasible is not None or not more.any():
            return functions, regression, chosen, tuple(held.values())
        held |= {axis: held_inertia_reason(axis, mass, data.profile, False) for axis in np.flatnonzero(more).tolist()}
        axes = axes | more
