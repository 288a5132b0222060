"""Whether what was found holds on data that it was not fitted to, and better there than what cannot be true.

The log is cut into contiguous blocks, dealt to folds in turn. For every fold the hypothesis, hull included, is fitted to the
windows of the other folds that stay a purge gap away, and judged on the windows of its own: so every window is judged once, by
a fit that has not seen it. Which effects were chosen, and when they begin, is known from the whole log.

Errors are judged in the weak form: ``M (a_picture - a_measured)`` averaged over a window, with the velocities' first derivative
moved onto the window's weight and the mass matrix of the plain picture, before and after alike. That is a force along the
vessel's axes, in N and N·m; no noisy signal was differentiated for it, and a refitted mass cannot shrink its own error. Where
positions were fitted, it is judged by velocities that the fit has not seen at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.hypothesis import Fit, Suspect, Trial, fit
from ferryid.diagnose.noise import ORDER
from ferryid.diagnose.weak import Windows
from ferryid.effects.picture import Picture, Scene, acceleration
from ferryid.vessel.profile import Floats

Ints = NDArray[np.int64]

FOLDS = 3
BLOCK_WINDOWS = 5.0
"""Length of a block in lengths of a window: 40 s for windows of 8 s, a manoeuvre or two."""
FEWEST_BLOCKS = 2 * FOLDS
GUARD = 0.25
"""Purged between training and held-out windows, in lengths of a window, so that slow disturbances are not shared either."""
DRAWS = 1000
SHIFTS = (0.29, 0.382, 0.5)
"""Shares of the log that a placebo is late by. About a third, and none a multiple of another: a trial that repeats itself
would make a single shift fit by accident."""
HEADING = "heading mirrored"
SAME = 1e-6
"""A placebo that differs less than this from its effect, as a share of it, is none."""


@dataclass(frozen=True)
class Folds:
    """Blocks of a log's windows and who is judged with whom.

    Attributes
    ----------
    block
        Block of every window, shape (J,).
    fold
        Fold of every window, shape (J,).
    training
        The windows to fit on, for every fold.
    """

    block: Ints
    fold: Ints
    training: tuple[Windows, ...]


@dataclass(frozen=True)
class HeldOut:
    """What a hypothesis leaves on windows it was not fitted to.

    Attributes
    ----------
    gaps
        On the channels that are fitted, shape (J, channels).
    errors
        As forces along the vessel's axes [N, N, N·m], shape (J, 3).
    fits
        One for every fold.
    """

    gaps: Floats
    errors: Floats
    fits: tuple[Fit, ...]


@dataclass(frozen=True)
class Improvement:
    """Held-out errors of two hypotheses.

    Attributes
    ----------
    before, after
        Force error of every window, shape (J, 3) [N, N, N·m].
    mse_before, mse_after
        Mean squares by axis, shape (3,) [N², N², N²m²].
    removed, low, high
        Fraction of the mean square that was removed, with its 95 % block-bootstrap interval, shape (3,).
    score, score_low, score_high
        Gain in log-likelihood of all channels under the noise of the better fit, with the same interval; positive where the
        second hypothesis predicts better.
    """

    before: Floats
    after: Floats
    mse_before: Floats
    mse_after: Floats
    removed: Floats
    low: Floats
    high: Floats
    score: float
    score_low: float
    score_high: float


@dataclass(frozen=True)
class Proof:
    """Held-out evidence for one suspect, beside all the others that were found.

    Attributes
    ----------
    suspect
        What is judged.
    improvement
        By adding it to the others.
    placebos
        Score of each placebo in its place.
    beaten
        Lower end of the 95 % interval of how much better its score is than that of the placebos: the least of the mirrored
        heading's and the median of the shifted ones'. Infinite where there is no placebo.
    holds
        True where it improves held-out data, and beyond its placebos.
    """

    suspect: Suspect
    improvement: Improvement
    placebos: Mapping[str, float]
    beaten: float
    holds: bool


@dataclass(frozen=True)
class FreeRuns:
    """Errors of held-out free runs, root mean square over all starts, at some horizons.

    Attributes
    ----------
    horizons_s
        Shape (h,).
    before, after
        Position [m], heading [rad], speed [m/s] and yaw rate [rad/s], shape (h, 4); NaN where the log has no position.
    removed, low, high
        Fraction of the error that was removed with its 95 % block-bootstrap interval, shape (h, 4).
    starts
        Number of runs.
    """

    horizons_s: Floats
    before: Floats
    after: Floats
    removed: Floats
    low: Floats
    high: Floats
    starts: int


@dataclass(frozen=True)
class Evidence:
    """All held-out evidence for a hypothesis: as a whole, for each of its suspects, and in free runs."""

    folds: Folds
    whole: Improvement
    proofs: tuple[Proof, ...]
    free_runs: FreeRuns


def evidence(trial: Trial, found: Fit) -> Evidence | None:
    """Return the held-out evidence for what was found; None for a log too short to hold anything out.

    Parameters
    ----------
    trial
        With the noise that the hypothesis leaves.
    found
        The hypothesis, fitted to the whole log.
    """
    folds = folds_of(trial.windows)
    if folds is None:
        return None
    base = held_out(trial, folds, ())
    full = held_out(trial, folds, found.suspects, found.values)
    proofs = tuple(_proof(trial, folds, found, full, base, index) for index in range(len(found.suspects)))
    return Evidence(
        folds,
        improvement(trial, folds, base, full),
        proofs,
        free_runs(trial, folds, base.fits, full.fits),
    )


def folds_of(windows: Windows) -> Folds | None:
    """Cut windows into blocks and deal them to folds; None where there are fewer than `FEWEST_BLOCKS`.

    A block lasts `BLOCK_WINDOWS` windows' lengths, less in a short log, and is never shorter than two.
    """
    if len(windows.starts) == 0:
        return None
    scene = windows.scene
    width_s = len(windows.weight) * scene.step_s
    stride_s = float(np.median(np.diff(windows.starts))) * scene.step_s if len(windows.starts) > 1 else width_s
    seconds = len(windows.starts) * stride_s
    number = round(seconds / (BLOCK_WINDOWS * width_s))
    if number < FEWEST_BLOCKS:
        number = FEWEST_BLOCKS
    if seconds / number < 2.0 * width_s:
        return None
    block = np.arange(len(windows.starts)) * number // len(windows.starts)
    fold = block % FOLDS
    purge = round(GUARD * len(windows.weight)) + len(windows.weight)
    training = []
    for k in range(FOLDS):
        held = np.sort(windows.starts[fold == k])
        place = np.searchsorted(held, windows.starts)
        after = np.abs(windows.starts - held[np.minimum(place, len(held) - 1)])
        before = np.abs(windows.starts - held[np.maximum(place - 1, 0)])
        training.append(subset(windows, (fold != k) & (np.minimum(after, before) >= purge)))
    if any(_learning(one) < 2 * ORDER for one in training):
        return None
    return Folds(block, fold, tuple(training))


def subset(windows: Windows, chosen: NDArray[np.bool_]) -> Windows:
    """Return some of the windows, shape (J,); a series is broken where one is left out."""
    runs, count = [], 0
    for first, end in windows.runs:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen[first:end], [False]]).astype(np.int8)))
        for a, b in edges.reshape(-1, 2):
            runs.append((count, count + int(b - a)))
            count += int(b - a)
    return replace(windows, starts=windows.starts[chosen], runs=tuple(runs), measured=windows.measured[chosen])


def held_out(trial: Trial, folds: Folds, suspects: Sequence[Suspect], start: Sequence[Floats] | None = None) -> HeldOut:
    """Return what a hypothesis leaves of the gaps of windows it was not fitted to.

    Parameters
    ----------
    trial
        Its noise weighs the windows, in all folds.
    folds
        From `folds_of`.
    suspects, start
        As in `ferryid.diagnose.hypothesis.fit`.
    """
    gaps = np.empty((len(trial.windows.starts), int(trial.windows.channels.sum())))
    errors = np.empty((len(trial.windows.starts), 3))
    fits = []
    for k, training in enumerate(folds.training):
        made = fit(_part(trial, training), suspects, start)
        fits.append(made)
        own = folds.fold == k
        judged, picture = subset(trial.windows, own), imagined(trial.plain, made)
        gaps[own] = judged.gap(picture)
        errors[own] = force_errors(judged, picture, trial.plain)
    return HeldOut(gaps, errors, tuple(fits))


def imagined(plain: Picture, made: Fit) -> Picture:
    """Return the picture that a fit has of the log."""
    picture = replace(plain, hull=made.hull)
    for suspect, values in zip(made.suspects, made.values, strict=True):
        picture = suspect.act(picture, values)
    return picture


def force_errors(windows: Windows, picture: Picture, plain: Picture) -> Floats:
    """Return a picture's force less the one that the velocities show [N, N, N·m], in every window, shape (J, 3)."""
    velocities = replace(windows, channels=np.repeat([False, True], 3))
    return np.asarray(velocities.gap(picture) @ mass_of(plain.hull).T)


