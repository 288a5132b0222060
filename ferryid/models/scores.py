"""Force errors of models per axis, the same for fit, evaluate and compare."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ferryid.signals.track import Motion
from ferryid.types import AXES, Flags, Floats, by_axis


@dataclass(frozen=True, eq=False)
class ForceScores:
    """Errors of the applied force that a base model and a model estimate, on the same rows.

    Attributes
    ----------
    mse_base, mse_model
        Mean square error in surge, sway [N²] and yaw [N²·m²], shape (3,).
    r2_base, r2_model
        Coefficient of determination, shape (3,); NaN where the force never varies.
    ratio
        MSE of the model over the base model's, shape (3,); NaN where the base model makes no error.
    normalised_mse
        Mean of the ratios that are known.
    mse_constant_velocity
        Mean square error of predicting that the velocity does not change, shape (3,): a model that errs more is of no use to
        predict motion (the reference of a skill score; Murphy 1988). NaN where errors are not those of an acceleration.
    """

    mse_base: Floats
    mse_model: Floats
    r2_base: Floats
    r2_model: Floats
    ratio: Floats
    normalised_mse: float
    mse_constant_velocity: Floats = field(default_factory=lambda: np.full(3, np.nan))

    @classmethod
    def of(cls, mse_base: Floats, mse_model: Floats, variance: Floats) -> ForceScores:
        """Return the scores of mean square errors and the variance of the measured force, shape (3,) each."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(mse_base > 0, mse_model / mse_base, np.nan)
            r2 = [np.where(variance > 0, 1.0 - mse / variance, np.nan) for mse in (mse_base, mse_model)]
        known = ratio[np.isfinite(ratio)]
        return cls(mse_base, mse_model, r2[0], r2[1], ratio, float(known.mean()) if known.size else math.nan)

    @property
    def skill_warnings(self) -> dict[str, str]:
        """Sentences on the axes on which the model errs more than a velocity that does not change, by axis."""
        roots = zip(AXES, np.sqrt(self.mse_model).tolist(), np.sqrt(self.mse_constant_velocity).tolist(), strict=True)
        return {
            axis: f"In {axis} the model predicts acceleration worse than a velocity that does not change (rms error "
            f"{error:.3g} against {none:.3g} {'N·m' if axis == 'yaw' else 'N'}). Do not rely on the model there."
            for axis, error, none in roots
            if error > none
        }

    def without_sway(self) -> ForceScores:
        """Return the scores where sway was not measured: NaN there, and the mean of the other axes."""
        known = np.array([1.0, np.nan, 1.0])
        ratio = self.ratio * known
        finite = ratio[np.isfinite(ratio)]
        return ForceScores(
            self.mse_base * known,
            self.mse_model * known,
            self.r2_base * known,
            self.r2_model * known,
            ratio,
            float(finite.mean()) if finite.size else math.nan,
            self.mse_constant_velocity * known,
        )

    def to_json(self) -> dict[str, Any]:
        """Return the scores as plain values by the names of the axes."""
        still = self.mse_constant_velocity
        return {
            "mse": {
                "base": by_axis(self.mse_base),
                "model": by_axis(self.mse_model),
                **({"constant_velocity": by_axis(still)} if np.isfinite(still).any() else {}),
            },
            "r2": {"base": by_axis(self.r2_base), "model": by_axis(self.r2_model)},
            "per_axis": by_axis(self.ratio),
            "normalised_mse": self.normalised_mse,
        }


@dataclass(frozen=True, eq=False)
class ModelScores:
    """Scores in a model file.

    Attributes
    ----------
    force
        Force errors.
    rows, seconds
        How many rows they are of, and their length [s].
    split
        How these rows were set apart; ``"none"`` where nothing was held out.
    split_notes
        The same in sentences.
    measure
        ``"force"``: errors of the estimated force, row by row; ``"prediction"``: errors of the predicted acceleration, as a
        force on the base model's mass, in windows of some seconds, which noise does not drown.
    interval
        95 % interval of ``force.normalised_mse``; None where there are too few independent blocks, or it was not sought.
    """

    force: ForceScores
    rows: int
    seconds: float
    split: str
    split_notes: tuple[str, ...]
    measure: str = "force"
    interval: tuple[float, float] | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the scores as a model file has them."""
        return {
            **self.force.to_json(),
            "rows": self.rows,
            "seconds": self.seconds,
            "split": self.split,
            "split_notes": list(self.split_notes),
            "measure": self.measure,
            "interval": None if self.interval is None else list(self.interval),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ModelScores:
        """Return the scores of a model file.

        Raises
        ------
        KeyError, TypeError or ValueError
            Where a part is missing, or of another kind.
        """

        def axes(values: Mapping[str, float | None]) -> Floats:
            return np.array([math.nan if values[axis] is None else values[axis] for axis in AXES], dtype=np.float64)

        mean = data["normalised_mse"]
        return cls(
            ForceScores(
                mse_base=axes(data["mse"]["base"]),
                mse_model=axes(data["mse"]["model"]),
                r2_base=axes(data["r2"]["base"]),
                r2_model=axes(data["r2"]["model"]),
                ratio=axes(data["per_axis"]),
                normalised_mse=math.nan if mean is None else float(mean),
                mse_constant_velocity=axes(data["mse"].get("constant_velocity", dict.fromkeys(AXES))),
            ),
            rows=int(data["rows"]),
            seconds=float(data["seconds"]),
            split=str(data["split"]),
            split_notes=tuple(str(note) for note in data["split_notes"]),
            measure=str(data.get("measure", "force")),
            interval=_ends(data.get("interval")),
        )


def _ends(interval: Sequence[float] | None) -> tuple[float, float] | None:
    """Return the ends of an interval of a model file; ValueError where there are not two."""
    if interval is None:
        return None
    low, high = interval
    return float(low), float(high)


def usable_rows(motion: Motion, *estimates: Floats) -> Flags:
    """Return the rows on which force and every estimate are known, shape (n,)."""
    rows: Flags = motion.valid & np.isfinite(motion.tau).all(axis=1)
    for estimate in estimates:
        rows = rows & np.isfinite(estimate).all(axis=1)
    return rows


def mean_square(tau: Floats, estimate: Floats, rows: Flags) -> Floats:
    """Return the mean square of ``tau - estimate`` over `rows` per axis, shape (3,) [N², N², (N·m)²]."""
    if not rows.any():
        return np.full(3, np.nan)
    result: Floats = np.mean((tau[rows] - estimate[rows]) ** 2, axis=0)
    return result


def force_scores(tau: Floats, base: Floats, model: Floats, rows: Flags) -> ForceScores:
    """Return MSE and R² of base and model over `rows` per axis, their ratio, and its mean over the axes that can be judged."""
    variance = np.var(tau[rows], axis=0) if rows.any() else np.full(3, np.nan)
    return ForceScores.of(mean_square(tau, base, rows), mean_square(tau, model, rows), variance)
