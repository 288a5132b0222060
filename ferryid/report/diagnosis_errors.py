"""Errors without and with the findings of a diagnosis, as tables."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite, pi, tau
from typing import Any

from ferryid.diagnose import Diagnosis, Estimate, error_ratio
from ferryid.effects.wording import listed
from ferryid.types import AXES

FREE_RUN = (
    ("position_m", "position", "m", 1.0),
    ("heading_rad", "heading", "deg", 57.29577951308232),
    ("speed_mps", "speed", "m/s", 1.0),
    ("yaw_rate_radps", "yaw rate", "deg/s", 57.29577951308232),
)
WORSE_RUN = 1.1
"""Ratio of free-run errors from which a caution is given: less may be chance."""
DIVERGED_MPS = 50.0
"""Speed error of free runs above which they diverged [m/s]: how far is the integrator's, and no measure of a model."""


def fitted(diagnosis: Diagnosis) -> bool:
    """Return whether the errors with the findings are others than without: what has no name is not in them."""
    after = diagnosis.after.get("mse", {})
    return bool(diagnosis.findings) and bool(after) and after != diagnosis.before.get("mse", {})


def ratio_of(diagnosis: Diagnosis) -> dict[str, Estimate]:
    """Return force error after over before by axis; ends of the interval are NaN where they are not known."""
    given: Mapping[str, Any] = diagnosis.after.get("ratio", {})
    if given:
        return {
            axis: _estimated(given[axis])
            for axis in AXES
            if axis in given and isfinite(_number(given[axis].get("value")))
        }
    before, after = diagnosis.before.get("mse", {}), diagnosis.after.get("mse", {})
    return error_ratio(before, after)


def force_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return the rows of the table before and after: a name and a cell per axis."""
    rows = []
    both = fitted(diagnosis)
    parts = (("without the findings", diagnosis.before), ("with the findings", diagnosis.after))
    for name, part in parts if both else parts[:1]:
        mse = part.get("mse", {})
        if mse:
            label = f"root-mean-square error, {name}" if both else "root-mean-square error"
            rows.append({"name": label, "cells": [_cell(mse.get(axis), root=True) for axis in AXES]})
    if not both:
        return rows
    ratios = ratio_of(diagnosis)
    if ratios:
        rows.append({"name": "squared error, with over without", "cells": [_ratio(ratios.get(axis)) for axis in AXES]})
    before = diagnosis.before.get("mse", {})
    for name, mse in diagnosis.after.get("placebos", {}).items():
        cells = [_cell(_over(mse.get(axis), before.get(axis))) for axis in AXES]
        rows.append({"name": f"the same with a placebo: {name}", "cells": cells})
    return rows


def free_run_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return free-run error before, after and their ratio, a row a quantity, at the longest horizon that has data.

    Where ratios with intervals are given, their horizon is the one. A quantity without data has no row.
    """
    before, after = diagnosis.before.get("free_run", {}), diagnosis.after.get("free_run", {})
    horizons = list(before.get("horizons_s", ()))
    ratios = diagnosis.after.get("free_run_ratio", {})
    diverged = [_diverged(run) for run in (before, after)]
    rows = []
    for key, name, unit, factor in FREE_RUN:
        runs = [run[key] for run in (before, after) if run.get(key)]
        known = [k for k in range(len(horizons)) if runs and all(isfinite(_number(run[k])) for run in runs)]
        if not known:
            continue
        given = ratios.get(key) if ratios.get("horizon_s") in [horizons[k] for k in known] else None
        k = horizons.index(ratios["horizon_s"]) if given else known[-1]
        one, other = (_number(run[key][k]) * factor if run.get(key) else float("nan") for run in (before, after))
        ratio = _estimated(given) if given else _bare(other / one if one > 0.0 else float("nan"))
        if any(diverged):
            ratio = _bare(float("nan"))
        cells = [
            "diverges" if away else _turned(key, each / factor, _cell(each))
            for each, away in zip((one, other), diverged, strict=True)
        ]
        rows.append(
            {
                "name": f"{name} after {horizons[k]:.3g} s [{unit}]",
                "quantity": name,
                "ratio": ratio.value,
                "low": ratio.low,
                "cells": [*cells, _ratio(ratio)],
            }
        )
    return rows


def free_run_caution(diagnosis: Diagnosis) -> str:
    """Return in what free runs err more with the findings than without, as a sentence; empty where in nothing."""
    if not fitted(diagnosis):
        return ""
    before, after = (_diverged(part.get("free_run", {})) for part in (diagnosis.before, diagnosis.after))
    if after:
        without = ", as they do without" if before else ""
        return (
            f"Free runs diverge with the findings{without}, whatever the force errors say: do not simulate with them."
        )
    worse = [
        f"{row['quantity']} ({row['ratio']:.2f} times)"
        for row in free_run_rows(diagnosis)
        if row["ratio"] > WORSE_RUN and row["low"] > 1.0
    ]
    if not worse:
        return ""
    return (
        f"Free runs err more with the findings, in {listed(worse)}, whatever the force errors say: do not simulate with them "
        "unchecked."
    )


def _diverged(run: Mapping[str, Any]) -> bool:
    """Return whether free runs diverged at some horizon."""
    return any(_number(one) > DIVERGED_MPS for one in run.get("speed_mps", ()))


def _estimated(given: Mapping[str, Any]) -> Estimate:
    return Estimate(_number(given.get("value")), _number(given.get("low")), _number(given.get("high")), "-")


def _bare(value: float) -> Estimate:
    """Return a ratio whose interval is not known."""
    return Estimate(value, float("nan"), float("nan"), "-")


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _over(value: float | None, base: float | None) -> float:
    return _number(value) / _number(base) if _number(base) > 0.0 else float("nan")


def _cell(value: float | None, *, root: bool = False) -> str:
    number = _number(value)
    if not isfinite(number):
        return "–"
    return f"{number**0.5 if root else number:.3g}"


def _turned(key: str, value: float, cell: str) -> str:
    """Return the cell of an error with turns beside it where a free run has turned by more than half of one too many."""
    return f"{cell} ({value / tau:.1f} turns)" if key == "heading_rad" and value > pi else cell


def _ratio(one: Estimate | None) -> str:
    if one is None or not isfinite(one.value):
        return "–"
    interval = f" ({one.low:.2f} to {one.high:.2f})" if isfinite(one.low) and isfinite(one.high) else ""
    return f"{one.value:.2f}{interval}"