def mass_of(hull: Floats) -> Floats:
    """Return the mass matrix of coefficients in the order of `COEFFICIENTS`, shape (3, 3)."""
    m11, m22, m23, m32, m33 = hull[:5]
    return np.array([[m11, 0.0, 0.0], [0.0, m22, m23], [0.0, m32, m33]])


def improvement(trial: Trial, folds: Folds, before: HeldOut, after: HeldOut) -> Improvement:
    """Return how much better the second of two hypotheses predicts."""
    picks = _draws(folds.block)
    sums = [_by_block(one.errors**2, folds.block) for one in (before, after)]
    removed = 1.0 - sums[1].sum(axis=0) / sums[0].sum(axis=0)
    drawn = 1.0 - (picks @ sums[1]) / (picks @ sums[0])
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    gains = _gains(trial, folds, before.gaps, after.gaps)
    score_low, score_high = np.quantile(picks @ gains, [0.025, 0.975])
    return Improvement(
        before.errors,
        after.errors,
        np.mean(before.errors**2, axis=0),
        np.mean(after.errors**2, axis=0),
        removed,
        low,
        high,
        float(gains.sum()),
        float(score_low),
        float(score_high),
    )


def placebos(trial: Trial, suspect: Suspect, values: Floats) -> dict[str, Suspect]:
    """Return what should explain as much as a suspect if only its shape counted and not when or where it acted.

    Its force late by shares of the log, and its force on a vessel that turned the other way (heading mirrored), if it depends
    on the heading at all. Each has the parameters of the suspect, to be fitted like it.
    """
    seconds = float(trial.windows.scene.t[-1] - trial.windows.scene.t[0])
    made = {f"{share * seconds:.0f} s late": _shifted(suspect, share) for share in SHIFTS}
    mirrored = _mirrored(suspect)
    true = suspect.act(trial.plain, values)
    wrong = mirrored.act(trial.plain, values)
    size = np.abs(acceleration(true) - acceleration(trial.plain)).max()
    if np.abs(acceleration(true) - acceleration(wrong)).max() > SAME * size:
        made[HEADING] = mirrored
    return made


