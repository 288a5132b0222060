"""Interactive figures of a fit and of a comparison: measured and estimated force, motion and track on one time axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ferryid.compare import ComparedLog, ComparedModel
from ferryid.identify import LogFit
from ferryid.report.figures import SYMBOLS, UNITS
from ferryid.report.structure import worst_and_best_minute, worst_minute
from ferryid.report.timeline import PALETTE, Arrows, Mark, Strip, Timeline, Trace, flagged, left_out_spans
from ferryid.signals.track import Motion
from ferryid.types import AXES, Flags, Floats

MINUTE_S = 60.0


def fit_timeline(log: LogFit) -> Timeline | None:
    """Return the interactive figures of one log of a fit; None where it has too few rows to draw."""
    motion = log.motion
    estimates = {
        "base model": (log.tau_base, "base", (), False),
        "new model": (log.tau_model, "new", (), True),
    }
    minutes = worst_and_best_minute(log)
    marks = () if minutes is None else (_minute("worst minute", minutes[0]), _minute("best minute", minutes[1]))
    return _timeline(
        motion,
        motion.valid,
        estimates,
        (*flagged(motion.t, log.validation, "validation", "validation"), *left_out_spans(motion.left_out)),
        marks,
        ("new model", log.tau_model),
    )


def comparison_timeline(
    log: ComparedLog, models: Sequence[ComparedModel], looks: Mapping[str, Mapping[str, Any]]
) -> Timeline | None:
    """Return those of one log of a comparison, `looks` as of `ferryid.report.comparison_figures.looks`."""
    estimates = {}
    number = 0
    for model, tau in zip(models, log.taus, strict=True):
        colour = "grey" if model.is_base else f"c{number % PALETTE}"
        style = looks[model.label]["linestyle"]
        dash = () if style == "-" else tuple(4.0 * float(one) for one in style[1])
        # A base model may be wild.
        estimates[model.label] = (tau, colour, dash, not model.is_base)
        number += not model.is_base
    start = worst_minute(log.motion, log.taus, log.rows, MINUTE_S)
    marks = () if start is None else (_minute("minute with the greatest errors", start),)
    return _timeline(log.motion, log.rows, estimates, left_out_spans(log.motion.left_out), marks, None)


def _minute(title: str, start: float) -> Mark:
    return Mark(title, ((start, start + MINUTE_S),))


def _timeline(
    motion: Motion,
    rows: Flags,
    estimates: Mapping[str, tuple[Floats, str, tuple[float, ...], bool]],
    spans: tuple[Any, ...],
    marks: tuple[Mark, ...],
    residual: tuple[str, Floats] | None,
) -> Timeline | None:
    if len(motion.t) < 2:
        return None
    known = np.where(rows[:, None], 1.0, np.nan)
    strips: list[Strip] = []
    for j in range(len(AXES)):
        traces = [
            Trace(label, (tau * known)[:, j], colour, framing=framing, dash=dash)
            for label, (tau, colour, dash, framing) in estimates.items()
        ]
        strips.append(
            Strip(
                f"{AXES[j]} {SYMBOLS[j]} [{UNITS[j]}]",
                (Trace("measured", (motion.tau * known)[:, j], "measured"), *traces),
            )
        )
        if residual is None:
            left = tuple(replace(one, values=(motion.tau * known)[:, j] - one.values) for one in traces)
            strips.append(Strip(f"{AXES[j]} {SYMBOLS[j]}, residual [{UNITS[j]}]", left))
    nu = motion.nu * known
    strips += [
        Strip(
            "velocity over ground [m/s]",
            (Trace("surge u", nu[:, 0], "c0"), Trace("sway v", nu[:, 1], "c1", dash=(6.0, 3.0))),
        ),
        Strip("yaw rate [deg/s]", (Trace("yaw rate r", np.degrees(nu[:, 2]), "c0"),)),
    ]
    place = motion.eta if np.isfinite(motion.eta).all(axis=1).any() else None
    arrows = []
    for name, flow in (("wind", motion.wind), ("current", motion.current)):
        if flow is not None:
            colour = {"wind": "c2", "current": "c3"}[name]
            arrows.append(Arrows(f"{name}, measured", "m/s", colour, flow[:, 0], flow[:, 1]))
    if residual is not None:
        label, tau = residual
        cos, sin = np.cos(motion.eta[:, 2]), np.sin(motion.eta[:, 2])
        x, y, _ = ((motion.tau - tau) * known).T
        arrows.append(Arrows(f"residual of the {label}", "N", "new", cos * x - sin * y, sin * x + cos * y))
    return Timeline(motion.log, motion.t, tuple(strips), spans, marks, place, tuple(arrows))
