"""One correction fitted to motions in memory, on all rows: what `ferryid.identify.adapt` is made of."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from ferryid import __version__
from ferryid.errors import FerryIdError
from ferryid.identify.basis import Basis, basis
from ferryid.identify.bootstrap import Blocks, block_seconds, bootstrap
from ferryid.identify.choose import choose, folds_by_blocks, force_free, pieces_of
from ferryid.identify.combine import check_vessel
from ferryid.identify.estimate import Estimator, estimator
from ferryid.identify.excitation import ranges
from ferryid.identify.fit import forceless, regress
from ferryid.identify.judge import wanted_rows
from ferryid.identify.model import Model
from ferryid.identify.qr import factorise
from ferryid.identify.residual import residual
from ferryid.identify.rows import basis_of, grids, known_rows, rows_of
from ferryid.identify.scores import force_scores
from ferryid.identify.settings import FitSettings
from ferryid.signals.track import Motion
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Profile

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Task:
    """What is fitted: a correction to `targets` on the rows that `masks` marks, one of each a motion."""

    functions: Basis
    motions: tuple[Motion, ...]
    targets: tuple[Floats, ...]
    masks: tuple[Flags, ...]


@dataclass(frozen=True, eq=False)
class Correction:
    """A fitted correction with its spread, NaN where none was asked for."""

    theta: Floats
    intercept: Floats
    low: Floats
    high: Floats
    intercept_low: Floats
    intercept_high: Floats
    covariance: Floats
    components: int
    notes: tuple[str, ...]


def task_of(
    profile: Profile,
    motions: Sequence[Motion],
    settings: FitSettings,
    base: Model | None,
    rows: Sequence[Flags] | None,
) -> Task:
    """Return basis, residual and usable rows of motions; arguments as in `ferryid.identify.adapt.fit_motions`.

    Raises
    ------
    FerryIdError
        For motions that cannot be used, or a base of another vessel or basis.
    """
    if not motions:
        raise FerryIdError("fit: there are no motions to fit. Fix: give one or more")
    settings = settings.on(profile)
    if base is None:
        functions = basis_of(settings, motions)
    else:
        _check_base(base, profile, settings)
        functions = basis(str(base.settings["basis"]), structure=settings.structure)
    targets = [residual(profile, motion, settings.scale, settings.residual) for motion in motions]
    measured = (
        targets
        if settings.residual == "measured"
        else [residual(profile, motion, settings.scale) for motion in motions]
    )
    masks = []
    for motion, target, error, wanted in zip(motions, targets, measured, wanted_rows(motions, rows), strict=True):
        mask = known_rows(motion, functions, target, error) & wanted
        if not mask.any():
            raise FerryIdError(
                f"{motion.log}: none of the rows asked for has velocity, acceleration and applied force. "
                "Fix: ask for other rows, or leave the motion out"
            )
        masks.append(mask)
    if base is not None:
        targets = [
            target - (functions.of(motion) @ base.theta + base.intercept)
            for motion, target in zip(motions, targets, strict=True)
        ]
    return Task(functions, tuple(motions), tuple(targets), tuple(masks))


def _check_base(base: Model, profile: Profile, settings: FitSettings) -> None:
    where, name = f"{base.name}@{base.version}", str(base.settings["basis"])
    if base.diagnosed:
        raise FerryIdError(
            f"model {where}: a diagnosis has changed its hull or forces, and a correction would be fitted to what these "
            "explain. Fix: take the model that was diagnosed as the base"
        )
    if settings.basis not in (name, name.partition("+")[0]):
        raise FerryIdError(
            f"model {where}: as a base its basis {name} must be that of the fit, which is {settings.basis}. "
            f"Fix: set the basis to {name}"
        )
    estimator(base)  # refuses a model whose terms were changed
    if base.profile_text != profile.text:
        check_vessel(profile, parse_profile(base.profile_text, base.name), where)
    if settings.residual == "parallel":
        raise FerryIdError(
            f"model {where}: the parallel residual runs the physical base model and cannot be taken against a model. "
            "Fix: use the residual measured or commanded"
        )


def correct(profile: Profile, settings: FitSettings, task: Task, base: Model | None, draws: int) -> Correction:
    """Fit the correction, and with `draws` its spread; where inertia had to be held, its notes say so."""
    masks = task.masks
    rows = rows_of(task.functions, task.motions, task.targets, masks)
    training = factorise(*rows, names=task.functions.terms, where=task.motions[0].log)
    already = None if base is None else base.theta
    functions, fitted, chosen, notes = regress(
        profile,
        settings,
        task.functions,
        training,
        _components(profile, settings, task, already),
        forceless(task.motions, task.targets, masks),
        before=already,
    )
    theta, intercept = fitted.coefficients[chosen - 1], fitted.intercepts[chosen - 1]
    K = len(functions.terms)
    if not draws:
        unknown = np.full((K, 3), np.nan)
        spread = (unknown, unknown, unknown[0], unknown[0], np.full((3, K + 1, K + 1), np.nan))
        return Correction(theta, intercept, *spread, chosen, notes)
    rates = [motion.rate_hz for motion in task.motions]
    block_s, narrow = block_seconds(rows, rates, theta, intercept)
    drawn = bootstrap(
        Blocks.of(rows, rates, block_s),
        chosen,
        draws=draws,
        seed=settings.seed,
        allowed=functions.mask,
        block_s=block_s,
        notes=narrow,
    )
    return Correction(
        theta,
        intercept,
        drawn.low,
        drawn.high,
        drawn.intercept_low,
        drawn.intercept_high,
        drawn.covariance,
        chosen,
        (*notes, *drawn.notes),
    )


def _components(profile: Profile, settings: FitSettings, task: Task, already: Floats | None) -> int:
    if settings.components != "auto":
        return int(settings.components)
    logs = [
        pieces_of(task.functions, (motion, target), [(motion, target)], settings.window_s, wanted=mask)
        for motion, target, mask in zip(task.motions, task.targets, task.masks, strict=True)
    ]
    return choose(
        profile,
        settings,
        task.functions,
        [settings.window_s],
        folds_by_blocks(logs),
        force_free(logs),
        before=already,
        where=logs[0].log,
    ).components


def bare_model(profile: Profile, settings: FitSettings, task: Task, found: Correction, name: str, draws: int) -> Model:
    """Return a model of the correction alone, without scores."""
    nu, nu_dot = (
        np.concatenate([values[mask] for values, mask in zip(columns, task.masks, strict=True)])
        for columns in ([motion.nu for motion in task.motions], [motion.nu_dot for motion in task.motions])
    )
    return Model(
        name=name,
        version=0,
        created=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        ferryid_version=__version__,
        profile_text=profile.text,
        scale=settings.scale,
        settings={
            **settings.plain(),
            "basis": task.functions.name,
            "components": found.components,
            "split": "none",
            "draws": draws,
            "notes": list(found.notes),
            **grids(task.motions, settings),
        },
        terms=task.functions.terms,
        units=task.functions.units,
        theta=found.theta,
        intercept=found.intercept,
        low=found.low,
        high=found.high,
        intercept_low=found.intercept_low,
        intercept_high=found.intercept_high,
        covariance=found.covariance,
        ranges=ranges(nu, nu_dot),
        training=tuple(
            {
                "name": motion.log,
                "files": [],
                "sha256": _digest(motion),
                "seconds": float(mask.sum() / motion.rate_hz),
                "rows": int(mask.sum()),
            }
            for motion, mask in zip(task.motions, task.masks, strict=True)
        ),
        scores={},
        accepted=False,
    )


def scored(model: Model, task: Task, before: Estimator) -> Model:
    """Return the model with its scores on the training rows, against what it was fitted on top of."""
    after = estimator(model)
    taus, olds, news = [], [], []
    for motion, mask in zip(task.motions, task.masks, strict=True):
        taus.append(motion.tau[mask])
        olds.append(before.of(motion)[mask])
        news.append(after.of(motion)[mask])
    tau = np.concatenate(taus)
    scores = force_scores(tau, np.concatenate(olds), np.concatenate(news), np.ones(len(tau), dtype=bool))
    seconds = sum(float(mask.sum()) / motion.rate_hz for motion, mask in zip(task.motions, task.masks, strict=True))
    notes = ["Nothing was held out: the scores are those of the rows that trained the model, and flatter it."]
    return replace(
        model, scores={**scores, "rows": len(tau), "seconds": seconds, "split": "none", "split_notes": notes}
    )


def _digest(motion: Motion) -> str:
    """SHA-256 of a motion in memory, which has no file to name: of its velocity, acceleration and force."""
    digest = hashlib.sha256(f"{motion.rate_hz!r} {len(motion.t)}".encode())
    for values in (motion.nu, motion.nu_dot, motion.tau):
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()
