"""Diagnosis by output error: each effect added to a prediction-error fit of the hull, one after the other, chosen by BIC.

The recording is cut into segments. From its measured start each is integrated under the measured forces, and the hull's
coefficients and the effects' parameters are those with which positions, heading and velocities at the nodes of the segments
differ least from the measured ones (Ljung 1999, section 7.2). There is no prior, no model of the disturbances and no placebo:
an effect stands where it lowers Schwarz's criterion (1978), its time of onset, if it has one, counted as a parameter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log
from pathlib import Path

import numpy as np

from ferryid.cached import cached_property
from ferryid.counts import counted
from ferryid.diagnose import Estimate
from ferryid.effects import Effect, effects
from ferryid.effects.effect import HELD
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, Measurements, hull_of
from ferryid.effects.free_motion import run_freely
from ferryid.effects.hull_spread import default_hull_spread
from ferryid.effects.measurements import hull_force_model
from ferryid.errors import FerryIdError
from ferryid.types import Floats, Ints
from ferryid.validation.records import Finding
from ferryid.validation.rivals.base import prepared_log
from ferryid.vessel.dimensions import froude_seconds
from ferryid.vessel.profile import Profile

SEGMENT_S, STEP_S = 10.0, 0.5
"""Length of a segment and of a step of the integration [s], for a vessel of 5 m; others by Froude's law."""
ONSETS = 7
"""Times at which an effect that may set in is tried, evenly over the recording."""
MOST_EFFECTS = 4
ROUNDS = 4
"""Gauss-Newton steps of a fit."""
REFINED = 3
"""Best effects of a round that are fitted; the others are judged by their slopes."""
PROBE = 1e-3
"""Finite difference, in sizes of a parameter."""
MARGIN = 1e-9
LARGEST = 1e6
"""Bound of pose and velocities in an integration that diverges [m, rad, m/s, rad/s]."""
SMALLEST = 1e-10
"""Share of the largest singular value of columns below which one counts as zero."""
FEWEST = 12
"""Segments below which there is nothing to choose by."""


@dataclass(frozen=True)
class Tried:
    """An effect in one instance from a time on [s]."""

    effect: Effect
    instance: str | None
    onset_s: float
    sizes: Floats
    neutral: Floats
    bounds: tuple[Floats, Floats]
    names: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def key(self) -> tuple[str, str | None]:
        """Effect and instance."""
        return self.effect.id, self.instance

    @property
    def cost(self) -> int:
        """Parameters that it spends, its time among them."""
        return len(self.sizes) + (self.onset_s > 0.0)

    def act(self, force_model: ForceModel, z: Floats) -> ForceModel:
        """Return a force model with the effect in it; `z` in sizes from neutral."""
        values = np.clip(self.neutral + self.sizes * z, *self.bounds)
        return self.effect.act(force_model, values, self.instance, self.onset_s)


@dataclass(frozen=True, eq=False)
class Segments:
    """Where the integration starts, and what is measured at its nodes."""

    plain: ForceModel
    starts: Ints
    stride: int
    steps: int
    weights: Floats

    @cached_property
    def units(self) -> Floats:
        """A unit of every coefficient of the hull, shape (26,)."""
        seen = self.plain.measurements
        return default_hull_spread(seen.profile, seen.nu[seen.usable])

    def left(self, force_model: ForceModel) -> Floats:
        """Return what a force model leaves of every node and channel, over the usual error of the channel, shape (m,)."""
        seen = force_model.measurements
        states = run_freely(force_model, self.starts, self.stride, self.steps, LARGEST)[1:]
        rows = self.starts + self.stride * np.arange(1, self.steps + 1)[:, None]
        left = (np.concatenate([seen.eta[rows], seen.nu[rows]], axis=2) - states) * self.weights
        return np.asarray(left[:, :, self.weights > 0.0].ravel())


