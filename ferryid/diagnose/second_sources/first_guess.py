"""The axes, the unit and the coarse delay with which a signal follows the mapped one, before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from ferryid.diagnose.checks.spans import RATE_HZ
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.second_sources.explanations import NAMES
from ferryid.diagnose.second_sources.fit import VECTORS, Complex, Setting, complex_of, lever_of, source_of
from ferryid.diagnose.second_sources.pairs import Pair
from ferryid.diagnose.second_sources.thresholds import SECOND
from ferryid.types import Flags, Floats
from ferryid.vessel.units import KINDS

UNIT_KIND = {"position": "length", "velocity": "speed", "speed": "speed", "yaw_rate": "rate", "heading": "angle"}
_WORLD = {"position": (True,), "velocity": (False, True)}
_MIRRORED = {"position": (False, True), "velocity": (False, True)}


@dataclass(frozen=True)
class Guess:
    """How a signal follows the mapped one best.

    Attributes
    ----------
    setting
        Kind, axes and gain.
    late_s
        How late it is [s], to a fifth of a second.
    share
        What both have in common, of the variance.
    unit
        Name of the unit; empty where it is that of SI or not known.
    known
        True where the gain is that of a unit, to a tenth.
    """

    setting: Setting
    late_s: float
    share: float
    unit: str = ""
    known: bool = True


def first_guess(kind: str, pairs: Sequence[Pair]) -> Guess | None:
    """Return the axes, gain and delay with which a signal follows best; None where either of the two never changes."""
    found = []
    for world in _WORLD.get(kind, (False,)):
        for mirrored in _MIRRORED.get(kind, (False,)):
            setting = Setting(kind, world, mirrored)
            best = _best_delay(setting, pairs)
            if best is not None:
                found.append((setting, *best))
    if not found:
        return None
    top = max(share for _, share, _, _ in found)
    # Where motion on one course fits several frames, the quarter turn that is nearest decides.
    near = [one for one in found if one[1] >= top - SECOND.better_frame]
    setting, share, late_s, gain = min(near, key=lambda one: (abs(_off_quarter(one[3])), -one[1]))
    size, unit, known = _unit(abs(gain), UNIT_KIND[kind])
    quarter = round(float(np.angle(gain)) / (0.5 * np.pi))
    on_axes = abs(_off_quarter(gain)) < 2.0 * CHECKS.gross
    turn = (1j**quarter) if on_axes else np.exp(1j * np.angle(gain))
    gain = complex(size * turn)
    # The gain acts on the signal as recorded, before it is mirrored.
    setting = Setting(kind, setting.world, setting.mirrored, gain.conjugate() if setting.mirrored else gain)
    return Guess(setting, late_s, share, unit, known)


def axes_of(setting: Setting) -> str:
    """Return the directions of a vector's components as words, or how an angle turns."""
    if setting.kind not in _WORLD:
        return "" if setting.kind == "speed" or setting.gain.real > 0.0 else "anticlockwise, z up"
    ends = ("north", "south", "east", "west") if setting.world else ("forward", "aft", "starboard", "port")
    quarter = np.angle(setting.gain) / (0.5 * np.pi)
    if abs(quarter - round(float(quarter))) > 1e-6:
        turned = float(np.degrees(np.angle(setting.gain)))
        return f"axes turned by {turned:.0f} degrees{', mirrored' if setting.mirrored else ''}"
    # What is recorded when the vector points along the first axis, and along the second.
    along = [complex(value) for value in (1.0, 1j)]
    seen = [setting.gain / abs(setting.gain) * (value.conjugate() if setting.mirrored else value) for value in along]
    parts = []
    for part in ("real", "imag"):
        shares = [round(getattr(value, part)) for value in seen]
        axis = 0 if shares[0] else 1
        parts.append(ends[2 * axis + (0 if shares[axis] > 0 else 1)])
    return ", ".join(parts)


