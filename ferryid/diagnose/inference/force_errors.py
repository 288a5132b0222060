"""Errors of a force model as forces along the vessel's axes, in the weak form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats


def force_errors(windows: Windows, force_model: ForceModel, plain: ForceModel) -> Floats:
    """Return a force model's force less the one that the velocities show [N, N, N·m], in every window, shape (J, 3)."""
    velocities = replace(windows, channels=np.repeat([False, True], 3))
    return np.asarray(velocities.gap(force_model) @ mass_of(plain.hull).T)


def position_errors(windows: Windows, force_model: ForceModel, plain: ForceModel) -> Floats | None:
    """Return the same as the positions and headings show it, shape (J, 3); None where there are none."""
    if not windows.channels[0]:
        return None
    return np.asarray(windows.along_vessel(windows.gap(force_model)) @ mass_of(plain.hull).T)


def mass_of(hull: Floats) -> Floats:
    """Return the mass matrix of coefficients in the order of `COEFFICIENTS`, shape (3, 3)."""
    m11, m22, m23, m32, m33 = hull[:5]
    return np.array([[m11, 0.0, 0.0], [0.0, m22, m23], [0.0, m32, m33]])
