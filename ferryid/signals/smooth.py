"""Smoothing and differentiation of the velocities, and the applied force smoothed alike."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.signals.kalman import fit_levels, smooth_runs
from ferryid.signals.quality import REFERENCE, require_excited
from ferryid.signals.thresholds import SIGNALS
from ferryid.signals.track import LeftOut, Motion, Track, segments
from ferryid.types import Flags, Floats
from ferryid.vessel import applied_force, speed_doubts
from ferryid.vessel.hull import current_in_body
from ferryid.vessel.profile import Profile

SMOOTHERS = ("square", "savgol", "kalman")
_POLYNOMIAL = 3
ON_FEW_ROWS = "% of the rows only and is left out"
"""What is told of a signal that is not used at all, as most of its rows lack it."""


@dataclass(frozen=True)
class Measured:
    """Unsmoothed motion and forces of one log: what smoothing needs, worked out once for many windows.

    Attributes are those of `Motion`; `usable` marks rows on which everything was measured.
    """

    log: str
    t: Floats
    rate_hz: float
    eta: Floats
    nu: Floats
    tau: Floats
    usable: Flags
    tau_d: Floats | None
    eta_d: Floats | None
    wind: Floats | None
    current: Floats | None
    payload: Floats | None
    repairs: tuple[str, ...]
    left_out: tuple[LeftOut, ...] = ()
    sway_measured: bool = True
    tau_steadied: Floats | None = None


def measure(track: Track, profile: Profile, *, steady_force: bool = False) -> Measured:
    """Return unsmoothed velocities and forces of a track; with `steady_force`, of one whose force never changes, too.

    Raises
    ------
    FerryIdError
        Where velocities or the applied force never change, and where a propeller turns far too fast.
    """
    columns, n = track.columns, track.t.size
    nothing = np.full(n, np.nan)
    nu = np.column_stack([columns[name] for name in ("u", "v", "r")])
    eta = np.column_stack([columns.get(name, nothing) for name in ("x", "y", "psi")])
    repairs = list(track.repairs)
    usable = track.valid.copy()
    wind, current = (
        _known(track, columns.get(f"{what}_N"), columns.get(f"{what}_E"), what, usable, repairs)
        for what in ("wind", "current")
    )
    payload = _payload(track, profile, usable, repairs)
    through_water = nu if current is None else nu - current_in_body(current, eta[:, 2])
    tau, notes = applied_force(profile, columns, through_water)
    repairs.extend((*notes, *speed_doubts(profile, columns)))
    tau_d = None
    if {"X_d", "Y_d", "N_d"} <= set(columns):
        tau_d = np.column_stack([columns[name] for name in ("X_d", "Y_d", "N_d")])
    eta_d = None
    if set(REFERENCE) & set(columns):
        eta_d = np.column_stack([columns.get(name, nothing) for name in REFERENCE])
    usable &= np.isfinite(nu).all(axis=1) & np.isfinite(tau).all(axis=1)
    if not usable.any():
        raise FerryIdError(
            f"{track.log}: no row has both velocity and applied force, found "
            f"{counted(int(np.count_nonzero(track.valid)), 'aligned row')}. Fix: check the actuator signals in the profile"
        )
    require_excited(track, nu, tau, sway_measured=profile.measures_sway, steady_force=steady_force)
    unknown = LeftOut.of(
        "wind, current or payload was not measured, or the force cannot be computed",
        track.valid & ~usable,
        track.rate_hz,
    )
    left_out = (*track.left_out, *unknown)
    return Measured(
        track.log,
        track.t,
        track.rate_hz,
        eta,
        nu,
        tau,
        usable,
        tau_d,
        eta_d,
        wind,
        current,
        payload,
        tuple(repairs),
        left_out,
        profile.measures_sway,
    )


def smooth_measured(measured: Measured, window_s: float, smoother: str = "square") -> Motion:
    """Smooth one log and differentiate its velocities.

    Position, velocity, applied and commanded force, wind and current all pass through the same zero-phase filter, so
    that force and motion stay comparable; the force is formed before, from unsmoothed actuator signals. A payload is not
    smoothed: it steps when somebody boards.

    Parameters
    ----------
    measured
        From `measure`.
    window_s
        Window [s]; 0 leaves the signals as they are.
    smoother
        ``"square"``: centred moving average over an odd number of rows, then the central difference, thesis (4.8).
        ``"savgol"``: local cubic over the window (at least 5 rows), and its slope. ``"kalman"``: fixed-interval
        smoother of a constant-acceleration model per axis, its noise found by maximum likelihood and its equivalent
        window kept at `window_s` or above, since the noise of a navigation filter is coloured and likelihood takes
        slow noise for motion.

    Returns
    -------
    Motion
        `valid` only where the whole window lies inside measured data.

    Raises
    ------
    FerryIdError
        For an unknown smoother, and for a window longer than every unbroken stretch.
    """
    if smoother not in SMOOTHERS:
        raise FerryIdError(
            f'settings: there is no smoother called "{smoother}".{did_you_mean(smoother, SMOOTHERS)} '
            f"Fix: choose one of {', '.join(SMOOTHERS)}"
        )
    measured = _with_heading_or_none(measured)
    rate = measured.rate_hz
    rows = odd_rows(window_s, rate)
    # Refused before any work, and again below where a smoother needs more than was asked for.
    _within(measured, rows // 2)
    parts = _columns(measured)
    stacked = np.hstack(list(parts.values()))
    if smoother == "square":
        smoothed = moving_mean(stacked, rows)
        nu_dot = central_difference(smoothed[:, :3], rate)
        # The difference reaches one row further than the average on both sides.
        half = rows // 2 + 1
        said = _told(smoother, rows, window_s, rate)
    elif smoother == "savgol":
        rows = max(rows, _POLYNOMIAL + 2)
        value, slope = local_polynomial(rows, _POLYNOMIAL)
        smoothed, nu_dot = correlate(stacked, value), correlate(stacked[:, :3], slope * rate)
        half = rows // 2
        said = _told(smoother, rows, window_s, rate)
    else:
        levels = fit_levels(measured.nu, segments(measured.usable), rate, window_s)
        axes = [axis for name in parts for axis in _AXIS_OF[name]]
        smoothed, nu_dot = smooth_runs(stacked, axes, levels, rate)
        half = max(1, round(max(level.window_s for level in levels) * rate / 2))
        said = "Smoothing: Kalman smoother, constant acceleration; " + ", ".join(
            f"{name} noise {level.noise:.2g} {unit}, equivalent window {level.window_s:.2g} s"
            for name, unit, level in zip(("surge", "sway", "yaw"), ("m/s", "m/s", "rad/s"), levels, strict=True)
        )
    valid = _within(measured, half)
    beside = LeftOut.of("the smoothing window meets such a row", _beside(measured.usable, valid), rate)
    ends = np.cumsum([part.shape[1] for part in parts.values()])[:-1]
    done = dict(zip(parts, np.hsplit(smoothed, ends), strict=True))
    return Motion(
        log=measured.log,
        t=measured.t,
        rate_hz=rate,
        eta=done["eta"],
        nu=done["nu"],
        nu_dot=nu_dot,
        tau=done["tau"],
        valid=valid,
        raw_nu=measured.nu,
        tau_d=done.get("tau_d"),
        eta_d=done.get("eta_d"),
        wind=done.get("wind"),
        current=done.get("current"),
        payload=measured.payload,
        repairs=(
            *measured.repairs,
            said,
            *(f"{counted(one.rows, 'row')} {verb(one.rows, 'is')} not used: {one.reason}." for one in beside),
        ),
        left_out=(*measured.left_out, *beside),
        sway_measured=measured.sway_measured,
        tau_steadied=done.get("tau_steadied"),
    )


def _with_heading_or_none(measured: Measured) -> Measured:
    """Return a log without what needs a heading where few rows have one; without any it is refused where it needs one."""
    known = np.isfinite(measured.eta[:, 2])
    share = float(np.mean(known[measured.usable])) if measured.usable.any() else 0.0
    if share >= SIGNALS.heading_share:
        return measured
    flows = [what for what in ("wind", "current") if getattr(measured, what) is not None]
    if not known.any():
        return measured
    told = f"The heading was measured on {100 * share:.0f} {ON_FEW_ROWS}"
    told += f", and {' and '.join(flows)} with it." if flows else "."
    eta = np.column_stack([measured.eta[:, :2], np.full(len(measured.eta), np.nan)])
    return replace(measured, eta=eta, wind=None, current=None, repairs=(*measured.repairs, told))


def odd_rows(window_s: float, rate_hz: float) -> int:
    """Return the odd number of rows nearest to a window; 1 for none."""
    return 2 * int(np.floor(window_s * rate_hz / 2)) + 1


def steady_mean(values: Floats, rows: int) -> Floats:
    """Return `moving_mean` with the ends carried on, so that no row is lost, shape (n, c)."""
    half = rows // 2
    padded = np.pad(values, ((half, half), (0, 0)), mode="edge")
    return np.ascontiguousarray(moving_mean(padded, rows)[half : half + len(values)])


def steady_cubic(values: Floats, rows: int) -> Floats:
    """Return the local cubic at every row, shape (n, c): quick motion passes it nearly whole, as a mean does not let it.

    At the ends the values are carried on turned about the last one, so that no row is lost and a slope goes on.

    Parameters
    ----------
    values
        Without NaN, shape (n, c).
    rows
        Odd number of samples in a window; below 5 a cubic passes through all of them, and nothing is changed.

    References
    ----------
    Savitzky and Golay (1964), Smoothing and differentiation of data by simplified least squares procedures.
    """
    half = min(rows // 2, len(values) - 1)
    if 2 * half + 1 < _POLYNOMIAL + 2:
        return values
    padded = np.pad(values, ((half, half), (0, 0)), mode="reflect", reflect_type="odd")
    weights, _ = local_polynomial(2 * half + 1, _POLYNOMIAL)
    return np.ascontiguousarray(correlate(padded, weights)[half : half + len(values)])


def moving_mean(values: Floats, rows: int) -> Floats:
    """Return the centred moving average, shape (n, c); NaN where the window leaves the data or meets a NaN.

    Each window is the tail of one block of `rows` samples and the head of the next, both summed within their block.
    Nothing is ever subtracted, so that no digits are lost however long the log or large the offset, and a NaN spoils
    only the windows that hold it.

    Parameters
    ----------
    values
        Shape (n, c). Not changed.
    rows
        Odd number of samples in a window.
    """
    n, c = values.shape
    result = np.full((c, n), np.nan)
    if n < rows:
        return result.T
    half, blocks = rows // 2, -(-n // rows)
    # One column at a time stays in the cache; samples of a block lie along the first axis, so that every sum runs over a
    # whole contiguous line of blocks.
    padded = np.zeros(blocks * rows)
    head, tail = np.empty((rows, blocks)), np.empty((rows, blocks))
    for k in range(c):
        padded[:n], padded[n:] = values[:, k], 0.0
        head[:] = padded.reshape(blocks, rows).T
        tail[:] = head
        for i in range(1, rows):
            head[i] += head[i - 1]
            tail[rows - 1 - i] += tail[rows - i]
        # A window that begins at sample j > 0 of a block ends at sample j - 1 of the next.
        tail[1:, :-1] += head[:-1, 1:]
        padded.reshape(blocks, rows)[:] = tail.T
        np.divide(padded[: n - 2 * half], rows, out=result[k, half : n - half])
    return result.T


def central_difference(values: Floats, rate_hz: float) -> Floats:
    """Return the slope between the rows before and after, shape (n, c); NaN in the first and last row."""
    slope = np.full_like(values, np.nan)
    slope[1:-1] = (values[2:] - values[:-2]) * (rate_hz / 2)
    return slope


def local_polynomial(rows: int, degree: int) -> tuple[Floats, Floats]:
    """Return weights for value and slope per row of a least-squares polynomial at its centre, shape (rows,) each.

    Savitzky and Golay (1964).
    """
    half = rows // 2
    # On (-1, 1) the powers stay well conditioned for any window.
    place = np.arange(-half, half + 1) / half
    fit = np.linalg.pinv(np.vander(place, degree + 1, increasing=True))
    return fit[0], fit[1] / half


def correlate(values: Floats, weights: Floats) -> Floats:
    """Return the weighted sums of the rows around each row, shape (n, c); NaN where they leave the data."""
    result = np.full_like(values, np.nan)
    half = weights.size // 2
    if len(values) >= weights.size:
        for i, column in enumerate(values.T):
            result[half : len(values) - half, i] = np.convolve(column, weights[::-1], "valid")
    return result


_AXIS_OF = {
    "nu": (0, 1, 2),
    "tau": (0, 1, 2),
    "tau_steadied": (0, 1, 2),
    "eta": (0, 1, 2),
    "tau_d": (0, 1, 2),
    "eta_d": (0, 1, 2),
    "wind": (0, 0),
    "current": (0, 0),
}
"""Which axis's smoother each column goes through; every equation of motion is then filtered as a whole."""


