"""The columns of a finding's figure: what is left over without and with it, on the axis and the quantity that show it best."""

from __future__ import annotations

from typing import Any

import numpy as np

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem
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
    axis = best_axis(place)
    before, after = place.before[:, axis], place.after[:, axis]
    columns = {"t": place.middle_s, "before": before}
    if not alone:
        # Of the model's error, what the finding adds takes away.
        columns |= {"after": after, "explained": before - after}
    kind, unit = ("moment", "N·m") if axis == 2 else ("force", "N")
    labels = {"residual": f"{AXES[axis]} {kind} left over [{unit}]"}
    if regressor is not None:
        label, values = regressor
        columns["regressor"] = _in_windows(problem, label, values)
        labels["regressor"] = label
    return {"evidence": columns, "labels": labels}


def best_axis(place: Location) -> int:
    """Return the axis on which the eye sees a finding best: by what it adds, over what is left with it.

    Where nothing is added, it is the axis with the greatest share.
    """
    added = np.mean((place.before - place.after) ** 2, axis=0)
    return int(np.argmax(added / np.mean(place.after**2, axis=0) if added.any() else place.shares))


def figure_regressor(
    candidate: Candidate, force_model: ForceModel, values: Floats, place: Location
) -> tuple[str, Floats] | None:
    """Return label and values of the quantity that gives an effect away, where the effect names one."""
    name = candidate.effect.regressor
    return None if name is None else name(force_model, values, candidate.instance, AXES[best_axis(place)])


def _in_windows(problem: EstimationProblem, label: str, values: Floats) -> Floats:
    """Return a quantity in every window: its mean, as forces are shown, but of an angle the one in the middle."""
    windows = problem.windows
    if label.endswith("[deg]"):
        return np.asarray(values[windows.starts + len(windows.weight) // 2])
    return windows.mean(values[:, None])[:, 0]