def free_runs(trial: Trial, folds: Folds, before: Sequence[Fit], after: Sequence[Fit]) -> FreeRuns:
    """Integrate the pictures of two hypotheses from many starts in held-out blocks and compare them with the log.

    From its start a run knows the forces that the picture holds to act along the measured path, and integrates hull, load and
    flow from there with Heun's rule; a run stays in its block. Both hypotheses start alike, from the smoothed velocity.

    Parameters
    ----------
    trial, folds
        The log.
    before, after
        Fits for every fold.
    """
    windows, scene = trial.windows, trial.windows.scene
    width_s = len(windows.weight) * scene.step_s
    horizons = width_s * np.array([0.5, 1.0, 2.0, 4.0])
    stride = max(1, round(width_s / 40.0 / scene.step_s))
    steps = np.maximum(1, np.round(horizons / scene.step_s / stride).astype(int))
    starts, last, block = _starts(windows, folds, stride * int(steps[0]))
    horizons = steps * stride * scene.step_s
    errors = np.full((2, len(starts), len(steps), 4), np.nan)
    for k in range(FOLDS):
        own = np.flatnonzero(block % FOLDS == k)
        if own.size == 0:
            continue
        for which, fits in enumerate((before, after)):
            path = _run(imagined(trial.plain, fits[k]), starts[own], stride, int(steps[-1]))
            for h, count in enumerate(steps):
                rows = starts[own] + stride * int(count)
                inside = rows <= last[own]
                errors[which, own[inside], h] = _error(scene, rows[inside], path[int(count), inside])
    # A run that left the numbers behind counts for neither.
    bad = ~np.isfinite(errors[:, :, :, 1:]).all(axis=(0, 3))
    errors[:, bad] = np.nan
    return _judged(horizons, errors, block)