def _columns(measured: Measured) -> dict[str, Floats]:
    parts = {name: getattr(measured, name) for name in _AXIS_OF}
    return {name: part for name, part in parts.items() if part is not None}


def _told(smoother: str, rows: int, window_s: float, rate_hz: float) -> str:
    if rows == 1 and window_s > 0.0:
        return f"Smoothing: none, a window of {window_s:g} s holds one row at {rate_hz:g} Hz."
    if rows == 1:
        return "Smoothing: none (window 0)."
    said = f"Smoothing: {smoother} window of {counted(rows, 'row')}, {rows / rate_hz:.3g} s at {rate_hz:g} Hz"
    if abs(rows / rate_hz - window_s) > 1e-9:
        said += f" (asked for {window_s:g} s; the number of rows must be odd)"
    return said + "."


def _within(measured: Measured, half: int) -> Flags:
    """Return the rows with `half` usable rows on either side."""
    usable = measured.usable
    valid = np.zeros_like(usable)
    for stretch in segments(usable):
        valid[stretch.start + half : max(stretch.start + half, stretch.stop - half)] = True
    if not valid.any():
        longest = longest_stretch_s(measured)
        needed, whole = (2 * half + 1) / measured.rate_hz, len(usable) / measured.rate_hz
        if whole >= needed:
            raise FerryIdError(
                f"{measured.log}: no stretch in which all signals are measured is as long as the smoothing window, found "
                f"{longest:.2f} s unbroken of {whole:.2f} s where {needed:.2f} s are needed. Fix: see with ferryid inspect "
                "which signals are missing, and map others, or use a shorter --window"
            )
        raise FerryIdError(
            f"{measured.log}: log shorter than the smoothing window, found {longest:.2f} s unbroken where "
            f"{needed:.2f} s are needed. Fix: use a longer log or a shorter --window"
        )
    return valid


