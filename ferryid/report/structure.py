"""What remains in a residual, and which minutes to look at: small computations that only figures need."""

from __future__ import annotations

import numpy as np

from ferryid.identify import LogFit
from ferryid.signals.track import Motion
from ferryid.types import AXES, Flags, Floats

POINTS = 900


def envelope(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Thin a series to at most `POINTS` bins, keeping the least and greatest of each so that no peak is lost."""
    if len(t) <= 2 * POINTS:
        return t, values
    # Bins of two sizes, the larger ones first.
    size, larger = divmod(len(t), POINTS)
    keep = []
    for start, bins, rows in ((0, larger, size + 1), (larger * (size + 1), POINTS - larger, size)):
        part = values[start : start + bins * rows].reshape(bins, rows)
        missing = ~np.isfinite(part)
        gap = missing.any(axis=1)
        # A bin that touches a gap keeps one missing point, so that the line breaks there.
        place = missing.argmax(axis=1)
        for extreme in (part.argmin(axis=1), part.argmax(axis=1)):
            keep.append(start + rows * np.arange(bins) + np.where(gap, place, extreme))
    kept = np.unique(np.concatenate(keep))
    return t[kept], values[kept]


def _stretch(log: LogFit, name: str, j: int) -> Floats:
    """Return the residual over the longest unbroken valid stretch of a log."""
    residual = log.motion.tau[:, j] - getattr(log, name)[:, j]
    good = log.motion.valid & np.isfinite(residual)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(np.int8)))
    if edges.size == 0:
        return np.empty(0)
    lengths = edges[1::2] - edges[::2]
    best = int(np.argmax(lengths))
    values: Floats = residual[edges[2 * best] : edges[2 * best + 1]]
    return values


def spectrum(log: LogFit, name: str, j: int) -> tuple[Floats, Floats]:
    """Return frequency [Hz] and Welch's one-sided power spectral density of a residual."""
    from matplotlib.mlab import psd  # scipy.signal takes a second to import

    values = _stretch(log, name, j)
    if values.size < 16:
        return np.empty(0), np.empty(0)
    rows = min(values.size, max(16, int(51.2 * log.motion.rate_hz)))
    hann = np.hanning(rows + 1)[:-1]
    density, frequency = psd(values, NFFT=rows, Fs=log.motion.rate_hz, window=hann, noverlap=rows // 2, detrend="mean")
    return np.asarray(frequency, dtype=np.float64), np.asarray(density, dtype=np.float64)


def autocorrelation(log: LogFit, name: str, j: int, longest_s: float = 30.0) -> tuple[Floats, Floats, int]:
    """Return lag [s], autocorrelation coefficient, and the number of samples."""
    values = _stretch(log, name, j)
    count = values.size
    lags = min(count // 3, int(longest_s * log.motion.rate_hz))
    if lags < 2:
        return np.empty(0), np.empty(0), count
    centred = values - values.mean()
    # Zeros behind it keep the lags apart, and a power of two is fast: a prime length takes ten times as long.
    power = np.abs(np.fft.rfft(centred, 1 << (count + lags - 1).bit_length())) ** 2
    covariance = np.fft.irfft(power)[: lags + 1]
    if covariance[0] <= 0:
        return np.empty(0), np.empty(0), count
    return np.arange(lags + 1) / log.motion.rate_hz, covariance / covariance[0], count


def worst_and_best_minute(log: LogFit, length_s: float = 60.0) -> tuple[float, float] | None:
    """Return the start times [s] of the minutes with the largest and smallest error of the new model.

    The error is the squared residual over the variance of the measured force, averaged over the axes; validation rows are
    preferred, and a minute counts when hardly a row of it is missing. None where those two overlap.
    """
    allowed = log.motion.valid & np.isfinite(log.motion.tau).all(axis=1) & np.isfinite(log.tau_model).all(axis=1)
    ordered = _minutes(log.motion, log.tau_model[None], allowed, log.validation & allowed, length_s)
    if ordered is None or abs(ordered[0] - ordered[-1]) < length_s:
        return None
    return float(ordered[-1]), float(ordered[0])


def worst_minute(motion: Motion, taus: Floats, rows: Flags, length_s: float = 60.0) -> float | None:
    """Return the start time [s] of the minute in which several models together err most; None where there is no whole one.

    `taus` are their estimates, shape (m, n, 3), and `rows` those that count, shape (n,).
    """
    ordered = _minutes(motion, taus, rows, rows, length_s)
    return None if ordered is None else float(ordered[-1])


def _minutes(motion: Motion, taus: Floats, allowed: Flags, preferred: Flags, length_s: float) -> Floats | None:
    """Return the start times [s] of whole minutes, the one with the least error first."""
    width = round(length_s * motion.rate_hz)
    if len(motion.t) < 2 * width:
        return None
    scale = np.var(motion.tau[allowed], axis=0)
    squares = ((motion.tau - taus) ** 2).mean(axis=0) / np.where(scale > 0, scale, 1.0)
    error = np.where(allowed[:, None], squares, 0.0)
    total = np.concatenate([[0.0], np.cumsum(error.mean(axis=1))])
    count = np.concatenate([[0], np.cumsum(allowed)])
    judged = np.concatenate([[0], np.cumsum(preferred)])
    starts = np.arange(0, len(motion.t) - width, max(1, width // 6))
    rows = count[starts + width] - count[starts]
    seen = judged[starts + width] - judged[starts]
    enough = (rows >= 0.98 * width) & ((seen >= 0.5 * width) if (seen >= 0.5 * width).any() else True)
    if not enough.any():
        return None
    mean = (total[starts + width] - total[starts]) / np.maximum(rows, 1)
    candidates = starts[enough]
    return np.asarray(motion.t[candidates[np.argsort(mean[enough], kind="stable")]])


SLOW_HZ = 0.05


def remainder(log: LogFit) -> list[str]:
    """Say of each axis how large the remaining residual is, how long it remembers, and how slow it is."""
    told = []
    for j, (axis, unit) in enumerate(zip(AXES, ("N", "N", "N·m"), strict=True)):
        values = _stretch(log, "tau_model", j)
        frequency, density = spectrum(log, "tau_model", j)
        lag, correlation, _ = autocorrelation(log, "tau_model", j)
        if frequency.size < 3 or lag.size == 0 or density.sum() <= 0:
            continue
        below = np.flatnonzero(correlation < np.exp(-1.0))
        memory = f"{lag[below[0]]:.1f} s" if below.size else f"more than {lag[-1]:.0f} s"
        slow = float(density[frequency < SLOW_HZ].sum() / density.sum())
        offset = float(values.mean())
        sentence = (
            f"{log.motion.log}, {axis}: {float(np.sqrt(np.mean(values**2))):.3g} {unit} rms remain (mean {offset:+.3g}), "
            f"with a memory of {memory}; {100.0 * slow:.0f} % of its power is slower than {1 / SLOW_HZ:.0f} s."
        )
        if slow > 0.5:
            sentence += " Noise is not that slow: a steady load such as wind or current, or a missing term, is left."
        told.append(sentence)
    return told
