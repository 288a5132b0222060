"""The columns of a finding's figure: what is left over without and with it, on the axis and the quantity that show it best."""

from __future__ import annotations

from typing import Any

import numpy as np

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging.locate import Location
from ferryid.effects.force_model import ForceModel
from ferryid.types import AXES, Floats


def figure_columns(
    problem: EstimationProblem, place: Location, regressor: tuple[str, Floats] | None, *, alone: bool = False
) -> dict[str, Any]:
    """Return `evidence` and `labels` of a finding.

    Parameters
    ----------
    problem
        The log.
    place
        Where the errors without the finding differ from those with it.
    regressor
        Label and values on the rows of the measurements, shape (n,), of the quantity that gives the finding away.
    alone
        True where nothing explains what is left over.
    """
    return error_columns(problem.windows, (place.before, place.after), best_axis(place), regressor, alone=alone)


def error_columns(
    windows: Windows,
    errors: tuple[Floats, Floats],
    axis: int,
    regressor: tuple[str, Floats] | None,
    *,
    alone: bool = False,
) -> dict[str, Any]:
    """Return the same of force errors of every window without and with a finding, shape (J, 3) each, on one axis."""
    before, after = (one[:, axis] for one in errors)
    columns = {"t": windows.middle_s, "before": before}
    if not alone:
        # Of the model's error, what the finding adds takes away.
        columns |= {"after": after, "explained": before - after}
    kind, unit = ("moment", "N·m") if axis == 2 else ("force", "N")
    labels = {"residual": f"{AXES[axis]} {kind} left over [{unit}]"}
    if regressor is not None:
        label, values = regressor
        columns["regressor"] = _in_windows(windows, label, values)
        labels["regressor"] = label
    return {"evidence": columns, "labels": labels}


def best_axis(place: Location) -> int:
    """Return the axis on which the eye sees a finding best: by what it adds, over what is left with it.

    Where nothing is added, it is the axis with the greatest share.
    """
    return axis_of_errors(place.before, place.after, place.shares)


def axis_of_errors(before: Floats, after: Floats, shares: Floats) -> int:
    """Return the same axis of force errors of every window, shape (J, 3), and the shares of the axes, shape (3,)."""
    added = np.mean((before - after) ** 2, axis=0)
    return int(np.argmax(added / np.mean(after**2, axis=0) if added.any() else shares))


def figure_regressor(
    candidate: Candidate, force_model: ForceModel, values: Floats, place: Location
) -> tuple[str, Floats] | None:
    """Return label and values of the quantity that gives an effect away, where the effect names one."""
    name = candidate.effect.regressor
    return None if name is None else name(force_model, values, candidate.instance, AXES[best_axis(place)])


def _in_windows(windows: Windows, label: str, values: Floats) -> Floats:
    """Return a quantity in every window: its mean, as forces are shown, but of an angle the one in the middle."""
    if label.endswith("[deg]"):
        return np.asarray(values[windows.starts + len(windows.weight) // 2])
    return windows.mean(values[:, None])[:, 0]