def _beside(usable: Flags, valid: Flags) -> Flags:
    """Return the usable rows that are lost beside others, and not only at the ends of the log."""
    beside = usable & ~valid
    rows = np.flatnonzero(valid)
    inner = segments(usable)
    first, last = int(rows[0]), int(rows[-1])
    if inner[0].start <= first < inner[0].stop:
        beside[:first] = False
    if inner[-1].start <= last < inner[-1].stop:
        beside[last + 1 :] = False
    return beside


def longest_stretch_s(measured: Measured) -> float:
    """Return the length of the longest unbroken stretch of a log [s]."""
    return float(max(stretch.stop - stretch.start for stretch in segments(measured.usable)) / measured.rate_hz)


def _payload(track: Track, profile: Profile, usable: Flags, repairs: list[str]) -> Floats | None:
    """Return the payload [kg] and its place [m], shape (n, 2), and tell its range; else like `_known`.

    Raises
    ------
    FerryIdError
        For a payload that the vessel cannot carry: a wrong unit, or the whole displacement.
    """
    mass, place = track.columns.get("payload_kg"), track.columns.get("payload_x")
    if mass is not None and place is not None:
        # Nothing has no place.
        place = np.where(mass == 0.0, np.nan_to_num(place), place)
    payload = _known(track, mass, place, "payload", usable, repairs)
    if payload is not None and usable.any():
        (least, aft), (most, fore) = payload[usable].min(axis=0), payload[usable].max(axis=0)
        hull_kg = profile.hull.mass_kg
        if least < SIGNALS.least_payload * hull_kg or most > SIGNALS.most_payload * hull_kg:
            raise FerryIdError(
                f"{track.log}: the payload cannot be right, found {least:.5g} to {most:.5g} kg on a vessel of "
                f"{hull_kg:.5g} kg. Fix: correct unit, sign or offset of signals.payload in the profile"
            )
        weight = f"{least:.0f} to {most:.0f} kg" if most > least else f"{most:.0f} kg"
        where = f"{aft:.2f} to {fore:.2f} m" if fore > aft else f"{fore:.2f} m"
        repairs.append(f"Payload: {weight} at x = {where}, which the model knows as mass.")
    return payload


def _known(
    track: Track, first: Floats | None, second: Floats | None, what: str, usable: Flags, repairs: list[str]
) -> Floats | None:
    """Return wind, current or payload, and take rows without it out of `usable`; None where there is (nearly) none."""
    if first is None or second is None:
        return None
    pair = np.column_stack([first, second])
    known: Flags = np.all(np.isfinite(pair), axis=1)
    share = float(np.mean(known[track.valid])) if track.valid.any() else 0.0
    if share < SIGNALS.weather_share:
        repairs.append(f"The {what} was measured on {100 * share:.0f} {ON_FEW_ROWS}.")
        return None
    lost = int(np.count_nonzero(usable & ~known))
    if lost:
        repairs.append(
            f"{counted(lost, 'row')} ({lost / track.rate_hz:.1f} s) {verb(lost, 'is')} not used: the {what} was not measured."
        )
    usable &= known
    return pair