def _off_quarter(gain: complex) -> float:
    angle = float(np.angle(gain))
    return angle - 0.5 * np.pi * round(angle / (0.5 * np.pi))


def _unit(size: float, kind: str) -> tuple[float, str, bool]:
    """Return the factor, name and whether it is known, of the unit that makes a gain: also of one that was taken twice."""
    # Of an angle the unit is known.
    if abs(log(size)) < log(SECOND.no_unit_ratio) or kind == "angle":
        return 1.0, "", True
    options = [(1.0 / factor, name) for name, factor in KINDS[kind].items() if factor != 1.0]
    options += [(factor, f"1/{name}") for name, factor in KINDS[kind].items() if factor != 1.0]
    nearest = min(options, key=lambda one: abs(log(size / one[0])))
    if abs(log(size / nearest[0])) < log(SECOND.unit_ratio):
        return nearest[0], nearest[1], True
    return size, "", False


def nearest_unit(size: float, kind: str) -> str:
    """Return factor and name of the unit that a factor is near to, for a signal of a kind; empty where there is none."""
    value, name, _ = _unit(size, UNIT_KIND[kind])
    return "" if not name or name.startswith("1/") else f"{value:.4g} of {NAMES.get(name, name)}"


def _best_delay(setting: Setting, pairs: Sequence[Pair]) -> tuple[float, float, complex] | None:
    """Return common share, delay [s] and gain at the delay at which a signal follows the mapped one best.

    The gain of the place of the other sensor is solved for along with the signal's: ahead of the mapped one looks like early.
    """
    reach = round(SECOND.most_delay_s * RATE_HZ)
    averaged = [_averages(setting, pair) for pair in pairs]
    best: tuple[float, float, complex] | None = None
    for lag in range(-reach, reach + 1):
        normal, right, power, count = np.zeros((2, 2), dtype=np.complex128), np.zeros(2, dtype=np.complex128), 0.0, 0
        for signal, sources, known in averaged:
            n = len(signal) - abs(lag)
            if n <= 0:
                continue
            after, before = slice(max(lag, 0), max(lag, 0) + n), slice(max(-lag, 0), max(-lag, 0) + n)
            both = known[after] & known[before]
            if not both.any():
                continue
            z, M = signal[after][both], sources[before][both]
            z, M = z - z.mean(), M - M.mean(axis=0)
            normal += M.conj().T @ M
            right += M.conj().T @ z
            power += float(np.vdot(z, z).real)
            count += len(z)
        used = 2 if setting.kind in VECTORS and normal[1, 1].real > 0.0 else 1
        if power <= 0.0 or normal[0, 0].real <= 0.0 or count < SECOND.fewest_windows:
            continue
        gain = np.linalg.lstsq(normal[:used, :used], right[:used], rcond=None)[0]
        share = float(np.vdot(gain, right[:used]).real) / power
        if best is None or share > best[0] + 1e-9:
            best = (share, lag / RATE_HZ, complex(gain[0]))
    return best


def _averages(setting: Setting, pair: Pair) -> tuple[Complex, Complex, Flags]:
    """Return what is compared about every row, of the signal and of what it follows, shape (n,) and (n, 2), and where."""
    spans = pair.spans
    weight: Floats = -spans.slope if setting.rates else spans.weight
    signal = complex_of(pair.other)
    if setting.mirrored:
        signal = np.conj(signal)
    columns = [signal, source_of(setting, pair.mapped), lever_of(setting, pair.mapped)]
    m = len(weight)
    if len(signal) < m:
        return np.zeros(0, dtype=np.complex128), np.zeros((0, 2), dtype=np.complex128), np.zeros(0, dtype=np.bool_)
    made = [np.convolve(values - values[0], weight[::-1], mode="valid") * spans.step_s + 0j for values in columns]
    until = np.concatenate([[0], np.cumsum(pair.good)])
    known: Flags = np.asarray(until[m:] - until[:-m] == m)
    return made[0], np.column_stack(made[1:]), known