def diagnose(log: str, profile: Profile, out: Path) -> tuple[Finding, ...]:
    """Return the effects that lower the criterion, in the order in which they were chosen.

    Parameters
    ----------
    log
        Path; parts of one recording joined by ``+``.
    profile
        The vessel.
    out
        Output folder, whose ``logs`` keep the ingested tables.

    Raises
    ------
    FerryIdError
        For a log that cannot be used.
    """
    segments = _cut(log, profile, out)
    library = _library(segments.plain.measurements)
    chosen: list[Tried] = []
    z, left, slopes = _fitted(segments, chosen, np.zeros(len(COEFFICIENTS)))
    criterion = _criterion(left, len(COEFFICIENTS))
    while len(chosen) < MOST_EFFECTS:
        taken = {one.key for one in chosen}
        promised = []
        # What is known already explains the same of what is left, whatever is tried beside it.
        known, largest = _span(slopes)
        unexplained = left - known @ (known.T @ left)
        for one in (other for other in library if other.key not in taken):
            columns = _slopes(segments, [*chosen, one], np.append(z, np.zeros(len(one.sizes))), left, len(z))
            more, scale = columns - known @ (known.T @ columns), max(largest, float(np.linalg.norm(columns)))
            rest = unexplained - _projected(more, unexplained, scale)
            promised.append((_criterion(rest, len(z) + sum(each.onset_s > 0.0 for each in chosen) + one.cost), one))
        promised.sort(key=lambda pair: pair[0])
        best = None
        for _, one in promised[:REFINED]:
            tried = [*chosen, one]
            found = _fitted(segments, tried, np.append(z, np.zeros(len(one.sizes))))
            value = _criterion(found[1], len(COEFFICIENTS) + sum(each.cost for each in tried))
            if best is None or value < best[0]:
                best = value, tried, found
        if best is None or best[0] >= criterion:
            break
        criterion, chosen, (z, left, slopes) = best[0], best[1], best[2]
    return _findings(chosen, z[len(COEFFICIENTS) :], left, slopes)


def _cut(log: str, profile: Profile, out: Path) -> Segments:
    from ferryid.effects.measurements import measurements_of_motion

    prepared = prepared_log(log, profile, out)
    assert prepared.track is not None
    seen = measurements_of_motion(prepared.track, prepared.motion, profile)
    plain = replace(hull_force_model(seen, hull_of(profile)), external=seen.air_load)
    length_s, step_s = (froude_seconds(profile, one) for one in (SEGMENT_S, STEP_S))
    stride = max(1, round(step_s / seen.step_s))
    steps = max(2, round(length_s / (stride * seen.step_s)))
    span = steps * stride
    whole = np.convolve(seen.usable, np.ones(span + 1), mode="valid") > span + 0.5
    starts, row = [], 0
    while row < len(whole):
        if whole[row]:
            starts.append(row)
            row += span
        else:
            row += 1
    if len(starts) < FEWEST:
        raise FerryIdError(
            f"{log}: too short to choose effects by, found {counted(len(starts), 'stretch')} of {length_s:.0f} s with force "
            f"and motion, {FEWEST} are needed. Fix: give a longer log"
        )
    one = Segments(plain, np.array(starts), stride, steps, np.ones(6))
    placed = np.isfinite(seen.eta[:, :2]).all()
    seen = seen if placed else replace(seen, eta=np.column_stack([np.zeros((len(seen.t), 2)), seen.eta[:, 2]]))
    one = replace(one, plain=replace(plain, measurements=seen))
    channels = np.array([placed, placed, True, True, True, True], dtype=np.float64)
    # Channels are weighed by what the hull that fits them all alike leaves of each.
    for _ in range(2):
        one = replace(one, weights=one.weights * channels)
        rest = _fitted(one, [], np.zeros(len(COEFFICIENTS)))[1].reshape(-1, int(np.count_nonzero(one.weights)))
        usual = np.ones(6)
        usual[one.weights > 0.0] = np.maximum(np.sqrt(np.mean(rest**2, axis=0)), 1e-12)
        one = replace(one, weights=one.weights / usual)
    return one


def has_parameters(effect: Effect) -> bool:
    """Return whether an effect can be added to the fit: it neither comes and goes by chance nor chooses its parameters."""
    return effect.unsteady is None and effect.choose is None and not effect.passing


