"""What a fit takes from motions: which basis they allow, which rows are known, and basis and outputs on these."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.identify.settings import FitSettings
from ferryid.models import usable_rows
from ferryid.regression import Rows
from ferryid.regression.bases import SWAY, Basis, make_basis, relative_flow
from ferryid.signals.smooth import Measured, odd_rows
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats


def basis_for(settings: FitSettings, motions: Sequence[Motion | Measured]) -> Basis:
    """Return the basis of the settings; wind and current join it when every log has them, unless the name says how.

    Its mask is without sway where that is not measured.
    """
    functions = _full_basis(settings, motions)
    return functions.without((SWAY,)) if settings.reduced else functions


def _full_basis(settings: FitSettings, motions: Sequence[Motion | Measured]) -> Basis:
    if "+" in settings.basis:
        return make_basis(settings.basis, structure=settings.structure)
    wind = "thesis" if all(motion.wind is not None for motion in motions) else None
    current = "thesis" if all(motion.current is not None for motion in motions) else None
    return make_basis(settings.basis, wind=wind, current=current, structure=settings.structure)


def known_rows(motion: Motion, functions: Basis, target: Floats, error: Floats) -> Flags:
    """Return the rows on which force, residual and every measurement that the basis needs are known."""
    rows = usable_rows(motion, target, error, motion.nu, motion.nu_dot)
    if functions.needs_wind and motion.wind is not None:
        rows &= np.isfinite(motion.wind).all(axis=1) & np.isfinite(motion.eta[:, 2])
    if functions.needs_current and motion.current is not None:
        rows &= np.isfinite(motion.current).all(axis=1) & np.isfinite(motion.eta[:, 2])
    if not rows.any():
        raise FerryIdError(
            f"{motion.log}: no moment at which velocity, acceleration and applied force are all known. "
            "Fix: see ferryid inspect for gaps, and give a log in which navigation and actuators overlap"
        )
    return rows


def rows_of(
    functions: Basis, motions: Sequence[Motion], outputs: Sequence[Floats], masks: Sequence[Flags]
) -> list[Rows]:
    """Return basis and outputs of the marked rows of every log; the basis is evaluated in chunks and forgotten."""
    rows = []
    for motion, output, mask in zip(motions, outputs, masks, strict=True):
        flows = [
            relative_flow(motion.nu, motion.eta[:, 2], flow) if needed and flow is not None else None
            for needed, flow in ((functions.needs_wind, motion.wind), (functions.needs_current, motion.current))
        ]
        rows.append(
            Rows((motion.nu, motion.nu_dot, *flows), output, mask, fill=functions.fill, terms=len(functions.terms))
        )
    return rows


def grids(motions: Sequence[Motion], settings: FitSettings) -> dict[str, Any]:
    """Return the grid rates [Hz] and window lengths [s] that came of the settings."""
    rates = sorted({motion.rate_hz for motion in motions})
    rows = [odd_rows(settings.window_s, rate) for rate in rates]
    return {"grid_hz": rates, "window_rows": rows} if settings.smoother == "square" else {"grid_hz": rates}