def _proof(trial: Trial, folds: Folds, found: Fit, full: HeldOut, base: HeldOut, index: int) -> Proof:
    suspect, values = found.suspects[index], found.values[index]
    others = [k for k in range(len(found.suspects)) if k != index]
    rest = [found.suspects[k] for k in others]
    start = [found.values[k] for k in others]
    without = held_out(trial, folds, rest, start) if rest else base
    made = improvement(trial, folds, without, full)
    gains = _gains(trial, folds, without.gaps, full.gaps)
    neutral = np.array([parameter.neutral for parameter in suspect.parameters])
    by_name = {}
    for name, placebo in placebos(trial, suspect, values).items():
        judged = held_out(trial, folds, [*rest, placebo], [*start, neutral])
        by_name[name] = _gains(trial, folds, without.gaps, judged.gaps)
    picks = _draws(folds.block)
    late = [one for name, one in by_name.items() if name != HEADING]
    rivals = [sorted(late, key=lambda one: float(one.sum()))[len(late) // 2]]
    rivals += [by_name[HEADING]] if HEADING in by_name else []
    beaten = min(float(np.quantile(picks @ (gains - rival), 0.025)) for rival in rivals)
    scores = {name: float(one.sum()) for name, one in by_name.items()}
    return Proof(suspect, made, scores, beaten, made.score_low > 0.0 and beaten > 0.0)


def _part(trial: Trial, windows: Windows) -> Trial:
    return Trial(windows, trial.plain, trial.noise, trial.hull_spread)


def _learning(windows: Windows) -> int:
    """Return how many windows are left to learn from when each series has started."""
    return sum(max(0, end - first - ORDER) for first, end in windows.runs)


def _gains(trial: Trial, folds: Folds, before: Floats, after: Floats) -> Floats:
    """Return the gain in log-likelihood of every block, shape (blocks,)."""
    runs, c = trial.windows.runs, before.shape[1]
    kept = np.concatenate([np.arange(a + ORDER, b) for a, b in runs if b - a > ORDER])
    left = [np.sum(trial.noise.white(gaps, runs).reshape(-1, c) ** 2, axis=1) for gaps in (before, after)]
    gained = np.zeros(len(folds.block))
    gained[kept] = 0.5 * (left[0] - left[1])
    return _by_block(gained[:, None], folds.block)[:, 0]


def _by_block(values: Floats, block: Ints) -> Floats:
    sums = np.zeros((int(block.max()) + 1, values.shape[1]))
    np.add.at(sums, block, values)
    return sums


def _draws(block: Ints) -> Floats:
    """Return how often each block is drawn, shape (DRAWS, blocks)."""
    number = int(block.max()) + 1
    drawn = np.random.default_rng(0).integers(0, number, size=(DRAWS, number))
    counts = np.zeros((DRAWS, number))
    np.add.at(counts, (np.arange(DRAWS)[:, None], drawn), 1.0)
    return counts


def _shifted(suspect: Suspect, share: float) -> Suspect:
    def apply(picture: Picture, p: Floats, instance: str | None) -> Picture:
        force = _force_of(suspect, picture, p)
        late = np.roll(force, round(share * len(force)), axis=0)
        return replace(picture, external=picture.external + late)

    return replace(suspect, effect=replace(suspect.effect, apply=apply), onset_s=0.0)


def _mirrored(suspect: Suspect) -> Suspect:
    def apply(picture: Picture, p: Floats, instance: str | None) -> Picture:
        scene = picture.scene
        eta = np.column_stack([scene.eta[:, :2], -scene.psi])
        force = _force_of(suspect, replace(picture, scene=replace(scene, eta=eta)), p)
        return replace(picture, external=picture.external + force)

    return replace(suspect, effect=replace(suspect.effect, apply=apply), onset_s=0.0)


def _force_of(suspect: Suspect, picture: Picture, p: Floats) -> Floats:
    """Return what an effect changes, as a force [N, N, N·m], shape (n, 3)."""
    more = acceleration(suspect.act(picture, p)) - acceleration(picture)
    return np.asarray(more @ mass_of(picture.hull).T)


def _starts(windows: Windows, folds: Folds, shortest: int) -> tuple[Ints, Ints, Ints]:
    """Return first and last possible row of each run, and its block: one run every window's length."""
    starts, last, block = [], [], []
    for first, end in windows.runs:
        for k in np.unique(folds.block[first:end]):
            rows = windows.starts[first:end][folds.block[first:end] == k]
            final = int(rows[-1]) + len(windows.weight) - 1
            for row in range(int(rows[0]), final - shortest + 1, len(windows.weight)):
                starts.append(row)
                last.append(final)
                block.append(int(k))
    return np.array(starts, dtype=np.int64), np.array(last, dtype=np.int64), np.array(block, dtype=np.int64)


def _run(picture: Picture, starts: Ints, stride: int, steps: int) -> Floats:
    """Return states of all runs, shape (steps + 1, starts, 6)."""
    scene = picture.scene
    end, dt = len(scene.t) - 1, stride * scene.step_s
    state = np.hstack([np.nan_to_num(scene.eta[starts]), scene.nu[starts]])
    path = np.empty((steps + 1, len(starts), 6))
    path[0] = state
    rate = _rates(picture, np.minimum(starts, end), state)
    for k in range(steps):
        following = np.minimum(starts + (k + 1) * stride, end)
        after = _rates(picture, following, state + dt * rate)
        state = state + 0.5 * dt * (rate + after)
        # What diverges is stopped, and left out where errors are judged.
        state = np.where(np.abs(state) < 1e6, state, np.nan)
        path[k + 1] = state
        rate = _rates(picture, following, state)
    return path


def _rates(picture: Picture, rows: Ints, state: Floats) -> Floats:
    """Return the derivative of states, shape (s, 6), with the forces of some rows."""
    nu, psi = state[:, 3:], state[:, 2]
    now: Scene = replace(picture.scene, t=picture.scene.t[rows], eta=state[:, :3], nu=nu, nu_raw=nu)
    at = replace(
        picture,
        scene=now,
        parts=picture.parts[rows],
        external=picture.external[rows],
        flow=None if picture.flow is None else picture.flow[rows],
        load=None if picture.load is None else picture.load[rows],
        damping_factor=None if picture.damping_factor is None else picture.damping_factor[rows],
    )
    c, s = np.cos(psi), np.sin(psi)
    velocity = np.column_stack([c * nu[:, 0] - s * nu[:, 1], s * nu[:, 0] + c * nu[:, 1], nu[:, 2]])
    return np.hstack([velocity, acceleration(at)])


def _error(scene: Scene, rows: Ints, state: Floats) -> Floats:
    """Return errors of position, heading, speed and yaw rate, shape (s, 4)."""
    away = state[:, :2] - scene.eta[rows, :2]
    turned = np.abs(state[:, 2] - scene.psi[rows])
    slip = state[:, 3:] - scene.nu[rows]
    return np.column_stack(
        [np.hypot(away[:, 0], away[:, 1]), turned, np.hypot(slip[:, 0], slip[:, 1]), np.abs(slip[:, 2])]
    )


def _judged(horizons: Floats, errors: Floats, block: Ints) -> FreeRuns:
    """Return root mean squares over runs and their bootstrap over blocks, from errors of shape (2, starts, h, 4)."""
    shape = errors.shape[2:]
    known = np.isfinite(errors).all(axis=0)
    flat = [np.where(known, one, 0.0).reshape(len(block), -1) for one in errors]
    count = known.reshape(len(block), -1).astype(np.float64)
    total = np.maximum(count.sum(axis=0), 1.0)
    seen = count.sum(axis=0) > 0
    before, after = (np.where(seen, np.sqrt((one**2).sum(axis=0) / total), np.nan).reshape(shape) for one in flat)
    picks = _draws(block)
    sums = [picks @ _by_block(one**2, block) for one in flat]
    ratio = np.sqrt(sums[1] / np.where(sums[0] > 0.0, sums[0], np.nan))
    low, high = np.full(ratio.shape[1], np.nan), np.full(ratio.shape[1], np.nan)
    low[seen], high[seen] = np.nanquantile(1.0 - ratio[:, seen], [0.025, 0.975], axis=0)
    removed = 1.0 - after / before
    return FreeRuns(horizons, before, after, removed, low.reshape(shape), high.reshape(shape), len(block))