def _library(seen: Measurements) -> list[Tried]:
    found = []
    times = [float(one) for one in np.linspace(seen.t[0], seen.t[-1], ONSETS + 2)[1:-1]]
    for effect in effects().values():
        if not has_parameters(effect) or effect.untestable(seen):
            continue
        for instance in effect.testable_instances(seen):
            every = [one for one in effect.parameters_of(seen.profile) if one.size > HELD]
            if not every or len(every) != len(effect.parameters_of(seen.profile)):
                continue
            for onset_s in [0.0, *(times if effect.onset else [])]:
                found.append(
                    Tried(
                        effect,
                        instance,
                        onset_s,
                        np.array([one.size for one in every]),
                        np.array([one.neutral for one in every]),
                        (np.array([one.low for one in every]), np.array([one.high for one in every])),
                        tuple(one.name for one in every),
                        tuple(one.unit for one in every),
                    )
                )
    return found


def _force_model(segments: Segments, tried: Sequence[Tried], z: Floats) -> ForceModel:
    h = len(COEFFICIENTS)
    known = segments.plain.hull
    made = replace(segments.plain, hull=known + z[:h] * segments.units)
    at = h
    for one in tried:
        made = one.act(made, z[at : at + len(one.sizes)])
        at += len(one.sizes)
    return made


def _slopes(segments: Segments, tried: Sequence[Tried], z: Floats, left: Floats, first: int = 0) -> Floats:
    """Return minus the derivatives of what is left by the parameters from one on, shape (m, k)."""
    columns = []
    for k in range(first, len(z)):
        moved = z + PROBE * (np.arange(len(z)) == k)
        columns.append((left - segments.left(_force_model(segments, tried, moved))) / PROBE)
    return np.column_stack(columns) if columns else np.empty((len(left), 0))


def _span(columns: Floats, scale: float = 0.0) -> tuple[Floats, float]:
    """Return an orthonormal basis of what columns span, shape (m, r), and their largest singular value, at least `scale`."""
    basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    largest = max(float(sizes[0]), scale)
    return basis[:, sizes > SMALLEST * largest], largest


def _projected(columns: Floats, left: Floats, scale: float) -> Floats:
    """Return what columns explain of what is left by least squares; those much smaller than `scale` explain nothing."""
    basis, _ = _span(columns, scale)
    return np.asarray(basis @ (basis.T @ left))


def _fitted(segments: Segments, tried: Sequence[Tried], z: Floats) -> tuple[Floats, Floats, Floats]:
    """Return parameters, what they leave, and minus its slopes."""
    left = segments.left(_force_model(segments, tried, z))
    slopes = _slopes(segments, tried, z, left)
    for _ in range(ROUNDS):
        step = np.linalg.lstsq(slopes, left, rcond=1e-6)[0]
        better = None
        for share in (1.0, 0.5, 0.25, 0.1):
            there = segments.left(_force_model(segments, tried, z + share * step))
            if there @ there < (1.0 - MARGIN) * (left @ left):
                better = z + share * step, there
                break
        if better is None:
            break
        gained = 1.0 - better[1] @ better[1] / (left @ left)
        z, left = better
        slopes = _slopes(segments, tried, z, left)
        if gained < 1e-3:
            break
    return z, left, slopes


def _criterion(left: Floats, parameters: int) -> float:
    m = len(left)
    return m * log(max(float(left @ left), 1e-300) / m) + parameters * log(m)


def _findings(chosen: Sequence[Tried], z: Floats, left: Floats, slopes: Floats) -> tuple[Finding, ...]:
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(slopes.T @ slopes)), 0.0) * float(left @ left) / len(left))
    errors, found, at = spread[len(spread) - len(z) :], [], 0
    for one in chosen:
        own = slice(at, at + len(one.sizes))
        values = np.clip(one.neutral + one.sizes * z[own], *one.bounds)
        reach = 1.96 * one.sizes * errors[own]
        estimates = {
            name: Estimate(value, value - r, value + r, unit)
            for name, value, r, unit in zip(one.names, values.tolist(), reach.tolist(), one.units, strict=True)
        }
        onset = one.onset_s if one.onset_s > 0.0 else None
        found.append(Finding(one.effect.id, one.instance, 1.0, estimates, onset=onset))
        at += len(one.sizes)
    return tuple(found)
